//! Images for a display whose primaries were measured: R, G, B become the display's own values.

use crate::color::{Primaries, Space};
use crate::image::Image;

/// The image with the main colour, linear BT.709, taken through `matrix` (rows), as
/// [`to_display`](crate::color::to_display) makes it; `None` where it has none.
pub fn native(image: &Image, matrix: &[[f64; 3]; 3]) -> Option<Image> {
    let mut image = image.in_rgb().into_owned();
    let rgb = image.rgb()?;
    let stride = image.channels().len();
    for pixel in image.data_mut().chunks_exact_mut(stride) {
        let color = rgb.map(|c| f64::from(pixel[c]));
        for (c, row) in rgb.into_iter().zip(matrix) {
            pixel[c] = (row[0] * color[0] + row[1] * color[1] + row[2] * color[2]) as f32;
        }
    }
    Some(image)
}

/// The chromaticities of at most `most` of an image's pixels, evenly spread; of those that are not black.
pub fn chromaticities_of(image: &Image, most: usize) -> Option<Vec<[f64; 2]>> {
    let image = image.in_rgb();
    let rgb = image.rgb()?;
    let stride = image.channels().len();
    let pixels = image.data().chunks_exact(stride);
    let step = pixels.len().div_ceil(most.max(1)).max(1);
    let of = |pixel: &[f32]| {
        let xyz = Space::Bt709.to_xyz(rgb.map(|c| f64::from(pixel[c])));
        let lit = xyz.iter().all(|v| v.is_finite()) && xyz[1] > 0.0;
        lit.then(|| crate::color::chromaticity(xyz))
    };
    Some(pixels.step_by(step).filter_map(of).collect())
}

/// The gamut of a space by name, for diagrams.
pub fn gamut(name: &str) -> Option<Primaries> {
    Space::named(name)?.primaries()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_acts_on_the_colour_and_on_nothing_else() {
        let names = ["A", "B", "G", "R"].map(String::from).to_vec();
        let image = Image::from_data(1, 1, names, vec![0.5, 3.0, 2.0, 1.0]).unwrap();
        let matrix = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [2.0, 0.0, 0.0]];
        assert_eq!(
            native(&image, &matrix).unwrap().data(),
            [0.5, 2.0, 3.0, 2.0]
        );
        let number = Image::new(1, 1, vec!["depth".into()]);
        assert!(native(&number, &matrix).is_none());
    }

    #[test]
    fn grey_pixels_are_at_the_white_point_and_black_ones_nowhere() {
        let names = ["R", "G", "B"].map(String::from).to_vec();
        let image = Image::from_data(2, 1, names, vec![0.5, 0.5, 0.5, 0.0, 0.0, 0.0]).unwrap();
        let found = chromaticities_of(&image, 100).unwrap();
        assert_eq!(found.len(), 1);
        assert!((found[0][0] - 0.3127).abs() < 1e-4 && (found[0][1] - 0.329).abs() < 1e-4);
    }
}
