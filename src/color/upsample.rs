//! Smooth reflectance spectra for RGB colours: S(λ) = ½ + ½·v/√(1 + v²) with v = (c₀λ + c₁)λ + c₂, whose
//! colour under D65 is the given one (Jakob and Hanika, "A Low-Dimensional Function Space for Efficient
//! Spectral Upsampling", 2019). [`fit`] solves for the three coefficients with a damped Gauss-Newton
//! iteration; [`Table`] interpolates between solutions.

mod table;

use std::array::from_fn;
use std::sync::OnceLock;

use super::cie;
use super::d65::d65;
use crate::lanes::Lanes;

pub use table::Table;

/// A reflectance spectrum with values in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sigmoid {
    /// c₀ (1/nm²), c₁ (1/nm) and c₂. Where c₂ is infinite, the other two are 0 and the spectrum is 0 or 1.
    pub c: [f32; 3],
}

impl Sigmoid {
    /// The spectrum that is `value` everywhere; `value` is clamped to [0, 1].
    pub fn constant(value: f32) -> Self {
        let value = f64::from(unit(value));
        // 0 and 1 divide by zero, and their infinities are what is wanted.
        let c2 = (value - 0.5) / (value * (1.0 - value)).sqrt();
        Self {
            c: [0.0, 0.0, c2 as f32],
        }
    }

    /// The reflectance at `lambda` (nm), in [0, 1].
    #[inline]
    pub fn eval(&self, lambda: f32) -> f32 {
        let [c0, c1, c2] = self.c;
        sigmoid((c0 * lambda + c1) * lambda + c2).0
    }

    /// The same at wavelengths in lanes.
    #[inline(always)]
    pub(super) fn eval_lanes<F: Lanes>(&self, lambda: F) -> F {
        let [c0, c1, c2] = self.c;
        eval_lanes([F::splat(c0), F::splat(c1), F::splat(c2)], lambda)
    }

    /// From the coefficients of t², t and 1, where t runs from −1 to 1 over the visible range.
    fn from_centred(a: Coefficients) -> Self {
        let [a0, a1, a2] = a;
        let scale = 1.0 / HALF_WIDTH;
        let shift = -CENTRE / HALF_WIDTH;
        Self {
            c: [
                (a0 * scale * scale) as f32,
                (scale * (a1 + 2.0 * a0 * shift)) as f32,
                ((a0 * shift + a1) * shift + a2) as f32,
            ],
        }
    }
}

/// [`Sigmoid::eval`] with coefficients in lanes.
#[inline(always)]
pub(super) fn eval_lanes<F: Lanes>([c0, c1, c2]: [F; 3], lambda: F) -> F {
    let v = (c0 * lambda + c1) * lambda + c2;
    let root = (F::one() + v * v).sqrt();
    let tail = F::splat(0.5) / (root * (root + v.abs()));
    F::select(v.lt(F::zero()), tail, F::one() - tail)
}

/// ½ + ½·v/√(1 + v²) and its derivative, written so that small values keep their digits and infinite v
/// gives exactly 0 or 1.
#[inline]
fn sigmoid(v: f32) -> (f32, f32) {
    let root = (1.0 + v * v).sqrt();
    let tail = 0.5 / (root * (root + v.abs()));
    let value = if v < 0.0 { tail } else { 1.0 - tail };
    (value, 0.5 / (root * root * root))
}

/// `value` clamped to [0, 1]; NaN is 0.
fn unit(value: f32) -> f32 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}

/// The middle of the visible range and its half width, in nm: t = (λ − CENTRE) / HALF_WIDTH.
const CENTRE: f64 = 0.5 * (cie::FIRST + cie::LAST) as f64;
const HALF_WIDTH: f64 = 0.5 * (cie::LAST - cie::FIRST) as f64;

/// Coefficients of t², t and 1.
type Coefficients = [f64; 3];

/// Vector lanes: the sums of [`Observer::residual`] run in this many columns.
const LANES: usize = 4;

/// XYZ to linear BT.709.
const XYZ_TO_RGB: [[f64; 3]; 3] = [
    [3.240479, -1.537150, -0.498535],
    [-0.969256, 1.875991, 0.041556],
    [0.055648, -0.204043, 1.057311],
];

/// A quadrature rule that takes a reflectance to its RGB colour under D65: two Gauss-Legendre points in
/// every interval of the CIE tables, where the weight functions are polynomials.
struct Observer {
    groups: Vec<Group>,
}

/// [`LANES`] points of the rule.
struct Group {
    t: [f32; LANES],
    /// Weights for red, green and blue.
    rgb: [[f32; LANES]; 3],
}

