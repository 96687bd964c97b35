//! Walking the tree with packets: as many rays as there are lanes go down together, and a box or a triangle is held
//! against all of them. That pays for rays that go the same way, as those of a pixel do; the hits are those of the walk
//! of single rays, to the bit.
//!
//! Rays are walked in groups of sixteen, which are parted into as many packets as the lanes make necessary. All of a
//! group look at children in the order that suits its first ray. So what a ray visits, and what is counted, does not
//! depend on how many lanes there are.

use glam::DVec3;

use super::node::{BLOCK, BLOCK_INDEX, DONE, LEAF, OTHER, OTHER_INDEX, WIDTH, triangles_of};
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
    pub(super) counts: &'a mut Counts,
}

/// Rays that go down together; fields as in [`Shear`].
struct Packet<F: Lanes> {
    origin: Vec3<F>,
    direction: Vec3<F>,
    boxes: LaneBoxes<F>,
    /// The octant of the directions, a bit an axis, where all have the same.
    octant: Option<usize>,
    /// Along the shear's axes.
    sheared_origin: Vec3<F>,
    shear: [F; 2],
    /// Which axes: those of each ray, 0 to 5, and who has which.
    ways: [F::Mask; 6],
    /// The best hits so far; numbers with their highest bit turned, so that they compare as if without a sign.
    limit: F,
    id: F::Int,
    place: F::Int,
}

/// What is still to be visited.
#[derive(Clone, Copy)]
struct Stop<F: Lanes> {
    near: F,
    name: u32,
    mask: F::Mask,
}

const SIGN: u32 = 1 << 31;

/// The axis along which a ray mostly goes, and whether it goes backwards, as an index of [`Packet::ways`].
fn axes_of(way: usize) -> [usize; 3] {
    AXES[way / 2][way % 2]
}

/// A point along these axes, for all rays.
#[inline(always)]
fn along<F: Lanes>(point: glam::Vec3, [x, y, z]: [usize; 3]) -> Vec3<F> {
    Vec3::new(F::splat(point[x]), F::splat(point[y]), F::splat(point[z]))
}

impl<F: Lanes> Packet<F> {
    #[inline(always)]
    fn new(origin: Vec3<F>, direction: Vec3<F>) -> Self {
        let zero = F::zero();
        let (x, y, z) = (direction.x, direction.y, direction.z);
        let (a, b, c) = (x.abs(), y.abs(), z.abs());
        let (ab, ac, bc) = (a.gt(b), a.gt(c), b.gt(c));
        let (is_x, is_y) = (ab & ac, !ab & bc);
        let along = Self::pick(is_x, is_y, direction, [0, 1, 2]);
        let back = along.lt(zero);
        // The axes after z, changed round for rays that go backwards.
        let (first, second) = (
            Self::pick(is_x, is_y, direction, [1, 2, 0]),
            Self::pick(is_x, is_y, direction, [2, 0, 1]),
        );
        let (from_first, from_second) = (
            Self::pick(is_x, is_y, origin, [1, 2, 0]),
            Self::pick(is_x, is_y, origin, [2, 0, 1]),
        );
        let sheared_origin = Vec3::new(
            F::select(back, from_second, from_first),
            F::select(back, from_first, from_second),
            Self::pick(is_x, is_y, origin, [0, 1, 2]),
        );
        let shear = [
            F::select(back, second, first) / along,
            F::select(back, first, second) / along,
        ];
        let is_z = !is_x & !is_y;
        Self {
            origin,
            direction,
            boxes: LaneBoxes::new(origin, direction),
            sheared_origin,
            shear,
            ways: [
                is_x & !back,
                is_x & back,
                is_y & !back,
                is_y & back,
                is_z & !back,
                is_z & back,
            ],
            octant: None,
            limit: zero,
            id: F::Int::splat(0),
            place: F::Int::splat(0),
        }
    }

    /// The component `axes[0]` of those that go mostly along x, `axes[1]` along y, `axes[2]` along z.
    #[inline(always)]
    fn pick(is_x: F::Mask, is_y: F::Mask, v: Vec3<F>, axes: [usize; 3]) -> F {
        let v = [v.x, v.y, v.z];
        F::select(is_x, v[axes[0]], F::select(is_y, v[axes[1]], v[axes[2]]))
    }

