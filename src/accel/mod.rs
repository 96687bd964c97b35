//! Finding what a ray meets. A [`Tracer`] holds the shapes of a scene in groups: group 0 is the world,
//! the others stand in the world as instances. Each group has a tree, and beside it stands brute force:
//! both answer with the same bits, because hits are ordered by (t, instance, shape, primitive) and a
//! hit's t is never less than its own box's entry, which no box around it exceeds.
//!
//! Rays are traced in batches: [`Tracer::closest`] and [`Tracer::occluded`] take slices.

mod boxes;
mod group;
mod lone;
mod met;
mod triangle;
mod walk;
mod wide;

use std::path::PathBuf;
use std::sync::Arc;

use glam::{Affine3, Vec2, Vec3};
use rayon::prelude::*;

use crate::error::{Error, Problem};
use crate::interaction::{Hit, Interaction, Ray};
use crate::lanes::Kernel;
use crate::math::Moving;
use crate::shape::{Bounds, Geometry};

use group::{Group, Members, Shapes};
pub use met::Met;
use walk::Walk;

/// What tracing costs, counted: the same on every machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Counts {
    /// Tree nodes entered.
    pub node_steps: u64,
    /// Primitives tested.
    pub primitive_tests: u64,
}

impl Counts {
    /// Adds another part's counts.
    pub fn add(&mut self, other: &Self) {
        self.node_steps += other.node_steps;
        self.primitive_tests += other.primitive_tests;
    }
}

/// What is known of the rays of a batch. It changes no hit, but how they are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Nothing: each is walked by itself, unless the tree is small.
    #[default]
    Any,
    /// Those that follow one another go much the same way, as a camera's do: they are walked in packets.
    Coherent,
}

/// How rays find shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Test everything: O(P·O).
    Brute,
    /// The same, and a shadow ray that is blocked goes on all the same, so that every ray costs O tests.
    Exhaustive,
    /// A tree: O(P·log O).
    #[default]
    Tree,
    /// Not at all, each misses: for whoever draws shapes without tracing rays.
    Never,
}

/// How much work goes into a tree. More makes rays faster and changes no hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Build {
    /// Primitives are sorted along a curve.
    Quick,
    /// Clusters are looked for near by.
    Fast,
    /// And further off, and the worst twentieth is placed anew.
    #[default]
    Medium,
    /// And the worst fifth.
    Slow,
}

impl Build {
    /// The work that pays for so many primitives and rays.
    pub fn suited(primitives: u64, rays: u64) -> Self {
        match rays / primitives.max(1) {
            0..FAST_PAYS => Self::Quick,
            FAST_PAYS..MEDIUM_PAYS => Self::Fast,
            MEDIUM_PAYS..SLOW_PAYS => Self::Medium,
            SLOW_PAYS.. => Self::Slow,
        }
    }
}

/// From how many rays a primitive on more work has paid for itself.
const FAST_PAYS: u64 = 20;
/// See `FAST_PAYS`. Medium costs 0.1 µs a triangle more than fast and saves half a percent of a ray, slow 0.5 µs and 2 %.
const MEDIUM_PAYS: u64 = 200;
/// See `FAST_PAYS`.
const SLOW_PAYS: u64 = 400;

/// How a tracer is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Tree or brute force.
    pub method: Method,
    /// The work that goes into a tree.
    pub build: Build,
    /// A folder in which trees are kept: what was built once is read from there. It is made where it is not there.
    pub cache: Option<PathBuf>,
    /// The first and the last time of rays: what moves is bounded for these.
    pub shutter: (f32, f32),
    /// The instructions with which it is walked.
    pub kernel: Kernel,
}

impl Default for Recipe {
    /// A tree for rays of all times.
    fn default() -> Self {
        Self {
            method: Method::default(),
            build: Build::default(),
            cache: None,
            shutter: (f32::NEG_INFINITY, f32::INFINITY),
            kernel: Kernel::default(),
        }
    }
}

/// What a folder of trees was good for.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct CacheUse {
    /// Trees that were read.
    pub read: usize,
    /// Trees that were built and written.
    pub written: usize,
    /// Files that could not be used or written; their trees were built all the same.
    #[serde(skip)]
    pub problems: Vec<Problem>,
}

impl CacheUse {
    fn warn(&mut self, error: Error) {
        self.problems.extend_from_slice(error.problems());
    }

    fn add(&mut self, other: Self) {
        self.read += other.read;
        self.written += other.written;
        self.problems.extend(other.problems);
    }
}

