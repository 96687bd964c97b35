//! Elementary functions in lanes, without branches or tables. As they consist of operations that every processor does
//! alike, so are their results, which cannot be said of a system's own.

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, LOG2_E, PI, TAU};

use super::{Ints as _, Lanes};

/// ln 2 in two parts, the first of few enough digits for an exponent times it to be exact (Cody and Waite, *Software
/// manual for the elementary functions*, 1980).
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];

/// The polynomial with these coefficients, that of 1 first.
#[inline(always)]
fn horner<F: Lanes, const N: usize>(coefficients: [f32; N], x: F) -> F {
    let mut sum = F::splat(coefficients[N - 1]);
    let mut i = N - 1;
    while i > 0 {
        i -= 1;
        sum = sum * x + F::splat(coefficients[i]);
    }
    sum
}

/// eˣ within 2 units in the last place; 0 below −87, and x = 88 stands for all beyond it.
///
/// x = n·ln 2 + r with |r| ≤ ½ ln 2, of which eʳ is Taylor's polynomial and 2ⁿ is made of its bits.
#[inline(always)]
pub fn exp<F: Lanes>(x: F) -> F {
    /// 1.5·2²³: added to a number, it leaves the nearest integer in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    // In this order what is no number stays so.
    let within = F::splat(-87.0).max(F::splat(88.0).min(x));
    let rounded = within * F::splat(LOG2_E) + F::splat(ROUND);
    let n = rounded - F::splat(ROUND);
    let r = within - n * F::splat(LN_2[0]) - n * F::splat(LN_2[1]);
    let taylor = [
        0.5,
        1.0 / 6.0,
        1.0 / 24.0,
        1.0 / 120.0,
        1.0 / 720.0,
        1.0 / 5040.0,
    ];
    let series = r * r * horner(taylor, r);
    let power = rounded.to_bits().shl::<23>() + F::Int::splat(1f32.to_bits());
    let value = (F::one() + (r + series)) * power.from_bits();
    F::select(x.lt(F::splat(-87.0)), F::zero(), value)
}

/// The natural logarithm of normal numbers above 0, within 2 units in the last place (Cephes' `logf`).
#[inline(always)]
pub fn ln<F: Lanes>(x: F) -> F {
    const FIT: [f32; 9] = [
        3.333_333e-1,
        -2.499_999_4e-1,
        2.000_071_5e-1,
        -1.666_805_8e-1,
        1.424_932_3e-1,
        -1.242_014_1e-1,
        1.167_699_9e-1,
        -1.151_461e-1,
        7.037_683_6e-2,
    ];
    let bits = x.to_bits();
    let exponent = (bits.shr::<23>() - F::Int::splat(126)).to_float();
    let fraction = (bits & F::Int::splat(0x007f_ffff)) | F::Int::splat(0x3f00_0000);
    let fraction = fraction.from_bits();
    let low = fraction.lt(F::splat(FRAC_1_SQRT_2));
    let exponent = F::select(low, exponent - F::one(), exponent);
    let m = F::select(low, fraction + fraction, fraction) - F::one();
    let m2 = m * m;
    let tail = horner(FIT, m) * m * m2 + exponent * F::splat(LN_2[1]) - F::splat(0.5) * m2;
    m + tail + exponent * F::splat(LN_2[0])
}

/// x to the power of `y`; what is below the least normal number, also 0, counts as that.
#[inline(always)]
pub fn pow<F: Lanes>(x: F, y: F) -> F {
    exp(y * ln(x.max(F::splat(f32::MIN_POSITIVE))))
}

/// Sine and cosine for |x| ≤ π/4.
#[inline(always)]
pub(super) fn sin_cos_small<F: Lanes>(x: F) -> (F, F) {
    let x2 = x * x;
    let sin = horner([-1.666_665_5e-1, 8.332_161e-3, -1.951_529_6e-4], x2) * x2 * x + x;
    let cos = horner([4.166_664_6e-2, -1.388_731_6e-3, 2.443_315_7e-5], x2) * x2 * x2
        - F::splat(0.5) * x2
        + F::one();
    (sin, cos)
}

