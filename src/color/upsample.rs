//! Smooth reflectance spectra for RGB colours: S(λ) = ½ + ½·v/√(1 + v²) with v = (c₀λ + c₁)λ + c₂, whose
//! colour under D65 is the given one (Jakob and Hanika, "A Low-Dimensional Function Space for Efficient
//! Spectral Upsampling", 2019). [`fit`] solves for the three coefficients with a damped Gauss-Newton
//! iteration; [`Table`] holds solutions on a grid over the cube and interpolates them.

use std::array::from_fn;
use std::sync::OnceLock;
use std::thread;

use super::cie;
use super::d65::d65;

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

/// Nodes of the table along each ratio.
const RATIOS: usize = 32;

/// Nodes of the table along the largest component.
const LEVELS: usize = 40;

/// Solutions for the whole RGB cube. A colour is found by which component is largest, by that
/// component z, and by the ratios of the next two (cyclically) to z.
#[derive(Debug)]
pub struct Table {
    /// [`position`] of z at its nodes, ascending.
    levels: [f32; LEVELS],
    /// `[largest][second ratio][first ratio][z]`: 3 × [`RATIOS`] × [`RATIOS`] × [`LEVELS`].
    nodes: Vec<Sigmoid>,
}

impl Table {
    /// The table, computed when it is first asked for (a fraction of a second).
    pub fn shared() -> &'static Self {
        static SHARED: OnceLock<Table> = OnceLock::new();
        SHARED.get_or_init(Self::new)
    }

    fn new() -> Self {
        let smoothstep = |x: f64| x * x * (3.0 - 2.0 * x);
        let z: [f64; LEVELS] = from_fn(|k| {
            let x = k as f64 / (LEVELS - 1) as f64;
            smoothstep(x).powi(2).clamp(1e-6, 1.0)
        });
        let mut columns = vec![[Sigmoid::default(); LEVELS]; 3 * RATIOS * RATIOS];
        // Threads of its own, not rayon's: a worker of a pool that waits here could steal a task that asks
        // for the table again, and wait for itself.
        let threads = thread::available_parallelism().map_or(1, usize::from);
        let share = columns.len().div_ceil(threads);
        thread::scope(|scope| {
            for (part, columns) in columns.chunks_mut(share).enumerate() {
                scope.spawn(move || {
                    for (i, column) in columns.iter_mut().enumerate() {
                        *column = fit_column(part * share + i, &z);
                    }
                });
            }
        });
        Self {
            levels: z.map(|z| position(z as f32)),
            nodes: columns.into_flattened(),
        }
    }

    /// The spectrum of the linear BT.709 reflectance `rgb`, interpolated. Components are clamped to
    /// [0, 1]; greys are exact and flat.
    pub fn lookup(&self, rgb: [f32; 3]) -> Sigmoid {
        let rgb = rgb.map(unit);
        if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
            return Sigmoid::constant(rgb[0]);
        }
        let largest = match rgb {
            [r, g, b] if r >= g && r >= b => 0,
            [_, g, b] if g >= b => 1,
            _ => 2,
        };
        let z = rgb[largest];
        let last = (RATIOS - 1) as f32;
        let axis = |value: f32| {
            let position = value / z * last;
            let node = (position as usize).min(RATIOS - 2);
            (node, (position - node as f32).min(1.0))
        };
        let (x, fx) = axis(rgb[(largest + 1) % 3]);
        let (y, fy) = axis(rgb[(largest + 2) % 3]);
        let level = position(z);
        let k = self.levels.partition_point(|&node| node <= level);
        let k = k.clamp(1, LEVELS - 1) - 1;
        let [below, above] = [self.levels[k], self.levels[k + 1]];
        let fz = unit((level - below) / (above - below));

        let mut c = [0.0; 3];
        for corner in 0..8 {
            let side = |bit: usize, f: f32| {
                let upper = corner >> bit & 1;
                (upper, if upper == 1 { f } else { 1.0 - f })
            };
            let ((i, wi), (j, wj), (l, wl)) = (side(0, fx), side(1, fy), side(2, fz));
            let column = (largest * RATIOS + y + j) * RATIOS + x + i;
            let node = &self.nodes[column * LEVELS + k + l];
            for (sum, v) in c.iter_mut().zip(node.c) {
                *sum += wi * wj * wl * v;
            }
        }
        Sigmoid { c }
    }
}

/// Where the largest component `z` stands between its nodes. The coefficients run in step with it: c₂ of a
/// grey is (z − ½)/√(z(1 − z)), while those of other colours stay finite at z = 1.
fn position(z: f32) -> f32 {
    (z - 0.5) / (z * (1.1 - z)).sqrt()
}

/// Solutions for one pair of ratios at each `z`, each found from its neighbour, from the middle to both ends.
fn fit_column(index: usize, z: &[f64; LEVELS]) -> [Sigmoid; LEVELS] {
    let observer = Observer::shared();
    let largest = index / (RATIOS * RATIOS);
    let ratio = |i: usize| (i % RATIOS) as f64 / (RATIOS - 1) as f64;
    let rgb = |z: f64| {
        let mut rgb = [z; 3];
        rgb[(largest + 1) % 3] *= ratio(index);
        rgb[(largest + 2) % 3] *= ratio(index / RATIOS);
        rgb
    };
    let level = z.map(|z| f64::from(position(z as f32)));
    let middle = LEVELS / 2;
    let mut column = [Sigmoid::default(); LEVELS];
    let first = observer.fit(rgb(z[middle]), grey_start(rgb(z[middle])));
    column[middle] = Sigmoid::from_centred(first);
    let mut march = |nodes: &mut dyn Iterator<Item = usize>| {
        let (mut last, mut a, mut slope) = (level[middle], first, [0.0; 3]);
        for k in nodes {
            let step = level[k] - last;
            let found = observer.fit(rgb(z[k]), from_fn(|i| a[i] + step * slope[i]));
            slope = from_fn(|i| (found[i] - a[i]) / step);
            (last, a) = (level[k], found);
            column[k] = Sigmoid::from_centred(a);
        }
    };
    march(&mut (0..middle).rev());
    march(&mut (middle + 1..LEVELS));
    column
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    /// The colour of a reflectance under D65, by a midpoint rule that shares nothing with the fit's.
    fn colour(spectrum: &Sigmoid) -> [f64; 3] {
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
    fn colours() -> impl Iterator<Item = [f32; 3]> {
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

    fn worst_error(upsample: impl Fn([f32; 3]) -> Sigmoid) -> (f64, [f32; 3]) {
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
    fn the_table_keeps_colours_too() {
        let table = Table::shared();
        let (error, rgb) = worst_error(|rgb| table.lookup(rgb));
        assert!(error < 5e-3, "{error} at {rgb:?}");
    }

    #[test]
    fn dark_colours_keep_their_hue_in_the_table() {
        let table = Table::shared();
        for bright in colours().filter(|rgb| rgb.iter().all(|&v| v > 0.1)) {
            let rgb = bright.map(|v| 0.01 * v);
            let back = colour(&table.lookup(rgb));
            for c in 0..3 {
                let error = (back[c] / f64::from(rgb[c]) - 1.0).abs();
                assert!(error < 0.03, "{back:?} for {rgb:?}");
            }
        }
    }

    #[test]
    fn the_table_can_be_asked_for_inside_parallel_work() {
        let first = |i: u32| Table::shared().lookup([1.0 / i as f32, 0.5, 0.2]);
        assert_eq!((2..64).into_par_iter().map(first).count(), 62);
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
