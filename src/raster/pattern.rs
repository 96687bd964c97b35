//! Where the samples of a pixel lie: its centre, or the patterns of 2, 4, 8 and 16 that Direct3D 11 names the standard ones,
//! in sixteenths of a pixel from the centre; the same in every pixel.

/// How many samples a pixel may have.
pub const COUNTS: [u32; 5] = [1, 2, 4, 8, 16];

/// Places of samples within a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pattern {
    /// To the right and down from the centre, in sixteenths of a pixel.
    offsets: &'static [[i8; 2]],
}

impl Pattern {
    /// The centre alone.
    pub const CENTRE: Self = Self { offsets: &[[0, 0]] };

    /// The pattern of so many samples, if there is one.
    pub fn of(count: u32) -> Option<Self> {
        const TWO: &[[i8; 2]] = &[[4, 4], [-4, -4]];
        const FOUR: &[[i8; 2]] = &[[-2, -6], [6, -2], [-6, 2], [2, 6]];
        const EIGHT: &[[i8; 2]] = &[
            [1, -3],
            [-1, 3],
            [5, 1],
            [-3, -5],
            [-5, 5],
            [-7, -1],
            [3, 7],
            [7, -7],
        ];
        const SIXTEEN: &[[i8; 2]] = &[
            [1, 1],
            [-1, -3],
            [-3, 2],
            [4, -1],
            [-5, -2],
            [2, 5],
            [5, 3],
            [3, -5],
            [-2, 6],
            [0, -7],
            [-4, -6],
            [-6, 4],
            [-8, 0],
            [7, -4],
            [6, 7],
            [-7, -8],
        ];
        let offsets = match count {
            1 => return Some(Self::CENTRE),
            2 => TWO,
            4 => FOUR,
            8 => EIGHT,
            16 => SIXTEEN,
            _ => return None,
        };
        Some(Self { offsets })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.offsets.len()
    }

    /// A sample's place within its pixel, in [0, 1)².
    pub fn place(&self, sample: usize) -> [f64; 2] {
        self.offsets[sample].map(|offset| 0.5 + f64::from(offset) / 16.0)
    }

    /// The same in units of 2⁻ᵇⁱᵗˢ pixels, of at least 4 bits.
    pub(super) fn fixed(&self, bits: u32) -> Vec<[i64; 2]> {
        let fixed = |offset: i8| i64::from(offset + 8) << (bits - 4);
        let offsets = self.offsets.iter();
        offsets.map(|offset| offset.map(fixed)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_of_different_places_within_the_pixel() {
        for count in COUNTS {
            let pattern = Pattern::of(count).unwrap();
            assert_eq!(pattern.count(), count as usize);
            for sample in 0..pattern.count() {
                let [x, y] = pattern.place(sample);
                assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
                assert!((0..sample).all(|other| pattern.place(other) != [x, y]));
                let scale = f64::from(1 << 10);
                assert_eq!(pattern.fixed(10)[sample].map(|n| n as f64 / scale), [x, y]);
            }
        }
        assert_eq!(Pattern::of(3), None);
    }
}
