//! Lights in lanes: directions from a block of points toward one light.

use super::Light;
use crate::color::{ColorModel, PerLane, Spectra, Spectral};
use crate::interaction::{Points, Reference, Source};
use crate::lanes::{Call, Lanes, Mask as _, Vec2, Vec3};

/// Directions drawn toward a light; the fields are those of [`super::LightSample`]. Radiance comes last, once for all lights.
#[derive(Clone, Copy, Debug)]
pub struct LightSamples<F: Lanes, S = ()> {
    /// World space, unit length.
    pub direction: Vec3<F>,
    /// Where the light is, if it is not `distant`.
    pub target: Vec3<F>,
    /// Where it is infinitely far.
    pub distant: F::Mask,
    /// Radiance from there (of a delta light: the irradiance at right angles), not divided by the density.
    pub radiance: S,
    /// Density per solid angle in 1/sr; 1 for a delta light, 0 where nothing arrives.
    pub pdf: F,
    /// Where it is a point or a direction that no path meets by chance.
    pub delta: F::Mask,
}

impl<F: Lanes> LightSamples<F> {
    /// No light.
    #[inline(always)]
    pub fn none() -> Self {
        Self {
            direction: Vec3::splat(0.0),
            target: Vec3::splat(0.0),
            distant: F::Mask::splat(false),
            radiance: (),
            pdf: F::zero(),
            delta: F::Mask::splat(false),
        }
    }

    /// `yes` where the mask is set, else `no`.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self {
            direction: Vec3::select(mask, yes.direction, no.direction),
            target: Vec3::select(mask, yes.target, no.target),
            distant: (mask & yes.distant) | (!mask & no.distant),
            radiance: (),
            pdf: F::select(mask, yes.pdf, no.pdf),
            delta: (mask & yes.delta) | (!mask & no.delta),
        }
    }

    /// The same with radiance.
    #[inline(always)]
    pub fn with<S>(self, radiance: S) -> LightSamples<F, S> {
        LightSamples {
            direction: self.direction,
            target: self.target,
            distant: self.distant,
            radiance,
            pdf: self.pdf,
            delta: self.delta,
        }
    }
}

/// A light that stands still and is written over lanes. Wavelengths are given from the first lane on.
pub(super) trait BlockEmitter<C: ColorModel> {
    /// [`super::Emitter::sample`] for the lanes that are `active`; what the others get is not used. These lanes' radiance is
    /// put into `radiance`.
    fn sample_lanes<F: Lanes>(
        &self,
        from: Vec3<F>,
        u: Vec2<F>,
        w: &[C::Wavelengths],
        active: F::Mask,
        radiance: &mut C::PerLane<F>,
    ) -> LightSamples<F>;
}

/// The arguments of [`Light::sample_lanes`].
struct Draw<'a, C: ColorModel, F: Lanes> {
    light: &'a Light<C>,
    from: Vec3<F>,
    /// Who knows the lanes' times.
    source: &'a dyn Source,
    u: Vec2<F>,
    w: &'a [C::Wavelengths],
    active: F::Mask,
    radiance: &'a mut C::PerLane<F>,
}

impl<C: ColorModel, F: Lanes> Call<F> for Draw<'_, C, F> {
    type Output = LightSamples<F>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self {
            light,
            from,
            u,
            w,
            active,
            ..
        } = self;
        let radiance = &mut *self.radiance;
        match light {
            Light::Area(area) if area.is_written_over_lanes() => {
                area.sample_lanes(from, u, w, active, radiance)
            }
            Light::Constant(constant) => constant.sample_lanes(from, u, w, active, radiance),
            Light::Directional(light) if light.is_still() => {
                light.sample_lanes(from, u, w, active, radiance)
            }
            Light::Envmap(envmap) if envmap.is_still() => {
                envmap.sample_lanes(from, u, w, active, radiance)
            }
            Light::Point(point) if point.is_still() => {
                point.sample_lanes(from, u, w, active, radiance)
            }
            _ => self.each(),
        }
    }
}

