//! N spectral bands: a range, by default the visible one of 360–830 nm, cut into equal bands. A path carries one
//! wavelength a band, all shifted inside their bands by one shared random number, so that a band's value is an
//! unbiased average over the band. XYZ is summed per sample at the sampled wavelengths, never from band
//! averages, so that the RGB image is unbiased whatever N. A film of responses has a channel for each of them
//! in place of the bands.

use std::sync::{Arc, OnceLock};

use super::cie::{self, Between};
use super::comb::{Comb, Teeth};
use super::d65::d65;
use super::model::{Color, ColorModel, Role, xyz_to_rgb};
use super::per_lane::SpectrumPerLane;
use super::response::Response;
use super::samples::{Columns, Samples, Spectra as _, Spectral as _};
use super::spectrum::{Spectrum, Upsampled};
use super::texels::Pixels;
use super::upsample::Table;
use crate::lanes::{self, Call, Ints as _, Kernel, Lanes, MAX_LANES, SMALL_TABLE, Task, Vec2};

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
    type Wavelengths = Teeth<f32>;
    type Sample = Samples<N>;
    type Columns<F: Lanes> = Columns<F, N>;
    type PerLane<F: Lanes> = SpectrumPerLane<F, N>;

    fn passes(&self) -> u32 {
        self.comb.count().div_ceil(self.carried.count()) as u32
    }

    #[inline]
    fn wavelengths(&self, u: impl FnOnce() -> f32) -> Teeth<f32> {
        self.carried.teeth(0, 1, u())
    }

    #[inline]
    fn wavelengths_of(&self, pass: u32, u: impl FnOnce() -> f32) -> Teeth<f32> {
        (self.comb).teeth(pass as usize, self.passes() as usize, u())
    }

    #[inline(always)]
    fn narrowed(wavelengths: &Teeth<f32>, throughput: &Samples<N>) -> Teeth<f32> {
        let mut carrying = (0..N).filter(|band| throughput.0[*band] != 0.0);
        match (carrying.next(), carrying.next()) {
            (Some(only), None) => wavelengths.only(only),
            _ => *wavelengths,
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
    fn evaluate(stored: &Spectrum, wavelengths: &Teeth<f32>) -> Samples<N> {
        Kernel::best().run(OverBands {
            stored,
            wavelengths,
        })
    }

    #[inline(always)]
    fn evaluate_lanes<F: Lanes>(stored: &Spectrum, wavelengths: &[Teeth<f32>]) -> Columns<F, N> {
        F::call(Evaluation {
            stored,
            wavelengths,
        })
    }

    fn evaluate_rgb(&self, rgb: [f32; 3], role: Role, wavelengths: &Teeth<f32>) -> Samples<N> {
        let texel = Upsampled::of_texel(Table::shared(), rgb, role);
        Samples(texel.sample(&wavelengths.all()))
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
        wavelengths: &[Teeth<f32>],
    ) -> Columns<F, N> {
        let mut row = F::Int::ROW;
        index.store(&mut row);
        Columns::from_samples(|lane| {
            Samples::<N>(texel(texels, row[lane]).sample(&wavelengths[lane].all()))
        })
    }

    /// As Mitsuba's spectral variants do it: scale and shape are interpolated apart, and then multiplied.
    #[inline(always)]
    fn evaluate_between<F: Lanes>(
        texels: &Vec<Upsampled>,
        corners: [[F::Int; 2]; 2],
        place: Vec2<F>,
        wavelengths: &[Teeth<f32>],
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
            let wavelengths: [f32; N] = wavelengths[lane].all();
            let mut scale = 0.0;
            let mut shape = [0.0; N];
            for (row, wy) in rows.iter().zip([1.0 - fy, fy]) {
                for (corner, wx) in row.iter().zip([1.0 - fx, fx]) {
                    let texel = texel(texels, corner[lane]);
                    let weight = wx * wy;
                    scale += weight * texel.scale;
                    for (sum, l) in shape.iter_mut().zip(&wavelengths) {
                        *sum += weight * texel.sigmoid.eval(*l);
                    }
                }
            }
            let light = texel(texels, rows[0][0][lane]).illuminant;
            Samples::<N>::from_fn(|i| {
                let power = if light { d65(wavelengths[i]) } else { 1.0 };
                scale * shape[i] * power
            })
        })
    }

    fn luminance(&self, sample: &Samples<N>, wavelengths: &Teeth<f32>) -> f32 {
        let (mut sum, mut white) = (0.0, 0.0);
        for i in 0..self.carried.count() {
            let weight = cie::xyz(wavelengths.at(i))[1];
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

    fn develop(&self, pass: u32, sample: &Samples<N>, wavelengths: &Teeth<f32>, out: &mut [f32]) {
        let rgb = Kernel::best().run(Seen {
            values: &sample.0,
            wavelengths,
        });
        for c in 0..3 {
            out[c] = rgb[c] * self.comb.width();
        }
        let values = &sample.0[..wavelengths.count()];
        match (self.responses.is_empty(), self.passes() as usize) {
            (true, 1) => out[3..][..values.len()].copy_from_slice(values),
            (true, passes) => {
                let bands = &mut out[3..][..self.comb.count()];
                bands.fill(0.0);
                let own = bands[pass as usize..].iter_mut().step_by(passes);
                for (band, value) in own.zip(values) {
                    *band = *value;
                }
            }
            (false, _) => {
                for (out, response) in out[3..].iter_mut().zip(self.responses.iter()) {
                    *out = response.of(&self.comb, values, wavelengths);
                }
            }
        }
    }
}

/// The observer's curves as linear BT.709, at their nodes, in 1/nm.
fn observer() -> &'static [[f32; SMALL_TABLE]; 3] {
    static NODES: OnceLock<[[f32; SMALL_TABLE]; 3]> = OnceLock::new();
    NODES.get_or_init(|| {
        let mut nodes = [[0.0; SMALL_TABLE]; 3];
        for i in 0..cie::SAMPLES {
            let xyz = [cie::X[i], cie::Y[i], cie::Z[i]];
            let scaled = xyz.map(|v| f64::from(v) * f64::from(cie::NORMALIZATION));
            for (nodes, value) in nodes.iter_mut().zip(xyz_to_rgb(scaled)) {
                nodes[i] = value as f32;
            }
        }
        nodes
    })
}

