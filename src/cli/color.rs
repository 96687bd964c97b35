//! `etendue color`: conversions, differences, displays, metamers and the chromaticity diagram.

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use etendue::color::{self, Light, Space};
use etendue::description::{self, Spectrum};
use etendue::display::{self, diagram};
use etendue::error::{Error, Location, Result};
use etendue::image::{self, Metadata};

use super::memory::MemoryArguments;
use super::{output, parse, report, status};

/// Convert and compare colours, and draw them
///
/// Colours are three numbers such as 0.2,0.5,0.8; spaces are named xyz, xyy, bt709, srgb, bt2020, dci-p3, p3-d65, ap0, ap1,
/// lms, lab, luv, hsv and hls. White is D65 with Y = 1, to which other whites are adapted. Files of spectra hold a
/// wavelength in nm and a value a line.
#[derive(Args, Debug)]
#[command(after_help = status::HELP)]
pub(super) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// A colour in another space
    Convert {
        /// The space in which the colour is given
        #[arg(value_parser = parse::space)]
        from: Space,
        /// The space in which it is wanted
        #[arg(value_parser = parse::space)]
        to: Space,
        /// Three numbers
        #[arg(value_parser = parse::color, allow_hyphen_values = true)]
        color: [f64; 3],
    },
    /// How far apart two colours look: CIE 1976 and CIEDE2000
    Difference {
        /// Three numbers, by default L*,a*,b*
        #[arg(value_parser = parse::color, allow_hyphen_values = true)]
        one: [f64; 3],
        /// Three numbers
        #[arg(value_parser = parse::color, allow_hyphen_values = true)]
        other: [f64; 3],
        /// The space in which they are given
        #[arg(long, value_name = "NAME", default_value = "lab", value_parser = parse::space)]
        space: Space,
    },
    /// The matrix from linear BT.709 to a display whose primaries were measured, and an image for it
    Display {
        /// Spectrum of the display's red
        red: PathBuf,
        /// Spectrum of its green
        green: PathBuf,
        /// Spectrum of its blue
        blue: PathBuf,
        /// An image to be taken to the display's own values
        #[arg(long, value_name = "FILE", requires = "output")]
        image: Option<PathBuf>,
        /// Where it goes: .exr or .hdr (linear)
        #[arg(short, long, value_name = "FILE", requires = "image")]
        output: Option<PathBuf>,
        #[command(flatten)]
        memory: MemoryArguments,
    },
    /// Whether two reflectances are one colour under a light: exit status 0 if so, 1 if not
    Metamers {
        /// A spectrum
        one: PathBuf,
        /// Another
        other: PathBuf,
        /// What they are lit by: d65, equal, or a file
        #[arg(long, value_name = "LIGHT", default_value = "d65")]
        light: String,
        /// The largest CIEDE2000 that counts as the same
        #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = parse::positive)]
        threshold: f64,
    },
    /// The chromaticity diagram (CIE 1931)
    Diagram {
        /// Where it goes (.svg)
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Draw the gamut of a space with primaries; may be given repeatedly
        #[arg(long = "gamut", value_name = "NAME", value_parser = parse::gamut, default_value = "bt709")]
        gamuts: Vec<String>,
        /// Show the colours of an image's pixels
        #[arg(long, value_name = "FILE")]
        image: Option<PathBuf>,
        #[command(flatten)]
        memory: MemoryArguments,
    },
}

