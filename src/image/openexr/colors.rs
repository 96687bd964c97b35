//! What an OpenEXR file's colours mean: luminance and chroma (Y, RY, BY), and RGB of the primaries in the attribute
//! `chromaticities`, become RGB of BT.709 (openexr.com, "Technical Introduction"). X, Y, Z stay.

use ::exr::meta::attribute::Chromaticities;
use ::exr::prelude::Vec2;
use rayon::prelude::*;

use crate::color::Primaries;
use crate::error::{Error, Result};
use crate::image::Image;

/// Takes the colours of all layers into BT.709.
pub(super) fn convert(image: &mut Image, chromaticities: Option<&Chromaticities>) -> Result<()> {
    let primaries = chromaticities.map_or(Primaries::BT709, primaries);
    for layer in layers(image, ["Y", "RY", "BY"]) {
        let [r, g, b] = primaries
            .luminances()
            .ok_or_else(no_space)?
            .map(|v| v as f32);
        change(image, &layer, |[y, ry, by]| {
            let (red, blue) = ((ry + 1.0) * y, (by + 1.0) * y);
            [red, (y - r * red - b * blue) / g, blue]
        });
        for (c, name) in layer.channels.iter().zip(["R", "G", "B"]) {
            image.rename(*c, format!("{}{name}", layer.prefix));
        }
    }
    if primaries.same(&Primaries::BT709) {
        return Ok(());
    }
    for layer in layers(image, ["R", "G", "B"]) {
        let to_bt709 = primaries.to_bt709().ok_or_else(no_space)?;
        change(image, &layer, to_bt709);
    }
    Ok(())
}

fn primaries(chromaticities: &Chromaticities) -> Primaries {
    let point = |Vec2(x, y): Vec2<f32>| [f64::from(x), f64::from(y)];
    Primaries {
        red: point(chromaticities.red),
        green: point(chromaticities.green),
        blue: point(chromaticities.blue),
        white: point(chromaticities.white),
    }
}

fn no_space() -> Error {
    Error::input("the file's chromaticities make no space of colours")
        .help("the primaries must not lie on one line, and the white must have a luminance")
}

/// Three channels that are one colour.
struct Layer {
    /// What stands before the channels' letters.
    prefix: String,
    channels: [usize; 3],
}

/// The layers that have these three channels.
fn layers(image: &Image, names: [&str; 3]) -> Vec<Layer> {
    let find = |prefix: &str| {
        let [a, b, c] = names.map(|name| image.channel(&format!("{prefix}{name}")));
        Some([a?, b?, c?])
    };
    let prefixes = image.channels().iter().filter_map(|name| {
        let prefix = name.strip_suffix(names[0])?;
        (prefix.is_empty() || prefix.ends_with('.')).then(|| prefix.to_owned())
    });
    prefixes
        .filter_map(|prefix| {
            Some(Layer {
                channels: find(&prefix)?,
                prefix,
            })
        })
        .collect()
}

/// Changes the layer's colour in every pixel.
fn change(image: &mut Image, layer: &Layer, f: impl Fn([f32; 3]) -> [f32; 3] + Sync) {
    let stride = image.channels().len();
    let pixels = image.data_mut().par_chunks_exact_mut(stride);
    pixels.with_min_len(1 << 12).for_each(|pixel| {
        let changed = f(layer.channels.map(|c| pixel[c]));
        for (&c, value) in layer.channels.iter().zip(changed) {
            pixel[c] = value;
        }
    });
}
