//! What of a glTF material is seen: its factors and textures, or its base colour alone. The rest is told once a file.

use std::collections::BTreeSet;

use glam::{Mat2, Vec2};
use serde_json::Value;

use super::image::Textures;
use super::json::{Material, TextureInfo};
use super::{Look, OrWhy};
use crate::mesh::surface::{Maps, Surface};

/// An archived extension, whose diffuse colour is the base colour.
const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
const EMISSIVE_STRENGTH: &str = "KHR_materials_emissive_strength";

impl Material {
    /// Linear red, green, blue, and alpha.
    pub(super) fn base_color(&self) -> [f32; 4] {
        let own = self.pbr_metallic_roughness.base_color_factor;
        let diffuse = || {
            let factor = &self.extensions.get(SPECULAR_GLOSSINESS)?["diffuseFactor"];
            let numbers = factor.as_array()?.iter().map(Value::as_f64);
            let numbers: Vec<f32> = numbers.flatten().map(|number| number as f32).collect();
            <[f32; 4]>::try_from(numbers).ok()
        };
        own.or_else(diffuse).unwrap_or([1.0; 4])
    }

    /// A number of one of its extensions.
    fn extended(&self, extension: &str, name: &str) -> Option<f32> {
        Some(self.extensions.get(extension)?[name].as_f64()? as f32)
    }

    /// What its factors and textures say. Where a texture that is not shown has most of the say, the factor alone would be
    /// no likeness: then it is no metal, and does not shine. What light reaches a place is not looked up, but rendered.
    pub(super) fn surface(
        &self,
        textures: &Textures<'_>,
        unseen: &mut BTreeSet<String>,
    ) -> OrWhy<Surface> {
        let mut look = |info: &Option<TextureInfo>, directions| match info {
            Some(info) => textures.map(info, directions, unseen),
            None => Ok(None),
        };
        let normal = look(&self.normal_texture, true)?;
        let mut map = |info: &Option<TextureInfo>| look(info, false);
        let pbr = &self.pbr_metallic_roughness;
        let parts = map(&pbr.metallic_roughness_texture)?;
        let is_missing = parts.is_none() && pbr.metallic_roughness_texture.is_some();
        let (metallic, roughness) = if self.extensions.contains_key(SPECULAR_GLOSSINESS) {
            let glossiness = self.extended(SPECULAR_GLOSSINESS, "glossinessFactor");
            (0.0, 1.0 - glossiness.unwrap_or(1.0))
        } else {
            let metallic = match is_missing {
                true => 0.0,
                false => pbr.metallic_factor.unwrap_or(1.0),
            };
            (metallic, pbr.roughness_factor.unwrap_or(1.0))
        };
        let color = map(&self.color_texture())?;
        let emission = map(&self.emissive_texture)?;
        let strength = match self.emissive_texture.is_some() && emission.is_none() {
            true => 0.0,
            false => (self.extended(EMISSIVE_STRENGTH, "emissiveStrength")).unwrap_or(1.0),
        };
        let [.., alpha] = self.base_color();
        let alpha = alpha.clamp(0.0, 1.0);
        let varies = color.as_ref().filter(|_| alpha > 0.0);
        let (opacity, cutoff, varies) = match self.alpha_mode.as_deref() {
            Some("BLEND") => (alpha, None, varies),
            Some("MASK") => match (self.alpha_cutoff.unwrap_or(0.5), varies) {
                // Above 1 nothing is left.
                (cutoff, Some(map)) => (1.0, Some((cutoff / alpha).min(2.0)), Some(map)),
                (cutoff, None) if alpha < cutoff => (0.0, None, None),
                _ => (1.0, None, None),
            },
            _ => (1.0, None, None),
        };
        Ok(Surface {
            roughness: roughness.clamp(0.0, 1.0),
            metallic: metallic.clamp(0.0, 1.0),
            emission: (self.emissive_factor)
                .map(|part| (part * strength * opacity).clamp(0.0, f32::MAX)),
            opacity,
            cutoff,
            maps: Maps {
                opacity: varies.map(|map| map.by("a")),
                roughness: parts.as_ref().map(|map| map.by("g")),
                metallic: parts.as_ref().map(|map| map.by("b")),
                normal,
                normal_scale: (self.normal_texture.as_ref())
                    .and_then(|info| info.scale)
                    .filter(|scale| scale.is_finite())
                    .unwrap_or(1.0),
                color,
                emission,
            },
        })
    }

    /// That of its base colour.
    fn color_texture(&self) -> Option<TextureInfo> {
        let own = self.pbr_metallic_roughness.base_color_texture.clone();
        own.or_else(|| {
            let diffuse = self
                .extensions
                .get(SPECULAR_GLOSSINESS)?
                .get("diffuseTexture")?;
            serde_json::from_value(diffuse.clone()).ok()
        })
    }

    /// The texture whose texture coordinates the mesh has: those of others may be others.
    fn first_texture(&self) -> Option<TextureInfo> {
        let others = [
            &self.pbr_metallic_roughness.metallic_roughness_texture,
            &self.normal_texture,
            &self.emissive_texture,
        ];
        let other = || others.into_iter().flatten().next().cloned();
        self.color_texture().or_else(other)
    }

    /// Whether it may be seen through.
    pub(super) fn has_alpha(&self) -> bool {
        !matches!(self.alpha_mode.as_deref(), None | Some("OPAQUE"))
    }

    /// Whether its base colour is more than what a texture is multiplied by.
    pub(super) fn has_color(&self) -> bool {
        self.color_texture().is_none()
    }

    /// Notes what is not shown of it, whatever its textures.
    pub(super) fn note_unseen(&self, look: Look, unseen: &mut BTreeSet<String>) {
        let color_alone = look == Look::Color;
        let textured = self.first_texture().is_some() || self.occlusion_texture.is_some();
        for (there, what) in [
            (textured, "textures"),
            (self.emissive_factor != [0.0; 3], "emission"),
            (self.has_alpha(), "transparency"),
        ] {
            if there && color_alone {
                unseen.insert(what.to_owned());
            }
        }
        let names = self.extensions.keys();
        let names = names.filter(|name| color_alone || *name != EMISSIVE_STRENGTH);
        unseen.extend(names.cloned());
    }
}

/// How a mesh's texture coordinates come to be, of which it has only one set: those of the base colour, or of the first
/// texture.
pub(super) struct Coordinates {
    /// Which of the primitive's sets.
    pub(super) set: u32,
    matrix: Mat2,
    offset: Vec2,
}

impl Coordinates {
    /// As the base colour has them; where all of the material is looked up, as they are.
    pub(super) fn of(material: Option<&Material>, look: Look) -> Self {
        let texture = material.and_then(Material::first_texture);
        let (matrix, offset) = match (&texture, look) {
            (Some(texture), Look::Color) => texture.transform(),
            _ => (Mat2::IDENTITY, Vec2::ZERO),
        };
        Self {
            set: texture.map_or(0, |texture| texture.set()),
            matrix,
            offset,
        }
    }

    pub(super) fn apply(&self, uv: [f32; 2]) -> Vec2 {
        self.matrix * Vec2::from(uv) + self.offset
    }
}
