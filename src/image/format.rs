//! Which format a file has: on reading its first bytes decide, as names lie, and only TGA, which has no
//! mark, goes by its name; on writing the extension decides.

use std::path::Path;

use ::image::ImageFormat;

use super::{openexr, tiff};
use crate::error::{Error, Result};

/// A file format that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR, any channels, float32.
    Exr,
    /// Radiance RGBE.
    Hdr,
    /// Portable float map.
    Pfm,
    /// TIFF, 8 or 16 bits a channel, or float32.
    Tiff,
    /// PNG, 8 or 16 bits a channel.
    Png,
    /// JPEG, 8 bits a channel.
    Jpeg,
}

impl Format {
    /// The format that the extension of `path` asks for.
    ///
    /// # Errors
    /// For any extension but `.exr`, `.hdr`, `.pfm`, `.tif`, `.tiff`, `.png`, `.jpg` and `.jpeg`, in whatever case.
    pub fn of_output(path: &Path) -> Result<Self> {
        match extension(path).as_str() {
            "exr" => Ok(Self::Exr),
            "hdr" => Ok(Self::Hdr),
            "pfm" => Ok(Self::Pfm),
            "tif" | "tiff" => Ok(Self::Tiff),
            "png" => Ok(Self::Png),
            "jpg" | "jpeg" => Ok(Self::Jpeg),
            other => {
                let name = path.display();
                let message = if other.is_empty() {
                    format!("the image name {name} has no extension")
                } else {
                    format!("the image name {name} has the unknown extension .{other}")
                };
                Err(Error::input(message).help("use .exr, .hdr, .pfm, .tif, .png or .jpg"))
            }
        }
    }
}

/// The decoder for a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decoder {
    Exr,
    Hdr,
    Jpeg,
    Pfm,
    Tiff,
    Raster(ImageFormat),
}

impl Decoder {
    pub(super) fn of_input(path: &Path, bytes: &[u8]) -> Result<Self> {
        let marks: [(&[u8], Decoder); 7] = [
            (&openexr::MAGIC, Self::Exr),
            (b"\x89PNG\r\n\x1a\n", Self::Raster(ImageFormat::Png)),
            (b"\xff\xd8\xff", Self::Jpeg),
            (b"BM", Self::Raster(ImageFormat::Bmp)),
            (b"#?", Self::Hdr),
            (b"PF", Self::Pfm),
            (b"Pf", Self::Pfm),
        ];
        for (mark, decoder) in marks {
            if bytes.starts_with(mark) {
                return Ok(decoder);
            }
        }
        if tiff::is_tiff(bytes) {
            return Ok(Self::Tiff);
        }
        if let [b'P', b'1'..=b'7', space, ..] = bytes
            && (space.is_ascii_whitespace() || *space == b'#')
        {
            return Ok(Self::Raster(ImageFormat::Pnm));
        }
        if extension(path) == "tga" {
            return Ok(Self::Raster(ImageFormat::Tga));
        }
        if bytes.is_empty() {
            return Err(Error::input("the file is empty"));
        }
        Err(Error::input("the file is no image of a known format")
            .help("EXR, HDR, PFM, TIFF, PNG, JPEG, BMP, TGA and PPM are known"))
    }
}

fn extension(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}
