//! `sdfgrid`: the surface where a function is 0 that is given at the points of a grid, below 0 inside, and trilinear
//! between them; the grid of the `.vol` file `filename` fills the unit cube, which `to_world` places. A primitive is a
//! voxel that the surface passes. Along a ray the function is a cubic, whose first root is enclosed between its extrema
//! and found in double precision. Shading normals are the gradient (`normals` analytic), or the mean of the gradients of
//! the eight voxels around, which has no seams (smooth; Hansson-Söderlund, Evans and Akenine-Möller, *Ray Tracing of
//! Signed Distance Function Grids*, 2022). There are no texture coordinates.

use glam::{DAffine3, DMat4, DVec3, UVec3, Vec2, Vec3};

use super::{Bounds, Geometry, Shape, Surface, rounding};
use crate::description::Properties;
use crate::description::declared::{Plugin, choice, file};
use crate::error::Result;
use crate::image::vol;
use crate::interaction::{Hit, Interaction, Ray};
use crate::math::{Frame, Transform};

/// A surface in a grid, in world space.
#[derive(Debug)]
pub struct SdfGrid {
    /// From the unit cube to the world.
    to_world: DAffine3,
    to_local: DAffine3,
    /// The same, for boxes.
    placed: Transform,
    /// Points along x, y and z, 2 at least.
    size: UVec3,
    /// At the points, x fastest.
    values: Vec<f32>,
    /// The voxels that the surface passes, by the number of their first point.
    voxels: Vec<u32>,
    /// Whether shading normals have no seams.
    smooth: bool,
}

pub(super) const PLUGIN: Plugin = Plugin {
    about: "the surface where a function on a grid is 0",
    properties: &[
        super::COMMON,
        &[
            file(
                "filename",
                "a grid (.vol) with one channel: the distance to the surface, below 0 inside",
            ),
            choice(
                "normals",
                &["smooth", "analytic"],
                "whether shading normals are without seams between voxels",
            ),
        ],
    ],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let path = properties.file("filename")?;
    let grid = vol::read(&path, properties.budget());
    let grid = grid.map_err(|e| e.named_at(properties.location()))?;
    if grid.channels != 1 {
        let message = format!("the grid has {} channels, and one is needed", grid.channels);
        return Err(properties.error("filename", message));
    }
    let size = UVec3::from_array(grid.size);
    if size.min_element() < 2 {
        let message = format!(
            "a grid of {} × {} × {} points has no voxels",
            size.x, size.y, size.z
        );
        let error = properties.error("filename", message);
        return Err(error.help("two points at least are needed along each axis"));
    }
    let matrix = *to_world;
    let placed =
        Transform::new(&matrix).filter(|_| DAffine3::from_mat4(matrix).inverse().is_finite());
    let Some(placed) = placed else {
        let message = "the transform of an sdfgrid must keep its volume";
        return Err(properties.error("to_world", message));
    };
    let mut shape = SdfGrid {
        to_world: DAffine3::from_mat4(matrix),
        to_local: DAffine3::from_mat4(matrix).inverse(),
        placed,
        size,
        values: grid.values,
        voxels: Vec::new(),
        smooth: properties.choice("normals")? == "smooth",
    };
    shape.voxels = shape.passed();
    if shape.voxels.is_empty() {
        let error = properties.error(
            "filename",
            "the function has the same sign all over the grid",
        );
        return Err(error.help("it must be below 0 inside of the surface and above 0 outside"));
    }
    (properties.budget()).take((shape.voxels.len() * size_of::<u32>()) as u64)?;
    Ok(Geometry::Sdf(shape).into())
}

/// A voxel's eight values, x fastest, then y and z.
type Corners = [f64; 8];

/// The trilinear function in the unit cube: factors of 1, x, y, xy, z, xz, yz and xyz.
struct Trilinear([f64; 8]);

