//! Microfacet distributions: how the normals of a rough surface's facets spread, for models that
//! reflect or refract at them (Walter et al., *Microfacet models for refraction through rough surfaces*,
//! 2007). Beckmann's is that of a Gaussian height field, GGX has longer tails; both may be stretched
//! along the tangents. Facets are drawn as they are seen from `wi` (Heitz and d'Eon, *Importance sampling
//! microfacet-based BSDFs using the distribution of visible normals*, 2014; GGX by Heitz, *A simpler and
//! exact sampling routine*, 2017; Beckmann by Jakob, *An improved visible normal sampling routine*, 2014)
//! or by their area alone.

use std::f32::consts::{FRAC_1_PI, PI};

use crate::color::Mono;
use crate::description::Properties;
use crate::description::declared::{Row, boolean, choice, number};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3, erf, erf_inverse, exp, ln, sin_cos_turns, warp};
use crate::texture::{Palette, Texture};

/// Which distribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// Of a Gaussian height field.
    Beckmann,
    /// Trowbridge and Reitz's, long-tailed.
    Ggx,
}

/// Which facets there are.
pub(super) const KIND: &[Row] = &[
    choice(
        "distribution",
        &["beckmann", "ggx"],
        "of the facets' normals; ggx has longer tails",
    ),
    boolean(
        "sample_visible",
        true,
        "whether facets are drawn as they are seen",
    ),
];

/// The same with a roughness that may be stretched.
pub(super) const STRETCHED: &[Row] = &[
    KIND[0],
    KIND[1],
    number(
        "alpha",
        DEFAULT_ALPHA,
        "roughness, at least 0.0001; not beside alpha_u and alpha_v",
    ),
    number("alpha_u", DEFAULT_ALPHA, "roughness along the tangent").absent("alpha"),
    number("alpha_v", DEFAULT_ALPHA, "roughness across it").absent("alpha"),
];

/// Which distribution, and how it is drawn from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub(super) shape: Shape,
    pub(super) sample_visible: bool,
}

impl Kind {
    pub(super) fn build(properties: &Properties<'_>) -> Result<Self> {
        let shape = match properties.choice("distribution")? {
            "ggx" => Shape::Ggx,
            _ => Shape::Beckmann,
        };
        Ok(Self {
            shape,
            sample_visible: properties.boolean("sample_visible")?,
        })
    }
}

/// A distribution whose roughness varies over the surface: `alpha` (0.1), or `alpha_u` and `alpha_v`.
#[derive(Clone, Debug)]
pub(super) struct Roughness {
    kind: Kind,
    alpha_u: Texture<Mono>,
    /// The same as `alpha_u` where absent.
    alpha_v: Option<Texture<Mono>>,
}

impl Roughness {
    pub(super) fn build(properties: &Properties<'_>, numbers: &Palette<Mono>) -> Result<Self> {
        let kind = Kind::build(properties)?;
        let stretched = properties.has("alpha_u") || properties.has("alpha_v");
        if stretched && properties.has("alpha") {
            return Err(properties.error("alpha", "give either alpha, or alpha_u and alpha_v"));
        }
        if stretched && !(properties.has("alpha_u") && properties.has("alpha_v")) {
            return Err(properties.error("", "alpha_u and alpha_v come together"));
        }
        let name = if stretched { "alpha_u" } else { "alpha" };
        let alpha_u = numbers.number(properties, name)?;
        let alpha_v = stretched
            .then(|| numbers.number(properties, "alpha_v"))
            .transpose()?;
        Ok(Self {
            kind,
            alpha_u,
            alpha_v,
        })
    }

    /// The distribution at points.
    #[inline(always)]
    pub(super) fn at_lanes<F: Lanes>(&self, at: &Points<'_, F>) -> Distribution<F> {
        let u = self.alpha_u.numbers(at);
        let v = match &self.alpha_v {
            Some(v) => v.numbers(at),
            None => u,
        };
        Distribution::new(self.kind, u, v)
    }
}

/// Roughness where a scene gives none.
pub(super) const DEFAULT_ALPHA: f64 = 0.1;

/// The distribution at points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Distribution<F> {
    kind: Kind,
    alpha: Vec2<F>,
}

