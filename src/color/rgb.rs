//! Three channels of linear BT.709. Spectral curves are integrated against the CIE observer while the
//! scene is built, as Mitsuba's RGB variants do: emission as it is, other quantities under D65.

use super::cie;
use super::d65::d65;
use super::model::{Color, ColorModel, Role, luminance, xyz_to_rgb};
use super::samples::{Columns, Samples};
use super::texels::{Packed, Pixels};
use crate::lanes::Lanes;

/// The RGB colour model.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rgb;

impl ColorModel for Rgb {
    type Stored = [f32; 3];
    type Texels = Packed;
    type Wavelengths = ();
    type Sample = Samples<3>;
    type Columns<F: Lanes> = Columns<F, 3>;
    type PerLane<F: Lanes> = Columns<F, 3>;

    fn wavelengths(&self, _u: impl FnOnce() -> f32) {}

    fn unit(&self) -> Samples<3> {
        Samples([1.0; 3])
    }

    fn store(&self, color: &Color, role: Role) -> Result<[f32; 3], String> {
        let rgb = match color {
            Color::Grey(value) => [*value; 3],
            Color::Rgb(rgb) => *rgb,
            Color::Flat(value) if role == Role::Emission => integrate(|_| *value),
            Color::Flat(value) => [*value; 3],
            Color::D65(rgb) => {
                check(*rgb, role.unbounded())?;
                return Ok(rgb.map(|v| v as f32));
            }
            Color::Curve(points) => {
                check(points.iter().map(|p| p.1), role.unbounded())?;
                into_gamut(seen(points, role), role)
            }
        };
        check(rgb, role)?;
        Ok(rgb.map(|v| v as f32))
    }

    fn remark(&self, color: &Color, role: Role) -> Option<String> {
        let Color::Curve(points) = color else {
            return None;
        };
        let rgb = seen(points, role);
        let inside = into_gamut(rgb, role);
        (inside != rgb).then(|| {
            let [r, g, b] = rgb.map(|v| v as f32);
            format!("the spectrum's colour {r:.3}, {g:.3}, {b:.3} is out of gamut, and is clamped")
        })
    }

    fn is_rgb(&self) -> bool {
        true
    }

    #[inline]
    fn evaluate(stored: &[f32; 3], _wavelengths: &()) -> Samples<3> {
        Samples(*stored)
    }

    #[inline(always)]
    fn evaluate_lanes<F: Lanes>(&[r, g, b]: &[f32; 3], _wavelengths: &[()]) -> Columns<F, 3> {
        Columns([F::splat(r), F::splat(g), F::splat(b)])
    }

    fn evaluate_rgb(&self, rgb: [f32; 3], role: Role, _wavelengths: &()) -> Samples<3> {
        Samples(match role {
            Role::Reflectance => rgb.map(|v| v.clamp(0.0, 1.0)),
            _ => rgb,
        })
    }

    fn texel_bytes(pixels: &Pixels) -> usize {
        pixels.size()
    }

    fn texels(&self, pixels: Pixels, role: Role) -> Packed {
        Packed::new(pixels, |rgb| self.evaluate_rgb(rgb, role, &()).0)
    }

    #[inline(always)]
    fn evaluate_texels<F: Lanes>(texels: &Packed, index: F::Int, _: &[()]) -> Columns<F, 3> {
        Columns(texels.at(index))
    }

    fn luminance(&self, sample: &Samples<3>, _wavelengths: &()) -> f32 {
        luminance(sample.0)
    }

    #[inline(always)]
    fn luminance_lanes<F: Lanes>(&self, samples: Columns<F, 3>, _wavelengths: &[()]) -> F {
        luminance(samples.0)
    }

    fn channels(&self) -> Vec<String> {
        ["R", "G", "B"].map(String::from).to_vec()
    }

    #[inline]
    fn develop(&self, _pass: u32, sample: &Samples<3>, _wavelengths: &(), out: &mut [f32]) {
        out[..3].copy_from_slice(&sample.0);
    }
}

