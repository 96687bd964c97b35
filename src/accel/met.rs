//! What a block of rays has met: from hits to points in lanes. Points on triangles of the world are made together, those on
//! a sphere too, all others one by one.

use glam::Vec2;

use super::Tracer;
use crate::interaction::{Hit, Interaction, Points, Ray, Source};
use crate::lanes::{self, Call, Frame, Lanes, Mask as _};
use crate::mesh::Mesh;
use crate::shape::{Geometry, SurfacePoints, Triangles};

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
        let (mut spheres, mut others) = (0_u32, 0_u32);
        for lane in 0..self.indices.len() {
            let hit = self.hit(lane);
            match self.tracer.shapes.get(hit.shape) {
                Geometry::Mesh(mesh) if hit.instance == Hit::NONE => {
                    triangles.set(lane, mesh, hit.primitive, Vec2::new(hit.u, hit.v));
                }
                Geometry::Sphere(_) if hit.instance == Hit::NONE => spheres |= 1 << lane,
                _ => others |= 1 << lane,
            }
        }
        let mut surface = triangles.surface();
        if spheres != 0 {
            let (met, others) = (self, surface);
            surface = F::call(OnSpheres {
                met,
                spheres,
                others,
            });
        }
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

/// Points with those of some lanes, which have met spheres of the world.
struct OnSpheres<'a, F> {
    met: &'a Met<'a>,
    spheres: u32,
    others: SurfacePoints<F>,
}

impl<F: Lanes> Call<F> for OnSpheres<'_, F> {
    type Output = SurfacePoints<F>;

    #[inline(always)]
    fn run(self) -> SurfacePoints<F> {
        let Self {
            met,
            mut spheres,
            others: mut points,
        } = self;
        let mut places = [F::ROW; 3];
        for lane in F::Mask::from_bits(spheres).lanes() {
            let place = met.ray(lane).at(met.hit(lane).t);
            for (row, value) in places.iter_mut().zip(place.to_array()) {
                row[lane] = value;
            }
        }
        let places = lanes::Vec3::<F>::load(&places);
        while spheres != 0 {
            let shape = met.hit(spheres.trailing_zeros() as usize).shape;
            let mut own = 0;
            for lane in F::Mask::from_bits(spheres).lanes() {
                own |= u32::from(met.hit(lane).shape == shape) << lane;
            }
            spheres &= !own;
            if let Geometry::Sphere(sphere) = met.tracer.shapes.get(shape) {
                let own = F::Mask::from_bits(own);
                points = SurfacePoints::select(own, sphere.points(places), points);
            }
        }
        points
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

#[cfg(test)]
mod tests {
    use super::super::surface_tests::{skew, surface};
    use super::super::tests::direction;
    use super::*;
    use crate::accel::{Counts, Method, Order};
    use crate::lanes::{Kernel, Task};
    use crate::mesh;
    use crate::shape::TriangleMesh;
    use std::sync::Arc;

    /// Holds points in lanes against single ones.
    struct Compare<'a>(Met<'a>);

    impl Task for Compare<'_> {
        type Output = ();

        #[inline(always)]
        fn run<F: Lanes>(self) {
            for indices in self.0.indices.chunks(F::WIDTH) {
                let met = Met { indices, ..self.0 };
                let points = met.points::<F>();
                for lane in 0..indices.len() {
                    let at = met.interaction(lane);
                    let both = [
                        (points.position, at.position),
                        (points.error, at.error),
                        (points.normal, at.normal),
                        (points.frame.s, at.frame.s),
                        (points.frame.t, at.frame.t),
                        (points.frame.n, at.frame.n),
                        (points.dp_du, at.dp_du),
                        (points.dp_dv, at.dp_dv),
                        (points.wi, at.wi),
                    ];
                    for (number, (lanes, one)) in both.into_iter().enumerate() {
                        assert_eq!(lanes.lane(lane), one, "lane {lane}, vector {number}");
                    }
                    assert_eq!(points.uv.lane(lane), at.uv, "lane {lane}");
                }
            }
        }
    }

    #[test]
    fn points_in_lanes_are_those_of_single_hits_whatever_a_block_has_met() {
        let mut shapes: Vec<_> = (0..6)
            .flat_map(|i| {
                [r#"type="sphere""#, r#"type="disk""#].map(|what| surface(what, &skew(i)))
            })
            .collect();
        shapes.push(Geometry::Mesh(TriangleMesh::new(mesh::bumpy_sphere(2, 5))));
        let shapes: Vec<_> = shapes.into_iter().map(Arc::new).collect();
        let groups = vec![0; shapes.len()];
        let tracer = Tracer::new(shapes, &groups, Vec::new(), Method::Tree);
        let ray = |i| Ray {
            origin: direction(1, i) * 2.0,
            direction: (direction(2, i) * 0.7 - direction(1, i)).normalize(),
            t_max: f32::INFINITY,
            time: 0.0,
        };
        let rays: Vec<Ray> = (0..2000).map(ray).collect();
        let (mut hits, mut counts) = (Vec::new(), Counts::default());
        tracer.closest(&rays, Order::Any, &mut hits, &mut counts);
        let met = |i: &u32| !hits[*i as usize].is_miss();
        let indices: Vec<u32> = (0..rays.len() as u32).filter(met).collect();
        assert!(indices.len() > 1000);
        for kernel in Kernel::all() {
            kernel.run(Compare(Met {
                tracer: &tracer,
                rays: &rays,
                hits: &hits,
                indices: &indices,
            }));
        }
    }
}
