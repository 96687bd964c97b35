//! `normalmap`: turns the normal of the nested material to that of the texture `normalmap`, whose values
//! in [0, 1] stand for components in [−1, 1] in the shading frame; images want `raw`. Étendue's own are `scale`, which x and y
//! are multiplied by, and `against_v`: y runs against v where texture coordinates are mirrored too, as glTF has it.

use super::perturbed::{Normals, Perturbed};
use crate::color::{ColorModel, Rgb, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, float, map};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, MAX_LANES, Vec3};
use crate::texture::{Palettes, Texture};

/// A material on a surface with given normals.
pub(super) type NormalMap<C> = Perturbed<C, Mapped>;

/// Normals that a texture holds.
#[derive(Clone, Debug)]
pub struct Mapped {
    texture: Texture<Rgb>,
    scale: f32,
    against_v: bool,
}

impl<C: ColorModel> NormalMap<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "normals from a texture",
        properties: &[
            super::perturbed::PROPERTIES,
            &[
                map(
                    "normalmap",
                    "normals in the shading frame, from [−1, 1] to [0, 1]",
                ),
                float("scale", 1.0, "what their x and y are multiplied by").own(),
                boolean(
                    "against_v",
                    false,
                    "whether y runs against v where texture coordinates are mirrored too",
                )
                .own(),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        if properties.object("normalmap")?.is_none() {
            return Err(properties.missing("normalmap"));
        }
        let vectors = &palettes.vectors;
        let normals = Mapped {
            texture: vectors.texture(properties, "normalmap", Role::Quantity)?,
            scale: properties.float("scale")? as f32,
            against_v: properties.boolean("against_v")?,
        };
        Self::around(properties, palettes, normals)
    }
}

impl Normals for Mapped {
    #[inline(always)]
    fn normals<F: Lanes>(&self, at: &Points<'_, F>) -> (Vec3<F>, Vec3<F>) {
        let value = self.texture.eval_lanes(at, &[(); MAX_LANES]);
        let value = Vec3::new(value[0], value[1], value[2]);
        let mut normal = value * F::splat(2.0) - Vec3::splat(1.0);
        let scale = F::splat(self.scale);
        (normal.x, normal.y) = (normal.x * scale, normal.y * scale);
        if self.against_v {
            let along_v = F::zero().lt(at.frame.t.dot(at.dp_dv));
            normal.y = F::select(along_v, -normal.y, normal.y);
        }
        (normal, Vec3::all(glam::Vec3::X))
    }
}