impl Trilinear {
    #[inline]
    fn new(f: &Corners) -> Self {
        let (x, y, z) = (f[1] - f[0], f[2] - f[0], f[4] - f[0]);
        let (xy, xz, yz) = (f[3] - f[2] - x, f[5] - f[4] - x, f[6] - f[4] - y);
        let xyz = f[7] - f[6] - f[5] + f[4] - (f[3] - f[2] - f[1] + f[0]);
        Self([f[0], x, y, xy, z, xz, yz, xyz])
    }

    /// The function along a line: factors of 1, t, t² and t³.
    #[inline]
    fn along(&self, o: DVec3, d: DVec3) -> [f64; 4] {
        let Self([k, x, y, xy, z, xz, yz, xyz]) = self;
        let pairs = DVec3::new(
            o.y * d.z + o.z * d.y,
            o.x * d.z + o.z * d.x,
            o.x * d.y + o.y * d.x,
        );
        [
            k + x * o.x
                + y * o.y
                + z * o.z
                + xy * o.x * o.y
                + xz * o.x * o.z
                + yz * o.y * o.z
                + xyz * o.x * o.y * o.z,
            x * d.x
                + y * d.y
                + z * d.z
                + xy * pairs.z
                + xz * pairs.y
                + yz * pairs.x
                + xyz * (pairs.z * o.z + o.x * o.y * d.z),
            xy * d.x * d.y
                + xz * d.x * d.z
                + yz * d.y * d.z
                + xyz * (pairs.z * d.z + d.x * d.y * o.z),
            xyz * d.x * d.y * d.z,
        ]
    }

    fn value(&self, p: DVec3) -> f64 {
        self.along(p, DVec3::ZERO)[0]
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        let Self([_, x, y, xy, z, xz, yz, xyz]) = self;
        DVec3::new(
            x + xy * p.y + xz * p.z + xyz * p.y * p.z,
            y + xy * p.x + yz * p.z + xyz * p.x * p.z,
            z + xz * p.x + yz * p.y + xyz * p.x * p.y,
        )
    }
}

