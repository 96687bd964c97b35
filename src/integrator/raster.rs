//! `raster`, Étendue's own: the picture that a z-buffer draws, with the equation of `phong` for what is seen and no light that
//! was reflected twice. `shading` is `phong` (for every fragment) or `gouraud` (for corners of triangles); `falloff` that of the
//! integrator `phong`. Lights cast shadows by maps of `shadow_map_size` texels a side (1024), compared with a `shadow_bias` in
//! scene units (by default what texel and slope ask for) and averaged over a square of `pcf` texels (1). `multisamples`
//! (1, 2, 4, 8 or 16) is how often a pixel asks which triangle it sees, and takes the place of sampler and filter;
//! `depth_bits` (0, a float) how many bits depths have; `cull` (`none`, `back`, `front`) which sides are left out.
//!
//! A whole image is drawn by `render`. Where samples come one by one (in parts of images, adaptively, inside of `aov`) rays
//! find what is seen, and shadow rays are asked; what is shaded is the same.

use glam::Vec3;

use super::limits;
use super::phong::FALLOFFS;
use super::{Context, Cost, Estimate, Estimates, Estimator, Footprint, Start};
use crate::color::{ColorModel, Spectral as _};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, choice, float, integer};
use crate::error::Result;
use crate::interaction::Ray;
use crate::math::Frame;
use crate::raster::{
    Batch, COUNTS, Cull, DepthFormat, Lighting, Pattern, ShadeSettings, Shader, Shading,
    ShadowSettings,
};
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The settings.
#[derive(Clone, Debug)]
pub struct Raster {
    pub(crate) shade: ShadeSettings,
    pub(crate) pattern: Pattern,
    pub(crate) depth: DepthFormat,
    pub(crate) cull: Cull,
    footprint: Option<Footprint>,
}

impl Raster {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "what a z-buffer draws, with Phong's equation and shadow maps",
        properties: &[
            limits::COMMON,
            limits::NO_DEPTHS,
            &[
                choice(
                    "shading",
                    &["phong", "gouraud"],
                    "where the equation is evaluated: for every fragment, or for corners of triangles",
                ),
                choice("falloff", FALLOFFS, "how light weakens with distance"),
                boolean(
                    "shadows",
                    true,
                    "whether lights cast shadows; those of environments never do",
                ),
                integer(
                    "shadow_map_size",
                    1024,
                    "texels along a side of a shadow map",
                )
                .between(1.0, 16384.0),
                float(
                    "shadow_bias",
                    0.0,
                    "how much nearer something must be to cast a shadow; scene units",
                )
                .at_least(0.0)
                .absent("by a texel's size and the surface's slope"),
                integer(
                    "pcf",
                    1,
                    "texels along a side of the square over which a shadow is averaged",
                )
                .between(1.0, 64.0),
                integer(
                    "multisamples",
                    4,
                    "places in a pixel that ask what is seen: 1, 2, 4, 8 or 16",
                )
                .between(1.0, 16.0),
                integer("depth_bits", 0, "bits of a depth; 0 is a float").between(0.0, 31.0),
                choice(
                    "cull",
                    &["none", "back", "front"],
                    "which sides of surfaces are left out",
                ),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        let count = properties.integer("multisamples")? as u32;
        let Some(pattern) = Pattern::of(count) else {
            let message = format!("there is no pattern of {count} samples");
            let error = properties.error("multisamples", message);
            let counts = COUNTS.map(|count| count.to_string()).join(", ");
            return Err(error.help(format!("there are patterns of {counts}")));
        };
        let shadows = ShadowSettings {
            size: properties.integer("shadow_map_size")? as u32,
            bias: properties.given("shadow_bias")?,
            filter: properties.integer("pcf")? as u32,
        };
        Ok(Self {
            shade: ShadeSettings {
                shading: match properties.choice("shading")? {
                    "gouraud" => Shading::Gouraud,
                    _ => Shading::Phong,
                },
                lighting: match properties.choice("falloff")? {
                    "inverse_square" => Lighting::InverseSquare,
                    "radiometric" => Lighting::Radiometric,
                    _ => Lighting::Textbook,
                },
                shadows: properties.boolean("shadows")?.then_some(shadows),
                hide_emitters: properties.boolean("hide_emitters")?,
            },
            pattern,
            depth: match properties.integer("depth_bits")? {
                0 => DepthFormat::Float,
                bits => DepthFormat::Bits(bits as u32),
            },
            cull: match properties.choice("cull")? {
                "back" => Cull::Back,
                "front" => Cull::Front,
                _ => Cull::None,
            },
            footprint: context.footprint.clone(),
        })
    }

    /// That of the picture which comes before the image of another integrator.
    pub(crate) fn preview() -> Self {
        Self {
            shade: ShadeSettings {
                shading: Shading::Phong,
                lighting: Lighting::Radiometric,
                shadows: Some(ShadowSettings {
                    size: 1024,
                    bias: None,
                    filter: 2,
                }),
                hide_emitters: false,
            },
            pattern: Pattern::CENTRE,
            depth: DepthFormat::Float,
            cull: Cull::None,
            footprint: None,
        }
    }
}

impl<C: ColorModel> Estimator<C> for Raster {
    fn estimate(
        &self,
        scene: &Scene<C>,
        _sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        let rays: Vec<Ray> = starts.iter().map(|s| s.ray).collect();
        let mut hits = Vec::new();
        cost.closest(scene, 0, &rays, &mut hits);
        estimates.values.clear();
        estimates.extra.clear();
        let (mut batch, mut met, mut colors) = (Batch::default(), Vec::new(), Vec::new());
        let mut answer = Vec::new();
        let footprint = self.footprint.as_ref().filter(|_| scene.has_mipmaps());
        let is_alike =
            |a: &Start<C>, b: &Start<C>| a.wavelengths == b.wavelengths && a.ray.time == b.ray.time;
        let mut hits = hits.iter();
        for starts in starts.chunk_by(is_alike) {
            let shader = Shader::new(scene, self.shade, starts[0].wavelengths, starts[0].ray.time);
            batch.clear();
            met.clear();
            for (Start { ray, .. }, hit) in starts.iter().zip(&mut hits) {
                let (radiance, alpha) = if hit.is_miss() {
                    shader.background(ray)
                } else {
                    met.push(estimates.values.len());
                    batch.rays.push(*ray);
                    batch.hits.push(*hit);
                    if let Some(footprint) = footprint {
                        let width = footprint.cone(ray).at(hit.t);
                        let Frame { s, t, .. } = Frame::around(-ray.direction);
                        batch.steps.push([s * width, t * width]);
                    } else if scene.has_mipmaps() {
                        batch.steps.push([Vec3::ZERO; 2]);
                    }
                    (C::Sample::zero(), 1.0)
                };
                estimates.values.push(Estimate { radiance, alpha });
            }
            let mut blocked = |ray: &Ray| {
                cost.occluded(scene, &[*ray], &mut answer);
                answer[0]
            };
            shader.shade(&batch, Some(&mut blocked), &mut colors);
            for (slot, color) in met.iter().zip(&colors) {
                estimates.values[*slot].radiance = *color;
            }
        }
    }
}
