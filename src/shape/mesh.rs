//! Triangle meshes as surfaces: boxes, what a hit looks like, and points drawn uniformly over the area, or over
//! the solid angle of a mesh that is a rectangle.

use std::sync::OnceLock;

use glam::{DMat4, Vec2, Vec3};

use super::quad::{Place, Quad};
use super::{
    Bounds, Chart, Geometry, Setting, Shape, Surface, SurfaceSample, area_to_solid_angle, to_world,
};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray};
use crate::math::distribution::Discrete;
use crate::math::{Frame, offset, warp};
use crate::mesh::{Loaded, Mesh, MeshFile, ReadOptions};

/// A mesh in world space.
#[derive(Debug)]
pub struct TriangleMesh {
    mesh: Mesh,
    /// Triangles by area, made when the first light sample asks for it.
    areas: OnceLock<Option<Discrete>>,
    /// The rectangle that it is, if it is one.
    quad: Option<Quad>,
    /// Whether its triangles have been turned over: where it has no texture coordinates, u and v are those of the
    /// triangles as they were, as in Mitsuba.
    flipped: bool,
    hash: OnceLock<blake3::Hash>,
}

impl TriangleMesh {
    /// A mesh whose coordinates are the world's.
    pub fn new(mesh: Mesh) -> Self {
        Self {
            quad: Quad::of(&mesh),
            mesh,
            areas: OnceLock::new(),
            flipped: false,
            hash: OnceLock::new(),
        }
    }

    /// [`Mesh::triangles_hash`], taken once.
    pub fn triangles_hash(&self) -> &blake3::Hash {
        self.hash.get_or_init(|| self.mesh.triangles_hash())
    }

    /// The triangles.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The triangles, without what was made for light samples.
    pub(super) fn into_mesh(self) -> Mesh {
        self.mesh
    }

