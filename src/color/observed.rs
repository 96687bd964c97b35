//! Spectra as an observer sees them: X, Y, Z of a curve of (nm, value), and whether two are metamers.

use glam::{DMat3, DVec3};

use super::cie;
use super::d65::d65;
use super::primaries::Primaries;
use super::rgb::curve;

/// X, Y, Z of light, Y being ∫ L(λ) ȳ(λ) dλ over that of the observer's curve (equal energy of 1 has Y = 1). Integrated
/// every half nanometre by the trapezoidal rule.
pub fn xyz_of_light(spectrum: &[(f64, f64)]) -> [f64; 3] {
    integrate(|l| curve(spectrum, l))
}

/// X, Y, Z of a reflectance under a light, a white surface having Y = 1; `None` under light that is not seen.
pub fn xyz_of_surface(reflectance: &[(f64, f64)], light: Light<'_>) -> Option<[f64; 3]> {
    let white = integrate(|l| light.at(l))[1];
    let seen = integrate(|l| light.at(l) * curve(reflectance, l));
    (white > 0.0).then(|| seen.map(|v| v / white))
}

/// What a surface is lit by.
#[derive(Clone, Copy, Debug)]
pub enum Light<'a> {
    /// CIE standard illuminant D65.
    D65,
    /// Equal energy at all wavelengths.
    Equal,
    /// Points of (nm, value).
    Curve(&'a [(f64, f64)]),
}

impl Light<'_> {
    fn at(self, lambda: f64) -> f64 {
        match self {
            Self::D65 => d65(lambda as f32).into(),
            Self::Equal => 1.0,
            Self::Curve(points) => curve(points, lambda),
        }
    }
}

fn integrate(spectrum: impl Fn(f64) -> f64) -> [f64; 3] {
    const STEPS: u32 = 940;
    let (first, last) = (f64::from(cie::FIRST), f64::from(cie::LAST));
    let mut sums = [0.0; 3];
    let mut norm = 0.0;
    for i in 0..=STEPS {
        let lambda = first + (last - first) * f64::from(i) / f64::from(STEPS);
        let end = if i == 0 || i == STEPS { 0.5 } else { 1.0 };
        let observer = cie::xyz(lambda as f32).map(f64::from);
        let value = end * spectrum(lambda);
        for (sum, weight) in sums.iter_mut().zip(observer) {
            *sum += value * weight;
        }
        norm += end * observer[1];
    }
    sums.map(|sum| sum / norm)
}

/// What takes linear BT.709 to a display's own values, whose primaries were measured: (SᵀP)⁻¹ M, with the observer's curves
/// S, the primaries' spectra P and the matrix M of BT.709; `None` where the primaries are of no three colours.
pub fn to_display(primaries: [&[(f64, f64)]; 3]) -> Option<[[f64; 3]; 3]> {
    let [red, green, blue] = primaries.map(|p| DVec3::from(xyz_of_light(p)));
    let native = DMat3::from_cols(red, green, blue);
    let bt709 = Primaries::BT709.to_xyz()?;
    let matrix = native.inverse() * bt709;
    let size = red.length() * green.length() * blue.length();
    let valid = native.determinant().abs() > 1e-9 * size && matrix.is_finite();
    valid.then(|| matrix.transpose().to_cols_array_2d())
}

#[cfg(test)]
mod tests {
    use super::super::space::{Space, chromaticity};
    use super::*;

    #[test]
    fn daylight_has_its_chromaticity_and_equal_energy_the_middle() {
        let flat = [(360.0, 1.0), (830.0, 1.0)];
        let xyz = xyz_of_light(&flat);
        assert!(xyz.iter().all(|v| (v - 1.0).abs() < 5e-4), "{xyz:?}");
        let [x, y] = chromaticity(xyz_of_surface(&flat, Light::D65).unwrap());
        assert!(
            (x - 0.3127).abs() < 2e-4 && (y - 0.329).abs() < 2e-4,
            "{x} {y}"
        );
        assert!(xyz_of_surface(&flat, Light::Curve(&[(100.0, 1.0), (200.0, 1.0)])).is_none());
    }

    /// CIE 15:2004, table T.3: illuminant A.
    #[test]
    fn a_lamp_of_2856_kelvin_is_illuminant_a() {
        let planck = |l: f64| (l / 560.0).powi(-5) / ((1.4388e7 / (l * 2856.0)).exp() - 1.0);
        let lamp: Vec<(f64, f64)> = (360..=830).map(|l| (l.into(), planck(l.into()))).collect();
        let [x, y] = chromaticity(xyz_of_light(&lamp));
        assert!(
            (x - 0.4476).abs() < 2e-4 && (y - 0.4074).abs() < 2e-4,
            "{x} {y}"
        );
    }

    #[test]
    fn a_display_shows_the_colour_that_it_is_given() {
        let primary = |nm: f64, width: f64| -> Vec<(f64, f64)> {
            let at = |l: f64| (-((l - nm) / width).powi(2)).exp();
            (360..=830).map(|l| (l.into(), at(l.into()))).collect()
        };
        let primaries = [
            primary(620.0, 20.0),
            primary(530.0, 30.0),
            primary(455.0, 15.0),
        ];
        let matrix = to_display([&primaries[0], &primaries[1], &primaries[2]]).unwrap();
        for rgb in [[1.0, 1.0, 1.0], [0.2, 0.5, 0.1], [1.0, 0.0, 0.0]] {
            let native = matrix.map(|row| (0..3).map(|c| row[c] * rgb[c]).sum::<f64>());
            let shown: Vec<(f64, f64)> = (0..=470)
                .map(|i| {
                    let value: f64 = (0..3).map(|c| native[c] * primaries[c][i].1).sum();
                    (360.0 + i as f64, value)
                })
                .collect();
            let back = Space::Bt709.of_xyz(xyz_of_light(&shown));
            for c in 0..3 {
                assert!((back[c] - rgb[c]).abs() < 1e-6, "{back:?} {rgb:?}");
            }
        }
        let red = primaries[0].as_slice();
        assert!(to_display([red, red, &primaries[2]]).is_none());
    }
}
