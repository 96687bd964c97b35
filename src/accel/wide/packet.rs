//! Walking the tree with packets: as many rays as there are lanes go down together, and a box or a triangle is held
//! against all of them. That pays for rays that go the same way, as those of a pixel do, and for any rays in small trees; the
//! hits are those of the walk of single rays, to the bit.
//!
//! Rays are walked in groups of sixteen, which are parted into as many packets as the lanes make necessary. All of a
//! group look at children in the order that suits its first ray. So what a ray visits, and what is counted, does not
//! depend on how many lanes there are. Rays that go any way are in groups of one octant, so that each visits what it would
//! visit by itself.

use glam::DVec3;

use super::directions;
use super::node::{BLOCK_INDEX, DONE, LEAF, OTHER, OTHER_INDEX, WIDTH, triangles_of};
use super::state::{Best, Place, Visit};
use super::{Met, Tree, Walker};
use crate::accel::Counts;
use crate::accel::boxes::{LaneBoxes, RayBoxes};
use crate::accel::triangle::{AXES, Shear};
use crate::interaction::{Hit, Ray};
use crate::lanes::{Doubles as _, Ints as _, Lanes, Mask as _, Task, Vec3};

/// Rays that are walked in the same order.
const GROUP: usize = 16;

/// [`Tree::packets`].
pub(super) struct Packets<'a, 't, W, const ANY: bool> {
    pub(super) tree: &'t Tree,
    pub(super) walker: &'a mut W,
    pub(super) rays: &'a [Ray],
    /// The indices of all rays in the order in which they are taken.
    pub(super) sequence: &'a [u32],
    /// Whether they are sorted by octant, and groups have rays of one.
    pub(super) by_octant: bool,
    pub(super) counts: &'a mut Counts,
}

/// Rays that go down together; fields as in [`Shear`].
struct Packet<F: Lanes> {
    origin: Vec3<F>,
    direction: Vec3<F>,
    boxes: LaneBoxes<F>,
    /// The octant of the directions, a bit an axis, where all have the same.
    octant: Option<usize>,
    /// Who goes mostly along x, and who along y.
    mostly: [F::Mask; 2],
    /// The axis along which the rays go mostly, where all have the same.
    axis: Option<usize>,
    /// Along the shear's axes.
    sheared_origin: Vec3<F>,
    shear: [F; 2],
    /// The best hits so far; numbers with their highest bit turned, so that they compare as if without a sign.
    limit: F,
    id: F::Int,
    place: F::Int,
    /// The edge functions of the best.
    edges: [F; 3],
}

/// What is still to be visited.
#[derive(Clone, Copy)]
struct Stop<F: Lanes> {
    near: F,
    name: u32,
    mask: F::Mask,
}

const SIGN: u32 = 1 << 31;

impl<F: Lanes> Packet<F> {
    #[inline(always)]
    fn new(origin: Vec3<F>, direction: Vec3<F>) -> Self {
        let [a, b, c] = [direction.x.abs(), direction.y.abs(), direction.z.abs()];
        let (ab, ac, bc) = (a.gt(b), a.gt(c), b.gt(c));
        let mostly = [ab & ac, !ab & bc];
        let along = Self::turned(mostly, direction);
        Self {
            origin,
            direction,
            boxes: LaneBoxes::new(origin, direction),
            mostly,
            axis: None,
            sheared_origin: Self::turned(mostly, origin),
            shear: [along.x / along.z, along.y / along.z],
            octant: None,
            limit: F::zero(),
            id: F::Int::splat(0),
            place: F::Int::splat(0),
            edges: [F::zero(); 3],
        }
    }

    /// The axis along which the rays with these bits go mostly, where all have the same.
    #[inline(always)]
    fn common_axis(&self, rays: u32) -> Option<usize> {
        let [is_x, is_y] = self.mostly;
        match (is_x.to_bits() & rays, is_y.to_bits() & rays) {
            (0, 0) => Some(2),
            (x, _) if x == rays => Some(0),
            (_, y) if y == rays => Some(1),
            _ => None,
        }
    }

    /// A vector along the shear's axes.
    #[inline(always)]
    fn turned(mostly: [F::Mask; 2], v: Vec3<F>) -> Vec3<F> {
        Vec3::new(
            Self::pick(mostly, [v.y, v.z, v.x]),
            Self::pick(mostly, [v.z, v.x, v.y]),
            Self::pick(mostly, [v.x, v.y, v.z]),
        )
    }

