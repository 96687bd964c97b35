//! What `principled` and `principledthin` share: Disney's parameters and the lobes made of them (Burley,
//! *Physically based shading at Disney*, 2012, and *Extending the Disney BRDF to a BSDF with integrated
//! subsurface scattering*, 2015), in the form of Mitsuba 3.

use std::f32::consts::{FRAC_1_PI, PI};

use super::microfacet::{Distribution, Kind, Shape};
use crate::color::{ColorModel, Mono, Role, Spectra};
use crate::description::declared::{Row, float, number as number_row, texture};
use crate::description::{Properties, Property, Value};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3, ln, pow, sin_cos_turns};
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

    /// The parameters at points.
    #[inline(always)]
    pub(super) fn at<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        w: &[C::Wavelengths],
    ) -> Point<F, C::Columns<F>> {
        let base_color = self.base_color.eval_lanes(at, w);
        let luminance = self.color.luminance_lanes(base_color, w);
        Point {
            base_color,
            tint: C::Columns::<F>::select(
                F::zero().lt(luminance),
                base_color * (F::one() / luminance),
                C::Columns::<F>::splat(F::one()),
            ),
            roughness: self.roughness.numbers(at),
            anisotropic: self.anisotropic.numbers(at),
            spec_trans: self.spec_trans.numbers(at),
            spec_tint: self.spec_tint.numbers(at),
            sheen: self.sheen.numbers(at),
            sheen_tint: self.sheen_tint.numbers(at),
            flatness: self.flatness.numbers(at),
        }
    }
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

/// The parameters at points of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<F, S> {
    /// What the surface's colour is.
    pub(super) base_color: S,
    /// The base colour's hue: scaled to luminance 1.
    pub(super) tint: S,
    roughness: F,
    anisotropic: F,
    /// How much is glass.
    pub(super) spec_trans: F,
    /// How far highlights take on the colour.
    pub(super) spec_tint: F,
    sheen: F,
    sheen_tint: F,
    flatness: F,
}

impl<F: Lanes, S: Spectra<F>> Point<F, S> {
    /// The facets of the main specular lobes, with the roughness times `factor`.
    #[inline(always)]
    pub(super) fn distribution(&self, factor: F) -> Distribution<F> {
        const KIND: Kind = Kind {
            shape: Shape::Ggx,
            sample_visible: true,
        };
        let least = F::splat(1e-3);
        let alpha = (self.roughness * factor).squared();
        let aspect = (F::one() - F::splat(0.9) * self.anisotropic).sqrt();
        Distribution::new(
            KIND,
            (alpha / aspect).max(least),
            (alpha * aspect).max(least),
        )
    }

    /// f of the diffuse lobe with its retro-reflection, flattened toward subsurface scattering; cosines
    /// of incidence, of exitance and between exitance and the half vector.
    #[inline(always)]
    pub(super) fn diffuse(&self, cos_i: F, cos_o: F, cos_d: F) -> S {
        let (half, one) = (F::splat(0.5), F::one());
        let (f_i, f_o) = (schlick_weight(cos_i), schlick_weight(cos_o));
        let retro = F::splat(2.0) * self.roughness * cos_d * cos_d;
        let rough = (one - half * f_i) * (one - half * f_o)
            + retro * (f_o + f_i + f_o * f_i * (retro - one));
        let grazing = half * retro;
        let flat = lerp(one, grazing, f_o) * lerp(one, grazing, f_i);
        let flat = F::splat(1.25) * (flat * (one / (cos_o + cos_i) - half) + half);
        self.base_color * (F::splat(FRAC_1_PI) * lerp(rough, flat, self.flatness))
    }

    /// f of the sheen of cloth at grazing angles.
    #[inline(always)]
    pub(super) fn sheen(&self, cos_d: F) -> S {
        let strength = self.sheen * schlick_weight(cos_d.abs());
        let mut sheen = self.tint;
        for c in 0..S::CHANNELS {
            sheen.set(c, strength * lerp(F::one(), sheen[c], self.sheen_tint));
        }
        sheen
    }
}

/// `a` at 0, `b` at 1.
#[inline(always)]
pub(super) fn lerp<F: Lanes>(a: F, b: F, t: F) -> F {
    a * (F::one() - t) + b * t
}

/// (1 − cos θ)⁵.
#[inline(always)]
fn schlick_weight<F: Lanes>(cos: F) -> F {
    let x = (F::one() - cos).clamp(0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}

/// Schlick's approximation of Fresnel's reflectance from outside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Schlick<F> {
    weight: F,
}

impl<F: Lanes> Schlick<F> {
    /// At the cosine `cos`.
    #[inline(always)]
    pub(super) fn new(cos: F, eta: F) -> Self {
        let one = F::one();
        let cos2_t = one - (one - cos * cos) / (eta * eta);
        let inside = cos2_t.max(F::zero()).sqrt();
        Self {
            weight: schlick_weight(F::select(one.lt(eta), cos.abs(), inside)),
        }
    }

    /// Where `r0` is reflected at normal incidence.
    #[inline(always)]
    pub(super) fn reflectance(self, r0: F) -> F {
        lerp(self.weight, F::one(), r0)
    }
}

/// Fresnel's reflectance at normal incidence.
#[inline(always)]
pub(super) fn normal_reflectance<F: Lanes>(eta: F) -> F {
    ((eta - F::one()) / (eta + F::one())).squared()
}

/// The clear coat's facets: Burley's GTR with γ = 1, long-tailed, of roughness 0.1 (gloss 0) to 0.001.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat<F> {
    alpha2: F,
}

impl<F: Lanes> Coat<F> {
    /// Of a gloss in [0, 1].
    #[inline(always)]
    pub(super) fn new(gloss: F) -> Self {
        Self {
            alpha2: lerp(F::splat(0.1), F::splat(0.001), gloss).squared(),
        }
    }

    /// D(m).
    #[inline(always)]
    pub(super) fn eval(&self, m: Vec3<F>) -> F {
        let a = self.alpha2 - F::one();
        let log = ln(self.alpha2.max(F::splat(f32::MIN_POSITIVE)));
        let d = a / (F::splat(PI) * log * (F::one() + a * m.z * m.z));
        F::select(F::splat(1e-20).lt(d * m.z), d, F::zero())
    }

    /// Masking and shadowing, with a roughness of ¼ whatever the gloss.
    #[inline(always)]
    pub(super) fn g(&self, wi: Vec3<F>, wo: Vec3<F>) -> F {
        Self::g1(wi) * Self::g1(wo)
    }

    /// The share of facets that `v` sees.
    #[inline(always)]
    fn g1(v: Vec3<F>) -> F {
        let (one, cos2) = (F::one(), v.z * v.z);
        let tan2 = (one - cos2).max(F::zero()) / cos2;
        F::splat(2.0) / (one + (one + F::splat(0.0625) * tan2).sqrt())
    }

    /// The density of [`Self::sample`].
    #[inline(always)]
    pub(super) fn pdf(&self, m: Vec3<F>) -> F {
        self.eval(m) * m.z
    }

    /// Draws a facet's normal by its area projected on the surface.
    #[inline(always)]
    pub(super) fn sample(&self, u: Vec2<F>) -> Vec3<F> {
        let (zero, one) = (F::zero(), F::one());
        let cos2 = (one - pow(self.alpha2, one - u.y)) / (one - self.alpha2);
        let sin = (one - cos2).max(zero).sqrt();
        let (s, c) = sin_cos_turns(u.x);
        Vec3::new(c * sin, s * sin, cos2.max(zero).sqrt())
    }
}
