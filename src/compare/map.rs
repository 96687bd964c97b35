//! Maps: one value a pixel, drawn over a colour bar that says what the colours mean: in magma from 0 on, or
//! from blue over white to red about 0. Small images are enlarged in whole steps, so that the legend has room and
//! pixels can be told apart.

use flip_rs::MAGMA;
use font8x8::legacy::BASIC_LEGACY;

use crate::error::{Error, Result};
use crate::image::{Codes, Layout};

/// Pixels are enlarged until the picture is so wide.
const LEAST_WIDTH: usize = 416;
/// A letter's side.
const LETTER: usize = 8;
const BACKGROUND: [u8; 3] = [24, 24, 24];
const INK: [u8; 3] = [235, 235, 235];

/// What is drawn.
#[derive(Clone, Debug)]
pub struct Map<'a> {
    /// Width of the image in pixels.
    pub width: usize,
    /// The values, row by row.
    pub values: &'a [f32],
    /// What the values are, in ASCII, such as `|b - a|`.
    pub label: &'a str,
    /// The value that takes the last colour, as all above do.
    pub top: f32,
    /// What the first colour stands for.
    pub scale: Scale,
}

/// Where the colours of a [`Map`] begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// At 0, which is black; the top is the brightest.
    FromZero,
    /// At minus the top, which is blue; 0 is white and the top is red.
    AboutZero,
}

impl Scale {
    /// The colour of `value` where the last colour stands for `top`. What is not a number takes the last colour, or
    /// black about 0.
    pub fn color(self, value: f32, top: f32) -> [u8; 3] {
        match self {
            Self::FromZero => magma(value / top),
            Self::AboutZero => diverging(value / top),
        }
    }
}

/// A top for [`Map`] that a few fireflies do not raise: what 99.5 % of the values lie below, or the greatest
/// where most are 0. Signs do not count.
pub fn robust_top(values: &[f32]) -> f32 {
    let mut sorted: Vec<f32> = values.iter().map(|v| v.abs()).collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let rank = sorted.len() * 995 / 1000;
    let most = sorted.get(rank).copied().unwrap_or(0.0);
    let greatest = sorted.last().copied().unwrap_or(0.0);
    match if most > 0.0 { most } else { greatest } {
        top if top > 0.0 && top.is_finite() => top,
        _ => 1.0,
    }
}

impl Map<'_> {
    /// The map with its legend below.
    ///
    /// # Errors
    /// Where the values do not make rows, or the picture does not fit into memory.
    pub fn draw(&self) -> Result<Codes> {
        if self.width == 0
            || self.values.is_empty()
            || !self.values.len().is_multiple_of(self.width)
        {
            return Err(Error::input("the map has no whole rows"));
        }
        let height = self.values.len() / self.width;
        let zoom = LEAST_WIDTH.div_ceil(self.width);
        let (map_width, map_height) = (self.width * zoom, height * zoom);
        // Letters grow with large images, so that they are legible when the whole is seen.
        let unit = (map_width / 640).max(1);
        let mut canvas = Canvas::new(map_width, map_height + LEGEND_ROWS * LETTER * unit / 2)?;
        for y in 0..map_height {
            for x in 0..map_width {
                let value = self.values[y / zoom * self.width + x / zoom];
                canvas.set(x, y, self.scale.color(value, self.top));
            }
        }
        self.legend(&mut canvas, map_height, unit);
        canvas.into_codes()
    }

    /// A line of text, the bar, and three numbers below it.
    fn legend(&self, canvas: &mut Canvas, top: usize, unit: usize) {
        let half = LETTER * unit / 2;
        let (left, right) = (half, canvas.width - half);
        let mean =
            self.values.iter().map(|v| f64::from(*v)).sum::<f64>() / self.values.len() as f64;
        let greatest = self.values.iter().copied().fold(0.0, f32::max);
        let least = self.values.iter().copied().fold(0.0, f32::min);
        let signed = self.scale == Scale::AboutZero;
        let numbers = if signed {
            let [least, greatest] = [least, greatest].map(|v| sign(short(v.into())));
            format!("mean {}, {least} to {greatest}", sign(short(mean)))
        } else {
            format!("mean {}, greatest {}", short(mean), short(greatest.into()))
        };
        canvas.text(
            left,
            top + half,
            unit,
            &format!("{}: {numbers}", self.label),
        );
        for x in left..right {
            let part = (x - left) as f32 / (right - left - 1).max(1) as f32;
            for y in top + 4 * half..top + 6 * half {
                let value = if signed { 2.0 * part - 1.0 } else { part };
                canvas.set(x, y, self.scale.color(value, 1.0));
            }
        }
        let most = short(self.top.into());
        let beyond = if greatest > self.top { ">= " } else { "" };
        let below = if least < -self.top { "<= " } else { "" };
        let ends = if signed {
            [
                (0.0, format!("{below}-{most}")),
                (0.5, "0".to_owned()),
                (1.0, format!("{beyond}+{most}")),
            ]
        } else {
            [
                (0.0, "0".to_owned()),
                (0.5, short(f64::from(self.top) / 2.0)),
                (1.0, format!("{beyond}{most}")),
            ]
        };
        for (part, text) in ends {
            let room = (right - left).saturating_sub(text.len() * LETTER * unit);
            let x = left + (part * room as f64) as usize;
            canvas.text(x, top + 7 * half, unit, &text);
        }
    }
}