/// The most pixels that a diagram shows.
const MOST_PIXELS: usize = 4000;

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    match &arguments.action {
        Action::Convert { from, to, color } => {
            output::line(&numbers(to.of_xyz(from.to_xyz(*color))));
        }
        Action::Difference { one, other, space } => {
            if *space == Space::Lab
                && let Some([lightness, ..]) = [one, other].into_iter().find(|lab| lab[0] > 100.0)
            {
                let message = format!("a lightness of {lightness}: in L*a*b* white has 100");
                let warning = Error::input(message).help("--space says what the numbers are");
                report::warnings(warning.problems());
            }
            let [one, other] = [one, other].map(|color| Space::Lab.of_xyz(space.to_xyz(*color)));
            output::line(&format!("CIE 1976   {:.4}", color::delta_e_76(one, other)));
            output::line(&format!(
                "CIEDE2000  {:.4}",
                color::delta_e_2000(one, other)
            ));
        }
        Action::Display {
            red,
            green,
            blue,
            image,
            output,
            memory,
        } => {
            let [red, green, blue] = [curve(red)?, curve(green)?, curve(blue)?];
            let matrix = color::to_display([&red, &green, &blue]).ok_or_else(|| {
                Error::input("the three spectra are not those of three different primaries")
            })?;
            if let (Some(input), Some(output)) = (image, output) {
                let picture = image::read(input, &memory.budget().open())?;
                if picture.encoding != image::Encoding::Linear {
                    let error = Error::input("only linear images can be taken to a display");
                    return Err(error.at(&Location::of_file(input)));
                }
                let native =
                    display::native(&picture.image, &matrix).ok_or_else(|| no_color(input))?;
                image::write(output, &native, &Metadata::default())?;
            }
            for row in matrix {
                output::line(&numbers(row));
            }
        }
        Action::Metamers {
            one,
            other,
            light,
            threshold,
        } => return metamers([one, other], light, *threshold),
        Action::Diagram {
            output,
            gamuts,
            image,
            memory,
        } => {
            let points = match image {
                None => Vec::new(),
                Some(input) => {
                    let picture = image::read(input, &memory.budget().open())?;
                    display::chromaticities_of(&picture.image, MOST_PIXELS)
                        .ok_or_else(|| no_color(input))?
                }
            };
            let named = gamuts.iter();
            let gamuts: Vec<_> = named
                .filter_map(|name| Some((name.as_str(), display::gamut(name)?)))
                .collect();
            output::write_svg(output, &diagram::chromaticities(&gamuts, &points))?;
            output::line(&format!("{}: the chromaticity diagram", output.display()));
        }
    }
    Ok(status::DONE)
}

/// Tells the cones' responses to two reflectances under a light, and how far apart they are.
fn metamers(files: [&Path; 2], light: &str, threshold: f64) -> Result<u8> {
    let lamp;
    let light = match light {
        "d65" | "D65" => Light::D65,
        "equal" => Light::Equal,
        file => {
            lamp = curve(Path::new(file))?;
            Light::Curve(&lamp)
        }
    };
    let mut colors = Vec::new();
    for file in files {
        let dark = || Error::input("nothing is seen under this light");
        let xyz = color::xyz_of_surface(&curve(file)?, light).ok_or_else(dark)?;
        let [x, y] = color::chromaticity(xyz);
        output::line(&format!(
            "{}: LMS {}  XYZ {}  xy {x:.4} {y:.4}",
            file.display(),
            numbers(Space::Lms.of_xyz(xyz)),
            numbers(xyz)
        ));
        colors.push(Space::Lab.of_xyz(xyz));
    }
    let apart = color::delta_e_2000(colors[0], colors[1]);
    let same = apart <= threshold;
    let words = if same { "one colour" } else { "two colours" };
    output::line(&format!("CIEDE2000 {apart:.4}: {words}"));
    Ok(if same { status::DONE } else { status::DIFFERS })
}

fn no_color(file: &Path) -> Error {
    Error::input("the image has no colours").at(&Location::of_file(file))
}

fn numbers([a, b, c]: [f64; 3]) -> String {
    format!("{a:.6} {b:.6} {c:.6}")
}

/// The points of a file of a spectrum.
fn curve(path: &Path) -> Result<Vec<(f64, f64)>> {
    let text = fs::read_to_string(path).map_err(|e| Error::system("read", path, &e))?;
    match description::spectrum_file(&text, path)? {
        Spectrum::Curve(points) => Ok(points),
        Spectrum::Uniform(_) => unreachable!("a file holds a curve"),
    }
}
