//! `etendue compare`: whether images agree, by metrics, by seeds or against a reference of known variance.

mod known;
mod sides;
mod two;

use std::path::{Path, PathBuf};

use clap::Args;
use etendue::compare::map::{Map, Scale, robust_top};
use etendue::compare::metric::Metric;
use etendue::compare::pair;
use etendue::compare::{Crop, Layer, Selection, flip, signed};
use etendue::error::{Error, Result};
use etendue::image::{self, Encoding, Image};
use etendue::sensor::Window;
use serde_json::{Value, json};

use super::memory::MemoryArguments;
use super::page::{self, Page, Pair, Scene};
use super::{output, parse, report, status};

/// Find out whether images agree
///
/// Two images are measured with every metric, A being the reference. They agree if they are equal or, where
/// limits are given, if they keep within them. Metrics cannot tell noise from error: for renders give
/// several seeds a side (--a, --b), and a statistical test tells, or one image and a reference of known
/// variance (--reference, --variance).
#[derive(Args, Debug)]
#[command(after_help = HELP, after_long_help = LONG_HELP)]
pub(super) struct Arguments {
    /// Two images, the reference first (EXR, HDR, PFM, TIFF, PNG, JPEG, BMP, TGA, PPM); with --reference only one
    #[arg(value_name = "IMAGE", num_args = 1..=2, required_unless_present = "a", conflicts_with = "a")]
    images: Vec<PathBuf>,
    /// Compare the channels NAME.* or the one channel NAME, not the main colour
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Compare a window of pixels
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", value_parser = parse::crop)]
    crop: Option<Window>,

    /// Differ only if the metric is above the value; may be given several times
    #[arg(long, value_name = "METRIC=VALUE", value_parser = limit, conflicts_with = "a", help_heading = PAIR)]
    fail_above: Vec<Limit>,
    /// Differ only if the metric (psnr, ssim) is below the value; may be given several times
    #[arg(long, value_name = "METRIC=VALUE", value_parser = limit, conflicts_with = "a", help_heading = PAIR)]
    fail_below: Vec<Limit>,
    /// The greatest value meant to occur: PSNR's peak, SSIM's range
    #[arg(long, value_name = "VALUE", default_value_t = 1.0, value_parser = parse::positive, help_heading = PAIR)]
    peak: f64,
    /// Pixels in a degree of the visual field, for FLIP
    #[arg(long, value_name = "N", default_value_t = flip::PIXELS_PER_DEGREE,
        value_parser = pixels_per_degree, help_heading = PAIR)]
    ppd: f32,

    /// Side A: renders of one scene with different seeds, at least two
    #[arg(long, value_name = "IMAGE", num_args = 1.., requires = "b", help_heading = SEEDS)]
    a: Vec<PathBuf>,
    /// Side B
    #[arg(long, value_name = "IMAGE", num_args = 1.., requires = "a", help_heading = SEEDS)]
    b: Vec<PathBuf>,
    /// The probability that two sides of one image are found to agree
    #[arg(long, value_name = "P", default_value_t = 0.99, value_parser = probability, help_heading = SEEDS)]
    confidence: f64,
    /// Refuse to compare (status 2) where a relative difference of the mean below this could hide in noise
    #[arg(long, value_name = "PART", value_parser = parse::positive, requires = "a", help_heading = SEEDS)]
    precision: Option<f64>,

    /// The reference's mean
    #[arg(long, value_name = "IMAGE", requires_all = ["variance", "spp"], conflicts_with_all = ["a", "fail_above", "fail_below"], help_heading = KNOWN)]
    reference: Option<PathBuf>,
    /// The variance of one of its samples a pixel
    #[arg(long, value_name = "IMAGE", requires = "reference", help_heading = KNOWN)]
    variance: Option<PathBuf>,
    /// Samples a pixel of the image
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), requires = "reference", help_heading = KNOWN)]
    spp: Option<u32>,
    /// Samples a pixel of the reference
    #[arg(long, value_name = "N", default_value_t = 32_000, value_parser = clap::value_parser!(u32).range(1..), help_heading = KNOWN)]
    reference_spp: u32,

    /// Draw where they differ, with a legend, as PNG: FLIP (of colours) or |b − a|, |t| between seeds, |z|
    /// against a reference
    #[arg(long, value_name = "PNG", help_heading = TELL)]
    map: Option<PathBuf>,
    /// What the map of two images shows, and that of the page
    #[arg(long, value_enum, conflicts_with_all = ["a", "reference"], help_heading = TELL)]
    map_of: Option<MapOf>,
    /// Draw where B is brighter than A (red) and where darker (blue), as PNG: (b − a) / (|a| + 1 % of its mean), by the
    /// luminance of colours, by that of other channels which differs most
    #[arg(long, value_name = "PNG", help_heading = TELL)]
    signed_map: Option<PathBuf>,
    /// Write DIR/index.html, a page that needs no network: both images beside each other and in turns, both maps, and
    /// what is found in words
    #[arg(long, value_name = "DIR", help_heading = TELL)]
    report: Option<PathBuf>,
    #[command(flatten)]
    memory: MemoryArguments,
    /// Print a JSON object
    #[arg(long, help_heading = TELL)]
    json: bool,
    /// Print nothing but what is wrong
    #[arg(short, long, help_heading = TELL)]
    quiet: bool,
}

