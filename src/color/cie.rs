//! The CIE 1931 standard colorimetric observer (2° field of view): the colour matching functions x̄, ȳ, z̄
//! every 5 nm from 360 to 830 nm (CIE 15:2004, tables T.4 and T.6), linear in between. A spectrum L has the
//! tristimulus values X = [`NORMALIZATION`] · ∫ L(λ) x̄(λ) dλ, and likewise Y and Z.

use crate::lanes::{Ints as _, Lanes, SMALL_TABLE};

/// The first tabulated wavelength, in nm.
pub const FIRST: f32 = 360.0;
/// The last tabulated wavelength, in nm.
pub const LAST: f32 = 830.0;
/// The distance of two tabulated wavelengths, in nm.
pub const STEP: f32 = 5.0;
/// The number of tabulated wavelengths.
pub const SAMPLES: usize = 95;

/// One over the integral of ȳ, in 1/nm, as Mitsuba 3 has it. The table's own integral is 106.857, so that
/// the constant spectrum 1 has Y = 1.001.
pub const NORMALIZATION: f32 = 1.0 / 106.750_26;

/// The tabulated wavelength at or below `lambda`, with the fraction of the step to the next one in [0, 1];
/// `None` outside [[`FIRST`], [`LAST`]].
pub(super) fn locate(lambda: f32) -> Option<(usize, f32)> {
    if !(FIRST..=LAST).contains(&lambda) {
        return None;
    }
    let position = (lambda - FIRST) / STEP;
    let node = (position as usize).min(SAMPLES - 2);
    Some((node, position - node as f32))
}

/// Where wavelengths in lanes are among the tabulated ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Between<F: Lanes> {
    /// The tabulated wavelength below.
    node: F::Int,
    /// The fraction of the step to the next one.
    t: F,
    inside: F::Mask,
}

impl<F: Lanes> Between<F> {
    /// Of wavelengths in nm.
    #[inline(always)]
    pub(super) fn of(lambda: F) -> Self {
        let place = (lambda - F::splat(FIRST)) * F::splat(1.0 / STEP);
        let node = place.clamp(0.0, (SAMPLES - 2) as f32).to_int();
        Self {
            node,
            t: place - node.to_float(),
            inside: F::splat(FIRST).le(lambda) & lambda.le(F::splat(LAST)),
        }
    }

    /// What a table of [`SAMPLES`] numbers gives there, 0 outside; the last of its places is not looked at.
    #[inline(always)]
    pub(super) fn look_up(&self, table: &[f32; SMALL_TABLE]) -> F {
        let a = F::gather_small(table, self.node);
        let b = F::gather_small(table, self.node + F::Int::splat(1));
        let value = (F::one() - self.t) * a + self.t * b;
        F::select(self.inside, value, F::zero())
    }
}

/// x̄, ȳ and z̄ at `lambda` (nm), 0 outside [[`FIRST`], [`LAST`]].
pub fn xyz(lambda: f32) -> [f32; 3] {
    let Some((i, t)) = locate(lambda) else {
        return [0.0; 3];
    };
    [&X, &Y, &Z].map(|table| (1.0 - t) * table[i] + t * table[i + 1])
}

/// The colour matching function x̄ at the nodes.
#[rustfmt::skip]
pub const X: [f32; SAMPLES] = [
    0.0001299, 0.0002321, 0.0004149, 0.0007416, 0.001368, 0.002236, 0.004243, 0.00765,
    0.01431, 0.02319, 0.04351, 0.07763, 0.13438, 0.21477, 0.2839, 0.3285,
    0.34828, 0.34806, 0.3362, 0.3187, 0.2908, 0.2511, 0.19536, 0.1421,
    0.09564, 0.05795001, 0.03201, 0.0147, 0.0049, 0.0024, 0.0093, 0.0291,
    0.06327, 0.1096, 0.1655, 0.2257499, 0.2904, 0.3597, 0.4334499, 0.5120501,
    0.5945, 0.6784, 0.7621, 0.8425, 0.9163, 0.9786, 1.0263, 1.0567,
    1.0622, 1.0456, 1.0026, 0.9384, 0.8544499, 0.7514, 0.6424, 0.5419,
    0.4479, 0.3608, 0.2835, 0.2187, 0.1649, 0.1212, 0.0874, 0.0636,
    0.04677, 0.0329, 0.0227, 0.01584, 0.01135916, 0.008110916, 0.005790346, 0.004109457,
    0.002899327, 0.00204919, 0.001439971, 0.0009999493, 0.0006900786, 0.0004760213, 0.0003323011, 0.0002348261,
    0.0001661505, 0.000117413, 0.00008307527, 0.00005870652, 0.00004150994, 0.00002935326, 0.00002067383, 0.00001455977,
    0.00001025398, 0.000007221456, 0.000005085868, 0.000003581652, 0.000002522525, 0.000001776509, 0.000001251141,
];

