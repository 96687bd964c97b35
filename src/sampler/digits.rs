//! Binary digits: the first sixteen of Sobol's sequences (with Joe and Kuo's direction numbers, *Constructing
//! Sobol sequences with better two-dimensional projections*, 2008), and Owen's scrambling of them by a hash.
//!
//! Fractions are held as 32 bits *reversed*, the lowest bit standing for ½. The first sequence (van der
//! Corput's) is then the index itself. The second has as its bit k the sum modulo 2 of the index's bits j
//! for which C(j, k) is odd, which by Lucas' theorem are those whose binary digits include k's: five steps,
//! whatever the index. Owen's scrambling (*Randomly permuted (t,m,s)-nets*, 1995) flips each bit by a random
//! function of all bits above it, which here are those below it: integer operations carry that way, and a
//! few of them make a hash of this kind (Laine and Karras, *Stratified sampling for stochastic
//! transparency*, 2011; Burley, *Practical hash-based Owen scrambling*, 2020; constants by Vegdahl,
//! *Building a better LK hash*, 2021).

use crate::lanes::random::unit;
use crate::lanes::{Ints, Lanes};

/// The second sequence's element `index`, reversed.
#[inline(always)]
pub(super) fn second<I: Ints>(index: I) -> I {
    let index = index ^ (index.shr::<1>() & I::splat(0x5555_5555));
    let index = index ^ (index.shr::<2>() & I::splat(0x3333_3333));
    let index = index ^ (index.shr::<4>() & I::splat(0x0f0f_0f0f));
    let index = index ^ (index.shr::<8>() & I::splat(0x00ff_00ff));
    index ^ index.shr::<16>()
}

/// How many of Sobol's sequences there are here.
pub(super) const SEQUENCES: usize = 16;

/// Their primitive polynomials (degree, and the coefficients between the first and the last as bits) and first
/// direction numbers, of which each ends at its degree. The first sequence has neither.
const POLYNOMIALS: [(usize, u32, [u32; 6]); SEQUENCES] = [
    (0, 0, [0; 6]),
    (1, 0, [1, 0, 0, 0, 0, 0]),
    (2, 1, [1, 3, 0, 0, 0, 0]),
    (3, 1, [1, 3, 1, 0, 0, 0]),
    (3, 2, [1, 1, 1, 0, 0, 0]),
    (4, 1, [1, 1, 3, 3, 0, 0]),
    (4, 4, [1, 3, 5, 13, 0, 0]),
    (5, 2, [1, 1, 5, 5, 17, 0]),
    (5, 4, [1, 1, 5, 5, 5, 0]),
    (5, 7, [1, 1, 7, 11, 19, 0]),
    (5, 11, [1, 1, 5, 1, 1, 0]),
    (5, 13, [1, 1, 1, 3, 11, 0]),
    (5, 14, [1, 3, 5, 5, 31, 0]),
    (6, 1, [1, 3, 3, 9, 7, 49]),
    (6, 13, [1, 1, 1, 15, 21, 21]),
    (6, 16, [1, 3, 1, 13, 27, 49]),
];

/// All direction numbers, reversed: of each bit of an index, those of all sequences.
const DIRECTIONS: [[u32; SEQUENCES]; 32] = {
    let mut all = [[0; SEQUENCES]; 32];
    let mut sequence = 0;
    while sequence < SEQUENCES {
        let of_one = directions(POLYNOMIALS[sequence]);
        let mut bit = 0;
        while bit < 32 {
            all[bit][sequence] = of_one[bit];
            bit += 1;
        }
        sequence += 1;
    }
    all
};

const fn directions((degree, between, first): (usize, u32, [u32; 6])) -> [u32; 32] {
    let mut v = [0; 32];
    let mut i = 0;
    while i < 32 {
        v[i] = if degree == 0 {
            1 << i
        } else if i < degree {
            first[i].reverse_bits() >> (31 - i)
        } else {
            let mut sum = v[i - degree] ^ (v[i - degree] << degree);
            let mut lag = 1;
            while lag < degree {
                if between >> (degree - 1 - lag) & 1 == 1 {
                    sum ^= v[i - lag];
                }
                lag += 1;
            }
            sum
        };
        i += 1;
    }
    v
}

