//! `hair`: a fibre of rough glass that absorbs (Chiang, Bitterli, Tappan and Burley, *A Practical and Controllable Hair
//! and Fur Model for Production Path Tracing*, 2016), whose shading frame has the fibre along y, as curves have it. One
//! event is all that happens within: f·|cos θ_o| = Σ_p A_p·M_p·N_p over light that is reflected (p = 0), passes (1), is
//! reflected once within (2) or more often, with the share A_p that is not absorbed, the longitudinal M_p of d'Eon et al.
//! (*An Energy-Conserving Hair Reflectance Model*, 2011) and a logistic N_p around the fibre. The absorption per radius
//! is `sigma_a`, times `scale`, or that of the pigments `eumelanin` and `pheomelanin`.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, fresnel, single_face};
use crate::color::{Color, ColorModel, Role, Spectra};
use crate::description::Properties;
use crate::description::declared::{Plugin, float, texture};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3, acos, atan2, exp, ln, ln_bessel_i0, sin_cos};
use crate::texture::{Palettes, Texture};

/// What d'Eon et al. (2011) give for a unit of each pigment, per radius, in linear BT.709.
const EUMELANIN: [f64; 3] = [0.419, 0.697, 1.37];
/// See [`EUMELANIN`].
const PHEOMELANIN: [f64; 3] = [0.187, 0.4, 1.05];
/// The ways that are told apart; the last stands for all longer ones.
const WAYS: usize = 4;
/// The least roughness: below it, single precision has no lobes any more.
const SMOOTHEST: f64 = 0.01;

/// Hair, fur or another fibre.
#[derive(Clone, Debug)]
pub struct Hair<C: ColorModel> {
    color: C,
    /// What adds up to the absorption per radius.
    absorbing: Vec<Texture<C>>,
    /// Factor on that.
    scale: f32,
    /// Index of refraction within over that outside.
    eta: f32,
    /// 1 over the longitudinal variance of each way.
    concentration: [f32; WAYS],
    /// Of the logistic distribution around the fibre.
    width: f32,
    /// Sine and cosine of how far the scales on the fibre turn each way's light, but for the last.
    tilt: [[f32; 2]; WAYS],
}

