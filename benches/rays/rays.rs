//! The rays: made once a mesh from Étendue's hits, and the same arrays for every tracer.
//!
//! Primary rays are those of two cameras, a sample a pixel, in tiles as the renderer takes them and inside a
//! tile along Morton's curve, so that sixteen in a row are a square of pixels. From their hits start the
//! any-hit rays, by turns toward a light and, for ambient occlusion, in a cosine-distributed direction; and
//! the first bounce; from that one's hits the second.

use etendue::interaction::{Hit, Ray};
use etendue::lanes::warp;
use etendue::math::{Frame, random};
use glam::{Vec2, Vec3};

use crate::peer::Peer;

/// Rays of a batch: as many camera rays as the renderer traces at a time in RGB, in whole packets.
pub(crate) const BATCH: usize = 2_720;

/// What a tracer is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Question {
    /// The closest hit, of rays side by side.
    Coherent,
    /// The closest hit.
    Closest,
    /// Whether there is any.
    Any,
}

/// Rays of one kind.
pub(crate) struct Set {
    pub(crate) name: &'static str,
    pub(crate) question: Question,
    pub(crate) rays: Vec<Ray>,
    /// The same once more, where they are coherent.
    pub(crate) packets: Vec<Packet>,
}

/// Sixteen rays, a coordinate a row; those after the last ray have ended before they begin.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Packet {
    pub(crate) origin: [[f32; 16]; 3],
    pub(crate) direction: [[f32; 16]; 3],
    pub(crate) t_max: [f32; 16],
}

/// A part of a set.
#[derive(Clone, Copy)]
pub(crate) struct Batch<'s> {
    pub(crate) rays: &'s [Ray],
    pub(crate) packets: &'s [Packet],
}

impl Set {
    pub(crate) fn new(name: &'static str, question: Question, rays: Vec<Ray>) -> Self {
        let packets = match question {
            Question::Coherent => rays.chunks(16).map(packet).collect(),
            _ => Vec::new(),
        };
        Self {
            name,
            question,
            rays,
            packets,
        }
    }

    pub(crate) fn batches(&self) -> Vec<Batch<'_>> {
        let packets = self
            .packets
            .chunks(BATCH / 16)
            .chain(std::iter::repeat(&[][..]));
        let batches = self.rays.chunks(BATCH).zip(packets);
        batches
            .map(|(rays, packets)| Batch { rays, packets })
            .collect()
    }
}

fn packet(rays: &[Ray]) -> Packet {
    let row = |value: &dyn Fn(&Ray) -> f32, none: f32| -> [f32; 16] {
        std::array::from_fn(|i| rays.get(i).map_or(none, value))
    };
    let rows = |value: fn(&Ray) -> Vec3| [0, 1, 2].map(|axis| row(&|r| value(r)[axis], 1.0));
    Packet {
        origin: rows(|r| r.origin),
        direction: rows(|r| r.direction),
        t_max: row(&|r| r.t_max, -1.0),
    }
}

/// What rays are made for.
pub(crate) struct Stage<'t> {
    /// Its lowest and highest corner.
    pub(crate) bounds: (Vec3, Vec3),
    /// The unit normal where a ray has hit, on the side where it came from.
    pub(crate) normal: &'t dyn Fn(&Ray, &Hit) -> Vec3,
}

/// The four sets, of about `count` rays each, from hits that `tracer` finds.
pub(crate) fn sets(stage: &Stage<'_>, tracer: &dyn Peer, count: usize) -> Vec<Set> {
    let scene = Scene::new(stage, tracer);
    let primary = scene.primary(count);
    let seen = scene.points(&primary);
    let first = scene.bounce(&seen, count, 1);
    let second = scene.bounce(&scene.points(&first), count, 2);
    vec![
        Set::new("primary", Question::Coherent, primary),
        Set::new(
            "shadow and occlusion",
            Question::Any,
            scene.any_hit(&seen, count),
        ),
        Set::new("first bounce", Question::Closest, first),
        Set::new("second bounce", Question::Closest, second),
    ]
}

/// A mesh to stand on.
struct Scene<'t> {
    normal: &'t dyn Fn(&Ray, &Hit) -> Vec3,
    tracer: &'t dyn Peer,
    center: Vec3,
    /// Of a ball around everything.
    radius: f32,
}

/// Where a ray ended, moved off the surface, and the normal on the side where it came from.
struct Point {
    position: Vec3,
    normal: Vec3,
}