const PAIR: &str = "Two images";
const SEEDS: &str = "Several seeds a side";
const KNOWN: &str = "A reference of known variance";
const TELL: &str = "What is told";

const HELP: &str = "Exit status: 0 the images agree; 1 they differ; 2 they cannot be compared, or the command \
line is wrong.";

const LONG_HELP: &str = "\
Metrics, d = b - a, over all pixels and channels:
  bias      greatest |mean d| of a channel      mape      mean |d| / (|a| + 0.01)
  max       greatest |d|                        smape     mean 2|d| / (|a| + |b| + 0.01)
  mae       mean |d|                            psnr      10 log10(peak^2 / mse)
  mse       mean d^2                            ssim      scikit-image's, 7 x 7 windows
  rmse      square root of mse                  flip_ldr  mean FLIP of what a screen shows
  relmse    mean d^2 / (a^2 + 0.01)             flip_hdr  mean FLIP over exposures
Values of EXR and HDR are taken as they are, those of PNG as codes from 0 to 1; of one beside the \
other the linear ones are encoded. NaN and infinite values cannot be compared; the message counts them.

Between seeds, Welch's test holds the means of the image, of tiles of 16 x 16 pixels and of single \
pixels against each other, with correction for the number of tests. The errors are those between \
seeds, never those of pixels: a filter that splats samples into several pixels makes neighbours vary \
together.

Examples:
  etendue compare reference.exr image.exr --fail-above relmse=0.01 --map map.png
  etendue compare reference.exr image.exr --report page && xdg-open page/index.html
  etendue compare image.exr other.exr --layer albedo --crop 0,0,64,64 --json
  etendue compare --a a1.exr a2.exr a3.exr a4.exr --b b1.exr b2.exr b3.exr b4.exr
  etendue compare image.exr --reference mean.exr --variance variance.exr --spp 256

Exit status: 0 the images agree; 1 they differ; 2 they cannot be compared, or the command line is wrong.";

/// What a map of two images shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum MapOf {
    /// FLIP, over exposures where values are linear
    Flip,
    /// |b - a|, the greatest over channels
    Difference,
    /// |b - a| / (|a| + 0.01), the greatest over channels
    Relative,
}

/// A bound on a metric.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Limit {
    metric: Metric,
    value: f64,
}

fn limit(text: &str) -> std::result::Result<Limit, String> {
    let (name, value) = text
        .split_once('=')
        .ok_or("write it as METRIC=VALUE, such as relmse=0.01")?;
    let metric = Metric::of_name(name).ok_or_else(|| {
        let names: Vec<&str> = Metric::ALL.iter().map(|m| m.name()).collect();
        format!(
            "there is no metric {name:?}; there are {}",
            names.join(", ")
        )
    })?;
    let value: f64 = value
        .parse()
        .map_err(|_| format!("{value:?} is not a number"))?;
    if value.is_nan() {
        return Err("nothing is above or below NaN".to_owned());
    }
    Ok(Limit { metric, value })
}

fn pixels_per_degree(text: &str) -> std::result::Result<f32, String> {
    let number = parse::positive(text)? as f32;
    if number > 0.0 && number.is_finite() {
        Ok(number)
    } else {
        Err(format!("{text} is out of all bounds"))
    }
}

fn probability(text: &str) -> std::result::Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "write a number")?;
    if value > 0.0 && value < 1.0 {
        Ok(value)
    } else {
        Err("it must lie between 0 and 1".to_owned())
    }
}

/// What a comparison comes to.
struct Outcome {
    agrees: bool,
    /// In words.
    sentence: String,
    /// Lines for people.
    lines: Vec<String>,
    /// What a page says, with labels.
    rows: Vec<(String, String)>,
    /// For programs.
    object: Value,
    /// What was compared, where it is to be looked at.
    difference: Option<Difference>,
}

