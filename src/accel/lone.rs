//! An instance that is all there is in the world: rays begin in its tree, and those that miss its box end there. They are
//! brought into its space many at a time.

use glam::Vec3;

use super::boxes::LaneBoxes;
use super::group::Group;
use super::walk::Way;
use super::wide::Tree;
use super::{Instance, Tracer};
use crate::interaction::Ray;
use crate::lanes::{self, Doubles as _, Kernel, Lanes, MAX_LANES, Mask as _, Task};
use crate::math::Moving;
use crate::math::moving::Affine;
use crate::shape::Bounds;

/// See the module.
#[derive(Debug)]
pub(super) struct Lone<'t> {
    way: Way,
    instance: &'t Instance,
    bounds: &'t Bounds,
    group: &'t Group,
    tree: &'t Tree,
    kernel: Kernel,
    /// The first ray that is prepared, and how many are.
    first: usize,
    count: usize,
    locals: Locals,
}

/// Rays in the instance's space.
#[derive(Clone, Copy, Debug, Default)]
struct Locals {
    origin: [[f32; MAX_LANES]; 3],
    direction: [[f32; MAX_LANES]; 3],
    /// Where they enter its box; negative where they pass by.
    entry: [f32; MAX_LANES],
}

impl<'t> Lone<'t> {
    /// `None` where its group has several trees.
    pub(super) fn new(tracer: &'t Tracer, index: u32) -> Option<Self> {
        let instance = &tracer.instances[index as usize];
        let group = &tracer.groups[instance.group as usize];
        Some(Self {
            way: Way {
                group: instance.group,
                instance: index,
                entry: 0.0,
            },
            instance,
            bounds: &tracer.instance_bounds[index as usize],
            group,
            tree: group.only_tree()?,
            kernel: tracer.kernel,
            first: 0,
            count: 0,
            locals: Locals::default(),
        })
    }

    pub(super) fn way(&self) -> Way {
        self.way
    }

    pub(super) fn tree(&self) -> &'t Tree {
        self.tree
    }

    /// How far the tree has come at a time.
    #[inline(always)]
    pub(super) fn part(&self, time: f32) -> f32 {
        self.group.tree_at(time).1
    }

    /// Whether a ray is prepared.
    #[inline(always)]
    pub(super) fn has(&self, ray: usize) -> bool {
        ray.wrapping_sub(self.first) < self.count
    }

    /// Prepares the first of `rays`, of which the first is number `first`, and which go as far as `limits`.
    pub(super) fn prepare(&mut self, first: usize, rays: &[Ray], limits: &[f32; MAX_LANES]) {
        self.first = first;
        self.count = rays.len().min(MAX_LANES);
        self.kernel.run(Localize {
            to_world: &self.instance.to_world,
            bounds: self.bounds,
            rays: &rays[..self.count],
            limits,
            locals: &mut self.locals,
        });
    }

    /// A ray that is prepared in the instance's space, and where it enters that; `None` where the walk through the world's
    /// tree would pass by.
    #[inline(always)]
    pub(super) fn ray(&self, number: usize, ray: &Ray) -> Option<(Ray, f32)> {
        let (locals, lane) = (&self.locals, number - self.first);
        let entry = locals.entry[lane];
        let at = |c: &[[f32; MAX_LANES]; 3]| Vec3::new(c[0][lane], c[1][lane], c[2][lane]);
        let local = Ray {
            origin: at(&locals.origin),
            direction: at(&locals.direction),
            ..*ray
        };
        (entry >= 0.0).then_some((local, entry))
    }
}

/// Brings rays into an instance's space.
struct Localize<'a> {
    to_world: &'a Moving,
    bounds: &'a Bounds,
    rays: &'a [Ray],
    limits: &'a [f32; MAX_LANES],
    locals: &'a mut Locals,
}

impl Task for Localize<'_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        for first in (0..self.rays.len()).step_by(F::WIDTH) {
            let (mut origin, mut direction) = ([F::ROW; 3], [F::ROW; 3]);
            let (mut times, mut ends) = (F::ROW, F::ROW);
            let (mut soonest, mut latest) = (f32::INFINITY, f32::NEG_INFINITY);
            for lane in 0..F::WIDTH {
                // What has no ray is as the last.
                let ray = &self.rays[(first + lane).min(self.rays.len() - 1)];
                for axis in 0..3 {
                    origin[axis][lane] = ray.origin[axis];
                    direction[axis][lane] = ray.direction[axis];
                }
                (times[lane], ends[lane]) = (ray.time, ray.t_max);
                (soonest, latest) = (soonest.min(ray.time), latest.max(ray.time));
            }
            let origin = lanes::Vec3::<F>::load(&origin);
            let direction = lanes::Vec3::<F>::load(&direction);
            let is_sound = is_finite(origin) & is_finite(direction) & F::zero().le(F::load(&ends));
            let Bounds { min, max } = self.bounds;
            let slabs = [min.x, max.x, min.y, max.y, min.z, max.z];
            let [near, far] = LaneBoxes::new(origin, direction).enter(slabs, None);
            let limit = F::from_slice(&self.limits[first..]);
            let enters = is_sound & near.le(far) & near.le(limit);
            let entry = F::select(enters, near, F::splat(-1.0));
            entry.store_to(&mut self.locals.entry[first..]);
            if !enters.any() {
                continue;
            }
            let back = (self.to_world).back_at(F::load(&times).widen(), soonest, latest);
            let [origin, direction] = apply::<F>(&back, origin, direction);
            store(origin, first, &mut self.locals.origin);
            store(direction, first, &mut self.locals.direction);
        }
    }
}

#[inline(always)]
fn is_finite<F: Lanes>(v: lanes::Vec3<F>) -> F::Mask {
    v.x.is_finite() & v.y.is_finite() & v.z.is_finite()
}

/// A point's image and a direction's, as [`glam::Affine3`] has them.
#[inline(always)]
fn apply<F: Lanes>(
    map: &Affine<F::Double>,
    point: lanes::Vec3<F>,
    direction: lanes::Vec3<F>,
) -> [lanes::Vec3<F>; 2] {
    let [x, y, z] = map.axes;
    let axes = [narrow::<F>(x), narrow::<F>(y), narrow::<F>(z)];
    let point = combine(axes, point) + narrow::<F>(map.translation);
    [point, combine(axes, direction)]
}

#[inline(always)]
fn combine<F: Lanes>([x, y, z]: [lanes::Vec3<F>; 3], v: lanes::Vec3<F>) -> lanes::Vec3<F> {
    x * v.x + y * v.y + z * v.z
}

#[inline(always)]
fn narrow<F: Lanes>([x, y, z]: [F::Double; 3]) -> lanes::Vec3<F> {
    lanes::Vec3::new(x.narrow(), y.narrow(), z.narrow())
}

#[inline(always)]
fn store<F: Lanes>(v: lanes::Vec3<F>, first: usize, columns: &mut [[f32; MAX_LANES]; 3]) {
    v.x.store_to(&mut columns[0][first..]);
    v.y.store_to(&mut columns[1][first..]);
    v.z.store_to(&mut columns[2][first..]);
}
