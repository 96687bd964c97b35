//! Spectra as a scene in bands keeps them: numbers, curves, and smooth spectra of RGB colours ([`upsample`](super::upsample)).

use std::sync::Arc;

use super::d65::d65_lanes;
use super::model::{Color, Role};
use super::rgb::{check, curve};
use super::upsample::{Sigmoid, Table, fit};
use crate::lanes::{Ints as _, Lanes};

/// A value over wavelength.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    /// The same everywhere.
    Flat(f32),
    /// The smooth spectrum of an RGB colour.
    Upsampled(Upsampled),
    /// Points of (nm, value), nm increasing; linear between them and 0 outside.
    Curve(Arc<[(f64, f64)]>),
    /// The same by values at even steps.
    Even(Arc<Even>),
}

/// Values at even steps of wavelength; linear between them and 0 outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Even {
    /// In nm.
    first: f32,
    last: f32,
    /// Steps a nanometre.
    per_nm: f32,
    /// Two or more.
    values: Box<[f32]>,
}

/// Scale times a reflectance, times D65 where it is light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Upsampled {
    /// The factor.
    pub(super) scale: f32,
    /// The shape.
    pub(super) sigmoid: Sigmoid,
    /// Whether D65 multiplies it.
    pub(super) illuminant: bool,
}

