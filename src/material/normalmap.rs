//! `normalmap`: turns the normal of the nested material to that of the texture `normalmap`, whose values
//! in [0, 1] stand for components in [−1, 1] in the shading frame; images want `raw`.

use glam::Vec3;

use super::perturbed::{Normals, Perturbed};
use crate::color::{Color, ColorModel, Rgb, Role};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::{Palettes, Texture};

/// A material on a surface with given normals.
pub(super) type NormalMap<C> = Perturbed<C, Mapped>;

/// Normals that a texture holds.
#[derive(Clone, Debug)]
pub struct Mapped(Texture<Rgb>);

impl<C: ColorModel> NormalMap<C> {
    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        if properties.object("normalmap")?.is_none() {
            return Err(properties.error("", "normalmap needs a texture of the same name"));
        }
        let flat = Color::Rgb([0.5, 0.5, 1.0]);
        let vectors = &palettes.vectors;
        let normals = Mapped(vectors.texture(properties, "normalmap", Role::Quantity, flat)?);
        Self::around(properties, palettes, normals)
    }
}

impl Normals for Mapped {
    fn normal(&self, at: &Interaction<'_>) -> (Vec3, Vec3) {
        let value = self.0.eval(at, &());
        (Vec3::from_array(value.0) * 2.0 - 1.0, Vec3::X)
    }
}
