//! What `bumpmap` and `normalmap` share: a material seen in another frame than the surface's own, and the
//! shadowing that hides the edge where the surface itself turns away from the light (Estevez, Lecocq and
//! Stein, *A microfacet-based shadowing function to solve the bump terminator problem*, 2019).

use super::{
    BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, Material, PhongTerms, nested, single_face,
};
use crate::color::ColorModel;
use crate::description::declared::{Row, boolean, nested as nested_row};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::{Frame, Lanes, Vec2, Vec3};
use crate::texture::Palettes;

/// Where the normals of a surface point.
pub trait Normals: std::fmt::Debug + Send + Sync {
    /// The normals, of any length, and the directions that the frames' s follow; both in the shading frame. Must be
    /// `#[inline(always)]`.
    fn normals<F: Lanes>(&self, at: &Points<'_, F>) -> (Vec3<F>, Vec3<F>);
}

/// A material on a surface with other normals than its own.
#[derive(Clone, Debug)]
pub struct Perturbed<C: ColorModel, N> {
    normals: N,
    nested: Box<Material<C>>,
    flip_invalid_normals: bool,
    use_shadowing_function: bool,
}

/// What both materials read.
pub(super) const PROPERTIES: &[Row] = &[
    boolean(
        "flip_invalid_normals",
        true,
        "whether normals that face away are turned over",
    ),
    boolean(
        "use_shadowing_function",
        true,
        "whether bumps hide light at flat angles",
    ),
    nested_row(Kind::Bsdf, "the material"),
];

impl<C: ColorModel, N: Normals> Perturbed<C, N> {
    pub(super) fn around(
        properties: &Properties<'_>,
        palettes: &Palettes<C>,
        normals: N,
    ) -> Result<Self> {
        let mut nested = nested(properties, palettes, 1..=1)?;
        Ok(Self {
            normals,
            nested: Box::new(nested.remove(0)),
            flip_invalid_normals: properties.boolean("flip_invalid_normals")?,
            use_shadowing_function: properties.boolean("use_shadowing_function")?,
        })
    }

    /// The frames around the normals, in coordinates of the surface's shading frames: normals are turned about z where
    /// they would face away from `wi`.
    #[inline(always)]
    fn frames<F: Lanes>(&self, at: &Points<'_, F>, wi: Vec3<F>) -> Frame<F> {
        let (mut n, tangent) = self.normals.normals(at);
        if self.flip_invalid_normals {
            let away = (wi.z * wi.dot(n)).le(F::zero());
            n = Vec3::select(away, Vec3::new(-n.x, -n.y, n.z), n);
        }
        Frame::along(unit_or_up(n), tangent)
    }

    /// The share of light from `wo` that the bumps let through.
    #[inline(always)]
    fn shadowing<F: Lanes>(&self, frames: &Frame<F>, wo: Vec3<F>) -> F {
        let one = F::one();
        if !self.use_shadowing_function {
            return one;
        }
        let alpha2 = (F::splat(0.125) * tan2(frames.n)).min(one);
        F::splat(2.0) / (one + (one + alpha2 * tan2(wo)).sqrt())
    }
}

/// Of length 1; +z where that cannot be.
#[inline(always)]
pub(super) fn unit_or_up<F: Lanes>(v: Vec3<F>) -> Vec3<F> {
    let unit = v.normalize_or_zero();
    let none = unit.length_squared().eq(F::zero());
    Vec3::select(none, Vec3::all(glam::Vec3::Z), unit)
}

/// The square of the tangent of a unit vector's angle with z.
#[inline(always)]
fn tan2<F: Lanes>(v: Vec3<F>) -> F {
    let cos2 = v.z * v.z;
    (F::one() - cos2).max(F::zero()) / cos2
}

/// The surface with its shading frames turned to `frames`, in coordinates of its own, and `wi` in those.
#[inline(always)]
fn turned<'a, F: Lanes>(
    at: &Points<'a, F>,
    frames: &Frame<F>,
    wi: Vec3<F>,
) -> (Points<'a, F>, Vec3<F>) {
    let wi = frames.to_local(wi);
    let frame = Frame {
        s: at.frame.to_world(frames.s),
        t: at.frame.to_world(frames.t),
        n: at.frame.to_world(frames.n),
    };
    (Points { frame, wi, ..*at }, wi)
}

impl<C: ColorModel, N: Normals> Bsdf<C> for Perturbed<C, N> {
    fn lobes(&self) -> Lobes {
        self.nested.lobes()
    }

    fn passes(&self) -> bool {
        self.nested.passes()
    }

    single_face!();

    fn ambient(&self, at: &Interaction<'_>, wi: glam::Vec3, w: &C::Wavelengths) -> C::Sample {
        let point = Points::one(at);
        let frame = self.frames(&point, wi.into());
        let (inner, wi) = turned(&point, &frame, wi.into());
        self.nested.ambient(&inner.lane(0), wi.into(), w)
    }
}

impl<C: ColorModel, N: Normals> BlockBsdf<C> for Perturbed<C, N> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let frames = self.frames(at, wi);
        let (inner, inner_wi) = turned(at, &frames, wi);
        let inner_wo = frames.to_local(wo);
        let values = self.nested.eval_lanes(&inner, inner_wi, inner_wo, w);
        let values = BsdfValues {
            value: values.value * self.shadowing(&frames, wo),
            ..values
        };
        values.only(F::zero().lt(inner_wo.z * wo.z))
    }

    #[inline(always)]
    fn passing_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let frames = self.frames(at, wi);
        let (inner, inner_wi) = turned(at, &frames, wi);
        self.nested.passing_lanes(&inner, inner_wi, w)
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let frames = self.frames(at, wi);
        let (inner, inner_wi) = turned(at, &frames, wi);
        let samples = self.nested.sample_lanes(&inner, inner_wi, u1, u2, w);
        let wo = frames.to_world(samples.wo);
        BsdfSamples {
            drawn: samples.drawn & F::zero().lt(samples.wo.z * wo.z),
            wo,
            weight: samples.weight * self.shadowing(&frames, wo),
            ..samples
        }
    }

    /// About the turned normals; the textbook knows no shadowing of bumps.
    #[inline(always)]
    fn phong_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> Option<PhongTerms<C::Columns<F>>> {
        let frames = self.frames(at, wi);
        let (inner, inner_wi) = turned(at, &frames, wi);
        let inner_wo = frames.to_local(wo);
        let terms = self.nested.phong_lanes(&inner, inner_wi, inner_wo, w);
        Some(terms.only(F::zero().lt(inner_wo.z * wo.z)))
    }
}