impl<C: ColorModel> Hair<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "hair or fur, on curves",
        properties: &[
            &[
                float("eumelanin", 1.3, "how much of the brown pigment").at_least(0.0),
                float("pheomelanin", 0.2, "how much of the red pigment").at_least(0.0),
                texture("sigma_a", 0.0, "absorption per radius; not beside pigments")
                    .absent("that of the pigments"),
                float("scale", 1.0, "factor on sigma_a").at_least(0.0),
                float("longitudinal_roughness", 0.3, "along the fibre").between(0.0, 1.0),
                float("azimuthal_roughness", 0.3, "around the fibre").between(0.0, 1.0),
                float(
                    "scale_tilt",
                    2.0,
                    "how the scales on a fibre stand off; degrees",
                ),
            ],
            &super::ior::dielectric("amber"),
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let eta = super::ior::relative(properties)?;
        if eta == 1.0 {
            let message =
                "the indices of refraction of a fibre and of what is around it must differ";
            return Err(properties.error("int_ior", message));
        }
        let given = properties.has("sigma_a");
        let pigment = ["eumelanin", "pheomelanin"]
            .into_iter()
            .find(|name| properties.has(name));
        if let (true, Some(pigment)) = (given, pigment) {
            let error = properties.error(pigment, format!("{pigment} cannot stand beside sigma_a"));
            return Err(error.help("give pigments or the absorption"));
        }
        let absorbing = if given {
            vec![(palettes.colors).texture(properties, "sigma_a", Role::Quantity)?]
        } else {
            let palette = palettes.colors.with_role(Role::Quantity);
            let pigment = |name, unit: [f64; 3]| {
                let amount = properties.float(name)?;
                let color = palette.uniform(&Color::Rgb(unit.map(|c| amount * c)));
                color.map_err(|message| properties.error(name, message))
            };
            vec![
                pigment("eumelanin", EUMELANIN)?,
                pigment("pheomelanin", PHEOMELANIN)?,
            ]
        };
        let along = properties.float("longitudinal_roughness")?.max(SMOOTHEST);
        let around = properties.float("azimuthal_roughness")?.max(SMOOTHEST);
        let variance = (0.726 * along + 0.812 * along.powi(2) + 3.7 * along.powi(20)).powi(2);
        let logistic = 0.265 * around + 1.194 * around.powi(2) + 5.372 * around.powi(22);
        let tilt = properties.float("scale_tilt")?.to_radians();
        let turn = |angle: f64| [angle.sin() as f32, angle.cos() as f32];
        Ok(Self {
            color: palettes.colors.color.clone(),
            absorbing,
            scale: if given {
                properties.float("scale")? as f32
            } else {
                1.0
            },
            eta,
            concentration: [1.0, 0.25, 4.0, 4.0].map(|factor| (1.0 / (factor * variance)) as f32),
            width: ((std::f64::consts::PI / 8.0).sqrt() * logistic) as f32,
            tilt: [turn(-2.0 * tilt), turn(tilt), turn(4.0 * tilt), turn(0.0)],
        })
    }

    /// What a path meets there.
    #[inline(always)]
    fn fibre<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> Fibre<F, C::Columns<F>> {
        let (zero, one) = (F::zero(), F::one());
        let sin = wi.y.clamp(-1.0, 1.0);
        let cos = (one - sin * sin).max(zero).sqrt();
        let across = (wi.x * wi.x + wi.z * wi.z).sqrt();
        // How far from the axis it comes in, in radii.
        let is_along = across.eq(zero);
        let h = F::select(is_along, zero, -wi.x / across).clamp(-1.0, 1.0);
        let cos_gamma_i = (one - h * h).max(zero).sqrt();
        let gamma_i = F::select(is_along, zero, acos(wi.z / across).copysign(h));
        let sin_t = sin * F::splat(1.0 / self.eta);
        let cos_t = (one - sin_t * sin_t).max(zero).sqrt();
        let eta2 = F::splat(self.eta * self.eta);
        let bent = (eta2 - sin * sin).max(zero).sqrt();
        let sin_gamma_t = F::select(zero.lt(bent), h * cos / bent, zero).clamp(-1.0, 1.0);
        let cos_gamma_t = (one - sin_gamma_t * sin_gamma_t).max(zero).sqrt();
        let length = F::splat(2.0) * cos_gamma_t / cos_t.max(F::splat(1e-6));
        let reflected = fresnel::dielectric(cos * cos_gamma_i, self.eta).reflectance;
        let mut sigma = C::Columns::<F>::zero();
        for texture in &self.absorbing {
            sigma = sigma + texture.eval_lanes(at, w);
        }
        Fibre {
            sin,
            cos,
            phi: atan2(wi.z, wi.x),
            gamma_i,
            gamma_t: atan2(sin_gamma_t, cos_gamma_t),
            shares: shares(sigma, length * F::splat(self.scale), reflected),
        }
    }

    /// The probability of each way.
    #[inline(always)]
    fn probabilities<F: Lanes>(
        &self,
        shares: &[C::Columns<F>; WAYS],
        w: &[C::Wavelengths],
    ) -> [F; WAYS] {
        let mut all = [F::zero(); WAYS];
        let mut sum = F::zero();
        for (one, share) in all.iter_mut().zip(shares) {
            *one = self.color.luminance_lanes(*share, w).max(F::zero());
            sum = sum + *one;
        }
        for one in &mut all {
            *one = F::select(F::zero().lt(sum), *one / sum, F::splat(1.0 / WAYS as f32));
        }
        all
    }

    /// Value and density toward `wo`.
    #[inline(always)]
    fn scatter<F: Lanes>(
        &self,
        fibre: &Fibre<F, C::Columns<F>>,
        probabilities: &[F; WAYS],
        wo: Vec3<F>,
    ) -> BsdfValues<F, C::Columns<F>> {
        let (zero, one) = (F::zero(), F::one());
        let sin_o = wo.y.clamp(-1.0, 1.0);
        let cos_o = (one - sin_o * sin_o).max(zero).sqrt();
        let turned = atan2(wo.z, wo.x) - fibre.phi;
        let mut values = BsdfValues::none();
        for (way, probability) in probabilities.iter().enumerate() {
            let (sin_i, cos_i) = self.tilted(fibre, way);
            let k = F::splat(self.concentration[way]);
            let mut lobe = longitudinal(sin_i * sin_o, cos_i * cos_o, k);
            if way + 1 < WAYS {
                lobe = lobe * self.azimuthal(turned - fibre.perfect(way));
            } else {
                lobe = lobe * F::splat(0.5 * FRAC_1_PI);
            }
            values.value = values.value + fibre.shares[way] * lobe;
            values.pdf = values.pdf + *probability * lobe;
        }
        values
    }

    /// Sine and cosine of the angle of incidence that the scales make of it for a way.
    #[inline(always)]
    fn tilted<F: Lanes, S>(&self, fibre: &Fibre<F, S>, way: usize) -> (F, F) {
        let [sin, cos] = self.tilt[way];
        let (sin, cos) = (F::splat(sin), F::splat(cos));
        (
            fibre.sin * cos + fibre.cos * sin,
            (fibre.cos * cos - fibre.sin * sin).abs(),
        )
    }

    /// The cumulative logistic distribution, before it is cut off at ±π.
    fn below(&self, x: f32) -> f32 {
        1.0 / (1.0 + (-x / self.width).exp())
    }

    /// The density around the fibre, `off` by so much from the perfect angle.
    #[inline(always)]
    fn azimuthal<F: Lanes>(&self, off: F) -> F {
        let one = F::one();
        let off = off - F::splat(TAU) * (off * F::splat(1.0 / TAU) + F::splat(0.5)).floor();
        let e = exp(-off.abs() * F::splat(1.0 / self.width));
        let whole = self.width * (self.below(PI) - self.below(-PI));
        e / (F::splat(whole) * (one + e) * (one + e))
    }

    /// An angle off the perfect one, drawn.
    #[inline(always)]
    fn draw_azimuth<F: Lanes>(&self, u: F) -> F {
        let (low, high) = (self.below(-PI), self.below(PI));
        let part = (u * F::splat(high - low) + F::splat(low)).clamp(1e-7, 1.0 - 1e-7);
        let x = ln(part / (F::one() - part)) * F::splat(self.width);
        x.clamp(-PI, PI)
    }
}

