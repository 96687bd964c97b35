//! `etendue merge`: one image from parts that many processes or machines have rendered.

use std::path::PathBuf;

use clap::Args;
use etendue::error::{Error, Result};
use etendue::render::{MergeReport, Merged, human_duration, is_part, merge};
use etendue::sensor::Window;
use etendue::{display, image};

use super::memory::MemoryArguments;
use super::summary::samples;
use super::{output, parse, status};

/// Make an image of parts
///
/// A part is what `etendue render` writes with an output named .part: a crop (--crop) of the film, some of the passes over
/// it (--passes), or both. Parts of one image may be rendered by any number of processes and machines; what merge makes of
/// them has the same bits as one run. Crops must cover the film without sharing pixels, and the parts of a crop all passes;
/// what is missing, doubled, damaged or of another image is named, and nothing is written.
#[derive(Args, Debug)]
#[command(after_help = format!("{EXAMPLES}\n\n{}", status::HELP))]
pub(super) struct Arguments {
    /// Where the image goes: .exr, .hdr, .pfm, .tif, .png or .jpg
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// The parts, in any order
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    /// The parts make this crop of the film, and not the whole
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse::crop)]
    crop: Option<Window>,
    #[command(flatten)]
    memory: MemoryArguments,
    /// Write OUT.fingerprint beside the image, which says what it was made of: see `etendue render --skip-same`
    #[arg(long)]
    fingerprint: bool,
    /// Print nothing where all is well
    #[arg(short, long)]
    quiet: bool,
    /// Print a JSON object: size, samples, counts, seconds
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  etendue render scene.xml -o left.part --crop 0,0,320,480 &
  etendue render scene.xml -o right.part --crop 320,0,320,480 & wait
  etendue merge scene.exr left.part right.part
  for i in 0 1 2 3; do etendue render scene.xml -o $i.part --spp 48 --passes $i:$((i + 1)); done
  etendue merge scene.exr ?.part";

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    if is_part(&arguments.output) {
        let message = format!(
            "{} is a part, and no place for the image",
            arguments.output.display()
        );
        let help =
            "name the image before its parts, as in: etendue merge image.exr left.part right.part";
        return Err(Error::input(message).help(help));
    }
    image::check_writable(&arguments.output)?;
    let limit = arguments.memory.budget().limit();
    let Merged {
        image,
        window,
        metadata,
        provenance,
        report,
    } = merge(&arguments.parts, arguments.crop, limit)?;
    display::save_window(
        &arguments.output,
        &image,
        &window,
        &metadata,
        &display::DisplayTransform::default(),
    )?;
    if arguments.fingerprint {
        provenance.write(&arguments.output)?;
    }
    tell(arguments, &report);
    Ok(status::DONE)
}

fn tell(arguments: &Arguments, report: &MergeReport) {
    if arguments.json {
        let mut object = serde_json::to_value(report).expect("a report has only names and numbers");
        object["output"] = arguments.output.display().to_string().into();
        output::object(object);
    } else if !arguments.quiet {
        output::line(&format!(
            "{}: {}×{}, {}, of {} parts, {}",
            arguments.output.display(),
            report.width,
            report.height,
            samples(report.spp),
            report.parts,
            human_duration(std::time::Duration::from_secs_f64(report.seconds))
        ));
    }
}
