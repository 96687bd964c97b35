//! Noise taken out of images by Open Image Denoise 2 (Áfra, 2019–), which has learned what renders look like. It is told
//! what is seen by two guides, the diffuse reflectance and the shading normal of first hits, which are cleaned by
//! themselves first. The main colour is denoised and nothing else. It wants pixels whose noise is their own, as those of
//! a box filter.

mod oidn;

use std::path::Path;

use crate::error::{Error, Result};
use crate::image::Image;
use oidn::{Colors, Oidn, Setting, Subject};

/// The library, ready.
#[derive(Debug)]
pub struct Denoiser {
    oidn: Oidn,
}

/// The names of layers that guide.
#[derive(Clone, Debug, Default)]
pub struct Guides {
    /// With channels R, G, B.
    pub albedo: Option<String>,
    /// With channels X, Y, Z.
    pub normal: Option<String>,
}

/// What layers are called that a render with guides has.
pub const ALBEDO: &str = "denoise.albedo";
/// See [`ALBEDO`].
pub const NORMAL: &str = "denoise.normal";

impl Guides {
    /// Those that the image has by the usual names, in place of those that are not named.
    #[must_use]
    pub fn or_found_in(self, image: &Image) -> Self {
        let found = |names: &[&str], suffixes| {
            let has = |name: &&&str| layer(image, name, suffixes).is_some();
            names.iter().find(has).map(|name| (*name).to_owned())
        };
        let albedo = || found(&[ALBEDO, "albedo"], RGB);
        let normal = || {
            found(
                &[NORMAL, "sh_normal", "normal", "normals", "geo_normal"],
                XYZ,
            )
        };
        Self {
            albedo: self.albedo.or_else(albedo),
            normal: self.normal.or_else(normal),
        }
    }
}

const RGB: [&str; 3] = ["R", "G", "B"];
const XYZ: [&str; 3] = ["X", "Y", "Z"];

/// The indices of a layer's channels.
fn layer(image: &Image, name: &str, suffixes: [&str; 3]) -> Option<[usize; 3]> {
    let [a, b, c] = suffixes.map(|suffix| image.channel(&format!("{name}.{suffix}")));
    Some([a?, b?, c?])
}

/// Three channels of each pixel; what is no number is 0.
fn pixels(image: &Image, channels: [usize; 3]) -> Vec<[f32; 3]> {
    let count = image.channels().len();
    let number = |value: f32| if value.is_finite() { value } else { 0.0 };
    let pixel = |pixel: &[f32]| channels.map(|c| number(pixel[c]));
    image.data().chunks_exact(count).map(pixel).collect()
}

impl Denoiser {
    /// With the library at `path` (a file, or a folder that holds it), or where the system looks for libraries; it takes
    /// so many threads, 0 being one a processor. The image does not depend on how many.
    ///
    /// # Errors
    /// Where there is no library, or one that is too old.
    pub fn load(path: Option<&Path>, threads: usize) -> Result<Self> {
        let oidn = Oidn::load(path)?;
        oidn.start(threads)?;
        Ok(Self { oidn })
    }

    /// The library's version.
    pub fn version(&self) -> String {
        let version = self.oidn.version();
        format!(
            "{}.{}.{}",
            version / 10_000,
            version / 100 % 100,
            version % 100
        )
    }

    /// The image with its main colour denoised, and without the guides of a render that was made for this.
    ///
    /// # Errors
    /// Where the image has no colour or not the layers that are named, or the library fails.
    pub fn denoise(&self, image: &Image, guides: &Guides) -> Result<Image> {
        let Some(channels) = image.rgb() else {
            let error = Error::input("the image has no red, green and blue to be denoised");
            return Err(error.help("etendue info tells an image's channels"));
        };
        let (width, height) = (image.width() as usize, image.height() as usize);
        let guide = |name: &Option<String>, suffixes, subject| {
            let Some(name) = name else { return Ok(None) };
            let Some(channels) = layer(image, name, suffixes) else {
                let names = suffixes.map(|suffix| format!("{name}.{suffix}")).join(", ");
                let error = Error::input(format!("the image has no channels {names}"));
                return Err(error.help("etendue info tells an image's channels"));
            };
            let values = pixels(image, channels);
            let noisy = Colors {
                width,
                height,
                values: &values,
            };
            self.oidn
                .filter(subject, &noisy, Setting::default())
                .map(Some)
        };
        let albedo = guide(&guides.albedo, RGB, Subject::Albedo)?;
        // The library takes normals with an albedo alone.
        let normal = match albedo {
            Some(_) => guide(&guides.normal, XYZ, Subject::Normal)?,
            None => None,
        };
        let values = pixels(image, channels);
        let noisy = Colors {
            width,
            height,
            values: &values,
        };
        let setting = Setting {
            albedo: albedo.as_deref(),
            normal: normal.as_deref(),
        };
        let clean = self.oidn.filter(Subject::Color, &noisy, setting)?;
        let kept: Vec<usize> = (image.channels().iter().enumerate())
            .filter(|(_, name)| !name.starts_with("denoise."))
            .map(|(c, _)| c)
            .collect();
        let names = kept.iter().map(|c| image.channels()[*c].clone());
        let mut denoised = Image::try_new(image.width(), image.height(), names.collect())?;
        let from = image.data().chunks_exact(image.channels().len());
        let to = denoised.data_mut().chunks_exact_mut(kept.len());
        for ((from, to), clean) in from.zip(to).zip(&clean) {
            for (to, c) in to.iter_mut().zip(&kept) {
                let place = channels.iter().position(|channel| channel == c);
                *to = place.map_or(from[*c], |place| clean[place]);
            }
        }
        Ok(denoised)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_library_is_told_with_what_to_install() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("libOpenImageDenoise.so.2");
        for path in [folder.path(), &file] {
            let error = Denoiser::load(Some(path), 1).unwrap_err().to_string();
            assert!(error.contains("pip install pyoidn"), "{error}");
        }
        std::fs::write(&file, "no library").unwrap();
        let error = Denoiser::load(Some(folder.path()), 1)
            .unwrap_err()
            .to_string();
        assert!(error.contains("cannot be loaded"), "{error}");
    }

    #[test]
    fn guides_are_found_by_the_usual_names() {
        let names = [
            "R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "normal.X",
        ];
        let image = Image::new(2, 2, names.map(String::from).to_vec());
        let guides = Guides::default().or_found_in(&image);
        assert_eq!(guides.albedo.as_deref(), Some("albedo"));
        assert_eq!(guides.normal, None);
    }
}
