//! One side of a comparison by seeds: images come one after another, and what is kept of them are the
//! moments of their means, of their tiles' means and of each pixel.

use crate::compare::statistics::Moments;
use crate::error::{Error, Result};
use crate::image::Image;

/// The side of a tile in pixels; tiles at the right and lower edges may be smaller.
pub const TILE: usize = 16;

/// Luminance of linear BT.709.
pub(in crate::compare) const LUMINANCE: [f64; 3] = [0.212_671, 0.715_160, 0.072_169];

/// One side: what is kept of its images, one after another.
#[derive(Clone, Debug)]
pub struct Side {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) channels: Vec<String>,
    /// Which channels make the luminance.
    rgb: Option<[usize; 3]>,
    pub(super) count: usize,
    /// Image means by channel and, last, of the luminance where there is one.
    pub(super) means: Vec<Moments>,
    /// By tile and channel.
    pub(super) tiles: Vec<Moments>,
    /// Mean and sum of squared distances from it, by pixel and channel.
    pub(super) pixels: Vec<[f64; 2]>,
}

impl Side {
    /// A side without images yet, of the size and channels of `image`; `rgb` are the channels that make its
    /// luminance, if it has one.
    ///
    /// # Errors
    /// Where it does not fit into memory.
    pub fn new(image: &Image, rgb: Option<[usize; 3]>) -> Result<Self> {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let channels = image.channels().to_vec();
        let mut pixels = Vec::new();
        pixels
            .try_reserve_exact(image.data().len())
            .map_err(|_| Error::input("the images do not fit into memory"))?;
        pixels.resize(image.data().len(), [0.0; 2]);
        let rgb = rgb.filter(|rgb| rgb[0] != rgb[1]);
        let tiles = width.div_ceil(TILE) * height.div_ceil(TILE);
        Ok(Self {
            means: vec![Moments::default(); channels.len() + usize::from(rgb.is_some())],
            tiles: vec![Moments::default(); tiles * channels.len()],
            width,
            height,
            channels,
            rgb,
            count: 0,
            pixels,
        })
    }

    /// How many images it has.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Takes one more image.
    ///
    /// # Errors
    /// Where its size or channels differ from the others', or a value is not finite.
    pub fn push(&mut self, image: &Image) -> Result<()> {
        let (width, height) = (image.width() as usize, image.height() as usize);
        if (width, height) != (self.width, self.height) {
            return Err(Error::input(format!(
                "{width} × {height} pixels, where the others have {} × {}",
                self.width, self.height
            )));
        }
        if image.channels() != self.channels {
            return Err(Error::input(format!(
                "the channels {}, where the others have {}",
                image.channels().join(", "),
                self.channels.join(", ")
            )));
        }
        if let Some(value) = image.data().iter().find(|v| !v.is_finite()) {
            return Err(Error::input(format!("a value is {value}")));
        }
        self.count += 1;
        let n = self.count as f64;
        let channels = self.channels.len();
        let columns = width.div_ceil(TILE);
        let mut tiles = vec![0.0; self.tiles.len()];
        for (y, row) in image.data().chunks(width * channels).enumerate() {
            let kept = &mut self.pixels[y * width * channels..][..row.len()];
            for (i, (value, [mean, squares])) in row.iter().zip(kept).enumerate() {
                let value = f64::from(*value);
                let before = value - *mean;
                *mean += before / n;
                *squares += before * (value - *mean);
                let tile = y / TILE * columns + i / channels / TILE;
                tiles[tile * channels + i % channels] += value;
            }
        }
        let mut means = vec![0.0; channels];
        for (i, sum) in tiles.iter().enumerate() {
            means[i % channels] += sum;
            let pixels = self.pixels_of_tile(i / channels);
            self.tiles[i].push(sum / pixels as f64);
        }
        for mean in &mut means {
            *mean /= (width * height) as f64;
        }
        if let Some(rgb) = self.rgb {
            let luminance = rgb
                .iter()
                .zip(LUMINANCE)
                .map(|(&c, weight)| weight * means[c]);
            means.push(luminance.sum());
        }
        for (moments, mean) in self.means.iter_mut().zip(means) {
            moments.push(mean);
        }
        Ok(())
    }

    fn pixels_of_tile(&self, tile: usize) -> usize {
        let columns = self.width.div_ceil(TILE);
        let (x, y) = (tile % columns * TILE, tile / columns * TILE);
        (self.width - x).min(TILE) * (self.height - y).min(TILE)
    }

    /// What is known of a pixel's channel.
    pub(super) fn pixel(&self, index: usize) -> Moments {
        let [mean, squares] = self.pixels[index];
        Moments {
            count: self.count,
            mean,
            squares,
        }
    }

    /// The mean of its images.
    ///
    /// # Errors
    /// Where it does not fit into memory.
    pub fn mean(&self) -> Result<Image> {
        let side = |n: usize| u32::try_from(n).map_err(|_| Error::input("the image is too large"));
        let (width, height) = (side(self.width)?, side(self.height)?);
        let mut image = Image::try_new(width, height, self.channels.clone())?;
        for (value, [mean, _]) in image.data_mut().iter_mut().zip(&self.pixels) {
            *value = *mean as f32;
        }
        Ok(image)
    }

    /// The mean of the whole image over all channels.
    pub(super) fn scale(&self) -> f64 {
        let channels = &self.means[..self.channels.len()];
        channels.iter().map(|m| m.mean).sum::<f64>().abs() / channels.len().max(1) as f64
    }
}
