//! A local operator, as dodging and burning do in a darkroom (Reinhard et al., *Photographic tone reproduction for
//! digital images*, 2002): each place is compressed by the luminance of its own neighbourhood, which is as large as
//! there is no strong contrast in it.

use super::blur::gaussian;
use super::exposure::{MIDDLE_GREY, geometric_mean};
use crate::color::luminance;

/// Neighbourhoods, each 1.6 times as wide as the one before.
const SCALES: usize = 8;
const RATIO: f32 = 1.6;
/// How much contrast ends a neighbourhood, and how sharply.
const CONTRAST: f32 = 0.05;
const SHARPNESS: i32 = 8;

/// Applies it to linear values of an image of `width` columns.
pub(super) fn view(pixels: &mut [[f32; 3]], width: usize, exposure: f32) {
    let Some(mean) = geometric_mean(pixels) else {
        return;
    };
    let key = MIDDLE_GREY * exposure;
    let scaled = |pixel: &[f32; 3]| {
        let light = luminance(*pixel) * key / mean;
        if light > 0.0 { light.min(1e6) } else { 0.0 }
    };
    let light: Vec<f32> = pixels.iter().map(scaled).collect();
    // σ of a neighbourhood of one pixel is 1/(2√2).
    let mut sigma = 0.125_f32.sqrt();
    let mut centre = gaussian(&light, width, sigma);
    let mut chosen = centre.clone();
    let mut grows = vec![true; light.len()];
    for scale in 0..SCALES {
        sigma *= RATIO;
        let around = gaussian(&light, width, sigma);
        let size = RATIO.powi(scale as i32);
        let least = 2_f32.powi(SHARPNESS) * key / (size * size);
        for i in 0..light.len() {
            let contrast = (centre[i] - around[i]) / (least + centre[i]);
            grows[i] &= contrast.abs() < CONTRAST;
            if grows[i] {
                chosen[i] = centre[i];
            }
        }
        centre = around;
    }
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let factor = key / mean / (1.0 + chosen[i]);
        *pixel = pixel.map(|v| v * factor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_image_is_compressed_as_the_global_curve_does() {
        let mut pixels = vec![[2.0, 1.0, 0.5]; 64 * 64];
        view(&mut pixels, 64, 1.0);
        let expected = 0.18 / 1.18;
        assert!((luminance(pixels[2000]) - expected).abs() < 1e-5);
        assert!((pixels[2000][0] / pixels[2000][2] - 4.0).abs() < 1e-4);
    }

    /// Two halves, one a thousand times as bright, with the same fine checks of 20 % in both: compressing by the pixel alone
    /// would leave the bright half's contrast at a hundredth.
    #[test]
    fn detail_survives_in_bright_places() {
        let width = 128;
        let pixel = |i: usize| {
            let (x, y) = (i % width, i / width);
            let detail = if (x + y) % 2 == 0 { 1.2 } else { 1.0 };
            [detail * if x < width / 2 { 0.05 } else { 50.0 }; 3]
        };
        let mut pixels: Vec<[f32; 3]> = (0..width * width).map(pixel).collect();
        view(&mut pixels, width, 1.0);
        let contrast = |x: usize| pixels[64 * width + x][0] / pixels[64 * width + x + 1][0];
        assert!((contrast(20) - 1.2).abs() < 0.05, "{}", contrast(20));
        assert!((contrast(100) - 1.2).abs() < 0.05, "{}", contrast(100));
        let brightest = pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
        assert!(brightest < 1.7, "{brightest}");
    }
}
