//! From scene-referred to display-referred: linear values become codes for a screen, and [`save`] is how
//! renders leave: EXR and HDR stay linear, PNG is encoded.

pub mod srgb;

use std::borrow::Cow;
use std::path::Path;

use crate::color::xyz_to_rgb;
use crate::error::Result;
use crate::image::{self, Format, Image, Metadata, Window};

/// Writes an image in linear BT.709 or XYZ in the format of the extension: `.exr` (every channel, metadata), `.hdr`
/// (main colour) or `.png` (main colour and opacity, encoded by [`srgb::encode`]). The file appears whole
/// or not at all.
///
/// # Errors
/// Where the extension is another, the format cannot hold the image, or the file system refuses.
pub fn save(path: &Path, image: &Image, metadata: &Metadata) -> Result<()> {
    match Format::of_output(path)? {
        Format::Png => image::write_codes(path, &srgb::encode(&in_rgb(image))?),
        Format::Hdr => image::write(path, &in_rgb(image), metadata),
        Format::Exr => image::write(path, image, metadata),
    }
}

/// The image with R, G, B in place of X, Y, Z.
fn in_rgb(image: &Image) -> Cow<'_, Image> {
    let [Some(x), Some(y), Some(z)] = ["X", "Y", "Z"].map(|name| image.channel(name)) else {
        return Cow::Borrowed(image);
    };
    let mut names = image.channels().to_vec();
    for (place, name) in [(x, "R"), (y, "G"), (z, "B")] {
        names[place] = name.to_owned();
    }
    let mut data = image.data().to_vec();
    for pixel in data.chunks_exact_mut(names.len()) {
        let rgb = xyz_to_rgb([x, y, z].map(|place| f64::from(pixel[place])));
        for (place, value) in [x, y, z].into_iter().zip(rgb) {
            pixel[place] = value as f32;
        }
    }
    let image = Image::from_data(image.width(), image.height(), names, data);
    Cow::Owned(image.expect("as many samples as before"))
}

/// Like [`save`], for an image that is a part of a whole: EXR says which, the others only store the part.
///
/// # Errors
/// As [`save`], and where the image reaches beyond the whole.
pub fn save_window(path: &Path, image: &Image, window: &Window, metadata: &Metadata) -> Result<()> {
    match Format::of_output(path)? {
        Format::Png | Format::Hdr => save(path, image, metadata),
        Format::Exr => image::write_window(path, image, window, metadata),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Budget;
    use crate::image::Encoding;

    #[test]
    fn one_image_leaves_in_every_format_linear_or_encoded() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["R", "G", "B"].map(String::from).to_vec();
        let image = Image::from_data(2, 1, names, vec![0.5, 0.0, 1.0, 2.0, 0.25, 0.125]).unwrap();
        for (name, encoding, red) in [
            ("a.exr", Encoding::Linear, 0.5),
            ("a.HDR", Encoding::Linear, 0.5),
            ("a.png", Encoding::Srgb, 188.0 / 255.0),
        ] {
            let path = folder.path().join(name);
            save(&path, &image, &Metadata::default()).unwrap();
            let back = image::read(&path, &Budget::default().open()).unwrap();
            assert_eq!(back.encoding, encoding, "{name}");
            assert_eq!(back.image.get(0, 0, 0), red, "{name}");
        }
    }

    #[test]
    fn an_unknown_extension_names_the_known_ones() {
        let image = Image::new(1, 1, vec!["Y".into()]);
        let error = save(Path::new("a.tiff"), &image, &Metadata::default()).unwrap_err();
        assert!(error.to_string().contains(".exr, .hdr or .png"), "{error}");
    }
}