/// A fibre as a path meets it.
struct Fibre<F, S> {
    /// Sine and cosine of the angle between the path and the plane at right angles to the fibre.
    sin: F,
    cos: F,
    /// The path's angle around the fibre.
    phi: F,
    /// Angle of incidence in that plane, and of refraction.
    gamma_i: F,
    gamma_t: F,
    /// What is left of the light on each way.
    shares: [S; WAYS],
}

impl<F: Lanes, S> Fibre<F, S> {
    /// By how much a way turns light around a smooth fibre.
    #[inline(always)]
    fn perfect(&self, way: usize) -> F {
        let p = F::splat(way as f32);
        F::splat(2.0) * (p * self.gamma_t - self.gamma_i) + p * F::splat(PI)
    }
}

/// What is left of light on each way: of what is `reflected` at each boundary, and absorbed on each `length` within.
#[inline(always)]
fn shares<F: Lanes, S: Spectra<F>>(sigma: S, length: F, reflected: F) -> [S; WAYS] {
    let (zero, one) = (F::zero(), F::one());
    let mut shares = [S::zero(); WAYS];
    let passed = (one - reflected) * (one - reflected);
    for channel in 0..S::CHANNELS {
        let kept = exp(-sigma[channel] * length).min(one);
        let once = passed * kept;
        let twice = once * kept * reflected;
        let again = kept * reflected;
        let rest = twice * again / (one - again);
        shares[0].set(channel, reflected);
        shares[1].set(channel, once);
        shares[2].set(channel, twice);
        shares[3].set(channel, F::select(again.lt(one), rest, zero));
    }
    shares
}

/// The density of the angle along the fibre, over solid angle times 2π: κ/(2 sinh κ)·exp(−κ sin θ_i sin θ_o)·
/// I₀(κ cos θ_i cos θ_o), whose exponents are added up before they are taken, for each is large.
#[inline(always)]
fn longitudinal<F: Lanes>(sines: F, cosines: F, k: F) -> F {
    let whole = F::one() - exp(F::splat(-2.0) * k);
    k / whole * exp(ln_bessel_i0(k * cosines) - k * sines - k)
}

impl<C: ColorModel> Bsdf<C> for Hair<C> {
    fn lobes(&self) -> Lobes {
        Lobes {
            smooth: true,
            transmission: true,
        }
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Hair<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let fibre = self.fibre(at, wi, w);
        let probabilities = self.probabilities(&fibre.shares, w);
        let values = self.scatter(&fibre, &probabilities, wo);
        values.only(F::zero().lt(values.pdf) & values.pdf.is_finite())
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let (zero, one) = (F::zero(), F::one());
        let fibre = self.fibre(at, wi, w);
        let probabilities = self.probabilities(&fibre.shares, w);
        // The way, and what is left of the number that has chosen it.
        let (mut start, mut rest) = (zero, zero);
        let (mut sin_i, mut cos_i) = (zero, zero);
        let (mut k, mut perfect) = (one, zero);
        let mut last = F::Mask::splat(false);
        for (way, probability) in probabilities.iter().enumerate() {
            let chosen = start.le(u1);
            let (sin, cos) = self.tilted(&fibre, way);
            rest = F::select(chosen, (u1 - start) / *probability, rest);
            sin_i = F::select(chosen, sin, sin_i);
            cos_i = F::select(chosen, cos, cos_i);
            k = F::select(chosen, F::splat(self.concentration[way]), k);
            perfect = F::select(chosen, fibre.perfect(way), perfect);
            last = if way + 1 < WAYS { last } else { chosen };
            start = start + *probability;
        }
        let rest = rest.clamp(0.0, 1.0);
        let e = exp(F::splat(-2.0) * k);
        let part = (u2.x + (one - u2.x) * e).max(F::splat(f32::MIN_POSITIVE));
        let cosine = (one + ln(part) / k).clamp(-1.0, 1.0);
        let sine = (one - cosine * cosine).max(zero).sqrt();
        let (_, around) = sin_cos(u2.y * F::splat(TAU));
        let sin_o = (sine * around * cos_i - cosine * sin_i).clamp(-1.0, 1.0);
        let cos_o = (one - sin_o * sin_o).max(zero).sqrt();
        let turned = F::select(
            last,
            rest * F::splat(TAU),
            perfect + self.draw_azimuth(rest),
        );
        let (sin_phi, cos_phi) = sin_cos(fibre.phi + turned);
        let wo = Vec3::new(cos_o * cos_phi, sin_o, cos_o * sin_phi).normalize();
        (self.scatter(&fibre, &probabilities, wo)).as_samples(wo, one)
    }
}
