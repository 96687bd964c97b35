//! From scene-referred to display-referred. A [`DisplayTransform`] makes linear values into codes for a screen: exposure,
//! a view (how more light than a display has is compressed), glare, the display's primaries, the light of the room, its
//! curve, and as many bits as it has. [`save`] is how renders leave: EXR, HDR and PFM stay linear, PNG and JPEG are encoded, and TIFF
//! is either.

pub mod diagram;
pub mod srgb;

mod aces;
mod agx;
mod ambient;
mod blur;
mod dither;
mod exposure;
mod glare;
mod local;
mod native;
mod sigmoid;
mod transfer;

use std::path::Path;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::color::Primaries;
use crate::error::{Error, Result};
use crate::image::{self, Code, Codes, Format, Image, Layout, Metadata, Tag, Window};

pub use ambient::{Ambient, AmbientMode};
pub use exposure::Exposure;
pub use native::{chromaticities_of, gamut, native};
pub use transfer::{Transfer, WHITE_NITS};

/// How light beyond the display's range is brought into it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// Not at all: what is above 1 is cut off.
    #[default]
    Standard,
    /// By a sigmoid about the geometric mean of luminance.
    Sigmoid,
    /// By the luminance of each place's neighbourhood.
    Local,
    /// AgX, as Blender has it.
    Agx,
    /// ACES 1.
    Aces,
}

/// A display's primaries; white is D65.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gamut {
    /// ITU-R BT.709, as sRGB has them.
    #[default]
    Bt709,
    /// P3.
    P3,
    /// ITU-R BT.2020.
    Bt2020,
}

/// Bits of a code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Depth {
    /// 256 codes.
    #[default]
    Eight,
    /// 65,536 codes.
    Sixteen,
    /// No codes: linear values as they are, as float32, which of these formats only TIFF has.
    Float,
}

/// What lies between linear values and codes. By default exactly sRGB in 8 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayTransform {
    /// A factor before all else.
    pub exposure: Exposure,
    /// How the range is compressed.
    pub view: View,
    /// How much of the light beyond the display's maximum is spread over its neighbourhood; from 0 to 1.
    pub glare: f32,
    /// The display's primaries.
    pub gamut: Gamut,
    /// The light of the room that it stands in; `None`: it is dark.
    pub ambient: Option<Ambient>,
    /// Its curve.
    pub transfer: Transfer,
    /// Bits of a code.
    pub depth: Depth,
    /// Whether what lies between two codes becomes either by a pattern of blue noise, so that no bands are seen.
    pub dither: bool,
}

impl Default for DisplayTransform {
    fn default() -> Self {
        Self {
            exposure: Exposure::Stops(0.0),
            view: View::Standard,
            glare: 0.0,
            gamut: Gamut::Bt709,
            ambient: None,
            transfer: Transfer::Srgb,
            depth: Depth::Eight,
            dither: false,
        }
    }
}

/// A color whose components are no larger than the largest half-precision number, either way; what is no number is 0.
fn within_half(rgb: [f32; 3]) -> DVec3 {
    const LARGEST: f32 = 65504.0;
    let within = rgb.map(|v| match v.is_nan() {
        true => 0.0,
        false => f64::from(v.clamp(-LARGEST, LARGEST)),
    });
    within.into()
}

/// Pixels that one task encodes.
const GRAIN: usize = 1 << 13;

impl DisplayTransform {
    /// Finds out whether an image can be written as a file of this name.
    ///
    /// # Errors
    /// Where its format has not as many bits, or cannot say what the codes mean; where the extension is unknown.
    pub fn check(&self, path: &Path) -> Result<()> {
        match (Format::of_output(path)?, self.depth) {
            (Format::Png | Format::Jpeg, Depth::Float) => {
                Err(Error::input("PNG and JPEG have no floats")
                    .help("use .tif, or .exr, .hdr or .pfm, which always have"))
            }
            (_, Depth::Float) => Ok(()),
            (_, Depth::Eight) => image::check_codes(path, 8, self.tag()),
            (_, Depth::Sixteen) => image::check_codes(path, 16, self.tag()),
        }
    }

