//! obvhs's own traversal as it comes: its compressed wide tree `CwBvh` and its binary tree `Bvh2` over its
//! `RtTriangle`s, built with its medium settings. It is here without its feature `parallel`: its builds take one thread.

use std::sync::Arc;
use std::time::{Duration, Instant};

use etendue::interaction::{Hit, Ray};
use etendue::shape::Geometry;
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{INVALID_ID, Ray as TheirRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;

use crate::meshes::triangles;
use crate::peer::{Built, Maker, Peer, on_threads};
use crate::rays::Batch;

/// A tree with its triangles in the tree's own order.
struct Theirs<T> {
    tree: T,
    triangles: Vec<RtTriangle>,
}

/// The two trees have the same methods, and no trait.
macro_rules! theirs {
    ($tree:ty, $name:literal, $build:path) => {
        impl Theirs<$tree> {
            fn maker() -> Maker {
                Maker {
                    name: $name,
                    traced: true,
                    build: Box::new(|geometry, threads| {
                        let corners = corners(geometry);
                        let start = Instant::now();
                        let theirs = on_threads(threads, || {
                            let settings = BvhBuildParams::medium_build();
                            let tree = $build(&corners, settings, &mut Duration::default());
                            let order = tree.primitive_indices.iter();
                            let triangles = order.map(|&i| RtTriangle::from(&corners[i as usize]));
                            let triangles = triangles.collect();
                            Self { tree, triangles }
                        });
                        let seconds = start.elapsed().as_secs_f64();
                        let bytes = size_of_val(&theirs.tree.nodes[..])
                            + size_of_val(&theirs.tree.primitive_indices[..])
                            + size_of_val(&theirs.triangles[..]);
                        let peers: Vec<Box<dyn Peer>> = vec![Box::new(theirs)];
                        Ok(Built {
                            peers,
                            seconds,
                            bytes,
                        })
                    }),
                }
            }
        }

        impl Peer for Theirs<$tree> {
            fn name(&self) -> String {
                $name.to_owned()
            }

            fn closest(&self, batch: &Batch<'_>, hits: &mut Vec<Hit>) {
                hits.extend(batch.rays.iter().map(|ray| {
                    let mut hit = RayHit::none();
                    let triangle = |ray: &TheirRay, i: usize| self.triangles[i].intersect(ray);
                    self.tree.ray_traverse(theirs(ray), &mut hit, triangle);
                    if hit.primitive_id == INVALID_ID {
                        return Hit::miss(ray.t_max);
                    }
                    Hit {
                        shape: 0,
                        primitive: self.tree.primitive_indices[hit.primitive_id as usize],
                        ..Hit::miss(hit.t)
                    }
                }));
            }

            fn occluded(&self, rays: &[Ray], blocked: &mut Vec<bool>) {
                blocked.extend(rays.iter().map(|ray| {
                    let triangle = |ray: &TheirRay, i: usize| self.triangles[i].intersect(ray);
                    !self.tree.ray_traverse_miss(theirs(ray), triangle)
                }));
            }
        }
    };
}

theirs!(CwBvh, "obvhs CwBvh", build_cwbvh_from_tris);
theirs!(Bvh2, "obvhs Bvh2", build_bvh2_from_tris);

pub(crate) fn makers() -> Vec<Maker> {
    vec![Theirs::<CwBvh>::maker(), Theirs::<Bvh2>::maker()]
}

fn corners(geometry: &Arc<Geometry>) -> Vec<Triangle> {
    let mesh = triangles(geometry);
    let corners = mesh.triangles.iter().map(|t| {
        let [v0, v1, v2] = mesh.corners(t).map(Vec3A::from);
        Triangle { v0, v1, v2 }
    });
    corners.collect()
}

fn theirs(ray: &Ray) -> TheirRay {
    TheirRay::new(ray.origin.into(), ray.direction.into(), 0.0, ray.t_max)
}
