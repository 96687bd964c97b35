//! The image buffer: width × height pixels of named f32 channels, interleaved, so that sample (x, y, c)
//! lies at (y·width + x)·channels + c. Views give it other strides without a copy.

use std::borrow::Cow;

use crate::color::Primaries;
use crate::error::{Error, Result};
use crate::image::View;

/// An image that owns its samples; row 0 is the top row.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    channels: Vec<String>,
    data: Vec<f32>,
}

impl Image {
    /// An image of zeros, for sizes that were checked before; [`Image::try_new`] is for the others.
    ///
    /// # Panics
    /// Where the image does not fit into memory.
    pub fn new(width: u32, height: u32, channels: Vec<String>) -> Self {
        Self::try_new(width, height, channels).expect("the caller checked that the image fits")
    }

    /// An image of zeros.
    ///
    /// # Errors
    /// Where the image does not fit into memory.
    pub fn try_new(width: u32, height: u32, channels: Vec<String>) -> Result<Self> {
        let too_large = || {
            let n = channels.len();
            Error::input(format!(
                "an image of {width} × {height} pixels and {n} channels does not fit into memory"
            ))
        };
        let samples = sample_count(width, height, channels.len()).ok_or_else(too_large)?;
        let mut data = Vec::new();
        data.try_reserve_exact(samples).map_err(|_| too_large())?;
        data.resize(samples, 0.0);
        Ok(Self {
            width,
            height,
            channels,
            data,
        })
    }

    /// An image of the given interleaved samples.
    ///
    /// # Errors
    /// Unless there are exactly width · height · channels samples.
    pub fn from_data(
        width: u32,
        height: u32,
        channels: Vec<String>,
        data: Vec<f32>,
    ) -> Result<Self> {
        if sample_count(width, height, channels.len()) != Some(data.len()) {
            return Err(Error::input(format!(
                "{} samples do not make an image of {width} × {height} pixels and {} channels",
                data.len(),
                channels.len()
            )));
        }
        Ok(Self {
            width,
            height,
            channels,
            data,
        })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The channels' names in the order of the samples; a layer is named before a dot: "albedo.R".
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// All samples, interleaved.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All samples, interleaved, to be changed.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// All samples, interleaved, without the image around them.
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }

    /// Where pixel (x, y) begins in [`Image::data`].
    fn first_sample(&self, x: u32, y: u32) -> usize {
        assert!(
            x < self.width && y < self.height,
            "pixel ({x}, {y}) lies outside of {} × {}",
            self.width,
            self.height
        );
        (y as usize * self.width as usize + x as usize) * self.channels.len()
    }

    /// Sample `c` of pixel (x, y).
    ///
    /// # Panics
    /// Outside of the image.
    pub fn get(&self, x: u32, y: u32, c: usize) -> f32 {
        self.pixel(x, y)[c]
    }

    /// Changes sample `c` of pixel (x, y).
    ///
    /// # Panics
    /// Outside of the image.
    pub fn set(&mut self, x: u32, y: u32, c: usize, value: f32) {
        self.pixel_mut(x, y)[c] = value;
    }

    /// The samples of pixel (x, y), one a channel.
    ///
    /// # Panics
    /// Outside of the image.
    pub fn pixel(&self, x: u32, y: u32) -> &[f32] {
        &self.data[self.first_sample(x, y)..][..self.channels.len()]
    }

    /// The samples of pixel (x, y), one a channel, to be changed.
    ///
    /// # Panics
    /// Outside of the image.
    pub fn pixel_mut(&mut self, x: u32, y: u32) -> &mut [f32] {
        let first = self.first_sample(x, y);
        &mut self.data[first..][..self.channels.len()]
    }

