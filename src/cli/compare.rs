//! `etendue compare`: whether images agree, by metrics, by seeds or against a reference of known variance.

use std::path::{Path, PathBuf};

use clap::Args;
use etendue::compare::map::{self, Map};
use etendue::compare::metric::Metric;
use etendue::compare::pair::{self, Report};
use etendue::compare::seeds::{self, Side, Verdict};
use etendue::compare::ztest::{self, Reference};
use etendue::compare::{Crop, Layer, Selection, flip};
use etendue::error::{Error, Location, Result};
use etendue::image;
use etendue::sensor::Window;
use serde_json::{Value, json};

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
    /// Two images, the reference first (EXR, HDR, PNG, JPEG, BMP, TGA); with --reference only one
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
    #[arg(long, value_name = "VALUE", default_value_t = 1.0, value_parser = positive, help_heading = PAIR)]
    peak: f64,
    /// Pixels in a degree of the visual field, for FLIP
    #[arg(long, value_name = "N", default_value_t = f64::from(flip::PIXELS_PER_DEGREE), value_parser = positive, help_heading = PAIR)]
    ppd: f64,

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
    #[arg(long, value_name = "PART", value_parser = positive, requires = "a", help_heading = SEEDS)]
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
    /// What the map of two images shows
    #[arg(long, value_enum, requires = "map", conflicts_with_all = ["a", "reference"], help_heading = TELL)]
    map_of: Option<MapOf>,
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
Values of EXR and HDR are taken as they are, those of PNG as codes from 0 to 1; of one beside the other the
linear ones are encoded. NaN and infinite values cannot be compared; the message counts them.

Between seeds, Welch's test holds the means of the image, of tiles of 16 x 16 pixels and of single pixels
against each other. The errors are those between seeds, never those of pixels: a filter that splats samples
into several pixels makes neighbours vary together.

Examples:
  etendue compare reference.exr image.exr --fail-above relmse=0.01 --map map.png
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