/// The linear BT.709 of a curve: of light as it is, of other quantities under D65.
fn seen(points: &[(f64, f64)], role: Role) -> [f64; 3] {
    match role {
        Role::Reflectance | Role::Quantity => {
            integrate(|l| curve(points, l) * f64::from(d65(l as f32)))
        }
        Role::Emission | Role::Tabulated => integrate(|l| curve(points, l)),
    }
}

/// A spectrum's colour, clamped to what its role allows.
fn into_gamut(rgb: [f64; 3], role: Role) -> [f64; 3] {
    match role {
        Role::Reflectance => rgb.map(|v| v.clamp(0.0, 1.0)),
        Role::Emission | Role::Quantity => rgb.map(|v| v.max(0.0)),
        Role::Tabulated => rgb,
    }
}

/// Whether the values are what their role allows.
pub(super) fn check(values: impl IntoIterator<Item = f64>, role: Role) -> Result<(), String> {
    for v in values {
        if !v.is_finite() {
            return Err(format!("{v} is not a finite number"));
        }
        match role {
            Role::Reflectance if v > 1.0 && v <= 255.0 && v == v.trunc() => {
                return Err(format!(
                    "a reflectance lies in [0, 1], and {v} does not; codes up to 255 are written as #rrggbb"
                ));
            }
            Role::Reflectance if !(0.0..=1.0).contains(&v) => {
                return Err(format!("a reflectance lies in [0, 1], and {v} does not"));
            }
            Role::Emission if v < 0.0 => {
                return Err(format!("emission cannot be negative, and {v} is"));
            }
            _ => {}
        }
    }
    Ok(())
}

/// The value of a curve at a wavelength in nm: linear between its points, 0 outside.
pub(super) fn curve(points: &[(f64, f64)], lambda: f64) -> f64 {
    let after = points.partition_point(|p| p.0 <= lambda);
    match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (lambda - a.0) / (b.0 - a.0),
        (Some(last), None) if last.0 == lambda => last.1,
        _ => 0.0,
    }
}

/// Linear BT.709 of a spectrum: the CIE integral over 360–830 nm in 1000 steps.
fn integrate(spectrum: impl Fn(f64) -> f64) -> [f64; 3] {
    const STEPS: usize = 1000;
    let (first, last) = (f64::from(cie::FIRST), f64::from(cie::LAST));
    let mut xyz = [0.0; 3];
    for i in 0..STEPS {
        let lambda = first + (last - first) * (i as f64) / (STEPS as f64 - 1.0);
        let weight = cie::xyz(lambda as f32);
        let value = spectrum(lambda);
        for c in 0..3 {
            xyz[c] += value * f64::from(weight[c]);
        }
    }
    xyz_to_rgb(xyz.map(|v| v * (last - first) / STEPS as f64 * f64::from(cie::NORMALIZATION)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mitsuba 3.9.1 `scalar_rgb`, rendered under a constant emitter of that radiance.
    #[test]
    fn emission_curves_have_mitsuba_s_colours() {
        let points = vec![(400.0, 0.0), (500.0, 8.0), (600.0, 15.6), (700.0, 18.4)];
        let cases = [
            (Color::Flat(1.0), [1.204_782_4, 0.948_257_4, 0.908_932]),
            (Color::Curve(points), [20.710_936, 10.855_127, 2.771_202]),
            (Color::D65([2.0; 3]), [2.0, 2.0, 2.0]),
        ];
        for (color, expected) in cases {
            let rgb = Rgb.store(&color, Role::Emission).unwrap();
            for c in 0..3 {
                assert!(
                    (rgb[c] - expected[c]).abs() < 2e-3 * expected[c],
                    "{color:?}: {rgb:?} {expected:?}"
                );
            }
        }
    }

    #[test]
    fn reflectances_outside_the_unit_interval_are_refused() {
        assert!(
            Rgb.store(&Color::Rgb([0.5, 1.2, 0.0]), Role::Reflectance)
                .is_err()
        );
        assert!(
            Rgb.store(&Color::Rgb([0.5, 1.2, 0.0]), Role::Emission)
                .is_ok()
        );
        assert!(Rgb.store(&Color::Grey(-1.0), Role::Emission).is_err());
    }
}