    /// The first of those that go mostly along x, the second along y, the third along z.
    #[inline(always)]
    fn pick([is_x, is_y]: [F::Mask; 2], [x, y, z]: [F; 3]) -> F {
        F::select(is_x, x, F::select(is_y, y, z))
    }

    /// A point along the shear's axes.
    #[inline(always)]
    fn along(&self, point: glam::Vec3) -> Vec3<F> {
        match self.axis {
            Some(axis) => {
                let [x, y, z] = AXES[axis][0];
                Vec3::new(F::splat(point[x]), F::splat(point[y]), F::splat(point[z]))
            }
            None => Self::turned(self.mostly, Vec3::all(point)),
        }
    }

    /// Edge functions of a triangle. Those of rays that go backwards have the other sign than [`Shear::edges`]: whether
    /// all have the same does not depend on it.
    #[inline(always)]
    fn edges(&self, corners: [glam::Vec3; 3]) -> [F; 3] {
        let [a, b, c] = [
            self.planar(corners[0]),
            self.planar(corners[1]),
            self.planar(corners[2]),
        ];
        [
            c[0] * b[1] - c[1] * b[0],
            a[0] * c[1] - a[1] * c[0],
            b[0] * a[1] - b[1] * a[0],
        ]
    }

    #[inline(always)]
    fn planar(&self, corner: glam::Vec3) -> [F; 2] {
        let p = self.along(corner) - self.sheared_origin;
        [p.x - self.shear[0] * p.z, p.y - self.shear[1] * p.z]
    }

    /// The second and third barycentric coordinates of the best hits, as [`Shear::barycentric`] has them.
    #[inline(always)]
    fn barycentric(&self) -> [F; 2] {
        let [u, v, w] = self.edges;
        let inverse = F::one() / (u + v + w);
        [v * inverse + F::zero(), w * inverse + F::zero()]
    }

    /// Distances to a triangle's plane, in double precision.
    #[inline(always)]
    fn distance(&self, [a, b, c]: [DVec3; 3]) -> F {
        let normal = (b - a).cross(c - a);
        let splat = F::Double::splat;
        let (nx, ny, nz) = (splat(normal.x), splat(normal.y), splat(normal.z));
        let (o, d) = (self.origin, self.direction);
        let above = nx * (splat(a.x) - o.x.widen())
            + ny * (splat(a.y) - o.y.widen())
            + nz * (splat(a.z) - o.z.widen());
        let along = nx * d.x.widen() + ny * d.y.widen() + nz * d.z.widen();
        (above / along).narrow()
    }

    /// Takes what some rays meet at these distances, if it is better than their best; whose it is then.
    #[inline(always)]
    fn take(
        &mut self,
        there: F::Mask,
        (t, edges): (F, [F; 3]),
        (id, place): (u32, Place),
    ) -> F::Mask {
        let (id, place) = (F::Int::splat(id ^ SIGN), F::Int::splat(place.0));
        let first = t.eq(self.limit) & id.lt(self.id);
        let better = there & (t.lt(self.limit) | first);
        self.limit = F::select(better, t, self.limit);
        self.id = F::Int::select(better, id, self.id);
        self.place = F::Int::select(better, place, self.place);
        for (best, edge) in self.edges.iter_mut().zip(edges) {
            *best = F::select(better, edge, *best);
        }
        better
    }
}

impl<'t, W: Walker<'t>, const ANY: bool> Task for Packets<'_, 't, W, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(mut self) {
        let stop = Stop {
            near: F::zero(),
            name: DONE,
            mask: F::Mask::splat(false),
        };
        // Each level leaves up to seven children on the stack; the eighth is on its way down.
        let mut stack = vec![stop; (WIDTH - 1) * self.tree.levels + 2 * WIDTH];
        let mut start = 0;
        while start < self.sequence.len() {
            let octant = directions::octant(self.ray(start));
            let mut end = (start + GROUP).min(self.sequence.len());
            while self.by_octant && directions::octant(self.ray(end - 1)) != octant {
                end -= 1;
            }
            for first in (start..end).step_by(F::WIDTH) {
                self.packet(first, end, octant, &mut stack);
            }
            start = end;
        }
    }
}

