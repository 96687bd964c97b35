//! Counter-based random numbers: each is a hash of (seed, pixel, sample, dimension) and of nothing else,
//! so that an image does not depend on threads, tiles, order or crop. The hash is the finaliser of
//! SplitMix64 (Steele, Lea and Flood, *Fast splittable pseudorandom number generators*, 2014, with
//! Stafford's "variant 13" constants); numbers along a key are the SplitMix64 sequence that starts there.

use std::convert::Infallible;

use rand::TryRng;

/// The golden ratio's fraction in 64 bits, SplitMix64's step.
pub(crate) const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// By which [`mix`] multiplies.
pub(crate) const FACTORS: [u64; 2] = [0xbf58_476d_1ce4_e5b9, 0x94d0_49bb_1331_11eb];

/// A bijection of 64 bits that lets every input bit reach every output bit.
#[inline]
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(FACTORS[0]);
    x = (x ^ (x >> 27)).wrapping_mul(FACTORS[1]);
    x ^ (x >> 31)
}

/// A key below `key`, one for each `index`.
#[inline]
pub fn key(key: u64, index: u64) -> u64 {
    mix(key ^ mix(index.wrapping_add(STEP)))
}

/// 64 random bits, the `dimension`-th along `key`.
#[inline]
pub fn bits(key: u64, dimension: u32) -> u64 {
    mix(key.wrapping_add(STEP.wrapping_mul(u64::from(dimension) + 1)))
}

/// A number in [0, 1), uniform on multiples of 2⁻²⁴.
#[inline]
pub fn unit(bits: u64) -> f32 {
    (bits >> 40) as f32 * (1.0 / 16_777_216.0)
}

/// The numbers along a key one after another, for `rand`'s distributions where order is no matter: the
/// shapes of generated meshes, never a path to a pixel.
#[derive(Clone, Debug)]
pub struct Sequence {
    key: u64,
    next: u32,
}

impl Sequence {
    /// From the start.
    pub fn new(seed: u64) -> Self {
        Self {
            key: key(0, seed),
            next: 0,
        }
    }
}

impl TryRng for Sequence {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok((self.try_next_u64()? >> 32) as u32)
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        self.next = self.next.wrapping_add(1);
        Ok(bits(self.key, self.next))
    }

    fn try_fill_bytes(&mut self, dst: &mut [u8]) -> Result<(), Infallible> {
        for chunk in dst.chunks_mut(8) {
            let bytes = self.try_next_u64()?.to_le_bytes();
            chunk.copy_from_slice(&bytes[..chunk.len()]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_along_a_key_are_uniform_and_uncorrelated() {
        let n = 1 << 16;
        let mut sum = [0.0f64; 3];
        for d in 0..n {
            let a = f64::from(unit(bits(key(7, 3), d))) - 0.5;
            let b = f64::from(unit(bits(key(7, 3), d + 1))) - 0.5;
            let c = f64::from(unit(bits(key(7, 4), d))) - 0.5;
            sum = [sum[0] + a, sum[1] + a * b, sum[2] + a * c];
        }
        // Standard deviations: 1/√12 for the mean, 1/12 for the products, each over √n.
        let scale = f64::from(n).sqrt();
        assert!(sum[0].abs() / scale < 4.0 * 0.289, "{sum:?}");
        assert!(
            sum[1].abs() / scale < 4.0 / 12.0 && sum[2].abs() / scale < 4.0 / 12.0,
            "{sum:?}"
        );
    }
}
