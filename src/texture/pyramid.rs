//! Mipmaps: an image and smaller ones of it, each half as wide and half as high, down to a single texel (Williams, *Pyramidal
//! parametrics*, 1983). A texel of a level is the mean, in linear values, of what it covers of the level below; where a size
//! is odd the half is rounded down, and what lies across two texels counts for each by its part, so that the mean of a level
//! is that of the image whatever its size. In bands the means of colours become spectra.

use super::bitmap::Wrap;
use crate::color::{ColorModel, Pixels, Spectra as _};
use crate::lanes::{Ints as _, Lanes, Mask as _, Vec2, ln};

/// The smaller images, from the largest on.
#[derive(Debug)]
pub(super) struct Levels {
    /// Columns and rows of each.
    pub(super) sizes: Vec<[usize; 2]>,
    /// All of their texels.
    pub(super) pixels: Pixels,
}

impl Levels {
    /// Their sizes; none of an image of a single texel.
    pub(super) fn sizes(mut size: [usize; 2]) -> Vec<[usize; 2]> {
        let mut sizes = Vec::new();
        while size != [1, 1] {
            size = size.map(|n| (n / 2).max(1));
            sizes.push(size);
        }
        sizes
    }

    /// Of an image whose texels `color` tells, row by row from the top.
    pub(super) fn new(
        size: [usize; 2],
        sizes: Vec<[usize; 2]>,
        color: impl Fn(usize) -> [f32; 3],
    ) -> Self {
        let mut pixels = Vec::new();
        let (mut below, mut begin) = (size, 0);
        for (number, of) in sizes.iter().enumerate() {
            let end = pixels.len();
            match number {
                0 => reduce(below, *of, &color, &mut pixels),
                _ => {
                    let before = pixels[begin..].to_vec();
                    reduce(below, *of, |index| before[index], &mut pixels);
                }
            }
            (below, begin) = (*of, end);
        }
        Self {
            sizes,
            pixels: Pixels::Linear(pixels),
        }
    }
}

/// Which of `n` texels lie below one of `m`, and their parts in it.
fn below(i: usize, n: usize, m: usize) -> impl Iterator<Item = (usize, f64)> {
    let (first, last) = (i * n, (i + 1) * n);
    (first / m..last.div_ceil(m)).map(move |j| {
        let covered = last.min((j + 1) * m) - first.max(j * m);
        (j, covered as f64 / n as f64)
    })
}

/// Adds the level of size `to` that stands above one of size `from`.
fn reduce(
    from: [usize; 2],
    to: [usize; 2],
    color: impl Fn(usize) -> [f32; 3],
    pixels: &mut Vec<[f32; 3]>,
) {
    for y in 0..to[1] {
        for x in 0..to[0] {
            let mut sum = [0.0_f64; 3];
            for (row, down) in below(y, from[1], to[1]) {
                for (column, across) in below(x, from[0], to[0]) {
                    let texel = color(row * from[0] + column);
                    for (sum, value) in sum.iter_mut().zip(texel) {
                        *sum += down * across * f64::from(value);
                    }
                }
            }
            pixels.push(sum.map(|value| value as f32));
        }
    }
}

/// The levels above an image, ready to be evaluated.
#[derive(Debug)]
pub(super) struct Pyramid<C: ColorModel> {
    widths: Vec<f32>,
    heights: Vec<f32>,
    /// Where each begins among the texels.
    firsts: Vec<u32>,
    texels: C::Texels,
}

/// An image with its pyramid, and what lies beyond its edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mipmap<'a, C: ColorModel> {
    pub(super) size: [usize; 2],
    pub(super) texels: &'a C::Texels,
    pub(super) pyramid: &'a Pyramid<C>,
    /// Along u and v.
    pub(super) wrap: [Wrap; 2],
}

/// Two levels, and how much the upper one counts.
#[derive(Clone, Copy, Debug)]
struct Between<F: Lanes> {
    /// The lower one, 0 being the image itself.
    level: F,
    upper: F,
}

