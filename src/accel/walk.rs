//! One thread's way through the groups: batches through the world's tree and those of instances, every item in
//! turn for brute force; and items that are no triangles, whoever asks.

use std::cmp::Ordering;

use crate::interaction::{Hit, Ray};
use crate::lanes::MAX_LANES;
use crate::shape::{Bounds, Geometry, Sphere};

use super::boxes::RayBoxes;
use super::group::Item;
use super::lone::Lone;
use super::triangle::Shear;
use super::wide::{Best, Met, Needs, Place, Start, Visit, Walker};
use super::{Counts, Instance, Method, Order, Tracer, to_local};

/// See the module.
pub(super) struct Walk<'t> {
    tracer: &'t Tracer,
    counts: &'t mut Counts,
}

/// The way by which a group is met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    pub(super) group: u32,
    /// The instance through which the group is met, or [`Hit::NONE`].
    pub(super) instance: u32,
    /// Where the ray enters the instance's box.
    pub(super) entry: f32,
}

const WORLD: Way = Way {
    group: 0,
    instance: Hit::NONE,
    entry: 0.0,
};

/// Whether a ray's numbers are such that it can meet anything.
fn is_sound(ray: &Ray) -> bool {
    ray.origin.is_finite() && ray.direction.is_finite() && ray.t_max >= 0.0
}

impl<'t> Walk<'t> {
    pub(super) fn new(tracer: &'t Tracer, counts: &'t mut Counts) -> Self {
        Self { tracer, counts }
    }

    /// Improves each ray's hit.
    pub(super) fn closest(&mut self, rays: &[Ray], order: Order, hits: &mut [Hit]) {
        self.rays::<_, false>((WORLD, order), rays, hits);
    }

    /// Says of each ray whether anything lies on it.
    pub(super) fn occluded(&mut self, rays: &[Ray], order: Order, blocked: &mut [bool]) {
        self.rays::<_, true>((WORLD, order), rays, &mut Shadows { rays, blocked });
    }

    /// Meets a group: improves each ray's hit; with `ANY`, by any that is there.
    fn rays<L: Ledger + ?Sized, const ANY: bool>(
        &mut self,
        (way, order): (Way, Order),
        rays: &[Ray],
        ledger: &mut L,
    ) {
        let tracer = self.tracer;
        let group = &tracer.groups[way.group as usize];
        if !group.unbounded().is_empty() {
            self.items::<_, ANY>(way, group.unbounded(), rays, ledger);
        }
        if tracer.method != Method::Tree {
            return self.items::<_, ANY>(way, group.items(), rays, ledger);
        }
        let mut counts = Counts::default();
        let lone = tracer.alone.filter(|_| way.instance == Hit::NONE);
        let lone = lone.and_then(|instance| Lone::new(tracer, instance));
        let (way, tree) = match &lone {
            Some(lone) => (lone.way(), lone.tree()),
            None => (way, group.tree()),
        };
        let mut party = Party::<_, ANY> {
            walk: self,
            way,
            lone,
            rays,
            ledger,
        };
        let (kernel, count) = (tracer.kernel, rays.len());
        let in_packets = order == Order::Coherent || (tracer.is_small && way.instance == Hit::NONE);
        if in_packets && !group.has_instances() {
            tree.packets::<_, ANY>(kernel, &mut party, (rays, order), &mut counts);
            return self.counts.add(&counts);
        }
        let needs = Needs {
            inner_levels: tracer.inner_levels,
            fetch: tracer.is_large,
            later: tracer.deforms || party.lone.is_some(),
            others: tracer.has_others,
        };
        tree.batch::<_, ANY>(kernel, needs, &mut party, count, &mut counts);
        self.counts.add(&counts);
    }

    /// Meets items one after another.
    fn items<L: Ledger + ?Sized, const ANY: bool>(
        &mut self,
        way: Way,
        items: &[Item],
        rays: &[Ray],
        ledger: &mut L,
    ) {
        let stops = ANY && self.tracer.method != Method::Exhaustive;
        for (i, ray) in rays.iter().enumerate().filter(|(_, ray)| is_sound(ray)) {
            let (boxes, shear) = (RayBoxes::new(ray), Shear::new(ray));
            let mut hit = ledger.hit(i);
            for item in items {
                let found = self.item::<ANY>(item, ray, (&boxes, &shear), way, &mut hit);
                if found {
                    ledger.improve(i, hit);
                }
                if found && stops {
                    break;
                }
            }
        }
    }

    /// Meets one item of a group; whether it improved the hit.
    fn item<const ANY: bool>(
        &mut self,
        item: &Item,
        ray: &Ray,
        prepared: (&RayBoxes, &Shear),
        way: Way,
        best: &mut Hit,
    ) -> bool {
        let Some(instance) = item.as_instance() else {
            return self.primitive(item, ray, prepared, way, best);
        };
        let Instance { to_world, group } = &self.tracer.instances[instance as usize];
        let bounds = &self.tracer.instance_bounds[instance as usize];
        let Some(entry) = prepared.0.entry(bounds, best.t) else {
            return false;
        };
        let way = Way {
            group: *group,
            instance,
            entry,
        };
        let before = *best;
        let local = to_local(to_world, ray);
        let way = (way, Order::Any);
        self.rays::<[Hit], ANY>(way, &[local], std::slice::from_mut(best));
        *best != before
    }