/// A cubic's value.
#[inline]
fn cubic([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    a + t * (b + t * (c + t * d))
}

/// The first root of a cubic in [low, high] that it crosses there.
fn first_root(f: [f64; 4], low: f64, high: f64) -> Option<f64> {
    let [_, b, c, d] = f;
    // Where it turns: 3d t² + 2c t + b = 0.
    let inside = c * c - 3.0 * d * b;
    let q = -(c + inside.max(0.0).sqrt().copysign(c));
    let (one, two) = (q / (3.0 * d), b / q);
    let turns = match inside > 0.0 {
        true => [one.min(two), one.max(two)],
        false => [f64::NAN; 2],
    };
    let mut from = (low, cubic(f, low));
    for to in turns
        .into_iter()
        .filter(|t| low < *t && *t < high)
        .chain([high])
    {
        let to = (to, cubic(f, to));
        if (from.1 < 0.0) != (to.1 < 0.0) {
            return Some(enclosed(f, from, to));
        }
        from = to;
    }
    None
}

/// The root between two places where a cubic that does not turn between them has different signs: by Newton's steps,
/// and by halving where these leave.
fn enclosed(f: [f64; 4], (mut low, at_low): (f64, f64), (mut high, at_high): (f64, f64)) -> f64 {
    let below = at_low < 0.0;
    let mut t = low + (high - low) * (at_low / (at_low - at_high)).clamp(0.0, 1.0);
    for _ in 0..60 {
        let value = cubic(f, t);
        if (value < 0.0) == below {
            low = t;
        } else {
            high = t;
        }
        let slope = f[1] + t * (2.0 * f[2] + t * 3.0 * f[3]);
        let next = t - value / slope;
        let next = match next > low && next < high {
            true => next,
            false => 0.5 * (low + high),
        };
        if (next - t).abs() <= 1e-14 * t.abs() || next == low || next == high {
            return next;
        }
        t = next;
    }
    t
}

/// How much longer than a voxel its stretch of a ray is: what rounding parts from one voxel is in the next.
const BEYOND: f64 = 1e-9;

impl SdfGrid {
    /// Voxels along each axis.
    fn cells(&self) -> UVec3 {
        self.size - 1
    }

    /// The number of a point.
    fn index(&self, at: UVec3) -> u32 {
        (at.z * self.size.y + at.y) * self.size.x + at.x
    }

    /// The place of a point by its number.
    fn place(&self, index: u32) -> UVec3 {
        let (row, x) = (index / self.size.x, index % self.size.x);
        UVec3::new(x, row % self.size.y, row / self.size.y)
    }

    fn corners(&self, first: UVec3) -> Corners {
        std::array::from_fn(|i| {
            let corner = UVec3::new(i as u32 & 1, i as u32 >> 1 & 1, i as u32 >> 2);
            f64::from(self.values[self.index(first + corner) as usize])
        })
    }

    /// The voxels that the surface passes.
    fn passed(&self) -> Vec<u32> {
        let cells = self.cells();
        let rows = (0..cells.z).flat_map(|z| (0..cells.y).map(move |y| (y, z)));
        let voxels = rows.flat_map(|(y, z)| (0..cells.x).map(move |x| UVec3::new(x, y, z)));
        let passes = |voxel: &UVec3| {
            let corners = self.corners(*voxel);
            let all = |one: fn(&f64) -> bool| corners.iter().all(one);
            !all(|f| *f > 0.0) && !all(|f| *f < 0.0)
        };
        voxels
            .filter(passes)
            .map(|voxel| self.index(voxel))
            .collect()
    }

    /// A box around the surface in a voxel, in the unit cube: it holds where edges are crossed, and so all of it.
    fn local_bounds(&self, voxel: UVec3) -> (DVec3, DVec3) {
        let f = self.corners(voxel);
        let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for a in 0..8 {
            for b in [a | 1, a | 2, a | 4] {
                let crossed = f[a] * f[b] <= 0.0 && f[a] != f[b];
                let part = if crossed { f[a] / (f[a] - f[b]) } else { 0.0 };
                if crossed || f[a] == 0.0 {
                    let at = corner(a).lerp(corner(b), part);
                    (low, high) = (low.min(at), high.max(at));
                }
                if f[b] == 0.0 {
                    (low, high) = (low.min(corner(b)), high.max(corner(b)));
                }
            }
        }
        // Room for rounding.
        let (origin, cells) = (voxel.as_dvec3(), self.cells().as_dvec3());
        (
            (origin + low - 1e-6) / cells,
            (origin + high + 1e-6) / cells,
        )
    }

    /// A line in a voxel's own space, in which it is the unit cube.
    #[inline]
    fn in_voxel(&self, voxel: UVec3, ray: &Ray) -> (DVec3, DVec3) {
        let cells = self.cells().as_dvec3();
        let origin = self.to_local.transform_point3(ray.origin.as_dvec3());
        let direction = self.to_local.transform_vector3(ray.direction.as_dvec3());
        (origin * cells - voxel.as_dvec3(), direction * cells)
    }

    /// The gradient that a voxel has for a place, as far as its faces go: differences between opposite faces, at the
    /// other coordinates of the place, wherever it is.
    fn differences(&self, voxel: UVec3, place: DVec3) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| {
            let (mut low, mut high) = (place, place);
            low[axis] = f64::from(voxel[axis]);
            high[axis] = low[axis] + 1.0;
            self.value(high) - self.value(low)
        }))
    }

    /// The function at a place, in voxels.
    fn value(&self, place: DVec3) -> f64 {
        let last = (self.cells() - 1).as_dvec3();
        let voxel = place.floor().clamp(DVec3::ZERO, last);
        let within = (place - voxel).clamp(DVec3::ZERO, DVec3::ONE);
        Trilinear::new(&self.corners(voxel.as_uvec3())).value(within)
    }

    /// The mean of the directions of the gradients of the voxels around a place, in voxels.
    fn smoothed(&self, place: DVec3) -> DVec3 {
        let cells = self.cells();
        // The voxel whose centre is before the place, and how far behind that it is; at the edge there is but one.
        let before = (place - 0.5).floor();
        let last = (cells - 1).as_dvec3();
        let weight = (place - 0.5 - before).clamp(DVec3::ZERO, DVec3::ONE);
        let mut sum = DVec3::ZERO;
        for i in 0..8_u32 {
            let step = UVec3::new(i & 1, i >> 1 & 1, i >> 2).as_dvec3();
            let voxel = (before + step).clamp(DVec3::ZERO, last).as_uvec3();
            let part = step * weight + (1.0 - step) * (1.0 - weight);
            let gradient = self.differences(voxel, place) * cells.as_dvec3();
            sum += part.x * part.y * part.z * gradient.normalize_or_zero();
        }
        sum
    }

    /// A direction across the surface in the world, from that in the unit cube.
    fn to_normal(&self, gradient: DVec3) -> Option<Vec3> {
        let normal = self.to_local.matrix3.transpose() * gradient;
        normal.try_normalize().map(|normal| normal.as_vec3())
    }
}

