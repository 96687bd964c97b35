//! `etendue convert`: images to other formats, and to pictures for a screen.

use std::path::{Path, PathBuf};

use clap::Args;
use etendue::denoise::Denoiser;
use etendue::display::{self, srgb};
use etendue::error::{Error, Location, Result};
use etendue::image::{self, Image, Metadata};
use etendue::sensor::Window;
use serde_json::json;

use super::denoise::{self, DenoiseArguments};
use super::display::DisplayArguments;
use super::folders::{Wanted, files, pattern};
use super::memory::MemoryArguments;
use super::output::{self, Names};
use super::{parse, report, status};

/// Convert images, and make pictures of renders
///
/// Reads EXR, HDR, PFM, TIFF, PNG, JPEG, BMP, TGA and PPM. The extension of OUT says the format: .exr (all channels), .hdr
/// and .pfm (main colour) hold linear values; .tif, .png and .jpg are for screens, and the options below say how linear
/// values become their codes. With --bits 32 .tif holds linear values too. Codes that are read are taken for sRGB.
#[derive(Args, Debug)]
#[command(after_help = format!("{EXAMPLES}\n\n{}", status::HELP))]
pub(super) struct Arguments {
    /// Images, or folders of them
    #[arg(required = true, value_name = "IN")]
    inputs: Vec<PathBuf>,
    /// Where the image goes; {name} stands for the input's name, and a folder for FOLDER/{name}.png
    #[arg(short, long, value_name = "OUT")]
    output: String,
    /// Only this layer, such as albedo, light.lamp.diffuse or depth; "etendue info" lists them
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Only this part of each image
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse::crop)]
    crop: Option<Window>,
    /// Put all images on one sheet, with so many in a row: 2 for a stereo pair side by side
    #[arg(long, value_name = "COLUMNS", value_parser = clap::value_parser!(u32).range(1..=1000))]
    sheet: Option<u32>,
    #[command(flatten)]
    display: DisplayArguments,
    #[command(flatten)]
    denoising: DenoiseArguments,
    #[command(flatten)]
    memory: MemoryArguments,
    /// No word on what was written, no warnings
    #[arg(short, long)]
    quiet: bool,
    /// Print a JSON object for each image that is written: file, width, height, channels
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  etendue convert room.exr -o room.png --exposure auto --view agx
  etendue convert a.exr b.exr -o out/{name}.png --view local
  etendue convert room.exr -o hdr.png --encode pq --gamut bt2020 --bits 16
  etendue convert room.exr -o linear.tif --bits 32
  etendue convert room.exr -o albedo.png --layer albedo
  etendue convert left.exr right.exr -o pair.png --sheet 2";

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let inputs = files(&arguments.inputs, Wanted::Images)?;
    let outputs = outputs(arguments, &inputs)?;
    for output in &outputs {
        image::check_writable(output)?;
        arguments.display.transform().check(output)?;
    }
    let paths = outputs.iter().map(PathBuf::as_path);
    arguments.display.warn_unused(paths, arguments.quiet);
    let denoiser = arguments.denoising.denoiser(0)?;
    if let Some(columns) = arguments.sheet {
        let images: Result<Vec<Image>> = inputs
            .iter()
            .map(|i| read(arguments, denoiser.as_ref(), i))
            .collect();
        write(
            arguments,
            &outputs[0],
            &image::sheet(&images?, columns)?,
            Metadata::default(),
        )?;
        return Ok(status::DONE);
    }
    for (input, output) in inputs.iter().zip(&outputs) {
        let image = read(arguments, denoiser.as_ref(), input)?;
        let metadata = Metadata::default().with("converted_from", input.display().to_string());
        write(arguments, output, &image, metadata)?;
    }
    Ok(status::DONE)
}

/// Of each input, or the one of a sheet.
fn outputs(arguments: &Arguments, inputs: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let pattern = match arguments.sheet {
        Some(_) => arguments.output.as_str().into(),
        None => pattern(&arguments.output, 1),
    };
    let expanded = |input: &PathBuf| {
        let names = Names {
            input,
            frame: 0,
            sensor: "0",
            eye: None,
        };
        names.expand(&pattern)
    };
    let count = if arguments.sheet.is_some() {
        1
    } else {
        inputs.len()
    };
    let outputs: Vec<PathBuf> = inputs[..count]
        .iter()
        .map(expanded)
        .collect::<Result<_>>()?;
    let named = outputs.iter().zip(inputs);
    let named = named.map(|(o, i)| (o.as_path(), i.display().to_string()));
    let help = "name them after the inputs, as in -o out/{name}.png or -o out/, or make one of all by --sheet";
    output::check_distinct(named, help)?;
    Ok(outputs)
}

/// An image's linear values, or those of the part that is asked for.
fn read(arguments: &Arguments, denoiser: Option<&Denoiser>, input: &Path) -> Result<Image> {
    let of_input = |error: Error| error.at(&Location::of_file(input));
    let picture = image::read(input, &arguments.memory.budget().open())?;
    if !arguments.quiet {
        report::warnings(&picture.warnings);
    }
    let mut image = srgb::linear(picture);
    if let Some(denoiser) = denoiser {
        image = denoise::applied(denoiser, &image).map_err(of_input)?;
    }
    if let Some(name) = &arguments.layer {
        image = image.layer(name).map_err(of_input)?;
    }
    if let Some(Window {
        x,
        y,
        width,
        height,
    }) = arguments.crop
    {
        image = image.crop([x, y, width, height]).map_err(of_input)?;
    }
    Ok(image)
}

fn write(arguments: &Arguments, output: &Path, image: &Image, metadata: Metadata) -> Result<()> {
    let metadata = metadata.with("software", concat!("etendue ", env!("CARGO_PKG_VERSION")));
    display::save(output, image, &metadata, &arguments.display.transform())?;
    if arguments.json {
        let object = json!({
            "file": output.display().to_string(),
            "width": image.width(),
            "height": image.height(),
            "channels": image.channels(),
        });
        output::object(object);
    } else if !arguments.quiet {
        output::written(output, image);
    }
    Ok(())
}
