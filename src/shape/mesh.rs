//! Triangle meshes as surfaces: boxes, what a hit looks like, and points drawn uniformly over the area.

use std::sync::OnceLock;

use glam::{DMat4, Vec2, Vec3};

use super::{Bounds, Geometry, Shape, Surface, SurfaceSample, area_to_solid_angle, to_world};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray};
use crate::math::distribution::Discrete;
use crate::math::{Frame, offset, warp};
use crate::mesh::{Mesh, ReadOptions, read};

/// A mesh in world space.
#[derive(Debug)]
pub struct TriangleMesh {
    mesh: Mesh,
    /// Triangles by area, made when the first light sample asks for it.
    areas: OnceLock<Option<Discrete>>,
}

impl TriangleMesh {
    /// A mesh whose coordinates are the world's.
    pub fn new(mesh: Mesh) -> Self {
        Self {
            mesh,
            areas: OnceLock::new(),
        }
    }

    /// The triangles.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// A triangle's corners.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|i| self.mesh.positions[i as usize])
    }

    fn areas(&self) -> Option<&Discrete> {
        let build = || {
            let area = |t: u32| {
                let [a, b, c] = self.corners(t).map(Vec3::as_dvec3);
                0.5 * (b - a).cross(c - a).length()
            };
            Discrete::new((0..self.primitive_count()).map(area))
        };
        self.areas.get_or_init(build).as_ref()
    }

    /// The shading normal and the texture coordinates at a point of a triangle.
    fn shading(&self, triangle: u32, b: [f32; 3], geometric: Vec3) -> (Vec3, Vec2) {
        let corners = self.mesh.triangles[triangle as usize];
        let mut normal = geometric;
        if !self.mesh.normals.is_empty() {
            let [n0, n1, n2] = corners.map(|i| self.mesh.normals[i as usize]);
            let n = (b[0] * n0 + b[1] * n1 + b[2] * n2).normalize_or_zero();
            if n != Vec3::ZERO {
                normal = n;
            }
        }
        let uv = if self.mesh.uvs.is_empty() {
            Vec2::new(b[1], b[2])
        } else {
            let [uv0, uv1, uv2] = corners.map(|i| self.mesh.uvs[i as usize]);
            b[0] * uv0 + b[1] * uv1 + b[2] * uv2
        };
        (normal, uv)
    }

    fn geometric_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
        // In double precision, for the cross product of a sliver cancels.
        let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
        (b - a).cross(c - a).normalize_or_zero().as_vec3()
    }

    /// The change of position with u and with v (PBRT 4th ed., 6.5.3); zero where the coordinates do
    /// not tell.
    fn tangents(&self, triangle: u32, [a, b, c]: [Vec3; 3]) -> (Vec3, Vec3) {
        let (e1, e2) = (b - a, c - a);
        if self.mesh.uvs.is_empty() {
            return (e1, e2);
        }
        let [uv0, uv1, uv2] =
            self.mesh.triangles[triangle as usize].map(|i| self.mesh.uvs[i as usize]);
        let (d1, d2) = (uv1 - uv0, uv2 - uv0);
        let determinant = d1.x * d2.y - d1.y * d2.x;
        if determinant == 0.0 {
            return (Vec3::ZERO, Vec3::ZERO);
        }
        (
            (d2.y * e1 - d1.y * e2) / determinant,
            (d1.x * e2 - d2.x * e1) / determinant,
        )
    }
}

impl Surface for TriangleMesh {
    fn primitive_count(&self) -> u32 {
        self.mesh.triangles.len() as u32
    }

    fn bounds(&self, primitive: u32) -> Bounds {
        self.corners(primitive)
            .into_iter()
            .fold(Bounds::EMPTY, Bounds::with)
    }

    fn intersect(&self, _primitive: u32, _ray: &Ray) -> Option<(f32, f32, f32)> {
        unreachable!("the tracer intersects triangles itself")
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let corners = self.corners(hit.primitive);
        let b = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let terms = [b[0] * corners[0], b[1] * corners[1], b[2] * corners[2]];
        let position = terms[0] + terms[1] + terms[2];
        let error = offset::gamma(7) * (terms[0].abs() + terms[1].abs() + terms[2].abs());
        let normal = Self::geometric_normal(corners);
        let (shading, uv) = self.shading(hit.primitive, b, normal);
        let (dp_du, dp_dv) = self.tangents(hit.primitive, corners);
        let frame = Frame::along(shading, dp_du);
        Interaction {
            t: hit.t,
            position,
            error,
            normal,
            frame,
            uv,
            dp_du,
            dp_dv,
            wi: frame.to_local(-ray.direction),
            time: ray.time,
            shape: hit.shape,
            primitive: hit.primitive,
            mesh: Some(&self.mesh),
            barycentric: Vec2::new(hit.u, hit.v),
        }
    }

    fn area(&self) -> f64 {
        self.areas().map_or(0.0, Discrete::total)
    }

    fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let areas = self.areas()?;
        let drawn = areas.sample(u.x);
        let triangle = drawn.index as u32;
        let corners = self.corners(triangle);
        let b = warp::uniform_triangle(Vec2::new(drawn.rest, u.y));
        let b = [1.0 - b.x - b.y, b.x, b.y];
        let position = b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2];
        let geometric = Self::geometric_normal(corners);
        let (normal, uv) = self.shading(triangle, b, geometric);
        let pdf = area_to_solid_angle(areas.total(), from, position, geometric);
        (pdf > 0.0).then_some(SurfaceSample {
            position,
            normal,
            uv,
            primitive: triangle,
            barycentric: Vec2::new(b[1], b[2]),
            pdf,
        })
    }

    fn pdf(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        area_to_solid_angle(self.area(), from, at.position, at.normal)
    }

    fn bytes(&self) -> usize {
        self.mesh.bytes()
    }
}

/// Puts a mesh into the world as its shape says: `to_world`, `face_normals`, `flip_normals`.
pub(super) fn place(mut mesh: Mesh, properties: &Properties<'_>, outer: &DMat4) -> Result<Shape> {
    mesh.transform(&to_world(properties, outer)?);
    // A transform can carry finite corners to infinity.
    let dropped = mesh.check().dropped_triangles;
    if properties.boolean("face_normals")?.unwrap_or(false) {
        mesh.drop_normals();
    } else if mesh.normals.is_empty() {
        mesh.compute_normals();
    }
    if properties.boolean("flip_normals")?.unwrap_or(false) {
        mesh.flip_normals();
    }
    let mut shape = Shape::from(Geometry::Mesh(TriangleMesh::new(mesh)));
    if dropped > 0 {
        let message = format!(
            "{dropped} triangles were dropped, for to_world carries them out of all bounds"
        );
        shape
            .warnings
            .extend_from_slice(properties.error("to_world", message).problems());
    }
    Ok(shape)
}

/// Reads the file that a mesh plugin names, with that plugin's own `options`.
pub(super) fn load(
    properties: &Properties<'_>,
    outer: &DMat4,
    options: ReadOptions,
) -> Result<Shape> {
    let Some(path) = properties.file("filename")? else {
        return Err(properties
            .error(
                "filename",
                format!("{} needs a filename", properties.plugin()),
            )
            .help(r#"add <string name="filename" value="…"/>"#));
    };
    let flip_tex_coords = properties.boolean("flip_tex_coords")?;
    let options = ReadOptions {
        flip_tex_coords,
        ..options
    };
    let loaded = read(&path, &options).map_err(|e| e.named_at(properties.location()))?;
    let mut shape = place(loaded.mesh, properties, outer)?;
    shape.warnings.splice(0..0, loaded.warnings);
    Ok(shape)
}
