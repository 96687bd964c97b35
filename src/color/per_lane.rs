//! Stored colours in lanes, each lane its own: the paths of a block look toward different lights, and have met different
//! squares of a checkerboard. What lanes have is put together first and evaluated once, for in bands it is evaluating
//! that takes long.

use super::bands::Bands;
use super::comb::Teeth;
use super::d65::d65_lanes;
use super::model::ColorModel;
use super::samples::{Columns, Spectra as _};
use super::spectrum::{Spectrum, Upsampled};
use super::upsample::{Sigmoid, eval_lanes};
use crate::lanes::{Call, Lanes, Mask as _};

/// A stored colour a lane. Wavelengths are given from the first lane on.
pub trait PerLane<C: ColorModel, F: Lanes>: Sized {
    /// Darkness.
    fn zero() -> Self;
    /// Gives lanes a colour times a factor.
    fn put(&mut self, lanes: F::Mask, stored: &C::Stored, factor: F, w: &[C::Wavelengths]);
    /// Gives lanes values that are known already.
    fn put_values(&mut self, lanes: F::Mask, values: C::Columns<F>);
    /// All lanes' colours at their paths' wavelengths.
    fn evaluate(self, w: &[C::Wavelengths]) -> C::Columns<F>;
}

/// Where colours are the same whatever the wavelengths.
impl<C: ColorModel<Columns<F> = Self>, F: Lanes, const N: usize> PerLane<C, F> for Columns<F, N> {
    #[inline(always)]
    fn zero() -> Self {
        Self([F::zero(); N])
    }

    #[inline(always)]
    fn put(&mut self, lanes: F::Mask, stored: &C::Stored, factor: F, w: &[C::Wavelengths]) {
        let values = C::evaluate_lanes::<F>(stored, w) * factor;
        *self = Self::select(lanes, values, *self);
    }

    #[inline(always)]
    fn put_values(&mut self, lanes: F::Mask, values: Self) {
        *self = Self::select(lanes, values, *self);
    }

    #[inline(always)]
    fn evaluate(self, _w: &[C::Wavelengths]) -> Self {
        self
    }
}

/// A spectrum a lane: an upsampled one, or values.
#[derive(Clone, Copy, Debug)]
pub struct SpectrumPerLane<F: Lanes, const N: usize> {
    /// The lanes that have an upsampled one.
    upsampled: F::Mask,
    /// As in [`Upsampled`].
    scale: F,
    sigmoid: [F; 3],
    illuminant: F::Mask,
    /// Of all other lanes; `None` where they are dark.
    values: Option<Columns<F, N>>,
}

impl<F: Lanes, const N: usize> PerLane<Bands<N>, F> for SpectrumPerLane<F, N> {
    #[inline(always)]
    fn zero() -> Self {
        let none = F::Mask::splat(false);
        Self {
            upsampled: none,
            scale: F::zero(),
            sigmoid: [F::zero(); 3],
            illuminant: none,
            values: None,
        }
    }

    #[inline(always)]
    fn put(&mut self, lanes: F::Mask, stored: &Spectrum, factor: F, w: &[Teeth<f32>]) {
        match stored {
            Spectrum::Flat(value) => self.put_upsampled(lanes, &Upsampled::flat(*value), factor),
            Spectrum::Upsampled(upsampled) => self.put_upsampled(lanes, upsampled, factor),
            Spectrum::Curve(_) | Spectrum::Even(_) => {
                let values = Bands::<N>::evaluate_lanes::<F>(stored, w);
                self.put_values(lanes, values * factor);
            }
        }
    }

    #[inline(always)]
    fn put_values(&mut self, lanes: F::Mask, values: Columns<F, N>) {
        self.upsampled = self.upsampled & !lanes;
        let before = self.values.unwrap_or(Columns([F::zero(); N]));
        self.values = Some(Columns::select(lanes, values, before));
    }

    #[inline(always)]
    fn evaluate(self, w: &[Teeth<f32>]) -> Columns<F, N> {
        match self.values {
            Some(values) if !self.upsampled.any() => values,
            Some(values) => Columns::select(self.upsampled, self.evaluate_upsampled(w), values),
            None => self.evaluate_upsampled(w),
        }
    }
}

impl<F: Lanes, const N: usize> SpectrumPerLane<F, N> {
    #[inline(always)]
    fn put_upsampled(&mut self, lanes: F::Mask, spectrum: &Upsampled, factor: F) {
        self.upsampled = self.upsampled | lanes;
        self.scale = F::select(lanes, F::splat(spectrum.scale) * factor, self.scale);
        for (own, c) in self.sigmoid.iter_mut().zip(spectrum.sigmoid.c) {
            *own = F::select(lanes, F::splat(c), *own);
        }
        let illuminant = F::Mask::splat(spectrum.illuminant);
        self.illuminant = (lanes & illuminant) | (!lanes & self.illuminant);
    }