/// Two images, the reference first, and where they differ.
struct Difference {
    images: [Image; 2],
    /// What they are called in words, and their files.
    sides: [(&'static str, String); 2],
    encoding: Encoding,
    /// The channels that are red, green and blue, if they are colours.
    rgb: Option<[usize; 3]>,
    /// How far apart they are, row by row, if somebody wants to see it, and what that is.
    distance: Vec<f32>,
    label: &'static str,
    /// The distance that takes the last colour.
    top: f32,
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let outcome = match compare(arguments) {
        Ok(outcome) => outcome,
        Err(error) => {
            if arguments.json {
                let problems = report::json(error.problems());
                output::object(json!({ "verdict": "cannot compare", "problems": problems }));
            } else {
                report::error(&error);
            }
            return Ok(status::CANNOT_COMPARE);
        }
    };
    if arguments.json {
        let mut object = outcome.object;
        object["verdict"] = verdict(outcome.agrees).into();
        object["sentence"] = outcome.sentence.into();
        output::object(object);
    } else if !arguments.quiet {
        outcome.lines.iter().for_each(|line| output::line(line));
        output::line(&outcome.sentence);
    }
    Ok(if outcome.agrees {
        status::DONE
    } else {
        status::DIFFERS
    })
}

fn compare(arguments: &Arguments) -> Result<Outcome> {
    for map in [&arguments.map, &arguments.signed_map]
        .into_iter()
        .flatten()
    {
        image::check_writable(map)?;
    }
    if let Some(folder) = &arguments.report {
        page::check_writable(folder)?;
    }
    if arguments.map_of.is_some() && arguments.map.is_none() && arguments.report.is_none() {
        return Err(
            Error::input("--map-of says what a map shows, and there is none")
                .help("give --map too, or --report"),
        );
    }
    let outcome = compared(arguments)?;
    if let Some(difference) = &outcome.difference {
        arguments.show(difference, &outcome)?;
    }
    Ok(outcome)
}

fn compared(arguments: &Arguments) -> Result<Outcome> {
    match (&arguments.reference, &arguments.images[..]) {
        (Some(reference), [image]) => known::against_reference(arguments, image, reference),
        (None, [a, b]) => two::two(arguments, a, b),
        (None, []) => sides::sides(arguments),
        (Some(_), _) => Err(Error::input("one image is held against a reference")),
        (None, _) => Err(
            Error::input("there is one image, and nothing to hold it against")
                .help("give two images, or --reference, --variance and --spp"),
        ),
    }
}

impl Arguments {
    fn selection(&self) -> Selection {
        Selection {
            layer: self.layer.clone(),
            crop: self.crop.map(
                |Window {
                     x,
                     y,
                     width,
                     height,
                 }| Crop {
                    x,
                    y,
                    width,
                    height,
                },
            ),
        }
    }

    /// Whether anybody wants to see where images differ.
    fn shows(&self) -> bool {
        self.shows_distance() || self.signed_map.is_some()
    }

    /// Whether anybody wants to see how far images are apart.
    fn shows_distance(&self) -> bool {
        self.map.is_some() || self.report.is_some()
    }

    /// Draws the maps and writes the page that are asked for.
    fn show(&self, difference: &Difference, outcome: &Outcome) -> Result<()> {
        let Difference {
            images: [a, b],
            rgb,
            distance,
            label,
            top,
            ..
        } = difference;
        let map = Map {
            width: a.width() as usize,
            values: distance,
            label,
            top: *top,
            scale: Scale::FromZero,
        };
        if let Some(path) = &self.map {
            image::write_codes(path, &map.draw()?, image::Tag::Srgb)?;
        }
        if self.signed_map.is_none() && self.report.is_none() {
            return Ok(());
        }
        let brighter = signed::relative(a, b, *rgb)?;
        if let Some(path) = &self.signed_map {
            let map = Map {
                values: &brighter,
                label: "(b - a) / a",
                top: robust_top(&brighter),
                scale: Scale::AboutZero,
                ..map
            };
            image::write_codes(path, &map.draw()?, image::Tag::Srgb)?;
        }
        match &self.report {
            Some(folder) => difference.page(outcome, &brighter, folder),
            None => Ok(()),
        }
    }
}

impl Difference {
    /// Writes the page.
    fn page(&self, outcome: &Outcome, brighter: &[f32], folder: &Path) -> Result<()> {
        let [a, b] = &self.sides;
        let mut lines = vec![("verdict".to_owned(), outcome.sentence.clone())];
        lines.extend([a, b].map(|(side, files)| ((*side).to_owned(), files.clone())));
        lines.extend(outcome.rows.iter().cloned());
        let scene = Scene {
            name: &format!("{} and {}", a.1, b.1),
            status: verdict(outcome.agrees),
            lines,
            pair: Some(Pair {
                reference: &self.images[0],
                other: &self.images[1],
                encoding: self.encoding,
                rgb: self.rgb,
                distance: &self.distance,
                label: self.label,
                top: self.top,
                brighter,
            }),
        };
        let page = Page {
            title: "Images compared",
            sides: [a.0, b.0],
            scenes: vec![scene],
        };
        page.write(folder)
    }
}

/// In a word.
fn verdict(agrees: bool) -> &'static str {
    if agrees { "agree" } else { "differ" }
}

/// The brightest |t| and |z| on a map: chance alone rarely reaches it.
const T_TOP: f32 = 6.0;

/// What is compared, for people.
fn head(layer: &Layer, paths: &[(&Path, &str)]) -> Vec<String> {
    let mut lines: Vec<String> = paths
        .iter()
        .map(|(path, side)| format!("{side:2} {}", path.display()))
        .collect();
    let image = &layer.image;
    let mut what = format!(
        "   {} × {} pixels; {}; {}",
        image.width(),
        image.height(),
        image.channels().join(", "),
        pair::kind_of_values(layer.encoding)
    );
    if !layer.others.is_empty() {
        what += &format!("; not compared: {}", layer.others.join(", "));
    }
    lines.push(what);
    lines
}