impl From<Method> for Recipe {
    fn from(method: Method) -> Self {
        Self {
            method,
            ..Self::default()
        }
    }
}

/// A group's shapes put into the world once more.
#[derive(Clone, Debug)]
pub struct Instance {
    /// From the group's space to the world, at the time of each ray.
    pub to_world: Moving,
    /// Which group, from 1.
    pub group: u32,
}

/// A shape where it stands in the world.
#[derive(Clone, Copy, Debug)]
pub struct Standing<'a> {
    /// Its index.
    pub shape: u32,
    /// The instance through which it stands there, or [`Hit::NONE`].
    pub instance: u32,
    /// From its space to the world, where that is another.
    pub to_world: Option<&'a Moving>,
}

/// The shapes of a scene, ready to be met by rays.
#[derive(Debug)]
pub struct Tracer {
    shapes: Shapes,
    /// By shape.
    group_of: Vec<u32>,
    instances: Vec<Instance>,
    /// Each instance's box in the world, for all times of rays.
    instance_bounds: Vec<Bounds>,
    groups: Vec<Group>,
    /// The instance that is all there is in the world, if that is so and one tree holds what stands in it.
    alone: Option<u32>,
    /// Of the deepest tree of an instance.
    inner_levels: usize,
    /// Whether any tree moves.
    deforms: bool,
    /// Whether any tree has items that are no triangles.
    has_others: bool,
    /// Whether the world's tree is so small that rays are faster in packets, whatever way they go.
    is_small: bool,
    /// Whether the trees do not fit into the caches near a core.
    is_large: bool,
    method: Method,
    kernel: Kernel,
    cache: CacheUse,
}

impl Tracer {
    /// `group_of[i]` is the group of shape `i`: 0 for the world, others for instances. A mesh that deforms has a group of
    /// its own. Triangles with corners that are not finite must have been dropped before.
    pub fn new(
        shapes: Vec<Arc<Geometry>>,
        group_of: &[u32],
        instances: Vec<Instance>,
        recipe: impl Into<Recipe>,
    ) -> Self {
        let recipe: Recipe = recipe.into();
        let count = 1 + group_of
            .iter()
            .copied()
            .chain(instances.iter().map(|i| i.group))
            .max()
            .unwrap_or(0);
        let shapes = Shapes::new(shapes);
        let mut shapes_of = vec![Vec::new(); count as usize];
        for (shape, group) in (0..).zip(group_of) {
            shapes_of[*group as usize].push(shape);
        }
        let mut cache = CacheUse::default();
        let mut group = |of: &[u32], instances: Option<&[Bounds]>| {
            let deforming = match of {
                [shape] if instances.is_none() => Group::deforming(&shapes, *shape, &recipe),
                _ => None,
            };
            let (group, used) = deforming
                .unwrap_or_else(|| Group::new(Members::new(&shapes, of, instances), &recipe));
            cache.add(used);
            group
        };
        let groups = shapes_of[1..].iter().map(|of| group(of, None));
        let mut groups: Vec<Group> = groups.collect();
        let instance_bounds: Vec<Bounds> = (instances.par_iter())
            .map(|Instance { to_world, group }| {
                groups[*group as usize - 1].bounds_in(to_world, recipe.shutter)
            })
            .collect();
        let world = group(&shapes_of[0], Some(&instance_bounds));
        groups.insert(0, world);
        let inner = groups[1..].iter().map(Group::levels);
        let alone = groups[0].lone_instance().filter(|instance| {
            let group = instances[*instance as usize].group;
            groups[group as usize].only_tree().is_some()
        });
        Self {
            alone,
            shapes,
            group_of: group_of.to_vec(),
            instances,
            instance_bounds,
            inner_levels: inner.max().unwrap_or(0),
            deforms: groups.iter().any(Group::deforms),
            has_others: groups.iter().any(|group| !group.items().is_empty()),
            is_small: groups[0].tree().node_count() <= SMALL,
            is_large: groups.iter().map(Group::bytes).sum::<usize>() > CACHED,
            groups,
            method: recipe.method,
            kernel: recipe.kernel,
            cache,
        }
    }

    /// A box around everything that has an end.
    pub fn bounds(&self) -> Bounds {
        self.groups[0].bounds()
    }

    /// The instructions that it uses, and whoever works with its hits.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// The first hit of each ray, in the order of the rays. A ray that is not finite meets nothing.
    pub fn closest(&self, rays: &[Ray], order: Order, hits: &mut Vec<Hit>, counts: &mut Counts) {
        hits.clear();
        hits.extend(rays.iter().map(|ray| Hit::miss(ray.t_max)));
        Walk::new(self, counts).closest(rays, order, hits);
    }

