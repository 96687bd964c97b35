//! Functions against double precision, and every kind of lanes against single numbers, bit by bit.

use std::num::Wrapping;

use super::*;
use crate::math::random;

/// Numbers in [−1, 1).
fn numbers(key: u64) -> impl Iterator<Item = f32> {
    (0..4096).map(move |i| 2.0 * random::unit(random::bits(key, i)) - 1.0)
}

#[test]
fn functions_are_those_of_double_precision() {
    type Case = (&'static str, fn(f32) -> f32, fn(f64) -> f64, [f32; 2], f64);
    // Errors relative to values above 1, absolute below.
    let cases: [Case; 6] = [
        ("ln", ln, f64::ln, [1e-6, 1e6], 2.0e-7),
        ("sin", |x| sin_cos(x).0, f64::sin, [-50.0, 50.0], 2e-7),
        ("cos", |x| sin_cos(x).1, f64::cos, [-50.0, 50.0], 2e-7),
        (
            "sin 2πu",
            |u| sin_cos_turns(u).0,
            |u| (std::f64::consts::TAU * u).sin(),
            [0.0, 1.0],
            6e-7,
        ),
        ("acos", acos, f64::acos, [-1.0, 1.0], 4e-7),
        (
            "atan2",
            |x| atan2(x, -0.3),
            |x| x.atan2(f64::from(-0.3f32)),
            [-3.0, 3.0],
            4e-7,
        ),
    ];
    for (name, ours, exact, [low, high], tolerance) in cases {
        for u in numbers(1).map(|x| 0.5 * x + 0.5) {
            let x = low + (high - low) * u;
            let expected = exact(x.into());
            let error = (f64::from(ours(x)) - expected).abs() / expected.abs().max(1.0);
            assert!(error < tolerance, "{name} {x}: {error}");
        }
    }
}

#[test]
fn exp_is_that_of_double_precision_and_ends_at_0() {
    for i in -870_000..880_000 {
        let x = i as f32 * 1e-4;
        let exact = f64::from(x).exp();
        let error = (f64::from(exp(x)) / exact - 1.0).abs();
        assert!(error < 1.5e-7, "{x}: {error}");
    }
    let ends = [0.0, -0.0, -87.1, f32::NEG_INFINITY].map(exp);
    assert_eq!(ends, [1.0, 1.0, 0.0, 0.0]);
    assert!(exp(f32::NAN).is_nan() && exp(f32::INFINITY) > 1e38);
}

#[test]
fn angles_are_those_of_the_quadrants() {
    for (y, x) in [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 0.0)] {
        assert_eq!(atan2::<f32>(y, x), y.atan2(x), "{y} {x}");
    }
    assert_eq!(acos::<f32>(2.0), 0.0);
}

/// I₀ by its series, in double precision, where that does not overflow.
#[test]
fn the_logarithm_of_the_bessel_function_is_that_of_its_series() {
    for i in 0..3000 {
        let x = (i as f32 * 0.2).min(600.0);
        let quarter = f64::from(x) * f64::from(x) / 4.0;
        let (mut term, mut sum) = (1.0, 1.0);
        for k in 1..2000 {
            term *= quarter / f64::from(k * k);
            sum += term;
        }
        let error = f64::from(ln_bessel_i0(x)) - f64::ln(sum);
        assert!(error.abs() < 1e-6 + 2e-7 * f64::from(x), "{x}: {error}");
    }
    assert_eq!(ln_bessel_i0(0.0_f32), 0.0);
}

#[test]
fn erf_is_the_integral_of_the_bell_curve() {
    let (mut sum, step) = (0.0f64, 1e-4);
    for i in 0..40_000 {
        let t = (f64::from(i) + 0.5) * step;
        sum += 2.0 / std::f64::consts::PI.sqrt() * (-t * t).exp() * step;
        let x = ((f64::from(i) + 1.0) * step) as f32;
        let error = f64::from(erf(x)) - sum;
        assert!(error.abs() < 4e-7, "{x}: {error}");
        assert_eq!(erf(-x), -erf(x));
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
    for y in [-1.0f32, 1.0, 2.0] {
        assert!(f32::is_finite(erf_inverse(y)));
    }
}

/// Every operation and function of pairs of numbers.
struct Everything<'a>(&'a [[f32; 2]]);

