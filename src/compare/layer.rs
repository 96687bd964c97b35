//! What of a picture is compared: its main colour or a layer by name, whole or in a window. Two layers can
//! be compared where they have the same size and channels, and are made to hold values of one kind.

use std::borrow::Cow;
use std::path::Path;

use serde::Serialize;

use crate::budget::Budget;
use crate::color::srgb;
use crate::error::{Error, Location, Result};
use crate::image::{self, Encoding, Image, Picture};

/// A window of an image, in pixels from its upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// The first column.
    pub x: u32,
    /// The first row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// What of a picture is compared.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// The channels `layer.*`, or the one channel of this name; the main colour where absent.
    pub layer: Option<String>,
    /// The whole image where absent.
    pub crop: Option<Crop>,
}

/// The channels of a picture that are compared.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Their values, with the layer's name left out of the channels'.
    pub image: Image,
    /// What the values mean.
    pub encoding: Encoding,
    /// The indices of red, green and blue (thrice the same where the image is grey), if the layer is a
    /// colour that can be looked at.
    pub rgb: Option<[usize; 3]>,
    /// Channels of the picture that are not among them, by their full names.
    pub others: Vec<String>,
}

/// How many values are no numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct NotFinite {
    /// Values that are NaN.
    pub nan: usize,
    /// Values that are infinite.
    pub infinite: usize,
    /// Where the first of them is, row by row.
    pub first: Option<Place>,
}

/// A value's place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Place {
    /// Column, from 0.
    pub x: usize,
    /// Row, from 0.
    pub y: usize,
    /// The channel's name.
    pub channel: String,
}

impl Layer {
    /// Reads a file.
    ///
    /// # Errors
    /// Where the file cannot be read, lacks what is selected or is larger than the budget allows.
    pub fn read(path: &Path, selection: &Selection, budget: &Budget) -> Result<Self> {
        let account = budget.open();
        let picture = image::read(path, &account)?;
        let layer = Self::of(&picture, selection).map_err(|e| e.at(&Location::of_file(path)))?;
        account.keep(size_of_val(layer.image.data()) as u64);
        Ok(layer)
    }

    /// Selects from a picture.
    ///
    /// # Errors
    /// Where the picture lacks what is selected.
    pub fn of(picture: &Picture, selection: &Selection) -> Result<Self> {
        let image = match &selection.layer {
            Some(_) => Cow::Borrowed(&picture.image),
            None => picture.image.in_rgb(),
        };
        let chosen = match &selection.layer {
            Some(name) => named(&image, name)?,
            None => main_color(&image)?,
        };
        let view = match selection.crop {
            None => image.view(),
            Some(Crop {
                x,
                y,
                width,
                height,
            }) => image
                .view()
                .region(x, y, width, height)
                .filter(|region| region.width() > 0 && region.height() > 0)
                .ok_or_else(|| {
                    Error::input(format!(
                        "the window {x},{y},{width},{height} is empty or reaches beyond {} × {} pixels",
                        image.width(),
                        image.height()
                    ))
                })?,
        };
        let mut data = Vec::with_capacity(
            view.width() as usize * view.height() as usize * chosen.indices.len(),
        );
        for (y, x) in (0..view.height()).flat_map(|y| (0..view.width()).map(move |x| (y, x))) {
            data.extend(chosen.indices.iter().map(|&c| view.get(x, y, c)));
        }
        let left_out = |c: &usize| !chosen.indices.contains(c);
        let others = (0..image.channels().len()).filter(left_out);
        Ok(Self {
            others: others.map(|c| image.channels()[c].clone()).collect(),
            image: Image::from_data(view.width(), view.height(), chosen.names, data)?,
            encoding: picture.encoding,
            rgb: chosen.rgb,
        })
    }

    /// The values that are not finite.
    pub fn not_finite(&self) -> NotFinite {
        let names = self.image.channels();
        let width = self.image.width() as usize;
        let mut found = NotFinite::default();
        for (i, value) in self.image.data().iter().enumerate() {
            if value.is_finite() {
                continue;
            }
            if value.is_nan() {
                found.nan += 1;
            } else {
                found.infinite += 1;
            }
            found.first.get_or_insert_with(|| Place {
                x: i / names.len() % width,
                y: i / names.len() / width,
                channel: names[i % names.len()].clone(),
            });
        }
        found
    }