fn positive(text: &str) -> std::result::Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "write a number")?;
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err("it must be positive".to_owned())
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
    /// For programs.
    object: Value,
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let outcome = match compare(arguments) {
        Ok(outcome) => outcome,
        Err(error) => {
            if arguments.json {
                let problems = report::json(error.problems());
                output::line(
                    &json!({ "verdict": "cannot compare", "problems": problems }).to_string(),
                );
            } else {
                report::error(&error);
            }
            return Ok(status::CANNOT_COMPARE);
        }
    };
    if arguments.json {
        let mut object = outcome.object;
        object["verdict"] = if outcome.agrees { "agree" } else { "differ" }.into();
        object["sentence"] = outcome.sentence.into();
        output::line(&object.to_string());
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
    if let Some(map) = &arguments.map {
        image::check_writable(map)?;
    }
    match (&arguments.reference, &arguments.images[..]) {
        (Some(reference), [image]) => against_reference(arguments, image, reference),
        (None, [a, b]) => two(arguments, a, b),
        (None, []) => sides(arguments),
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

    fn draw(&self, layer: &Layer, values: &[f32], label: &str, top: f32) -> Result<()> {
        let Some(path) = &self.map else {
            return Ok(());
        };
        let width = layer.image.width() as usize;
        let map = Map {
            width,
            values,
            label,
            top,
        };
        image::write_codes(path, &map.draw()?)
    }
}

fn two(arguments: &Arguments, path_a: &Path, path_b: &Path) -> Result<Outcome> {
    let selection = arguments.selection();
    let (mut a, mut b) = (
        Layer::read(path_a, &selection)?,
        Layer::read(path_b, &selection)?,
    );
    Layer::align(&mut a, &mut b)?;
    for (layer, path) in [(&a, path_a), (&b, path_b)] {
        pair::check_finite(layer, "it").map_err(|e| e.at(&Location::of_file(path)))?;
    }
    let options = pair::Options {
        peak: arguments.peak,
        pixels_per_degree: arguments.ppd as f32,
    };
    let report = pair::measure(&a, &b, &options)?;
    let (agrees, sentence) = judge(arguments, &report)?;
    if arguments.map.is_some() {
        draw_pair(arguments, &a, &b)?;
    }
    let mut object = serde_json::to_value(&report).expect("it has only names and numbers");
    object["a"] = path_a.display().to_string().into();
    object["b"] = path_b.display().to_string().into();
    object["values"] = pair::kind_of_values(a.encoding).into();
    object["not_compared"] = json!({ "a": a.others, "b": b.others });
    let mut lines = head(&a, &[(path_a, "A"), (path_b, "B")]);
    lines.extend(table(&report));
    Ok(Outcome {
        agrees,
        sentence,
        lines,
        object,
    })
}

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

fn table(report: &Report) -> Vec<String> {
    let means = report.channels.iter().map(|c| {
        format!(
            "  {:10} {:12.6} {:12.6} {:+12.4e}",
            c.channel, c.a, c.b, c.bias
        )
    });
    let mut lines = vec![format!(
        "  {:10} {:>12} {:>12} {:>12}",
        "channel", "mean a", "mean b", "bias"
    )];
    lines.extend(means);
    lines.push(String::new());
    for figure in &report.metrics {
        let value = match &figure.value {
            Ok(value) if value.is_infinite() => "∞".to_owned(),
            Ok(value) if *value == 0.0 || (1e-3..1e6).contains(&value.abs()) => {
                format!("{value:.6}")
            }
            Ok(value) => format!("{value:.5e}"),
            Err(why) => format!("none: {why}"),
        };
        let metric = figure.metric;
        lines.push(format!(
            "  {:10} {value:>12}   {}",
            metric.name(),
            metric.description()
        ));
    }
    lines
}

/// Whether a pair keeps within the limits or, without any, is equal; and that in words.
fn judge(arguments: &Arguments, report: &Report) -> Result<(bool, String)> {
    let above = arguments.fail_above.iter().map(|l| (l, true));
    let below = arguments.fail_below.iter().map(|l| (l, false));
    let limits: Vec<(&Limit, bool)> = above.chain(below).collect();
    if limits.is_empty() {
        let Some(worst) = &report.worst else {
            return Ok((true, "A and B are equal".to_owned()));
        };
        let [width, height] = report.size.map(u64::from);
        let sentence = format!(
            "A and B differ in {} of {} pixels, most at {}, {} in {} ({} and {})",
            report.differing_pixels,
            width * height,
            worst.x,
            worst.y,
            worst.channel,
            worst.a,
            worst.b
        );
        return Ok((false, sentence));
    }
    let mut failed = Vec::new();
    let mut kept = Vec::new();
    for (limit, is_above) in limits {
        let name = limit.metric.name();
        if is_above == limit.metric.is_similarity() {
            let right = if is_above {
                "--fail-below"
            } else {
                "--fail-above"
            };
            let better = if is_above { "more" } else { "less" };
            return Err(Error::input(format!("{better} {name} is better"))
                .help(format!("use {right} {name}={}", limit.value)));
        }
        let value = report.value(limit.metric)?;
        let fails = if is_above {
            value > limit.value
        } else {
            value < limit.value
        };
        let side = if fails == is_above { "above" } else { "below" };
        let text = format!("{name} {value:.6} {side} {}", limit.value);
        if fails { &mut failed } else { &mut kept }.push(text);
    }
    Ok(if failed.is_empty() {
        (true, format!("A and B agree: {}", kept.join(", ")))
    } else {
        (false, format!("A and B differ: {}", failed.join(", ")))
    })
}

fn draw_pair(arguments: &Arguments, a: &Layer, b: &Layer) -> Result<()> {
    let is_color = a.rgb.is_some();
    let of = arguments.map_of.unwrap_or(if is_color {
        MapOf::Flip
    } else {
        MapOf::Difference
    });
    let greatest = |term: fn(f32, f32) -> f32| -> Vec<f32> {
        let count = a.image.channels().len();
        let pixels = a
            .image
            .data()
            .chunks(count)
            .zip(b.image.data().chunks(count));
        let pixel = |(pa, pb): (&[f32], &[f32])| {
            pa.iter()
                .zip(pb)
                .map(|(a, b)| term(*a, *b))
                .fold(0.0, f32::max)
        };
        pixels.map(pixel).collect()
    };
    let ppd = arguments.ppd as f32;
    let (values, label) = match of {
        MapOf::Flip if a.encoding == image::Encoding::Linear => (flip::hdr(a, b, ppd)?, "HDR-FLIP"),
        MapOf::Flip => (flip::ldr(a, b, ppd)?, "FLIP"),
        MapOf::Difference => (greatest(|a, b| (b - a).abs()), "|b - a|"),
        MapOf::Relative => (
            greatest(|a, b| (b - a).abs() / (a.abs() + 0.01)),
            "|b - a| / (|a| + 0.01)",
        ),
    };
    let top = if of == MapOf::Flip {
        1.0
    } else {
        map::robust_top(&values)
    };
    arguments.draw(a, &values, label, top)
}

fn sides(arguments: &Arguments) -> Result<Outcome> {
    let (a, layer) = side(arguments, &arguments.a)?;
    let (b, _) = side(arguments, &arguments.b)?;
    let verdict = seeds::judge(&a, &b, arguments.confidence)?;
    if let Some(precision) = arguments.precision {
        let mean = &verdict.means[0];
        if verdict.agrees && mean.half_width > precision {
            return Err(Error::input(format!(
                "a difference of the mean {} of up to {:.3} % could hide in the noise, more than the {:.3} % asked for",
                mean.channel,
                100.0 * mean.half_width,
                100.0 * precision
            ))
            .help("take more samples or seeds"));
        }
    }
    if arguments.map.is_some() {
        let values = seeds::map(&a, &b)?;
        arguments.draw(&layer, &values, "|t| between seeds", T_TOP)?;
    }
    let mut lines = head(&layer, &[]);
    lines.extend(verdict_lines(&verdict));
    let mut object = serde_json::to_value(&verdict).expect("it has only names and numbers");
    object["a"] = names(&arguments.a);
    object["b"] = names(&arguments.b);
    Ok(Outcome {
        agrees: verdict.agrees,
        sentence: verdict.sentence,
        lines,
        object,
    })
}

/// The brightest |t| and |z| on a map: chance alone rarely reaches it.
const T_TOP: f32 = 6.0;

fn names(paths: &[PathBuf]) -> Value {
    paths.iter().map(|p| p.display().to_string()).collect()
}

/// Reads the images of a side, one after another; the first layer comes along.
fn side(arguments: &Arguments, paths: &[PathBuf]) -> Result<(Side, Layer)> {
    let selection = arguments.selection();
    let mut gathered: Option<(Side, Layer)> = None;
    for path in paths {
        let here = |e: Error| e.at(&Location::of_file(path));
        let layer = Layer::read(path, &selection)?;
        pair::check_finite(&layer, "it").map_err(here)?;
        match &mut gathered {
            Some((side, _)) => side.push(&layer.image).map_err(here)?,
            None => {
                let mut side = Side::new(&layer.image, layer.rgb)?;
                side.push(&layer.image).map_err(here)?;
                gathered = Some((side, layer));
            }
        }
    }
    gathered.ok_or_else(|| Error::input("a side has no images"))
}

fn verdict_lines(verdict: &Verdict) -> Vec<String> {
    let mut lines = vec![format!(
        "  {:10} {:>12} {:>12} {:>12} {:>10}",
        "mean", "a", "b", "difference", "±"
    )];
    for mean in &verdict.means {
        // Parts of a, where there are any.
        let (unit, factor) = if mean.a == 0.0 {
            ("  ", 1.0)
        } else {
            (" %", 100.0)
        };
        lines.push(format!(
            "  {:10} {:12.6} {:12.6} {:+10.4}{unit} {:8.4}{unit}{}",
            mean.channel,
            mean.a,
            mean.b,
            factor * mean.difference,
            factor * mean.half_width,
            if mean.agrees { "" } else { "  differs" }
        ));
    }
    for (name, test) in [("tiles", &verdict.tiles), ("pixels", &verdict.pixels)] {
        let worst = &test.worst;
        lines.push(format!(
            "  {name:10} {} of {} tests differ; most t = {:+.2}, p = {:.2e} (limit {:.2e}) at {}, {} in {}",
            test.differing, test.tests, worst.t, worst.p, test.limit, worst.x, worst.y, worst.channel
        ));
    }
    let noise = verdict.noise;
    lines.push(format!(
        "  {:10} {:.4e}, {:.2} times the {:.4e} expected from the noise of both sides",
        "relmse", noise.relmse, noise.ratio, noise.expected
    ));
    lines
}

fn against_reference(arguments: &Arguments, path: &Path, reference: &Path) -> Result<Outcome> {
    let (Some(variance), Some(spp)) = (&arguments.variance, arguments.spp) else {
        return Err(Error::input("a reference needs --variance and --spp"));
    };
    let selection = arguments.selection();
    let layer = Layer::read(path, &selection)?;
    let mean = Layer::read(reference, &selection)?;
    let variance = Layer::read(variance, &selection)?;
    let reference = Reference {
        mean: &mean,
        variance: &variance,
        spp: arguments.reference_spp,
    };
    let outcome = ztest::ztest(&layer, spp, &reference)?;
    arguments.draw(&layer, &outcome.map, "|z|", T_TOP)?;
    let lines = vec![format!(
        "  accepted {:.5}, gain {:+.5} ± {:.5}, z rms {:.3}, greatest {:.2} (bound {:.2})",
        outcome.accepted,
        outcome.gain,
        outcome.gain_error,
        outcome.z_rms,
        outcome.z_max,
        outcome.z_bound
    )];
    Ok(Outcome {
        agrees: outcome.passed,
        sentence: outcome.sentence(),
        lines,
        object: serde_json::to_value(&outcome).expect("it has only names and numbers"),
    })
}
