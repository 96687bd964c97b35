//! RGB of other primaries than ITU-R BT.709's, whose chromaticities an image file may give. Their colours are taken
//! over by way of CIE XYZ (SMPTE RP 177, 1993); white points stay what they are, there is no adaptation.

use glam::{DMat3, DVec3};

use super::model::xyz_to_rgb;

/// The chromaticities x and y (CIE 1931) of an RGB space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primaries {
    /// Of (1, 0, 0).
    pub red: [f64; 2],
    /// Of (0, 1, 0).
    pub green: [f64; 2],
    /// Of (0, 0, 1).
    pub blue: [f64; 2],
    /// Of (1, 1, 1), whose luminance is 1.
    pub white: [f64; 2],
}

impl Primaries {
    /// ITU-R BT.709, whose white is D65.
    pub const BT709: Self = Self {
        red: [0.64, 0.33],
        green: [0.3, 0.6],
        blue: [0.15, 0.06],
        white: [0.3127, 0.329],
    };
    /// P3 with white D65 (SMPTE EG 432-1, 2010).
    pub const P3_D65: Self = Self {
        red: [0.68, 0.32],
        green: [0.265, 0.69],
        blue: [0.15, 0.06],
        white: [0.3127, 0.329],
    };
    /// ITU-R BT.2020.
    pub const BT2020: Self = Self {
        red: [0.708, 0.292],
        green: [0.17, 0.797],
        blue: [0.131, 0.046],
        white: [0.3127, 0.329],
    };
    /// CIE XYZ as if it were RGB.
    pub const XYZ: Self = Self {
        red: [1.0, 0.0],
        green: [0.0, 1.0],
        blue: [0.0, 0.0],
        white: [1.0 / 3.0, 1.0 / 3.0],
    };

    /// Whether the two differ by no more than their figures' rounding.
    pub fn same(&self, other: &Self) -> bool {
        const ROUNDING: f64 = 1e-6;
        let points = |p: &Self| [p.red, p.green, p.blue, p.white];
        let squares = points(self).into_iter().zip(points(other)).map(|(a, b)| {
            let [x, y] = [a[0] - b[0], a[1] - b[1]];
            x * x + y * y
        });
        squares.sum::<f64>() < ROUNDING
    }

    /// What takes this RGB to XYZ; `None` where three such primaries make no space of colours.
    pub fn to_xyz(self) -> Option<DMat3> {
        // Of no luminance yet: the sums X + Y + Z are 1.
        let column = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0 - x - y);
        let shape = DMat3::from_cols(column(self.red), column(self.green), column(self.blue));
        let white = column(self.white) / self.white[1];
        let scaled = shape * DMat3::from_diagonal(shape.inverse() * white);
        let valid = shape.determinant().abs() > 1e-9 && scaled.is_finite();
        valid.then_some(scaled)
    }

    /// What takes linear RGB of these primaries to linear BT.709; `None` where they make no space of colours.
    pub fn to_bt709(&self) -> Option<impl Fn([f32; 3]) -> [f32; 3] + use<>> {
        let to_xyz = self.to_xyz()?;
        let matrix = if self.same(&Self::XYZ) {
            // That of all other XYZ, whose figures are rounded.
            DMat3::from_cols_array_2d(&DMat3::IDENTITY.to_cols_array_2d().map(xyz_to_rgb))
        } else {
            Self::BT709.to_xyz()?.inverse() * to_xyz
        };
        Some(move |rgb: [f32; 3]| {
            (matrix * DVec3::from(rgb.map(f64::from)))
                .as_vec3()
                .to_array()
        })
    }

    /// The luminances of red, green and blue, whose sum is 1; `None` where they make no space of colours.
    pub fn luminances(&self) -> Option<[f64; 3]> {
        Some(self.to_xyz()?.row(1).to_array())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BT2020: Primaries = Primaries::BT2020;

    #[test]
    fn colours_of_other_primaries_become_those_of_bt709() {
        let ap0 = Primaries {
            red: [0.7347, 0.2653],
            green: [0.0, 1.0],
            blue: [0.0001, -0.077],
            white: [0.32168, 0.33767],
        };
        for (primaries, rgb, expected) in [
            (BT2020, [0.228, 0.825, 0.870], [-0.1691, 0.8990, 0.8860]),
            (BT2020, [1.0; 3], [1.0; 3]),
            (Primaries::BT709, [0.5, 2.0, 0.25], [0.5, 2.0, 0.25]),
            (Primaries::XYZ, [0.950456, 1.0, 1.088754], [1.0; 3]),
            // Its white stays a little yellower than D65.
            (ap0, [1.0; 3], [1.047, 0.9945, 0.9153]),
        ] {
            let converted = primaries.to_bt709().unwrap()(rgb);
            for c in 0..3 {
                let error = (converted[c] - expected[c] as f32).abs();
                assert!(error < 1e-3, "{primaries:?}: {converted:?} {expected:?}");
            }
        }
    }

    #[test]
    fn luminances_of_primaries_sum_to_that_of_white() {
        let expected = [0.2126, 0.7152, 0.0722];
        let luminances = Primaries::BT709.luminances().unwrap();
        assert!((0..3).all(|c| (luminances[c] - expected[c]).abs() < 1e-4));
        assert!((BT2020.luminances().unwrap().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn primaries_on_one_line_make_no_colours() {
        let flat = Primaries {
            blue: [0.47, 0.465],
            ..Primaries::BT709
        };
        let dark = Primaries {
            white: [0.3, 0.0],
            ..Primaries::BT709
        };
        let none = Primaries {
            white: [f64::NAN; 2],
            ..Primaries::BT709
        };
        for primaries in [flat, dark, none] {
            assert!(primaries.to_bt709().is_none(), "{primaries:?}");
            assert!(primaries.luminances().is_none(), "{primaries:?}");
        }
    }

    #[test]
    fn rounded_figures_are_the_same_primaries() {
        let rounded = Primaries {
            white: [0.3127, 0.3290001],
            ..Primaries::BT709
        };
        assert!(rounded.same(&Primaries::BT709));
        assert!(!BT2020.same(&Primaries::BT709));
    }
}
