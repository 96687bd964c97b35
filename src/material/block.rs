//! Materials in lanes: what a block of paths meets, all of one material. A material is written once: its face for
//! single points is the same code with one lane.

use std::f32::consts::PI;

use super::{BsdfSample, BsdfValue, Material};
use crate::color::{ColorModel, Spectra};
use crate::interaction::Points;
use crate::lanes::{Call, Lanes, Mask as _, Vec2, Vec3};

/// A BSDF's values, without delta parts; black with density 0 where there is none.
#[derive(Clone, Copy, Debug)]
pub struct BsdfValues<F, S> {
    /// f·|cos θ_o|.
    pub value: S,
    /// The density with which `wo` is drawn, in 1/sr.
    pub pdf: F,
}

/// Directions drawn from a BSDF; the fields are those of [`BsdfSample`].
#[derive(Clone, Copy, Debug)]
pub struct BsdfSamples<F: Lanes, S> {
    /// Where a direction was drawn; the other lanes hold anything.
    pub drawn: F::Mask,
    /// Local, unit length.
    pub wo: Vec3<F>,
    /// f·|cos θ_o| over the density.
    pub weight: S,
    /// Density per solid angle in 1/sr; of a delta direction, the probability of its choice.
    pub pdf: F,
    /// Index of refraction on the side of `wo` over that on the side of `wi`; 1 for a reflection.
    pub eta: F,
    /// Where no other direction would do.
    pub delta: F::Mask,
    /// Where it goes straight on as if nothing were there.
    pub null: F::Mask,
}

impl<F: Lanes, S: Spectra<F>> BsdfValues<F, S> {
    /// None.
    #[inline(always)]
    pub(super) fn none() -> Self {
        Self {
            value: S::zero(),
            pdf: F::zero(),
        }
    }

    /// These where the mask is set, else none.
    #[inline(always)]
    pub(super) fn only(self, mask: F::Mask) -> Self {
        Self::select(mask, self, Self::none())
    }

    /// The mean of two with these shares.
    #[inline(always)]
    pub(super) fn mixed(self, share: F, other: Self, other_share: F) -> Self {
        Self {
            value: self.value * share + other.value * other_share,
            pdf: self.pdf * share + other.pdf * other_share,
        }
    }

    /// `yes` where the mask is set, else `no`.
    #[inline(always)]
    pub(super) fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self {
            value: S::select(mask, yes.value, no.value),
            pdf: F::select(mask, yes.pdf, no.pdf),
        }
    }

    /// The samples that drew `wo` with this density, where that is above 0.
    #[inline(always)]
    pub(super) fn as_samples(self, wo: Vec3<F>, eta: F) -> BsdfSamples<F, S> {
        let none = F::Mask::splat(false);
        BsdfSamples {
            drawn: F::zero().lt(self.pdf) & self.pdf.is_finite(),
            wo,
            weight: self.value * (F::one() / self.pdf),
            pdf: self.pdf,
            eta,
            delta: none,
            null: none,
        }
    }
}

impl<F: Lanes, S: Spectra<F>> BsdfSamples<F, S> {
    /// A mirror's.
    #[inline(always)]
    pub(super) fn delta(drawn: F::Mask, wo: Vec3<F>, weight: S, probability: F) -> Self {
        Self {
            drawn,
            wo,
            weight,
            pdf: probability,
            eta: F::one(),
            delta: F::Mask::splat(true),
            null: F::Mask::splat(false),
        }
    }

    /// Straight on through the surface, chosen with that probability.
    #[inline(always)]
    pub(super) fn passing(wi: Vec3<F>, probability: F, weight: S) -> Self {
        let all = F::Mask::splat(true);
        Self {
            null: all,
            ..Self::delta(all, -wi, weight, probability)
        }
    }

    /// `yes` where the mask is set, else `no`.
    #[inline(always)]
    pub(super) fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        let not = !mask;
        Self {
            drawn: (mask & yes.drawn) | (not & no.drawn),
            wo: Vec3::select(mask, yes.wo, no.wo),
            weight: S::select(mask, yes.weight, no.weight),
            pdf: F::select(mask, yes.pdf, no.pdf),
            eta: F::select(mask, yes.eta, no.eta),
            delta: (mask & yes.delta) | (not & no.delta),
            null: (mask & yes.null) | (not & no.null),
        }
    }
}

