//! Indices of refraction: `int_ior` and `ext_ior` as a number or the name of a substance (after Hecht,
//! *Optics*, 4th ed., at about 589 nm), and a conductor's `eta` and `k` or its `material`, looked up in
//! `conductors.txt`.

use super::fresnel;
use crate::color::{Bands, Color, ColorModel, Role, Spectral as _};
use crate::description::declared::{self, Row, string, substance, texture};
use crate::description::properties::STRICT;
use crate::description::{Properties, Value};
use crate::error::{Error, Result};
use crate::interaction::Points;
use crate::lanes::Lanes;
use crate::texture::{Palette, Palettes, Texture};

/// Substances by name and index.
const SUBSTANCES: &[(&str, f64)] = &[
    ("vacuum", 1.0),
    ("helium", 1.000036),
    ("hydrogen", 1.000132),
    ("air", 1.000277),
    ("carbon dioxide", 1.00045),
    ("water", 1.3330),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.52045),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.470),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.5750),
    ("diamond", 2.419),
];

/// The indices on both sides of a boundary.
pub(super) const fn dielectric(interior: &'static str) -> [Row; 2] {
    [
        substance("int_ior", interior, "index of refraction on the inside").positive(),
        substance("ext_ior", "air", "index of refraction on the outside").positive(),
    ]
}

/// The same, which may depend on wavelength.
pub(super) const fn dispersive(interior: &'static str) -> [Row; 2] {
    [
        declared::index("int_ior", interior, "index of refraction on the inside").positive(),
        declared::index("ext_ior", "air", "index of refraction on the outside").positive(),
    ]
}

/// A metal's index.
pub(super) const CONDUCTOR: &[Row] = &[
    string(
        "material",
        "none",
        "a metal by its symbol, such as Au; none is a perfect mirror",
    ),
    texture("eta", 0.0, "the index's real part; not beside material"),
    texture("k", 1.0, "the extinction coefficient"),
];

/// The index on the inside over that on the outside.
pub(super) fn relative(properties: &Properties<'_>) -> Result<f32> {
    Ok((index(properties, "int_ior")? / index(properties, "ext_ior")?) as f32)
}

/// Fraunhofer's line D, in nm, at which an index is told that is one number.
const YELLOW: f32 = 589.3;

/// As [`relative`], of spectra their values at 589.3 nm.
pub(super) fn relative_of_yellow(properties: &Properties<'_>) -> Result<f32> {
    let yellow = Palettes::new(Bands::<1>::visible(1).expect("one band is possible"));
    let index = |name| match medium(properties, &yellow, name)? {
        Medium::Same(index) => Ok::<_, Error>(index),
        Medium::Spectrum(spectrum) => Ok(f64::from(spectrum.at(YELLOW))),
    };
    Ok((index("int_ior")? / index("ext_ior")?) as f32)
}

/// The index of refraction on a side of a boundary.
#[derive(Clone, Debug)]
pub(super) enum Medium<C: ColorModel> {
    /// The same at all wavelengths.
    Same(f64),
    /// Over wavelength.
    Spectrum(C::Stored),
}

impl<C: ColorModel> Medium<C> {
    /// At a path's wavelengths.
    #[inline(always)]
    pub(super) fn at(&self, wavelengths: &C::Wavelengths) -> C::Sample {
        match self {
            Self::Same(index) => C::Sample::splat(*index as f32),
            Self::Spectrum(stored) => C::evaluate(stored, wavelengths),
        }
    }
}

