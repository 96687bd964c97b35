//! Points on surfaces in lanes, whatever surfaces these are.

use super::Interaction;
use crate::interaction::{Hit, Ray};
use crate::lanes::{Frame, Lanes, Vec2, Vec3};
use crate::math;
use crate::mesh::Mesh;

/// Points on surfaces; the fields are those of [`crate::interaction::Points`].
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoints<F> {
    /// World space.
    pub position: Vec3<F>,
    /// A bound on its rounding error.
    pub error: Vec3<F>,
    /// The geometric normal.
    pub normal: Vec3<F>,
    /// The shading frame.
    pub frame: Frame<F>,
    /// Texture coordinates.
    pub uv: Vec2<F>,
    /// How the position changes with u.
    pub dp_du: Vec3<F>,
    /// How it changes with v.
    pub dp_dv: Vec3<F>,
}

impl<F: Lanes> SurfacePoints<F> {
    /// `yes` where the mask is set, else `no`.
    #[inline(always)]
    pub(crate) fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self {
            position: Vec3::select(mask, yes.position, no.position),
            error: Vec3::select(mask, yes.error, no.error),
            normal: Vec3::select(mask, yes.normal, no.normal),
            frame: Frame {
                s: Vec3::select(mask, yes.frame.s, no.frame.s),
                t: Vec3::select(mask, yes.frame.t, no.frame.t),
                n: Vec3::select(mask, yes.frame.n, no.frame.n),
            },
            uv: Vec2::select(mask, yes.uv, no.uv),
            dp_du: Vec3::select(mask, yes.dp_du, no.dp_du),
            dp_dv: Vec3::select(mask, yes.dp_dv, no.dp_dv),
        }
    }
}

impl SurfacePoints<f32> {
    /// The point that `ray` has met by its `hit`, on a triangle of the mesh if it is one's.
    pub(crate) fn interaction<'a>(
        self,
        mesh: Option<&'a Mesh>,
        ray: &Ray,
        hit: &Hit,
    ) -> Interaction<'a> {
        let frame = math::Frame::from(self.frame);
        Interaction {
            t: hit.t,
            position: self.position.into(),
            error: self.error.into(),
            normal: self.normal.into(),
            frame,
            uv: self.uv.into(),
            dp_du: self.dp_du.into(),
            dp_dv: self.dp_dv.into(),
            footprint: [glam::Vec2::ZERO; 2],
            wi: frame.to_local(-ray.direction),
            time: ray.time,
            shape: hit.shape,
            primitive: hit.primitive,
            mesh,
            barycentric: glam::Vec2::new(hit.u, hit.v),
        }
    }
}
