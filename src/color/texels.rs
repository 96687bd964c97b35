//! The colours of an image, kept as small as they are in its file: what textures and environments cost is waiting for
//! memory.

use crate::lanes::{Ints, Lanes};

/// The texels of an image in linear BT.709, row by row.
#[derive(Clone, Debug)]
pub enum Pixels {
    /// Codes of eight bits for red, green and blue, the lowest byte being red; and the value of each code.
    Codes(Vec<u32>, Box<[f32; 256]>),
    /// Numbers of any size.
    Linear(Vec<[f32; 3]>),
}

impl Pixels {
    /// How many there are.
    pub fn count(&self) -> usize {
        match self {
            Self::Codes(codes, _) => codes.len(),
            Self::Linear(colors) => colors.len(),
        }
    }

    /// Bytes of each.
    pub fn size(&self) -> usize {
        match self {
            Self::Codes(..) => size_of::<u32>(),
            Self::Linear(_) => size_of::<[f32; 3]>(),
        }
    }

    /// A texel's colour.
    ///
    /// # Panics
    /// Beyond the last.
    pub fn get(&self, index: usize) -> [f32; 3] {
        match self {
            Self::Codes(codes, values) => {
                let [r, g, b, _] = codes[index].to_le_bytes();
                [r, g, b].map(|code| values[usize::from(code)])
            }
            Self::Linear(colors) => colors[index],
        }
    }

    /// All texels.
    pub fn iter(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.count()).map(|index| self.get(index))
    }
}

/// Texels as three numbers each, to the bit.
#[derive(Clone, Debug)]
pub enum Packed {
    /// As [`Pixels::Codes`].
    Codes(Vec<u32>, Box<[f32; 256]>),
    /// Numbers of half precision (IEEE 754 binary16): red and green, then blue.
    Halves(Vec<[u32; 2]>),
    /// Numbers of single precision.
    Singles(Vec<[f32; 3]>),
}

impl Packed {
    /// In the smallest form that holds them.
    pub(super) fn new(pixels: Pixels, color: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        if let Pixels::Codes(codes, values) = pixels {
            let values = values.map(|value| color([value; 3])[0]);
            return Self::Codes(codes, Box::new(values));
        }
        let halves = pixels.iter().map(|rgb| {
            let [r, g, b] = color(rgb).map(to_half);
            Some([u32::from(r?) | u32::from(g?) << 16, b?.into()])
        });
        match halves.collect() {
            Some(halves) => Self::Halves(halves),
            None => Self::Singles(pixels.iter().map(color).collect()),
        }
    }

    /// The colours of texels.
    #[inline(always)]
    pub(super) fn at<F: Lanes>(&self, index: F::Int) -> [F; 3] {
        match self {
            Self::Codes(codes, values) => {
                let codes = F::Int::gather(codes, index);
                let byte = F::Int::splat(0xff);
                [
                    F::gather(&values[..], codes & byte),
                    F::gather(&values[..], codes.shr::<8>() & byte),
                    F::gather(&values[..], codes.shr::<16>() & byte),
                ]
            }
            Self::Halves(halves) => {
                let (table, place) = (halves.as_flattened(), index.shl::<1>());
                let red_green = F::Int::gather(table, place);
                let blue = F::Int::gather(table, place + F::Int::splat(1));
                [
                    from_half(red_green),
                    from_half(red_green.shr::<16>()),
                    from_half(blue),
                ]
            }
            Self::Singles(colors) => {
                let (table, place) = (colors.as_flattened(), index.shl::<1>() + index);
                let next = |n| F::Int::splat(n);
                [
                    F::gather(table, place),
                    F::gather(table, place + next(1)),
                    F::gather(table, place + next(2)),
                ]
            }
        }
    }
}

/// What the exponents of half and single precision are apart, as a factor: 2¹¹².
const REBIAS: f32 = f32::from_bits((127 + 112) << 23);

/// The number of half precision in the lower sixteen bits, which is finite.
#[inline(always)]
fn from_half<F: Lanes>(bits: F::Int) -> F {
    let magnitude = (bits & F::Int::splat(0x7fff)).shl::<13>().from_bits();
    let sign = (bits & F::Int::splat(0x8000)).shl::<16>();
    ((magnitude * F::splat(REBIAS)).to_bits() | sign).from_bits()
}

/// A number's bits in half precision, if it is one of that.
fn to_half(value: f32) -> Option<u16> {
    let sign = value.to_bits() >> 16 & 0x8000;
    let magnitude = (value.abs() / REBIAS).to_bits() >> 13;
    let half = u16::try_from(magnitude | sign).ok()?;
    let is_finite = magnitude < 0x7c00;
    let back: f32 = from_half::<f32>(std::num::Wrapping(half.into()));
    (is_finite && back.to_bits() == value.to_bits()).then_some(half)
}

#[cfg(test)]
mod tests {
    use std::num::Wrapping;

    use super::*;

    #[test]
    fn texels_are_kept_to_the_bit_in_the_smallest_form() {
        let values = std::array::from_fn(|code| (code as f32 / 255.0).powf(2.2));
        let codes = Pixels::Codes(vec![0x00ff_8001, 0x0003_0201], Box::new(values));
        let smallest = f32::from_bits((127 - 24) << 23);
        let halves = vec![
            [0.0, -0.0, 1.0],
            [65504.0, -smallest, 1023.0 * smallest],
            [0.5, 0.1f32, 2.0],
        ];
        let singles = Pixels::Linear(halves.clone());
        let halves = Pixels::Linear(halves[..2].to_vec());
        let large = Pixels::Linear(vec![[65536.0, 0.0, 0.0]]);
        let kinds = [codes, halves, singles, large].map(|pixels| {
            let packed = Packed::new(pixels.clone(), |rgb| rgb);
            for (index, expected) in pixels.iter().enumerate() {
                let found = packed.at::<f32>(Wrapping(index as u32));
                assert_eq!(found.map(f32::to_bits), expected.map(f32::to_bits));
            }
            match packed {
                Packed::Codes(..) => 1,
                Packed::Halves(_) => 2,
                Packed::Singles(_) => 3,
            }
        });
        assert_eq!(kinds, [1, 2, 3, 3]);
    }
}