    /// Meets one primitive; whether it improved the hit.
    fn primitive(
        &mut self,
        item: &Item,
        ray: &Ray,
        (boxes, shear): (&RayBoxes, &Shear),
        way: Way,
        best: &mut Hit,
    ) -> bool {
        self.counts.primitive_tests += 1;
        let geometry = self.tracer.shapes.get(item.shape);
        let corners = match geometry {
            Geometry::Mesh(mesh) => Some(mesh.corners(item.index)),
            Geometry::Deforming(mesh) => Some(mesh.corners(item.index, mesh.moment(ray.time))),
            _ => None,
        };
        let (t, u, v, bounds) = match corners {
            Some(corners) => {
                let Some((t, u, v)) = shear.intersect(corners, best.t) else {
                    return false;
                };
                let bounds = corners.into_iter().fold(Bounds::EMPTY, Bounds::with);
                (t, u, v, bounds)
            }
            None => {
                let limited = Ray {
                    t_max: best.t,
                    ..*ray
                };
                let Some((t, u, v)) = geometry.intersect(item.index, &limited) else {
                    return false;
                };
                (t, u, v, geometry.bounds(item.index))
            }
        };
        // Never before the boxes that lead here: so no order of walking can miss it.
        let Some(own) = boxes.entry(&bounds, f32::INFINITY) else {
            return false;
        };
        let hit = Hit {
            t: t.max(own).max(way.entry),
            u,
            v,
            instance: way.instance,
            shape: item.shape,
            primitive: item.index,
        };
        let better = hit.precedes(best);
        if better {
            *best = hit;
        }
        better
    }
}

/// Where hits are written down.
trait Ledger {
    /// A ray's best hit so far; a miss says how far the ray goes.
    fn hit(&self, ray: usize) -> Hit;
    /// A better one.
    fn improve(&mut self, ray: usize, hit: Hit);
}

impl Ledger for [Hit] {
    #[inline(always)]
    fn hit(&self, ray: usize) -> Hit {
        self[ray]
    }

    #[inline(always)]
    fn improve(&mut self, ray: usize, hit: Hit) {
        self[ray] = hit;
    }
}

/// Rays of which nobody asks more than whether they are blocked.
struct Shadows<'a> {
    rays: &'a [Ray],
    blocked: &'a mut [bool],
}

impl Ledger for Shadows<'_> {
    #[inline(always)]
    fn hit(&self, ray: usize) -> Hit {
        // What is blocked goes nowhere.
        let end = if self.blocked[ray] {
            f32::NEG_INFINITY
        } else {
            self.rays[ray].t_max
        };
        Hit::miss(end)
    }

    #[inline(always)]
    fn improve(&mut self, ray: usize, _: Hit) {
        self.blocked[ray] = true;
    }
}

/// Rays that walk one group's tree together.
struct Party<'w, 't, 'r, L: ?Sized, const ANY: bool> {
    walk: &'w mut Walk<'t>,
    /// Of the tree in which they begin.
    way: Way,
    /// If that is not the world's.
    lone: Option<Lone<'t>>,
    rays: &'r [Ray],
    ledger: &'r mut L,
}

impl<'t, L: Ledger + ?Sized, const ANY: bool> Party<'_, 't, '_, L, ANY> {
    /// A hit as the tree of an instance or of the world knows it. At an equal distance the one of the lower
    /// instance comes first, which the tree is told by numbers that all or none of its triangles are below.
    #[inline(always)]
    fn best(&self, hit: &Hit, instance: u32) -> Best {
        if hit.is_miss() {
            return Best {
                t: hit.t,
                id: u32::MAX,
                place: Place::NOWHERE,
            };
        }
        let id = match hit.instance.cmp(&instance) {
            Ordering::Less => 0,
            Ordering::Greater => u32::MAX,
            Ordering::Equal => {
                let item = Item::primitive(hit.shape, hit.primitive);
                self.walk.tracer.shapes.number(item)
            }
        };
        Best {
            t: hit.t,
            id,
            place: Place::OUTSIDE,
        }
    }

    /// The primitive that the tree found.
    fn triangle(&self, best: Best, instance: u32, (u, v): (f32, f32)) -> Hit {
        let Item { shape, index } = self.walk.tracer.shapes.numbered(best.id);
        Hit {
            t: best.t,
            u,
            v,
            instance,
            shape,
            primitive: index,
        }
    }

    /// The best that is known of a ray.
    fn known(&self, visit: &Visit) -> Hit {
        if visit.best.is_inside() {
            self.triangle(visit.best, visit.instance, (0.0, 0.0))
        } else {
            self.ledger.hit(visit.ray)
        }
    }