impl<'t, W: Walker<'t>, const ANY: bool> Packets<'_, 't, W, ANY> {
    /// A ray by its place in the sequence.
    #[inline(always)]
    fn ray(&self, place: usize) -> &Ray {
        &self.rays[self.sequence[place] as usize]
    }

    /// Walks the rays from `first` on, up to `end`.
    #[inline(always)]
    fn packet<F: Lanes>(&mut self, first: usize, end: usize, octant: usize, stack: &mut [Stop<F>]) {
        let count = (end - first).min(F::WIDTH);
        let (mut origin, mut direction) = ([F::ROW; 3], [F::ROW; 3]);
        let mut limit = F::ROW;
        let (mut sound, mut ids, mut places) = (0_u32, F::ROW, F::ROW);
        for lane in 0..count {
            let index = self.sequence[first + lane] as usize;
            let ray = &self.rays[index];
            for axis in 0..3 {
                origin[axis][lane] = ray.origin[axis];
                direction[axis][lane] = ray.direction[axis];
            }
            let best = self.walker.start(index).best;
            limit[lane] = best.t;
            ids[lane] = f32::from_bits(best.id ^ SIGN);
            places[lane] = f32::from_bits(best.place.0);
            let is_sound = ray.origin.is_finite() && ray.direction.is_finite();
            sound |= u32::from(is_sound) << lane;
        }
        let mut packet = Packet::new(Vec3::<F>::load(&origin), Vec3::<F>::load(&direction));
        packet.limit = F::load(&limit);
        packet.id = F::load(&ids).to_bits();
        packet.place = F::load(&places).to_bits();
        packet.octant = packet.boxes.common_octant(sound);
        packet.axis = packet.common_axis(sound);
        self.walk(&mut packet, first, F::Mask::from_bits(sound), octant, stack);
        self.report(&packet, first, count);
    }

    /// Goes down the tree with the rays of the mask.
    #[inline(always)]
    fn walk<F: Lanes>(
        &mut self,
        packet: &mut Packet<F>,
        first: usize,
        mut alive: F::Mask,
        octant: usize,
        stack: &mut [Stop<F>],
    ) {
        let (mut name, mut mask, mut top) = (0_u32, alive, 0);
        let mut reached = F::zero();
        if !mask.any() {
            return;
        }
        loop {
            if name < LEAF {
                let node = &self.tree.nodes[name as usize];
                self.counts.node_steps += u64::from(mask.to_bits().count_ones());
                let order = node.order[octant];
                for place in 0..WIDTH {
                    let child = (order >> (3 * place) & 7) as usize;
                    let name = node.children[child];
                    if name == DONE {
                        continue;
                    }
                    let s = &node.slabs;
                    let slabs = [
                        s[0][child],
                        s[1][child],
                        s[2][child],
                        s[3][child],
                        s[4][child],
                        s[5][child],
                    ];
                    let [near, far] = packet.boxes.enter(slabs, packet.octant);
                    let mask = mask & near.le(far) & near.le(packet.limit);
                    if mask.any() {
                        stack[top] = Stop { near, name, mask };
                        top += 1;
                    }
                }
            } else if name < OTHER {
                let met = self.block(packet, name, mask);
                if ANY {
                    alive = alive & !met;
                }
            } else {
                let met = self.item(packet, first, name, mask, reached);
                if ANY {
                    alive = alive & !met;
                }
            }
            // What lies behind what was found since is left out.
            loop {
                if top == 0 || (ANY && !alive.any()) {
                    return;
                }
                top -= 1;
                let stop = stack[top];
                mask = stop.mask & stop.near.le(packet.limit);
                if ANY {
                    mask = mask & alive;
                }
                if mask.any() {
                    (name, reached) = (stop.name, stop.near);
                    break;
                }
            }
        }
    }

