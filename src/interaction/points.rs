//! Points on surfaces in lanes: what a block of paths has met.

use super::{Interaction, SHADOW_EPSILON, offset};
use crate::lanes::{Frame, Lanes, Mask as _, Vec2, Vec3};
use crate::mesh::Mesh;

/// Whoever knows the points of a block one by one.
pub trait Source {
    /// A lane's point.
    fn interaction(&self, lane: usize) -> Interaction<'_>;
    /// A lane's time.
    fn time(&self, lane: usize) -> f32;
    /// Where on its mesh, if it is on one, a lane's point lies: the triangle, and its second and third coordinate.
    fn on_mesh(&self, lane: usize) -> Option<(&Mesh, u32, glam::Vec2)>;
}

impl Source for Interaction<'_> {
    fn interaction(&self, _lane: usize) -> Interaction<'_> {
        self.clone()
    }

    fn time(&self, _lane: usize) -> f32 {
        self.time
    }

    fn on_mesh(&self, _lane: usize) -> Option<(&Mesh, u32, glam::Vec2)> {
        Some((self.mesh?, self.primitive, self.barycentric))
    }
}

/// Points on surfaces; the fields are those of [`Interaction`].
#[derive(Clone, Copy)]
pub struct Points<'a, F: Lanes> {
    /// The lanes that there are; the others hold anything.
    pub active: F::Mask,
    /// World space.
    pub position: Vec3<F>,
    /// A bound on the position's rounding error, for each axis.
    pub error: Vec3<F>,
    /// The geometric normal.
    pub normal: Vec3<F>,
    /// The shading frame.
    pub frame: Frame<F>,
    /// Texture coordinates.
    pub uv: Vec2<F>,
    /// How the position changes with u.
    pub dp_du: Vec3<F>,
    /// How the position changes with v.
    pub dp_dv: Vec3<F>,
    /// How far texture coordinates go over what the rays stand for: see [`Interaction::footprint`].
    pub footprint: [Vec2<F>; 2],
    /// Toward where the paths came from, in the shading frame.
    pub wi: Vec3<F>,
    /// The same points one by one.
    pub source: &'a dyn Source,
}

impl<F: Lanes> std::fmt::Debug for Points<'_, F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Points")
            .field("position", &self.position)
            .finish_non_exhaustive()
    }
}

impl<'a> Points<'a, f32> {
    /// A single point.
    #[inline(always)]
    pub fn one(at: &'a Interaction<'_>) -> Self {
        Self {
            active: true,
            position: at.position.into(),
            error: at.error.into(),
            normal: at.normal.into(),
            frame: at.frame.into(),
            uv: at.uv.into(),
            dp_du: at.dp_du.into(),
            dp_dv: at.dp_dv.into(),
            footprint: at.footprint.map(Vec2::from),
            wi: at.wi.into(),
            source: at,
        }
    }
}

impl<F: Lanes> Points<'_, F> {
    /// A lane's point, in the frame that the block has.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Interaction<'_> {
        let Frame { s, t, n } = self.frame;
        Interaction {
            frame: crate::math::Frame {
                s: s.lane(lane),
                t: t.lane(lane),
                n: n.lane(lane),
            },
            footprint: self.footprint.map(|way| way.lane(lane)),
            wi: self.wi.lane(lane),
            ..self.source.interaction(lane)
        }
    }

    /// A lane's point as textures see it, by the rows of the texture coordinates: whoever goes through the lanes in a
    /// closure must not take them out of registers there.
    #[inline(always)]
    pub fn texture_point(&self, lane: usize, [u, v]: &[F::Row; 2]) -> Interaction<'_> {
        let mut at = Interaction::at_uv(glam::Vec2::new(u[lane], v[lane]));
        if let Some((mesh, primitive, barycentric)) = self.source.on_mesh(lane) {
            (at.mesh, at.primitive, at.barycentric) = (Some(mesh), primitive, barycentric);
        }
        at
    }

    /// Where rays from here toward `direction` start: off the surface by its rounding error.
    #[inline(always)]
    pub fn origin(&self, direction: Vec3<F>) -> Vec3<F> {
        offset::offset(self.position, self.error, self.normal, direction)
    }

    /// Shadow rays from here to lights in some `direction`, which are at a `target` where they are not `distant`: to
    /// just before that.
    #[inline(always)]
    pub fn shadow(&self, direction: Vec3<F>, target: Vec3<F>, distant: F::Mask) -> ShadowRays<F> {
        let toward = Vec3::select(distant, direction, target - self.position);
        let origin = self.origin(toward);
        let way = target - origin;
        let distance = way.length();
        ShadowRays {
            origin,
            direction: Vec3::select(distant, direction, way / distance),
            t_max: F::select(
                distant,
                F::splat(f32::INFINITY),
                distance * F::splat(1.0 - SHADOW_EPSILON),
            ),
        }
    }

    /// The lanes that are there.
    #[inline(always)]
    pub fn lanes(&self) -> crate::lanes::LanesOf {
        self.active.lanes()
    }
}

/// Rays in lanes, without their time.
#[derive(Clone, Copy, Debug)]
pub struct ShadowRays<F> {
    /// World space.
    pub origin: Vec3<F>,
    /// Unit length.
    pub direction: Vec3<F>,
    /// Where they end.
    pub t_max: F,
}
