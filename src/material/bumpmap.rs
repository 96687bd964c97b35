//! `bumpmap`: tilts the normal of the nested material as if the surface were raised along it by the
//! nested texture times `scale` (1), in scene units (Blinn, *Simulation of wrinkled surfaces*, 1978).

use super::perturbed::{Normals, Perturbed, unit_or_up};
use crate::color::{ColorModel, Mono, Role};
use crate::description::declared::{Plugin, float, nested};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3};
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
        if texture.plugin() == "volume" {
            return Err(texture.error(
                "",
                "a volume does not say how heights change along a surface",
            ));
        }
        let bumps = Bumps {
            height: Texture::build(texture, &palettes.numbers.with_role(Role::Quantity))?,
            scale: properties.float("scale")? as f32,
        };
        Self::around(properties, palettes, bumps)
    }
}

impl Bumps {
    /// How the height changes with u and with v.
    #[inline(always)]
    fn slopes<F: Lanes>(&self, at: &Points<'_, F>) -> Vec2<F> {
        let (uv, mut slopes) = (at.uv.rows(), [F::ROW; 2]);
        let footprint = [at.footprint[0].rows(), at.footprint[1].rows()];
        for lane in at.lanes() {
            let mut point = at.texture_point(lane, &uv);
            for (way, rows) in point.footprint.iter_mut().zip(&footprint) {
                *way = Vec2::<F>::of(rows, lane);
            }
            let gradient = self.height.gradient(&point, &());
            for (row, slope) in slopes.iter_mut().zip(gradient) {
                row[lane] = slope[0];
            }
        }
        Vec2::<F>::load(&slopes) * F::splat(self.scale)
    }
}

/// `d` where the surface is raised by `slope` along it.
#[inline(always)]
fn raised<F: Lanes>(n: Vec3<F>, d: Vec3<F>, slope: F) -> Vec3<F> {
    d + n * (slope - n.dot(d))
}

impl Normals for Bumps {
    #[inline(always)]
    fn normals<F: Lanes>(&self, at: &Points<'_, F>) -> (Vec3<F>, Vec3<F>) {
        let slopes = self.slopes(at);
        let along_u = raised(at.frame.n, at.dp_du, slopes.x);
        let along_v = raised(at.frame.n, at.dp_dv, slopes.y);
        let normal = along_u.cross(along_v);
        let outward = F::one().copysign(normal.dot(at.normal));
        let normal = unit_or_up(at.frame.to_local(normal * outward));
        (normal, at.frame.to_local(at.dp_du))
    }
}