    /// The whole image as a view.
    pub fn view(&self) -> View<'_> {
        View::interleaved(&self.data, self.width, self.height, self.channels.len())
            .expect("the buffer holds width × height × channels samples")
    }

    /// The index of the channel of this name.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c == name)
    }

    /// The indices of the main red, green and blue channels: those named R, G and B, else three times the luminance
    /// Y of a grey image, else those of the first layer that has either.
    pub fn rgb(&self) -> Option<[usize; 3]> {
        let find = |prefix: &str, name: &str| self.channel(&format!("{prefix}{name}"));
        let color = |prefix: &str| {
            let [r, g, b] = ["R", "G", "B"].map(|name| find(prefix, name));
            Some([r?, g?, b?])
        };
        let grey = |prefix: &str| {
            // Beside X and Z, Y is a coordinate and no grey.
            let [x, y, z] = ["X", "Y", "Z"].map(|name| find(prefix, name));
            (x.is_none() && z.is_none()).then_some([y?; 3])
        };
        let layer = |name: &str| {
            let (prefix, _) = name.split_at(name.rfind('.')? + 1);
            color(prefix).or_else(|| grey(prefix))
        };
        color("")
            .or_else(|| grey(""))
            .or_else(|| self.channels.iter().find_map(|name| layer(name)))
    }

    /// The image with a main colour X, Y, Z (CIE 1931) as R, G, B of BT.709 in their place; itself where it has none, or
    /// has a red, green and blue already.
    #[must_use]
    pub fn into_rgb(mut self) -> Self {
        if let Some([x, y, z]) = self.xyz() {
            let to_rgb = Primaries::XYZ.to_bt709().expect("XYZ is a space");
            for pixel in self.data.chunks_exact_mut(self.channels.len()) {
                [pixel[x], pixel[y], pixel[z]] = to_rgb([pixel[x], pixel[y], pixel[z]]);
            }
            for (c, name) in [(x, "R"), (y, "G"), (z, "B")] {
                self.rename(c, name.into());
            }
        }
        self
    }

    /// As [`Image::into_rgb`], without a copy where there is nothing to change.
    pub fn in_rgb(&self) -> Cow<'_, Self> {
        match self.xyz() {
            Some(_) => Cow::Owned(self.clone().into_rgb()),
            None => Cow::Borrowed(self),
        }
    }

    /// The indices of X, Y and Z, where those are the main colour.
    pub fn xyz(&self) -> Option<[usize; 3]> {
        let [x, y, z] = ["X", "Y", "Z"].map(|name| self.channel(name));
        let found = [x?, y?, z?];
        self.channel("R").is_none().then_some(found)
    }

    /// Gives channel `c` another name.
    pub(super) fn rename(&mut self, c: usize, name: String) {
        self.channels[c] = name;
    }

    /// The index of the main opacity channel, A.
    pub fn alpha(&self) -> Option<usize> {
        self.channel("A")
    }
}

/// The number of samples of an image, where memory can be addressed for that many.
pub(super) fn sample_count(width: u32, height: u32, channels: usize) -> Option<usize> {
    (width as usize)
        .checked_mul(height as usize)?
        .checked_mul(channels)
        .filter(|&n| n <= isize::MAX as usize / size_of::<f32>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str]) -> Image {
        Image::new(1, 1, names.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn samples_lie_interleaved_row_by_row() {
        let mut image = Image::new(3, 2, vec!["R".into(), "G".into()]);
        image.set(2, 1, 1, 5.0);
        assert_eq!(image.data().iter().position(|&v| v == 5.0), Some(11));
        assert_eq!(image.get(2, 1, 1), 5.0);
        assert_eq!(image.pixel(2, 1), [0.0, 5.0]);
    }

    #[test]
    fn the_main_colour_is_found_by_name() {
        assert_eq!(named(&["A", "B", "G", "R"]).rgb(), Some([3, 2, 1]));
        assert_eq!(named(&["Y", "A"]).rgb(), Some([0, 0, 0]));
        assert_eq!(
            named(&["n.X", "a.B", "a.G", "a.R", "B", "G", "R"]).rgb(),
            Some([6, 5, 4])
        );
        assert_eq!(named(&["a.R", "b.R", "b.G", "b.B"]).rgb(), Some([1, 2, 3]));
        assert_eq!(named(&["X", "Y", "Z"]).rgb(), None);
        assert_eq!(named(&["R", "G"]).rgb(), None);
    }

    #[test]
    fn sizes_that_do_not_fit_are_errors() {
        assert!(Image::try_new(u32::MAX, u32::MAX, vec!["Y".into(); 4]).is_err());
        assert!(Image::from_data(2, 2, vec!["Y".into()], vec![0.0; 3]).is_err());
        assert!(Image::from_data(2, 2, vec!["Y".into()], vec![0.0; 4]).is_ok());
    }
}
