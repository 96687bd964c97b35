//! `regular`: a spectrum by its `values` at wavelengths in even steps from `wavelength_min` to `wavelength_max` (nm),
//! linear between them and 0 outside.

use super::{Palette, Pattern};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored spectrum.
#[derive(Clone, Debug)]
pub struct Regular<C: ColorModel> {
    value: C::Stored,
}

impl<C: ColorModel> Regular<C> {
    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let end = |name| match properties.float(name)? {
            Some(nanometres) if nanometres > 0.0 => Ok(nanometres),
            Some(_) => Err(properties.error(name, "a wavelength is positive")),
            None => Err(properties.error(name, format!("a regular spectrum needs {name:?}"))),
        };
        let (first, last) = (end("wavelength_min")?, end("wavelength_max")?);
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
    let Some(text) = properties.string(name)? else {
        let message = format!("a {} spectrum needs {name:?}", properties.plugin());
        return Err(properties.error(name, message));
    };
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