    /// Makes two layers comparable, value by value: a grey one beside a coloured one becomes coloured, and
    /// of linear values beside codes (EXR beside PNG) the codes are taken, as a screen would show them.
    ///
    /// # Errors
    /// Where sizes or channels differ.
    pub fn align(a: &mut Self, b: &mut Self) -> Result<()> {
        let size = |l: &Self| (l.image.width(), l.image.height());
        if size(a) != size(b) {
            let ((aw, ah), (bw, bh)) = (size(a), size(b));
            let message = format!("the sizes differ: {aw} × {ah} and {bw} × {bh} pixels");
            return Err(Error::input(message).help("--crop compares a window of both"));
        }
        let is_grey = |l: &Self| l.rgb.is_some() && l.image.channels().len() == 1;
        match (is_grey(a), is_grey(b)) {
            (true, false) if b.rgb.is_some() => a.spread()?,
            (false, true) if a.rgb.is_some() => b.spread()?,
            _ => {}
        }
        if a.image.channels() != b.image.channels() {
            let names = |l: &Self| l.image.channels().join(", ");
            let message = format!("the channels differ: {} and {}", names(a), names(b));
            return Err(Error::input(message));
        }
        match (a.encoding, b.encoding) {
            (Encoding::Linear, Encoding::Srgb) => a.encode(),
            (Encoding::Srgb, Encoding::Linear) => b.encode(),
            _ => {}
        }
        Ok(())
    }

    /// Grey as equal red, green and blue.
    fn spread(&mut self) -> Result<()> {
        let data = self.image.data().iter().flat_map(|&v| [v; 3]).collect();
        let names = ["R", "G", "B"].map(String::from).to_vec();
        self.image = Image::from_data(self.image.width(), self.image.height(), names, data)?;
        self.rgb = Some([0, 1, 2]);
        Ok(())
    }

    /// Linear values as codes in [0, 1], not rounded; what is not finite stays.
    fn encode(&mut self) {
        for value in self.image.data_mut() {
            if value.is_finite() {
                *value = srgb::encode(value.clamp(0.0, 1.0));
            }
        }
        self.encoding = Encoding::Srgb;
    }
}

/// Channels by index, and what they are called and mean.
struct Chosen {
    indices: Vec<usize>,
    names: Vec<String>,
    rgb: Option<[usize; 3]>,
}

fn main_color(image: &Image) -> Result<Chosen> {
    let Some(rgb) = image.rgb() else {
        return Err(Error::input(format!(
            "the image has no R, G, B, no X, Y, Z and no Y but {}",
            image.channels().join(", ")
        ))
        .help("--layer NAME chooses other channels"));
    };
    let grey = rgb[0] == rgb[1];
    let letters: &[&str] = if grey { &["Y"] } else { &["R", "G", "B"] };
    Ok(Chosen {
        indices: rgb[..letters.len()].to_vec(),
        names: letters.iter().map(ToString::to_string).collect(),
        rgb: Some(if grey { [0; 3] } else { [0, 1, 2] }),
    })
}

