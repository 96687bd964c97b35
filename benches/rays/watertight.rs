//! Rays from inside a closed bumpy sphere at its vertices and at points of its edges: every one hits, and who
//! says that it misses lets light through.

use std::sync::Arc;

use etendue::math::random;
use etendue::mesh::Mesh;
use etendue::shape::Geometry;
use glam::Vec3;

use crate::measure::thread_counts;
use crate::meshes::{Named, load, triangles};
use crate::peer::{Maker, Peer};
use crate::rays::{BATCH, Question, Set, ray};
use crate::report::{Misses, MissesRow};

/// Counts what each tracer misses, of `count` rays at vertices and as many at edges.
pub(crate) fn misses(makers: &[Maker], count: usize) -> Result<Misses, String> {
    let geometry: Arc<Geometry> = load(Named::Watertight)?.expect("it is generated");
    let mesh = triangles(&geometry);
    let [vertices, edges] = [false, true].map(|edges| aim(mesh, count, edges));
    let mut rows = Vec::new();
    for maker in makers {
        let threads = thread_counts().last().copied().unwrap_or(1);
        for peer in (maker.build)(&geometry, threads)?.peers {
            if peer.answers(Question::Closest) {
                rows.push(MissesRow {
                    name: peer.name(),
                    vertices: missed(&*peer, &vertices),
                    edges: missed(&*peer, &edges),
                });
            }
        }
    }
    Ok(Misses {
        triangles: mesh.triangles.len(),
        rays: count,
        rows,
    })
}

/// Rays from near the middle, at a random triangle's first corner, or somewhere on its first edge.
fn aim(mesh: &Mesh, count: usize, edges: bool) -> Set {
    let rays = (0..count as u64).map(|i| {
        let bits = |dimension| random::bits(random::key(5, i), dimension);
        let unit = |dimension| random::unit(bits(dimension));
        // In a cube of side 0.4, of which the surface stays clear.
        let origin = 0.4 * (Vec3::new(unit(0), unit(1), unit(2)) - 0.5);
        let triangle = (bits(3) % mesh.triangles.len() as u64) as usize;
        let [a, b, _] = mesh.corners(&mesh.triangles[triangle]);
        let target = if edges { a.lerp(b, unit(4)) } else { a };
        ray(origin, (target - origin).normalize(), f32::INFINITY)
    });
    Set::new("", Question::Closest, rays.collect())
}

fn missed(peer: &dyn Peer, set: &Set) -> usize {
    let (mut hits, mut missed) = (Vec::with_capacity(BATCH), 0);
    for batch in set.batches() {
        hits.clear();
        peer.closest(&batch, &mut hits);
        missed += hits.iter().filter(|hit| hit.is_miss()).count();
    }
    missed
}