    #[inline(always)]
    fn evaluate_upsampled(&self, wavelengths: &[Teeth<f32>]) -> Columns<F, N> {
        F::call(Evaluation {
            spectra: self,
            wavelengths,
        })
    }
}

/// The arguments of [`SpectrumPerLane::evaluate_upsampled`].
struct Evaluation<'a, F: Lanes, const N: usize> {
    spectra: &'a SpectrumPerLane<F, N>,
    wavelengths: &'a [Teeth<f32>],
}

impl<F: Lanes, const N: usize> Call<F> for Evaluation<'_, F, N> {
    type Output = Columns<F, N>;

    #[inline(always)]
    fn run(self) -> Columns<F, N> {
        let SpectrumPerLane {
            scale,
            sigmoid,
            illuminant,
            ..
        } = *self.spectra;
        let wavelengths = Teeth::<F>::of(self.wavelengths);
        let mut values = Columns([F::zero(); N]);
        for (number, value) in values.0.iter_mut().enumerate() {
            let lambda = wavelengths.at(number);
            *value = scale * eval_lanes(sigmoid, lambda);
            if illuminant.any() {
                *value = F::select(illuminant, *value * d65_lanes(lambda), *value);
            }
        }
        values
    }
}

impl Upsampled {
    /// The same everywhere.
    fn flat(value: f32) -> Self {
        Self {
            scale: value,
            sigmoid: Sigmoid::constant(1.0),
            illuminant: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::{Color, Role};
    use super::super::rgb::Rgb;
    use super::super::samples::Spectral;
    use super::*;
    use crate::lanes::{Kernel, MAX_LANES, Task};

    /// A colour a lane, each put in its turn, beside what it is by itself.
    struct Beside<'a, C: ColorModel> {
        stored: &'a [C::Stored],
        w: &'a [C::Wavelengths; MAX_LANES],
    }

    impl<C: ColorModel> Task for Beside<'_, C> {
        type Output = ();

        fn run<F: Lanes>(self) {
            let Self { stored, w } = self;
            let mut colors = C::PerLane::<F>::zero();
            // One colour each, then values, then nothing.
            let (count, own) = (stored.len(), |lane: usize| lane % (stored.len() + 2));
            let lanes_of = |kinds: std::ops::RangeInclusive<usize>| {
                let lanes = (0..F::WIDTH).filter(|lane| kinds.contains(&own(*lane)));
                F::Mask::from_bits(lanes.fold(0, |bits, lane| bits | 1 << lane))
            };
            for (number, stored) in stored.iter().enumerate() {
                // What is put later takes the place of what was there.
                let factor = F::splat(number as f32 + 0.5);
                colors.put(lanes_of(number..=count), stored, factor, w);
            }
            colors.put_values(
                lanes_of(count..=count),
                C::Columns::<F>::splat(F::splat(0.25)),
            );
            let rows = colors.evaluate(w).rows();
            for (lane, w) in w.iter().enumerate().take(F::WIDTH) {
                let value: C::Sample = C::Columns::<F>::of(&rows, lane);
                let expected = match own(lane) {
                    own if own < stored.len() => C::evaluate(&stored[own], w) * (own as f32 + 0.5),
                    own if own == stored.len() => C::Sample::splat(0.25),
                    _ => C::Sample::zero(),
                };
                for channel in 0..C::Sample::LANES {
                    let (value, expected) = (value[channel], expected[channel]);
                    let error = (value - expected).abs();
                    assert!(error <= 1e-5 * expected.abs(), "{value} {expected}");
                }
            }
        }
    }

    fn compare<C: ColorModel>(model: &C) {
        let curve = vec![(400.0, 1.0), (500.0, 2.0), (700.0, 3.0)];
        let colors = [
            (Color::Rgb([0.2, 0.5, 0.1]), Role::Emission),
            (Color::Rgb([0.2, 0.5, 0.1]), Role::Reflectance),
            (Color::Flat(0.7), Role::Quantity),
            (Color::Curve(curve), Role::Emission),
        ];
        let stored = colors.map(|(color, role)| model.store(&color, role).unwrap());
        let w = std::array::from_fn(|lane| model.wavelengths(|| lane as f32 / 16.0));
        for kernel in Kernel::all() {
            for count in 1..=stored.len() {
                let stored = &stored[..count];
                kernel.run(Beside::<C> { stored, w: &w });
            }
        }
    }

    #[test]
    fn each_lane_has_the_colour_that_it_was_given_last() {
        compare(&Rgb);
        compare(&Bands::<8>::visible(8).unwrap());
        compare(&Bands::<16>::visible(11).unwrap());
    }
}
