//! Rays, hits and what a hit looks like to a material: the small types that the layers above pass around.

mod cone;
pub mod offset;
mod points;

use glam::{Vec2, Vec3};

use crate::math::{Frame, Transform};
use crate::mesh::Mesh;

pub use cone::Cone;
pub use points::{Points, ShadowRays, Source};

/// Half a line: points `origin + t·direction` for t in (0, `t_max`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// World space.
    pub origin: Vec3,
    /// World space; unit length, so that t is a distance in scene units.
    pub direction: Vec3,
    /// The end, in units of the direction's length; may be infinite.
    pub t_max: f32,
    /// Absolute time, as in `shutter_open` and `shutter_close`.
    pub time: f32,
}

impl Ray {
    /// The point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }
}

/// Where and when light is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// World space.
    pub position: Vec3,
    /// Absolute time.
    pub time: f32,
}

/// Where a ray first meets a shape. Hits are ordered by (t, instance, shape, primitive), so that the
/// closest one does not depend on the order in which a tree is walked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f32,
    /// First surface parameter: a triangle's second barycentric coordinate.
    pub u: f32,
    /// Second surface parameter: a triangle's third barycentric coordinate.
    pub v: f32,
    /// The instance through which the ray came, or [`Hit::NONE`].
    pub instance: u32,
    /// Index of the shape in its scene, or [`Hit::NONE`] for a miss.
    pub shape: u32,
    /// Which of the shape's primitives: the triangle of a mesh.
    pub primitive: u32,
}

impl Hit {
    /// No shape, no instance.
    pub const NONE: u32 = u32::MAX;

    /// A miss of a ray that ends at `t_max`.
    #[inline]
    pub fn miss(t_max: f32) -> Self {
        Self {
            t: t_max,
            u: 0.0,
            v: 0.0,
            instance: Self::NONE,
            shape: Self::NONE,
            primitive: 0,
        }
    }

    /// Whether nothing was hit.
    #[inline]
    pub fn is_miss(&self) -> bool {
        self.shape == Self::NONE
    }

    /// Whether this hit comes first.
    #[inline]
    pub fn precedes(&self, other: &Self) -> bool {
        let id = |h: &Self| (h.instance, h.shape, h.primitive);
        self.t < other.t || (self.t == other.t && id(self) < id(other))
    }
}

/// A point on a surface, with what a material, a texture and the next ray need to know of it.
#[derive(Clone, Debug)]
pub struct Interaction<'s> {
    /// Distance from the ray's origin.
    pub t: f32,
    /// World space.
    pub position: Vec3,
    /// A bound on the position's rounding error, for each axis.
    pub error: Vec3,
    /// The geometric normal, unit length, on the side that the shape calls its front.
    pub normal: Vec3,
    /// The shading frame; its n is the interpolated normal.
    pub frame: Frame,
    /// Texture coordinates.
    pub uv: Vec2,
    /// How the position changes with u and with v.
    pub dp_du: Vec3,
    /// See `dp_du`.
    pub dp_dv: Vec3,
    /// By how much texture coordinates differ over what the ray stands for: an ellipse's conjugate diameters; 0 where
    /// nobody has asked.
    pub footprint: [Vec2; 2],
    /// Toward where the ray came from, in the shading frame.
    pub wi: Vec3,
    /// Absolute time.
    pub time: f32,
    /// The shape's index in its scene.
    pub shape: u32,
    /// The primitive's index in its shape.
    pub primitive: u32,
    /// The mesh that was hit, for its attributes.
    pub mesh: Option<&'s Mesh>,
    /// The second and third barycentric coordinate of a triangle.
    pub barycentric: Vec2,
}

impl Interaction<'_> {
    /// A point of no shape with these texture coordinates, seen along its normal +z.
    pub fn at_uv(uv: Vec2) -> Self {
        Self {
            t: 1.0,
            position: Vec3::ZERO,
            error: Vec3::ZERO,
            normal: Vec3::Z,
            frame: Frame::around(Vec3::Z),
            uv,
            dp_du: Vec3::X,
            dp_dv: Vec3::Y,
            footprint: [Vec2::ZERO; 2],
            wi: Vec3::Z,
            time: 0.0,
            shape: Hit::NONE,
            primitive: 0,
            mesh: None,
            barycentric: Vec2::ZERO,
        }
    }

    /// Where and when it is.
    pub fn reference(&self) -> Reference {
        Reference {
            position: self.position,
            time: self.time,
        }
    }

    /// A ray from here toward `direction` (unit length), off the surface by its rounding error.
    pub fn spawn(&self, direction: Vec3) -> Ray {
        Ray {
            origin: self.offset(direction),
            direction,
            t_max: f32::INFINITY,
            time: self.time,
        }
    }

    fn offset(&self, direction: Vec3) -> Vec3 {
        let (position, error) = (self.position.into(), self.error.into());
        offset::offset(position, error, self.normal.into(), direction.into()).into()
    }

    /// The same point after `transform`, seen along the world direction `direction`.
    #[must_use]
    pub fn transformed(self, transform: &Transform, direction: Vec3) -> Self {
        let normal = transform.normal(self.normal).normalize();
        let shading = transform.normal(self.frame.n).normalize();
        let dp_du = transform.vector(self.dp_du);
        let frame = Frame::along(shading, dp_du);
        Self {
            position: transform.point(self.position),
            error: transform.point_error(self.position, self.error),
            normal,
            wi: frame.to_local(-direction),
            frame,
            dp_du,
            dp_dv: transform.vector(self.dp_dv),
            ..self
        }
    }
}

/// By what fraction a shadow ray stops short of the light's surface.
const SHADOW_EPSILON: f32 = 1e-4;
