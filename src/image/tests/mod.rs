//! Tests of whole files: what is written is read again, and what is damaged is refused.

use super::*;

mod damaged;
mod round_trip;

/// An image whose samples all differ, brighter than a display too.
fn sample(width: u32, height: u32, names: &[&str]) -> Image {
    let names: Vec<String> = names.iter().map(ToString::to_string).collect();
    let n = width as usize * height as usize * names.len();
    let data = (0..n)
        .map(|i| (i as f32 * 0.37).sin().abs() * 4.0)
        .collect();
    Image::from_data(width, height, names, data).unwrap()
}

fn whole(image: &Image) -> Window {
    Window {
        x: 0,
        y: 0,
        full_width: image.width(),
        full_height: image.height(),
    }
}

/// The bytes of an EXR file without metadata.
fn exr_bytes(image: &Image) -> Vec<u8> {
    openexr::encode(image, &whole(image), &Metadata::default()).unwrap()
}

/// The bytes of a file of integers, by the crate `image`.
fn raster_bytes(
    width: u32,
    height: u32,
    color: ::image::ExtendedColorType,
    format: ::image::ImageFormat,
) -> Vec<u8> {
    let n = width as usize * height as usize * usize::from(color.bits_per_pixel()) / 8;
    let codes: Vec<u8> = (0..n).map(|i| (i * 37 % 251) as u8).collect();
    let mut file = std::io::Cursor::new(Vec::new());
    ::image::write_buffer_with_format(&mut file, &codes, width, height, color, format).unwrap();
    file.into_inner()
}
