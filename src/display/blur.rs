//! Blurring by a Gaussian, rows then columns. At an edge the weights that are left sum to 1.

use rayon::prelude::*;

/// Blurs a plane of `width` columns; `sigma` in pixels.
pub(super) fn gaussian(plane: &[f32], width: usize, sigma: f32) -> Vec<f32> {
    let weights = weights(sigma);
    let across = rows(plane, width, &weights);
    let height = plane.len() / width;
    let down = rows(&transposed(&across, width), height, &weights);
    transposed(&down, height)
}

/// From the middle on, up to three standard deviations.
fn weights(sigma: f32) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as usize;
    let weight = |i: usize| (-0.5 * (i as f32 / sigma).powi(2)).exp();
    (0..=reach).map(weight).collect()
}

fn rows(plane: &[f32], width: usize, weights: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; plane.len()];
    let lines = out.par_chunks_mut(width).zip(plane.par_chunks(width));
    lines.for_each(|(out, line)| {
        for (x, out) in out.iter_mut().enumerate() {
            let (mut sum, mut total) = (0.0, 0.0);
            let first = x.saturating_sub(weights.len() - 1);
            let last = (x + weights.len()).min(width);
            for (place, value) in line[first..last].iter().enumerate() {
                let weight = weights[(first + place).abs_diff(x)];
                sum += weight * value;
                total += weight;
            }
            *out = sum / total;
        }
    });
    out
}

fn transposed(plane: &[f32], width: usize) -> Vec<f32> {
    let height = plane.len() / width;
    let mut out = vec![0.0; plane.len()];
    out.par_chunks_mut(height).enumerate().for_each(|(x, out)| {
        for (y, out) in out.iter_mut().enumerate() {
            *out = plane[y * width + x];
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blurred_point_is_a_bell_and_an_even_plane_stays() {
        let (width, height, sigma) = (41, 31, 2.5_f32);
        let mut plane = vec![0.0; width * height];
        plane[15 * width + 20] = 1.0;
        let blurred = gaussian(&plane, width, sigma);
        let whole: f32 = blurred.iter().sum();
        assert!((whole - 1.0).abs() < 1e-4, "{whole}");
        for (x, y) in [(20, 15), (23, 15), (20, 11), (24, 18)] {
            let square = (x as f32 - 20.0).powi(2) + (y as f32 - 15.0).powi(2);
            let bell =
                (-0.5 * square / sigma.powi(2)).exp() / (std::f32::consts::TAU * sigma.powi(2));
            // The bell is cut at three standard deviations, where 0.5 % of it are left.
            let found = blurred[y * width + x];
            assert!((found / bell - 1.0).abs() < 0.01, "{x} {y}: {found} {bell}");
        }
        let even = gaussian(&vec![0.7; width * height], width, sigma);
        assert!(even.iter().all(|v| (v - 0.7).abs() < 1e-6));
    }
}