    /// Writes the codes of an image's main colour, and of its straight opacity if it has a channel A, as PNG, TIFF or
    /// JPEG; or as TIFF their linear values.
    ///
    /// # Errors
    /// Where the image has neither R, G, B nor X, Y, Z nor Y, or no pixels; where the format cannot hold them, or the file
    /// system refuses.
    pub fn write(&self, path: &Path, image: &Image) -> Result<()> {
        self.check(path)?;
        match self.depth {
            Depth::Float => image::write(path, image, &Metadata::default()),
            Depth::Eight => image::write_codes(path, &self.codes::<u8>(image)?, self.tag()),
            Depth::Sixteen => image::write_codes(path, &self.codes::<u16>(image)?, self.tag()),
        }
    }

    /// The 8-bit codes of an image's main colour and opacity.
    ///
    /// # Errors
    /// As [`DisplayTransform::write`].
    pub fn shown(&self, image: &Image) -> Result<Codes> {
        self.codes(image)
    }

    /// The codes of an image's main colour and opacity, of as many bits as `T` has.
    fn codes<T: Quantised>(&self, image: &Image) -> Result<Codes<T>> {
        let image = &*image.in_rgb();
        let Some(rgb) = image.rgb() else {
            return Err(Error::input("a display image needs channels R, G, B or Y")
                .help("write EXR, which takes any channels"));
        };
        let alpha = image.alpha();
        let layout = match (rgb[0] == rgb[1], alpha) {
            (true, None) => Layout::Grey,
            (true, Some(_)) => Layout::GreyAlpha,
            (false, None) => Layout::Rgb,
            (false, Some(_)) => Layout::Rgba,
        };
        let stride = image.channels().len();
        let colour = |pixel: &[f32]| rgb.map(|c| pixel[c]);
        let mut pixels: Vec<[f32; 3]> = image.data().chunks_exact(stride).map(colour).collect();
        let width = image.width() as usize;
        self.show(&mut pixels, width);
        let channels = layout.channels();
        let colours = channels - usize::from(alpha.is_some());
        let mut codes = vec![T::default(); pixels.len() * channels];
        let coded = codes.par_chunks_exact_mut(channels).enumerate();
        let sources = pixels.par_iter().zip(image.data().par_chunks_exact(stride));
        (coded.zip(sources).with_min_len(GRAIN)).for_each(|((i, codes), (shown, source))| {
            let (x, y) = (i % width, i / width);
            for (c, code) in codes[..colours].iter_mut().enumerate() {
                *code = self.code(shown[c], [x, y], c);
            }
            if let Some(a) = alpha {
                codes[colours] = T::of(source[a].clamp(0.0, 1.0), 0.5);
            }
        });
        Codes::new(image.width(), image.height(), layout, codes)
    }

    /// From scene-referred linear BT.709 to light of the display's primaries, of which 1 is white.
    fn show(&self, pixels: &mut [[f32; 3]], width: usize) {
        let exposure = self.exposure.factor(pixels);
        match self.view {
            View::Sigmoid => sigmoid::view(pixels, exposure),
            View::Local => local::view(pixels, width, exposure),
            View::Standard | View::Agx | View::Aces if exposure != 1.0 => {
                for pixel in &mut *pixels {
                    *pixel = pixel.map(|v| v * exposure);
                }
            }
            View::Standard | View::Agx | View::Aces => {}
        }
        match self.view {
            View::Agx => {
                let agx = agx::Agx::new();
                each(pixels, |rgb| agx.view(rgb));
            }
            View::Aces => {
                let aces = aces::Aces::new();
                each(pixels, |rgb| aces.view(rgb));
            }
            View::Standard | View::Sigmoid | View::Local => {}
        }
        if self.glare > 0.0 && !pixels.is_empty() {
            glare::add(pixels, width, self.glare);
        }
        if let Some(matrix) = self.gamut.matrix() {
            each(pixels, |rgb| {
                (matrix * DVec3::from(rgb.map(f64::from))).as_vec3().into()
            });
        }
        if let Some(ambient) = &self.ambient {
            each(pixels, |rgb| ambient.view(rgb));
        }
    }

