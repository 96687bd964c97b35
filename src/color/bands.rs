//! N spectral bands: a range, by default the visible one of 360–830 nm, cut into equal bands. A path carries one
//! wavelength a band, all shifted inside their bands by one shared random number, so that a band's value is an
//! unbiased average over the band. XYZ is summed per sample at the sampled wavelengths, never from band
//! averages, so that the RGB image is unbiased whatever N. A film of responses has a channel for each of them
//! in place of the bands.

use std::sync::{Arc, OnceLock};

use super::cie;
use super::comb::Comb;
use super::d65::d65;
use super::model::{Color, ColorModel, Role, xyz_to_rgb};
use super::response::Response;
use super::samples::{Columns, Samples, Spectra as _, Spectral as _};
use super::spectrum::{Spectrum, Upsampled};
use super::texels::Pixels;
use super::upsample::Table;
use crate::lanes::{Call, Ints as _, Lanes, Vec2};

/// Bands of which a path carries up to `N` in `N` lanes; lanes in excess carry nothing. More bands take several passes.
#[derive(Clone, Debug)]
pub struct Bands<const N: usize> {
    comb: Comb,
    /// The range in as many bands as a path carries.
    carried: Comb,
    responses: Arc<[Response]>,
}

impl<const N: usize> Bands<N> {
    /// The bands of a comb, and what a film makes of them: its channels, or the bands themselves where there are none.
    pub fn new(comb: Comb, responses: Arc<[Response]>) -> Self {
        let passes = comb.count().div_ceil(N);
        Self {
            comb,
            carried: comb.cut(comb.count().div_ceil(passes)),
            responses,
        }
    }

    /// `count` bands over the visible range; `None` unless 1 ≤ count ≤ [`MAX_BANDS`](super::MAX_BANDS).
    pub fn visible(count: usize) -> Option<Self> {
        Some(Self::new(Comb::new(count, super::VISIBLE)?, Arc::default()))
    }

    /// The bands of a pass, in the order of lanes.
    fn bands_of(&self, pass: u32) -> impl Iterator<Item = usize> {
        (pass as usize..self.comb.count()).step_by(self.passes() as usize)
    }
}

/// How bands are called in spectral images: S0 is intensity without regard to polarisation, then the middle of the band,
/// with a comma, for a dot would begin a layer (Fichet, Pacanowski and Wilkie, *An OpenEXR layout for spectral images*,
/// JCGT 10 (3), 2021).
fn band_name(comb: &Comb, band: usize) -> String {
    let centre = format!("{:.6}", comb.centre(band)).replace('.', ",");
    format!("S0.{centre}nm")
}

impl<const N: usize> ColorModel for Bands<N> {
    type Stored = Spectrum;
    type Texels = Vec<Upsampled>;
    /// nm; lanes that are not in use have the first band's.
    type Wavelengths = [f32; N];
    type Sample = Samples<N>;
    type Columns<F: Lanes> = Columns<F, N>;

    fn passes(&self) -> u32 {
        self.comb.count().div_ceil(self.carried.count()) as u32
    }

    #[inline]
    fn wavelengths(&self, u: impl FnOnce() -> f32) -> [f32; N] {
        let (u, count) = (u(), self.carried.count());
        std::array::from_fn(|i| self.carried.wavelength(if i < count { i } else { 0 }, u))
    }

    #[inline]
    fn wavelengths_of(&self, pass: u32, u: impl FnOnce() -> f32) -> [f32; N] {
        let u = u();
        let mut wavelengths = [self.comb.wavelength(pass as usize, u); N];
        for (wavelength, band) in wavelengths.iter_mut().zip(self.bands_of(pass)) {
            *wavelength = self.comb.wavelength(band, u);
        }
        wavelengths
    }

    #[inline(always)]
    fn narrowed(wavelengths: &[f32; N], throughput: &Samples<N>) -> [f32; N] {
        let carrying = throughput.0.iter().filter(|v| **v != 0.0).count();
        let only = throughput.0.iter().position(|v| *v != 0.0);
        match only.filter(|_| carrying == 1) {
            Some(only) => [wavelengths[only]; N],
            None => *wavelengths,
        }
    }

    fn unit(&self) -> Samples<N> {
        Samples::from_fn(|i| if i < self.carried.count() { 1.0 } else { 0.0 })
    }