fn named(image: &Image, layer: &str) -> Result<Chosen> {
    let mut chosen = Chosen {
        indices: Vec::new(),
        names: Vec::new(),
        rgb: None,
    };
    for (c, name) in image.channels().iter().enumerate() {
        let inner = name.strip_prefix(layer).and_then(|n| n.strip_prefix('.'));
        if let Some(inner) = inner.or((name == layer).then_some(name)) {
            chosen.indices.push(c);
            chosen.names.push(inner.to_owned());
        }
    }
    if chosen.indices.is_empty() {
        let mut layers: Vec<&str> = Vec::new();
        for name in image.channels() {
            let layer = name.rsplit_once('.').map_or(name.as_str(), |(l, _)| l);
            if !layers.contains(&layer) {
                layers.push(layer);
            }
        }
        let there = layers.join(", ");
        return Err(
            Error::input(format!("there is no layer {layer:?}; there are {there}"))
                .suggest(layer, layers),
        );
    }
    let find = |letter| chosen.names.iter().position(|n| n == letter);
    chosen.rgb = match [find("R"), find("G"), find("B")] {
        [Some(r), Some(g), Some(b)] => Some([r, g, b]),
        _ => None,
    };
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(names: &[&str], encoding: Encoding) -> Picture {
        let count = names.len();
        let names = names.iter().map(ToString::to_string).collect();
        let data = (0..2 * 2 * count).map(|i| i as f32 / 16.0).collect();
        Picture {
            image: Image::from_data(2, 2, names, data).unwrap(),
            encoding,
            metadata: Vec::new(),
            warnings: Vec::new(),
        }
    }

    fn layer(names: &[&str], name: Option<&str>) -> Result<Layer> {
        let selection = Selection {
            layer: name.map(str::to_owned),
            crop: None,
        };
        Layer::of(&picture(names, Encoding::Linear), &selection)
    }

    #[test]
    fn a_layer_is_the_main_colour_or_what_is_named() {
        const NAMES: &[&str] = &[
            "R", "G", "B", "A", "n.X", "n.Y", "n.Z", "dd.Y", "c.R", "c.G", "c.B",
        ];
        for (name, channels, is_color) in [
            (None, &["R", "G", "B"][..], true),
            (Some("n"), &["X", "Y", "Z"], false),
            (Some("dd"), &["Y"], false),
            (Some("dd.Y"), &["dd.Y"], false),
            (Some("A"), &["A"], false),
            (Some("c"), &["R", "G", "B"], true),
        ] {
            let layer = layer(NAMES, name).unwrap();
            assert_eq!(layer.image.channels(), channels, "{name:?}");
            assert_eq!(layer.rgb.is_some(), is_color, "{name:?}");
            assert_eq!(layer.others.len(), NAMES.len() - channels.len());
        }
        let error = layer(NAMES, Some("d")).unwrap_err().to_string();
        assert!(error.contains("there are R, G, B, A, n, dd, c"), "{error}");
        assert!(layer(&["n.X"], None).is_err());
    }

    #[test]
    fn a_crop_lies_inside_of_the_image() {
        let picture = picture(&["Y"], Encoding::Linear);
        let crop = |x, y, width, height| {
            let crop = Some(Crop {
                x,
                y,
                width,
                height,
            });
            Layer::of(&picture, &Selection { layer: None, crop })
        };
        assert_eq!(
            crop(1, 0, 1, 2).unwrap().image.data(),
            [1.0 / 16.0, 3.0 / 16.0]
        );
        assert!(crop(1, 1, 2, 1).is_err());
        assert!(crop(0, 0, 0, 1).is_err());
    }

    #[test]
    fn grey_and_coloured_linear_and_encoded_meet() {
        let mut grey = layer(&["Y"], None).unwrap();
        let selection = Selection::default();
        let mut codes = Layer::of(&picture(&["R", "G", "B"], Encoding::Srgb), &selection).unwrap();
        Layer::align(&mut grey, &mut codes).unwrap();
        assert_eq!(grey.image.channels(), codes.image.channels());
        assert_eq!(grey.encoding, Encoding::Srgb);
        assert_eq!(grey.image.get(1, 0, 2), srgb::encode(1.0 / 16.0));
        let mut normals = layer(&["n.X"], Some("n")).unwrap();
        assert!(Layer::align(&mut normals, &mut codes).is_err());
    }

    #[test]
    fn what_is_not_finite_is_counted_and_found() {
        let mut layer = layer(&["R", "G", "B"], None).unwrap();
        layer.image.set(1, 0, 2, f32::NAN);
        layer.image.set(0, 1, 0, f32::NEG_INFINITY);
        let found = layer.not_finite();
        assert_eq!((found.nan, found.infinite), (1, 1));
        let first = found.first.unwrap();
        assert_eq!((first.x, first.y, first.channel.as_str()), (1, 0, "B"));
    }
}
