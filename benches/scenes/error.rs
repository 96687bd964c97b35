//! CPU time at equal error: noise falls with samples, so that a render of half the error may take twice as long.

use std::path::Path;

use etendue::budget::Account;
use etendue::image::{self, Image};

use super::{Arguments, Ours, Theirs, median};

/// Mitsuba's variant that is compared, and by which the reference is made.
const VARIANT: &str = "llvm_ad_rgb";
/// The samplers beside the scene's own: of ours, and of Mitsuba's.
const BEST: [&str; 2] = ["sobol", "multijitter"];

/// Who takes part.
struct Side {
    name: String,
    renderer: Renderer,
    seconds: Vec<f64>,
    errors: Vec<f64>,
}

enum Renderer {
    Ours(Box<Ours>),
    Theirs(Theirs),
}

impl Renderer {
    /// Seconds of CPU time, and the image's red, green and blue.
    fn render(&mut self, seed: u64, file: &Path) -> Result<(f64, Vec<f32>), String> {
        match self {
            Self::Ours(ours) => {
                let (seconds, _, image) = ours.render(seed)?;
                Ok((seconds, colors(image)?))
            }
            Self::Theirs(theirs) => {
                let seconds = theirs.render(seed, Some(file))?;
                let read = image::read(file, &Account::default()).map_err(|e| e.to_string())?;
                Ok((seconds, colors(read.image)?))
            }
        }
    }
}

fn colors(image: Image) -> Result<Vec<f32>, String> {
    let image = image.into_rgb();
    let rgb = image.rgb().ok_or("the image has no colours")?;
    let pixels = image.data().chunks_exact(image.channels().len());
    Ok(pixels.flat_map(|pixel| rgb.map(|c| pixel[c])).collect())
}

/// The mean of the squared error relative to the reference.
fn error(image: &[f32], reference: &[f32]) -> f64 {
    let both = image.iter().zip(reference);
    let relative = both.map(|(x, r)| {
        let (x, r) = (f64::from(*x), f64::from(*r));
        (x - r).powi(2) / (r * r + 0.01)
    });
    relative.sum::<f64>() / image.len() as f64
}

/// Renders the scene in turns, and tells what each side takes of the time of the first at equal error.
pub(super) fn compare(
    arguments: &Arguments,
    name: &str,
    path: &Path,
    size: (u32, u32),
    reference: u32,
) -> Result<(), String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let file = folder.path().join("image.exr");
    let mut converged = Theirs::load(arguments, VARIANT, path, (size, reference), None)?;
    converged.render(1, Some(&file))?;
    drop(converged);
    let read = image::read(&file, &Account::default()).map_err(|e| e.to_string())?;
    let reference = colors(read.image)?;
    let spp = arguments.spp;
    let [best, their_best] = BEST;
    let mut sides = Vec::new();
    for sampler in [None, Some(their_best)] {
        let theirs = Theirs::load(arguments, VARIANT, path, (size, spp), sampler)?;
        sides.push((
            format!("{VARIANT} {}", sampler.unwrap_or_default()),
            Renderer::Theirs(theirs),
        ));
    }
    for sampler in [None, Some(best)] {
        let ours = Box::new(Ours::load(path, size, spp, sampler)?);
        sides.push((
            format!("étendue {}", sampler.unwrap_or_default()),
            Renderer::Ours(ours),
        ));
    }
    let mut sides: Vec<Side> = sides
        .into_iter()
        .map(|(name, renderer)| Side {
            name,
            renderer,
            seconds: Vec::new(),
            errors: Vec::new(),
        })
        .collect();
    for round in 0..arguments.rounds {
        for side in &mut sides {
            let (seconds, image) = side.renderer.render(round as u64 + 2, &file)?;
            side.seconds.push(seconds);
            side.errors.push(error(&image, &reference));
        }
    }
    let product = |side: &Side| median(&side.seconds) * median(&side.errors);
    let first = product(&sides[0]);
    for side in &sides {
        println!(
            "{name:16} {:24} relMSE {:.5}, CPU {:.3} s: {:.2} of the first's CPU time at equal error",
            side.name,
            median(&side.errors),
            median(&side.seconds),
            product(side) / first,
        );
    }
    Ok(())
}
