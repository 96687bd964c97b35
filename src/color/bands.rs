//! N spectral bands: the visible range, 360–830 nm, cut into equal bands. A path carries one wavelength
//! a band, all shifted inside their bands by one shared random number, so that a band's value is an
//! unbiased average over the band. XYZ is summed per sample at the sampled wavelengths, never from band
//! averages, so that the RGB image is unbiased whatever N.

use std::sync::Arc;

use super::cie;
use super::d65::d65;
use super::model::{Color, ColorModel, Role, xyz_to_rgb};
use super::rgb::{check, curve};
use super::samples::{Columns, Samples, Spectra as _, Spectral};
use super::texels::Pixels;
use super::upsample::{Sigmoid, Table, fit};
use crate::lanes::{Ints as _, Kernel, Lanes, Task};

/// Up to `N` bands in `N` lanes; lanes in excess carry nothing.
#[derive(Clone, Copy, Debug)]
pub struct Bands<const N: usize> {
    count: usize,
}

impl<const N: usize> Bands<N> {
    /// `count` bands; `None` unless 1 ≤ count ≤ `N`.
    pub fn new(count: usize) -> Option<Self> {
        (1..=N).contains(&count).then_some(Self { count })
    }

    /// A band's width in nm.
    fn width(&self) -> f32 {
        (cie::LAST - cie::FIRST) / self.count as f32
    }
}

/// A spectrum over wavelength.
#[derive(Clone, Debug)]
pub enum Spectrum {
    /// The same everywhere.
    Flat(f32),
    /// Scale times a reflectance that was upsampled from RGB, times D65 where it is light.
    Upsampled {
        /// The factor.
        scale: f32,
        /// The shape.
        sigmoid: Sigmoid,
        /// Whether D65 multiplies it.
        illuminant: bool,
    },
    /// Points of (nm, value).
    Curve(Arc<[(f64, f64)]>),
}

impl Spectrum {
    fn at(&self, lambda: f32) -> f32 {
        match self {
            Self::Flat(value) => *value,
            Self::Upsampled {
                scale,
                sigmoid,
                illuminant,
            } => {
                let light = if *illuminant { d65(lambda) } else { 1.0 };
                scale * light * sigmoid.eval(lambda)
            }
            Self::Curve(points) => curve(points, f64::from(lambda)) as f32,
        }
    }
}

/// A texel's upsampled spectrum.
#[derive(Clone, Copy, Debug)]
pub struct SpectralTexel {
    scale: f32,
    sigmoid: Sigmoid,
    illuminant: bool,
}

impl SpectralTexel {
    fn new(table: &Table, rgb: [f32; 3], role: Role) -> Self {
        let (scale, rgb) = match role {
            Role::Reflectance => (1.0, rgb.map(|v| v.clamp(0.0, 1.0))),
            Role::Emission | Role::Quantity | Role::Tabulated => scaled(rgb),
        };
        Self {
            scale,
            sigmoid: table.lookup(rgb),
            illuminant: role == Role::Emission,
        }
    }

    #[inline]
    fn evaluate<const N: usize>(&self, wavelengths: &[f32; N]) -> Samples<N> {
        Samples(wavelengths.map(|l| {
            let light = if self.illuminant { d65(l) } else { 1.0 };
            self.scale * light * self.sigmoid.eval(l)
        }))
    }
}

/// Splits an RGB triple of any brightness into a scale and a reflectance, as Mitsuba does for light.
fn scaled(rgb: [f32; 3]) -> (f32, [f32; 3]) {
    let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]);
    if scale > 0.0 {
        (scale, rgb.map(|v| v / scale))
    } else {
        (0.0, [0.0; 3])
    }
}

impl<const N: usize> ColorModel for Bands<N> {
    type Stored = Spectrum;
    type Texels = Vec<SpectralTexel>;
    /// nm; 0 in the lanes that are not in use.
    type Wavelengths = [f32; N];
    type Sample = Samples<N>;
    type Columns<F: Lanes> = Columns<F, N>;

    fn run<T: Task>(_kernel: Kernel, task: T) -> T::Output {
        task.run::<f32>()
    }

    #[inline]
    fn wavelengths(&self, u: impl FnOnce() -> f32) -> [f32; N] {
        let (u, width) = (u(), self.width());
        std::array::from_fn(|i| {
            if i < self.count {
                cie::FIRST + (i as f32 + u) * width
            } else {
                0.0
            }
        })
    }

    fn unit(&self) -> Samples<N> {
        Samples::from_fn(|i| if i < self.count { 1.0 } else { 0.0 })
    }

    fn store(&self, color: &Color, role: Role) -> Result<Spectrum, String> {
        let light = role == Role::Emission;
        Ok(match color {
            Color::D65(rgb) => {
                check(*rgb, role.unbounded())?;
                let (scale, rgb) = scaled(rgb.map(|v| v as f32));
                Spectrum::Upsampled {
                    scale,
                    sigmoid: fit(rgb),
                    illuminant: true,
                }
            }
            Color::Grey(value) => {
                check([*value], role)?;
                let (scale, grey) = (2.0 * *value as f32, Sigmoid::constant(0.5));
                if light {
                    Spectrum::Upsampled {
                        scale,
                        sigmoid: grey,
                        illuminant: true,
                    }
                } else {
                    Spectrum::Flat(*value as f32)
                }
            }
            Color::Flat(value) => {
                check([*value], role)?;
                Spectrum::Flat(*value as f32)
            }
            Color::Rgb(rgb) => {
                check(*rgb, role)?;
                let rgb = rgb.map(|v| v as f32);
                match role {
                    Role::Reflectance => Spectrum::Upsampled {
                        scale: 1.0,
                        sigmoid: fit(rgb),
                        illuminant: false,
                    },
                    Role::Emission | Role::Quantity | Role::Tabulated => {
                        let (scale, rgb) = scaled(rgb);
                        Spectrum::Upsampled {
                            scale,
                            sigmoid: fit(rgb),
                            illuminant: light,
                        }
                    }
                }
            }
            Color::Curve(points) => {
                check(
                    points.iter().map(|p| p.1),
                    if light { role } else { Role::Quantity },
                )?;
                let bounded = |v: f64| {
                    if role == Role::Reflectance {
                        v.clamp(0.0, 1.0)
                    } else {
                        v
                    }
                };
                Spectrum::Curve(points.iter().map(|p| (p.0, bounded(p.1))).collect())
            }
        })
    }

