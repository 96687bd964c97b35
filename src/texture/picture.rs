//! An image file as linear BT.709 texels, for the plugins that look into one: 8- and 16-bit files are decoded
//! from sRGB unless they hold plain numbers, values that are not finite count as 0, alpha is dropped.

use std::path::Path;

use crate::budget::{Account, Budget};
use crate::color::srgb;
use crate::error::{Error, Location, Result};
use crate::image::{self, Encoding, Image};

/// The colours of an image file.
#[derive(Debug)]
pub struct Picture {
    image: Image,
    /// Where red, green and blue stand among the channels.
    rgb: [usize; 3],
    encoded: bool,
    account: Account,
}

impl Picture {
    /// Reads the file; `raw` says that it holds plain numbers.
    ///
    /// # Errors
    /// Where the file cannot be read, holds no colours or is larger than the budget allows.
    pub fn read(path: &Path, raw: bool, budget: &Budget) -> Result<Self> {
        let account = budget.open();
        let picture = image::read(path, &account)?;
        let image = picture.image.into_rgb();
        let Some(rgb) = image.rgb() else {
            let message = format!("no colour channels among {:?}", image.channels());
            return Err(Error::input(message).at(&Location::of_file(path)));
        };
        Ok(Self {
            image,
            rgb,
            encoded: picture.encoding != Encoding::Linear && !raw,
            account,
        })
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.image.width() as usize, self.image.height() as usize]
    }

    /// What is made of its texels: `size` bytes of each, which are taken before it is made and kept in place of the
    /// picture.
    ///
    /// # Errors
    /// Where the budget does not allow it.
    pub fn into_texels<T>(self, size: usize, make: impl FnOnce(&Self) -> T) -> Result<T> {
        let [width, height] = self.size();
        self.account.take_rows(width * height, size)?;
        let made = make(&self);
        self.account.keep((width * height * size) as u64);
        Ok(made)
    }

    /// All texels, row by row from the top.
    pub fn texels(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.size()[1]).flat_map(|y| self.row(y))
    }

    /// The texels of a row, the top one being 0.
    ///
    /// # Panics
    /// Below the image, as soon as a texel is taken.
    pub fn row(&self, y: usize) -> impl Iterator<Item = [f32; 3]> {
        let texel = move |x| {
            let pixel = self.image.pixel(x, y as u32);
            self.rgb.map(|c| self.decode(pixel[c]))
        };
        (0..self.image.width()).map(texel)
    }

    fn decode(&self, value: f32) -> f32 {
        let value = if self.encoded {
            srgb::decode(value)
        } else {
            value
        };
        if value.is_finite() { value } else { 0.0 }
    }
}