    /// The way through the instance, which is entered there.
    #[inline(always)]
    fn way_by(&self, instance: u32, entry: f32) -> Way {
        if instance == self.way.instance {
            return Way { entry, ..self.way };
        }
        Way {
            group: self.walk.tracer.instances[instance as usize].group,
            instance,
            entry,
        }
    }

    /// The tree of an instance, and how it is entered.
    #[inline(always)]
    fn instance(&self, visit: &Visit, instance: u32) -> Met<'t> {
        let tracer = self.walk.tracer;
        let Instance { to_world, group } = &tracer.instances[instance as usize];
        let best = match visit.best.place {
            Place::NOWHERE => visit.best,
            Place::OUTSIDE => self.best(&self.ledger.hit(visit.ray), instance),
            // A triangle of the world, which comes after those of all instances.
            _ => Best {
                id: u32::MAX,
                place: Place::OUTSIDE,
                ..visit.best
            },
        };
        let ray = &self.rays[visit.ray];
        let (tree, part) = tracer.groups[*group as usize].tree_at(ray.time);
        let start = Start {
            ray: to_local(to_world, ray),
            instance,
            entry: visit.reached,
            part,
            best,
        };
        Met::Instance(tree, start)
    }

    /// Meets a primitive that is no triangle.
    #[inline(never)]
    fn primitive(&mut self, visit: &Visit, way: Way, item: &Item) -> Met<'t> {
        let from = if visit.instance == self.way.instance && self.lone.is_none() {
            self.rays[visit.ray]
        } else {
            let Instance { to_world, .. } = &self.walk.tracer.instances[visit.instance as usize];
            to_local(to_world, &self.rays[visit.ray])
        };
        let mut hit = self.known(visit);
        let prepared = (&visit.boxes, &visit.shear);
        if !(self.walk).primitive(item, &from, prepared, way, &mut hit) {
            return Met::Nothing;
        }
        self.ledger.improve(visit.ray, hit);
        Met::Better(self.best(&hit, visit.instance))
    }
}

impl<'t, L: Ledger + ?Sized, const ANY: bool> Walker<'t> for Party<'_, 't, '_, L, ANY> {
    #[inline(always)]
    fn start(&self, ray: usize) -> Start {
        Start {
            ray: self.rays[ray],
            instance: self.way.instance,
            entry: self.way.entry,
            part: 0.0,
            best: self.best(&self.ledger.hit(ray), self.way.instance),
        }
    }

    #[inline(always)]
    fn begins_inside(&self) -> bool {
        self.lone.is_some()
    }

    #[inline(always)]
    fn start_inside(&mut self, ray: usize) -> Option<Start> {
        let lone = self.lone.as_mut()?;
        if !lone.has(ray) {
            let rays = &self.rays[ray..];
            let mut limits = [0.0; MAX_LANES];
            for (lane, limit) in limits.iter_mut().enumerate().take(rays.len()) {
                *limit = self.ledger.hit(ray + lane).t;
            }
            lone.prepare(ray, rays, &limits);
        }
        let (local, entry) = lone.ray(ray, &self.rays[ray])?;
        Some(Start {
            ray: local,
            instance: self.way.instance,
            entry,
            part: lone.part(local.time),
            best: self.best(&self.ledger.hit(ray), self.way.instance),
        })
    }

    #[inline(always)]
    fn fetch(&self, instance: u32, item: u32) {
        let tracer = self.walk.tracer;
        let way = self.way_by(instance, 0.0);
        let item = &tracer.groups[way.group as usize].items()[item as usize];
        if item.as_instance().is_none() {
            tracer.shapes.get(item.shape).fetch(item.index);
        }
    }

    #[inline(always)]
    fn other(&mut self, visit: &Visit, item: u32) -> Met<'t> {
        let tracer = self.walk.tracer;
        let way = self.way_by(visit.instance, visit.entry);
        let item = &tracer.groups[way.group as usize].items()[item as usize];
        match item.as_instance() {
            Some(instance) => self.instance(visit, instance),
            None => self.primitive(visit, way, item),
        }
    }

    #[inline(always)]
    fn sphere(&self, item: u32) -> Option<(&'t Sphere, u32)> {
        let tracer = self.walk.tracer;
        let item = tracer.groups[self.way.group as usize].items()[item as usize];
        if item.as_instance().is_some() {
            return None;
        }
        match tracer.shapes.get(item.shape) {
            Geometry::Sphere(sphere) => Some((sphere, tracer.shapes.number(item))),
            _ => None,
        }
    }

    #[inline(always)]
    fn found(&mut self, ray: usize, instance: u32, best: Best, uv: (f32, f32)) {
        // Whoever wants any hit knows no number of it.
        let hit = if ANY {
            Hit {
                shape: 0,
                ..Hit::miss(best.t)
            }
        } else {
            self.triangle(best, instance, uv)
        };
        self.ledger.improve(ray, hit);
    }
}
