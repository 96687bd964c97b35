//! One image against a reference whose mean and variance are known: Mitsuba 3's own test and a test of the
//! overall gain.
//!
//! 1. In each pixel and each of X, Y, Z, z = |image − reference| √(spp / variance), with the variance of a
//!    sample floored at 10⁻⁴; at least 99.75 % of them must lie below the two-sided bound for significance
//!    0.01, Šidák-corrected for the number of pixels.
//! 2. The factor 1 + g by which the image's luminance fits the reference best, weighted by variance:
//!    |g| ≤ max(0.2 %, 4 standard errors). It sees what the first lets by: an error of a fraction of a
//!    percent all over.
//!
//! No value may be NaN or infinite. Both take the pixels' variances for independent ones, which splatting
//! filters make untrue; the test is meant for images that were rendered with a box filter, as Mitsuba's own
//! references are. [`seeds`](super::seeds) has no such restriction.

use serde::Serialize;

use crate::compare::Layer;
use crate::compare::statistics::{sidak, z_quantile};
use crate::error::{Error, Result};

const SIGNIFICANCE: f64 = 0.01;
const VARIANCE_FLOOR: f64 = 1e-4;
const ACCEPTED: f64 = 0.9975;
const GAIN: f64 = 0.002;

/// Linear BT.709 to CIE XYZ, to the digits that Mitsuba has.
const XYZ: [[f64; 3]; 3] = [
    [0.412_453, 0.357_580, 0.180_423],
    [0.212_671, 0.715_160, 0.072_169],
    [0.019_334, 0.119_193, 0.950_227],
];

/// An image with a known variance.
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    /// Its mean.
    pub mean: &'a Layer,
    /// The variance of one sample a pixel.
    pub variance: &'a Layer,
    /// How many samples a pixel the mean was taken over.
    pub spp: u32,
}

/// The outcome.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Whether both tests are passed and all values are finite.
    pub passed: bool,
    /// The part of the values that lie within the bound.
    pub accepted: f64,
    /// g.
    pub gain: f64,
    /// The standard error of g.
    pub gain_error: f64,
    /// How large |g| may be.
    pub gain_allowed: f64,
    /// The root of the mean z².
    pub z_rms: f64,
    /// The greatest z.
    pub z_max: f64,
    /// The bound on z.
    pub z_bound: f64,
    /// Pixels with a value that is not finite; they count as the reference's.
    pub not_finite: usize,
    /// Pixels.
    pub pixels: usize,
    /// The greatest z of each pixel, row by row.
    #[serde(skip)]
    pub map: Vec<f32>,
}

/// Tests `image`, of `spp` samples a pixel.
///
/// # Errors
/// Where sizes differ, one of the three is no colour, a value of the reference is not finite, or a count of
/// samples is 0.
pub fn ztest(image: &Layer, spp: u32, reference: &Reference) -> Result<Outcome> {
    let pixels = f64::from(image.image.width()) * f64::from(image.image.height());
    for other in [reference.mean, reference.variance] {
        let size = |l: &Layer| (l.image.width(), l.image.height());
        if size(image) != size(other) {
            let ((w, h), (rw, rh)) = (size(image), size(other));
            return Err(Error::input(format!(
                "the sizes differ: {w} × {h} pixels, and {rw} × {rh} in the reference"
            )));
        }
    }
    if spp == 0 || reference.spp == 0 {
        return Err(Error::input("a count of samples is 0"));
    }
    super::pair::check_finite(reference.mean, "the reference")?;
    super::pair::check_finite(reference.variance, "the variance")?;

    let bound = z_quantile(sidak(SIGNIFICANCE, pixels as usize));
    let per_sample = 1.0 / f64::from(spp) + 1.0 / f64::from(reference.spp);
    let mut map = Vec::with_capacity(pixels as usize);
    let (mut accepted, mut not_finite) = (0_usize, 0);
    let (mut z_squares, mut z_max) = (0.0, 0.0_f64);
    // Weighted sums of d·r and r·r over noisy pixels, and over all.
    let (mut noisy, mut all) = ([0.0; 2], [0.0; 2]);
    for ((rgb, mean), variance) in colors(image)?
        .zip(colors(reference.mean)?)
        .zip(colors(reference.variance)?)
    {
        not_finite += usize::from(rgb.iter().any(|v| !v.is_finite()));
        let (mean, variance) = (xyz(mean), xyz(variance).map(|v| v.max(VARIANCE_FLOOR)));
        let mut value = xyz(rgb);
        let mut greatest = 0.0_f64;
        for c in 0..3 {
            if !value[c].is_finite() {
                value[c] = mean[c];
            }
            let z = (value[c] - mean[c]).abs() * (f64::from(spp) / variance[c]).sqrt();
            accepted += usize::from(z < bound);
            z_squares += z * z;
            greatest = greatest.max(z);
        }
        z_max = z_max.max(greatest);
        map.push(greatest as f32);
        let weight = 1.0 / (variance[1] * per_sample);
        let (d, r) = (value[1] - mean[1], mean[1]);
        let terms = [d * r * weight, r * r * weight];
        // A noiseless background would outweigh everything else.
        let is_noisy = variance[1] > VARIANCE_FLOOR;
        for (i, term) in terms.into_iter().enumerate() {
            all[i] += term;
            noisy[i] += if is_noisy { term } else { 0.0 };
        }
    }
    let any_noise = colors(reference.variance)?.any(|v| xyz(v)[1] > VARIANCE_FLOOR);
    let [fit, information] = if any_noise { noisy } else { all };
    let information = information.max(1e-30);
    let (gain, gain_error) = (fit / information, 1.0 / information.sqrt());
    let gain_allowed = GAIN.max(4.0 * gain_error);
    let accepted = accepted as f64 / 3.0 / pixels;
    Ok(Outcome {
        passed: accepted >= ACCEPTED && gain.abs() <= gain_allowed && not_finite == 0,
        accepted,
        gain,
        gain_error,
        gain_allowed,
        z_rms: (z_squares / (3.0 * pixels)).sqrt(),
        z_max,
        z_bound: bound,
        not_finite,
        pixels: pixels as usize,
        map,
    })
}

impl Outcome {
    /// The outcome in words.
    pub fn sentence(&self) -> String {
        let Self {
            accepted,
            gain,
            gain_allowed,
            not_finite,
            ..
        } = self;
        format!(
            "{}: {:.3} % of the values accepted (99.75 % wanted), gain {:+.3} % (±{:.3} % allowed), \
             {not_finite} pixels not finite",
            if self.passed {
                "the image agrees with the reference"
            } else {
                "the image differs from the reference"
            },
            100.0 * accepted,
            100.0 * gain,
            100.0 * gain_allowed,
        )
    }
}

/// Red, green and blue of each pixel.
fn colors(layer: &Layer) -> Result<impl Iterator<Item = [f64; 3]>> {
    let rgb = layer
        .rgb
        .ok_or_else(|| Error::input("the z-test needs a colour, R, G and B"))?;
    let pixels = layer
        .image
        .data()
        .chunks_exact(layer.image.channels().len());
    Ok(pixels.map(move |p| rgb.map(|c| f64::from(p[c]))))
}

fn xyz(rgb: [f64; 3]) -> [f64; 3] {
    XYZ.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2])
}
