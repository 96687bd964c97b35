//! `blackbody`: what a black body of a `temperature` (K) radiates, from `wavelength_min` to `wavelength_max` (nm, the
//! visible range by default), in W·m⁻²·sr⁻¹·nm⁻¹: Planck's law, 2hc²λ⁻⁵ / (exp(hc / λkT) − 1).

use super::{Palette, Pattern};
use crate::color::{ColorModel, cie};
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored spectrum.
#[derive(Clone, Debug)]
pub struct Blackbody<C: ColorModel> {
    value: C::Stored,
}

impl<C: ColorModel> Blackbody<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "what a black body radiates; W·m⁻²·sr⁻¹·nm⁻¹",
        properties: &[&[
            float("temperature", 0.0, "in kelvin")
                .at_least(0.0)
                .required(),
            float(
                "wavelength_min",
                cie::FIRST as f64,
                "where it begins, in nm",
            ),
            float("wavelength_max", cie::LAST as f64, "where it ends, in nm"),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let temperature = properties.float("temperature")?;
        let (least, most) = (f64::from(cie::FIRST), f64::from(cie::LAST));
        let first = properties.float("wavelength_min")?.max(least);
        let last = properties.float("wavelength_max")?.min(most);
        if last <= first {
            let message = format!("no wavelength from {first} to {last} nm is visible");
            return Err(properties.error("wavelength_max", message));
        }
        // Linear in steps of at most a nanometre, which is below a millionth off.
        let steps = (last - first).ceil();
        let wavelength = |i: u32| first + (last - first) * f64::from(i) / steps;
        let points = (0..=steps as u32)
            .map(wavelength)
            .map(|nanometres| (nanometres, planck(nanometres, temperature)))
            .collect();
        let value = palette.curve(properties, points)?;
        Ok(Self { value })
    }
}

/// The radiance of a black body in W·m⁻²·sr⁻¹·nm⁻¹, with the constants of the SI.
fn planck(nanometres: f64, kelvin: f64) -> f64 {
    /// Planck's constant, in J·s.
    const H: f64 = 6.626_070_15e-34;
    /// The speed of light, in m/s.
    const C: f64 = 299_792_458.0;
    /// Boltzmann's constant, in J/K.
    const K: f64 = 1.380_649e-23;
    let metres = nanometres * 1e-9;
    let exponent = H * C / (metres * K * kelvin);
    // At 0 K that is infinite, and the radiance 0.
    1e-9 * 2.0 * H * C * C / metres.powi(5) / exponent.exp_m1()
}

impl<C: ColorModel> Pattern<C> for Blackbody<C> {
    fn eval(&self, _at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.value, wavelengths)
    }

    fn constant(&self) -> Option<&C::Stored> {
        Some(&self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wien's law and the law of Stefan and Boltzmann.
    #[test]
    fn the_brightest_wavelength_and_the_whole_radiance_are_those_of_the_laws() {
        let at = |i: u32| f64::from(i);
        let peak =
            (200..3000).max_by(|a, b| planck(at(*a), 5000.0).total_cmp(&planck(at(*b), 5000.0)));
        assert_eq!(peak, Some(580));
        let whole: f64 = (1..100_000).map(|i| planck(at(i), 5000.0)).sum();
        let law = 5.670_374e-8 * 5000f64.powi(4) / std::f64::consts::PI;
        assert!((whole / law - 1.0).abs() < 1e-4, "{whole} {law}");
        assert_eq!(planck(500.0, 0.0), 0.0);
    }
}
