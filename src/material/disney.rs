//! What `principled` and `principledthin` share: Disney's parameters and the lobes made of them (Burley,
//! *Physically based shading at Disney*, 2012, and *Extending the Disney BRDF to a BSDF with integrated
//! subsurface scattering*, 2015), in the form of Mitsuba 3.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Vec2, Vec3};

use super::microfacet::{Distribution, Kind, Shape};
use crate::color::{ColorModel, Mono, Role, Spectral};
use crate::description::declared::{Row, float, number as number_row, texture};
use crate::description::{Properties, Property, Value};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::{Palettes, Texture};

/// The parameters that both materials have.
#[derive(Clone, Debug)]
pub(super) struct Parameters<C: ColorModel> {
    color: C,
    base_color: Texture<C>,
    roughness: Texture<Mono>,
    anisotropic: Texture<Mono>,
    spec_trans: Texture<Mono>,
    spec_tint: Texture<Mono>,
    sheen: Texture<Mono>,
    sheen_tint: Texture<Mono>,
    flatness: Texture<Mono>,
}

/// What both materials read.
pub(super) const PROPERTIES: &[Row] = &[
    texture("base_color", 0.5, "the surface's colour"),
    number_row("roughness", 0.5, "from a mirror to matte"),
    number_row("anisotropic", 0.0, "how far highlights are stretched"),
    number_row("spec_trans", 0.0, "0 is opaque, 1 is glass"),
    number_row("spec_tint", 0.0, "how far highlights take on the colour"),
    number_row("sheen", 0.0, "light at flat angles, as of cloth"),
    number_row("sheen_tint", 0.0, "how far that takes on the colour"),
    number_row(
        "flatness",
        0.0,
        "blends with an approximation of subsurface scattering",
    ),
];

/// How often a lobe is sampled, beside the others.
pub(super) const fn sampling_rate(name: &'static str) -> Row {
    float(
        name,
        1.0,
        "how often this lobe is sampled, beside the others",
    )
    .positive()
}

impl<C: ColorModel> Parameters<C> {
    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let number = |name| palettes.numbers.number(properties, name);
        Ok(Self {
            color: palettes.colors.color.clone(),
            base_color: palettes
                .colors
                .texture(properties, "base_color", Role::Reflectance)?,
            roughness: number("roughness")?,
            anisotropic: number("anisotropic")?,
            spec_trans: number("spec_trans")?,
            spec_tint: number("spec_tint")?,
            sheen: number("sheen")?,
            sheen_tint: number("sheen_tint")?,
            flatness: number("flatness")?,
        })
    }

    pub(super) fn at(&self, at: &Interaction<'_>, w: &C::Wavelengths) -> Point<C::Sample> {
        let base_color = self.base_color.eval(at, w);
        let luminance = self.color.luminance(&base_color, w);
        Point {
            base_color,
            tint: if luminance > 0.0 {
                base_color / luminance
            } else {
                C::Sample::splat(1.0)
            },
            roughness: number(&self.roughness, at),
            anisotropic: number(&self.anisotropic, at),
            spec_trans: number(&self.spec_trans, at),
            spec_tint: number(&self.spec_tint, at),
            sheen: number(&self.sheen, at),
            sheen_tint: number(&self.sheen_tint, at),
            flatness: number(&self.flatness, at),
        }
    }
}

/// A texture's number.
pub(super) fn number(texture: &Texture<Mono>, at: &Interaction<'_>) -> f32 {
    texture.eval(at, &())[0]
}

/// Whether the scene gives the parameter and it is not simply 0.
pub(super) fn in_use(properties: &Properties<'_>, name: &'static str) -> bool {
    !matches!(
        properties.value(name),
        None | Some(Property {
            value: Value::Float(0.0) | Value::Integer(0),
            ..
        })
    )
}

/// A sampling rate.
pub(super) fn rate(properties: &Properties<'_>, name: &'static str) -> Result<f32> {
    Ok(properties.float(name)? as f32)
}

/// The parameters at a point of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<S> {
    pub(super) base_color: S,
    /// The base colour's hue: scaled to luminance 1.
    pub(super) tint: S,
    pub(super) roughness: f32,
    pub(super) anisotropic: f32,
    pub(super) spec_trans: f32,
    pub(super) spec_tint: f32,
    sheen: f32,
    sheen_tint: f32,
    flatness: f32,
}

