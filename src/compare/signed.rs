//! By how much one image is brighter than another, pixel by pixel and with its sign: (b − a) / (|a| + g), where g is a
//! hundredth of the mean of |a|, so that what is all but black does not drown the rest. Of colours the luminance
//! is taken; of other channels that one whose part is the greatest, with its sign.

use super::seeds::LUMINANCE;
use crate::error::{Error, Result};
use crate::image::Image;

/// What is added to |a|, as a part of its mean.
const DARK: f64 = 0.01;

/// The relative difference of every pixel, row by row, above 0 where b is brighter. Both images have the same
/// size and channels; `rgb` are the channels that make the luminance, if they are colours.
///
/// # Errors
/// Where sizes or channels differ.
pub fn relative(a: &Image, b: &Image, rgb: Option<[usize; 3]>) -> Result<Vec<f32>> {
    if (a.width(), a.height(), a.channels()) != (b.width(), b.height(), b.channels()) {
        return Err(Error::input("the sizes or channels of the images differ"));
    }
    let channels = a.channels().len().max(1);
    let pixels = || {
        a.data()
            .chunks_exact(channels)
            .zip(b.data().chunks_exact(channels))
    };
    Ok(match rgb {
        Some(rgb) => {
            let luminance = |pixel: &[f32]| -> f64 {
                let terms = rgb.iter().zip(LUMINANCE);
                terms.map(|(&c, weight)| weight * f64::from(pixel[c])).sum()
            };
            let guard = guard(a.data().chunks_exact(channels).map(luminance));
            let part = |(a, b)| part(luminance(a), luminance(b), guard);
            pixels().map(part).collect()
        }
        None => {
            let of_channel = |c: usize| a.data().iter().skip(c).step_by(channels);
            let guards: Vec<f64> = (0..channels)
                .map(|c| guard(of_channel(c).map(|v| f64::from(*v))))
                .collect();
            let pixel = |(a, b): (&[f32], &[f32])| {
                let parts = (0..channels).map(|c| part(a[c].into(), b[c].into(), guards[c]));
                parts.fold(
                    0.0,
                    |most: f32, part| {
                        if part.abs() > most.abs() { part } else { most }
                    },
                )
            };
            pixels().map(pixel).collect()
        }
    })
}

fn guard(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    DARK * values.map(f64::abs).sum::<f64>() / count
}

fn part(a: f64, b: f64, guard: f64) -> f32 {
    if a == b {
        0.0
    } else {
        // Where all of a is black, what is not is infinitely brighter.
        ((b - a) / (a.abs() + guard)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(names: &[&str], data: &[f32]) -> Image {
        let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
        let width = data.len() / names.len();
        Image::from_data(width as u32, 1, names, data.to_vec()).unwrap()
    }

    #[test]
    fn brighter_is_above_nought_and_darker_below_it() {
        let names = ["R", "G", "B"];
        let a = image(&names, &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let b = image(&names, &[1.1, 1.1, 1.1, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0]);
        let parts = relative(&a, &b, Some([0, 1, 2])).unwrap();
        let guard = 0.01 * 2.0 / 3.0;
        for (part, right) in parts.iter().zip([0.1, -0.5, 0.0]) {
            assert!(
                (f64::from(*part) - right / (1.0 + guard)).abs() < 1e-6,
                "{parts:?}"
            );
        }
        // Red and blue for green of the same luminance.
        let [r, g, _] = LUMINANCE;
        let c = image(&names, &[1.5, (1.0 - 0.5 * r / g) as f32, 1.0]);
        let white = image(&names, &[1.0; 3]);
        assert!(relative(&white, &c, Some([0, 1, 2])).unwrap()[0].abs() < 1e-6);
        assert!(relative(&white, &c, None).unwrap()[0] > 0.4);
    }

    #[test]
    fn of_other_channels_that_which_differs_most_counts_with_its_sign() {
        let a = image(&["x", "y"], &[1.0, -2.0, 4.0, 2.0]);
        let b = image(&["x", "y"], &[1.1, -3.0, 4.4, 2.1]);
        let parts = relative(&a, &b, None).unwrap();
        assert!((parts[0] + 1.0 / 2.02).abs() < 1e-6, "{parts:?}");
        assert!((parts[1] - 0.4 / 4.025).abs() < 1e-6, "{parts:?}");
        assert!(relative(&a, &image(&["x", "z"], &[0.0; 4]), None).is_err());
    }

    #[test]
    fn light_where_all_was_black_is_infinitely_brighter() {
        let [black, light] = [0.0, 1.0].map(|v| image(&["Y"], &[v; 2]));
        assert_eq!(relative(&black, &light, None).unwrap(), [f32::INFINITY; 2]);
        assert_eq!(relative(&black, &black, None).unwrap(), [0.0; 2]);
    }
}