    /// Holds the triangles of a block against the rays; those that meet one that is better.
    #[inline(always)]
    fn block<F: Lanes>(&mut self, packet: &mut Packet<F>, name: u32, mask: F::Mask) -> F::Mask {
        let index = name & BLOCK_INDEX;
        let block = &self.tree.blocks[index as usize];
        let count = triangles_of(name);
        self.counts.primitive_tests += u64::from(count * mask.to_bits().count_ones());
        let zero = F::zero();
        let mut met = F::Mask::splat(false);
        for lane in 0..count as usize {
            let corners = block.triangle(lane);
            let edges = packet.edges(corners);
            let [u, v, w] = edges;
            let up = u.ge(zero) & v.ge(zero) & w.ge(zero);
            let down = u.le(zero) & v.le(zero) & w.le(zero);
            let inside = (up ^ down) & mask;
            if !inside.any() {
                continue;
            }
            let [a, b, c] = corners;
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            let slabs = [low.x, high.x, low.y, high.y, low.z, high.z];
            let [own, far] = packet.boxes.enter(slabs, packet.octant);
            let t = packet.distance(corners.map(glam::Vec3::as_dvec3));
            let there = inside & own.le(far) & zero.lt(t);
            // Never before its own box: so no order of walking can miss it.
            let place = Place(index << 2 | lane as u32);
            met = met | packet.take(there, (t.max(own), edges), (block.ids[lane], place));
        }
        met
    }

    /// Holds an item that is no triangle against the rays; those that meet it.
    #[inline(always)]
    fn item<F: Lanes>(
        &mut self,
        packet: &mut Packet<F>,
        first: usize,
        name: u32,
        mask: F::Mask,
        reached: F,
    ) -> F::Mask {
        let Some((sphere, number)) = self.walker.sphere(name & OTHER_INDEX) else {
            return self.other(packet, first, name, mask, reached);
        };
        self.counts.primitive_tests += u64::from(mask.to_bits().count_ones());
        let t = sphere.meet(packet.origin, packet.direction, packet.limit);
        // What is not a number would become one.
        let there = mask & t.le(packet.limit);
        // Its u and v are 0.
        let edges = [F::one(), F::zero(), F::zero()];
        packet.take(there, (t.max(reached), edges), (number, Place::ITEM))
    }

    /// Holds any item against the rays one by one; those that meet it.
    #[inline(always)]
    fn other<F: Lanes>(
        &mut self,
        packet: &mut Packet<F>,
        first: usize,
        name: u32,
        mask: F::Mask,
        reached: F,
    ) -> F::Mask {
        let (mut limit, reached) = (packet.limit.row(), reached.row());
        let mut ids = packet.id.from_bits().row();
        let mut places = packet.place.from_bits().row();
        let mut met = 0;
        for lane in mask.lanes() {
            let index = self.sequence[first + lane] as usize;
            let ray = &self.rays[index];
            let visit = Visit {
                ray: index,
                instance: Hit::NONE,
                entry: 0.0,
                reached: reached[lane],
                best: Best {
                    t: limit[lane],
                    id: ids[lane].to_bits() ^ SIGN,
                    place: Place(places[lane].to_bits()),
                },
                boxes: RayBoxes::new(ray),
                shear: Shear::new(ray),
            };
            match self.walker.other(&visit, name & OTHER_INDEX) {
                Met::Nothing => {}
                Met::Better(Best { t, id, place }) => {
                    limit[lane] = t;
                    ids[lane] = f32::from_bits(id ^ SIGN);
                    places[lane] = f32::from_bits(place.0);
                    met |= 1 << lane;
                }
                Met::Instance(..) => unreachable!("packets walk trees without instances"),
            }
        }
        packet.limit = F::load(&limit);
        packet.id = F::load(&ids).to_bits();
        packet.place = F::load(&places).to_bits();
        F::Mask::from_bits(met)
    }

    /// Hands the primitives that were found to the walker.
    #[inline(always)]
    fn report<F: Lanes>(&mut self, packet: &Packet<F>, first: usize, count: usize) {
        let (limit, ids) = (packet.limit.row(), packet.id.from_bits().row());
        let places = packet.place.from_bits().row();
        let [u, v] = packet.barycentric();
        let (u, v) = (u.row(), v.row());
        for lane in 0..count {
            let best = Best {
                t: limit[lane],
                id: ids[lane].to_bits() ^ SIGN,
                place: Place(places[lane].to_bits()),
            };
            if best.is_inside() {
                let index = self.sequence[first + lane] as usize;
                self.walker
                    .found(index, Hit::NONE, best, (u[lane], v[lane]));
            }
        }
    }
}