/// What the observer makes of values at wavelengths, which are in lanes: linear BT.709, a nanometre each.
struct Seen<'a, const N: usize> {
    values: &'a [f32; N],
    wavelengths: &'a Teeth<f32>,
}

impl<const N: usize> Task for Seen<'_, N> {
    type Output = [f32; 3];

    #[inline(always)]
    fn run<F: Lanes>(self) -> [f32; 3] {
        let observer = observer();
        let mut sums = [[0.0; MAX_LANES]; 3];
        for part in (0..MAX_LANES).step_by(F::WIDTH) {
            let mut sum = [F::zero(); 3];
            for first in (part..N).step_by(MAX_LANES) {
                let values = &self.values[first..];
                let value = match values.len() < F::WIDTH {
                    true => F::from_fn(|lane| values.get(lane).copied().unwrap_or(0.0)),
                    false => F::from_slice(values),
                };
                // The last pass may have a lane that is no band's.
                let value = F::select(self.wavelengths.there::<F>(first), value, F::zero());
                let place = Between::of(self.wavelengths.from::<F>(first));
                for (sum, curve) in sum.iter_mut().zip(observer) {
                    *sum = *sum + value * place.look_up(curve);
                }
            }
            for (sums, sum) in sums.iter_mut().zip(sum) {
                sum.store_to(&mut sums[part..]);
            }
        }
        [
            lanes::sum_by_halves(sums[0]),
            lanes::sum_by_halves(sums[1]),
            lanes::sum_by_halves(sums[2]),
        ]
    }
}

