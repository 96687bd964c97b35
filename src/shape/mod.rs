//! Shapes: what a scene's `<shape>` plugins build. Most build a triangle mesh, some a surface with an
//! equation of its own; everything above sees a [`Geometry`].

mod curves;
mod deforming;
mod disk;
mod ellipsoids;
mod frustum;
mod mesh;
mod plane;
mod points;
mod quad;
mod sphere;
mod tessellate;

mod bsplinecurve;
mod cone;
mod cube;
mod cylinder;
mod gltf;
mod linearcurve;
mod obj;
mod ply;
mod polygon;
mod rectangle;
mod sdfgrid;
mod serialized;
mod stl;
mod triangle;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DMat4, DVec3, Vec2, Vec3};

use crate::description::declared::{
    Plugin, Plugins, Row, boolean, file, float, integer, medium, motion, nested, number, string,
    transform,
};
use crate::description::{Kind, Properties};
use crate::error::{Problem, Result};
use crate::family;
use crate::interaction::{Hit, Interaction, Ray, offset};
use crate::lanes::{self, Lanes, Mask as _};
use crate::math::Moving;
use crate::mesh::{Loaded, Mesh, MeshFile, ReadOptions, Time, read};
use deforming::Sets;

pub use bsplinecurve::BsplineCurves;
pub use deforming::{DeformingMesh, Moment};
pub use disk::Disk;
pub use ellipsoids::Ellipsoids;
pub use frustum::Frustum;
pub use linearcurve::LinearCurves;
pub use mesh::{TriangleMesh, Triangles};
pub use plane::Plane;
pub use points::SurfacePoints;
pub use sdfgrid::SdfGrid;
pub use sphere::Sphere;
pub use tessellate::Untessellated;

pub use crate::math::Bounds;

/// A point drawn on a surface as seen from another point.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceSample {
    /// World space.
    pub position: Vec3,
    /// Unit length, on the side that emits.
    pub normal: Vec3,
    /// The primitive.
    pub primitive: u32,
    /// The second and third barycentric coordinate on a triangle; on a disk its own x and y.
    pub barycentric: Vec2,
    /// Density per solid angle at the other point, in 1/sr.
    pub pdf: f32,
}

/// Points drawn on a surface as seen from other points, in lanes; the fields are those of [`SurfaceSample`].
#[derive(Clone, Copy, Debug)]
pub struct SurfaceSamples<F> {
    /// World space.
    pub position: lanes::Vec3<F>,
    /// Unit length, on the side that emits.
    pub normal: lanes::Vec3<F>,
    /// Density per solid angle at the other point, in 1/sr; 0 where none could be drawn.
    pub pdf: F,
}

impl<F: Lanes> SurfaceSamples<F> {
    /// `yes` where the mask is set, else `no`.
    #[inline(always)]
    fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self {
            position: lanes::Vec3::select(mask, yes.position, no.position),
            normal: lanes::Vec3::select(mask, yes.normal, no.normal),
            pdf: F::select(mask, yes.pdf, no.pdf),
        }
    }
}

/// The place on a surface that belongs to a pair of parameters in [0, 1]².
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    /// Where, without a density.
    pub point: SurfaceSample,
    /// How much area, in square units of the scene, a unit of the parameters' square covers there.
    pub stretch: f64,
}

