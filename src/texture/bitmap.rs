//! `bitmap`: an image file over texture coordinates, (0, 0) at the upper left corner of the image and v
//! downwards. `filter_type` is bilinear or nearest, `wrap_mode` repeat, mirror or clamp; 8- and 16-bit
//! files are decoded from sRGB unless `raw` says that they hold numbers; alpha is dropped.

use std::sync::Arc;

use glam::{Mat3, Vec2};

use super::{Palette, Pattern, Picture, to_uv, transformed};
use crate::budget::Budget;
use crate::color::{ColorModel, Role, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, choice, file, string};
use crate::error::Result;
use crate::interaction::Interaction;

/// An image whose texels are ready to be evaluated, row by row from the top.
#[derive(Debug)]
pub(super) struct Texels<C: ColorModel> {
    width: usize,
    height: usize,
    texels: Vec<C::Texel>,
}

#[derive(Clone, Copy, Debug)]
enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

impl Wrap {
    /// The texel that stands for index `i` of `n`, wherever `i` lies.
    fn apply(self, i: i64, n: usize) -> usize {
        let n = n as i64;
        // As a rule it lies inside, and a division takes long.
        if (0..n).contains(&i) {
            return i as usize;
        }
        let wrapped = match self {
            Self::Repeat => i.rem_euclid(n),
            Self::Clamp => i.clamp(0, n - 1),
            Self::Mirror => {
                let i = i.rem_euclid(2 * n);
                i.min(2 * n - 1 - i)
            }
        };
        wrapped as usize
    }
}

/// A texture from an image.
#[derive(Clone, Debug)]
pub struct Bitmap<C: ColorModel> {
    texels: Arc<Texels<C>>,
    nearest: bool,
    wrap: Wrap,
    to_uv: Mat3,
}

/// Four neighbouring texels.
#[derive(Clone, Copy, Debug)]
struct Cell<S> {
    /// Two rows of two.
    corners: [[S; 2]; 2],
    /// Where the point lies between them, in [0, 1)².
    f: Vec2,
}

impl<C: ColorModel> Bitmap<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "an image",
        properties: &[&[
            file("filename", "the image"),
            choice(
                "filter_type",
                &["bilinear", "nearest"],
                "how texels are looked up",
            ),
            choice(
                "wrap_mode",
                &["repeat", "mirror", "clamp"],
                "what lies beyond the edge",
            ),
            boolean(
                "raw",
                false,
                "numbers as they are in the file, and not sRGB codes of colours",
            ),
            super::TO_UV,
            string("format", "variant", "how Mitsuba stores texels").without_effect(),
            boolean("accel", true, "whether Mitsuba lets a GPU look texels up").without_effect(),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let nearest = properties.choice("filter_type")? == "nearest";
        let wrap = match properties.choice("wrap_mode")? {
            "mirror" => Wrap::Mirror,
            "clamp" => Wrap::Clamp,
            _ => Wrap::Repeat,
        };
        let raw = properties.boolean("raw")?;
        let path = properties.file("filename")?;
        let to_uv = to_uv(properties)?;
        let key = (path, palette.role, raw);
        let lock = || {
            palette
                .texels
                .lock()
                .expect("no thread panics while it holds the cache")
        };
        let cached = lock().get(&key).cloned();
        let texels = match cached {
            Some(texels) => texels,
            None => {
                let loaded = load(&key.0, palette, raw, properties.budget())
                    .map_err(|e| e.at(properties.location()))?;
                let Loaded { texels, clamped } = loaded;
                if clamped > 0 {
                    let all = texels.texels.len();
                    let message = format!(
                        "{clamped} of {all} texels reflect less than 0 or more than 1, and are clamped"
                    );
                    palette.warn(properties.error("filename", message));
                }
                lock().entry(key).or_insert(Arc::new(texels)).clone()
            }
        };
        Ok(Self {
            texels,
            nearest,
            wrap,
            to_uv,
        })
    }

    fn size(&self) -> Vec2 {
        Vec2::new(self.texels.width as f32, self.texels.height as f32)
    }

    /// The four texels around a point.
    #[inline(always)]
    fn cell(&self, uv: Vec2, wavelengths: &C::Wavelengths) -> Cell<C::Sample> {
        let p = transformed(&self.to_uv, uv) * self.size() - 0.5;
        let corner = p.floor();
        let (x, y) = (corner.x as i64, corner.y as i64);
        let Texels {
            width,
            height,
            texels,
        } = &*self.texels;
        let (left, right) = (
            self.wrap.apply(x, *width),
            self.wrap.apply(x.saturating_add(1), *width),
        );
        let (upper, lower) = (
            self.wrap.apply(y, *height) * width,
            self.wrap.apply(y.saturating_add(1), *height) * width,
        );
        let texel = |at: usize| C::evaluate_texel(&texels[at], wavelengths);
        Cell {
            corners: [
                [texel(upper + left), texel(upper + right)],
                [texel(lower + left), texel(lower + right)],
            ],
            f: p - corner,
        }
    }

    /// The texel at a point.
    fn nearest(&self, uv: Vec2, wavelengths: &C::Wavelengths) -> C::Sample {
        let Texels {
            width,
            height,
            texels,
        } = &*self.texels;
        let p = (transformed(&self.to_uv, uv) * self.size()).floor();
        let x = self.wrap.apply(p.x as i64, *width);
        let y = self.wrap.apply(p.y as i64, *height);
        C::evaluate_texel(&texels[y * width + x], wavelengths)
    }
}

