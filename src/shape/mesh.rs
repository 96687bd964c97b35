//! Triangle meshes as surfaces: boxes, what a hit looks like, and points drawn uniformly over the area, or over
//! the solid angle of a mesh that is a rectangle.

mod triangles;

use std::borrow::Cow;
use std::sync::OnceLock;

use glam::{DMat4, Vec2, Vec3};

use super::quad::{Place, Quad, Seen};
use super::{
    Bounds, Chart, Geometry, Setting, Shape, Surface, SurfaceSample, SurfaceSamples,
    area_to_solid_angle, area_to_solid_angles,
};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray};
use crate::lanes::{self, Lanes, Mask as _, warp};
use crate::math::distribution::Discrete;
use crate::mesh::{Loaded, Mesh, MeshFile, ReadOptions};
pub use triangles::Triangles;

/// A mesh in world space.
#[derive(Debug)]
pub struct TriangleMesh {
    mesh: Mesh,
    /// Triangles by area, made when the first light sample asks for it.
    areas: OnceLock<Option<Discrete>>,
    /// The rectangle that it is, if it is one.
    quad: Option<Quad>,
    /// The shading normal of a rectangle that has one all over.
    quad_normal: Option<Vec3>,
    /// Whether its triangles have been turned over: where it has no texture coordinates, u and v are those of the
    /// triangles as they were, as in Mitsuba.
    flipped: bool,
    hash: OnceLock<blake3::Hash>,
}

impl TriangleMesh {
    /// A mesh whose coordinates are the world's.
    pub fn new(mesh: Mesh) -> Self {
        let quad = Quad::of(&mesh);
        let mut placed = Self {
            quad,
            quad_normal: None,
            mesh,
            areas: OnceLock::new(),
            flipped: false,
            hash: OnceLock::new(),
        };
        if placed.quad.is_some() {
            placed.quad_normal = placed.even_normal();
        }
        placed
    }

    /// [`Mesh::triangles_hash`], taken once.
    pub fn triangles_hash(&self) -> &blake3::Hash {
        self.hash.get_or_init(|| self.mesh.triangles_hash())
    }

    /// The triangles.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Whether it is a rectangle, as far as is known.
    pub(super) fn is_rectangle(&self) -> bool {
        self.quad.is_some()
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
        triangles::geometric_normal::<f32>(self.corners(triangle).map(Into::into)).into()
    }

    /// A point drawn uniformly over one triangle, without a density.
    pub fn triangle_point(&self, triangle: u32, u: Vec2) -> SurfaceSample {
        let b = Vec2::from(warp::uniform_triangle(u.into()));
        self.at(Place {
            triangle,
            barycentric: [1.0 - b.x - b.y, b.x, b.y],
        })
    }

    /// The shading normal, where it is the same at all corners.
    fn even_normal(&self) -> Option<Vec3> {
        let corners = (0..self.primitive_count()).flat_map(|triangle| {
            let geometric = self.triangle_normal(triangle);
            let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            corners.map(|b| self.shading_normal(triangle, b, geometric))
        });
        let mut corners = corners;
        let first = corners.next()?;
        corners.all(|n| n.abs_diff_eq(first, 1e-6)).then_some(first)
    }

    fn areas(&self) -> Option<&Discrete> {
        let build = || Discrete::new((0..self.primitive_count()).map(|t| self.triangle_area(t)));
        self.areas.get_or_init(build).as_ref()
    }

    /// See [`super::Geometry::evenly`].
    pub(super) fn evenly(&self, u: Vec2) -> Option<SurfaceSample> {
        if let Some(chart) = self.chart(u) {
            return Some(chart.point);
        }
        let drawn = self.areas()?.sample(u.y);
        Some(self.triangle_point(drawn.index as u32, Vec2::new(u.x, drawn.rest)))
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
}

impl TriangleMesh {
    /// [`Surface::sample`] in lanes.
    #[inline(always)]
    pub(super) fn sample_lanes<F: Lanes>(
        &self,
        from: lanes::Vec3<F>,
        u: lanes::Vec2<F>,
        active: F::Mask,
    ) -> SurfaceSamples<F> {
        let mut sample = SurfaceSamples {
            position: lanes::Vec3::splat(0.0),
            normal: lanes::Vec3::splat(0.0),
            pdf: F::zero(),
        };
        let mut rest = active;
        if let Some(quad) = &self.quad {
            let seen = quad.seen(from);
            let even = seen.is_even & active;
            if even.any() {
                let fractions = seen.sample(u);
                let normal = match self.quad_normal {
                    Some(normal) => lanes::Vec3::all(normal),
                    None => self.quad_normals(fractions, even),
                };
                sample = SurfaceSamples {
                    position: quad.at(fractions),
                    normal,
                    pdf: F::one() / seen.solid_angle,
                };
            }
            rest = active & !even;
        }
        if rest.any() {
            let other = self.sample_triangles(from, u, rest);
            sample = SurfaceSamples::select(rest, other, sample);
        }
        sample
    }