/// The colour matching function ȳ at the nodes.
#[rustfmt::skip]
pub const Y: [f32; SAMPLES] = [
    0.000003917, 0.000006965, 0.00001239, 0.00002202, 0.000039, 0.000064, 0.00012, 0.000217,
    0.000396, 0.00064, 0.00121, 0.00218, 0.004, 0.0073, 0.0116, 0.01684,
    0.023, 0.0298, 0.038, 0.048, 0.06, 0.0739, 0.09098, 0.1126,
    0.13902, 0.1693, 0.20802, 0.2586, 0.323, 0.4073, 0.503, 0.6082,
    0.71, 0.7932, 0.862, 0.9148501, 0.954, 0.9803, 0.9949501, 1.0,
    0.995, 0.9786, 0.952, 0.9154, 0.87, 0.8163, 0.757, 0.6949,
    0.631, 0.5668, 0.503, 0.4412, 0.381, 0.321, 0.265, 0.217,
    0.175, 0.1382, 0.107, 0.0816, 0.061, 0.04458, 0.032, 0.0232,
    0.017, 0.01192, 0.00821, 0.005723, 0.004102, 0.002929, 0.002091, 0.001484,
    0.001047, 0.00074, 0.00052, 0.0003611, 0.0002492, 0.0001719, 0.00012, 0.0000848,
    0.00006, 0.0000424, 0.00003, 0.0000212, 0.00001499, 0.0000106, 0.0000074657, 0.0000052578,
    0.0000037029, 0.0000026078, 0.0000018366, 0.0000012934, 0.00000091093, 0.00000064153, 0.00000045181,
];

/// The colour matching function z̄ at the nodes.
#[rustfmt::skip]
pub const Z: [f32; SAMPLES] = [
    0.0006061, 0.001086, 0.001946, 0.003486, 0.006450001, 0.01054999, 0.02005001, 0.03621,
    0.06785001, 0.1102, 0.2074, 0.3713, 0.6456, 1.0390501, 1.3856, 1.62296,
    1.74706, 1.7826, 1.77211, 1.7441, 1.6692, 1.5281, 1.28764, 1.0419,
    0.8129501, 0.6162, 0.46518, 0.3533, 0.272, 0.2123, 0.1582, 0.1117,
    0.07824999, 0.05725001, 0.04216, 0.02984, 0.0203, 0.0134, 0.008749999, 0.005749999,
    0.0039, 0.002749999, 0.0021, 0.0018, 0.001650001, 0.0014, 0.0011, 0.001,
    0.0008, 0.0006, 0.00034, 0.00024, 0.00019, 0.0001, 0.00004999999, 0.00003,
    0.00002, 0.00001, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_integrate_to_equal_amounts() {
        // Equal-energy white has x = y = 1/3 by construction of the observer.
        for (table, integral) in [(&X, 106.8657), (&Y, 106.857), (&Z, 106.8933)] {
            let sum: f64 = table.iter().map(|&v| f64::from(v)).sum();
            assert!((sum * f64::from(STEP) - integral).abs() < 1e-3, "{sum}");
        }
    }

    #[test]
    fn the_eye_is_most_sensitive_at_555_nm_and_blind_outside_the_table() {
        assert_eq!(xyz(555.0)[1], 1.0);
        assert_eq!(xyz(FIRST), [X[0], Y[0], Z[0]]);
        assert_eq!(xyz(LAST), [X[94], Y[94], Z[94]]);
        for lambda in [359.9, 830.1, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(xyz(lambda), [0.0; 3]);
        }
    }

    #[test]
    fn between_two_entries_the_functions_are_linear() {
        let [x, y, z] = xyz(451.25);
        assert!((x - (0.75 * 0.3362 + 0.25 * 0.3187)).abs() < 1e-6);
        assert!((y - (0.75 * 0.038 + 0.25 * 0.048)).abs() < 1e-7);
        assert!((z - (0.75 * 1.77211 + 0.25 * 1.7441)).abs() < 1e-6);
    }
}
