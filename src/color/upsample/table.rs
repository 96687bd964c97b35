//! Spectra for many colours: solutions of [`fit`](super::fit()) on a grid over the RGB cube, interpolated
//! (Jakob and Hanika 2019, section 4). The axes are those of the paper, which component is largest, how large,
//! and the ratios of the other two to it; brightness is spaced as the coefficients of greys are.

use std::array::from_fn;
use std::sync::OnceLock;
use std::thread;

use super::{Observer, Sigmoid, grey_start, unit};

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

    use super::super::tests::{colour, colours, worst_error};
    use super::*;

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
}