/// Sine and cosine within 2·10⁻⁷, for |x| up to some thousands (Cephes' `sinf` and `cosf`).
#[inline(always)]
pub fn sin_cos<F: Lanes>(x: F) -> (F, F) {
    /// π/2 in three parts.
    const PARTS: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];
    let quarters = (x * F::splat(FRAC_2_PI) + F::splat(0.5)).floor();
    let r = x - quarters * F::splat(PARTS[0]);
    let r = r - quarters * F::splat(PARTS[1]);
    let r = r - quarters * F::splat(PARTS[2]);
    let (sin, cos) = sin_cos_small(r);
    let (one, two) = (F::Int::splat(1), F::Int::splat(2));
    let quarter = quarters.to_int();
    let odd = (quarter & one).eq(one);
    let (a, b) = (F::select(odd, cos, sin), F::select(odd, sin, cos));
    let sin_minus = (quarter & two).eq(two);
    let cos_minus = ((quarter + one) & two).eq(two);
    (F::select(sin_minus, -a, a), F::select(cos_minus, -b, b))
}

/// Sine and cosine of 2π·u.
#[inline(always)]
pub fn sin_cos_turns<F: Lanes>(u: F) -> (F, F) {
    sin_cos(u * F::splat(TAU))
}

/// The angle of (x, y) in [−π, π], within 3·10⁻⁷; 0 for (0, 0) (Cephes' `atanf`).
#[inline(always)]
pub fn atan2<F: Lanes>(y: F, x: F) -> F {
    const FIT: [f32; 4] = [
        -3.333_295e-1,
        1.997_771_1e-1,
        -1.387_768_6e-1,
        8.053_744_6e-2,
    ];
    /// tan π/8.
    const EIGHTH: f32 = 0.414_213_57;
    let (high, wide) = (y.abs(), x.abs());
    let steep = wide.lt(high);
    let (small, large) = (high.min(wide), high.max(wide));
    let ratio = F::select(large.eq(F::zero()), F::zero(), small / large);
    let above = F::splat(EIGHTH).lt(ratio);
    let reduced = F::select(above, (ratio - F::one()) / (ratio + F::one()), ratio);
    let r2 = reduced * reduced;
    let angle = horner(FIT, r2) * r2 * reduced + reduced;
    let angle = F::select(above, angle + F::splat(FRAC_PI_4), angle);
    let angle = F::select(steep, F::splat(FRAC_PI_2) - angle, angle);
    let angle = F::select(x.lt(F::zero()), F::splat(PI) - angle, angle);
    angle.copysign(y)
}

/// The angle in [0, π] whose cosine is `x`, of which what lies beyond ±1 is cut off.
#[inline(always)]
pub fn acos<F: Lanes>(x: F) -> F {
    let x = x.clamp(-1.0, 1.0);
    atan2(((F::one() - x) * (F::one() + x)).sqrt(), x)
}

/// The logarithm of the modified Bessel function I₀ for x ≥ 0, within 3·10⁻⁷ and its own rounding (Abramowitz and Stegun,
/// *Handbook of Mathematical Functions*, 9.8.1 and 9.8.2).
#[inline(always)]
pub fn ln_bessel_i0<F: Lanes>(x: F) -> F {
    const NEAR: [f32; 7] = [
        1.0,
        3.515_622_9,
        3.089_942_4,
        1.206_749_2,
        0.265_973_2,
        0.036_076_8,
        0.004_581_3,
    ];
    const FAR: [f32; 9] = [
        0.398_942_3,
        0.013_285_92,
        0.002_253_19,
        -0.001_575_65,
        0.009_162_81,
        -0.020_577_06,
        0.026_355_37,
        -0.016_476_33,
        0.003_923_77,
    ];
    const SEAM: f32 = 3.75;
    let near = x.lt(F::splat(SEAM));
    let t = x * F::splat(1.0 / SEAM);
    let t2 = t.min(F::one());
    let low = horner(NEAR, t2 * t2);
    let beyond = x.max(F::splat(SEAM));
    let high = horner(FAR, F::splat(SEAM) / beyond) / beyond.sqrt();
    ln(F::select(near, low, high)) + F::select(near, F::zero(), beyond)
}

/// 2/√π ∫₀ˣ exp(−t²) dt, within 4·10⁻⁷ (the Chebyshev fit of Press et al., *Numerical Recipes*, §6.2).
#[inline(always)]
pub fn erf<F: Lanes>(x: F) -> F {
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
    let t = F::one() / (F::one() + F::splat(0.5) * x.abs());
    let complement = t * exp(horner(FIT, t) - x * x);
    (F::one() - complement).copysign(x)
}

/// The x with erf(x) = `y`; `y` is clamped to where that is finite (Giles, *Approximating the erfinv function*, 2010).
#[inline(always)]
pub fn erf_inverse<F: Lanes>(y: F) -> F {
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
    let w = -ln((F::one() - y) * (F::one() + y));
    let middle = horner(MIDDLE, w - F::splat(2.5));
    let tails = horner(TAILS, w.sqrt() - F::splat(3.0));
    F::select(w.lt(F::splat(5.0)), middle, tails) * y
}