/// What every kind of geometry does. Triangles are intersected by `accel` itself, never one by one
/// through this trait.
pub trait Surface: std::fmt::Debug + Send + Sync {
    /// How many primitives it has.
    fn primitive_count(&self) -> u32;
    /// A box that contains a primitive's every hit; it may be without an end.
    fn bounds(&self, primitive: u32) -> Bounds;
    /// (t, u, v) of a primitive's first hit with 0 < t ≤ `t_max`.
    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)>;
    /// Asks for the memory ahead that [`Surface::intersect`] will read.
    fn fetch(&self, _primitive: u32) {}
    /// What a hit looks like; `hit` came from this surface and `ray`.
    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_>;
    /// In square units of the scene; infinite where no light may come from it, as is said of one that does not say it.
    fn area(&self) -> f64 {
        f64::INFINITY
    }
    /// A point drawn on the surface for light at `from`; `None` where none can be.
    fn sample(&self, _from: Vec3, _u: Vec2) -> Option<SurfaceSample> {
        None
    }
    /// The texture coordinates of a point that was drawn: few ask for them, and a sphere's take long.
    fn uv(&self, _point: &SurfaceSample) -> Vec2 {
        Vec2::ZERO
    }
    /// The density with which [`Surface::sample`] would have drawn the point `at`, which is visible
    /// from `from`.
    fn pdf(&self, _from: Vec3, _at: &Interaction<'_>) -> f32 {
        0.0
    }
    /// The place with these parameters, of a surface that is covered by one square of them.
    fn chart(&self, _parameters: Vec2) -> Option<Chart> {
        None
    }
    /// The place with these parameters on one of the primitives, each of which is covered by one square of them.
    fn patch(&self, primitive: u32, parameters: Vec2) -> Option<Chart> {
        (primitive == 0 && self.primitive_count() == 1)
            .then(|| self.chart(parameters))
            .flatten()
    }
    /// The parameters of a place, if there is a [`Surface::chart`].
    fn parameters(&self, _primitive: u32, _barycentric: Vec2, uv: Vec2) -> Vec2 {
        uv
    }
    /// Bytes held.
    fn bytes(&self) -> usize;
}

/// A surface, whatever its plugin.
#[derive(Debug)]
pub enum Geometry {
    /// Triangles.
    Mesh(TriangleMesh),
    /// Triangles whose corners move.
    Deforming(DeformingMesh),
    /// A disk.
    Disk(Disk),
    /// Ellipsoids, or hulls around them.
    Ellipsoids(Ellipsoids),
    /// B-splines as tubes.
    Bsplines(BsplineCurves),
    /// Lines as tubes.
    Lines(LinearCurves),
    /// A cylinder or a cone.
    Frustum(Frustum),
    /// A surface in a grid.
    Sdf(SdfGrid),
    /// A plane without an end.
    Plane(Plane),
    /// A sphere.
    Sphere(Sphere),
}

impl Geometry {
    /// The triangles, if it is made of them.
    pub fn mesh(&self) -> Option<&Mesh> {
        match self {
            Self::Mesh(mesh) => Some(mesh.mesh()),
            Self::Deforming(mesh) => Some(mesh.mesh()),
            _ => None,
        }
    }

    /// Whether all of it is known to lie in a plane.
    pub fn is_flat(&self) -> bool {
        match self {
            Self::Plane(_) | Self::Disk(_) => true,
            Self::Mesh(mesh) => mesh.is_rectangle(),
            _ => false,
        }
    }
}

impl Geometry {
    /// A point drawn evenly over the area, without a density, as Mitsuba spreads `u` over the surface where that has an
    /// equation; `None` of a surface that cannot be drawn so.
    pub fn evenly(&self, u: Vec2) -> Option<SurfaceSample> {
        let parameters = match self {
            Self::Mesh(mesh) => return mesh.evenly(u),
            Self::Sphere(_) => {
                let polar = (1.0 - 2.0 * u.y).clamp(-1.0, 1.0).acos();
                Vec2::new(u.x, polar * std::f32::consts::FRAC_1_PI)
            }
            Self::Disk(_) => {
                let p = Vec2::from(lanes::warp::concentric_disk::<f32>(u.into()));
                let turns = p.y.atan2(p.x) / std::f32::consts::TAU;
                Vec2::new(p.length(), turns)
            }
            // One whose circles are none, or of two radii, is not even in its parameters.
            Self::Frustum(frustum) => {
                let stretch = |x, y| frustum.chart(Vec2::new(x, y)).map(|chart| chart.stretch);
                let whole = stretch(0.0, 0.0)?;
                let other = [stretch(0.125, 0.5)?, stretch(0.25, 1.0)?];
                let even = other.iter().all(|s| (s / whole - 1.0).abs() < 1e-3);
                even.then_some(Vec2::new(u.y, u.x))?
            }
            Self::Bsplines(_)
            | Self::Deforming(_)
            | Self::Ellipsoids(_)
            | Self::Lines(_)
            | Self::Plane(_)
            | Self::Sdf(_) => return None,
        };
        self.chart(parameters).map(|chart| chart.point)
    }

