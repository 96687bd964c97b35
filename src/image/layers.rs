//! Layers of an image, and images side by side.

use super::Image;
use crate::error::{Error, Result};

impl Image {
    /// The names of the layers beside the main colour, in the order of their channels: "albedo" has channels "albedo.R"
    /// and so on; a channel of another name is a layer by itself.
    pub fn layers(&self) -> Vec<&str> {
        let mut names = Vec::new();
        for channel in self.channels() {
            let name = match channel.rsplit_once('.') {
                Some((layer, _)) => layer,
                None if ["R", "G", "B", "A", "X", "Y", "Z"].contains(&channel.as_str()) => continue,
                None => channel,
            };
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// A layer as an image of its own: its channels without the layer's name, or the one channel of this name as Y.
    ///
    /// # Errors
    /// Where there is no such layer.
    pub fn layer(&self, name: &str) -> Result<Image> {
        let own =
            |channel: &String| Some(channel.strip_prefix(name)?.strip_prefix('.')?.to_owned());
        let mut chosen: Vec<(usize, String)> = Vec::new();
        for (c, channel) in self.channels().iter().enumerate() {
            if channel == name {
                chosen = vec![(c, "Y".to_owned())];
                break;
            }
            chosen.extend(own(channel).map(|own| (c, own)));
        }
        if chosen.is_empty() {
            let error = Error::input(format!("the image has no layer {name:?}"));
            return Err(error.help(match self.layers().as_slice() {
                [] => "it has a main colour alone".to_owned(),
                names => format!("it has {}", names.join(", ")),
            }));
        }
        // Three numbers that are no colour are shown as one: a normal, a position.
        for (x, r) in [("X", "R"), ("Y", "G"), ("Z", "B")] {
            if chosen.len() == 3 {
                chosen
                    .iter_mut()
                    .filter(|(_, own)| own == x)
                    .for_each(|(_, own)| r.clone_into(own));
            }
        }
        let data = self.data().chunks_exact(self.channels().len());
        let data = data
            .flat_map(|pixel| chosen.iter().map(|(c, _)| pixel[*c]))
            .collect();
        let names = chosen.iter().map(|(_, own)| own.clone()).collect();
        Image::from_data(self.width(), self.height(), names, data)
    }

    /// The part of an image from (x, y) on.
    ///
    /// # Errors
    /// Where that reaches beyond the image or is empty.
    pub fn crop(&self, [x, y, width, height]: [u32; 4]) -> Result<Image> {
        let part = self.view().region(x, y, width, height);
        let part = part.filter(|_| width > 0 && height > 0);
        let part = part.and_then(|part| part.to_image(self.channels().to_vec()));
        part.ok_or_else(|| {
            let (own_width, own_height) = (self.width(), self.height());
            Error::input(format!(
                "the part {x},{y},{width},{height} does not lie within the image of {own_width} × {own_height} pixels"
            ))
        })
    }
}

/// Black pixels between the images of a sheet.
const GAP: u32 = 4;

/// The main colours of images in rows of `columns`, each in the middle of a cell as large as the largest.
///
/// # Errors
/// Where an image has no main colour, or the sheet does not fit into memory.
///
/// # Panics
/// Without images or columns.
pub fn sheet(images: &[Image], columns: u32) -> Result<Image> {
    let most = |side: fn(&Image) -> u32| images.iter().map(side).max().expect("there are images");
    let [width, height] = [most(Image::width), most(Image::height)].map(u64::from);
    let columns = u64::from(columns).min(images.len() as u64);
    let rows = (images.len() as u64).div_ceil(columns);
    let side = |cells: u64, size: u64| {
        let side = cells * size + (cells - 1) * u64::from(GAP);
        u32::try_from(side).map_err(|_| Error::input("the sheet is too large"))
    };
    let names = ["R", "G", "B"].map(String::from).to_vec();
    let mut sheet = Image::try_new(side(columns, width)?, side(rows, height)?, names)?;
    for (i, image) in (0..).zip(images) {
        let image = &*image.in_rgb();
        let Some(rgb) = image.rgb() else {
            return Err(Error::input(
                "an image of the sheet has no channels R, G, B or Y",
            ));
        };
        let corner = |cell: u64, size: u64, own: u32| {
            (cell * (size + u64::from(GAP)) + (size - u64::from(own)) / 2) as u32
        };
        let left = corner(i % columns, width, image.width());
        let top = corner(i / columns, height, image.height());
        for y in 0..image.height() {
            for x in 0..image.width() {
                let pixel = image.pixel(x, y);
                sheet
                    .pixel_mut(left + x, top + y)
                    .copy_from_slice(&rgb.map(|c| pixel[c]));
            }
        }
    }
    Ok(sheet)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str]) -> Image {
        let data = (0..names.len()).map(|c| c as f32).collect();
        Image::from_data(1, 1, names.iter().map(ToString::to_string).collect(), data).unwrap()
    }

    #[test]
    fn layers_are_found_by_name() {
        let image = named(&[
            "B", "G", "R", "albedo.R", "albedo.G", "albedo.B", "depth", "n.X", "n.Y", "n.Z",
        ]);
        assert_eq!(image.layers(), ["albedo", "depth", "n"]);
        let albedo = image.layer("albedo").unwrap();
        assert_eq!(albedo.channels(), ["R", "G", "B"]);
        assert_eq!(albedo.data(), [3.0, 4.0, 5.0]);
        assert_eq!(image.layer("depth").unwrap().data(), [6.0]);
        let normal = image.layer("n").unwrap();
        assert_eq!(
            (normal.channels()[0].as_str(), normal.data()),
            ("R", &[7.0, 8.0, 9.0][..])
        );
        let error = image.layer("alb").unwrap_err().to_string();
        assert!(error.contains("it has albedo, depth, n"), "{error}");
    }

    #[test]
    fn a_sheet_holds_images_in_the_middle_of_their_cells() {
        let plain = |width, height, value| {
            let data = vec![value; (width * height) as usize];
            Image::from_data(width, height, vec!["Y".into()], data).unwrap()
        };
        let images = [plain(3, 2, 1.0), plain(1, 2, 2.0), plain(3, 1, 3.0)];
        let sheet = sheet(&images, 2).unwrap();
        assert_eq!((sheet.width(), sheet.height()), (10, 8));
        let places = [
            (0, 0, 1.0),
            (2, 1, 1.0),
            (3, 0, 0.0),
            (7, 0, 0.0),
            (8, 0, 2.0),
            (0, 6, 3.0),
            (0, 7, 0.0),
        ];
        for (x, y, value) in places {
            assert_eq!(sheet.pixel(x, y), [value; 3], "{x} {y}");
        }
    }

    #[test]
    fn a_crop_must_lie_within() {
        let image = Image::new(4, 3, vec!["Y".into()]);
        assert_eq!(image.crop([1, 1, 3, 2]).unwrap().width(), 3);
        for beyond in [
            [2, 0, 3, 1],
            [0, 0, 0, 1],
            [u32::MAX, 0, 2, 1],
            [4, 3, 1, 1],
        ] {
            assert!(image.crop(beyond).is_err(), "{beyond:?}");
        }
    }
}
