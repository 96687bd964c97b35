//! One thread's way through the groups: batches through the world's tree, single rays through those of
//! instances, every item in turn for brute force; and items that are no triangles, whoever asks.

use crate::interaction::{Hit, Ray};
use crate::shape::{Bounds, Geometry};

use super::boxes::RayBoxes;
use super::group::{Group, Item};
use super::triangle::Shear;
use super::wide::{Best, Flight, Place, Start, Walker};
use super::{Counts, Instance, Method, Tracer, to_local};

/// See the module.
pub(super) struct Walk<'t> {
    tracer: &'t Tracer,
    counts: &'t mut Counts,
    /// Room for walking an instance.
    inner: Option<Flight>,
}

/// The way by which a group is met.
#[derive(Clone, Copy, Debug)]
struct Way {
    group: u32,
    /// The instance through which the group is met, or [`Hit::NONE`].
    instance: u32,
    /// Where the ray enters the instance's box.
    entry: f32,
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
        Self {
            tracer,
            counts,
            inner: None,
        }
    }

    /// Improves each ray's hit.
    pub(super) fn closest(&mut self, rays: &[Ray], hits: &mut [Hit]) {
        self.rays::<false>(WORLD, rays, hits);
    }

    /// Says of each ray whether anything lies on it.
    pub(super) fn occluded(&mut self, rays: &[Ray], blocked: &mut [bool]) {
        let mut hits: Vec<Hit> = rays.iter().map(|ray| Hit::miss(ray.t_max)).collect();
        self.rays::<true>(WORLD, rays, &mut hits);
        for (blocked, hit) in blocked.iter_mut().zip(hits) {
            *blocked = !hit.is_miss();
        }
    }

    /// Meets a group: improves each ray's hit; with `ANY`, by any that is there.
    fn rays<const ANY: bool>(&mut self, way: Way, rays: &[Ray], hits: &mut [Hit]) {
        let tracer = self.tracer;
        let group = &tracer.groups[way.group as usize];
        if !group.unbounded().is_empty() {
            self.items::<ANY>(way, group.unbounded(), rays, hits);
        }
        if tracer.method == Method::Brute {
            return self.items::<ANY>(way, group.items(), rays, hits);
        }
        let mut counts = Counts::default();
        let mut inner = self.inner.take();
        let mut party = Party::<ANY> {
            walk: self,
            group,
            way,
            rays,
            hits,
        };
        if way.instance == Hit::NONE {
            let count = rays.len();
            group
                .tree()
                .batch::<_, ANY>(tracer.kernel, &mut party, count, &mut counts);
        } else {
            let flight = inner.get_or_insert_with(|| {
                let levels = tracer.groups.iter().map(|group| group.tree().levels());
                Flight::new(1, levels.max().unwrap_or(1))
            });
            group
                .tree()
                .single::<_, ANY>(tracer.kernel, &mut party, flight, &mut counts);
        }
        self.inner = self.inner.take().or(inner);
        self.counts.add(&counts);
    }

    /// Meets items one after another.
    fn items<const ANY: bool>(&mut self, way: Way, items: &[Item], rays: &[Ray], hits: &mut [Hit]) {
        for (ray, hit) in rays.iter().zip(hits).filter(|(ray, _)| is_sound(ray)) {
            let (boxes, shear) = (RayBoxes::new(ray), Shear::new(ray));
            for item in items {
                if ANY && !hit.is_miss() {
                    break;
                }
                self.item::<ANY>(item, ray, (&boxes, &shear), way, hit);
            }
        }
    }

    /// Meets one item of a group; whether it improved the hit.
    fn item<const ANY: bool>(
        &mut self,
        item: &Item,
        ray: &Ray,
        (boxes, shear): (&RayBoxes, &Shear),
        way: Way,
        best: &mut Hit,
    ) -> bool {
        if let Some(instance) = item.as_instance() {
            let Instance { to_world, group } = self.tracer.instances[instance as usize];
            let bounds = &self.tracer.instance_bounds[instance as usize];
            let Some(entry) = boxes.entry(bounds, best.t) else {
                return false;
            };
            let way = Way {
                group,
                instance,
                entry,
            };
            let before = *best;
            let local = to_local(&to_world, ray);
            self.rays::<ANY>(way, &[local], std::slice::from_mut(best));
            return *best != before;
        }
        self.counts.primitive_tests += 1;
        let (t, u, v, bounds) = match self.tracer.shapes.get(item.shape) {
            Geometry::Mesh(mesh) => {
                let corners = mesh.corners(item.index);
                let Some((t, u, v)) = shear.intersect(corners, best.t) else {
                    return false;
                };
                let bounds = corners.into_iter().fold(Bounds::EMPTY, Bounds::with);
                (t, u, v, bounds)
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

/// Rays that walk one group's tree together.
struct Party<'w, 't, 'r, const ANY: bool> {
    walk: &'w mut Walk<'t>,
    group: &'t Group,
    way: Way,
    rays: &'r [Ray],
    hits: &'r mut [Hit],
}

impl<const ANY: bool> Party<'_, '_, '_, ANY> {
    /// A hit as the tree knows it. At an equal distance the one of the lower instance comes first, which
    /// the tree is told by numbers that all or none of its triangles are below.
    fn best(&self, hit: &Hit) -> Best {
        let id = if hit.instance != self.way.instance {
            if hit.instance > self.way.instance {
                u32::MAX
            } else {
                0
            }
        } else if hit.is_miss() {
            u32::MAX
        } else {
            let item = Item::primitive(hit.shape, hit.primitive);
            self.walk.tracer.shapes.number(item)
        };
        Best {
            t: hit.t,
            id,
            place: if hit.is_miss() {
                Place::NOWHERE
            } else {
                Place::OUTSIDE
            },
        }
    }

    /// The hit of the triangle with this number.
    fn triangle(&self, t: f32, id: u32, (u, v): (f32, f32)) -> Hit {
        let Item { shape, index } = self.walk.tracer.shapes.numbered(id);
        Hit {
            t,
            u,
            v,
            instance: self.way.instance,
            shape,
            primitive: index,
        }
    }
}

impl<const ANY: bool> Walker for Party<'_, '_, '_, ANY> {
    #[inline(always)]
    fn start(&self, ray: usize) -> Start {
        Start {
            ray: self.rays[ray],
            entry: self.way.entry,
            best: self.best(&self.hits[ray]),
        }
    }

    fn other(&mut self, ray: usize, item: u32, best: Best) -> Option<Best> {
        if !matches!(best.place, Place::NOWHERE | Place::OUTSIDE) {
            self.hits[ray] = self.triangle(best.t, best.id, (0.0, 0.0));
        }
        let (from, item) = (self.rays[ray], self.group.items()[item as usize]);
        let (boxes, shear) = (RayBoxes::new(&from), Shear::new(&from));
        let mut hit = self.hits[ray];
        let found = self
            .walk
            .item::<ANY>(&item, &from, (&boxes, &shear), self.way, &mut hit);
        found.then(|| {
            self.hits[ray] = hit;
            self.best(&hit)
        })
    }

    #[inline(always)]
    fn end(&mut self, ray: usize, best: Best, uv: (f32, f32)) {
        if !matches!(best.place, Place::NOWHERE | Place::OUTSIDE) {
            self.hits[ray] = self.triangle(best.t, best.id, uv);
        }
    }
}