    /// Whether anything lies on each ray, in the order of the rays.
    pub fn occluded(
        &self,
        rays: &[Ray],
        order: Order,
        blocked: &mut Vec<bool>,
        counts: &mut Counts,
    ) {
        blocked.clear();
        blocked.resize(rays.len(), false);
        Walk::new(self, counts).occluded(rays, order, blocked);
    }

    /// What a hit looks like; `hit` came from `ray`.
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let shape = self.shapes.get(hit.shape);
        if hit.instance == Hit::NONE {
            return shape.interaction(ray, hit);
        }
        let to_world = self.instances[hit.instance as usize].to_world.at(ray.time);
        shape
            .interaction(&local(to_world.back(), ray), hit)
            .transformed(&to_world, ray.direction)
    }

    /// Where the point at `at`, which `hit` has met, is at another time; world space.
    pub fn position_at(&self, hit: &Hit, at: &Interaction<'_>, time: f32) -> Vec3 {
        let Some(Instance { to_world, .. }) = self.instances.get(hit.instance as usize) else {
            return at.position;
        };
        let local = match self.shapes.get(hit.shape) {
            Geometry::Deforming(mesh) => {
                mesh.position(hit.primitive, Vec2::new(hit.u, hit.v), time)
            }
            _ if to_world.is_still() => return at.position,
            _ => to_world.at(at.time).inverse().point(at.position),
        };
        to_world.at(time).point(local)
    }

    /// Whether anything moves.
    pub fn moves(&self) -> bool {
        let moves = |instance: &Instance| !instance.to_world.is_still();
        let deforms = |shape: &Geometry| matches!(shape, Geometry::Deforming(_));
        self.instances.iter().any(moves) || self.shapes.iter().any(deforms)
    }

    /// Primitives, each instance's counted once.
    pub fn primitive_count(&self) -> usize {
        self.shapes.primitive_count()
    }

    /// How many instances there are.
    pub fn instance_count(&self) -> usize {
        self.instances.len()
    }

    /// A shape by its index, in its group's space.
    pub fn shape(&self, index: u32) -> &Geometry {
        self.shapes.get(index)
    }

    /// Every shape wherever it stands in the world, in the order of hits.
    pub fn standing(&self) -> impl Iterator<Item = Standing<'_>> {
        let of = move |group: u32| {
            let shapes = (0..).zip(&self.group_of);
            shapes.filter_map(move |(shape, own)| (*own == group).then_some(shape))
        };
        let once_more = (0..)
            .zip(&self.instances)
            .flat_map(move |(index, instance)| {
                of(instance.group).map(move |shape| Standing {
                    shape,
                    instance: index,
                    to_world: Some(&instance.to_world),
                })
            });
        once_more.chain(of(0).map(|shape| Standing {
            shape,
            instance: Hit::NONE,
            to_world: None,
        }))
    }

    /// The same shapes, met in another way.
    #[must_use]
    pub fn rebuilt(&self, recipe: impl Into<Recipe>) -> Self {
        let shapes = self.shapes.shared();
        Self::new(shapes, &self.group_of, self.instances.clone(), recipe)
    }

    /// What the folder of trees was good for, if there was one.
    pub fn cache_use(&self) -> &CacheUse {
        &self.cache
    }

    /// Bytes held by trees.
    pub fn tree_bytes(&self) -> usize {
        self.groups.iter().map(Group::bytes).sum()
    }
}

/// Trees of up to so many nodes are walked in packets by rays that go any way. From about sixteen nodes of triangles on, and
/// fifty of spheres, a walk for each ray is faster.
const SMALL: usize = 12;

/// Trees up to this size are in the caches nearest to a core, as far as counts: there asking for memory ahead
/// costs a tenth.
const CACHED: usize = 16 << 20;

/// The ray in an instance's space, as it stands at the ray's time; t keeps its meaning, since the direction is not
/// normalised.
#[inline]
fn to_local(to_world: &Moving, ray: &Ray) -> Ray {
    local(&to_world.back(ray.time), ray)
}

#[inline]
fn local(to_local: &Affine3, ray: &Ray) -> Ray {
    Ray {
        origin: to_local.transform_point3(ray.origin),
        direction: to_local.transform_vector3(ray.direction),
        ..*ray
    }
}

#[cfg(test)]
mod instance_tests;
#[cfg(test)]
mod motion_tests;
#[cfg(test)]
mod surface_tests;
#[cfg(test)]
mod tests;
