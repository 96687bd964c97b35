//! `sellmeier`, an extension of Étendue's: an index of refraction n over wavelength, n² = 1 + Σ Bᵢ·λ²/(λ² − Cᵢ) with λ in
//! micrometres (Sellmeier, 1871): the lists `b`, and `c` in µm², as catalogues of glasses give them.

use super::regular::numbers;
use super::{Palette, Pattern};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, string};
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored index.
#[derive(Clone, Debug)]
pub struct Sellmeier<C: ColorModel> {
    value: C::Stored,
}

/// Pairs of B and C in µm².
pub(super) type Terms = [(f64, f64)];

/// The index at a wavelength in nm; NaN at a resonance, where the formula has no value.
fn index(terms: &Terms, nanometres: f64) -> f64 {
    let square = (nanometres * 1e-3).powi(2);
    let term = |(b, c): &(f64, f64)| b * square / (square - c);
    (1.0 + terms.iter().map(term).sum::<f64>()).sqrt()
}

/// Points of (nm, index), every nanometre over what bands may want, where a formula has values.
pub(super) fn tabulated(index: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let points = (250..=2500).map(|nanometres| {
        let nanometres = f64::from(nanometres);
        (nanometres, index(nanometres))
    });
    let (first, last) = (
        f64::from(crate::color::VISIBLE[0]),
        f64::from(crate::color::VISIBLE[1]),
    );
    let points: Vec<_> = points.collect();
    let valid = |p: &&(f64, f64)| p.1.is_finite() && p.1 > 0.0;
    // Resonances in the infrared or the ultraviolet end what is told, those in the visible are told as they are.
    let start = points
        .iter()
        .rposition(|p| p.0 < first && !valid(&p))
        .map_or(0, |i| i + 1);
    let end = points
        .iter()
        .position(|p| p.0 > last && !valid(&p))
        .unwrap_or(points.len());
    points[start..end].to_vec()
}

/// Points of (nm, index) by Sellmeier's formula.
pub(super) fn points(terms: &Terms) -> Vec<(f64, f64)> {
    tabulated(|nanometres| index(terms, nanometres))
}

impl<C: ColorModel> Sellmeier<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "an index of refraction by Sellmeier's formula",
        properties: &[&[
            string("b", "", "the strengths B, two or more").required(),
            string(
                "c",
                "",
                "the squares of resonances C, one for each B, in µm²",
            )
            .required(),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let (b, c) = (numbers(properties, "b")?, numbers(properties, "c")?);
        if b.len() != c.len() {
            let message = format!("{} values C for {} values B", c.len(), b.len());
            return Err(properties.error("c", message));
        }
        let terms: Vec<(f64, f64)> = b.into_iter().zip(c).collect();
        let points = points(&terms);
        if points.iter().any(|p| !p.1.is_finite()) {
            return Err(properties.error("c", "there is a resonance in the visible range"));
        }
        let value = palette.index(properties, points)?;
        Ok(Self { value })
    }
}

impl<C: ColorModel> Pattern<C> for Sellmeier<C> {
    fn eval(&self, _at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.value, wavelengths)
    }

    fn constant(&self) -> Option<&C::Stored> {
        Some(&self.value)
    }
}
