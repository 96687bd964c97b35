//! One number instead of a colour, for parameters that are numbers: opacity, roughness, weights. A
//! texture of numbers is a texture of this model.

use super::model::{Color, ColorModel, Role, luminance};
use super::rgb::{Rgb, check};
use super::samples::{Columns, Samples};
use super::texels::Pixels;
use crate::lanes::Lanes;

/// The model of plain numbers; a colour counts as its luminance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mono;

impl ColorModel for Mono {
    type Stored = f32;
    type Texels = Vec<f32>;
    type Wavelengths = ();
    type Sample = Samples<1>;
    type Columns<F: Lanes> = Columns<F, 1>;
    type PerLane<F: Lanes> = Columns<F, 1>;

    fn wavelengths(&self, _u: impl FnOnce() -> f32) {}

    fn unit(&self) -> Samples<1> {
        Samples([1.0])
    }

    fn store(&self, color: &Color, role: Role) -> Result<f32, String> {
        let value = match color {
            Color::Grey(value) | Color::Flat(value) => *value,
            Color::Rgb(rgb) => f64::from(luminance(rgb.map(|v| v as f32))),
            Color::D65(_) | Color::Curve(_) => return Ok(luminance(Rgb.store(color, role)?)),
        };
        check([value], role)?;
        Ok(value as f32)
    }

    fn remark(&self, color: &Color, role: Role) -> Option<String> {
        Rgb.remark(color, role)
    }

    fn evaluate(stored: &f32, _wavelengths: &()) -> Samples<1> {
        Samples([*stored])
    }

    #[inline(always)]
    fn evaluate_lanes<F: Lanes>(stored: &f32, _wavelengths: &[()]) -> Columns<F, 1> {
        Columns([F::splat(*stored)])
    }

    fn evaluate_rgb(&self, rgb: [f32; 3], role: Role, _wavelengths: &()) -> Samples<1> {
        let value = luminance(rgb);
        Samples([match role {
            Role::Reflectance => value.clamp(0.0, 1.0),
            _ => value,
        }])
    }

    fn texel_bytes(_pixels: &Pixels) -> usize {
        size_of::<f32>()
    }

    fn texels(&self, pixels: Pixels, role: Role) -> Vec<f32> {
        let value = |rgb| self.evaluate_rgb(rgb, role, &())[0];
        pixels.iter().map(value).collect()
    }

    #[inline(always)]
    fn evaluate_texels<F: Lanes>(texels: &Vec<f32>, index: F::Int, _: &[()]) -> Columns<F, 1> {
        Columns([F::gather(texels, index)])
    }

    fn luminance(&self, sample: &Samples<1>, _wavelengths: &()) -> f32 {
        sample.0[0]
    }

    fn channels(&self) -> Vec<String> {
        vec!["Y".into()]
    }

    fn develop(&self, _pass: u32, sample: &Samples<1>, _wavelengths: &(), out: &mut [f32]) {
        out[0] = sample.0[0];
    }
}
