//! `regular`: a spectrum by its `values` at wavelengths in even steps from `wavelength_min` to `wavelength_max` (nm),
//! linear between them and 0 outside.

use super::{Palette, Pattern};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, float, string};
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored spectrum.
#[derive(Clone, Debug)]
pub struct Regular<C: ColorModel> {
    value: C::Stored,
}

impl<C: ColorModel> Regular<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a spectrum by values at even steps",
        properties: &[&[
            float("wavelength_min", 0.0, "of the first value, in nm")
                .positive()
                .required(),
            float("wavelength_max", 0.0, "of the last value, in nm")
                .positive()
                .required(),
            string("values", "", "two or more; linear between, 0 outside").required(),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let first = properties.float("wavelength_min")?;
        let last = properties.float("wavelength_max")?;
        if last <= first {
            let message = format!("wavelength_max {last} is not above wavelength_min {first}");
            return Err(properties.error("wavelength_max", message));
        }
        let values = numbers(properties, "values")?;
        let steps = values.len() - 1;
        let wavelength = |i: usize| first + (last - first) * (i as f64 / steps as f64);
        let points = (0..).map(wavelength).zip(values).collect();
        let value = palette.curve(properties, points)?;
        Ok(Self { value })
    }
}

/// A list of at least two numbers that are not negative, parted by commas or spaces.
pub(super) fn numbers(properties: &Properties<'_>, name: &'static str) -> Result<Vec<f64>> {
    let text = properties.string(name)?;
    let words = text.split(|c: char| c == ',' || c.is_ascii_whitespace());
    let number = |word: &str| match word.parse::<f64>() {
        Ok(v) if v.is_finite() && v >= 0.0 => Ok(v),
        Ok(_) => Err(properties.error(name, format!("{word} is not a number from 0 up"))),
        Err(_) => {
            let word: String = word.chars().take(40).collect();
            Err(properties.error(name, format!("{word:?} is not a number")))
        }
    };
    let numbers: Vec<f64> =
        (words.filter(|word| !word.is_empty()).map(number)).collect::<Result<_>>()?;
    if numbers.len() < 2 {
        let message = format!("{name:?} holds at least 2 numbers, found {}", numbers.len());
        return Err(properties.error(name, message));
    }
    Ok(numbers)
}

impl<C: ColorModel> Pattern<C> for Regular<C> {
    fn eval(&self, _at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.value, wavelengths)
    }

    fn constant(&self) -> Option<&C::Stored> {
        Some(&self.value)
    }
}