/// What Phong's equation as textbooks write it, I = I_a·k_a + Σ I_i·[k_d·max(0, L·N) + k_s·max(0, R·V)ⁿ],
/// multiplies a light's I_i by. Nothing in it is normalised.
#[derive(Clone, Copy, Debug)]
pub struct PhongTerms<S> {
    /// k_d·max(0, L·N), whoever looks on.
    pub diffuse: S,
    /// k_s·max(0, R·V)ⁿ where L·N > 0.
    pub specular: S,
}

impl<S> PhongTerms<S> {
    /// These where the mask is set, else none.
    #[inline(always)]
    pub(super) fn only<F: Lanes>(self, mask: F::Mask) -> Self
    where
        S: Spectra<F>,
    {
        Self {
            diffuse: S::select(mask, self.diffuse, S::zero()),
            specular: S::select(mask, self.specular, S::zero()),
        }
    }

    /// The terms of a material that shows only this share of itself.
    #[inline(always)]
    pub(super) fn weighted<F: Lanes>(self, weight: F) -> Self
    where
        S: Spectra<F>,
    {
        Self {
            diffuse: self.diffuse * weight,
            specular: self.specular * weight,
        }
    }
}

/// A material in lanes. Wavelengths are given from the first lane on.
pub(super) trait BlockBsdf<C: ColorModel> {
    /// [`Bsdf::eval`]; none where all lobes are single directions.
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        _at: &Points<'_, F>,
        _wi: Vec3<F>,
        _wo: Vec3<F>,
        _w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        BsdfValues::none()
    }

    /// [`Bsdf::sample`].
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>>;

    /// See [`Material::passing_lanes`].
    #[inline(always)]
    fn passing_lanes<F: Lanes>(
        &self,
        _at: &Points<'_, F>,
        _wi: Vec3<F>,
        _w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        BsdfValues::none()
    }

    /// Its terms of Phong's equation, if it has a part in it.
    #[inline(always)]
    fn phong_lanes<F: Lanes>(
        &self,
        _at: &Points<'_, F>,
        _wi: Vec3<F>,
        _wo: Vec3<F>,
        _w: &[C::Wavelengths],
    ) -> Option<PhongTerms<C::Columns<F>>> {
        None
    }
}

/// The face for single points of a material that is written in lanes.
macro_rules! single_face {
    () => {
        fn eval(
            &self,
            at: &crate::interaction::Interaction<'_>,
            wi: glam::Vec3,
            wo: glam::Vec3,
            w: &C::Wavelengths,
        ) -> Option<crate::material::BsdfValue<C::Sample>> {
            crate::material::block::single_value::<C, _>(self, at, wi, wo, w)
        }

        fn sample(
            &self,
            at: &crate::interaction::Interaction<'_>,
            wi: glam::Vec3,
            u1: f32,
            u2: glam::Vec2,
            w: &C::Wavelengths,
        ) -> Option<crate::material::BsdfSample<C::Sample>> {
            crate::material::block::single_sample::<C, _>(self, at, wi, (u1, u2), w)
        }
    };
}
pub(super) use single_face;

/// See [`single_face`].
pub(super) fn single_value<C: ColorModel, B: BlockBsdf<C>>(
    bsdf: &B,
    at: &crate::interaction::Interaction<'_>,
    wi: glam::Vec3,
    wo: glam::Vec3,
    w: &C::Wavelengths,
) -> Option<BsdfValue<C::Sample>> {
    let points = Points::one(at);
    let values = bsdf.eval_lanes::<f32>(&points, wi.into(), wo.into(), std::slice::from_ref(w));
    let there = values.pdf > 0.0 || !values.value.is_black();
    there.then(|| BsdfValue {
        value: values.value.sample(0),
        pdf: values.pdf,
    })
}

/// See [`single_face`].
pub(super) fn single_sample<C: ColorModel, B: BlockBsdf<C>>(
    bsdf: &B,
    at: &crate::interaction::Interaction<'_>,
    wi: glam::Vec3,
    (u1, u2): (f32, glam::Vec2),
    w: &C::Wavelengths,
) -> Option<BsdfSample<C::Sample>> {
    let points = Points::one(at);
    let w = std::slice::from_ref(w);
    let samples = bsdf.sample_lanes::<f32>(&points, wi.into(), u1, u2.into(), w);
    samples.drawn.then(|| BsdfSample {
        wo: samples.wo.into(),
        weight: samples.weight.sample(0),
        pdf: samples.pdf,
        eta: samples.eta,
        delta: samples.delta,
        null: samples.null,
    })
}

/// Something to be asked of whichever material it is. `visit` must be `#[inline(always)]`.
pub(super) trait Visitor<C: ColorModel> {
    type Output;