    /// The rectangle that it is, where it is drawn evenly over the solid angle that a point sees.
    fn evenly_seen(&self, from: Vec3) -> Option<(&Quad, Seen<f32>)> {
        let quad = self.quad.as_ref()?;
        let seen = quad.seen::<f32>(from.into());
        seen.is_even.then_some((quad, seen))
    }

    /// The shading normals at points of a rectangle.
    #[inline(always)]
    fn quad_normals<F: Lanes>(&self, fractions: lanes::Vec2<F>, active: F::Mask) -> lanes::Vec3<F> {
        let mut triangles = Triangles::<F>::default();
        let quad = self.quad.as_ref().expect("it is a rectangle");
        for lane in active.lanes() {
            let Place {
                triangle,
                barycentric: [_, u, v],
            } = quad.place(fractions.lane(lane));
            triangles.set(lane, self, triangle, Vec2::new(u, v));
        }
        triangles.surface().frame.n
    }

    /// Points drawn evenly over the area.
    #[inline(always)]
    fn sample_triangles<F: Lanes>(
        &self,
        from: lanes::Vec3<F>,
        u: lanes::Vec2<F>,
        active: F::Mask,
    ) -> SurfaceSamples<F> {
        let mut triangles = Triangles::<F>::default();
        let areas = self.areas();
        for lane in active.lanes() {
            let Some(areas) = areas else { continue };
            let u = u.lane(lane);
            let drawn = areas.sample(u.x);
            let within = warp::uniform_triangle::<f32>(Vec2::new(drawn.rest, u.y).into());
            triangles.set(lane, self, drawn.index as u32, within.into());
        }
        let surface = triangles.surface();
        let area = areas.map_or(0.0, Discrete::total);
        let pdf = area_to_solid_angles(area, from, surface.position, surface.normal);
        let drawn = active & F::zero().lt(pdf) & pdf.is_finite();
        SurfaceSamples {
            position: surface.position,
            normal: surface.frame.n,
            pdf: F::select(drawn, pdf, F::zero()),
        }
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
        let mut triangles = Triangles::<f32>::default();
        triangles.set(0, self, hit.primitive, Vec2::new(hit.u, hit.v));
        triangles.surface().interaction(Some(&self.mesh), ray, hit)
    }

    fn area(&self) -> f64 {
        self.areas().map_or(0.0, Discrete::total)
    }

    fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        if let Some((quad, seen)) = self.evenly_seen(from) {
            return Some(SurfaceSample {
                pdf: 1.0 / seen.solid_angle,
                ..self.at(quad.place(seen.sample(u.into()).into()))
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
        match self.evenly_seen(from) {
            Some((_, seen)) => 1.0 / seen.solid_angle,
            None => area_to_solid_angle(self.area(), from, at.position, at.normal),
        }
    }

    fn chart(&self, parameters: Vec2) -> Option<Chart> {
        let quad = self.quad.as_ref()?;
        Some(Chart {
            point: self.at(quad.place(parameters)),
            stretch: quad.area().into(),
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

/// Puts a mesh into the world as its shape says: `face_normals`, `flip_normals`.
pub(super) fn place(mesh: Mesh, properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let setting = Setting {
        to_world: *to_world,
        cache: None,
    };
    place_in(&setting, mesh, properties)
}

fn place_in(setting: &Setting<'_>, mut mesh: Mesh, properties: &Properties<'_>) -> Result<Shape> {
    let mut dropped = 0;
    let (mut hash, mut uncached) = (None, None);
    if setting.to_world != DMat4::IDENTITY {
        mesh.transform(&setting.to_world);
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

/// Which of its file's surfaces a mesh plugin shows, where it is one.
pub(super) fn surface(properties: &Properties<'_>) -> Result<Option<usize>> {
    Ok(properties
        .given::<i64>("surface")?
        .map(|number| number as usize))
}

/// The shape that a mesh plugin makes of its file.
pub(super) fn place_file(
    loaded: Cow<'_, Loaded>,
    properties: &Properties<'_>,
    setting: &Setting<'_>,
) -> Result<Shape> {
    let (mesh, warnings, files) = match surface(properties)? {
        None => {
            let Loaded {
                mesh,
                warnings,
                files,
                ..
            } = loaded.into_owned();
            (mesh, warnings, files)
        }
        Some(number) => {
            let missing = || {
                let message = match loaded.surfaces.len() {
                    0 => "the file says nothing of materials, or is not read as bare".to_owned(),
                    count => format!("the file has no surface {number}: it has {count} of them"),
                };
                properties.error("surface", message)
            };
            let mesh = loaded.of_surface(number).ok_or_else(missing)?;
            (mesh, loaded.warnings.clone(), loaded.files.clone())
        }
    };
    let mut shape = place_in(setting, mesh, properties)?;
    shape.warnings.splice(0..0, warnings);
    shape.files = files;
    Ok(shape)
}
