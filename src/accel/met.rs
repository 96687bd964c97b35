//! What a block of rays has met: from hits to points in lanes. Points on triangles of the world are made together,
//! all others one by one.

use glam::Vec2;

use super::Tracer;
use crate::interaction::{Hit, Interaction, Points, Ray, Source};
use crate::lanes::{self, Frame, Lanes, Mask as _};
use crate::mesh::Mesh;
use crate::shape::{Geometry, Triangles};

/// Some of the rays that were traced together, each with its hit.
#[derive(Clone, Copy, Debug)]
pub struct Met<'a> {
    /// Who traced them.
    pub tracer: &'a Tracer,
    /// All rays.
    pub rays: &'a [Ray],
    /// Their hits.
    pub hits: &'a [Hit],
    /// Which of them, a lane each; none missed.
    pub indices: &'a [u32],
}

impl Met<'_> {
    /// A lane's ray.
    #[inline(always)]
    pub fn ray(&self, lane: usize) -> &Ray {
        &self.rays[self.indices[lane] as usize]
    }

    /// A lane's hit.
    #[inline(always)]
    pub fn hit(&self, lane: usize) -> &Hit {
        &self.hits[self.indices[lane] as usize]
    }

    /// The rays' directions.
    #[inline(always)]
    pub fn directions<F: Lanes>(&self) -> lanes::Vec3<F> {
        let mut rows = [F::ROW; 3];
        for lane in 0..self.indices.len() {
            let direction = self.ray(lane).direction;
            for (row, value) in rows.iter_mut().zip(direction.to_array()) {
                row[lane] = value;
            }
        }
        lanes::Vec3::<F>::load(&rows)
    }

    /// The points; at most as many as there are lanes.
    #[inline(always)]
    pub fn points<F: Lanes>(&self) -> Points<'_, F> {
        let mut triangles = Triangles::<F>::default();
        let mut others = 0_u32;
        for lane in 0..self.indices.len() {
            let hit = self.hit(lane);
            match self.tracer.shapes.get(hit.shape) {
                Geometry::Mesh(mesh) if hit.instance == Hit::NONE => {
                    triangles.set(lane, mesh, hit.primitive, Vec2::new(hit.u, hit.v));
                }
                _ => others |= 1 << lane,
            }
        }
        let surface = triangles.surface();
        let frame = surface.frame;
        let points = Points {
            active: F::Mask::from_bits(!(u32::MAX << self.indices.len())),
            position: surface.position,
            error: surface.error,
            normal: surface.normal,
            frame,
            uv: surface.uv,
            dp_du: surface.dp_du,
            dp_dv: surface.dp_dv,
            footprint: [lanes::Vec2::splat(0.0); 2],
            wi: frame.to_local(-self.directions()),
            source: self,
        };
        if others == 0 {
            points
        } else {
            self.with_others(points, F::Mask::from_bits(others))
        }
    }

    /// The points with those of some lanes made one by one.
    #[inline(always)]
    fn with_others<'a, F: Lanes>(
        &'a self,
        points: Points<'a, F>,
        others: F::Mask,
    ) -> Points<'a, F> {
        /// Vectors of three in a point.
        const VECTORS: usize = 9;
        let mut rows = [[F::ROW; 3]; VECTORS];
        let mut uvs = [F::ROW; 2];
        for lane in others.lanes() {
            let at = self.interaction(lane);
            let vectors: [glam::Vec3; VECTORS] = [
                at.position,
                at.error,
                at.normal,
                at.frame.s,
                at.frame.t,
                at.frame.n,
                at.dp_du,
                at.dp_dv,
                at.wi,
            ];
            for (rows, vector) in rows.iter_mut().zip(vectors) {
                for (row, value) in rows.iter_mut().zip(vector.to_array()) {
                    row[lane] = value;
                }
            }
            (uvs[0][lane], uvs[1][lane]) = (at.uv.x, at.uv.y);
        }
        let [position, error, normal, s, t, n, dp_du, dp_dv, wi] = &rows;
        Points {
            position: over(others, position, points.position),
            error: over(others, error, points.error),
            normal: over(others, normal, points.normal),
            frame: Frame {
                s: over(others, s, points.frame.s),
                t: over(others, t, points.frame.t),
                n: over(others, n, points.frame.n),
            },
            uv: lanes::Vec2::select(others, lanes::Vec2::<F>::load(&uvs), points.uv),
            dp_du: over(others, dp_du, points.dp_du),
            dp_dv: over(others, dp_dv, points.dp_dv),
            wi: over(others, wi, points.wi),
            ..points
        }
    }
}

/// The vectors of rows where the mask is set, else the others.
#[inline(always)]
fn over<F: Lanes>(mask: F::Mask, rows: &[F::Row; 3], others: lanes::Vec3<F>) -> lanes::Vec3<F> {
    lanes::Vec3::select(mask, lanes::Vec3::<F>::load(rows), others)
}

impl Source for Met<'_> {
    fn interaction(&self, lane: usize) -> Interaction<'_> {
        self.tracer.interaction(self.ray(lane), self.hit(lane))
    }

    fn time(&self, lane: usize) -> f32 {
        self.ray(lane).time
    }

    fn on_mesh(&self, lane: usize) -> Option<(&Mesh, u32, Vec2)> {
        let hit = self.hit(lane);
        let mesh = self.tracer.shapes.get(hit.shape).mesh()?;
        Some((mesh, hit.primitive, Vec2::new(hit.u, hit.v)))
    }
}