    fn visit<B: BlockBsdf<C>>(self, bsdf: &B) -> Self::Output;
}

/// Asks a material in a function that knows the instructions.
struct Ask<'a, C: ColorModel, V>(&'a Material<C>, V);

impl<C: ColorModel, F: Lanes, V: Visitor<C>> Call<F> for Ask<'_, C, V> {
    type Output = V::Output;

    #[inline(always)]
    fn run(self) -> V::Output {
        self.0.visit(self.1)
    }
}

/// Points, pairs of directions and wavelengths: what [`BlockBsdf::eval_lanes`] is given.
struct Pairs<'a, C: ColorModel, F: Lanes> {
    at: &'a Points<'a, F>,
    wi: Vec3<F>,
    wo: Vec3<F>,
    w: &'a [C::Wavelengths],
}

/// See [`BlockBsdf::eval_lanes`].
struct Eval<'a, C: ColorModel, F: Lanes>(Pairs<'a, C, F>);

impl<C: ColorModel, F: Lanes> Visitor<C> for Eval<'_, C, F> {
    type Output = BsdfValues<F, C::Columns<F>>;

    #[inline(always)]
    fn visit<B: BlockBsdf<C>>(self, bsdf: &B) -> Self::Output {
        let Pairs { at, wi, wo, w } = self.0;
        bsdf.eval_lanes(at, wi, wo, w)
    }
}

/// See [`BlockBsdf::passing_lanes`].
struct Pass<'a, C: ColorModel, F: Lanes> {
    at: &'a Points<'a, F>,
    wi: Vec3<F>,
    w: &'a [C::Wavelengths],
}

impl<C: ColorModel, F: Lanes> Visitor<C> for Pass<'_, C, F> {
    type Output = BsdfValues<F, C::Columns<F>>;

    #[inline(always)]
    fn visit<B: BlockBsdf<C>>(self, bsdf: &B) -> Self::Output {
        bsdf.passing_lanes(self.at, self.wi, self.w)
    }
}

/// See [`BlockBsdf::phong_lanes`].
struct Terms<'a, C: ColorModel, F: Lanes>(Pairs<'a, C, F>);

impl<C: ColorModel, F: Lanes> Visitor<C> for Terms<'_, C, F> {
    type Output = Option<PhongTerms<C::Columns<F>>>;

    #[inline(always)]
    fn visit<B: BlockBsdf<C>>(self, bsdf: &B) -> Self::Output {
        let Pairs { at, wi, wo, w } = self.0;
        bsdf.phong_lanes(at, wi, wo, w)
    }
}

/// See [`BlockBsdf::sample_lanes`].
struct Draw<'a, C: ColorModel, F: Lanes> {
    at: &'a Points<'a, F>,
    wi: Vec3<F>,
    u1: F,
    u2: Vec2<F>,
    w: &'a [C::Wavelengths],
}

impl<C: ColorModel, F: Lanes> Visitor<C> for Draw<'_, C, F> {
    type Output = BsdfSamples<F, C::Columns<F>>;

    #[inline(always)]
    fn visit<B: BlockBsdf<C>>(self, bsdf: &B) -> Self::Output {
        let Self { at, wi, u1, u2, w } = self;
        bsdf.sample_lanes(at, wi, u1, u2, w)
    }
}

impl<C: ColorModel> Material<C> {
    /// The values and densities of pairs of directions.
    #[inline(always)]
    pub fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        F::call(Ask(self, Eval(Pairs { at, wi, wo, w })))
    }

    /// The share of light along `wi` that goes straight on as if nothing were there, and the probability with which
    /// [`Material::sample_lanes`] lets it.
    #[inline(always)]
    pub fn passing_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        F::call(Ask(self, Pass { at, wi, w }))
    }

    /// The material's part in Phong's equation. One that has none there gives π times its value, so that a matte one has
    /// k_d = reflectance; as it may depend on the viewer, that counts as specular.
    #[inline(always)]
    pub fn phong_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> PhongTerms<C::Columns<F>> {
        match F::call(Ask(self, Terms(Pairs { at, wi, wo, w }))) {
            Some(terms) => terms,
            None => PhongTerms {
                diffuse: Spectra::zero(),
                specular: self.eval_lanes(at, wi, wo, w).value * F::splat(PI),
            },
        }
    }

    /// Draws directions: `u1` chooses the lobe, `u2` the direction.
    #[inline(always)]
    pub fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        F::call(Ask(self, Draw { at, wi, u1, u2, w }))
    }
}
