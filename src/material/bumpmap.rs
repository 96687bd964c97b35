//! `bumpmap`: tilts the normal of the nested material as if the surface were raised along it by the
//! nested texture times `scale` (1), in scene units (Blinn, *Simulation of wrinkled surfaces*, 1978).

use glam::Vec3;

use super::perturbed::{Normals, Perturbed};
use crate::color::{ColorModel, Mono, Role};
use crate::description::declared::{Plugin, float, nested};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::{Palettes, Texture};

/// A material on a surface with bumps.
pub(super) type BumpMap<C> = Perturbed<C, Bumps>;

/// A surface that is raised along its normal.
#[derive(Clone, Debug)]
pub struct Bumps {
    height: Texture<Mono>,
    scale: f32,
}

impl<C: ColorModel> BumpMap<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "bumps from a texture of heights",
        properties: &[
            super::perturbed::PROPERTIES,
            &[
                nested(Kind::Texture, "heights, in scene units"),
                float("scale", 1.0, "what heights are multiplied by"),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let textures = properties.children(Kind::Texture);
        let [texture] = &textures[..] else {
            let message = format!(
                "bumpmap needs one nested texture, and has {}",
                textures.len()
            );
            return Err(properties.error("", message));
        };
        let bumps = Bumps {
            height: Texture::build(texture, &palettes.numbers.with_role(Role::Quantity))?,
            scale: properties.float("scale")? as f32,
        };
        Self::around(properties, palettes, bumps)
    }
}

impl Normals for Bumps {
    fn normal(&self, at: &Interaction<'_>) -> (Vec3, Vec3) {
        let [along_u, along_v] = self.height.gradient(at, &()).map(|s| s[0] * self.scale);
        let n = at.frame.n;
        let along = |d: Vec3, slope: f32| d + n * (slope - n.dot(d));
        let raised = along(at.dp_du, along_u).cross(along(at.dp_dv, along_v));
        let raised = at.frame.to_local(raised * raised.dot(at.normal).signum());
        let raised = raised.try_normalize().unwrap_or(Vec3::Z);
        (raised, at.frame.to_local(at.dp_du))
    }
}