impl<F: Lanes> Distribution<F> {
    /// Roughness along the tangents, at least 10⁻⁴ each.
    #[inline(always)]
    pub(super) fn new(kind: Kind, alpha_u: F, alpha_v: F) -> Self {
        let least = F::splat(1e-4);
        Self {
            kind,
            alpha: Vec2::new(alpha_u.max(least), alpha_v.max(least)),
        }
    }

    /// The same with its roughness multiplied.
    #[must_use]
    #[inline(always)]
    pub(super) fn scaled(self, factor: F) -> Self {
        Self {
            alpha: self.alpha * factor,
            ..self
        }
    }

    /// Whether facets are drawn as they are seen.
    pub(super) fn samples_visible(&self) -> bool {
        self.kind.sample_visible
    }

    /// D(m): facet area per solid angle of normals and unit of surface.
    #[inline(always)]
    pub(super) fn eval(&self, m: Vec3<F>) -> F {
        let (x, y) = (m.x / self.alpha.x, m.y / self.alpha.y);
        let slope2 = x * x + y * y;
        let scale = F::splat(FRAC_1_PI) / (self.alpha.x * self.alpha.y);
        let cos2 = m.z * m.z;
        let d = match self.kind.shape {
            Shape::Beckmann => scale * exp(-slope2 / cos2) / (cos2 * cos2),
            Shape::Ggx => scale / (slope2 + cos2).squared(),
        };
        // Also false for what is no number: facets on edge, of which there are none.
        F::select(F::splat(1e-20).lt(d * m.z), d, F::zero())
    }

    /// Smith's masking: the share of facets with normal `m` that `v` sees.
    #[inline(always)]
    pub(super) fn g1(&self, v: Vec3<F>, m: Vec3<F>) -> F {
        let (zero, one) = (F::zero(), F::one());
        let xy2 = v.xy().times(self.alpha).length_squared();
        let tan2 = xy2 / (v.z * v.z);
        let share = match self.kind.shape {
            Shape::Beckmann => {
                let a = one / tan2.sqrt();
                // Walter's rational fit, within 0.35 %.
                let fit = (F::splat(3.535) * a + F::splat(2.181) * a * a)
                    / (one + F::splat(2.276) * a + F::splat(2.577) * a * a);
                F::select(F::splat(1.6).le(a), one, fit)
            }
            Shape::Ggx => F::splat(2.0) / (one + (one + tan2).sqrt()),
        };
        let share = F::select(xy2.eq(zero), one, share);
        // The back of a facet is not seen from the front.
        F::select(zero.lt(v.dot(m) * v.z), share, zero)
    }

    /// The share of facets seen from both.
    #[inline(always)]
    pub(super) fn g(&self, wi: Vec3<F>, wo: Vec3<F>, m: Vec3<F>) -> F {
        self.g1(wi, m) * self.g1(wo, m)
    }

    /// The density of [`Self::sample`]; `wi` is on the front side.
    #[inline(always)]
    pub(super) fn pdf(&self, wi: Vec3<F>, m: Vec3<F>) -> F {
        let d = self.eval(m);
        if self.kind.sample_visible {
            d * self.g1(wi, m) * wi.dot(m).abs() / wi.z
        } else {
            d * m.z
        }
    }

    /// Draws the normal, on the front side, of a facet for `wi`, which is there too.
    #[inline(always)]
    pub(super) fn sample(&self, wi: Vec3<F>, u: Vec2<F>) -> Vec3<F> {
        if self.kind.sample_visible {
            self.visible(wi, u)
        } else {
            self.any(u)
        }
    }

    /// A facet by its area projected on the surface.
    #[inline(always)]
    fn any(&self, u: Vec2<F>) -> Vec3<F> {
        // tan² θ for roughness 1, then stretched.
        let rest = F::one() - u.x;
        let tan2 = match self.kind.shape {
            Shape::Beckmann => -ln(rest),
            Shape::Ggx => u.x / rest,
        };
        let (sin, cos) = sin_cos_turns(u.y);
        let slope = self.alpha.times(Vec2::new(cos, sin)) * tan2.max(F::zero()).sqrt();
        slope.extend(F::one()).normalize()
    }