    fn store(&self, color: &Color, role: Role) -> Result<Spectrum, String> {
        Spectrum::new(color, role)
    }

    fn upsamples(&self) -> bool {
        true
    }

    #[inline]
    fn evaluate(stored: &Spectrum, wavelengths: &[f32; N]) -> Samples<N> {
        Samples(stored.sample(wavelengths))
    }

    #[inline(always)]
    fn evaluate_lanes<F: Lanes>(stored: &Spectrum, wavelengths: &[[f32; N]]) -> Columns<F, N> {
        F::call(Evaluation {
            stored,
            wavelengths,
        })
    }

    fn evaluate_rgb(&self, rgb: [f32; 3], role: Role, wavelengths: &[f32; N]) -> Samples<N> {
        let texel = Upsampled::of_texel(Table::shared(), rgb, role);
        Samples(texel.sample(wavelengths))
    }

    fn texel_bytes(_pixels: &Pixels) -> usize {
        size_of::<Upsampled>()
    }

    fn texels(&self, pixels: Pixels, role: Role) -> Vec<Upsampled> {
        let table = Table::shared();
        let texel = |rgb| Upsampled::of_texel(table, rgb, role);
        pixels.iter().map(texel).collect()
    }

    #[inline(always)]
    fn evaluate_texels<F: Lanes>(
        texels: &Vec<Upsampled>,
        index: F::Int,
        wavelengths: &[[f32; N]],
    ) -> Columns<F, N> {
        let mut row = F::Int::ROW;
        index.store(&mut row);
        Columns::from_samples(|lane| {
            Samples::<N>(texel(texels, row[lane]).sample(&wavelengths[lane]))
        })
    }

    /// As Mitsuba's spectral variants do it: scale and shape are interpolated apart, and then multiplied.
    #[inline(always)]
    fn evaluate_between<F: Lanes>(
        texels: &Vec<Upsampled>,
        corners: [[F::Int; 2]; 2],
        place: Vec2<F>,
        wavelengths: &[[f32; N]],
    ) -> Columns<F, N> {
        let (across, down) = (place.x.row(), place.y.row());
        let mut rows = [[F::Int::ROW; 2]; 2];
        for y in 0..2 {
            for x in 0..2 {
                corners[y][x].store(&mut rows[y][x]);
            }
        }
        Columns::from_samples(|lane| {
            let (fx, fy) = (across[lane], down[lane]);
            let mut scale = 0.0;
            let mut shape = [0.0; N];
            for (row, wy) in rows.iter().zip([1.0 - fy, fy]) {
                for (corner, wx) in row.iter().zip([1.0 - fx, fx]) {
                    let texel = texel(texels, corner[lane]);
                    let weight = wx * wy;
                    scale += weight * texel.scale;
                    for (sum, l) in shape.iter_mut().zip(&wavelengths[lane]) {
                        *sum += weight * texel.sigmoid.eval(*l);
                    }
                }
            }
            let light = texel(texels, rows[0][0][lane]).illuminant;
            Samples::<N>::from_fn(|i| {
                let power = if light {
                    d65(wavelengths[lane][i])
                } else {
                    1.0
                };
                scale * shape[i] * power
            })
        })
    }

    fn luminance(&self, sample: &Samples<N>, wavelengths: &[f32; N]) -> f32 {
        let (mut sum, mut white) = (0.0, 0.0);
        for i in 0..self.carried.count() {
            let weight = cie::xyz(wavelengths[i])[1];
            sum += weight * sample[i];
            white += weight;
        }
        if white > 0.0 { sum / white } else { 0.0 }
    }

    fn channels(&self) -> Vec<String> {
        let mut names = ["R", "G", "B"].map(String::from).to_vec();
        match self.responses.is_empty() {
            true => names.extend((0..self.comb.count()).map(|i| band_name(&self.comb, i))),
            false => names.extend(self.responses.iter().map(|r| r.name.clone())),
        }
        names
    }