    /// Edge functions of a triangle whose corners are given along the shear's axes.
    #[inline(always)]
    fn edges(&self, corners: [Vec3<F>; 3]) -> [F; 3] {
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
    fn planar(&self, corner: Vec3<F>) -> [F; 2] {
        let p = corner - self.sheared_origin;
        [p.x - self.shear[0] * p.z, p.y - self.shear[1] * p.z]
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
        for start in (0..self.rays.len()).step_by(GROUP) {
            let end = (start + GROUP).min(self.rays.len());
            let backward = RayBoxes::new(&self.rays[start])
                .inverse
                .cmplt(glam::Vec3::ZERO);
            let octant = backward.bitmask() as usize;
            for first in (start..end).step_by(F::WIDTH) {
                self.packet(first, end, octant, &mut stack);
            }
        }
    }
}

impl<'t, W: Walker<'t>, const ANY: bool> Packets<'_, 't, W, ANY> {
    /// Walks the rays from `first` on, up to `end`.
    #[inline(always)]
    fn packet<F: Lanes>(&mut self, first: usize, end: usize, octant: usize, stack: &mut [Stop<F>]) {
        let count = (end - first).min(F::WIDTH);
        let (mut origin, mut direction) = ([F::ROW; 3], [F::ROW; 3]);
        let mut limit = F::ROW;
        let (mut sound, mut ids, mut places) = (0_u32, F::ROW, F::ROW);
        for lane in 0..count {
            let ray = &self.rays[first + lane];
            for axis in 0..3 {
                origin[axis][lane] = ray.origin[axis];
                direction[axis][lane] = ray.direction[axis];
            }
            let best = self.walker.start(first + lane).best;
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
                let met = self.other(packet, first, name, mask, reached);
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
        for way in 0..packet.ways.len() {
            let mask = mask & packet.ways[way];
            if !mask.any() {
                continue;
            }
            let axes = axes_of(way);
            for lane in 0..count as usize {
                let [a, b, c] = block.triangle(lane);
                let sheared = [along(a, axes), along(b, axes), along(c, axes)];
                let [u, v, w] = packet.edges(sheared);
                let up = u.ge(zero) & v.ge(zero) & w.ge(zero);
                let down = u.le(zero) & v.le(zero) & w.le(zero);
                let inside = (up ^ down) & mask;
                if !inside.any() {
                    continue;
                }
                let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                let slabs = [low.x, high.x, low.y, high.y, low.z, high.z];
                let [own, far] = packet.boxes.enter(slabs, packet.octant);
                let t = packet.distance([a, b, c].map(glam::Vec3::as_dvec3));
                let there = inside & own.le(far) & zero.lt(t);
                // Never before its own box: so no order of walking can miss it.
                let t = t.max(own);
                let id = F::Int::splat(block.ids[lane] ^ SIGN);
                let first = t.eq(packet.limit) & id.lt(packet.id);
                let better = there & (t.lt(packet.limit) | first);
                packet.limit = F::select(better, t, packet.limit);
                let (place, old) = (F::Int::splat(index << 2 | lane as u32), packet.place);
                packet.id = F::select(better, id.from_bits(), packet.id.from_bits()).to_bits();
                packet.place = F::select(better, place.from_bits(), old.from_bits()).to_bits();
                met = met | better;
            }
        }
        met
    }

    /// Holds an item that is no triangle against the rays one by one; those that meet it.
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
            let ray = &self.rays[first + lane];
            let visit = Visit {
                ray: first + lane,
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

    /// Hands the triangles that were found to the walker.
    #[inline(always)]
    fn report<F: Lanes>(&mut self, packet: &Packet<F>, first: usize, count: usize) {
        let (limit, ids) = (packet.limit.row(), packet.id.from_bits().row());
        let places = packet.place.from_bits().row();
        for lane in 0..count {
            let best = Best {
                t: limit[lane],
                id: ids[lane].to_bits() ^ SIGN,
                place: Place(places[lane].to_bits()),
            };
            if !best.is_inside() {
                continue;
            }
            let mut uv = (0.0, 0.0);
            if !ANY {
                let place = places[lane].to_bits() as usize;
                let corners = self.tree.blocks[place / BLOCK].triangle(place % BLOCK);
                let shear = Shear::new(&self.rays[first + lane]);
                uv = Shear::barycentric(shear.edges(corners));
            }
            self.walker.found(first + lane, Hit::NONE, best, uv);
        }
    }
}
