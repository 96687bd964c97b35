//! Finding what a ray meets. A [`Tracer`] holds the shapes of a scene in groups: group 0 is the world,
//! the others stand in the world as instances. Each group has a tree, and beside it stands brute force:
//! both answer with the same bits, because hits are ordered by (t, instance, shape, primitive) and a
//! hit's t is never less than its own box's entry, which no box around it exceeds.
//!
//! Rays are traced in batches: [`Tracer::closest`] and [`Tracer::occluded`] take slices.

mod boxes;
mod group;
mod tree;
mod triangle;

use std::sync::Arc;

use crate::interaction::{Hit, Interaction, Ray};
use crate::math::Transform;
use crate::shape::{Bounds, Geometry};

use boxes::RayBoxes;
use group::{Group, Item};
use triangle::Shear;

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

/// How rays find shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Test everything: O(P·O).
    Brute,
    /// A tree: O(P·log O).
    #[default]
    Tree,
}

/// A group's shapes put into the world once more.
#[derive(Clone, Debug)]
pub struct Instance {
    /// From the group's space to the world.
    pub to_world: Transform,
    /// Which group, from 1.
    pub group: u32,
}

/// The shapes of a scene, ready to be met by rays.
#[derive(Debug)]
pub struct Tracer {
    shapes: Vec<Arc<Geometry>>,
    instances: Vec<Instance>,
    /// Each instance's box in the world.
    instance_bounds: Vec<Bounds>,
    groups: Vec<Group>,
    method: Method,
}

impl Tracer {
    /// `group_of[i]` is the group of shape `i`: 0 for the world, others for instances. Triangles with
    /// corners that are not finite must have been dropped before.
    pub fn new(
        shapes: Vec<Arc<Geometry>>,
        group_of: &[u32],
        instances: Vec<Instance>,
        method: Method,
    ) -> Self {
        let count = 1 + group_of
            .iter()
            .copied()
            .chain(instances.iter().map(|i| i.group))
            .max()
            .unwrap_or(0);
        let members = |group: u32| {
            let shapes = shapes
                .iter()
                .zip(group_of)
                .enumerate()
                .filter(move |(_, (_, g))| **g == group);
            shapes.flat_map(|(i, (shape, _))| {
                (0..shape.primitive_count())
                    .map(move |p| (Item::primitive(i as u32, p), shape.bounds(p)))
            })
        };
        let mut groups: Vec<Group> = (1..count).map(|g| Group::new(members(g), method)).collect();
        let instance_bounds: Vec<Bounds> = (instances.iter())
            .map(|instance| {
                let group = &groups[instance.group as usize - 1];
                match group.bounds() {
                    _ if !group.unbounded().is_empty() => Bounds::EVERYTHING,
                    bounds if bounds.is_empty() => bounds,
                    bounds => bounds.transformed(&instance.to_world),
                }
            })
            .collect();
        let placed = (0..)
            .map(Item::instance)
            .zip(instance_bounds.iter().copied());
        let placed = placed.filter(|(_, bounds)| !bounds.is_empty());
        let world = Group::new(members(0).chain(placed), method);
        groups.insert(0, world);
        Self {
            shapes,
            instances,
            instance_bounds,
            groups,
            method,
        }
    }

    /// A box around everything that has an end.
    pub fn bounds(&self) -> Bounds {
        self.groups[0].bounds()
    }

    /// The first hit of each ray, in the order of the rays.
    pub fn closest(&self, rays: &[Ray], hits: &mut Vec<Hit>, counts: &mut Counts) {
        let mut walk = Walk::new(self, counts);
        hits.clear();
        hits.extend(rays.iter().map(|ray| walk.closest(ray)));
    }

    /// Whether anything lies on each ray, in the order of the rays.
    pub fn occluded(
        &self,
        rays: impl Iterator<Item = Ray>,
        blocked: &mut Vec<bool>,
        counts: &mut Counts,
    ) {
        let mut walk = Walk::new(self, counts);
        blocked.clear();
        blocked.extend(rays.map(|ray| walk.occluded(&ray)));
    }

    /// What a hit looks like; `hit` came from `ray`.
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let shape = &self.shapes[hit.shape as usize];
        if hit.instance == Hit::NONE {
            return shape.interaction(ray, hit);
        }
        let to_world = &self.instances[hit.instance as usize].to_world;
        shape
            .interaction(&to_local(to_world, ray), hit)
            .transformed(to_world, ray.direction)
    }

    /// Primitives, each instance's counted once.
    pub fn primitive_count(&self) -> usize {
        self.shapes
            .iter()
            .map(|s| s.primitive_count() as usize)
            .sum()
    }

    /// How many instances there are.
    pub fn instance_count(&self) -> usize {
        self.instances.len()
    }

    /// Bytes held by trees.
    pub fn tree_bytes(&self) -> usize {
        self.groups.iter().map(Group::bytes).sum()
    }
}

