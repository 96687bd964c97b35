//! `etendue render`: scenes or bare meshes to images.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use etendue::accel::Method;
use etendue::description::{self, Description};
use etendue::error::{Error, Result};
use etendue::render::{self, Colors, Options, Overrides, Rendered, UpAxis, human_duration};
use etendue::sensor::Window;
use etendue::{display, image};

use super::progress::Bar;
use super::{output, report};

/// Render scenes or meshes to images
///
/// INPUT is a Mitsuba 3 scene (.xml) or a bare mesh (.ply, .obj), which gets an automatic camera on a
/// ground under a soft sky. The extension of OUT says the format: .exr (linear, float32, with metadata and
/// all channels), .hdr (linear) or .png (sRGB).
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Scene files (.xml) or meshes (.ply, .obj)
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// Where the image goes; {name} stands for the input's name, for several inputs
    #[arg(short, long, value_name = "OUT")]
    output: String,
    /// Samples a pixel, in place of the scene's sample_count; the sampler may round up
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Seed of the random numbers: one seed, one image
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u64,
    /// Threads; one a processor by default. The image does not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Size of the film in pixels
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// Render only this part of the film; equals the same pixels of the full image
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop)]
    crop: Option<Window>,
    /// Value of a $name parameter of the scene
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    define: Vec<(String, String)>,
    /// Integrator, in place of the scene's
    #[arg(long, value_name = "NAME")]
    integrator: Option<String>,
    /// The integrator's max_depth: 1 is emission only, 2 direct light, -1 no limit
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    max_depth: Option<i64>,
    /// Sampler, in place of the scene's
    #[arg(long, value_name = "NAME")]
    sampler: Option<String>,
    /// How rays find shapes; the image is the same
    #[arg(long, value_enum, default_value_t = Accel::Tree)]
    accel: Accel,
    /// Render N spectral bands over 360-830 nm instead of RGB; the image's RGB is made from them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=32))]
    bands: Option<u8>,
    /// Which way is up in a bare mesh
    #[arg(long, value_enum, default_value_t = Up::Y)]
    up: Up,
    /// Refuse what Mitsuba 3 would not read
    #[arg(long)]
    strict: bool,
    /// No progress bar, no summary
    #[arg(short, long)]
    quiet: bool,
    /// Print a JSON object for each image: size, counts, seconds
    #[arg(long)]
    json: bool,
    /// Print what was counted and timed
    #[arg(long)]
    stats: bool,
}

const EXAMPLES: &str = "\
Examples:
  etendue render scenes/cornell-box.xml -o cornell-box.png
  etendue render dragon.ply -o dragon.png --size 1920x1080 --spp 256
  etendue render a.xml b.xml -o out/{name}.exr --seed 7
  etendue render scene.xml -o crop.exr --crop 100,80,64,64 --max-depth 2 -D spp=16";

/// How rays find shapes.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Accel {
    /// Test every shape
    Brute,
    /// A bounding volume hierarchy
    Tree,
}

/// Which way is up.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Up {
    /// +y
    Y,
    /// +z
    Z,
}

fn numbers<const N: usize>(text: &str, separator: char) -> Option<[u32; N]> {
    let numbers: Vec<u32> = text
        .split(separator)
        .map(|t| t.trim().parse().ok())
        .collect::<Option<_>>()?;
    numbers.try_into().ok()
}

fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let [width, height] = numbers(text, 'x').ok_or("write it as WIDTHxHEIGHT, such as 640x480")?;
    Ok((width, height))
}

fn crop(text: &str) -> std::result::Result<Window, String> {
    let [x, y, width, height] =
        numbers(text, ',').ok_or("write it as X,Y,WIDTH,HEIGHT, such as 10,20,64,64")?;
    Ok(Window {
        x,
        y,
        width,
        height,
    })
}

fn define(text: &str) -> std::result::Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("write it as name=value")?;
    Ok((name.to_owned(), value.to_owned()))
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let outputs = output::expand_all(&arguments.output, &arguments.inputs)?;
    for path in &outputs {
        image::check_writable(path)?;
    }
    for (input, path) in arguments.inputs.iter().zip(&outputs) {
        render_one(arguments, input, path)?;
    }
    Ok(())
}