/// The legend's height in half letters.
const LEGEND_ROWS: usize = 10;

/// Three digits that say most.
fn short(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-2..1e4).contains(&value.abs()) {
        let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 4.0) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else {
        format!("{value:.2e}")
    }
}

/// A number with its sign, be that plus.
fn sign(number: String) -> String {
    if number.starts_with('-') || number == "0" {
        number
    } else {
        format!("+{number}")
    }
}

/// Blue, white and red, and what lies between: for −1, −1/2, 0, 1/2, 1.
const DIVERGING: [[f32; 3]; 5] = [
    [8.0, 48.0, 140.0],
    [80.0, 150.0, 225.0],
    [245.0, 245.0, 245.0],
    [235.0, 120.0, 80.0],
    [140.0, 10.0, 30.0],
];

/// From blue to red, `part` in [−1, 1].
fn diverging(part: f32) -> [u8; 3] {
    if part.is_nan() {
        return [0; 3];
    }
    let at = 2.0 * (part.clamp(-1.0, 1.0) + 1.0);
    let first = (at as usize).min(DIVERGING.len() - 2);
    let rest = at - first as f32;
    [0, 1, 2].map(|c| {
        let [a, b] = [DIVERGING[first][c], DIVERGING[first + 1][c]];
        (a + rest * (b - a)).round() as u8
    })
}

/// Magma at `part` of its length; what is not a number takes its end.
fn magma(part: f32) -> [u8; 3] {
    let last = (MAGMA.len() - 1) as f32;
    let index = if part.is_nan() {
        last
    } else {
        (part * last).round().clamp(0.0, last)
    };
    MAGMA[index as usize].map(|c| (c * 255.0).round() as u8)
}

/// A picture that is drawn on.
struct Canvas {
    width: usize,
    data: Vec<u8>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Result<Self> {
        let too_large = || Error::input("the map does not fit into memory");
        let length = width.checked_mul(height).and_then(|n| n.checked_mul(3));
        let length = length.ok_or_else(too_large)?;
        let mut data: Vec<u8> = Vec::new();
        data.try_reserve_exact(length).map_err(|_| too_large())?;
        data.extend(BACKGROUND.iter().cycle().take(length));
        Ok(Self { width, data })
    }

    fn set(&mut self, x: usize, y: usize, color: [u8; 3]) {
        if x < self.width
            && let Some(pixel) = self
                .data
                .get_mut((y * self.width + x) * 3..)
                .and_then(|d| d.get_mut(..3))
        {
            pixel.copy_from_slice(&color);
        }
    }

