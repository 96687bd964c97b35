//! `etendue relight`: an image's layers with other weights.

use std::path::PathBuf;

use clap::Args;
use etendue::display;
use etendue::error::{Error, Result};
use etendue::image::{self, Metadata};
use etendue::relight::{self, Weight};
use serde_json::{Value, json};

use super::display::DisplayArguments;
use super::memory::MemoryArguments;
use super::{output, parse, status};

/// Weight the layers of an image anew, without tracing
///
/// The image is one that the integrator "phong" has written with its property "layers". Without an output,
/// its layers are listed with their mean values.
#[derive(Args, Debug)]
#[command(after_help = status::HELP)]
pub(super) struct Arguments {
    /// Image with layers (.exr)
    input: PathBuf,
    /// Where the image goes: .exr, .hdr or .pfm (linear), .tif, .png or .jpg (for screens)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Multiply the layers of that name, one number or three for R,G,B: diffuse=0.5, light.lamp=2,1,0.5; a word
    /// of the name will do; may be given repeatedly
    #[arg(short, long = "weight", value_name = "NAME=WEIGHT", value_parser = parse::weight, requires = "output")]
    weights: Vec<Weight>,
    /// Print a JSON object: layers with their means, weights, output
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    display: DisplayArguments,
    #[command(flatten)]
    memory: MemoryArguments,
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let image = image::read(&arguments.input, &arguments.memory.budget().open())?.image;
    let of_input = |error: Error| error.at(&etendue::error::Location::of_file(&arguments.input));
    if let Some(output) = &arguments.output {
        image::check_writable(output)?;
        arguments.display.transform().check(output)?;
        arguments.display.warn_unused([output.as_path()], false);
        let relit = relight::relight(&image, &arguments.weights).map_err(of_input)?;
        let mut metadata = Metadata::default()
            .with("software", concat!("etendue ", env!("CARGO_PKG_VERSION")))
            .with("relit_from", arguments.input.display().to_string());
        let weights: Vec<String> = arguments.weights.iter().map(text).collect();
        if !weights.is_empty() {
            metadata = metadata.with("weights", weights.join(" "));
        }
        display::save(output, &relit, &metadata, &arguments.display.transform())?;
        if !arguments.json {
            output::written(output, &relit);
        }
    }
    let layers = relight::layers(&image);
    if layers.is_empty() {
        let error = Error::input("the image has no layers");
        let error =
            error.help("only the integrator phong writes them, with its property \"layers\"");
        return Err(of_input(error));
    }
    if arguments.json {
        let layers = layers
            .iter()
            .map(|layer| json!({ "name": layer.name, "mean": relight::mean(&image, layer) }));
        let weights = arguments
            .weights
            .iter()
            .map(|weight| json!({ "name": weight.name, "factors": weight.factors }));
        let object = json!({
            "file": arguments.input.display().to_string(),
            "layers": layers.collect::<Value>(),
            "weights": weights.collect::<Value>(),
            "output": arguments.output.as_ref().map(|o| o.display().to_string()),
        });
        output::object(object);
    } else if arguments.output.is_none() {
        for layer in layers {
            let [r, g, b] = relight::mean(&image, &layer);
            output::line(&format!("{:32} {r:.6} {g:.6} {b:.6}", layer.name));
        }
    }
    Ok(status::DONE)
}

/// As it is given on the command line.
fn text(weight: &Weight) -> String {
    let [r, g, b] = weight.factors;
    format!("{}={r},{g},{b}", weight.name)
}