impl Observer {
    fn shared() -> &'static Self {
        static SHARED: OnceLock<Observer> = OnceLock::new();
        SHARED.get_or_init(Self::new)
    }

    fn new() -> Self {
        let half = 0.5 * cie::STEP;
        let offset = half / 3f32.sqrt();
        let points: Vec<(f32, [f64; 3])> = (0..cie::SAMPLES - 1)
            .map(|i| cie::FIRST + cie::STEP * i as f32 + half)
            .flat_map(|middle| [middle - offset, middle + offset])
            .map(|lambda| {
                let xyz = cie::xyz(lambda).map(|v| f64::from(v * d65(lambda)));
                (lambda, XYZ_TO_RGB.map(|row| dot(row, xyz)))
            })
            .collect();
        // Scaled by the white point, so that the constant spectrum g is (g, g, g) to the last digit.
        let white: [f64; 3] = from_fn(|c| points.iter().map(|(_, rgb)| rgb[c]).sum());
        let groups = points
            .chunks_exact(LANES)
            .map(|points| Group {
                t: from_fn(|l| ((f64::from(points[l].0) - CENTRE) / HALF_WIDTH) as f32),
                rgb: from_fn(|c| from_fn(|l| (points[l].1[c] / white[c]) as f32)),
            })
            .collect();
        Self { groups }
    }

    /// RGB of the spectrum with coefficients `a`, and its derivatives: `jacobian[c][k]` = ∂rgb[c]/∂a[k].
    fn rgb(&self, a: Coefficients) -> ([f64; 3], [[f64; 3]; 3]) {
        let [a0, a1, a2] = a.map(|v| v as f32);
        let mut value = [[0f32; LANES]; 3];
        let mut slope = [[[0f32; LANES]; 3]; 3];
        for Group { t, rgb } in &self.groups {
            for l in 0..LANES {
                let (s, ds) = sigmoid((a0 * t[l] + a1) * t[l] + a2);
                for c in 0..3 {
                    let weight = rgb[c][l];
                    value[c][l] += weight * s;
                    slope[c][2][l] += weight * ds;
                    slope[c][1][l] += weight * ds * t[l];
                    slope[c][0][l] += weight * ds * t[l] * t[l];
                }
            }
        }
        let sum = |lanes: [f32; LANES]| lanes.iter().map(|&v| f64::from(v)).sum();
        (value.map(sum), slope.map(|row| row.map(sum)))
    }

    /// The coefficients whose colour is nearest to `target`, found from `start`.
    fn fit(&self, target: [f64; 3], start: Coefficients) -> Coefficients {
        // Errors are relative to the largest component, so that dark colours keep their hue.
        let scale = 1.0 / target[0].max(target[1]).max(target[2]).max(1e-6);
        let evaluate = |a| {
            let (rgb, jacobian) = self.rgb(a);
            let error: [f64; 3] = from_fn(|c| scale * (rgb[c] - target[c]));
            (error, jacobian.map(|row| row.map(|v| scale * v)))
        };
        let mut a = start;
        let (mut error, mut jacobian) = evaluate(a);
        let mut damping = 1e-4;
        for _ in 0..MAX_STEPS {
            if error.iter().all(|e| e.abs() < TOLERANCE) {
                break;
            }
            let Some(step) = damped_step(&jacobian, error, damping) else {
                break;
            };
            let next = from_fn(|k| a[k] - step[k]);
            let (next_error, next_jacobian) = evaluate(next);
            if dot(next_error, next_error) < dot(error, error) {
                (a, error, jacobian) = (next, next_error, next_jacobian);
                damping *= 0.1;
            } else {
                damping *= 8.0;
            }
        }
        a
    }
}

/// Steps of the iteration, accepted or not, after which the best solution so far stands.
const MAX_STEPS: usize = 60;

/// The iteration ends when no component's error exceeds this part of the largest component.
const TOLERANCE: f64 = 2e-5;

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Solves (JᵀJ + damping·diag(JᵀJ)) x = Jᵀe (Levenberg and Marquardt); `None` where that is singular.
fn damped_step(jacobian: &[[f64; 3]; 3], error: [f64; 3], damping: f64) -> Option<Coefficients> {
    let column = |k: usize| jacobian.map(|row| row[k]);
    let columns: [[f64; 3]; 3] = from_fn(column);
    let mut m: [[f64; 3]; 3] = from_fn(|i| from_fn(|j| dot(columns[i], columns[j])));
    for (k, row) in m.iter_mut().enumerate() {
        row[k] *= 1.0 + damping;
    }
    let right: [f64; 3] = from_fn(|k| dot(columns[k], error));
    // Cramer's rule; m is symmetric, so rows serve as columns.
    let determinant = dot(m[0], cross(m[1], m[2]));
    let x = [
        dot(right, cross(m[1], m[2])) / determinant,
        dot(m[0], cross(right, m[2])) / determinant,
        dot(m[0], cross(m[1], right)) / determinant,
    ];
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// The spectrum of the linear BT.709 reflectance `rgb`, solved for on the spot (some microseconds); for
/// many colours see [`Table`]. Components are clamped to [0, 1]; greys are exact and flat.
pub fn fit(rgb: [f32; 3]) -> Sigmoid {
    let rgb = rgb.map(unit);
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        return Sigmoid::constant(rgb[0]);
    }
    let target = rgb.map(f64::from);
    Sigmoid::from_centred(Observer::shared().fit(target, grey_start(target)))
}