/// The index that the property `name` gives.
pub(super) fn medium<C: ColorModel>(
    properties: &Properties<'_>,
    palettes: &Palettes<C>,
    name: &'static str,
) -> Result<Medium<C>> {
    let property = match properties.value(name) {
        Some(property) if matches!(property.value, Value::Spectrum(_) | Value::Object(_)) => {
            property
        }
        _ => return Ok(Medium::Same(index(properties, name)?)),
    };
    if properties.is_strict() {
        let message = format!("{name:?} over wavelength is Étendue's own");
        return Err(properties.error(name, message).help(STRICT));
    }
    let palette: &Palette<C> = &palettes.colors;
    let Some(stored) = palette.spectrum(properties, property, Role::Quantity)? else {
        return Err(properties.error(
            name,
            format!("{name:?} is a number, a substance or a spectrum"),
        ));
    };
    for u in [0.0, 0.5, 1f32.next_down()] {
        let indices = C::evaluate(&stored, &palette.color.wavelengths(|| u));
        for channel in 0..C::Sample::LANES {
            let index = indices[channel];
            if !(index > 0.0 && index.is_finite()) {
                let message = format!(
                    "an index of refraction is above 0 at all wavelengths of the bands, and {index} is not"
                );
                return Err(properties.error(name, message));
            }
        }
    }
    Ok(Medium::Spectrum(stored))
}

/// As [`relative`], for models that need the two to differ.
pub(super) fn relative_and_different(properties: &Properties<'_>) -> Result<f32> {
    different(properties, relative(properties)?)
}

/// The index, unless it is 1.
pub(super) fn different(properties: &Properties<'_>, eta: f32) -> Result<f32> {
    if eta == 1.0 {
        let message =
            "int_ior and ext_ior must differ: an interface between equal media is invisible";
        return Err(properties
            .error("int_ior", message)
            .help(r#"<bsdf type="null"/> is an invisible surface"#));
    }
    Ok(eta)
}

fn index(properties: &Properties<'_>, name: &'static str) -> Result<f64> {
    let given = properties.value(name).map(|property| &property.value);
    match given {
        None | Some(Value::String(_)) => substance_index(properties.string(name)?)
            .map_err(|error| error.at(properties.location())),
        Some(_) => properties.float(name),
    }
}

fn substance_index(name: &str) -> Result<f64> {
    let wanted = name.to_lowercase();
    let names = || SUBSTANCES.iter().map(|(name, _)| *name);
    SUBSTANCES
        .iter()
        .find(|(name, _)| *name == wanted)
        .map(|(_, index)| *index)
        .ok_or_else(|| {
            Error::input(format!("no index of refraction is known for \"{name}\""))
                .suggest(&wanted, names())
                .help(format!(
                    "there are {}",
                    names().collect::<Vec<_>>().join(", ")
                ))
        })
}

/// A conductor's index of refraction n + ik over wavelength.
#[derive(Clone, Debug)]
pub(super) struct Complex<C: ColorModel> {
    /// n.
    pub(super) eta: Texture<C>,
    /// The extinction coefficient k.
    pub(super) k: Texture<C>,
}

impl<C: ColorModel> Complex<C> {
    /// From `eta` and `k`, by default those of a perfect mirror (0 and 1), or from `material`.
    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let material = properties.string("material")?;
        if material != "none" {
            let name = material;
            if properties.has("eta") {
                return Err(properties.error("eta", "give either material or eta and k"));
            }
            let (eta, k) = conductor(name).map_err(|e| properties_error(properties, e))?;
            let palette = palettes.colors.with_role(Role::Tabulated);
            let uniform = |curve| {
                palette
                    .uniform(&Color::Curve(curve))
                    .map_err(|e| properties.error("material", e))
            };
            return Ok(Self {
                eta: uniform(eta)?,
                k: uniform(k)?,
            });
        }
        let texture = |name| palettes.colors.texture(properties, name, Role::Quantity);
        Ok(Self {
            eta: texture("eta")?,
            k: texture("k")?,
        })
    }
}

impl<C: ColorModel> Complex<C> {
    /// Fresnel's reflectance at the cosine `cos_i`.
    #[inline(always)]
    pub(super) fn fresnel<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        cos_i: F,
        w: &[C::Wavelengths],
    ) -> C::Columns<F> {
        fresnel::conductor(cos_i, self.eta.eval_lanes(at, w), self.k.eval_lanes(at, w))
    }
}