    fn develop(&self, pass: u32, sample: &Samples<N>, wavelengths: &[f32; N], out: &mut [f32]) {
        let nodes = observer();
        let mut rgb = [0.0; 3];
        // The last pass may have a lane that is no band's.
        let count = self.bands_of(pass).count();
        let (values, wavelengths) = (&sample.0[..count], &wavelengths[..count]);
        for (value, wavelength) in values.iter().zip(wavelengths) {
            let Some((node, t)) = cie::locate(*wavelength) else {
                continue;
            };
            let (a, b) = (value * (1.0 - t), value * t);
            for c in 0..3 {
                rgb[c] += a * nodes[node][c] + b * nodes[node + 1][c];
            }
        }
        for c in 0..3 {
            out[c] = rgb[c] * self.comb.width();
        }
        if self.responses.is_empty() {
            out[3..3 + self.comb.count()].fill(0.0);
            for (band, value) in self.bands_of(pass).zip(values) {
                out[3 + band] = *value;
            }
        }
        for (out, response) in out[3..].iter_mut().zip(self.responses.iter()) {
            *out = response.of(&self.comb, values, wavelengths);
        }
    }
}

/// The observer's curves as linear BT.709, at their nodes, in 1/nm.
fn observer() -> &'static [[f32; 3]; cie::SAMPLES] {
    static NODES: OnceLock<[[f32; 3]; cie::SAMPLES]> = OnceLock::new();
    NODES.get_or_init(|| {
        std::array::from_fn(|i| {
            let xyz = [cie::X[i], cie::Y[i], cie::Z[i]];
            let scaled = xyz.map(|v| f64::from(v) * f64::from(cie::NORMALIZATION));
            xyz_to_rgb(scaled).map(|v| v as f32)
        })
    })
}

/// The arguments of [`ColorModel::evaluate_lanes`].
struct Evaluation<'a, const N: usize> {
    stored: &'a Spectrum,
    wavelengths: &'a [[f32; N]],
}

impl<F: Lanes, const N: usize> Call<F> for Evaluation<'_, N> {
    type Output = Columns<F, N>;

    #[inline(always)]
    fn run(self) -> Columns<F, N> {
        let Self {
            stored,
            wavelengths,
        } = self;
        if let Spectrum::Flat(value) = stored {
            return Columns([F::splat(*value); N]);
        }
        if let Spectrum::Curve(_) = stored {
            return Columns::from_samples(|lane| Samples(stored.sample(&wavelengths[lane])));
        }
        let mut values: Columns<F, N> = Columns::from_samples(|lane| Samples(wavelengths[lane]));
        for value in &mut values.0 {
            *value = stored.at_lanes(*value);
        }
        values
    }
}

/// A texel; what is beyond the last is that.
#[inline(always)]
fn texel(texels: &[Upsampled], index: u32) -> &Upsampled {
    &texels[(index as usize).min(texels.len() - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The RGB that N bands make of a colour, averaged over shifts of the comb.
    fn rgb_of<const N: usize>(count: usize, color: &Color, role: Role, light: &Color) -> [f64; 3] {
        let bands = Bands::<N>::visible(count).unwrap();
        let (color, light) = (
            bands.store(color, role).unwrap(),
            bands.store(light, Role::Emission).unwrap(),
        );
        let mut sum = [0.0; 3];
        let n = 200;
        for i in 0..n {
            for pass in 0..bands.passes() {
                let w = bands.wavelengths_of(pass, || (i as f32 + 0.5) / n as f32);
                let mut out = vec![0.0; 3 + count];
                let light = Bands::<N>::evaluate(&light, &w);
                let value = Bands::<N>::evaluate(&color, &w) * light * bands.unit();
                bands.develop(pass, &value, &w, &mut out);
                for c in 0..3 {
                    sum[c] += f64::from(out[c]) / f64::from(n);
                }
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
                rgb_of::<8>(19, &one, Role::Quantity, &color),
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
    fn each_band_is_in_one_pass() {
        for count in [1, 7, 8, 9, 17, 100] {
            let bands = Bands::<8>::visible(count).unwrap();
            let mut all: Vec<usize> = (0..bands.passes())
                .flat_map(|p| bands.bands_of(p))
                .collect();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..count), "{count}");
            for pass in 0..bands.passes() {
                let wavelengths = bands.wavelengths_of(pass, || 0.5);
                for (lane, band) in bands.bands_of(pass).enumerate() {
                    assert_eq!(
                        wavelengths[lane],
                        bands.comb.wavelength(band, 0.5),
                        "{count}"
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
