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

/// The second sequence's element `index`, reversed.
#[inline]
pub(super) fn second(mut index: u32) -> u32 {
    index ^= (index >> 1) & 0x5555_5555;
    index ^= (index >> 2) & 0x3333_3333;
    index ^= (index >> 4) & 0x0f0f_0f0f;
    index ^= (index >> 8) & 0x00ff_00ff;
    index ^ (index >> 16)
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

/// All direction numbers, reversed.
const DIRECTIONS: [[u32; 32]; SEQUENCES] = {
    let mut all = [[0; 32]; SEQUENCES];
    let mut sequence = 0;
    while sequence < SEQUENCES {
        all[sequence] = directions(POLYNOMIALS[sequence]);
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

/// Element `index`, below 2^`bits`, of a sequence, reversed.
#[inline]
pub(super) fn sobol(sequence: usize, index: u32, bits: u32) -> u32 {
    let chosen = (0..bits).zip(&DIRECTIONS[sequence]);
    chosen.fold(0, |sum, (j, v)| sum ^ (v & (index >> j & 1).wrapping_neg()))
}

/// Owen's scrambling of a reversed fraction, one for each seed.
#[inline]
pub(super) fn scramble(mut reversed: u32, seed: u32) -> u32 {
    reversed ^= reversed.wrapping_mul(0x3d20_adea);
    reversed = reversed.wrapping_add(seed);
    reversed = reversed.wrapping_mul((seed >> 16) | 1);
    reversed ^= reversed.wrapping_mul(0x0552_6c56);
    reversed ^ reversed.wrapping_mul(0x53a2_2864)
}

/// An index's place in a shuffle of 0..`n`, a power of two, that keeps every aligned block of 2^k indices
/// together, so that the first 2^k points are a net, and so are the next.
#[inline]
pub(super) fn shuffle(index: u32, n: u32, seed: u32) -> u32 {
    scramble(index.reverse_bits(), seed).reverse_bits() & (n - 1)
}

/// The fraction in [0, 1), cut to 24 bits.
#[inline]
pub(super) fn fraction(reversed: u32) -> f32 {
    (reversed.reverse_bits() >> 8) as f32 * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
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
            assert_eq!(second(i).reverse_bits(), second_by_definition(i), "{i}");
        }
    }

    #[test]
    fn sequences_are_those_of_joe_and_kuo() {
        let eighths = |sequence| {
            [1, 2, 3, 4, 5, 6, 7].map(|i| (fraction(sobol(sequence, i, 3)) * 8.0) as u32)
        };
        assert_eq!(eighths(2), [4, 6, 2, 3, 7, 5, 1]);
        assert_eq!(eighths(3), [4, 6, 2, 1, 5, 7, 3]);
        // Element 731 as SciPy 1.17 gives it (`qmc.Sobol(16, scramble=False)`, in its order number 877).
        let expected = [
            877, 695, 959, 1009, 259, 917, 219, 741, 1005, 899, 803, 113, 97, 653, 783, 1015,
        ];
        for (sequence, expected) in expected.into_iter().enumerate() {
            let element = fraction(sobol(sequence, 731, 10)) * 1024.0;
            assert_eq!(element, expected as f32, "{sequence}");
        }
        for i in 0..1000 {
            assert_eq!((sobol(0, i, 10), sobol(1, i, 10)), (i, second(i)));
        }
    }

    #[test]
    fn scrambling_permutes_the_halves_of_every_interval_and_shuffling_blocks_of_indices() {
        for seed in [0, 1, 0x1234_5678, u32::MAX] {
            for k in 1..=10 {
                let n = 1_u32 << k;
                let mut seen = vec![[false; 2]; n as usize];
                for i in 0..n {
                    seen[(scramble(i, seed) & (n - 1)) as usize][0] = true;
                    seen[shuffle(i, n, seed) as usize][1] = true;
                }
                assert!(seen.iter().all(|s| *s == [true; 2]), "{seed} {k}");
                let half = |i| shuffle(i, n, seed) / n.div_ceil(2);
                assert!((0..n / 2).all(|i| half(i) == half(0)));
            }
        }
    }
}
