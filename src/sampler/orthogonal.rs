//! `orthogonal`: points from orthogonal arrays of strength 2 (Jarosz, Enayet, Kensler, Kilpatrick and
//! Christensen, *Orthogonal array sampling for Monte Carlo rendering*, 2019). A set of p² points, p prime,
//! puts one into each cell of a p × p grid in *every* two dimensions of a block, be they a pair or not, and
//! one into each of p² intervals of every dimension. Bose's construction: point (a, b) has the digits a, b,
//! a + b, 2a + b, … mod p in the block's dimensions, which are p + 1; permutations of each dimension's
//! digits, and within a digit's stratum the partner's digit (correlated multi-jitter), do the rest.

use super::stratified::offset;
use super::{PointSet, Sampler, Streams, below_one, count, place, sample_count};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, integer};
use crate::error::{Error, Result};
use crate::lanes::{Divisor, Ints, Lanes, Long, Vec2, random};

/// A set is the whole sample count, rounded up to the square of a prime.
#[derive(Clone, Debug)]
pub struct Orthogonal {
    prime: Divisor,
    set: Divisor,
    /// Dimensions that share an array: an even number, for pairs must not be parted.
    block: u32,
    /// Whether points lie anywhere in the smallest strata, or at their centres.
    jitter: bool,
}

const STRENGTH: Row = integer("strength", 2, "of the arrays; only 2 is possible here");

impl Orthogonal {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "one point in each cell of a grid in every pair of dimensions",
        properties: &[super::COMMON, &[super::JITTER, STRENGTH]],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        let strength = properties.integer("strength")?;
        if strength != 2 {
            let message =
                format!("orthogonal arrays of strength {strength} do not exist in Étendue");
            return Err(Error::unsupported(message)
                .at(properties.location())
                .help("they have strength 2, the default"));
        }
        let count = sample_count(properties)?;
        Ok(Self::new(count, properties.boolean("jitter")?))
    }

    fn new(count: u32, jitter: bool) -> Self {
        let root = count.isqrt();
        let least = (root + u32::from(root * root < count)).max(2);
        let prime = (least..)
            .find(|&n| is_prime(n))
            .expect("there is a larger prime");
        Self {
            prime: Divisor::new(prime),
            set: Divisor::new(prime * prime),
            block: (prime + 1) & !1,
            jitter,
        }
    }

    /// The point's number in the array that the block of `dimension` has to itself.
    #[inline(always)]
    fn row<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> (Long<F::Int>, F::Int) {
        let Streams { key, index } = place(streams, self.set, dimension / self.block);
        (key, random::permute::<F>(index, self.set, key))
    }

    /// A point's digit in a column of the array, before any permutation.
    #[inline(always)]
    fn digit<I: Ints>(&self, row: I, column: u32) -> I {
        let (a, b) = self.prime.divide(row);
        match column {
            0 => a,
            // Both factors are below 2^15, or a little above: see MAX_SAMPLES.
            _ => self.prime.divide(I::splat(column - 1) * a + b).1,
        }
    }

    /// A coordinate from its own digit and that of its partner; `within` is the place in the smallest
    /// stratum.
    #[inline(always)]
    fn coordinate<F: Lanes>(
        &self,
        key: Long<F::Int>,
        digit: F::Int,
        partner: F::Int,
        within: F,
    ) -> F {
        let p = count::<F>(self.prime);
        let stratum: F = random::permute::<F>(digit, self.prime, key).to_float();
        let key = random::bits(key, 0);
        let part: F = random::permute::<F>(partner, self.prime, key).to_float();
        below_one((stratum + (part + within) / p) / p)
    }
}

impl PointSet for Orthogonal {
    fn sample_count(&self) -> u32 {
        self.set_size()
    }

    fn set_size(&self) -> u32 {
        self.set.value()
    }

    fn counts(&self) -> &'static str {
        "squares of primes"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::Orthogonal(Self::new(count, self.jitter))
    }

    #[inline(always)]
    fn number<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> F {
        let (key, row) = self.row(streams, dimension);
        let column = dimension % self.block;
        let (digit, partner) = (self.digit(row, column), self.digit(row, column ^ 1));
        let key = random::bits(key, column);
        let within = offset::<F>(key, row, self.jitter);
        self.coordinate(key, digit, partner, within.x)
    }

    #[inline(always)]
    fn pair<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> Vec2<F> {
        let (key, row) = self.row(streams, dimension);
        let column = dimension % self.block;
        let (x, y) = (self.digit(row, column), self.digit(row, column + 1));
        let (key_x, key_y) = (random::bits(key, column), random::bits(key, column + 1));
        let within = offset::<F>(key_x, row, self.jitter);
        Vec2::new(
            self.coordinate(key_x, x, y, within.x),
            self.coordinate(key_y, y, x, within.y),
        )
    }
}

/// By trial division: the numbers are below 2^16.
fn is_prime(n: u32) -> bool {
    n >= 2
        && (2..)
            .take_while(|d| d * d <= n)
            .all(|d| !n.is_multiple_of(d))
}
