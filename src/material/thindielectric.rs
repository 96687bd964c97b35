//! `thindielectric`: a clear pane so thin that light leaves it where it entered: all the reflections
//! inside add up, R = 2F / (1 + F) (Born and Wolf, *Principles of Optics*), and what passes goes straight
//! on. `int_ior` is bk7 glass and `ext_ior` air by default; `specular_reflectance` and
//! `specular_transmittance` (1) multiply.

use super::dispersion::Dispersion;
use super::{
    BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, dielectric, fresnel, ior, single_face,
};
use crate::color::{ColorModel, Spectra};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3};
use crate::texture::{Palettes, Texture};

/// A thin clear pane.
#[derive(Clone, Debug)]
pub struct ThinDielectric<C: ColorModel> {
    /// Index of refraction, inside over outside.
    eta: f32,
    /// The same over wavelength, where it depends on that.
    dispersion: Option<Box<Dispersion<C>>>,
    specular_reflectance: Texture<C>,
    specular_transmittance: Texture<C>,
}

impl<C: ColorModel> ThinDielectric<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a thin pane of glass",
        properties: &[&super::ior::dispersive("bk7"), dielectric::FACTORS],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let [specular_reflectance, specular_transmittance] =
            dielectric::factors(properties, palettes)?;
        Ok(Self {
            eta: ior::relative_of_yellow(properties)?,
            dispersion: Dispersion::build(properties, palettes)?,
            specular_reflectance,
            specular_transmittance,
        })
    }
}

impl<C: ColorModel> Bsdf<C> for ThinDielectric<C> {
    fn lobes(&self) -> Lobes {
        Lobes {
            smooth: false,
            transmission: true,
        }
    }

    fn passes(&self) -> bool {
        true
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for ThinDielectric<C> {
    #[inline(always)]
    fn passing_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let transmittance = self.specular_transmittance.eval_lanes(at, w);
        if let Some(dispersion) = &self.dispersion {
            let reflectances = Self::reflectances(dispersion, wi, w);
            let mut rests = C::Columns::<F>::zero();
            for channel in 0..C::Columns::<F>::CHANNELS {
                rests.set(channel, F::one() - reflectances[channel]);
            }
            return BsdfValues {
                value: transmittance * rests,
                pdf: F::one() - dispersion.mean(reflectances),
            };
        }
        let rest = F::one() - twice(fresnel::dielectric(wi.z.abs(), self.eta).reflectance);
        BsdfValues {
            value: transmittance * rest,
            pdf: rest,
        }
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        _u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        if let Some(dispersion) = &self.dispersion {
            return self.sample_dispersed(dispersion, at, wi, u1, w);
        }
        let reflectance = twice(fresnel::dielectric(wi.z.abs(), self.eta).reflectance);
        let reflected = BsdfSamples::delta(
            F::Mask::splat(true),
            fresnel::mirror(wi),
            self.specular_reflectance.eval_lanes(at, w),
            reflectance,
        );
        let transmittance = self.specular_transmittance.eval_lanes(at, w);
        let passing = BsdfSamples::passing(wi, F::one() - reflectance, transmittance);
        BsdfSamples::select(u1.lt(reflectance), reflected, passing)
    }
}

/// What both sides of a thin plate reflect, with all that goes to and fro between them, where one reflects `once`.
#[inline(always)]
fn twice<F: Lanes>(once: F) -> F {
    (once + once) / (F::one() + once)
}

impl<C: ColorModel> ThinDielectric<C> {
    /// What is reflected of each wavelength.
    #[inline(always)]
    fn reflectances<F: Lanes>(
        dispersion: &Dispersion<C>,
        wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> C::Columns<F> {
        let indices = dispersion.indices::<F>(w);
        let mut reflectances = C::Columns::<F>::zero();
        for channel in 0..C::Columns::<F>::CHANNELS {
            let once = fresnel::dielectric_lanes(wi.z.abs(), indices[channel]).reflectance;
            reflectances.set(channel, twice(once));
        }
        reflectances
    }

    /// Samples where each wavelength has its own share of what is reflected.
    #[inline(always)]
    fn sample_dispersed<F: Lanes>(
        &self,
        dispersion: &Dispersion<C>,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let one = F::one();
        let reflectances = Self::reflectances(dispersion, wi, w);
        let mut rests = C::Columns::<F>::zero();
        for channel in 0..C::Columns::<F>::CHANNELS {
            rests.set(channel, one - reflectances[channel]);
        }
        let mean = dispersion.mean(reflectances);
        let reflected = BsdfSamples::delta(
            F::Mask::splat(true),
            fresnel::mirror(wi),
            self.specular_reflectance.eval_lanes(at, w) * reflectances * (one / mean),
            mean,
        );
        let transmittance = self.specular_transmittance.eval_lanes(at, w) * rests;
        let passing = BsdfSamples::passing(wi, one - mean, transmittance * (one / (one - mean)));
        BsdfSamples::select(u1.lt(mean), reflected, passing)
    }
}