impl<C: ColorModel> Pyramid<C> {
    pub(super) fn new(sizes: Vec<[usize; 2]>, texels: C::Texels) -> Self {
        let mut first = 0;
        let firsts = sizes.iter().map(|[width, height]| {
            first += (width * height) as u32;
            first - (width * height) as u32
        });
        Self {
            firsts: firsts.collect(),
            widths: sizes.iter().map(|size| size[0] as f32).collect(),
            heights: sizes.iter().map(|size| size[1] as f32).collect(),
            texels,
        }
    }

    /// The levels whose texels are about `length` texels of the image long.
    #[inline(always)]
    fn between<F: Lanes>(&self, length: F) -> Between<F> {
        let highest = self.widths.len() as f32;
        let longest = (1_u64 << self.widths.len()) as f32;
        let place = ln(length.clamp(1.0, longest)) * F::splat(std::f32::consts::LOG2_E);
        let place = place.clamp(0.0, highest);
        let level = place.floor().min(F::splat(highest - 1.0));
        Between {
            level,
            upper: place - level,
        }
    }
}

impl<C: ColorModel> Mipmap<'_, C> {
    /// The value at a place in texture coordinates, where `length` texels of the image are looked at: linear between the
    /// texels of a level, and between two levels.
    #[inline(always)]
    pub(super) fn eval<F: Lanes>(
        &self,
        uv: Vec2<F>,
        length: F,
        wavelengths: &[C::Wavelengths],
    ) -> C::Columns<F> {
        let Pyramid {
            widths,
            heights,
            firsts,
            texels,
        } = self.pyramid;
        let Between { level, upper } = self.pyramid.between(length);
        let at_image = level.lt(F::splat(0.5));
        let mut sum = C::Columns::<F>::zero();
        // The image itself, the lower level where that is another, and the upper one.
        for step in 0..3 {
            let share = match step {
                0 => F::select(at_image, F::one() - upper, F::zero()),
                1 => F::select(at_image, F::zero(), F::one() - upper),
                _ => upper,
            };
            let counts = F::zero().lt(share);
            if !counts.any() {
                continue;
            }
            let (size, first, texels) = match step {
                0 => {
                    let size =
                        Vec2::new(F::splat(self.size[0] as f32), F::splat(self.size[1] as f32));
                    (size, F::Int::splat(0), self.texels)
                }
                _ => {
                    // Levels are counted from the first above the image here.
                    let index = match step {
                        1 => (level - F::one()).max(F::zero()),
                        _ => level,
                    };
                    let index = index.to_int();
                    let size = Vec2::new(F::gather(widths, index), F::gather(heights, index));
                    (size, F::Int::gather(firsts, index), texels)
                }
            };
            let value = bilinear::<C, F>(texels, size, first, self.wrap, uv, wavelengths);
            sum = C::Columns::<F>::select(counts, sum + value * share, sum);
        }
        sum
    }
}

/// Linear between the four texels around a place of levels of such sizes, which begin at `first`.
#[inline(always)]
fn bilinear<C: ColorModel, F: Lanes>(
    texels: &C::Texels,
    size: Vec2<F>,
    first: F::Int,
    [along_u, along_v]: [Wrap; 2],
    uv: Vec2<F>,
    wavelengths: &[C::Wavelengths],
) -> C::Columns<F> {
    let half = F::splat(0.5);
    let (px, py) = (uv.x * size.x - half, uv.y * size.y - half);
    let (x, y) = (px.floor(), py.floor());
    let (left, right) = (
        along_u.apply_each(x, size.x),
        along_u.apply_each(x + F::one(), size.x),
    );
    let stride = size.x.to_int();
    let (above, below) = (
        first + along_v.apply_each(y, size.y) * stride,
        first + along_v.apply_each(y + F::one(), size.y) * stride,
    );
    let (fx, fy) = (px - x, py - y);
    let (gx, gy) = (F::one() - fx, F::one() - fy);
    let upper = C::evaluate_texels::<F>(texels, above + left, wavelengths) * gx
        + C::evaluate_texels::<F>(texels, above + right, wavelengths) * fx;
    let lower = C::evaluate_texels::<F>(texels, below + left, wavelengths) * gx
        + C::evaluate_texels::<F>(texels, below + right, wavelengths) * fx;
    let is_finite = fx.is_finite() & fy.is_finite();
    C::Columns::<F>::select(is_finite, upper * gy + lower * fy, C::Columns::<F>::zero())
}