    /// A facet by its area projected on `wi`: stretched so that the roughness is 1, drawn there, and
    /// stretched back.
    #[inline(always)]
    fn visible(&self, wi: Vec3<F>, u: Vec2<F>) -> Vec3<F> {
        let stretched = wi.xy().times(self.alpha).extend(wi.z).normalize();
        let sin2 = stretched.xy().length_squared();
        let told = F::splat(1e-14).lt(sin2);
        let turn = stretched.xy() / sin2.sqrt();
        let turn = Vec2::select(told, turn, Vec2::new(F::one(), F::zero()));
        let slope = match self.kind.shape {
            Shape::Beckmann => beckmann_slope(stretched.z, u),
            Shape::Ggx => ggx_slope(stretched.z, u),
        };
        let x = turn.x * slope.x - turn.y * slope.y;
        let y = turn.y * slope.x + turn.x * slope.y;
        Vec3::new(-(x * self.alpha.x), -(y * self.alpha.y), F::one()).normalize()
    }
}

impl Distribution<f32> {
    /// The same in all lanes.
    #[inline(always)]
    pub(super) fn all<F: Lanes>(&self) -> Distribution<F> {
        Distribution {
            kind: self.kind,
            alpha: Vec2::all(self.alpha.into()),
        }
    }
}

/// A slope seen at the angle with that cosine in the plane x = 0, of Beckmann's distribution with
/// roughness 1: the inverse of the cumulative distribution, in the domain of erf, by Newton's method.
#[inline(always)]
fn beckmann_slope<F: Lanes>(cos: F, u: Vec2<F>) -> Vec2<F> {
    let one = F::one();
    let tan = (one - cos * cos).max(F::zero()).sqrt() / cos;
    let cot = one / tan;
    let limit = erf(cot);
    let (ux, uy) = (u.x.clamp(1e-6, 1.0 - 1e-6), u.y.clamp(1e-6, 1.0 - 1e-6));
    // Exact at grazing incidence, where the function is least linear.
    let mut x = limit - (limit + one) * erf((-ln(ux)).sqrt());
    let root = F::splat(1.0 / PI.sqrt()) * tan;
    let target = ux * (one + limit + root * exp(-cot * cot));
    for _ in 0..3 {
        let slope = erf_inverse(x);
        let value = one + x + root * exp(-slope * slope) - target;
        x = x - value / (one - slope * tan);
    }
    Vec2::new(erf_inverse(x), erf_inverse(uy + uy - one))
}

/// The same of GGX: a point on the facets' hemisphere, projected along the view on a disc.
#[inline(always)]
fn ggx_slope<F: Lanes>(cos: F, u: Vec2<F>) -> Vec2<F> {
    let (zero, one) = (F::zero(), F::one());
    let p = warp::concentric_disk(u);
    let s = F::splat(0.5) * (one + cos);
    let edge = (one - p.x * p.x).max(zero).sqrt();
    let y = edge + (p.y - edge) * s;
    let z = (one - p.x * p.x - y * y).max(zero).sqrt();
    let sin = (one - cos * cos).max(zero).sqrt();
    Vec2::new(cos * y - sin * z, p.x) / (sin * y + cos * z)
}

/// Two directions and the facet that would take light from one to the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interface<F: Lanes> {
    /// Where a facet that is seen from both does it; the other lanes hold anything.
    pub(super) found: F::Mask,
    /// Its normal, on the front side.
    pub(super) m: Vec3<F>,
    /// Where both directions are on the same side.
    pub(super) reflection: F::Mask,
    /// Index of refraction on the side of `wo` over that on the side of `wi`.
    pub(super) eta: F,
    /// Solid angle of normals for each of `wo`.
    pub(super) jacobian: F,
}

impl<F: Lanes> Interface<F> {
    /// Of a boundary whose index is `eta` inside over outside.
    #[inline(always)]
    pub(super) fn between(wi: Vec3<F>, wo: Vec3<F>, eta: f32) -> Self {
        Self::between_either_way(wi, wo, F::splat(eta), F::splat(1.0 / eta))
    }

    /// The same where the index varies.
    #[inline(always)]
    pub(super) fn between_lanes(wi: Vec3<F>, wo: Vec3<F>, eta: F) -> Self {
        Self::between_either_way(wi, wo, eta, F::one() / eta)
    }

