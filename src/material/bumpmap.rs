//! `bumpmap`: tilts the normal of the nested material as if the surface were raised along it by the
//! nested texture times `scale` (1), in scene units (Blinn, *Simulation of wrinkled surfaces*, 1978).

use glam::{Vec2, Vec3};

use super::perturbed::Perturbed;
use super::{Bsdf, BsdfSample, BsdfValue, Lobes, PhongTerms};
use crate::color::{ColorModel, Mono, Role};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::math::Frame;
use crate::texture::{Palettes, Texture};

/// A material on a surface with bumps.
#[derive(Clone, Debug)]
pub struct BumpMap<C: ColorModel> {
    material: Perturbed<C>,
    height: Texture<Mono>,
    scale: f32,
}

impl<C: ColorModel> BumpMap<C> {
    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let textures = properties.children(Kind::Texture);
        let [texture] = &textures[..] else {
            let message = format!(
                "bumpmap needs one nested texture, and has {}",
                textures.len()
            );
            return Err(properties.error("", message));
        };
        Ok(Self {
            material: Perturbed::build(properties, palettes)?,
            height: Texture::build(texture, &palettes.numbers.with_role(Role::Quantity))?,
            scale: properties.float("scale")?.unwrap_or(1.0) as f32,
        })
    }

    /// The frame of the raised surface, in coordinates of the shading frame.
    fn frame(&self, at: &Interaction<'_>, wi: Vec3) -> Frame {
        let [along_u, along_v] = self.height.gradient(at, &()).map(|s| s[0] * self.scale);
        let n = at.frame.n;
        let along = |d: Vec3, slope: f32| d + n * (slope - n.dot(d));
        let raised = along(at.dp_du, along_u).cross(along(at.dp_dv, along_v));
        let raised = at.frame.to_local(raised * raised.dot(at.normal).signum());
        let raised = raised.try_normalize().unwrap_or(Vec3::Z);
        self.material.frame(wi, raised, at.frame.to_local(at.dp_du))
    }
}

impl<C: ColorModel> Bsdf<C> for BumpMap<C> {
    fn lobes(&self) -> Lobes {
        self.material.nested.lobes()
    }

    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        self.material.eval(at, &self.frame(at, wi), wi, wo, w)
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
        self.material.sample(at, &frame, wi, (u1, u2), w)
    }

    fn phong(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<PhongTerms<C::Sample>> {
        self.material.phong(at, &self.frame(at, wi), wi, wo, w)
    }

    fn ambient(&self, at: &Interaction<'_>, wi: Vec3, w: &C::Wavelengths) -> C::Sample {
        self.material.ambient(at, &self.frame(at, wi), wi, w)
    }
}