    /// [`Surface::sample`] in lanes.
    #[inline(always)]
    pub fn sample_lanes<F: Lanes>(
        &self,
        from: lanes::Vec3<F>,
        u: lanes::Vec2<F>,
        active: F::Mask,
    ) -> SurfaceSamples<F> {
        match self {
            Self::Mesh(mesh) => mesh.sample_lanes(from, u, active),
            Self::Sphere(sphere) => sphere.sample_lanes(from, u, active),
            other => {
                let (mut position, mut normal) = ([F::ROW; 3], [F::ROW; 3]);
                let mut pdf = F::ROW;
                for lane in active.lanes() {
                    let Some(sample) = other.sample(from.lane(lane), u.lane(lane)) else {
                        continue;
                    };
                    for axis in 0..3 {
                        position[axis][lane] = sample.position[axis];
                        normal[axis][lane] = sample.normal[axis];
                    }
                    pdf[lane] = sample.pdf;
                }
                SurfaceSamples {
                    position: lanes::Vec3::load(&position),
                    normal: lanes::Vec3::load(&normal),
                    pdf: F::load(&pdf),
                }
            }
        }
    }
}

impl std::ops::Deref for Geometry {
    type Target = dyn Surface;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Mesh(mesh) => mesh,
            Self::Deforming(mesh) => mesh,
            Self::Disk(disk) => disk,
            Self::Ellipsoids(ellipsoids) => ellipsoids,
            Self::Bsplines(curves) => curves,
            Self::Lines(curves) => curves,
            Self::Frustum(frustum) => frustum,
            Self::Plane(plane) => plane,
            Self::Sdf(grid) => grid,
            Self::Sphere(sphere) => sphere,
        }
    }
}

/// What a shape plugin builds.
#[derive(Debug)]
pub struct Shape {
    /// In world space.
    pub geometry: Geometry,
    /// What the user should know of its file.
    pub warnings: Vec<Problem>,
    /// The files that its file names and that were read for it, or tried.
    pub files: Vec<PathBuf>,
}

impl From<Geometry> for Shape {
    fn from(geometry: Geometry) -> Self {
        Self {
            geometry,
            warnings: Vec::new(),
            files: Vec::new(),
        }
    }
}

