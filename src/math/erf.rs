//! The error function, by the Chebyshev fit of Press et al. (*Numerical Recipes*, §6.2; within 2·10⁻⁷),
//! and its inverse, by Giles's polynomials (*Approximating the erfinv function*, 2010).

/// 2/√π ∫₀ˣ exp(−t²) dt.
pub fn erf(x: f32) -> f32 {
    const FIT: [f32; 10] = [
        -1.265_512_2,
        1.000_023_7,
        0.374_091_96,
        0.096_784_18,
        -0.186_288_06,
        0.278_868_07,
        -1.135_204,
        1.488_515_9,
        -0.822_152_23,
        0.170_872_77,
    ];
    let t = 1.0 / (1.0 + 0.5 * x.abs());
    let complement = t * (horner(&FIT, t) - x * x).exp();
    (1.0 - complement).copysign(x)
}

/// The x with erf(x) = `y`; `y` is clamped to where that is finite.
pub fn erf_inverse(y: f32) -> f32 {
    const MIDDLE: [f32; 9] = [
        1.501_409_4,
        0.246_640_73,
        -0.004_177_681_6,
        -0.001_253_725,
        0.000_218_580_87,
        -4.391_506_5e-6,
        -3.523_387_7e-6,
        3.432_739_4e-7,
        2.810_226_4e-8,
    ];
    const TAILS: [f32; 9] = [
        2.832_976_8,
        1.001_674,
        0.009_438_87,
        -0.007_622_461,
        0.005_739_508,
        -0.003_673_428_4,
        0.001_349_343_2,
        0.000_100_950_56,
        -0.000_200_214_26,
    ];
    let y = y.clamp(-1f32.next_down(), 1f32.next_down());
    let w = -((1.0 - y) * (1.0 + y)).ln();
    let ratio = if w < 5.0 {
        horner(&MIDDLE, w - 2.5)
    } else {
        horner(&TAILS, w.sqrt() - 3.0)
    };
    ratio * y
}

/// The polynomial with these coefficients, that of 1 first.
fn horner(coefficients: &[f32], x: f32) -> f32 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn erf_is_the_integral_of_the_bell_curve() {
        let (mut sum, step) = (0.0f64, 1e-4);
        for i in 0..40_000 {
            let t = (f64::from(i) + 0.5) * step;
            sum += 2.0 / std::f64::consts::PI.sqrt() * (-t * t).exp() * step;
            let x = (f64::from(i) + 1.0) * step;
            let error = f64::from(erf(x as f32)) - sum;
            assert!(error.abs() < 4e-7, "{x}: {error}");
            assert_eq!(erf(-x as f32), -erf(x as f32));
        }
        assert_eq!(erf(f32::INFINITY), 1.0);
    }

    #[test]
    fn the_inverse_undoes_erf_and_stays_finite() {
        for i in -250..=250 {
            let x = i as f32 * 0.01;
            let slope = 2.0 / std::f32::consts::PI.sqrt() * (-x * x).exp();
            let tolerance = 1e-5 + 4e-7 / slope;
            assert!((erf_inverse(erf(x)) - x).abs() < tolerance, "{x}");
        }
        for y in [-1.0, 1.0, 2.0] {
            assert!(erf_inverse(y).is_finite());
        }
    }
}