/// The ray in an instance's space; t keeps its meaning, since the direction is not normalised.
fn to_local(to_world: &Transform, ray: &Ray) -> Ray {
    let to_local = to_world.inverse();
    Ray {
        origin: to_local.point(ray.origin),
        direction: to_local.vector(ray.direction),
        ..*ray
    }
}

/// One thread's walk through the trees, ray after ray.
struct Walk<'t> {
    tracer: &'t Tracer,
    counts: &'t mut Counts,
    /// Nodes still to be entered, with the distance at which the ray does; of the world, then of the
    /// instance that is being walked.
    stacks: [Vec<(f32, u32)>; 2],
}

impl<'t> Walk<'t> {
    fn new(tracer: &'t Tracer, counts: &'t mut Counts) -> Self {
        Self {
            tracer,
            counts,
            stacks: Default::default(),
        }
    }

    fn closest(&mut self, ray: &Ray) -> Hit {
        let mut best = Hit::miss(ray.t_max);
        self.group::<false>(0, ray, Hit::NONE, 0.0, &mut best);
        best
    }

    fn occluded(&mut self, ray: &Ray) -> bool {
        self.group::<true>(0, ray, Hit::NONE, 0.0, &mut Hit::miss(ray.t_max))
    }

    /// Meets a group: improves `best`, or with `ANY` returns true at the first hit. `instance` is the
    /// one through which the group is met, and `entry` where the ray enters its box.
    fn group<const ANY: bool>(
        &mut self,
        group: u32,
        ray: &Ray,
        instance: u32,
        entry: f32,
        best: &mut Hit,
    ) -> bool {
        let group = &self.tracer.groups[group as usize];
        let (boxes, shear) = (RayBoxes::new(ray), Shear::new(ray));
        let meet = |walk: &mut Self, item: &Item, best: &mut Hit| {
            walk.item::<ANY>(item, ray, (&boxes, &shear), (instance, entry), best)
        };
        let mut endless = group.unbounded().iter();
        if endless.any(|item| meet(self, item, best) && ANY) {
            return true;
        }
        match self.tracer.method {
            Method::Brute => group
                .items()
                .iter()
                .any(|item| meet(self, item, best) && ANY),
            Method::Tree => {
                let level = usize::from(instance != Hit::NONE);
                let mut stack = std::mem::take(&mut self.stacks[level]);
                let found =
                    group
                        .tree()
                        .walk(&boxes, &mut stack, best.t, |walk_counts, range, limit| {
                            self.counts.node_steps += walk_counts;
                            let found = group.items()[range]
                                .iter()
                                .any(|item| meet(self, item, best) && ANY);
                            *limit = best.t;
                            found
                        });
                stack.clear();
                self.stacks[level] = stack;
                found
            }
        }
    }

    /// Meets one item of a group.
    #[inline]
    fn item<const ANY: bool>(
        &mut self,
        item: &Item,
        ray: &Ray,
        (boxes, shear): (&RayBoxes, &Shear),
        (instance, entry): (u32, f32),
        best: &mut Hit,
    ) -> bool {
        if let Some(inner) = item.as_instance() {
            let Instance { to_world, group } = &self.tracer.instances[inner as usize];
            let bounds = &self.tracer.instance_bounds[inner as usize];
            return boxes.entry(bounds, best.t).is_some_and(|entry| {
                self.group::<ANY>(*group, &to_local(to_world, ray), inner, entry, best)
            });
        }
        self.counts.primitive_tests += 1;
        let (t, u, v, bounds) = match &*self.tracer.shapes[item.shape as usize] {
            Geometry::Mesh(mesh) => {
                let corners = mesh.corners(item.index);
                let Some((t, u, v)) = shear.intersect(corners, best.t) else {
                    return false;
                };
                (
                    t,
                    u,
                    v,
                    corners.into_iter().fold(Bounds::EMPTY, Bounds::with),
                )
            }
            other => {
                let limited = Ray {
                    t_max: best.t,
                    ..*ray
                };
                let Some((t, u, v)) = other.intersect(item.index, &limited) else {
                    return false;
                };
                (t, u, v, other.bounds(item.index))
            }
        };
        // Never before the boxes that lead here: so no order of walking can miss it.
        let Some(own) = boxes.entry(&bounds, f32::INFINITY) else {
            return false;
        };
        let hit = Hit {
            t: t.max(own).max(entry),
            u,
            v,
            instance,
            shape: item.shape,
            primitive: item.index,
        };
        if !hit.precedes(best) {
            return false;
        }
        *best = hit;
        true
    }
}

#[cfg(test)]
mod surface_tests;
#[cfg(test)]
mod tests;
