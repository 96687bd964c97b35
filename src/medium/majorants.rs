//! Bounds of a medium's extinction: a coarse grid over its box, whose cells are walked one by one, so that sparse smoke is
//! not paid for where it is empty (as in Pharr, Jakob and Humphreys, *PBRT* 4th ed., 11.4.4).

use glam::Vec3;

use crate::color::ColorModel;
use crate::lanes::{Lanes, Mask as _, Vec3 as Vectors};
use crate::math::Bounds;
use crate::texture::volume::Volume;

/// Cells of a volume's grid to a cell here, along each axis.
const COARSER: usize = 4;
/// The most cells here along each axis.
const MOST: usize = 64;

/// Numbers that extinction does not exceed, by cell.
#[derive(Clone, Debug)]
pub(super) struct Majorants {
    bounds: Bounds,
    size: [usize; 3],
    /// A cell's sides.
    sides: Vec3,
    /// x fastest.
    cells: Vec<f32>,
}

impl Majorants {
    /// Of a volume's values times `scale`.
    pub(super) fn new<C: ColorModel>(volume: &Volume<C>, scale: f32) -> Self {
        let bounds = volume.bounds();
        let size = (volume.resolution()).map(|n| n.div_ceil(COARSER).clamp(1, MOST));
        let [x, y, z] = size;
        let sides = (bounds.max - bounds.min) / Vec3::new(x as f32, y as f32, z as f32);
        // Places within are found by another formula, which rounds otherwise.
        let room = (sides * 1e-3).max(bounds.min.abs().max(bounds.max.abs()) * 1e-6);
        let mut cells = Vec::with_capacity(x * y * z);
        for k in 0..z {
            for j in 0..y {
                for i in 0..x {
                    let min = bounds.min + sides * Vec3::new(i as f32, j as f32, k as f32);
                    let cell = Bounds {
                        min: min - room,
                        max: min + sides + room,
                    };
                    cells.push(volume.most_within(&cell) * scale);
                }
            }
        }
        Self {
            bounds,
            size,
            sides,
            cells,
        }
    }

    /// A bound on the optical depth along any straight line.
    pub(super) fn thickness(&self) -> f32 {
        let most = self.cells.iter().copied().fold(0.0, f32::max);
        most * (self.bounds.max - self.bounds.min).length()
    }
}

/// Where rays enter and leave a box, between 0 and their ends; nowhere is an exit before the entry.
#[inline(always)]
pub(super) fn inside<F: Lanes>(
    bounds: &Bounds,
    origin: Vectors<F>,
    direction: Vectors<F>,
    end: F,
) -> [F; 2] {
    let (mut enter, mut exit) = (F::zero(), end);
    let rows = [
        (origin.x, direction.x, bounds.min.x, bounds.max.x),
        (origin.y, direction.y, bounds.min.y, bounds.max.y),
        (origin.z, direction.z, bounds.min.z, bounds.max.z),
    ];
    for (o, d, min, max) in rows {
        let (a, b) = ((F::splat(min) - o) / d, (F::splat(max) - o) / d);
        let along = d.eq(F::zero());
        let within = F::splat(min).le(o) & o.le(F::splat(max));
        let (infinity, nowhere) = (F::splat(f32::INFINITY), F::splat(-1.0));
        let near = F::select(along, F::zero(), a.min(b));
        let far = F::select(along, F::select(within, infinity, nowhere), a.max(b));
        enter = enter.max(near);
        exit = exit.min(far);
    }
    [enter, exit]
}

/// Rays on their way from cell to cell.
pub(super) struct March<'a, F: Lanes> {
    majorants: &'a Majorants,
    origin: Vectors<F>,
    direction: Vectors<F>,
    /// Whole numbers.
    cell: [F; 3],
    end: F,
    /// How far they have come.
    pub(super) t: F,
    /// Those that have not come to their ends.
    pub(super) alive: F::Mask,
}

/// What a step came to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<F: Lanes> {
    /// Where the optical depth was used up.
    pub(super) collided: F::Mask,
    /// The cell's bound there.
    pub(super) majorant: F,
}

impl<'a, F: Lanes> March<'a, F> {
    #[inline(always)]
    pub(super) fn new(
        majorants: &'a Majorants,
        active: F::Mask,
        origin: Vectors<F>,
        direction: Vectors<F>,
        end: F,
    ) -> Self {
        let [enter, exit] = inside(&majorants.bounds, origin, direction, end);
        let at = origin + direction * enter;
        let Bounds { min, .. } = majorants.bounds;
        let mut cell = [F::zero(); 3];
        for (axis, p) in [at.x, at.y, at.z].into_iter().enumerate() {
            let place = (p - F::splat(min[axis])) / F::splat(majorants.sides[axis]);
            cell[axis] = place.floor().clamp(0.0, (majorants.size[axis] - 1) as f32);
        }
        Self {
            majorants,
            origin,
            direction,
            cell,
            end: exit,
            t: enter,
            alive: active & enter.lt(exit),
        }
    }

    /// Goes on to where the optical depth `tau` is used up, or to the end of the cell, which takes its share of it.
    #[inline(always)]
    pub(super) fn step(&mut self, tau: &mut F) -> Step<F> {
        let Majorants {
            bounds,
            size,
            sides,
            cells,
        } = self.majorants;
        let [x, y, z] = self.cell;
        let [nx, ny, _] = size.map(|n| F::splat(n as f32));
        let majorant = F::gather(cells, ((z * ny + y) * nx + x).to_int());
        let mut exits = [F::zero(); 3];
        let rows = [
            (self.origin.x, self.direction.x),
            (self.origin.y, self.direction.y),
            (self.origin.z, self.direction.z),
        ];
        for (axis, (o, d)) in rows.into_iter().enumerate() {
            let ahead = F::select(F::zero().lt(d), F::one(), F::zero());
            let side = F::splat(sides[axis]);
            let plane = F::splat(bounds.min[axis]) + (self.cell[axis] + ahead) * side;
            let exit = (plane - o) / d;
            exits[axis] = F::select(d.eq(F::zero()), F::splat(f32::INFINITY), exit);
        }
        let [ex, ey, ez] = exits;
        let exit = ex.min(ey).min(ez).max(self.t);
        let stop = exit.min(self.end);
        let depth = (stop - self.t) * majorant;
        let collided = self.alive & tau.lt(depth);
        let passed = self.alive & !collided;
        let way = F::select(collided, *tau / majorant, stop - self.t);
        let t = F::select(collided, (self.t + way).min(stop), stop);
        self.t = F::select(self.alive, t, self.t);
        *tau = F::select(passed, *tau - depth, *tau);
        let over = passed & self.end.le(exit);
        let along_x = ex.le(ey) & ex.le(ez);
        let along_y = !along_x & ey.le(ez);
        let along = [along_x, along_y, !along_x & !along_y];
        let mut outside = F::Mask::splat(false);
        for (axis, (_, d)) in rows.into_iter().enumerate() {
            let forward = F::select(F::zero().lt(d), F::one(), -F::one());
            let next = self.cell[axis] + forward;
            self.cell[axis] = F::select(passed & along[axis], next, self.cell[axis]);
            let last = F::splat((size[axis] - 1) as f32);
            let beyond = self.cell[axis].lt(F::zero()) | last.lt(self.cell[axis]);
            outside = outside | beyond;
        }
        self.alive = self.alive & !over & !outside;
        Step { collided, majorant }
    }

    /// Where the rays are.
    #[inline(always)]
    pub(super) fn place(&self) -> Vectors<F> {
        self.origin + self.direction * self.t
    }
}
