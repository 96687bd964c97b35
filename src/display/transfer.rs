//! From linear light to code values: sRGB (IEC 61966-2-1), a power, and the two curves of HDR (ITU-R BT.2100-2, 2018).

use crate::color::srgb;

/// Nits (cd/m²) of the value 1, diffuse white, on a PQ display (ITU-R BT.2408).
pub const WHITE_NITS: f32 = 203.0;

/// A curve from linear light to codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transfer {
    /// That of sRGB.
    Srgb,
    /// Of a display with this exponent.
    Gamma(f32),
    /// The perceptual quantiser (SMPTE ST 2084): absolute luminance up to 10,000 nits, of which diffuse white has
    /// [`WHITE_NITS`].
    Pq,
    /// Hybrid log-gamma: diffuse white is the code 0.75 (BT.2408).
    Hlg,
}

impl Transfer {
    /// The code in [0, 1] of linear light, of which 1 is diffuse white. NaN becomes 0.
    pub fn encode(self, x: f32) -> f32 {
        let x = if x > 0.0 { x } else { 0.0 };
        match self {
            Self::Srgb => srgb::encode(x.min(1.0)),
            Self::Gamma(exponent) => x.min(1.0).powf(1.0 / exponent),
            Self::Pq => pq(f64::from(x) * f64::from(WHITE_NITS)) as f32,
            Self::Hlg => hlg(f64::from(x) * HLG_WHITE) as f32,
        }
    }
}

/// The code of a luminance in nits.
fn pq(nits: f64) -> f64 {
    const M1: f64 = 2610.0 / 16384.0;
    const M2: f64 = 2523.0 / 4096.0 * 128.0;
    const C1: f64 = 3424.0 / 4096.0;
    const C2: f64 = 2413.0 / 4096.0 * 32.0;
    const C3: f64 = 2392.0 / 4096.0 * 32.0;
    let y = (nits / 10_000.0).min(1.0).powf(M1);
    ((C1 + C2 * y) / (1.0 + C3 * y)).powf(M2)
}

/// The scene light whose code is 0.75.
const HLG_WHITE: f64 = 0.264_962_560_422_007_6;

/// The code of scene light in [0, 1].
fn hlg(x: f64) -> f64 {
    const A: f64 = 0.178_832_77;
    const B: f64 = 1.0 - 4.0 * A;
    let c = 0.5 - A * (4.0 * A).ln();
    let x = x.min(1.0);
    if x <= 1.0 / 12.0 {
        (3.0 * x).sqrt()
    } else {
        A * (12.0 * x - B).ln() + c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of PyPI `colour-science` 0.4.7: `eotf_inverse_ST2084` of nits, and `oetf_BT2100_HLG`.
    #[test]
    fn codes_of_hdr_are_the_published_ones() {
        for (nits, code) in [
            (0.0, 7.309_559_025_783_966e-7),
            (0.005, 0.015_076_399_042_367_94),
            (100.0, 0.508_078_421_517_399),
            (203.0, 0.580_688_881_041_610_9),
            (1000.0, 0.751_827_096_247_041),
            (10_000.0, 1.0),
        ] {
            assert!((pq(nits) - code).abs() < 1e-6, "{nits}: {}", pq(nits));
        }
        for (light, code) in [
            (0.0, 0.0),
            (1.0 / 12.0, 0.5),
            (0.18, 0.672_358_132_127_654_5),
            (HLG_WHITE, 0.75),
            (1.0, 1.0),
        ] {
            assert!((hlg(light) - code).abs() < 1e-4, "{light}: {}", hlg(light));
        }
        assert!((Transfer::Pq.encode(1.0) - 0.580_689).abs() < 1e-5);
        assert!((Transfer::Hlg.encode(1.0) - 0.75).abs() < 1e-5);
    }

    #[test]
    fn every_curve_rises_from_its_least_code_and_takes_anything() {
        for transfer in [
            Transfer::Srgb,
            Transfer::Gamma(2.2),
            Transfer::Pq,
            Transfer::Hlg,
        ] {
            let codes: Vec<f32> = (0..5000)
                .map(|i| transfer.encode(i as f32 * 1e-2))
                .collect();
            assert!(
                codes.windows(2).all(|pair| pair[0] <= pair[1]),
                "{transfer:?}"
            );
            assert!(codes.iter().all(|code| (0.0..=1.0).contains(code)));
            assert_eq!(transfer.encode(f32::NAN), transfer.encode(0.0));
            assert_eq!(transfer.encode(-3.0), transfer.encode(0.0));
            assert_eq!(transfer.encode(f32::INFINITY), 1.0);
        }
        assert!((Transfer::Gamma(2.2).encode(0.5) - 0.729_740).abs() < 1e-5);
    }
}
