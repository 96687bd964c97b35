//! Glare (bloom): light that is beyond the display's maximum spreads over its neighbourhood, as it does in an eye or a
//! lens. Values within the range have none of their own (Spencer et al., *Physically-based glare effects for digital
//! images*, 1995, have it only where it is seen).

use super::blur::gaussian;

/// Standard deviations of the bells that glare is the mean of, in parts of the image's diagonal.
const WIDTHS: [f32; 3] = [0.003, 0.01, 0.04];

/// Adds `amount` of what exceeds 1, spread, to what does not.
pub(super) fn add(pixels: &mut [[f32; 3]], width: usize, amount: f32) {
    let excess = |v: f32| {
        if v > 1.0 && v.is_finite() {
            v - 1.0
        } else {
            0.0
        }
    };
    let height = pixels.len() / width;
    let diagonal = (width as f32).hypot(height as f32);
    for channel in 0..3 {
        let plane: Vec<f32> = pixels.iter().map(|pixel| excess(pixel[channel])).collect();
        if plane.iter().all(|v| *v == 0.0) {
            continue;
        }
        for part in WIDTHS {
            let spread = gaussian(&plane, width, (part * diagonal).max(0.5));
            for (pixel, spread) in pixels.iter_mut().zip(spread) {
                pixel[channel] += amount / WIDTHS.len() as f32 * spread;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_beyond_the_display_glares_and_its_light_is_kept() {
        let width = 300;
        let mut within = vec![[1.0, 0.5, 0.0]; width * 200];
        let before = within.clone();
        add(&mut within, width, 1.0);
        assert_eq!(within, before);

        let mut pixels = vec![[0.1; 3]; width * 200];
        pixels[100 * width + 150] = [31.0, 1.0, 0.5];
        add(&mut pixels, width, 0.1);
        let added: f32 = pixels.iter().map(|pixel| pixel[0] - 0.1).sum::<f32>() - 30.9;
        assert!((added - 3.0).abs() < 0.02, "{added}");
        let beside = pixels[100 * width + 152];
        assert!(beside[0] > 0.11 && beside[1] == 0.1, "{beside:?}");
    }
}