impl<S: Spectral> Point<S> {
    /// The facets of the main specular lobes, with the roughness times `factor`.
    pub(super) fn distribution(&self, factor: f32) -> Distribution<f32> {
        const KIND: Kind = Kind {
            shape: Shape::Ggx,
            sample_visible: true,
        };
        let alpha = (self.roughness * factor).powi(2);
        let aspect = (1.0 - 0.9 * self.anisotropic).sqrt();
        Distribution::new(KIND, (alpha / aspect).max(1e-3), (alpha * aspect).max(1e-3))
    }

    /// f of the diffuse lobe with its retro-reflection, flattened toward subsurface scattering; cosines
    /// of incidence, of exitance and between exitance and the half vector.
    pub(super) fn diffuse(&self, cos_i: f32, cos_o: f32, cos_d: f32) -> S {
        let (f_i, f_o) = (schlick_weight(cos_i), schlick_weight(cos_o));
        let retro = 2.0 * self.roughness * cos_d * cos_d;
        let rough =
            (1.0 - 0.5 * f_i) * (1.0 - 0.5 * f_o) + retro * (f_o + f_i + f_o * f_i * (retro - 1.0));
        let grazing = 0.5 * retro;
        let flat = lerp(1.0, grazing, f_o) * lerp(1.0, grazing, f_i);
        let flat = 1.25 * (flat * (1.0 / (cos_o + cos_i) - 0.5) + 0.5);
        self.base_color * (FRAC_1_PI * lerp(rough, flat, self.flatness))
    }

    /// f of the sheen of cloth at grazing angles.
    pub(super) fn sheen(&self, cos_d: f32) -> S {
        let strength = self.sheen * schlick_weight(cos_d.abs());
        self.tint
            .map(|tint| strength * lerp(1.0, tint, self.sheen_tint))
    }
}

pub(super) fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// (1 − cos θ)⁵.
fn schlick_weight(cos: f32) -> f32 {
    (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

/// Schlick's approximation of Fresnel's reflectance from outside, `r0` at normal incidence.
pub(super) fn schlick(r0: f32, cos: f32, eta: f32) -> f32 {
    let weight = if eta > 1.0 {
        schlick_weight(cos.abs())
    } else {
        let cos2_t = 1.0 - (1.0 - cos * cos) / (eta * eta);
        schlick_weight(cos2_t.max(0.0).sqrt())
    };
    lerp(weight, 1.0, r0)
}

/// Fresnel's reflectance at normal incidence.
pub(super) fn normal_reflectance(eta: f32) -> f32 {
    ((eta - 1.0) / (eta + 1.0)).powi(2)
}

/// The clear coat's facets: Burley's GTR with γ = 1, long-tailed, of roughness 0.1 (gloss 0) to 0.001.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    alpha2: f32,
}

impl Coat {
    pub(super) fn new(gloss: f32) -> Self {
        Self {
            alpha2: lerp(0.1, 0.001, gloss).powi(2),
        }
    }

    /// D(m).
    pub(super) fn eval(&self, m: Vec3) -> f32 {
        let a = self.alpha2 - 1.0;
        let d = a / (PI * self.alpha2.ln() * (1.0 + a * m.z * m.z));
        if d * m.z > 1e-20 { d } else { 0.0 }
    }

    /// Masking and shadowing, with a roughness of ¼ whatever the gloss.
    pub(super) fn g(&self, wi: Vec3, wo: Vec3) -> f32 {
        let g1 = |v: Vec3| {
            let tan2 = (1.0 - v.z * v.z).max(0.0) / (v.z * v.z);
            2.0 / (1.0 + (1.0 + 0.0625 * tan2).sqrt())
        };
        g1(wi) * g1(wo)
    }

    /// The density of [`Self::sample`].
    pub(super) fn pdf(&self, m: Vec3) -> f32 {
        self.eval(m) * m.z
    }

    pub(super) fn sample(&self, u: Vec2) -> Vec3 {
        let cos2 = (1.0 - self.alpha2.powf(1.0 - u.y)) / (1.0 - self.alpha2);
        let sin = (1.0 - cos2).max(0.0).sqrt();
        let (s, c) = (TAU * u.x).sin_cos();
        Vec3::new(c * sin, s * sin, cos2.max(0.0).sqrt())
    }
}