fn properties_error(properties: &Properties<'_>, error: Error) -> Error {
    let located = properties.value("material").map(|p| &p.location);
    error.at(located.unwrap_or(properties.location()))
}

/// Wavelengths in nm with a value for each.
type Curve = Vec<(f64, f64)>;

/// n and k of the conductor called `name`.
fn conductor(name: &str) -> Result<(Curve, Curve)> {
    let lines = || {
        include_str!("conductors.txt")
            .lines()
            .filter(|line| !line.starts_with('#'))
            .filter_map(|line| line.split_once(' '))
    };
    let Some((_, data)) = lines().find(|(n, _)| *n == name) else {
        let names = || lines().map(|(name, _)| name);
        return Err(Error::input(format!("unknown conductor \"{name}\""))
            .suggest(name, names())
            .help(format!(
                "there are none (a perfect mirror), {}",
                names().collect::<Vec<_>>().join(", ")
            )));
    };
    let numbers: Vec<f64> = data
        .split(' ')
        .map(|number| number.parse().expect("the table holds numbers"))
        .collect();
    let curve = |column: usize| numbers.chunks_exact(3).map(|p| (p[0], p[column])).collect();
    Ok((beyond(curve(1)), beyond(curve(2))))
}

/// With the values at the ends of the table beyond them, where bands may lie.
fn beyond(mut curve: Curve) -> Curve {
    const FARTHEST: f64 = 1e7;
    if let (Some(first), Some(last)) = (curve.first().copied(), curve.last().copied()) {
        curve.insert(0, (0.0, first.1));
        curve.push((FARTHEST, last.1));
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;

    #[test]
    fn every_conductor_has_increasing_wavelengths_and_physical_values() {
        let mut count = 0;
        for line in include_str!("conductors.txt").lines() {
            if line.starts_with('#') {
                continue;
            }
            count += 1;
            let name = line.split(' ').next().unwrap();
            assert_eq!(line.split(' ').count() % 3, 1, "{name}");
            let (eta, k) = conductor(name).unwrap();
            assert!(eta.len() >= 5, "{name}");
            assert!(eta.windows(2).all(|w| w[0].0 < w[1].0), "{name}");
            assert!(eta.iter().all(|p| p.1 >= 0.0 && p.1 < 15.0), "{name}");
            assert!(k.iter().all(|p| p.1 >= 0.0 && p.1 < 15.0), "{name}");
        }
        assert_eq!(count, 40);
    }

    /// Mitsuba 3.9.1 `scalar_rgb`, the parameters of a conductor of gold: by name, then with the same table
    /// written in the scene.
    #[test]
    fn gold_is_as_yellow_as_in_mitsuba() {
        let (eta, k) = conductor("Au").unwrap();
        let (table, given) = (Role::Tabulated, Role::Quantity);
        for (curve, role, expected) in [
            (&eta, table, [0.143_036, 0.375_307, 1.442_05]),
            (&k, table, [3.983, 2.385_56, 1.603_36]),
            (&eta, given, [0.079_870_5, 0.404_652, 1.558_97]),
            (&k, given, [3.386_75, 2.500_71, 1.768_91]),
        ] {
            let rgb = Rgb.store(&Color::Curve(curve.clone()), role).unwrap();
            for c in 0..3 {
                assert!(
                    (rgb[c] / expected[c] - 1.0).abs() < 3e-3,
                    "{rgb:?} {expected:?}"
                );
            }
        }
    }

    #[test]
    fn names_that_are_not_known_are_refused_with_a_suggestion() {
        let message = substance_index("diamnd").unwrap_err().to_string();
        assert!(message.contains("diamond"), "{message}");
        let message = conductor("AU").unwrap_err().to_string();
        assert!(message.contains("Au"), "{message}");
        assert_eq!(substance_index("BK7").unwrap(), 1.5046);
    }
}
