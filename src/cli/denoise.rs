//! `etendue denoise`, and the arguments of those commands that can denoise what they make.

use std::path::PathBuf;

use clap::Args;
use etendue::denoise::{Denoiser, Guides};
use etendue::display::{self, srgb};
use etendue::error::Result;
use etendue::image::{self, Image, Metadata};

use super::display::DisplayArguments;
use super::memory::MemoryArguments;
use super::{output, report, status};

/// Whether and with what images are denoised.
#[derive(Args, Clone, Debug)]
pub(super) struct DenoiseArguments {
    /// Take the noise out by Open Image Denoise 2, a library that has to be there
    #[arg(long, help_heading = DENOISING)]
    pub(super) denoise: bool,
    #[command(flatten)]
    library: LibraryArguments,
}

/// Where the library is.
#[derive(Args, Clone, Debug)]
struct LibraryArguments {
    /// The denoiser's library or its folder, where the system does not find it: `pip install pyoidn` brings one as
    /// site-packages/pyoidn/oidn/lib
    #[arg(long, value_name = "PATH", env = "ETENDUE_DENOISE_LIB", hide_env_values = true, help_heading = DENOISING)]
    denoise_lib: Option<PathBuf>,
}

const DENOISING: &str = "Denoising";

impl DenoiseArguments {
    /// The denoiser, if one is wanted.
    pub(super) fn denoiser(&self, threads: usize) -> Result<Option<Denoiser>> {
        let load = || self.library.denoiser(threads);
        self.denoise.then(load).transpose()
    }
}

impl LibraryArguments {
    fn denoiser(&self, threads: usize) -> Result<Denoiser> {
        Denoiser::load(self.denoise_lib.as_deref(), threads)
    }
}

/// Takes the noise out of finished images
///
/// The main colour is denoised, and told apart from noise by the layers albedo and normal where the image has them; other
/// layers stay as they are. It is best done with images of a box filter, as `etendue render --denoise` makes them: where
/// pixels share samples, what they share looks like an image.
#[derive(Args, Debug)]
#[command(after_help = format!("{EXAMPLES}\n\n{}", status::HELP))]
pub(super) struct Arguments {
    /// The image
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Where the denoised image goes
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// The layer of diffuse reflectances, in place of albedo
    #[arg(long, value_name = "LAYER")]
    albedo: Option<String>,
    /// The layer of shading normals, in place of sh_normal or normal
    #[arg(long, value_name = "LAYER", requires = "albedo")]
    normal: Option<String>,
    #[command(flatten)]
    library: LibraryArguments,
    #[command(flatten)]
    display: DisplayArguments,
    #[command(flatten)]
    memory: MemoryArguments,
    /// No word on what was written, no warnings
    #[arg(short, long)]
    quiet: bool,
}

const EXAMPLES: &str = "\
Examples:
  etendue denoise room.exr -o clean.exr
  etendue denoise room.exr -o clean.png --albedo a --normal n --view agx";

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    image::check_writable(&arguments.output)?;
    arguments.display.transform().check(&arguments.output)?;
    let output = arguments.output.as_path();
    arguments.display.warn_unused([output], arguments.quiet);
    let denoiser = arguments.library.denoiser(0)?;
    let picture = image::read(&arguments.input, &arguments.memory.budget().open())?;
    if !arguments.quiet {
        report::warnings(&picture.warnings);
    }
    let guides = Guides {
        albedo: arguments.albedo.clone(),
        normal: arguments.normal.clone(),
    };
    let image = srgb::linear(picture);
    let denoised = denoiser.denoise(&image, &guides.or_found_in(&image))?;
    let metadata = Metadata::default()
        .with("software", concat!("etendue ", env!("CARGO_PKG_VERSION")))
        .with("denoised_from", arguments.input.display().to_string())
        .with("denoiser", name(&denoiser));
    let display = arguments.display.transform();
    display::save(&arguments.output, &denoised, &metadata, &display)?;
    if !arguments.quiet {
        output::written(&arguments.output, &denoised);
    }
    Ok(status::DONE)
}

/// What an image's metadata say of how it was denoised.
pub(super) fn name(denoiser: &Denoiser) -> String {
    format!("Open Image Denoise {}", denoiser.version())
}

/// The image with its noise taken out, by the guides that it has.
pub(super) fn applied(denoiser: &Denoiser, image: &Image) -> Result<Image> {
    denoiser.denoise(image, &Guides::default().or_found_in(image))
}
