//! `glass`, an extension of Étendue's: the index of refraction of a clear substance over wavelength, by `name`. By
//! Sellmeier's formula, with the coefficients of Schott's catalogue (BK7, F2, SF10), Malitson 1965 (fused silica), Peter
//! 1923 (diamond), and Daimon and Masumura 2007 (water of 20 °C).

use super::sellmeier::{self, Terms};
use super::{Palette, Pattern};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, choice};
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored index.
#[derive(Clone, Debug)]
pub struct Glass<C: ColorModel> {
    value: C::Stored,
}

/// The names, the first being what is taken where none is given.
const NAMES: &[&str] = &["BK7", "F2", "SF10", "diamond", "fused silica", "water"];

/// The substance of that name, one of [`NAMES`].
#[rustfmt::skip]
fn terms(name: &str) -> &'static Terms {
    match name {
        "F2" => &[(1.34533359, 0.00997743871), (0.209073176, 0.0470450767), (0.937357162, 111.886764)],
        "SF10" => &[(1.62153902, 0.0122241457), (0.256287842, 0.0595736775), (1.64447552, 147.468793)],
        "diamond" => &[(4.3356, 0.1060 * 0.1060), (0.3306, 0.1750 * 0.1750)],
        "fused silica" => &[
            (0.6961663, 0.0684043 * 0.0684043), (0.4079426, 0.1162414 * 0.1162414), (0.8974794, 9.896161 * 9.896161),
        ],
        "water" => &[
            (0.5684027565, 0.005101829712), (0.1726177391, 0.01821153936),
            (0.02086189578, 0.02620722293), (0.1130748688, 10.69792721),
        ],
        _ => &[(1.03961212, 0.00600069867), (0.231792344, 0.0200179144), (1.01046945, 103.560653)],
    }
}

impl<C: ColorModel> Glass<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the index of refraction of a clear substance",
        properties: &[&[choice("name", NAMES, "which substance")]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let points = sellmeier::points(terms(properties.choice("name")?));
        let value = palette.index(properties, points)?;
        Ok(Self { value })
    }
}

impl<C: ColorModel> Pattern<C> for Glass<C> {
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

    /// The index at the lines d (587.56 nm), F (486.13 nm) and C (656.27 nm), and Abbe's number (n_d − 1)/(n_F − n_C), as
    /// Schott's data sheets and the papers have them.
    #[test]
    fn substances_refract_as_published() {
        for (name, index, abbe) in [
            ("BK7", 1.51680, 64.17),
            ("F2", 1.62004, 36.37),
            ("SF10", 1.72825, 28.41),
            ("fused silica", 1.45846, 67.82),
            ("diamond", 2.4175, 55.3),
            ("water", 1.33341, 55.7),
        ] {
            let points = sellmeier::points(terms(name));
            let at = |nm: f64| {
                let after = points.partition_point(|p| p.0 <= nm);
                let (a, b) = (points[after - 1], points[after]);
                a.1 + (b.1 - a.1) * (nm - a.0) / (b.0 - a.0)
            };
            let (d, f, c) = (at(587.5618), at(486.1327), at(656.2725));
            assert!((d - index).abs() < 1e-4, "{name}: {d}");
            let number = (d - 1.0) / (f - c);
            assert!((number / abbe - 1.0).abs() < 5e-3, "{name}: {number}");
        }
    }

    #[test]
    fn every_name_is_a_substance_of_its_own() {
        for (i, name) in NAMES.iter().enumerate() {
            for other in &NAMES[..i] {
                assert_ne!(terms(name), terms(other));
            }
        }
    }
}