    /// A triangle's corners.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|i| self.mesh.positions[i as usize])
    }

    /// A triangle's area, in square units.
    pub fn triangle_area(&self, triangle: u32) -> f64 {
        let [a, b, c] = self.corners(triangle).map(Vec3::as_dvec3);
        0.5 * (b - a).cross(c - a).length()
    }

    /// A triangle's geometric normal; zero where it has no area.
    pub fn triangle_normal(&self, triangle: u32) -> Vec3 {
        Self::geometric_normal(self.corners(triangle))
    }

    /// A point drawn uniformly over one triangle, without a density.
    pub fn triangle_point(&self, triangle: u32, u: Vec2) -> SurfaceSample {
        let b = warp::uniform_triangle(u);
        self.at(Place {
            triangle,
            barycentric: [1.0 - b.x - b.y, b.x, b.y],
        })
    }

    fn areas(&self) -> Option<&Discrete> {
        let build = || Discrete::new((0..self.primitive_count()).map(|t| self.triangle_area(t)));
        self.areas.get_or_init(build).as_ref()
    }

    /// A point of the mesh, not yet with a density.
    fn at(&self, place: Place) -> SurfaceSample {
        let Place {
            triangle,
            barycentric: b,
        } = place;
        let corners = self.corners(triangle);
        SurfaceSample {
            position: b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2],
            normal: self.shading_normal(triangle, b, self.triangle_normal(triangle)),
            primitive: triangle,
            barycentric: Vec2::new(b[1], b[2]),
            pdf: 0.0,
        }
    }

    /// The shading normal at a point of a triangle.
    fn shading_normal(&self, triangle: u32, b: [f32; 3], geometric: Vec3) -> Vec3 {
        if self.mesh.normals.is_empty() {
            return geometric;
        }
        let corners = self.mesh.triangles[triangle as usize];
        let [n0, n1, n2] = corners.map(|i| self.mesh.normals[i as usize]);
        let n = (b[0] * n0 + b[1] * n1 + b[2] * n2).normalize_or_zero();
        if n == Vec3::ZERO { geometric } else { n }
    }

    /// The texture coordinates at a point of a triangle.
    fn uv_at(&self, triangle: u32, b: [f32; 3]) -> Vec2 {
        if self.mesh.uvs.is_empty() {
            let [_, u, v] = b;
            return if self.flipped {
                Vec2::new(v, u)
            } else {
                Vec2::new(u, v)
            };
        }
        let corners = self.mesh.triangles[triangle as usize];
        let [uv0, uv1, uv2] = corners.map(|i| self.mesh.uvs[i as usize]);
        b[0] * uv0 + b[1] * uv1 + b[2] * uv2
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
            return if self.flipped { (e2, e1) } else { (e1, e2) };
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

    #[inline]
    fn bounds(&self, primitive: u32) -> Bounds {
        let [a, b, c] = self.corners(primitive);
        Bounds {
            min: a.min(b).min(c),
            max: a.max(b).max(c),
        }
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
        let shading = self.shading_normal(hit.primitive, b, normal);
        let (dp_du, dp_dv) = self.tangents(hit.primitive, corners);
        let frame = Frame::along(shading, dp_du);
        Interaction {
            t: hit.t,
            position,
            error,
            normal,
            frame,
            uv: self.uv_at(hit.primitive, b),
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
        if let Some(quad) = &self.quad
            && let Some(seen) = quad.seen(from)
        {
            return Some(SurfaceSample {
                pdf: (1.0 / seen.solid_angle) as f32,
                ..self.at(quad.place(seen.sample(u)))
            });
        }
        let areas = self.areas()?;
        let drawn = areas.sample(u.x);
        let triangle = drawn.index as u32;
        let sample = self.triangle_point(triangle, Vec2::new(drawn.rest, u.y));
        let normal = self.triangle_normal(triangle);
        let pdf = area_to_solid_angle(areas.total(), from, sample.position, normal);
        (pdf > 0.0).then_some(SurfaceSample { pdf, ..sample })
    }

    fn uv(&self, point: &SurfaceSample) -> Vec2 {
        let Vec2 { x, y } = point.barycentric;
        self.uv_at(point.primitive, [1.0 - x - y, x, y])
    }

    fn pdf(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        match self.quad.as_ref().and_then(|quad| quad.seen(from)) {
            Some(seen) => (1.0 / seen.solid_angle) as f32,
            None => area_to_solid_angle(self.area(), from, at.position, at.normal),
        }
    }

    fn chart(&self, parameters: Vec2) -> Option<Chart> {
        let quad = self.quad.as_ref()?;
        Some(Chart {
            point: self.at(quad.place(parameters.as_dvec2())),
            stretch: quad.area(),
        })
    }

    fn parameters(&self, primitive: u32, barycentric: Vec2, uv: Vec2) -> Vec2 {
        match &self.quad {
            Some(quad) => quad.fractions(primitive, barycentric),
            None => uv,
        }
    }

    fn bytes(&self) -> usize {
        self.mesh.bytes()
    }
}

/// Puts a mesh into the world as its shape says: `to_world`, `face_normals`, `flip_normals`.
pub(super) fn place(mesh: Mesh, properties: &Properties<'_>, outer: &DMat4) -> Result<Shape> {
    let setting = Setting {
        outer: *outer,
        cache: None,
    };
    place_in(&setting, mesh, properties)
}

fn place_in(setting: &Setting<'_>, mut mesh: Mesh, properties: &Properties<'_>) -> Result<Shape> {
    let to_world = to_world(properties, &setting.outer)?;
    let mut dropped = 0;
    let (mut hash, mut uncached) = (None, None);
    if to_world != DMat4::IDENTITY {
        mesh.transform(&to_world);
        // A transform can carry finite corners to infinity.
        dropped = mesh.check().dropped_triangles;
    }
    // A glTF without normals is flat, says its specification.
    let flat = properties.plugin() == "gltf" && mesh.normals.is_empty();
    if properties.boolean("face_normals")? || flat {
        mesh.drop_normals();
    } else if mesh.normals.is_empty() {
        match setting.cache {
            Some(folder) if mesh.is_large() => {
                let hash = hash.insert(mesh.triangles_hash());
                uncached = mesh.compute_normals_once(hash, folder);
            }
            _ => mesh.compute_normals(),
        }
    }
    let flipped = properties.boolean("flip_normals")?;
    if flipped {
        mesh.flip_normals();
        hash = None;
    }
    let mesh = TriangleMesh {
        flipped,
        hash: hash.map(OnceLock::from).unwrap_or_default(),
        ..TriangleMesh::new(mesh)
    };
    let mut shape = Shape::from(Geometry::Mesh(mesh));
    if let Some(problem) = uncached {
        shape.warnings.extend_from_slice(problem.problems());
    }
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

/// The file that a mesh plugin names, to be read with that plugin's own `options`.
pub(super) fn file(properties: &Properties<'_>, options: ReadOptions) -> Result<MeshFile> {
    let path = properties.file("filename")?;
    let flip_tex_coords = properties.given("flip_tex_coords")?;
    let bare = properties.boolean("bare")?;
    let options = ReadOptions {
        flip_tex_coords,
        bare,
        ..options
    };
    Ok(MeshFile { path, options })
}

/// The shape that a mesh plugin makes of its file.
pub(super) fn place_file(
    loaded: Loaded,
    properties: &Properties<'_>,
    setting: &Setting<'_>,
) -> Result<Shape> {
    let mut shape = place_in(setting, loaded.mesh, properties)?;
    shape.warnings.splice(0..0, loaded.warnings);
    shape.files = loaded.files;
    Ok(shape)
}
