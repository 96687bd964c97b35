//! `etendue spectrum`: what a pixel of a spectral image holds.

use std::path::PathBuf;

use clap::Args;
use etendue::display::diagram;
use etendue::error::{Error, Location, Result};
use etendue::image;
use serde_json::json;

use super::memory::MemoryArguments;
use super::{output, status};

/// Print the spectrum of a pixel of a spectral image, and draw it
///
/// The image has channels such as S0.550,000000nm, as renders with --bands have (Fichet and others, JCGT 2021). Each line
/// is a wavelength in nm, the middle of a band, and the band's mean.
#[derive(Args, Debug)]
#[command(after_help = status::HELP)]
pub(super) struct Arguments {
    /// Spectral image (.exr)
    input: PathBuf,
    /// Column of the pixel, from the left edge of the image
    x: u32,
    /// Row of the pixel, from its upper edge
    y: u32,
    /// Draw the spectrum (.svg)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print a JSON object: wavelengths, values, output
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    memory: MemoryArguments,
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let image = image::read(&arguments.input, &arguments.memory.budget().open())?.image;
    let of_input = |error: Error| error.at(&Location::of_file(&arguments.input));
    let bands = image::bands(&image);
    if bands.is_empty() {
        let error = Error::input("the image has no spectral channels");
        let error = error.help("they are called S0.550,0nm and so on; render with --bands");
        return Err(of_input(error));
    }
    let (x, y) = (arguments.x, arguments.y);
    if x >= image.width() || y >= image.height() {
        let (width, height) = (image.width(), image.height());
        let message = format!("pixel ({x}, {y}) lies outside of {width} × {height}");
        return Err(of_input(Error::input(message)));
    }
    let value = |channel| f64::from(image.get(x, y, channel));
    let points: Vec<(f64, f64)> = bands
        .iter()
        .map(|band| (band.nm, value(band.channel)))
        .collect();
    if let Some(file) = &arguments.output {
        let title = format!("{} at ({x}, {y})", arguments.input.display());
        let drawn = diagram::spectrum(&title, "radiance per nm", &points);
        output::write_svg(file, &drawn)?;
    }
    if arguments.json {
        let (wavelengths, values): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        let object = json!({
            "file": arguments.input.display().to_string(),
            "pixel": [x, y],
            "wavelengths": wavelengths,
            "values": values,
            "output": arguments.output.as_ref().map(|o| o.display().to_string()),
        });
        output::line(&object.to_string());
    } else {
        for (nm, value) in points {
            output::line(&format!("{nm:10.3} {value:.6}"));
        }
    }
    Ok(status::DONE)
}