    #[inline]
    fn evaluate(stored: &Spectrum, wavelengths: &[f32; N]) -> Samples<N> {
        Samples(wavelengths.map(|l| stored.at(l)))
    }

    fn evaluate_rgb(&self, rgb: [f32; 3], role: Role, wavelengths: &[f32; N]) -> Samples<N> {
        SpectralTexel::new(Table::shared(), rgb, role).evaluate(wavelengths)
    }

    fn texel_bytes(_pixels: &Pixels) -> usize {
        size_of::<SpectralTexel>()
    }

    fn texels(&self, pixels: Pixels, role: Role) -> Vec<SpectralTexel> {
        let table = Table::shared();
        let texel = |rgb| SpectralTexel::new(table, rgb, role);
        pixels.iter().map(texel).collect()
    }

    #[inline(always)]
    fn evaluate_texels<F: Lanes>(
        texels: &Vec<SpectralTexel>,
        index: F::Int,
        wavelengths: &[[f32; N]],
    ) -> Columns<F, N> {
        let mut row = F::Int::ROW;
        index.store(&mut row);
        Columns::from_samples(|lane| {
            let index = row[lane] as usize;
            let texel = &texels[index.min(texels.len() - 1)];
            texel.evaluate(&wavelengths[lane])
        })
    }

    fn luminance(&self, sample: &Samples<N>, wavelengths: &[f32; N]) -> f32 {
        let (mut sum, mut white) = (0.0, 0.0);
        for i in 0..self.count {
            let weight = cie::xyz(wavelengths[i])[1];
            sum += weight * sample[i];
            white += weight;
        }
        if white > 0.0 { sum / white } else { 0.0 }
    }

    fn channels(&self) -> Vec<String> {
        let width = self.width();
        let edge = |i: usize| cie::FIRST + i as f32 * width;
        let mut names = ["R", "G", "B"].map(String::from).to_vec();
        // Zero-padded, for EXR sorts its channels by name.
        names.extend(
            (0..self.count).map(|i| format!("band.{i:02}_{:.1}-{:.1}nm", edge(i), edge(i + 1))),
        );
        names
    }

    fn develop(&self, sample: &Samples<N>, wavelengths: &[f32; N], out: &mut [f32]) {
        let mut xyz = [0.0; 3];
        for i in 0..self.count {
            let weight = cie::xyz(wavelengths[i]);
            for c in 0..3 {
                xyz[c] += f64::from(sample[i] * weight[c]);
            }
        }
        let scale = f64::from(self.width() * cie::NORMALIZATION);
        let rgb = xyz_to_rgb(xyz.map(|v| v * scale));
        for c in 0..3 {
            out[c] = rgb[c] as f32;
        }
        out[3..3 + self.count].copy_from_slice(&sample.0[..self.count]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The RGB that N bands make of a colour, averaged over shifts of the comb.
    fn rgb_of<const N: usize>(count: usize, color: &Color, role: Role, light: &Color) -> [f64; 3] {
        let bands = Bands::<N>::new(count).unwrap();
        let (color, light) = (
            bands.store(color, role).unwrap(),
            bands.store(light, Role::Emission).unwrap(),
        );
        let mut sum = [0.0; 3];
        let n = 200;
        for i in 0..n {
            let w = bands.wavelengths(|| (i as f32 + 0.5) / n as f32);
            let mut out = vec![0.0; 3 + count];
            let value =
                Bands::<N>::evaluate(&color, &w) * Bands::<N>::evaluate(&light, &w) * bands.unit();
            bands.develop(&value, &w, &mut out);
            for c in 0..3 {
                sum[c] += f64::from(out[c]) / f64::from(n);
            }
        }
        sum
    }

    /// Mitsuba 3.9.1 `scalar_spectral`.
    #[test]
    fn every_number_of_bands_makes_the_same_rgb_as_mitsuba() {
        let rgb = Color::Rgb([0.2, 0.5, 3.0]);
        let one = Color::Flat(1.0);
        for (color, expected) in [
            (Color::Flat(1.0), [1.205_961, 0.949_195_5, 0.912_521_7]),
            (Color::Grey(1.0), [0.999_989_1, 0.999_697, 1.003_182_6]),
            (rgb, [0.200_034_4, 0.498_063, 3.008_341_3]),
        ] {
            for result in [
                rgb_of::<8>(8, &one, Role::Quantity, &color),
                rgb_of::<16>(11, &one, Role::Quantity, &color),
                rgb_of::<32>(32, &one, Role::Quantity, &color),
            ] {
                for c in 0..3 {
                    assert!(
                        (result[c] / expected[c] - 1.0).abs() < 0.01,
                        "{color:?} {result:?} {expected:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_reflectance_keeps_its_rgb_under_d65() {
        let rgb = [0.2, 0.5, 0.8];
        let result = rgb_of::<16>(
            16,
            &Color::Rgb(rgb),
            Role::Reflectance,
            &Color::D65([1.0; 3]),
        );
        for c in 0..3 {
            assert!((result[c] - rgb[c]).abs() < 5e-3, "{result:?}");
        }
    }
}