    /// The code of a shown value.
    fn code<T: Quantised>(&self, shown: f32, [x, y]: [usize; 2], channel: usize) -> T {
        if self.dither {
            return T::of(
                self.transfer.encode(shown),
                dither::threshold(x, y, channel),
            );
        }
        match (self.transfer, T::SRGB) {
            (Transfer::Srgb, Some(encode)) => encode(shown),
            _ => T::of(self.transfer.encode(shown), 0.5),
        }
    }

    /// What the codes mean.
    fn tag(&self) -> Tag {
        let primaries = match self.gamut {
            Gamut::Bt709 => 1,
            Gamut::P3 => 12,
            Gamut::Bt2020 => 9,
        };
        match (self.transfer, self.gamut) {
            (Transfer::Srgb, Gamut::Bt709) => Tag::Srgb,
            (Transfer::Gamma(exponent), gamut) => Tag::Gamma(exponent, gamut.primaries()),
            (Transfer::Srgb, _) => Tag::Cicp {
                primaries,
                transfer: 13,
            },
            (Transfer::Pq, _) => Tag::Cicp {
                primaries,
                transfer: 16,
            },
            (Transfer::Hlg, _) => Tag::Cicp {
                primaries,
                transfer: 18,
            },
        }
    }
}

/// Changes every pixel by itself.
fn each(pixels: &mut [[f32; 3]], view: impl Fn([f32; 3]) -> [f32; 3] + Sync) {
    let pixels = pixels.par_iter_mut().with_min_len(GRAIN);
    pixels.for_each(|pixel| *pixel = view(*pixel));
}

impl Gamut {
    fn primaries(self) -> Primaries {
        match self {
            Self::Bt709 => Primaries::BT709,
            Self::P3 => Primaries::P3_D65,
            Self::Bt2020 => Primaries::BT2020,
        }
    }

    /// From linear BT.709, unless it is that.
    fn matrix(self) -> Option<DMat3> {
        let to_xyz = |primaries: Primaries| primaries.to_xyz().expect("they are a space");
        (self != Self::Bt709).then(|| to_xyz(self.primaries()).inverse() * to_xyz(Primaries::BT709))
    }
}

/// A code that a value in [0, 1] is brought to.
trait Quantised: Code + Default + Send {
    /// What encodes linear values as sRGB at once, where there is such a thing.
    const SRGB: Option<fn(f32) -> Self>;
    /// The next code below where the rest is less than 1 − `threshold`, else the next one above.
    fn of(value: f32, threshold: f32) -> Self;
}

impl Quantised for u8 {
    const SRGB: Option<fn(f32) -> Self> = Some(srgb::encode_value);

    fn of(value: f32, threshold: f32) -> Self {
        (value * 255.0 + threshold) as u8
    }
}

impl Quantised for u16 {
    const SRGB: Option<fn(f32) -> Self> = None;

    fn of(value: f32, threshold: f32) -> Self {
        (value * 65535.0 + threshold) as u16
    }
}

/// Writes an image in linear BT.709 or XYZ in the format of the extension: `.exr` (every channel, metadata), `.hdr` or
/// `.pfm` (main colour), `.tif`, `.png` or `.jpg` (main colour, TIFF and PNG with opacity, as `display` makes them into
/// codes). The file appears whole or not at all.
///
/// # Errors
/// Where the extension is another, the format cannot hold the image, or the file system refuses.
pub fn save(
    path: &Path,
    image: &Image,
    metadata: &Metadata,
    display: &DisplayTransform,
) -> Result<()> {
    match Format::of_output(path)? {
        Format::Tiff | Format::Png | Format::Jpeg => display.write(path, image),
        Format::Hdr | Format::Pfm => image::write(path, &image.in_rgb(), metadata),
        Format::Exr => image::write(path, image, metadata),
    }
}

/// Like [`save`], for an image that is a part of a whole: EXR says which, the others only store the part.
///
/// # Errors
/// As [`save`], and where the image reaches beyond the whole.
pub fn save_window(
    path: &Path,
    image: &Image,
    window: &Window,
    metadata: &Metadata,
    display: &DisplayTransform,
) -> Result<()> {
    match Format::of_output(path)? {
        Format::Tiff | Format::Png | Format::Jpeg | Format::Hdr | Format::Pfm => {
            save(path, image, metadata, display)
        }
        Format::Exr => image::write_window(path, image, window, metadata),
    }
}

#[cfg(test)]
mod tests;
