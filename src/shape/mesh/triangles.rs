//! Points on triangles in lanes, of any meshes: what belongs to each triangle is fetched lane by lane, the rest is
//! arithmetic.

use super::TriangleMesh;
use crate::interaction::offset;
use crate::lanes::{Doubles as _, Frame, Lanes, Vec2, Vec3};
use crate::shape::SurfacePoints;

/// Rows of `N` components of each of the three corners.
type Corners<F, const N: usize> = [[<F as Lanes>::Row; N]; 3];

/// The triangles that lanes are at, and where on them.
#[derive(Clone, Copy, Debug)]
pub struct Triangles<F: Lanes> {
    positions: Corners<F, 3>,
    /// Zero where there are none.
    normals: Corners<F, 3>,
    /// The barycentric coordinates themselves where there are none.
    uvs: Corners<F, 2>,
    /// The second and third barycentric coordinate.
    barycentric: [F::Row; 2],
}

/// Second and third coordinate at the corners of a triangle without texture coordinates, as it is and turned over: as in
/// Mitsuba, u and v are those of the triangle as it was.
const BARYCENTRIC: [[[f32; 2]; 3]; 2] = [
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
    [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]],
];

impl<F: Lanes> Default for Triangles<F> {
    #[inline(always)]
    fn default() -> Self {
        Self {
            positions: [[F::ROW; 3]; 3],
            normals: [[F::ROW; 3]; 3],
            uvs: [[F::ROW; 2]; 3],
            barycentric: [F::ROW; 2],
        }
    }
}

impl<F: Lanes> Triangles<F> {
    /// Puts a lane at a point of a triangle.
    #[inline(always)]
    pub fn set(
        &mut self,
        lane: usize,
        mesh: &TriangleMesh,
        triangle: u32,
        barycentric: glam::Vec2,
    ) {
        let data = &mesh.mesh;
        let corners = data.triangles[triangle as usize];
        for (corner, index) in corners.into_iter().enumerate() {
            let index = index as usize;
            let position = data.positions[index];
            for (row, value) in self.positions[corner].iter_mut().zip(position.to_array()) {
                row[lane] = value;
            }
            if let Some(normal) = data.normals.get(index) {
                for (row, value) in self.normals[corner].iter_mut().zip(normal.to_array()) {
                    row[lane] = value;
                }
            }
            let uv = data.uvs.get(index).map(|uv| uv.to_array());
            let uv = uv.unwrap_or(BARYCENTRIC[usize::from(mesh.flipped)][corner]);
            for (row, value) in self.uvs[corner].iter_mut().zip(uv) {
                row[lane] = value;
            }
        }
        self.barycentric[0][lane] = barycentric.x;
        self.barycentric[1][lane] = barycentric.y;
    }

    /// Puts a corner of a lane's triangle elsewhere, with its normal if it has one.
    pub(in crate::shape) fn place(
        &mut self,
        lane: usize,
        corner: usize,
        position: glam::Vec3,
        normal: Option<glam::Vec3>,
    ) {
        for (row, value) in self.positions[corner].iter_mut().zip(position.to_array()) {
            row[lane] = value;
        }
        let Some(normal) = normal else { return };
        for (row, value) in self.normals[corner].iter_mut().zip(normal.to_array()) {
            row[lane] = value;
        }
    }

    /// The points.
    #[inline(always)]
    pub fn surface(&self) -> SurfacePoints<F> {
        let (u, v) = (F::load(&self.barycentric[0]), F::load(&self.barycentric[1]));
        let w = F::one() - u - v;
        let [p0, p1, p2] = [
            Vec3::<F>::load(&self.positions[0]),
            Vec3::<F>::load(&self.positions[1]),
            Vec3::<F>::load(&self.positions[2]),
        ];
        let (q0, q1, q2) = (p0 * w, p1 * u, p2 * v);
        let error = (q0.abs() + q1.abs() + q2.abs()) * F::splat(offset::gamma(7));
        let normal = geometric_normal([p0, p1, p2]);
        let n0 = Vec3::<F>::load(&self.normals[0]) * w;
        let n1 = Vec3::<F>::load(&self.normals[1]) * u;
        let n2 = Vec3::<F>::load(&self.normals[2]) * v;
        let interpolated = (n0 + n1 + n2).normalize_or_zero();
        let flat = interpolated.length_squared().eq(F::zero());
        let shading = Vec3::select(flat, normal, interpolated);
        let [t0, t1, t2] = [
            Vec2::<F>::load(&self.uvs[0]),
            Vec2::<F>::load(&self.uvs[1]),
            Vec2::<F>::load(&self.uvs[2]),
        ];
        // The change of position with u and with v (PBRT 4th ed., 6.5.3); zero where the coordinates do not tell.
        let (e1, e2, d1, d2) = (p1 - p0, p2 - p0, t1 - t0, t2 - t0);
        let determinant = d1.x * d2.y - d1.y * d2.x;
        let untold = determinant.eq(F::zero());
        let (du, dv) = (e1 * d2.y - e2 * d1.y, e2 * d1.x - e1 * d2.x);
        let zero = Vec3::splat(0.0);
        let dp_du = Vec3::select(untold, zero, du / determinant);
        let dp_dv = Vec3::select(untold, zero, dv / determinant);
        SurfacePoints {
            position: q0 + q1 + q2,
            error,
            normal,
            frame: Frame::along(shading, dp_du),
            uv: t0 * w + t1 * u + t2 * v,
            dp_du,
            dp_dv,
        }
    }
}

/// In double precision, for the cross product of a sliver cancels; zero where a triangle has no area.
#[inline(always)]
pub(super) fn geometric_normal<F: Lanes>([a, b, c]: [Vec3<F>; 3]) -> Vec3<F> {
    let (ax, ay, az) = (a.x.widen(), a.y.widen(), a.z.widen());
    let (ux, uy, uz) = (b.x.widen() - ax, b.y.widen() - ay, b.z.widen() - az);
    let (vx, vy, vz) = (c.x.widen() - ax, c.y.widen() - ay, c.z.widen() - az);
    let (x, y, z) = (uy * vz - vy * uz, uz * vx - vz * ux, ux * vy - vx * uy);
    let one = F::Double::splat(1.0);
    let scale = one / (x * x + y * y + z * z).sqrt();
    // Neither infinite nor no number.
    let usable = scale.lt(F::Double::splat(f64::INFINITY)) & F::Double::splat(0.0).lt(scale);
    let scale = F::Double::select(usable, scale, F::Double::splat(0.0));
    let normal = Vec3::new(
        (x * scale).narrow(),
        (y * scale).narrow(),
        (z * scale).narrow(),
    );
    Vec3::select(usable, normal, Vec3::splat(0.0))
}