impl Upsampled {
    /// The spectrum of a texel; reflectances are clamped to [0, 1].
    pub(super) fn of_texel(table: &Table, rgb: [f32; 3], role: Role) -> Self {
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

    /// At wavelengths in nm, one a lane.
    #[inline(always)]
    fn at_lanes<F: Lanes>(&self, lambda: F) -> F {
        let shape = F::splat(self.scale) * self.sigmoid.eval_lanes(lambda);
        match self.illuminant {
            true => shape * d65_lanes(lambda),
            false => shape,
        }
    }

    /// At wavelengths in nm.
    #[inline]
    pub(super) fn sample<const N: usize>(&self, wavelengths: &[f32; N]) -> [f32; N] {
        wavelengths.map(|l| self.at_lanes(l))
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

impl Even {
    /// From points of (nm, value); `None` unless there are two or more in even steps.
    fn new(points: &[(f64, f64)]) -> Option<Self> {
        const ROUNDING: f64 = 1e-6;
        let (first, last) = (points.first()?.0, points.last()?.0);
        let step = (last - first) / (points.len() - 1) as f64;
        let is_even = |(i, p): (usize, &(f64, f64))| {
            (p.0 - (first + step * i as f64)).abs() <= ROUNDING * step
        };
        let even = points.len() > 1 && step > 0.0 && points.iter().enumerate().all(is_even);
        even.then(|| Self {
            first: first as f32,
            last: last as f32,
            per_nm: (1.0 / step) as f32,
            values: points.iter().map(|p| p.1 as f32).collect(),
        })
    }

    /// At wavelengths in nm, one a lane.
    #[inline(always)]
    fn at_lanes<F: Lanes>(&self, lambda: F) -> F {
        let last = (self.values.len() - 1) as f32;
        let place = (lambda - F::splat(self.first)) * F::splat(self.per_nm);
        let node = place.clamp(0.0, last - 1.0).to_int();
        let t = (place - node.to_float()).clamp(0.0, 1.0);
        let (a, b) = (
            F::gather(&self.values, node),
            F::gather(&self.values, node + F::Int::splat(1)),
        );
        let value = (F::one() - t) * a + t * b;
        let inside = F::splat(self.first).le(lambda) & lambda.le(F::splat(self.last));
        F::select(inside, value, F::zero())
    }

    #[inline]
    fn at(&self, lambda: f32) -> f32 {
        self.at_lanes(lambda)
    }
}

impl Spectrum {
    /// A scene's colour; the error says what is wrong with the value.
    pub(super) fn new(color: &Color, role: Role) -> Result<Self, String> {
        let light = role == Role::Emission;
        let upsampled = |scale, sigmoid, illuminant| {
            Self::Upsampled(Upsampled {
                scale,
                sigmoid,
                illuminant,
            })
        };
        let of_any_size = |rgb: &[f64; 3], illuminant| {
            let (scale, rgb) = scaled(rgb.map(|v| v as f32));
            upsampled(scale, fit(rgb), illuminant)
        };
        Ok(match color {
            Color::D65(rgb) => {
                check(*rgb, role.unbounded())?;
                of_any_size(rgb, true)
            }
            Color::Grey(value) => {
                check([*value], role)?;
                match light {
                    true => upsampled(2.0 * *value as f32, Sigmoid::constant(0.5), true),
                    false => Self::Flat(*value as f32),
                }
            }
            Color::Flat(value) => {
                check([*value], role)?;
                Self::Flat(*value as f32)
            }
            Color::Rgb(rgb) => {
                check(*rgb, role)?;
                match role {
                    Role::Reflectance if rgb[0] == rgb[1] && rgb[1] == rgb[2] => {
                        Self::Flat(rgb[0] as f32)
                    }
                    Role::Reflectance => upsampled(1.0, fit(rgb.map(|v| v as f32)), false),
                    Role::Emission | Role::Quantity | Role::Tabulated => of_any_size(rgb, light),
                }
            }
            Color::Curve(points) => {
                let role_of_points = if light { role } else { Role::Quantity };
                check(points.iter().map(|p| p.1), role_of_points)?;
                let bounded = |v: f64| match role {
                    Role::Reflectance => v.clamp(0.0, 1.0),
                    _ => v,
                };
                let points: Vec<(f64, f64)> = points.iter().map(|p| (p.0, bounded(p.1))).collect();
                match Even::new(&points) {
                    Some(even) => Self::Even(Arc::new(even)),
                    None => Self::Curve(points.into()),
                }
            }
        })
    }

    /// At a wavelength in nm.
    pub fn at(&self, lambda: f32) -> f32 {
        self.sample(&[lambda])[0]
    }

    /// At wavelengths in nm.
    #[inline]
    pub(super) fn sample<const N: usize>(&self, wavelengths: &[f32; N]) -> [f32; N] {
        match self {
            Self::Flat(value) => [*value; N],
            Self::Upsampled(upsampled) => upsampled.sample(wavelengths),
            Self::Curve(points) => wavelengths.map(|l| curve(points, f64::from(l)) as f32),
            Self::Even(even) => wavelengths.map(|l| even.at(l)),
        }
    }

    /// At wavelengths in nm, one a lane; points at uneven steps are asked one by one.
    #[inline(always)]
    pub(super) fn at_lanes<F: Lanes>(&self, lambda: F) -> F {
        match self {
            Self::Flat(value) => F::splat(*value),
            Self::Upsampled(upsampled) => upsampled.at_lanes(lambda),
            Self::Even(even) => even.at_lanes(lambda),
            Self::Curve(points) => {
                let mut row = lambda.row();
                for lane in 0..F::WIDTH {
                    row[lane] = curve(points, f64::from(row[lane])) as f32;
                }
                F::load(&row)
            }
        }
    }

    /// Its least value, or 0 where that is less.
    pub fn least(&self) -> f32 {
        match self {
            Self::Flat(value) => value.min(0.0),
            Self::Upsampled(upsampled) => upsampled.scale.min(0.0),
            Self::Curve(points) => points.iter().fold(0.0, |least, p| least.min(p.1 as f32)),
            Self::Even(even) => even.values.iter().copied().fold(0.0, f32::min),
        }
    }

    /// The wavelengths in nm outside of which it is 0; `None` where there are none such.
    pub fn support(&self) -> Option<[f32; 2]> {
        match self {
            Self::Flat(_) | Self::Upsampled(_) => None,
            Self::Curve(points) => {
                let ends = [points.first()?.0, points.last()?.0];
                Some(ends.map(|l| l as f32))
            }
            Self::Even(even) => Some([even.first, even.last]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_steps_are_the_same_curve() {
        let points: Vec<(f64, f64)> = (0..9)
            .map(|i| (400.0 + 37.5 * f64::from(i), f64::from(i * i % 7)))
            .collect();
        let even = Spectrum::new(&Color::Curve(points.clone()), Role::Quantity).unwrap();
        assert!(matches!(even, Spectrum::Even(_)));
        let uneven = Spectrum::Curve(points.into());
        for i in 0..4000 {
            let l = 380.0 + 0.1 * i as f32;
            assert!((even.at(l) - uneven.at(l)).abs() < 1e-4, "{l}");
        }
        assert_eq!((even.at(399.9), even.at(700.1)), (0.0, 0.0));
        assert_eq!((even.at(400.0), even.at(700.0)), (0.0, 1.0));
        assert_eq!(even.support(), Some([400.0, 700.0]));
    }

    #[test]
    fn uneven_steps_stay_points() {
        let points = vec![(400.0, 1.0), (500.0, 2.0), (700.0, 3.0)];
        let curve = Spectrum::new(&Color::Curve(points), Role::Quantity).unwrap();
        assert!(matches!(curve, Spectrum::Curve(_)));
        assert_eq!(curve.at(600.0), 2.5);
    }
}