struct Loaded<C: ColorModel> {
    texels: Texels<C>,
    /// How many texels are no reflectances.
    clamped: usize,
}

fn load<C: ColorModel>(
    path: &std::path::Path,
    palette: &Palette<C>,
    raw: bool,
    budget: &Budget,
) -> Result<Loaded<C>> {
    let picture = Picture::read(path, raw, budget)?;
    let [width, height] = picture.size();
    let role = if raw && palette.role == Role::Reflectance {
        Role::Quantity
    } else {
        palette.role
    };
    let mut clamped = 0;
    let texel = |rgb: [f32; 3]| {
        let fits = role != Role::Reflectance || rgb.iter().all(|v| (0.0..=1.0).contains(v));
        clamped += usize::from(!fits);
        palette.color.texel(rgb, role)
    };
    let texels = picture.into_texels(size_of::<C::Texel>(), |picture| {
        picture.texels().map(texel).collect()
    })?;
    Ok(Loaded {
        texels: Texels {
            width,
            height,
            texels,
        },
        clamped,
    })
}

impl<C: ColorModel> Pattern<C> for Bitmap<C> {
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        if self.nearest {
            return self.nearest(at.uv, wavelengths);
        }
        let Cell {
            corners: [[a, b], [c, d]],
            f,
        } = self.cell(at.uv, wavelengths);
        let value = (a * (1.0 - f.x) + b * f.x) * (1.0 - f.y) + (c * (1.0 - f.x) + d * f.x) * f.y;
        value.map(|v| if v.is_finite() { v } else { 0.0 })
    }

    fn gradient(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> [C::Sample; 2] {
        if self.nearest {
            return [C::Sample::zero(); 2];
        }
        let Cell {
            corners: [[a, b], [c, d]],
            f,
        } = self.cell(at.uv, wavelengths);
        let size = self.size();
        let along_x = ((b - a) * (1.0 - f.y) + (d - c) * f.y) * size.x;
        let along_y = ((c - a) * (1.0 - f.x) + (d - b) * f.x) * size.y;
        let m = &self.to_uv;
        [m.x_axis, m.y_axis].map(|axis| along_x * axis.x + along_y * axis.y)
    }

    fn resolution(&self) -> [usize; 2] {
        [self.texels.width, self.texels.height]
    }
}
