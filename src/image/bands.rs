//! Spectral channels by the layout of Fichet, Pacanowski and Wilkie (*An OpenEXR layout for spectral images*, JCGT 10 (3),
//! 2021): `S0.` and a wavelength or a frequency, with a comma in place of the dot, such as `S0.550,5nm`.

use super::Image;

/// A channel of a spectral image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Its index.
    pub channel: usize,
    /// Its wavelength in nm.
    pub nm: f64,
}

/// The speed of light in nm·THz.
const NM_THZ: f64 = 299_792.458;

/// The wavelength in nm that the name of a channel says, if it is a spectral one's.
fn wavelength(name: &str) -> Option<f64> {
    let text = name.strip_prefix("S0.")?;
    let end = text.rfind(|c: char| c.is_ascii_digit())? + 1;
    let (number, unit) = text.split_at(end);
    let number: f64 = number.replace(',', ".").parse().ok()?;
    let nm = match unit {
        "pm" => 1e-3 * number,
        "nm" => number,
        "um" => 1e3 * number,
        "mm" => 1e6 * number,
        "m" => 1e9 * number,
        "Hz" => 1e12 * NM_THZ / number,
        "GHz" => 1e3 * NM_THZ / number,
        "THz" => NM_THZ / number,
        "PHz" => 1e-3 * NM_THZ / number,
        _ => return None,
    };
    (nm > 0.0 && nm.is_finite()).then_some(nm)
}

/// An image's spectral channels without regard to polarisation, wavelengths ascending.
pub fn bands(image: &Image) -> Vec<Band> {
    let names = image.channels().iter().enumerate();
    let band = |(channel, name): (usize, &String)| {
        let nm = wavelength(name)?;
        Some(Band { channel, nm })
    };
    let mut bands: Vec<Band> = names.filter_map(band).collect();
    bands.sort_by(|a, b| a.nm.total_cmp(&b.nm));
    bands
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_wavelengths_or_frequencies() {
        for (name, nm) in [
            ("S0.550,5nm", 550.5),
            ("S0.550nm", 550.0),
            ("S0.5,505e-7m", 550.5),
            ("S0.0,5505um", 550.5),
            ("S0.599,584916THz", 500.0),
        ] {
            let found = wavelength(name).unwrap_or_else(|| panic!("{name}"));
            assert!((found - nm).abs() < 1e-6, "{name}: {found}");
        }
        for name in [
            "R",
            "S0",
            "S0.nm",
            "S1.550nm",
            "S0.550",
            "S0.550parsec",
            "S0.-1nm",
            "S0.0Hz",
        ] {
            assert_eq!(wavelength(name), None, "{name}");
        }
    }

    #[test]
    fn bands_stand_by_wavelength() {
        let names = ["R", "S0.600,0nm", "S0.500,0nm"].map(String::from).to_vec();
        let found = bands(&Image::new(1, 1, names));
        assert_eq!(found.iter().map(|b| b.channel).collect::<Vec<_>>(), [2, 1]);
    }
}