impl Surface for SdfGrid {
    fn primitive_count(&self) -> u32 {
        self.voxels.len() as u32
    }

    fn bounds(&self, primitive: u32) -> Bounds {
        let voxel = self.place(self.voxels[primitive as usize]);
        let (min, max) = self.local_bounds(voxel);
        let bounds = Bounds {
            min: min.as_vec3(),
            max: max.as_vec3(),
        };
        bounds.transformed(&self.placed)
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)> {
        let voxel = self.place(self.voxels[primitive as usize]);
        let (o, d) = self.in_voxel(voxel, ray);
        let (one, two) = (-o / d, (1.0 - o) / d);
        // Along an axis that the ray stands still on, a stretch is all or nothing.
        let still = d.cmpeq(DVec3::ZERO);
        let outside = o.cmplt(DVec3::splat(-BEYOND)) | o.cmpgt(DVec3::splat(1.0 + BEYOND));
        if (still & outside).any() {
            return None;
        }
        let near = DVec3::select(still, DVec3::NEG_INFINITY, one.min(two)).max_element();
        let far = DVec3::select(still, DVec3::INFINITY, one.max(two)).min_element();
        let room = BEYOND / d.abs().max_element();
        let (near, far) = ((near - room).max(0.0), far + room);
        if !(near < far && far.is_finite()) {
            return None;
        }
        let function = Trilinear::new(&self.corners(voxel)).along(o + near * d, d);
        let t = (near + first_root(function, 0.0, far - near)?) as f32;
        (t > 0.0 && t <= ray.t_max).then_some((t, 0.0, 0.0))
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let voxel = self.place(self.voxels[hit.primitive as usize]);
        let (o, d) = self.in_voxel(voxel, ray);
        let function = Trilinear::new(&self.corners(voxel));
        let cells = self.cells().as_dvec3();
        // Back onto the surface, from which t has been rounded.
        let mut local = o + f64::from(hit.t) * d;
        let way = -self.to_local.transform_vector3(ray.direction.as_dvec3());
        for _ in 0..2 {
            let gradient = function.gradient(local);
            let step = function.value(local) / gradient.length_squared();
            if step.is_finite() {
                local -= step * gradient;
            }
        }
        let gradient = function.gradient(local) * cells;
        let place = voxel.as_dvec3() + local;
        let local = place / cells;
        let position = self.to_world.transform_point3(local);
        let normal = self
            .to_normal(gradient)
            .or_else(|| self.to_normal(way))
            .unwrap_or(Vec3::Z);
        let shading = self.smooth.then(|| self.to_normal(self.smoothed(place)));
        let frame = Frame::around(shading.flatten().unwrap_or(normal));
        Interaction {
            t: hit.t,
            position: position.as_vec3(),
            error: rounding(&self.to_world, local, position),
            normal,
            frame,
            uv: Vec2::ZERO,
            dp_du: Vec3::ZERO,
            dp_dv: Vec3::ZERO,
            footprint: [Vec2::ZERO; 2],
            wi: frame.to_local(-ray.direction),
            time: ray.time,
            shape: hit.shape,
            primitive: hit.primitive,
            mesh: None,
            barycentric: Vec2::ZERO,
        }
    }

    fn bytes(&self) -> usize {
        4 * (self.values.len() + self.voxels.len())
    }
}