    /// The same with the index for light from outside and from inside.
    #[inline(always)]
    fn between_either_way(wi: Vec3<F>, wo: Vec3<F>, inward: F, outward: F) -> Self {
        let (zero, one) = (F::zero(), F::one());
        let reflection = zero.lt(wi.z * wo.z);
        let relative = F::select(zero.lt(wi.z), inward, outward);
        let eta = F::select(reflection, one, relative);
        let half = (wi + wo * eta).normalize_or_zero();
        let m = Vec3::select(half.z.lt(zero), -half, half);
        let (cos_i, cos_o) = (wi.dot(m), wo.dot(m));
        let seen = zero.lt(cos_i * wi.z) & zero.lt(cos_o * wo.z);
        let reflected = F::splat(0.25) / cos_o.abs();
        let refracted = eta * eta * cos_o.abs() / (cos_i + eta * cos_o).squared();
        let jacobian = F::select(reflection, reflected, refracted);
        Self {
            found: seen & jacobian.is_finite(),
            m,
            reflection,
            eta,
            jacobian,
        }
    }
}

/// `v` turned over where it is behind the surface.
#[inline(always)]
pub(super) fn in_front<F: Lanes>(v: Vec3<F>) -> Vec3<F> {
    v * F::one().copysign(v.z)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use glam::{Vec2, Vec3};

    use super::*;

    fn distributions() -> impl Iterator<Item = Distribution<f32>> {
        [Shape::Beckmann, Shape::Ggx].into_iter().flat_map(|shape| {
            [(0.1, 0.1), (0.5, 0.2), (1.0, 1.0)]
                .into_iter()
                .flat_map(move |(u, v)| {
                    [true, false].map(|sample_visible| {
                        let kind = Kind {
                            shape,
                            sample_visible,
                        };
                        Distribution::new(kind, u, v)
                    })
                })
        })
    }

    /// The integral of `f` over the normals of the front, by a fine grid in cos θ and φ.
    fn integral(f: impl Fn(Vec3) -> f32) -> f64 {
        let n = 1000;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                // Denser near the pole, where smooth surfaces have their facets.
                let x = (i as f32 + 0.5) / n as f32;
                let cos = 1.0 - x * x;
                let sin = (1.0 - cos * cos).sqrt();
                let (s, c) = (TAU * (j as f32 + 0.5) / n as f32).sin_cos();
                sum += f64::from(f(Vec3::new(sin * c, sin * s, cos)) * 2.0 * x);
            }
        }
        sum * std::f64::consts::TAU / f64::from(n * n)
    }

    #[test]
    fn facets_cover_the_surface_and_densities_integrate_to_one() {
        let wi = Vec3::new(0.6, -0.36, 0.714_142_84);
        for d in distributions() {
            let area = integral(|m| d.eval(m.into()) * m.z);
            assert!((area - 1.0).abs() < 2e-3, "{d:?}: {area}");
            let pdf = integral(|m| d.pdf(wi.into(), m.into()));
            // Beckmann's masking is a fit.
            assert!((pdf - 1.0).abs() < 5e-3, "{d:?}: {pdf}");
            let seen =
                integral(|m| d.eval(m.into()) * d.g1(wi.into(), m.into()) * wi.dot(m).max(0.0));
            assert!((seen / f64::from(wi.z) - 1.0).abs() < 5e-3, "{d:?}: {seen}");
        }
    }

    #[test]
    fn drawn_facets_have_the_slopes_of_their_density() {
        let wi = Vec3::new(0.6, -0.36, 0.714_142_84);
        for d in distributions() {
            // cos θ, for slopes of long-tailed distributions have no finite variance.
            for f in [|m: Vec3| m.z, |m: Vec3| m.x, |m: Vec3| m.y * m.y] {
                let expected = integral(|m| f(m) * d.pdf(wi.into(), m.into()));
                let n = 300;
                let mut mean = 0.0;
                for i in 0..n * n {
                    let u = Vec2::new((i / n) as f32 + 0.5, (i % n) as f32 + 0.5) / n as f32;
                    let m = Vec3::from(d.sample(wi.into(), u.into()));
                    assert!(m.is_normalized() && m.z > 0.0);
                    mean += f64::from(f(m)) / f64::from(n * n);
                }
                assert!((mean - expected).abs() < 4e-3, "{d:?}: {mean} {expected}");
            }
        }
    }
}
