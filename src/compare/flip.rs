//! FLIP: how strongly a viewer who flips between two images sees them differ, 0 to 1 a pixel. LDR-FLIP is
//! that of Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild (*FLIP: a difference
//! evaluator for alternating images*, 2020) for what a screen shows; HDR-FLIP is the greatest over a range
//! of exposures that follows from the reference (Andersson, Nilsson, Shirley and Akenine-Möller,
//! *Visualizing errors in rendered high dynamic range images*, 2021). Both are computed by the crate
//! `flip-rs`, a port of the authors' version 1.7.

use flip_rs::{FlipError, HdrOptions, RgbImage};

use crate::color::srgb;
use crate::compare::Layer;
use crate::error::{Error, Result};
use crate::image::Encoding;

/// The pixels that a degree of the visual field holds at the authors' desk: a screen 0.7 m wide, of 3840
/// pixels, at 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = flip_rs::DEFAULT_PPD;

/// LDR-FLIP of each pixel. Linear values are clamped and encoded first, codes are taken as they are.
///
/// # Errors
/// Where the layers are no colour, or `pixels_per_degree` asks for filters that are too small or too large.
pub fn ldr(reference: &Layer, test: &Layer, pixels_per_degree: f32) -> Result<Vec<f32>> {
    let codes = |layer: &Layer| {
        let linear = layer.encoding == Encoding::Linear;
        rgb(layer, |v| {
            let v = v.clamp(0.0, 1.0);
            if linear { srgb::encode(v) } else { v }
        })
    };
    let (reference, test) = (codes(reference)?, codes(test)?);
    flip_rs::ldr_flip(&reference, &test, pixels_per_degree)
        .map(flip_rs::ErrorMap::into_pixels)
        .map_err(|e| refused(&e))
}

/// HDR-FLIP of each pixel; negative light counts as none.
///
/// # Errors
/// As [`ldr`], and where the values are codes or the reference is black all over.
pub fn hdr(reference: &Layer, test: &Layer, pixels_per_degree: f32) -> Result<Vec<f32>> {
    if [reference, test]
        .iter()
        .any(|l| l.encoding != Encoding::Linear)
    {
        return Err(Error::input("it needs linear values"));
    }
    let light = |layer| rgb(layer, |v| v.max(0.0));
    let (reference, test) = (light(reference)?, light(test)?);
    if reference.pixels() == test.pixels() {
        // Also where all is black, which leaves the exposures undefined.
        return Ok(vec![0.0; reference.width() * reference.height()]);
    }
    if reference.pixels().iter().all(|v| *v == 0.0) {
        return Err(Error::input(
            "a black reference leaves the exposures undefined",
        ));
    }
    let mut options = HdrOptions::default();
    options.ppd = pixels_per_degree;
    options.return_exposure_map = false;
    flip_rs::hdr_flip(&reference, &test, options)
        .map(|result| result.error_map.into_pixels())
        .map_err(|e| refused(&e))
}

fn rgb(layer: &Layer, value: impl Fn(f32) -> f32) -> Result<RgbImage<f32>> {
    let image = &layer.image;
    let indices = layer
        .rgb
        .ok_or_else(|| Error::input("it needs a colour, R, G and B"))?;
    let pixels = image.data().chunks_exact(image.channels().len());
    let values = pixels.flat_map(|p| indices.map(|c| value(p[c]))).collect();
    RgbImage::new(image.width() as usize, image.height() as usize, values).map_err(|e| refused(&e))
}

fn refused(error: &FlipError) -> Error {
    Error::input(error.to_string())
}