/// Coefficients of a grey about as bright as `target`.
fn grey_start(target: [f64; 3]) -> Coefficients {
    let mean = (target.iter().sum::<f64>() / 3.0).clamp(1e-6, 1.0 - 1e-3);
    [0.0, 0.0, (mean - 0.5) / (mean * (1.0 - mean)).sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The colour of a reflectance under D65, by a midpoint rule that shares nothing with the fit's.
    pub(super) fn colour(spectrum: &Sigmoid) -> [f64; 3] {
        let mut xyz = [0.0; 3];
        for k in 0..940 {
            let lambda = 360.25 + 0.5 * k as f32;
            let light = spectrum.eval(lambda) * d65(lambda) * cie::NORMALIZATION * 0.5;
            for (sum, v) in xyz.iter_mut().zip(cie::xyz(lambda)) {
                *sum += f64::from(v * light);
            }
        }
        XYZ_TO_RGB.map(|row| dot(row, xyz))
    }

    /// A grid over the cube with its faces, edges and corners, then random colours and dark ones.
    pub(super) fn colours() -> impl Iterator<Item = [f32; 3]> {
        let grid = (0..729).map(|i| [i / 81, i / 9 % 9, i % 9].map(|v| v as f32 / 8.0));
        let mut state = 1u64;
        let mut random = move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let random = (0..2000).map(move |i| {
            let scale = if i % 4 == 0 { 0.05 } else { 1.0 };
            [random() * scale, random() * scale, random() * scale]
        });
        grid.chain(random)
    }

    pub(super) fn worst_error(upsample: impl Fn([f32; 3]) -> Sigmoid) -> (f64, [f32; 3]) {
        let error = |rgb: [f32; 3]| {
            let back = colour(&upsample(rgb));
            (0..3)
                .map(|c| (back[c] - f64::from(rgb[c])).abs())
                .fold(0.0, f64::max)
        };
        colours()
            .map(|rgb| (error(rgb), rgb))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .expect("there are colours")
    }

    #[test]
    fn a_fitted_spectrum_has_the_colour_it_was_made_for() {
        let (error, rgb) = worst_error(fit);
        assert!(error < 1e-3, "{error} at {rgb:?}");
    }

    #[test]
    fn spectra_stay_within_zero_and_one() {
        let table = Table::shared();
        for rgb in colours() {
            for spectrum in [fit(rgb), table.lookup(rgb)] {
                for lambda in 360..=830 {
                    let value = spectrum.eval(lambda as f32);
                    assert!((0.0..=1.0).contains(&value), "{value} for {rgb:?}");
                }
            }
        }
    }

    #[test]
    fn grey_is_flat_and_black_and_white_are_exact() {
        for upsample in [fit, |rgb| Table::shared().lookup(rgb)] {
            for grey in [0.0, 1e-4, 0.18, 0.5, 0.999, 1.0] {
                let spectrum = upsample([grey; 3]);
                for lambda in [360.0, 555.0, 830.0] {
                    assert!((spectrum.eval(lambda) - grey).abs() <= 1e-6 * grey);
                }
            }
        }
        assert_eq!(fit([f32::NAN, -1.0, 0.0]).eval(500.0), 0.0);
        assert_eq!(fit([2.0; 3]).eval(500.0), 1.0);
    }

    #[test]
    fn spectra_are_those_of_mitsuba() {
        let expected = [
            (450.0, 0.8024),
            (550.0, 0.2190),
            (560.0, 0.2207),
            (650.0, 0.7600),
        ];
        for spectrum in [
            fit([0.5, 0.2, 0.8]),
            Table::shared().lookup([0.5, 0.2, 0.8]),
        ] {
            for (lambda, value) in expected {
                assert!((spectrum.eval(lambda) - value).abs() < 0.01, "{lambda} nm");
            }
        }
    }
}