impl<C: ColorModel> Light<C> {
    /// Directions from those of the points `from` that are `active` toward the light, each at its own time.
    #[inline(always)]
    pub fn sample_lanes<F: Lanes>(
        &self,
        from: &Points<'_, F>,
        u: Vec2<F>,
        w: &[C::Wavelengths],
        active: F::Mask,
    ) -> LightSamples<F, C::Columns<F>> {
        let mut radiance = C::PerLane::<F>::zero();
        let samples = self.sample_among(from, u, w, active, &mut radiance);
        samples.with(radiance.evaluate(w))
    }

    /// The same of one light among others, each for its own lanes, whose radiance is evaluated for all at once.
    #[inline(always)]
    pub fn sample_among<F: Lanes>(
        &self,
        from: &Points<'_, F>,
        u: Vec2<F>,
        w: &[C::Wavelengths],
        active: F::Mask,
        radiance: &mut C::PerLane<F>,
    ) -> LightSamples<F> {
        F::call(Draw {
            light: self,
            from: from.position,
            source: from.source,
            u,
            w,
            active,
            radiance,
        })
    }
}

impl<C: ColorModel, F: Lanes> Draw<'_, C, F> {
    /// Directions toward a light that is asked lane by lane.
    #[inline(always)]
    fn each(self) -> LightSamples<F> {
        let Self {
            light,
            from,
            source,
            u,
            w,
            active,
            radiance,
        } = self;
        let there = active.to_bits();
        let (mut direction, mut target, mut pdf) = ([F::ROW; 3], [F::ROW; 3], F::ROW);
        let (mut distant, mut delta) = (0, 0);
        let values = Spectra::from_samples(|lane| {
            let sample = if there >> lane & 1 == 1 {
                let from = Reference {
                    position: from.lane(lane),
                    time: source.time(lane),
                };
                light.sample(from, u.lane(lane), &w[lane])
            } else {
                None
            };
            let Some(sample) = sample else {
                return C::Sample::zero();
            };
            for axis in 0..3 {
                direction[axis][lane] = sample.direction[axis];
                target[axis][lane] = sample.target.unwrap_or_default()[axis];
            }
            distant |= u32::from(sample.target.is_none()) << lane;
            delta |= u32::from(sample.delta) << lane;
            pdf[lane] = sample.pdf;
            sample.radiance
        });
        radiance.put_values(active, values);
        LightSamples {
            direction: Vec3::<F>::load(&direction),
            target: Vec3::<F>::load(&target),
            distant: F::Mask::from_bits(distant),
            radiance: (),
            pdf: F::load(&pdf),
            delta: F::Mask::from_bits(delta),
        }
    }
}

/// The face for a single point of a light that is written over lanes.
pub(super) fn single_sample<C: ColorModel, E: BlockEmitter<C>>(
    emitter: &E,
    from: glam::Vec3,
    u: glam::Vec2,
    w: &C::Wavelengths,
) -> Option<super::LightSample<C::Sample>> {
    let w = std::slice::from_ref(w);
    let mut radiance = C::PerLane::<f32>::zero();
    let samples = emitter.sample_lanes::<f32>(from.into(), u.into(), w, true, &mut radiance);
    single(samples.with(radiance.evaluate(w)))
}

/// A single direction; `None` where nothing arrives.
pub(super) fn single<S: Spectral, T: Spectra<f32>>(
    samples: LightSamples<f32, T>,
) -> Option<super::LightSample<S>> {
    (samples.pdf > 0.0).then(|| super::LightSample {
        direction: samples.direction.into(),
        target: (!samples.distant).then(|| samples.target.into()),
        radiance: samples.radiance.sample(0),
        pdf: samples.pdf,
        delta: samples.delta,
    })
}
