//! A comb of wavelengths: a range cut into equal bands, of which paths carry one wavelength each, all moved inside
//! their bands by one number.

use super::cie;
use crate::lanes::Lanes;

/// Equal bands side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comb {
    count: usize,
    first: f32,
    last: f32,
}

/// The most bands of an image.
pub const MAX_BANDS: usize = 1024;

/// The visible range, in nm, over which the observer's curves are known.
pub const VISIBLE: [f32; 2] = [cie::FIRST, cie::LAST];

impl Comb {
    /// `count` bands from the first to the second wavelength of `range` (nm); `None` unless there are 1 to [`MAX_BANDS`]
    /// and the range is positive and rises.
    pub fn new(count: usize, [first, last]: [f32; 2]) -> Option<Self> {
        let fits = (1..=MAX_BANDS).contains(&count);
        let rises = first > 0.0 && last > first && last.is_finite();
        (fits && rises).then_some(Self { count, first, last })
    }

    /// The same range in so many bands.
    pub(super) fn cut(self, count: usize) -> Self {
        Self { count, ..self }
    }

    /// How many bands.
    pub fn count(&self) -> usize {
        self.count
    }

    /// A band's width in nm.
    pub fn width(&self) -> f32 {
        (self.last - self.first) / self.count as f32
    }

    /// The wavelength in nm at the fraction `u` of a band, in [0, 1).
    #[inline]
    pub fn wavelength(&self, band: usize, u: f32) -> f32 {
        self.first + (band as f32 + u) * self.width()
    }

    /// The wavelengths at the fraction `u` of bands: of `first` and every `every`-th behind it.
    #[inline]
    pub(super) fn teeth(&self, first: usize, every: usize, u: f32) -> Teeth<f32> {
        Teeth {
            first: self.wavelength(first, u),
            step: every as f32 * self.width(),
            count: (self.count - first).div_ceil(every),
        }
    }

    /// The middle of a band in nm.
    pub fn centre(&self, band: usize) -> f64 {
        let (first, last) = (f64::from(self.first), f64::from(self.last));
        first + (last - first) * (band as f64 + 0.5) / self.count as f64
    }
}

/// Wavelengths at even steps, as a path carries them, one a band; those of paths in lanes if `F` is that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Teeth<F> {
    /// In nm.
    first: F,
    step: F,
    /// How many there are.
    count: usize,
}

impl<F: Lanes> Teeth<F> {
    /// Those of the paths of one wave, from the first lane on.
    #[inline(always)]
    pub(super) fn of(paths: &[Teeth<f32>]) -> Self {
        Self {
            first: F::from_fn(|lane| paths[lane].first),
            step: F::from_fn(|lane| paths[lane].step),
            count: paths[0].count,
        }
    }

    /// A wavelength in nm; beyond the last, the first.
    #[inline(always)]
    pub(super) fn at(&self, number: usize) -> F {
        let number = if number < self.count { number } else { 0 };
        self.first + self.step * F::splat(number as f32)
    }
}

impl Teeth<f32> {
    /// Each of the first `N`.
    #[inline(always)]
    pub(super) fn all<const N: usize>(&self) -> [f32; N] {
        std::array::from_fn(|number| self.at(number))
    }

    /// In lanes, one after another from one on.
    #[inline(always)]
    pub(super) fn from<F: Lanes>(&self, number: usize) -> F {
        let numbers = F::select(self.there::<F>(number), numbers_from(number), F::zero());
        F::splat(self.first) + F::splat(self.step) * numbers
    }

    /// Which of these there are.
    #[inline(always)]
    pub(super) fn there<F: Lanes>(&self, number: usize) -> F::Mask {
        numbers_from::<F>(number).lt(F::splat(self.count as f32))
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// A single one of them, in the place of all.
    #[inline(always)]
    pub(super) fn only(&self, number: usize) -> Self {
        Self {
            first: self.at(number),
            step: 0.0,
            ..*self
        }
    }
}

/// One number after another, in lanes.
#[inline(always)]
fn numbers_from<F: Lanes>(number: usize) -> F {
    F::from_fn(|lane| (number + lane) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_fill_their_range_side_by_side() {
        let comb = Comb::new(8, VISIBLE).unwrap();
        assert_eq!(comb.width(), 58.75);
        assert_eq!(comb.wavelength(0, 0.0), 360.0);
        assert_eq!(comb.wavelength(7, 1.0), 830.0);
        assert_eq!(comb.centre(0), 389.375);
    }

    #[test]
    fn what_is_no_comb_is_none() {
        for (count, range) in [
            (0, VISIBLE),
            (MAX_BANDS + 1, VISIBLE),
            (4, [500.0, 500.0]),
            (4, [0.0, 500.0]),
            (4, [500.0, f32::INFINITY]),
            (4, [f32::NAN, 500.0]),
        ] {
            assert_eq!(Comb::new(count, range), None, "{count} {range:?}");
        }
    }
}