/// How a plugin comes to its shape.
enum Build {
    /// By itself, in the place that the matrix says.
    Made(fn(&Properties<'_>, &DMat4) -> Result<Shape>),
    /// From the file `filename`, which is read with these options.
    Read(fn(&Properties<'_>) -> Result<ReadOptions>),
}

/// The shape plugins that are shapes by themselves.
const SINGLE: &[(&str, &Plugin, Build)] = &[
    (
        "bsplinecurve",
        &bsplinecurve::PLUGIN,
        Build::Made(bsplinecurve::build),
    ),
    ("cone", &cone::PLUGIN, Build::Made(cone::build)),
    ("cube", &cube::PLUGIN, Build::Made(cube::build)),
    ("cylinder", &cylinder::PLUGIN, Build::Made(cylinder::build)),
    ("disk", &disk::PLUGIN, Build::Made(disk::build)),
    (
        "ellipsoids",
        &ellipsoids::PLUGIN,
        Build::Made(ellipsoids::build),
    ),
    (
        "ellipsoidsmesh",
        &ellipsoids::MESH_PLUGIN,
        Build::Made(ellipsoids::build_mesh),
    ),
    ("gltf", &gltf::PLUGIN, Build::Read(gltf::options)),
    (
        "linearcurve",
        &linearcurve::PLUGIN,
        Build::Made(linearcurve::build),
    ),
    ("obj", &obj::PLUGIN, Build::Read(obj::options)),
    ("plane", &plane::PLUGIN, Build::Made(plane::build)),
    ("ply", &ply::PLUGIN, Build::Read(ply::options)),
    ("polygon", &polygon::PLUGIN, Build::Made(polygon::build)),
    (
        "rectangle",
        &rectangle::PLUGIN,
        Build::Made(rectangle::build),
    ),
    ("sdfgrid", &sdfgrid::PLUGIN, Build::Made(sdfgrid::build)),
    (
        "serialized",
        &serialized::PLUGIN,
        Build::Read(serialized::options),
    ),
    ("sphere", &sphere::PLUGIN, Build::Made(sphere::build)),
    ("stl", &stl::PLUGIN, Build::Read(stl::options)),
    ("triangle", &triangle::PLUGIN, Build::Made(triangle::build)),
];

/// How the plugin that `properties` name comes to its shape, if it is one by itself.
fn single(properties: &Properties<'_>) -> Option<&'static Build> {
    let mut plugins = SINGLE.iter();
    let named = plugins.find(|(name, ..)| *name == properties.plugin());
    named.map(|(.., build)| build)
}

/// From a shape's space to that in which it stands.
const TO_WORLD: Row = motion("to_world", "from the shape's space to the world");
/// Which side is the front.
const FLIP_NORMALS: Row = boolean("flip_normals", false, "whether the other side is the front");
const BSDF: Row = nested(Kind::Bsdf, "how it scatters light; diffuse without one");

/// How far a surface may be moved; squares of single precision end at 3.4e38.
const MOST_DISPLACED: f64 = 1e15;

/// What every shape reads.
const COMMON: &[Row] = &[
    TO_WORLD,
    BSDF,
    nested(Kind::Emitter, "area, where it gives light"),
    nested(Kind::Sensor, "irradiancemeter, where its light is measured"),
    medium("interior", "what it encloses"),
    medium("exterior", "what is around it"),
    nested(Kind::Medium, "one that is called neither is ignored").without_effect(),
    float(
        "silhouette_sampling_weight",
        1.0,
        "for differentiable rendering",
    )
    .without_effect(),
    number(
        "displacement",
        0.0,
        "how far the surface moves along its normal; scene units",
    )
    .absent("none")
    .own(),
    float(
        "displacement_scale",
        1.0,
        "what displacement is multiplied by",
    )
    .between(-MOST_DISPLACED, MOST_DISPLACED)
    .own(),
    float(
        "displacement_offset",
        0.0,
        "what is added to that; scene units",
    )
    .between(-MOST_DISPLACED, MOST_DISPLACED)
    .own(),
    float(
        "displacement_edge",
        0.0,
        "longest edge of the triangles; scene units",
    )
    .positive()
    .absent("1/256 of the box's diagonal")
    .own(),
];

/// What every mesh reads.
const MESH: &[Row] = &[
    FLIP_NORMALS,
    boolean(
        "face_normals",
        false,
        "whether triangles are flat, whatever normals there are",
    ),
];

/// What every mesh from a file reads.
const FILE: &[Row] = &[
    file("filename", "the mesh"),
    file("filename_#", "the same mesh at later times, from filename_1 on: it deforms, and goes straight from each to the next").absent("none").own(),
    string("times", "", "when those are, and the first before them: as many numbers, ascending").absent("evenly from 0 to 1").own(),
    boolean("flip_tex_coords", false, "whether v runs from the top")
        .absent("true for obj, else false"),
    boolean("bare", false, "whether the file is read as one without a scene: with its colours, its concave polygons as they are, and near the origin").own(),
    integer("surface", 0, "of a bare file, the faces alone that have this one of its surfaces, from 0: materials that differ in colour alone are one").between(0.0, 1e6).absent("all").own(),
];

/// Shapes made of shapes, which the scene puts together: several in a space of their own, and those once
/// more in the world.
pub const GROUP: &str = "shapegroup";
/// See [`GROUP`].
pub const INSTANCE: &str = "instance";
/// A node of a scene graph: shapes that share its transform and its material.
pub const NODE: &str = "group";
/// Shapes that stand where they would by themselves.
pub const MERGE: &str = "merge";

const COMPOUND: Plugins = &[
    (
        GROUP,
        &Plugin {
            about: "shapes in a space of their own, seen where instances of them stand",
            properties: &[&[
                nested(Kind::Shape, "the shapes"),
                transform("to_world", "the shapes and the instances have their own")
                    .without_effect(),
            ]],
        },
    ),
    (
        INSTANCE,
        &Plugin {
            about: "a shapegroup once more",
            properties: &[&[
                motion("to_world", "from the group's space to the world"),
                nested(Kind::Shape, "the shapegroup, by reference"),
            ]],
        },
    ),
    (
        NODE,
        &Plugin {
            about: "a node of a scene graph: shapes that share a transform and a material",
            properties: &[&[
                TO_WORLD,
                nested(Kind::Shape, "shapes, instances and groups"),
                nested(Kind::Bsdf, "of those shapes that have none of their own"),
            ]],
        },
    ),
    (
        MERGE,
        &Plugin {
            about: "shapes as they are by themselves: here one tree holds all anyway",
            properties: &[&[
                nested(Kind::Shape, "the shapes"),
                nested(Kind::Bsdf, "shapes have their own").without_effect(),
            ]],
        },
    ),
];

/// The plugins' names, as scene files write them, and what they declare.
pub fn plugins() -> impl Iterator<Item = (&'static str, &'static Plugin)> + Clone {
    let single = SINGLE.iter().map(|(name, plugin, _)| (*name, *plugin));
    single.chain(COMPOUND.iter().copied())
}

/// The properties as the shape sees them that they name.
///
/// # Errors
/// Where there is no such shape, or it is Étendue's own and the scene is read strictly.
pub(crate) fn declared<'a>(properties: &Properties<'a>) -> Result<Properties<'a>> {
    family::declared(properties, plugins())
}

/// Builds the shape that `properties` names; one that moves stands where its first keyframe has it.
pub fn build(properties: &Properties<'_>) -> Result<Shape> {
    let properties = &declared(properties)?;
    let to_world = match single(properties) {
        Some(_) => Placement::of(properties)?.first,
        None => DMat4::IDENTITY,
    };
    let setting = Setting {
        to_world,
        cache: None,
    };
    build_within(&setting, properties)
}

/// Where a shape is built.
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a> {
    /// From the shape's own space to that in which it stands still, whatever its property `to_world` says.
    pub to_world: DMat4,
    /// A folder for what takes long to compute of a large mesh.
    pub cache: Option<&'a Path>,
}

/// Builds the shape that `properties` names, as it stands in its setting.
pub fn build_within(setting: &Setting<'_>, properties: &Properties<'_>) -> Result<Shape> {
    let properties = &declared(properties)?;
    match single(properties) {
        Some(Build::Made(build)) => build(properties, &setting.to_world),
        Some(Build::Read(options)) => {
            let file = mesh::file(properties, options(properties)?)?;
            let loaded = read(&file.path, &file.options, properties.budget());
            let loaded = loaded.map_err(|e| e.named_at(properties.location()))?;
            from_file(Cow::Owned(loaded), properties, setting)
        }
        None => {
            let message = format!("a {} is put together by the scene", properties.plugin());
            Err(properties.error("", message))
        }
    }
}

/// The mesh file from which the shape is built; `None` where it needs none, or does not say it right.
pub fn mesh_file(properties: &Properties<'_>) -> Option<MeshFile> {
    let properties = &declared(properties).ok()?;
    match single(properties)? {
        Build::Made(_) => None,
        Build::Read(options) => mesh::file(properties, options(properties).ok()?).ok(),
    }
}

/// As [`build_within`], with the [`mesh_file`] read already.
pub fn build_from(
    loaded: Cow<'_, Loaded>,
    setting: &Setting<'_>,
    properties: &Properties<'_>,
) -> Result<Shape> {
    from_file(loaded, &declared(properties)?, setting)
}

/// Bytes that the shape will hold of a file that is read already.
pub fn room_of(loaded: &Loaded, properties: &Properties<'_>) -> u64 {
    match mesh::surface(properties) {
        Ok(Some(surface)) => loaded.room_of(surface),
        // What is wrong is told where the shape is built.
        _ => loaded.mesh.room(),
    }
}

/// The shape that a plugin makes of its file, and of those of later times.
fn from_file(
    loaded: Cow<'_, Loaded>,
    properties: &Properties<'_>,
    setting: &Setting<'_>,
) -> Result<Shape> {
    let Some(Build::Read(options)) = single(properties) else {
        return mesh::place_file(loaded, properties, setting);
    };
    let sets = Sets::of(properties)?;
    let times = match &sets {
        Sets::Files(times) | Sets::Animation(times) if sets.deform() => times,
        _ => return mesh::place_file(loaded, properties, setting),
    };
    let first = match &sets {
        Sets::Animation(_) => loaded.mesh.triangles.clone(),
        _ => Vec::new(),
    };
    let mut dropped = vec![loaded.dropped_triangles];
    let mut shapes = vec![mesh::place_file(loaded, properties, setting)?];
    for (number, time) in times.iter().enumerate().skip(1) {
        let mut file = mesh::file(properties, options(properties)?)?;
        match &sets {
            Sets::Animation(_) => file.options.time = Some(Time::of(*time)),
            _ => file.path = properties.file(&deforming::file_name(number))?,
        }
        let loaded = read(&file.path, &file.options, properties.budget());
        let mut loaded = loaded.map_err(|e| e.named_at(properties.location()))?;
        if let Sets::Animation(_) = sets {
            deforming::keep_winding(&first, &mut loaded.mesh);
        }
        dropped.push(loaded.dropped_triangles);
        shapes.push(mesh::place_file(Cow::Owned(loaded), properties, setting)?);
    }
    deforming::joined(shapes, &dropped, times.clone(), properties)
}

/// Whether the shape deforms, so that it has to stand in a group of its own.
pub(crate) fn deforms(properties: &Properties<'_>) -> bool {
    let from_file = matches!(single(properties), Some(Build::Read(_)));
    // What is wrong is told where the shape is built.
    from_file && Sets::of(properties).is_ok_and(|sets| sets.deform())
}

/// The property `to_world` of a shape.
#[derive(Clone, Debug)]
pub struct Placement {
    /// Where it stands: at its first keyframe, if it moves.
    pub first: DMat4,
    /// How it moves, if it does.
    pub moving: Option<Moving>,
}

impl Placement {
    /// Of what `properties` name.
    ///
    /// # Errors
    /// Where it makes no motion.
    pub fn of(properties: &Properties<'_>) -> Result<Self> {
        Ok(match properties.animation("to_world")? {
            None => Self {
                first: properties.transform("to_world")?,
                moving: None,
            },
            Some(keyframes) => Self {
                first: keyframes[0].1,
                moving: Some(properties.motion("to_world")?).filter(|moving| !moving.is_still()),
            },
        })
    }
}

/// A bound, for each axis, on the error of a world position that was computed in double precision from the
/// `local` one and then rounded: half a unit in the last place, and what the transforms there and back can have lost,
/// which is all that is left where `position` is near 0.
fn rounding(to_world: &DAffine3, local: DVec3, position: DVec3) -> Vec3 {
    // Some thousand roundings of double precision; those of single precision are 10⁴ times larger.
    const DOUBLE: f64 = 1e3 * f64::EPSILON;
    let m = to_world.matrix3;
    let spread = DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    let reach = spread * local.abs() + to_world.translation.abs();
    (position.abs() * f64::from(offset::gamma(2)) + reach * DOUBLE).as_vec3()
}

/// Density per solid angle of a point drawn with density 1/`area` over a surface.
pub fn area_to_solid_angle(area: f64, from: Vec3, position: Vec3, normal: Vec3) -> f32 {
    let way = position - from;
    let squared = way.length_squared();
    let cosine = normal.dot(way).abs() / squared.sqrt();
    if cosine > 0.0 {
        (f64::from(squared) / (f64::from(cosine) * area)) as f32
    } else {
        0.0
    }
}

/// The same in lanes and single precision; what is no density, seen on edge, is infinite or no number.
#[inline(always)]
fn area_to_solid_angles<F: Lanes>(
    area: f64,
    from: lanes::Vec3<F>,
    position: lanes::Vec3<F>,
    normal: lanes::Vec3<F>,
) -> F {
    let way = position - from;
    let squared = way.length_squared();
    let cosine = normal.dot(way).abs() / squared.sqrt();
    squared / (cosine * F::splat(area as f32))
}

#[cfg(test)]
mod curve_tests;
#[cfg(test)]
mod ellipsoid_tests;
#[cfg(test)]
mod sdf_tests;
#[cfg(test)]
mod tests;