/// Elements `index`, below 2^`bits`, of some sequences, reversed.
#[inline(always)]
pub(super) fn sobol<I: Ints, const N: usize>(sequences: [usize; N], index: I, bits: u32) -> [I; N] {
    let (mut sums, mut index) = ([I::splat(0); N], index);
    for directions in &DIRECTIONS[..bits as usize] {
        let chosen = I::splat(0) - (index & I::splat(1));
        for n in 0..N {
            sums[n] = sums[n] ^ (chosen & I::splat(directions[sequences[n]]));
        }
        index = index.shr::<1>();
    }
    sums
}

/// Owen's scrambling of a reversed fraction, one for each seed.
#[inline(always)]
pub(super) fn scramble<I: Ints>(reversed: I, seed: I) -> I {
    let x = reversed ^ (reversed * I::splat(0x3d20_adea));
    let x = (x + seed) * (seed.shr::<16>() | I::splat(1));
    let x = x ^ (x * I::splat(0x0552_6c56));
    x ^ (x * I::splat(0x53a2_2864))
}

/// An index's place in a shuffle of 0..`n`, a power of two, that keeps every aligned block of 2^k indices
/// together, so that the first 2^k points are a net, and so are the next.
#[inline(always)]
pub(super) fn shuffle<I: Ints>(index: I, n: u32, seed: I) -> I {
    scramble(index.reverse_bits(), seed).reverse_bits() & I::splat(n - 1)
}

/// The fraction in [0, 1), cut to 24 bits.
#[inline(always)]
pub(super) fn fraction<F: Lanes>(reversed: F::Int) -> F {
    unit(reversed.reverse_bits())
}

#[cfg(test)]
mod tests {
    use std::num::Wrapping;

    use super::*;

    /// By the recurrence of its direction numbers: v₀ = ½, vⱼ₊₁ = vⱼ ⊕ vⱼ/2.
    fn second_by_definition(index: u32) -> u32 {
        let (mut v, mut sum) = (1_u32 << 31, 0);
        for j in 0..32 {
            if index >> j & 1 == 1 {
                sum ^= v;
            }
            v ^= v >> 1;
        }
        sum
    }

    #[test]
    fn the_second_sequence_is_that_of_its_direction_numbers() {
        for i in (0..1000).chain([u32::MAX, 0xdead_beef, 1 << 31]) {
            let found = second(Wrapping(i)).0;
            assert_eq!(found.reverse_bits(), second_by_definition(i), "{i}");
        }
    }

    #[test]
    fn sequences_are_those_of_joe_and_kuo() {
        let element = |sequence, i, bits| fraction::<f32>(sobol([sequence], Wrapping(i), bits)[0]);
        let eighths =
            |sequence| [1, 2, 3, 4, 5, 6, 7].map(|i| (element(sequence, i, 3) * 8.0) as u32);
        assert_eq!(eighths(2), [4, 6, 2, 3, 7, 5, 1]);
        assert_eq!(eighths(3), [4, 6, 2, 1, 5, 7, 3]);
        // Element 731 as SciPy 1.17 gives it (`qmc.Sobol(16, scramble=False)`, in its order number 877).
        let expected = [
            877, 695, 959, 1009, 259, 917, 219, 741, 1005, 899, 803, 113, 97, 653, 783, 1015,
        ];
        for (sequence, expected) in expected.into_iter().enumerate() {
            assert_eq!(
                element(sequence, 731, 10) * 1024.0,
                expected as f32,
                "{sequence}"
            );
        }
        for i in (0..1000).map(Wrapping) {
            assert_eq!(sobol([0, 1], i, 10), [i, second(i)]);
        }
    }

    #[test]
    fn scrambling_permutes_the_halves_of_every_interval_and_shuffling_blocks_of_indices() {
        for seed in [0, 1, 0x1234_5678, u32::MAX].map(Wrapping) {
            for k in 1..=10 {
                let n = 1_u32 << k;
                let mut seen = vec![[false; 2]; n as usize];
                for i in (0..n).map(Wrapping) {
                    seen[(scramble(i, seed).0 & (n - 1)) as usize][0] = true;
                    seen[shuffle(i, n, seed).0 as usize][1] = true;
                }
                assert!(seen.iter().all(|s| *s == [true; 2]), "{seed} {k}");
                let half = |i| shuffle(Wrapping(i), n, seed).0 / n.div_ceil(2);
                assert!((0..n / 2).all(|i| half(i) == half(0)));
            }
        }
    }
}
