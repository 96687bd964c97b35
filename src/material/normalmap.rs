//! `normalmap`: turns the normal of the nested material to that of the texture `normalmap`, whose values
//! in [0, 1] stand for components in [−1, 1] in the shading frame; images want `raw`.

use glam::{Vec2, Vec3};

use super::perturbed::Perturbed;
use super::{Bsdf, BsdfSample, BsdfValue, Lobes, PhongTerms};
use crate::color::{Color, ColorModel, Rgb, Role};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::Interaction;
use crate::math::Frame;
use crate::texture::{Palettes, Texture};

/// A material on a surface with given normals.
#[derive(Clone, Debug)]
pub struct NormalMap<C: ColorModel> {
    material: Perturbed<C>,
    normals: Texture<Rgb>,
}

impl<C: ColorModel> NormalMap<C> {
    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        if properties.object("normalmap")?.is_none() {
            return Err(properties.error("", "normalmap needs a texture of the same name"));
        }
        let flat = Color::Rgb([0.5, 0.5, 1.0]);
        let vectors = &palettes.vectors;
        Ok(Self {
            material: Perturbed::build(properties, palettes)?,
            normals: vectors.texture(properties, "normalmap", Role::Quantity, flat)?,
        })
    }

    /// The frame of the texture's normal, in coordinates of the shading frame.
    fn frame(&self, at: &Interaction<'_>, wi: Vec3) -> Frame {
        let value = self.normals.eval(at, &());
        let n = Vec3::from_array(value.0) * 2.0 - 1.0;
        self.material.frame(wi, n, Vec3::X)
    }
}

impl<C: ColorModel> Bsdf<C> for NormalMap<C> {
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
