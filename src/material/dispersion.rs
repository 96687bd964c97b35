//! Boundaries whose index of refraction depends on wavelength. Reflection takes all wavelengths of a path along, each with
//! its own share; refraction has a direction for each index, so that a path chooses one of its wavelengths evenly and goes
//! on with those that have the same index, as a rule with that one. Weights make up for the others.

use super::BsdfSamples;
use super::fresnel;
use super::ior::{self, Medium};
use crate::color::{ColorModel, Spectra as _, Spectral as _};
use crate::description::Properties;
use crate::error::Result;
use crate::lanes::{Lanes, Mask as _, Vec3};
use crate::texture::Palettes;

/// The index of refraction, inside over outside, at each of a path's wavelengths.
#[derive(Clone, Debug)]
pub(super) struct Dispersion<C: ColorModel> {
    inside: Medium<C>,
    outside: Medium<C>,
    /// 1 in each channel in use.
    unit: C::Sample,
}

impl<C: ColorModel> Dispersion<C> {
    /// What the properties `int_ior` and `ext_ior` say; `None` where that is the same at all wavelengths, which everything is
    /// in RGB.
    pub(super) fn build(
        properties: &Properties<'_>,
        palettes: &Palettes<C>,
    ) -> Result<Option<Box<Self>>> {
        let color = &palettes.colors.color;
        if !color.upsamples() {
            return Ok(None);
        }
        let medium = |name| ior::medium(properties, palettes, name);
        let dispersion = Self {
            inside: medium("int_ior")?,
            outside: medium("ext_ior")?,
            unit: color.unit(),
        };
        let [Medium::Same(_), Medium::Same(_)] = [&dispersion.inside, &dispersion.outside] else {
            return Ok(Some(Box::new(dispersion)));
        };
        Ok(None)
    }

    /// The indices at the wavelengths of paths in lanes.
    #[inline(always)]
    pub(super) fn indices<F: Lanes>(&self, w: &[C::Wavelengths]) -> C::Columns<F> {
        C::Columns::<F>::from_samples(|lane| {
            let (inside, outside) = (self.inside.at(&w[lane]), self.outside.at(&w[lane]));
            C::Sample::from_fn(|channel| inside[channel] / outside[channel])
        })
    }

    /// How many channels are in use.
    #[inline(always)]
    fn count(&self) -> f32 {
        let channels = 0..C::Sample::LANES;
        channels.map(|channel| self.unit[channel]).sum()
    }

    /// Chooses one of the channels evenly by numbers in [0, 1): its place among them.
    #[inline(always)]
    pub(super) fn choose<F: Lanes>(&self, u: F) -> F {
        let count = self.count();
        (u * F::splat(count)).floor().min(F::splat(count - 1.0))
    }

    /// What is left of the number once a channel is chosen by it, in [0, 1) again.
    #[inline(always)]
    pub(super) fn rest<F: Lanes>(&self, u: F) -> F {
        let rest = u * F::splat(self.count()) - self.choose(u);
        rest.clamp(0.0, 1f32.next_down())
    }

    /// The value in the channel that was chosen.
    #[inline(always)]
    pub(super) fn chosen<F: Lanes>(&self, values: C::Columns<F>, choice: F) -> F {
        let mut value = values[0];
        for channel in 1..C::Sample::LANES {
            value = F::select(choice.eq(F::splat(channel as f32)), values[channel], value);
        }
        value
    }

    /// The mean over the channels in use.
    #[inline(always)]
    pub(super) fn mean<F: Lanes>(&self, values: C::Columns<F>) -> F {
        let mut sum = F::zero();
        for channel in 0..C::Sample::LANES {
            sum = sum + values[channel] * F::splat(self.unit[channel]);
        }
        sum * F::splat(1.0 / self.count())
    }

    /// A clear boundary's samples: by `u1` the paths are reflected or refracted, by `u2` a wavelength is chosen.
    /// `factors` multiply what is reflected and what is refracted.
    #[inline(always)]
    pub(super) fn sample<F: Lanes>(
        &self,
        wi: Vec3<F>,
        [u1, u2]: [F; 2],
        factors: [C::Columns<F>; 2],
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let one = F::one();
        let indices = self.indices::<F>(w);
        let mut reflectances = C::Columns::<F>::zero();
        for channel in 0..C::Sample::LANES {
            let boundary = fresnel::dielectric_lanes(wi.z, indices[channel]);
            reflectances.set(channel, boundary.reflectance);
        }
        let mean = self.mean(reflectances);
        let all = F::Mask::splat(true);
        let [reflected, refracted] = factors;
        let reflected = BsdfSamples::delta(
            all,
            fresnel::mirror(wi),
            reflected * reflectances * (one / mean),
            mean,
        );
        let choice = self.choose(u2);
        let index = self.chosen(indices, choice);
        let boundary = fresnel::dielectric_lanes(wi.z, index);
        let mut alike = C::Columns::<F>::zero();
        for channel in 0..C::Sample::LANES {
            let is_alike = indices[channel].eq(index);
            alike.set(channel, F::select(is_alike, one, F::zero()));
        }
        let share = (one - boundary.reflectance) / (one - mean) / self.mean(alike);
        let spread = one / (boundary.eta * boundary.eta);
        let normal = Vec3::all(glam::Vec3::Z);
        let refracted = BsdfSamples {
            eta: boundary.eta,
            ..BsdfSamples::delta(
                all,
                fresnel::refract(wi, normal, &boundary),
                refracted * alike * (share * spread),
                one - mean,
            )
        };
        BsdfSamples::select(u1.lt(mean), reflected, refracted)
    }
}