    /// ASCII text with its upper left corner at (x, y), each dot `unit` pixels wide.
    fn text(&mut self, x: usize, y: usize, unit: usize, text: &str) {
        for (i, letter) in text.bytes().enumerate() {
            let Some(glyph) = BASIC_LEGACY.get(usize::from(letter)) else {
                continue;
            };
            for dy in 0..LETTER * unit {
                for dx in 0..LETTER * unit {
                    if glyph[dy / unit] >> (dx / unit) & 1 == 1 {
                        self.set(x + i * LETTER * unit + dx, y + dy, INK);
                    }
                }
            }
        }
    }

    fn into_codes(self) -> Result<Codes> {
        let height = self.data.len() / 3 / self.width;
        let side = |n: usize| u32::try_from(n).map_err(|_| Error::input("the map is too large"));
        Codes::new(side(self.width)?, side(height)?, Layout::Rgb, self.data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_enlarged_and_has_a_legend_below() {
        let values = [0.0, 0.25, 0.5, 1.0];
        let map = Map {
            width: 2,
            values: &values,
            label: "FLIP",
            top: 0.5,
            scale: Scale::FromZero,
        };
        let codes = map.draw().unwrap();
        let pixel = |x: u32, y: u32| {
            let first = (y * codes.width() + x) as usize * 3;
            [0, 1, 2].map(|c| codes.data()[first + c])
        };
        assert_eq!(codes.width(), 416);
        assert_eq!(codes.height(), 416 + 40);
        assert_eq!(pixel(0, 0), magma(0.0));
        assert_eq!(pixel(415, 207), magma(0.5));
        assert_eq!(pixel(0, 415), magma(1.0));
        assert_eq!(pixel(415, 415), magma(1.0));
        assert_eq!(pixel(4, 416 + 18), magma(0.0));
        assert_eq!(pixel(411, 416 + 18), magma(1.0));
        let ink = codes.data().chunks(3).filter(|p| **p == INK).count();
        assert!(ink > 300, "{ink} dots of text");
        assert!(Map { width: 3, ..map }.draw().is_err());
    }

    #[test]
    fn a_signed_map_has_white_in_the_middle_and_its_bar_goes_from_blue_to_red() {
        let values = [-2.0, -0.25, 0.0, 0.5, f32::NAN, 0.0];
        let map = Map {
            width: 6,
            values: &values,
            label: "(b - a) / a",
            top: 0.5,
            scale: Scale::AboutZero,
        };
        let codes = map.draw().unwrap();
        let pixel = |x: u32, y: u32| {
            let first = (y * codes.width() + x) as usize * 3;
            [0, 1, 2].map(|c| codes.data()[first + c])
        };
        let zoom = codes.width() / 6;
        let [blue, light_blue, white, _, red] = DIVERGING.map(|c| c.map(|v| v as u8));
        let right = [blue, light_blue, white, red, [0; 3], white];
        for (i, right) in right.into_iter().enumerate() {
            assert_eq!(pixel(i as u32 * zoom, 0), right, "{i}");
        }
        let bar = zoom + 18;
        assert_eq!(pixel(4, bar), blue);
        assert_eq!(pixel(codes.width() - 5, bar), red);
        let [r, g, b] = pixel(codes.width() / 2, bar);
        assert!(r > 240 && g > 240 && b > 240);
        assert_eq!(robust_top(&[-3.0, 1.0]), 3.0);
        assert_eq!(sign(short(0.02)), "+0.02");
        assert_eq!(sign(short(-0.02)), "-0.02");
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.5, "0.5"),
            (1.0, "1"),
            (0.123_456, "0.123"),
            (1234.0, "1234"),
            (100.0, "100"),
            (12.345, "12.3"),
            (1.5e-7, "1.50e-7"),
        ] {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn a_firefly_does_not_darken_the_map() {
        let mut values = vec![0.1; 1000];
        values[7] = 1e6;
        assert_eq!(robust_top(&values), 0.1);
        let mut values = vec![0.0; 1000];
        assert_eq!(robust_top(&values), 1.0);
        values[7] = 3.0;
        assert_eq!(robust_top(&values), 3.0);
    }
}
