//! An image file as linear BT.709 texels, for the plugins that look into one: 8- and 16-bit files are decoded
//! from sRGB unless they hold plain numbers, values that are not finite count as 0, alpha is dropped unless it is what is
//! wanted. Images in glTF files are found there by their numbers.

use std::path::PathBuf;

use super::pyramid::{Levels, Pyramid};
use crate::budget::{Account, Budget};
use crate::color::{ColorModel, Pixels, Role, srgb};
use crate::error::{Error, Location, Result};
use crate::image::{self, Encoding, Image};
use crate::mesh::gltf_image;

/// What of a file is wanted.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Wanted {
    /// The image, or a glTF file with images in it.
    pub path: PathBuf,
    /// Which of a glTF file's images.
    pub image: Option<usize>,
    /// One of the channels `r`, `g`, `b` and `a`, the last of which is 1 where an image has none; `None`: the colour.
    pub channel: Option<char>,
    /// Whether it holds plain numbers.
    pub raw: bool,
}

impl Wanted {
    /// The colours of an image file.
    pub fn colors(path: PathBuf) -> Self {
        Self {
            path,
            image: None,
            channel: None,
            raw: false,
        }
    }

    fn read(&self, account: &Account) -> Result<image::Picture> {
        match self.image {
            None => image::read(&self.path, account),
            Some(index) => {
                let bytes = gltf_image(&self.path, index, u64::MAX, account)?;
                let picture = image::read_bytes(&self.path, &bytes, account);
                picture.map_err(|e| {
                    let message = &e.problems()[0].message;
                    Error::input(format!("image {index} in it: {message}"))
                        .at(&Location::of_file(&self.path))
                })
            }
        }
    }
}

/// The colours of an image file.
#[derive(Debug)]
pub struct Picture {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Row by row from the top.
    pub pixels: Pixels,
    /// Whether the file has greys, and no colours.
    pub grey: bool,
    account: Account,
}

impl Picture {
    /// Reads what is wanted.
    ///
    /// # Errors
    /// Where the file cannot be read, holds no colours or is larger than the budget allows.
    pub fn read(wanted: &Wanted, budget: &Budget) -> Result<Self> {
        let account = budget.open();
        let picture = wanted.read(&account)?;
        let image = picture.image.into_rgb();
        let channels = match wanted.channel {
            None => image.rgb(),
            Some('a') => match image.alpha() {
                Some(alpha) => Some([alpha; 3]),
                None => return Ok(Self::opaque(account)),
            },
            Some(channel) => image.rgb().map(|[r, g, b]| match channel {
                'r' => [r; 3],
                'g' => [g; 3],
                _ => [b; 3],
            }),
        };
        let Some(rgb) = channels else {
            let message = format!("no colour channels among {:?}", image.channels());
            return Err(Error::input(message).at(&Location::of_file(&wanted.path)));
        };
        let raw = wanted.raw || wanted.channel == Some('a');
        let size = [image.width() as usize, image.height() as usize];
        let take = |bytes| account.take_rows(size[0] * size[1], bytes);
        let decode: fn(f32) -> f32 = match picture.encoding {
            Encoding::Srgb if !raw => srgb::decode,
            Encoding::Srgb | Encoding::Linear => |value| value,
        };
        let mut codes = None;
        if picture.encoding == Encoding::Srgb {
            take(size_of::<u32>())?;
            codes = self::codes(&image, rgb);
        }
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        let linear = |value| finite(decode(value));
        Ok(Self {
            size,
            grey: rgb[0] == rgb[1],
            pixels: match codes {
                Some(codes) => {
                    let values = std::array::from_fn(|code| decode(of_code(code as u8)));
                    Pixels::Codes(codes, Box::new(values))
                }
                None => {
                    take(size_of::<[f32; 3]>())?;
                    Pixels::Linear(colors(&image, rgb).map(|color| color.map(linear)).collect())
                }
            },
            account,
        })
    }

    /// The opacity of an image that has none.
    fn opaque(account: Account) -> Self {
        Self {
            size: [1, 1],
            pixels: Pixels::Linear(vec![[1.0; 3]]),
            grey: true,
            account,
        }
    }

    /// Smaller images of what the colours stand for, see [`Levels`].
    ///
    /// # Errors
    /// Where the budget does not allow them.
    pub(super) fn levels(&self, role: Role) -> Result<Levels> {
        let sizes = Levels::sizes(self.size);
        let count: usize = sizes.iter().map(|[width, height]| width * height).sum();
        self.account.take_rows(count, size_of::<[f32; 3]>())?;
        let fraction = role == Role::Reflectance;
        Ok(Levels::new(self.size, sizes, |index| {
            let color = self.pixels.get(index);
            match fraction {
                true => color.map(|value| value.clamp(0.0, 1.0)),
                false => color,
            }
        }))
    }

    /// Its texels in the form in which they are evaluated; their memory is kept in place of the picture's.
    ///
    /// # Errors
    /// Where the budget does not allow it.
    pub fn into_texels<C: ColorModel>(self, color: &C, role: Role) -> Result<C::Texels> {
        Ok(self.into_both(color, role, None)?.0)
    }

    /// The same with those of its levels.
    ///
    /// # Errors
    /// Where the budget does not allow it.
    pub(super) fn into_pyramid<C: ColorModel>(
        self,
        color: &C,
        role: Role,
    ) -> Result<(C::Texels, Pyramid<C>)> {
        let levels = self.levels(role)?;
        let (texels, above) = self.into_both(color, role, Some(levels.pixels))?;
        let above = above.expect("there are as many as were given");
        Ok((texels, Pyramid::new(levels.sizes, above)))
    }

    /// Its texels, and those above them.
    fn into_both<C: ColorModel>(
        self,
        color: &C,
        role: Role,
        above: Option<Pixels>,
    ) -> Result<(C::Texels, Option<C::Texels>)> {
        let Self {
            pixels, account, ..
        } = self;
        let mut kept = 0;
        let mut stored = |pixels: Pixels| {
            let (count, bytes) = (pixels.count(), C::texel_bytes(&pixels));
            account.take_rows(count, bytes)?;
            kept += (count * bytes) as u64;
            Ok::<_, Error>(color.texels(pixels, role))
        };
        let texels = stored(pixels)?;
        let above = above.map(stored).transpose()?;
        account.keep(kept);
        Ok((texels, above))
    }
}

/// The values of three channels, row by row from the top.
fn colors(image: &Image, rgb: [usize; 3]) -> impl Iterator<Item = [f32; 3]> {
    (0..image.height()).flat_map(move |y| {
        (0..image.width()).map(move |x| {
            let pixel = image.pixel(x, y);
            rgb.map(|channel| pixel[channel])
        })
    })
}

/// The value of a code of eight bits.
fn of_code(code: u8) -> f32 {
    f32::from(code) / 255.0
}

/// All texels as codes of eight bits, if that is what they are.
fn codes(image: &Image, rgb: [usize; 3]) -> Option<Vec<u32>> {
    let code = |value: f32| {
        let code = (value * 255.0).round() as u8;
        (of_code(code) == value).then_some(code)
    };
    colors(image, rgb)
        .map(|color| {
            let [r, g, b] = color.map(code);
            Some(u32::from_le_bytes([r?, g?, b?, 0]))
        })
        .collect()
}