fn render_one(arguments: &Arguments, input: &Path, path: &Path) -> Result<()> {
    let start = Instant::now();
    let description = describe(arguments, input)?;
    let bar = Bar::new(&input.display().to_string(), arguments.quiet);
    let result = render::render(&description, &options(arguments, input), &bar);
    bar.finish();
    let rendered = result?;
    if !arguments.quiet {
        report::warnings(&rendered.warnings);
    }
    display::save_window(path, &rendered.image, &rendered.window, &rendered.metadata)?;
    tell(arguments, input, path, &rendered, start.elapsed());
    Ok(())
}

/// The scene, with the arguments' values in place of its own.
fn describe(arguments: &Arguments, input: &Path) -> Result<Description> {
    let options = description::Options {
        defines: arguments.define.clone(),
        strict: arguments.strict,
    };
    let mut description = if render::is_mesh(input) {
        let up = match arguments.up {
            Up::Y => UpAxis::Y,
            Up::Z => UpAxis::Z,
        };
        render::describe_mesh(input, up, &options)?
    } else if input
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("xml"))
    {
        Description::read(input, &options)?
    } else {
        let message = format!("{}: neither a scene nor a mesh", input.display());
        return Err(Error::input(message).help("a scene is an .xml file, a mesh a .ply or .obj"));
    };
    let overrides = Overrides {
        spp: arguments.spp,
        sampler: arguments.sampler.clone(),
        size: arguments.size,
        crop: arguments.crop,
        integrator: arguments.integrator.clone(),
        max_depth: arguments.max_depth,
    };
    overrides.apply(&mut description);
    Ok(description)
}

fn options(arguments: &Arguments, input: &Path) -> Options {
    Options {
        scene: input.display().to_string(),
        seed: arguments.seed,
        threads: arguments.threads,
        colors: arguments
            .bands
            .map_or(Colors::Rgb, |n| Colors::Bands(n.into())),
        method: match arguments.accel {
            Accel::Brute => Method::Brute,
            Accel::Tree => Method::Tree,
        },
    }
}

/// Says what was done, as the arguments ask.
fn tell(arguments: &Arguments, input: &Path, path: &Path, rendered: &Rendered, total: Duration) {
    let report = &rendered.report;
    if arguments.json {
        let mut object = serde_json::to_value(report).expect("a report has only names and numbers");
        object["input"] = input.display().to_string().into();
        object["output"] = path.display().to_string().into();
        object["seconds"]["total"] = total.as_secs_f64().into();
        output::line(&object.to_string());
        return;
    }
    if !arguments.quiet {
        let [width, height] = report.size;
        output::line(&format!(
            "{}: {width}×{height}, {} samples a pixel, {}",
            path.display(),
            report.spp,
            human_duration(total)
        ));
    }
    if arguments.stats {
        let stats = &report.stats;
        let rays = stats.rays().max(1) as f64;
        let rate = rays / report.seconds.render.max(1e-9) * 1e-6;
        for (name, value) in [
            ("primitives", report.primitives.to_string()),
            ("lights", report.lights.to_string()),
            (
                "geometry, trees",
                format!(
                    "{:.1} MB, {:.1} MB",
                    megabytes(report.bytes[0]),
                    megabytes(report.bytes[1])
                ),
            ),
            ("camera rays", stats.camera_rays.to_string()),
            ("bounce rays", stats.bounce_rays.to_string()),
            ("shadow rays", stats.shadow_rays.to_string()),
            ("points shaded", stats.shaded.to_string()),
            (
                "node steps a ray",
                format!("{:.2}", stats.tracing.node_steps as f64 / rays),
            ),
            (
                "primitive tests a ray",
                format!("{:.2}", stats.tracing.primitive_tests as f64 / rays),
            ),
            ("seconds to load", format!("{:.3}", report.seconds.load)),
            ("seconds to build", format!("{:.3}", report.seconds.build)),
            (
                "seconds to render",
                format!("{:.3} ({rate:.2} M rays/s)", report.seconds.render),
            ),
        ] {
            output::line(&format!("  {name:22} {value}"));
        }
    }
}

fn megabytes(bytes: usize) -> f64 {
    bytes as f64 * 1e-6
}
