//! What `bumpmap` and `normalmap` share: a material seen in another frame than the surface's own, and the
//! shadowing that hides the edge where the surface itself turns away from the light (Estevez, Lecocq and
//! Stein, *A microfacet-based shadowing function to solve the bump terminator problem*, 2019).

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, BsdfValue, Lobes, Material, PhongTerms, nested};
use crate::color::ColorModel;
use crate::description::declared::{Row, boolean, nested as nested_row};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::math::Frame;
use crate::texture::Palettes;

/// Where the normals of a surface point.
pub trait Normals: std::fmt::Debug + Send + Sync {
    /// The normal, of any length, and the direction that the frame's s follows; both in the shading frame.
    fn normal(&self, at: &Interaction<'_>) -> (Vec3, Vec3);
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

    /// The frame around the normal, in coordinates of the surface's shading frame: the normal is turned about z
    /// where it would face away from `wi`.
    fn frame(&self, at: &Interaction<'_>, wi: Vec3) -> Frame {
        let (n, tangent) = self.normals.normal(at);
        let away = wi.z * wi.dot(n) <= 0.0;
        let n = if away && self.flip_invalid_normals {
            Vec3::new(-n.x, -n.y, n.z)
        } else {
            n
        };
        let n = n.try_normalize().unwrap_or(Vec3::Z);
        Frame::along(n, tangent)
    }

    /// The share of light from `wo` that the bumps let through.
    fn shadowing(&self, frame: &Frame, wo: Vec3) -> f32 {
        if !self.use_shadowing_function {
            return 1.0;
        }
        let tan2 = |v: Vec3| (1.0 - v.z * v.z).max(0.0) / (v.z * v.z);
        let alpha2 = (0.125 * tan2(frame.n)).min(1.0);
        2.0 / (1.0 + (1.0 + alpha2 * tan2(wo)).sqrt())
    }
}

impl<C: ColorModel, N: Normals> Bsdf<C> for Perturbed<C, N> {
    fn lobes(&self) -> Lobes {
        self.nested.lobes()
    }

    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        let frame = self.frame(at, wi);
        let turned = frame.to_local(wo);
        if turned.z * wo.z <= 0.0 {
            return None;
        }
        let (inner, wi) = turned_interaction(at, &frame, wi);
        let value = self.nested.eval(&inner, wi, turned, w)?;
        Some(BsdfValue {
            value: value.value * self.shadowing(&frame, wo),
            pdf: value.pdf,
        })
    }

    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        u1: f32,
        u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        let frame = self.frame(at, wi);
        let (inner, wi) = turned_interaction(at, &frame, wi);
        let sample = self.nested.sample(&inner, wi, u1, u2, w)?;
        let wo = frame.to_world(sample.wo);
        (sample.wo.z * wo.z > 0.0).then(|| BsdfSample {
            wo,
            weight: sample.weight * self.shadowing(&frame, wo),
            ..sample
        })
    }

    /// The terms about the turned normal; the textbook knows no shadowing of bumps.
    fn phong(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<PhongTerms<C::Sample>> {
        let frame = self.frame(at, wi);
        let turned = frame.to_local(wo);
        if turned.z * wo.z <= 0.0 {
            return None;
        }
        let (inner, wi) = turned_interaction(at, &frame, wi);
        self.nested.phong(&inner, wi, turned, w)
    }

    fn ambient(&self, at: &Interaction<'_>, wi: Vec3, w: &C::Wavelengths) -> C::Sample {
        let (inner, wi) = turned_interaction(at, &self.frame(at, wi), wi);
        self.nested.ambient(&inner, wi, w)
    }
}

/// The surface with its shading frame turned to `frame`, and `wi` in that frame.
fn turned_interaction<'s>(
    at: &Interaction<'s>,
    frame: &Frame,
    wi: Vec3,
) -> (Interaction<'s>, Vec3) {
    let world = Frame {
        s: at.frame.to_world(frame.s),
        t: at.frame.to_world(frame.t),
        n: at.frame.to_world(frame.n),
    };
    let wi = frame.to_local(wi);
    let inner = Interaction {
        frame: world,
        wi,
        ..at.clone()
    };
    (inner, wi)
}