impl Task for Everything<'_> {
    type Output = Vec<Vec<u32>>;

    #[inline(always)]
    fn run<F: Lanes>(self) -> Vec<Vec<u32>> {
        let mut all = Vec::new();
        let numbers: Vec<f32> = self.0.iter().take(11).map(|pair| pair[0]).collect();
        let integers: Vec<u32> = (1..300).collect();
        for pairs in self.0.chunks(F::WIDTH) {
            let a = F::from_fn(|lane| pairs[lane][0]);
            let b = F::from_fn(|lane| pairs[lane][1]);
            let number = |mask| F::select(mask, F::one(), F::zero());
            let (wide_a, wide_b) = (a.widen(), b.widen());
            let (bits_a, bits_b) = (a.to_bits(), b.to_bits());
            let u = Vec3::new(a, b, a * b);
            let v = Vec3::new(b, a - b, a);
            let frame = Frame::along(u.normalize(), v);
            let local = frame.to_local(v);
            let results = [
                a + b,
                a - b,
                a * b,
                a / b,
                -a,
                a.abs().sqrt(),
                a.floor(),
                a.mul_add(b, a),
                a.min(b),
                a.max(b),
                a.clamp(-0.5, 0.5),
                a.copysign(b),
                number(a.lt(b)),
                number(a.le(b)),
                number(a.eq(a)),
                number(!a.lt(b) & b.lt(F::zero()) | a.gt(F::splat(0.9))),
                number(a.lt(b) ^ a.lt(F::zero())),
                number(F::Mask::from_bits(a.lt(b).to_bits())),
                number((a / F::zero()).is_finite()),
                (a * F::splat(1e4)).to_int().to_float(),
                (bits_a + bits_b).from_bits(),
                (bits_a * bits_b - bits_b).from_bits(),
                ((bits_a ^ bits_b) & (bits_a | !bits_b)).from_bits(),
                (bits_a.shl::<5>() ^ bits_b.shr::<7>()).from_bits(),
                number(bits_a.lt(bits_b)),
                number(bits_a.eq(bits_a)),
                bits_a.min(bits_b).from_bits(),
                bits_a.mul_high(bits_b).from_bits(),
                bits_a.reverse_bits().from_bits(),
                Divisor::new(77).divide(bits_a).0.from_bits(),
                Divisor::new(77).divide(bits_a).1.from_bits(),
                F::Int::select(a.lt(b), bits_a, bits_b).from_bits(),
                F::gather(&numbers, bits_a.shr::<28>()),
                F::Int::gather(&integers, bits_b).from_bits(),
                (wide_a * wide_b + wide_a / wide_b - (-wide_b)).narrow(),
                wide_a.abs().sqrt().narrow(),
                wide_a.min(wide_b).narrow(),
                wide_a.max(wide_b).narrow(),
                number(wide_a.lt(wide_b)),
                (wide_a * F::Double::splat(3e8)).to_nearest().from_bits(),
                (wide_a + wide_a).to_nearest().to_float(),
                F::Double::select(wide_a.lt(wide_b), wide_a, F::Double::splat(0.1)).narrow(),
                exp(a * F::splat(90.0)),
                ln(a.abs()),
                sin_cos(a * F::splat(10.0)).0,
                sin_cos(a * F::splat(10.0)).1,
                atan2(a, b),
                acos(a),
                erf(a),
                ln_bessel_i0(a.abs()),
                erf_inverse(a),
                local.x,
                local.y,
                local.z,
                u.cross(v).length(),
            ];
            all.extend((0..pairs.len()).map(|lane| {
                let of_lane = results.iter().map(|result| result.lane(lane).to_bits());
                of_lane.collect()
            }));
        }
        all
    }
}

#[test]
fn every_kernel_computes_the_same_bits() {
    let mut pairs: Vec<[f32; 2]> = numbers(1).zip(numbers(2)).map(|(a, b)| [a, b]).collect();
    pairs.extend([[1.0, 1.0], [-0.5, -0.5], [0.25, -0.0], [0.5, 3.0]].repeat(4));
    let expected = Kernel::all()[0].run(Everything(&pairs));
    assert_eq!(expected.len(), pairs.len());
    for kernel in Kernel::all() {
        let found = kernel.run(Everything(&pairs));
        for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert_eq!(found, expected, "{} {:?}", kernel.name(), pairs[i]);
        }
    }
}