/// The arguments of [`ColorModel::evaluate`], whose bands are in lanes.
struct OverBands<'a, const N: usize> {
    stored: &'a Spectrum,
    wavelengths: &'a Teeth<f32>,
}

impl<const N: usize> Task for OverBands<'_, N> {
    type Output = Samples<N>;

    #[inline(always)]
    fn run<F: Lanes>(self) -> Samples<N> {
        let mut values = [0.0; N];
        for (number, values) in values.chunks_mut(F::WIDTH).enumerate() {
            let wavelengths = self.wavelengths.from(number * F::WIDTH);
            let row = self.stored.at_lanes::<F>(wavelengths).row();
            values.copy_from_slice(&row.as_ref()[..values.len()]);
        }
        Samples(values)
    }
}

/// The arguments of [`ColorModel::evaluate_lanes`].
struct Evaluation<'a, const N: usize> {
    stored: &'a Spectrum,
    wavelengths: &'a [Teeth<f32>],
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
            return Columns::from_samples(|lane| {
                Samples(stored.sample(&wavelengths[lane].all::<N>()))
            });
        }
        let wavelengths = Teeth::<F>::of(wavelengths);
        let mut values = Columns([F::zero(); N]);
        for (number, value) in values.0.iter_mut().enumerate() {
            *value = stored.at_lanes(wavelengths.at(number));
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

    /// The bits of a spectrum at the wavelengths of some of a comb's paths, and of what an observer makes of it, by each
    /// kernel.
    fn bits_of<const N: usize>(count: usize, color: &Color) -> Vec<Vec<u32>> {
        let bands = Bands::<N>::visible(count).unwrap();
        let stored = bands.store(color, Role::Emission).unwrap();
        let bits = |kernel: Kernel| {
            let shifts = (0..40).map(|i| i as f32 / 40.0);
            let paths = shifts.flat_map(|u| {
                let wavelengths = &bands.wavelengths(|| u);
                let stored = &stored;
                let values = kernel.run(OverBands::<N> {
                    stored,
                    wavelengths,
                });
                let rgb = kernel.run(Seen {
                    values: &values.0,
                    wavelengths,
                });
                values.0.into_iter().chain(rgb)
            });
            paths.map(f32::to_bits).collect()
        };
        Kernel::all().into_iter().map(bits).collect()
    }

    #[test]
    fn every_kernel_sees_the_same_bits() {
        let even = (0..40).map(|i| (400.0 + 7.0 * f64::from(i), f64::from(i * i % 7)));
        for color in [
            Color::Rgb([0.2, 0.5, 3.0]),
            Color::Flat(0.7),
            Color::Curve(even.collect()),
            Color::Curve(vec![(450.0, 1.0), (500.0, 2.0), (700.0, 0.5)]),
        ] {
            for bits in [
                bits_of::<8>(5, &color),
                bits_of::<16>(16, &color),
                bits_of::<32>(29, &color),
            ] {
                assert!(
                    bits.iter().all(|of_kernel| *of_kernel == bits[0]),
                    "{color:?}"
                );
            }
        }
    }

    #[test]
    fn each_band_is_in_one_pass() {
        for count in [1, 7, 8, 9, 17, 100] {
            let bands = Bands::<8>::visible(count).unwrap();
            let mut all = Vec::new();
            for pass in 0..bands.passes() {
                let wavelengths = bands.wavelengths_of(pass, || 0.5);
                all.extend((0..wavelengths.count()).map(|i| wavelengths.at(i)));
            }
            all.sort_unstable_by(f32::total_cmp);
            assert_eq!(all.len(), count);
            for (band, wavelength) in all.into_iter().enumerate() {
                let error = wavelength - bands.comb.wavelength(band, 0.5);
                assert!(error.abs() < 1e-3, "{count}: {wavelength} nm");
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