impl<'t> Scene<'t> {
    fn new(stage: &Stage<'t>, tracer: &'t dyn Peer) -> Self {
        let (low, high) = stage.bounds;
        Self {
            normal: stage.normal,
            tracer,
            center: low.midpoint(high),
            radius: 0.5 * low.distance(high),
        }
    }

    /// From where the mesh fills most of the image.
    fn primary(&self, count: usize) -> Vec<Ray> {
        // Directions to the cameras, and their distances in radii: above, whether y or z points up.
        let cameras = [
            (Vec3::new(0.8, 0.45, 0.6), 1.5),
            (Vec3::new(-0.6, 0.7, 0.5), 1.0),
        ];
        let side = (((count / cameras.len()) as f64).sqrt() as u32).next_multiple_of(TILE);
        let rays = cameras.iter().flat_map(|(toward, distance)| {
            let eye = self.center + toward.normalize() * distance * self.radius;
            let frame = Frame::around((self.center - eye).normalize());
            pixels(side).map(move |pixel| {
                let at = (pixel + 0.5) * (2.0 / side as f32) - 1.0;
                let direction = frame.n + 0.45 * (at.x * frame.s + at.y * frame.t);
                ray(eye, direction.normalize(), f32::INFINITY)
            })
        });
        rays.collect()
    }

    /// Where rays end; those that miss are left out.
    fn points(&self, rays: &[Ray]) -> Vec<Point> {
        let mut hits = Vec::new();
        let packets = &[];
        self.tracer.closest(&Batch { rays, packets }, &mut hits);
        let met = rays.iter().zip(&hits).filter(|(_, hit)| !hit.is_miss());
        met.map(|(ray, hit)| {
            let normal = (self.normal)(ray, hit);
            // Further than any of them rounds, so that all start on the same side.
            let position = ray.at(hit.t) + 2e-5 * self.radius * normal;
            Point { position, normal }
        })
        .collect()
    }

    fn bounce(&self, points: &[Point], count: usize, seed: u64) -> Vec<Ray> {
        let start = |(i, point): (u32, &Point)| {
            ray(point.position, cosine(point.normal, seed, i), f32::INFINITY)
        };
        spread(points, count).map(start).collect()
    }

    fn any_hit(&self, points: &[Point], count: usize) -> Vec<Ray> {
        let light = self.center + self.radius * Vec3::new(-1.0, 0.5, 0.4);
        let start = |(i, point): (u32, &Point)| {
            let way = light - point.position;
            if i % 2 == 0 && way.dot(point.normal) > 0.0 {
                ray(point.position, way.normalize(), way.length())
            } else {
                ray(
                    point.position,
                    cosine(point.normal, 3, i),
                    0.4 * self.radius,
                )
            }
        };
        spread(points, count).map(start).collect()
    }
}

/// Pixels along a side of a tile, as in the renderer.
const TILE: u32 = 32;

/// The pixels of a square image, tile by tile.
fn pixels(side: u32) -> impl Iterator<Item = Vec2> {
    // Every second bit of a place along Morton's curve.
    let half = |i: u32| (0..5).fold(0, |x, bit| x | ((i >> (2 * bit)) & 1) << bit);
    let tiles = side / TILE;
    (0..tiles * tiles).flat_map(move |tile| {
        (0..TILE * TILE).map(move |i| {
            let x = tile % tiles * TILE + half(i);
            let y = tile / tiles * TILE + half(i >> 1);
            Vec2::new(x as f32, y as f32)
        })
    })
}

/// `count` of `points`, numbered: in their order, some left out or several times.
fn spread<T>(points: &[T], count: usize) -> impl Iterator<Item = (u32, &T)> {
    let count = if points.is_empty() { 0 } else { count };
    (0..count).map(move |i| (i as u32, &points[i * points.len() / count]))
}

fn cosine(normal: Vec3, seed: u64, i: u32) -> Vec3 {
    let unit = |dimension| random::unit(random::bits(random::key(seed, u64::from(i)), dimension));
    let local = warp::cosine_hemisphere::<f32>(Vec2::new(unit(0), unit(1)).into());
    Frame::around(normal).to_world(local.into())
}

/// Of unit length.
pub(crate) fn ray(origin: Vec3, direction: Vec3, t_max: f32) -> Ray {
    Ray {
        origin,
        direction,
        t_max,
        time: 0.0,
    }
}