#[test]
fn a_square_is_transposed() {
    struct Square;
    impl Task for Square {
        type Output = Vec<Vec<f32>>;
        #[inline(always)]
        fn run<F: Lanes>(self) -> Vec<Vec<f32>> {
            let mut square = [F::zero(); MAX_LANES];
            for (i, row) in square.iter_mut().enumerate() {
                *row = F::from_fn(|j| (100 * i + j) as f32);
            }
            F::transpose(&mut square);
            let rows = square[..F::WIDTH].iter();
            rows.map(|row| row.row().as_ref().to_vec()).collect()
        }
    }
    for kernel in Kernel::all() {
        let square = kernel.run(Square);
        for (i, row) in square.iter().enumerate() {
            for (j, number) in row.iter().enumerate() {
                assert_eq!(*number, (100 * j + i) as f32, "{}", kernel.name());
            }
        }
    }
}

#[test]
fn small_tables_are_gathered_from_alike() {
    struct Entries;
    impl Task for Entries {
        type Output = Vec<f32>;
        #[inline(always)]
        fn run<F: Lanes>(self) -> Vec<f32> {
            let table = std::array::from_fn(|i| i as f32);
            let mut entries = Vec::new();
            for first in (0..SMALL_TABLE).step_by(F::WIDTH) {
                let index = F::from_fn(|lane| (first + lane) as f32).to_int();
                entries.extend_from_slice(F::gather_small(&table, index).row().as_ref());
            }
            entries
        }
    }
    for kernel in Kernel::all() {
        let expected: Vec<f32> = (0..SMALL_TABLE).map(|i| i as f32).collect();
        assert_eq!(kernel.run(Entries), expected, "{}", kernel.name());
    }
}

#[test]
fn the_lanes_of_a_mask_are_those_that_say_yes() {
    struct Lanes5;
    impl Task for Lanes5 {
        type Output = Vec<usize>;
        #[inline(always)]
        fn run<F: Lanes>(self) -> Vec<usize> {
            F::Mask::from_bits(0b1_0101).lanes().collect()
        }
    }
    for kernel in Kernel::all() {
        let expected = [0, 2, 4];
        let found = kernel.run(Lanes5);
        assert_eq!(found, expected[..found.len()], "{}", kernel.name());
    }
}

#[test]
fn integers_are_divided_and_multiplied_exactly() {
    for divisor in [1_u32, 2, 3, 7, 64, 1023, 65_537, 1 << 30, (1 << 31) - 1] {
        let dividends = (0..70_000).chain([1 << 16, 1 << 31, u32::MAX - 1, u32::MAX]);
        for x in dividends.chain((0..1000).map(|i| divisor.wrapping_mul(i).wrapping_sub(1))) {
            let (quotient, rest) = Divisor::new(divisor).divide(Wrapping(x));
            assert_eq!(
                (quotient.0, rest.0),
                (x / divisor, x % divisor),
                "{x} / {divisor}"
            );
        }
    }
    let together = |x: Long<Wrapping<u32>>| u64::from(x.low.0) | u64::from(x.high.0) << 32;
    for i in 0..1000 {
        let (a, b) = (random::bits(1, i), random::bits(2, i));
        let long = Long::splat(a);
        assert_eq!(together(long.times(b)), a.wrapping_mul(b));
        assert_eq!(together(long + Long::splat(b)), a.wrapping_add(b));
        assert_eq!(together(long.xor_shr::<27, 5>()), a ^ a >> 27);
        assert_eq!(
            Wrapping(a as u32).reverse_bits().0,
            (a as u32).reverse_bits()
        );
        let dimension = b as u32;
        let expected = random::bits(a, dimension);
        assert_eq!(together(super::random::bits(long, dimension)), expected);
        assert_eq!(
            together(super::random::bits_along(long, Wrapping(dimension))),
            expected
        );
        let unit: f32 = super::random::unit(long.high);
        assert_eq!(unit, random::unit(a));
    }
}

#[test]
fn every_key_permutes() {
    for n in [1, 2, 3, 7, 16, 100, 1000] {
        for k in 0..20 {
            let key = Long::splat(random::key(k, 1));
            let mut seen = vec![false; n as usize];
            for i in (0..n).map(Wrapping) {
                let place = super::random::permute::<f32>(i, Divisor::new(n), key);
                seen[place.0 as usize] = true;
            }
            assert!(seen.iter().all(|&s| s), "n = {n}, key {k}");
        }
    }
}
