//! What of a glTF material is seen: its factors, or its base colour alone. The rest is told once a file.

use std::collections::BTreeSet;

use glam::{Mat2, Vec2};
use serde_json::Value;

use super::json::{Material, TextureInfo, TextureTransform};
use super::{GltfSurface, Look};

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

    /// What its factors say. Where a texture has most of the say the factor alone would be no likeness: then it is no
    /// metal, and does not shine.
    pub(super) fn surface(&self) -> GltfSurface {
        let pbr = &self.pbr_metallic_roughness;
        let (metallic, roughness) = if self.extensions.contains_key(SPECULAR_GLOSSINESS) {
            let glossiness = self.extended(SPECULAR_GLOSSINESS, "glossinessFactor");
            (0.0, 1.0 - glossiness.unwrap_or(1.0))
        } else {
            let metallic = match pbr.metallic_roughness_texture {
                Some(_) => 0.0,
                None => pbr.metallic_factor.unwrap_or(1.0),
            };
            (metallic, pbr.roughness_factor.unwrap_or(1.0))
        };
        let strength = self.extended(EMISSIVE_STRENGTH, "emissiveStrength");
        let strength = match self.emissive_texture {
            Some(_) => 0.0,
            None => strength.unwrap_or(1.0),
        };
        let [.., alpha] = self.base_color();
        let opacity = match self.alpha_mode.as_deref() {
            Some("BLEND") => alpha,
            Some("MASK") if alpha < self.alpha_cutoff.unwrap_or(0.5) => 0.0,
            _ => 1.0,
        };
        let opacity = opacity.clamp(0.0, 1.0);
        GltfSurface {
            roughness: roughness.clamp(0.0, 1.0),
            metallic: metallic.clamp(0.0, 1.0),
            emission: (self.emissive_factor)
                .map(|part| (part * strength * opacity).clamp(0.0, f32::MAX)),
            opacity,
        }
    }

    /// Whether its base colour is more than what a texture is multiplied by.
    pub(super) fn has_color(&self) -> bool {
        self.pbr_metallic_roughness.base_color_texture.is_none()
    }

    /// Notes what is not shown of it.
    pub(super) fn note_unseen(&self, look: Look, unseen: &mut BTreeSet<String>) {
        let pbr = &self.pbr_metallic_roughness;
        let glossy = self.extensions.get(SPECULAR_GLOSSINESS);
        let textured = pbr.base_color_texture.is_some()
            || pbr.metallic_roughness_texture.is_some()
            || self.normal_texture.is_some()
            || self.occlusion_texture.is_some()
            || self.emissive_texture.is_some()
            || glossy.is_some_and(|g| g.get("diffuseTexture").is_some());
        let opaque = matches!(self.alpha_mode.as_deref(), None | Some("OPAQUE"));
        let color_alone = look == Look::Color;
        for (there, what) in [
            (textured, "textures"),
            (color_alone && self.emissive_factor != [0.0; 3], "emission"),
            (
                !opaque && (color_alone || !self.has_color()),
                "transparency",
            ),
        ] {
            if there {
                unseen.insert(what.to_owned());
            }
        }
        let names = self.extensions.keys();
        let names = names.filter(|name| color_alone || *name != EMISSIVE_STRENGTH);
        unseen.extend(names.cloned());
    }
}

/// How the texture coordinates of the base colour come to be: those of other textures may be others, but a mesh has
/// only one set.
pub(super) struct Coordinates {
    /// Which of the primitive's sets.
    pub(super) set: u32,
    matrix: Mat2,
    offset: Vec2,
}

impl Coordinates {
    pub(super) fn of(material: Option<&Material>) -> Self {
        let texture = material.and_then(|m| m.pbr_metallic_roughness.base_color_texture.as_ref());
        let Some(TextureInfo {
            tex_coord,
            extensions,
        }) = texture
        else {
            return Self {
                set: 0,
                matrix: Mat2::IDENTITY,
                offset: Vec2::ZERO,
            };
        };
        let default = TextureTransform::default();
        let transform = extensions.transform.as_ref().unwrap_or(&default);
        // Counter-clockwise where v points down, as all viewers have it (and not as the extension's listing says).
        let turn = Mat2::from_angle(-transform.rotation);
        let scale = Vec2::from(transform.scale.unwrap_or([1.0; 2]));
        Self {
            set: transform.tex_coord.unwrap_or(*tex_coord),
            matrix: turn * Mat2::from_diagonal(scale),
            offset: transform.offset.into(),
        }
    }

    pub(super) fn apply(&self, uv: [f32; 2]) -> Vec2 {
        self.matrix * Vec2::from(uv) + self.offset
    }
}
