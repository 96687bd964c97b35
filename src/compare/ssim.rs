//! The structural similarity index of Wang, Bovik, Sheikh and Simoncelli (*Image quality assessment: from
//! error visibility to structural similarity*, 2004) as scikit-image computes it by default: windows of
//! 7 × 7 equal weights that lie inside the image, unbiased variances, K₁ = 0.01, K₂ = 0.03, averaged over
//! windows and channels.

use rayon::prelude::*;

use crate::image::Image;

const WINDOW: usize = 7;

/// The mean index of two images of the same size and channels, whose values span `range`; `None` where a
/// side is shorter than a window.
pub fn ssim(a: &Image, b: &Image, range: f64) -> Option<f64> {
    let (width, height) = (a.width() as usize, a.height() as usize);
    let channels = a.channels().len();
    if width < WINDOW || height < WINDOW || channels == 0 {
        return None;
    }
    let rows: Vec<f64> = (0..height + 1 - WINDOW)
        .into_par_iter()
        .map(|y| {
            let of_channel = |c| row(&moments(a, b, y, c), range);
            (0..channels).map(of_channel).sum()
        })
        .collect();
    let windows = (width + 1 - WINDOW) * rows.len() * channels;
    Some(rows.iter().sum::<f64>() / windows as f64)
}

/// Sums of a, b, a², b² and ab down the window's rows, by column.
fn moments(a: &Image, b: &Image, top: usize, channel: usize) -> Vec<[f64; 5]> {
    let (width, channels) = (a.width() as usize, a.channels().len());
    let mut sums = vec![[0.0; 5]; width];
    for y in top..top + WINDOW {
        let row = y * width * channels..(y + 1) * width * channels;
        let values = |image| samples(image, row.clone(), channel, channels);
        for ((sum, a), b) in sums.iter_mut().zip(values(a)).zip(values(b)) {
            for (s, term) in sum.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                *s += term;
            }
        }
    }
    sums
}

fn samples(
    image: &Image,
    row: std::ops::Range<usize>,
    channel: usize,
    channels: usize,
) -> impl Iterator<Item = f64> {
    let values = image.data()[row].iter().skip(channel).step_by(channels);
    values.map(|v| f64::from(*v))
}

/// The sum of the index over the windows of a row.
fn row(columns: &[[f64; 5]], range: f64) -> f64 {
    let n = (WINDOW * WINDOW) as f64;
    let unbiased = n / (n - 1.0);
    let (c1, c2) = ((0.01 * range).powi(2), (0.03 * range).powi(2));
    let index = |window: &[[f64; 5]]| {
        let mut mean = [0.0; 5];
        for column in window {
            for (m, v) in mean.iter_mut().zip(column) {
                *m += v / n;
            }
        }
        let [a, b, aa, bb, ab] = mean;
        let (va, vb) = (unbiased * (aa - a * a), unbiased * (bb - b * b));
        let covariance = unbiased * (ab - a * b);
        (2.0 * a * b + c1) * (2.0 * covariance + c2) / ((a * a + b * b + c1) * (va + vb + c2))
    };
    columns.windows(WINDOW).map(index).sum()
}
