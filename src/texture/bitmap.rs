//! `bitmap`: an image file over texture coordinates, (0, 0) at the upper left corner of the image and v
//! downwards. `filter_type` is bilinear or nearest, or one of Étendue's own: `trilinear`, between levels of the image that are
//! each half as large, by how much of it what a ray stands for covers ([`super::pyramid`]); and `anisotropic`, by up to
//! `max_anisotropy` such looks along what is covered where that is longer than wide ([`super::probes`]). Where nobody knows what a
//! ray stands for, these two are bilinear. `wrap_mode` is repeat, mirror or clamp; 8- and 16-bit
//! files are decoded from sRGB unless `raw` says that they hold numbers; alpha is dropped. Étendue's own are `image`, the number
//! of an image that lies in a glTF file, `channel`: one channel in place of the colour, and `wrap_mode_v`. In bands, as in Mitsuba's
//! spectral variants, colours become the spectra of reflectances whatever they stand for: as light they are clamped to
//! [0, 1] and have no illuminant, unless a `d65` holds the bitmap.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use glam::{Mat3, Vec2};

use super::probes::{Probes, Shape};
use super::pyramid::{Mipmap, Pyramid};
use super::{Palette, Pattern, Picture, TexelKey, Wanted, to_uv, transformed};
use crate::budget::Budget;
use crate::color::{ColorModel, Role, Spectra, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, choice, file, integer, string};
use crate::description::properties::STRICT;
use crate::error::Result;
use crate::interaction::Interaction;
use crate::lanes::{self, Call, Ints, Lanes};
use crate::mesh;

/// An image whose texels are ready to be evaluated, row by row from the top.
#[derive(Debug)]
pub(super) struct Texels<C: ColorModel> {
    size: [usize; 2],
    texels: C::Texels,
    /// Where that was asked for, and the image has more than a texel.
    pyramid: Option<Pyramid<C>>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

/// The remainder of whole numbers by `n`, in [0, n).
#[inline(always)]
fn modulo<F: Lanes>(i: F, n: F) -> F {
    let rest = i - (i / n).floor() * n;
    // What the quotient's rounding leaves.
    let rest = F::select(rest.lt(F::zero()), rest + n, rest);
    F::select(rest.lt(n), rest, rest - n)
}

impl Wrap {
    fn named(name: &str) -> Self {
        match name {
            "mirror" => Self::Mirror,
            "clamp" => Self::Clamp,
            _ => Self::Repeat,
        }
    }

    /// The texel that stands for the whole number `i` of `n`, wherever it lies.
    #[inline(always)]
    pub(super) fn apply<F: Lanes>(self, i: F, n: usize) -> F::Int {
        self.apply_each(i, F::splat(n as f32))
    }

    /// The same of as many texels as each lane says.
    #[inline(always)]
    pub(super) fn apply_each<F: Lanes>(self, i: F, n: F) -> F::Int {
        let wrapped = match self {
            Self::Repeat => modulo(i, n),
            Self::Clamp => i,
            Self::Mirror => {
                let i = modulo(i, n + n);
                i.min(n + n - F::one() - i)
            }
        };
        wrapped.max(F::zero()).min(n - F::one()).to_int()
    }
}

/// A texture from an image.
#[derive(Clone, Debug)]
pub struct Bitmap<C: ColorModel> {
    texels: Arc<Texels<C>>,
    nearest: bool,
    /// How what is seen of the image is looked up in its levels, if it has any.
    shape: Shape,
    /// Along u and v.
    wrap: [Wrap; 2],
    to_uv: Mat3,
}

/// Four neighbouring texels.
#[derive(Clone, Copy, Debug)]
struct Cell<F, S> {
    /// Two rows of two.
    corners: [[S; 2]; 2],
    /// Where the point lies between them, in [0, 1)².
    f: lanes::Vec2<F>,
}

impl<C: ColorModel> Bitmap<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "an image",
        properties: &[&[
            file("filename", "the image, or a glTF file with images in it"),
            integer("image", 0, "which of a glTF file's images, from 0")
                .between(0.0, 1e6)
                .absent("the file is the image")
                .own(),
            choice(
                "channel",
                &["color", "r", "g", "b", "a"],
                "what of it is looked up; an image without a is opaque",
            )
            .own(),
            choice(
                "filter_type",
                &["bilinear", "nearest", "trilinear", "anisotropic"],
                "how texels are looked up; the last two, of smaller images where it is far away, are Étendue's own",
            ),
            integer(
                "max_anisotropy",
                16,
                "the most looks of filter_type anisotropic",
            )
            .between(1.0, 256.0)
            .own(),
            choice(
                "wrap_mode",
                &["repeat", "mirror", "clamp"],
                "what lies beyond the edge",
            ),
            choice(
                "wrap_mode_v",
                &["same", "repeat", "mirror", "clamp"],
                "what lies above and below, if not the same",
            )
            .own(),
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
        let most = properties.integer("max_anisotropy")? as u32;
        let (nearest, shape) = match properties.choice("filter_type")? {
            "nearest" => (true, None),
            "trilinear" => (false, Some(Shape::Round)),
            "anisotropic" => (false, Some(Shape::Long(most))),
            _ => (false, None),
        };
        if shape.is_some() && properties.is_strict() {
            let message = "this filter is Étendue's own";
            return Err(properties.error("filter_type", message).help(STRICT));
        }
        let along_u = properties.choice("wrap_mode")?;
        let along_v = match properties.choice("wrap_mode_v")? {
            "same" => along_u,
            other => other,
        };
        let wrap = [along_u, along_v].map(Wrap::named);
        let raw = properties.boolean("raw")?;
        let path = properties.file("filename")?;
        let to_uv = to_uv(properties)?;
        let mipmapped = shape.is_some();
        let image = properties.given::<i64>("image")?;
        let holds_images = matches!(mesh::extension(&path).as_str(), "gltf" | "glb");
        if image.is_some() != holds_images {
            let message = match holds_images {
                true => "a glTF file holds several images: give image, from 0",
                false => "only a glTF file (.gltf, .glb) holds images that have numbers",
            };
            return Err(properties.error("image", message));
        }
        let channel = properties.choice("channel")?;
        let key = TexelKey {
            wanted: Wanted {
                path,
                image: image.map(|index| index as usize),
                channel: (channel != "color")
                    .then(|| channel.chars().next())
                    .flatten(),
                raw,
            },
            role: palette.role,
            mipmapped,
        };
        palette.mipmaps.fetch_or(mipmapped, Ordering::Relaxed);
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
                let loaded = load(&key, palette, properties.budget())
                    .map_err(|e| e.at(properties.location()))?;
                let Loaded { texels, clamped } = loaded;
                if clamped > 0 {
                    let [width, height] = texels.size;
                    let all = width * height;
                    let message = format!(
                        "{clamped} of {all} texels are below 0 or above 1, and are clamped to that"
                    );
                    palette.warn(properties.error("filename", message));
                }
                lock().entry(key).or_insert(Arc::new(texels)).clone()
            }
        };
        Ok(Self {
            texels,
            nearest,
            shape: shape.unwrap_or(Shape::Round),
            wrap,
            to_uv,
        })
    }

    /// A point in texels, from the upper left corner of the first.
    #[inline(always)]
    fn place<F: Lanes>(&self, uv: lanes::Vec2<F>) -> lanes::Vec2<F> {
        let [width, height] = self.texels.size.map(|n| F::splat(n as f32));
        let uv = transformed(&self.to_uv, uv);
        lanes::Vec2::new(uv.x * width, uv.y * height)
    }

    /// The four texels around points.
    #[inline(always)]
    fn cell<F: Lanes>(
        &self,
        uv: lanes::Vec2<F>,
        wavelengths: &[C::Wavelengths],
    ) -> Cell<F, C::Columns<F>> {
        let place = self.place(uv);
        let (px, py) = (place.x - F::splat(0.5), place.y - F::splat(0.5));
        let (x, y) = (px.floor(), py.floor());
        let Texels { size, texels, .. } = &*self.texels;
        let [width, height] = *size;
        let [along_u, along_v] = self.wrap;
        let (left, right) = (along_u.apply(x, width), along_u.apply(x + F::one(), width));
        let stride = Ints::splat(width as u32);
        let (upper, lower) = (
            along_v.apply(y, height) * stride,
            along_v.apply(y + F::one(), height) * stride,
        );
        Cell {
            corners: [
                [
                    C::evaluate_texels(texels, upper + left, wavelengths),
                    C::evaluate_texels(texels, upper + right, wavelengths),
                ],
                [
                    C::evaluate_texels(texels, lower + left, wavelengths),
                    C::evaluate_texels(texels, lower + right, wavelengths),
                ],
            ],
            f: lanes::Vec2::new(px - x, py - y),
        }
    }

    /// The image with its levels, if it has any.
    #[inline(always)]
    fn mipmap(&self) -> Option<Mipmap<'_, C>> {
        let Texels {
            size,
            texels,
            pyramid,
        } = &*self.texels;
        let (size, wrap) = (*size, self.wrap);
        pyramid.as_ref().map(|pyramid| Mipmap {
            size,
            texels,
            pyramid,
            wrap,
        })
    }

    /// The values at points that cover so much of texture coordinates, see [`Interaction::footprint`].
    #[inline(always)]
    pub(super) fn eval_lanes<F: Lanes>(
        &self,
        uv: lanes::Vec2<F>,
        footprint: [lanes::Vec2<F>; 2],
        wavelengths: &[C::Wavelengths],
    ) -> C::Columns<F> {
        if let Some(mipmap) = self.mipmap() {
            return F::call(Look {
                bitmap: self,
                mipmap,
                uv,
                footprint,
                wavelengths,
            });
        }
        if self.nearest {
            let place = self.place(uv);
            let Texels { size, texels, .. } = &*self.texels;
            let [along_u, along_v] = self.wrap;
            let x = along_u.apply(place.x.floor(), size[0]);
            let y = along_v.apply(place.y.floor(), size[1]);
            let index = y * Ints::splat(size[0] as u32) + x;
            return C::evaluate_texels(texels, index, wavelengths);
        }
        let Cell {
            corners: [[a, b], [c, d]],
            f,
        } = self.cell(uv, wavelengths);
        let (gx, gy) = (F::one() - f.x, F::one() - f.y);
        let value = (a * gx + b * f.x) * gy + (c * gx + d * f.x) * f.y;
        let is_finite = f.x.is_finite() & f.y.is_finite();
        C::Columns::<F>::select(is_finite, value, Spectra::zero())
    }
}

/// The arguments of [`Bitmap::eval_lanes`], of an image with levels.
struct Look<'a, C: ColorModel, F: Lanes> {
    bitmap: &'a Bitmap<C>,
    mipmap: Mipmap<'a, C>,
    uv: lanes::Vec2<F>,
    footprint: [lanes::Vec2<F>; 2],
    wavelengths: &'a [C::Wavelengths],
}

impl<C: ColorModel, F: Lanes> Call<F> for Look<'_, C, F> {
    type Output = C::Columns<F>;

    #[inline(always)]
    fn run(self) -> C::Columns<F> {
        let Self {
            bitmap,
            mipmap,
            uv,
            footprint,
            wavelengths,
        } = self;
        let uv = transformed(&bitmap.to_uv, uv);
        let probes = Probes::new(footprint, &bitmap.to_uv, mipmap.size, bitmap.shape);
        let share = F::one() / probes.count;
        let mut sum = C::Columns::<F>::zero();
        for number in 0..probes.most() {
            let looks = F::splat(number as f32).lt(probes.count);
            let place = uv + probes.place(number);
            let value = mipmap.eval(place, probes.length, wavelengths);
            sum = C::Columns::<F>::select(looks, sum + value * share, sum);
        }
        sum
    }
}

struct Loaded<C: ColorModel> {
    texels: Texels<C>,
    /// How many texels are no reflectances.
    clamped: usize,
}

fn load<C: ColorModel>(key: &TexelKey, palette: &Palette<C>, budget: &Budget) -> Result<Loaded<C>> {
    let raw = key.wanted.raw;
    let picture = Picture::read(&key.wanted, budget)?;
    let size = picture.size;
    let role = match palette.role {
        Role::Reflectance if raw => Role::Quantity,
        Role::Reflectance => Role::Reflectance,
        // Mitsuba's spectral variants make reflectances of all colours, and no spectra of plain numbers and of greys.
        _ if palette.color.upsamples() => match raw || picture.grey {
            true => Role::Quantity,
            false => Role::Reflectance,
        },
        role => role,
    };
    let fits = |rgb: [f32; 3]| rgb.iter().all(|v| (0.0..=1.0).contains(v));
    let clamped = match role {
        Role::Reflectance => picture.pixels.iter().filter(|rgb| !fits(*rgb)).count(),
        _ => 0,
    };
    let (texels, pyramid) = match key.mipmapped && size != [1, 1] {
        true => {
            let (texels, pyramid) = picture.into_pyramid(&palette.color, role)?;
            (texels, Some(pyramid))
        }
        false => (picture.into_texels(&palette.color, role)?, None),
    };
    Ok(Loaded {
        texels: Texels {
            size,
            texels,
            pyramid,
        },
        clamped,
    })
}

impl<C: ColorModel> Pattern<C> for Bitmap<C> {
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        let w = std::slice::from_ref(wavelengths);
        let footprint = at.footprint.map(lanes::Vec2::from);
        self.eval_lanes::<f32>(at.uv.into(), footprint, w).sample(0)
    }

    fn gradient(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> [C::Sample; 2] {
        if self.nearest {
            return [C::Sample::zero(); 2];
        }
        let m = &self.to_uv;
        if let Some(mipmap) = self.mipmap() {
            // As long as one probe.
            let footprint = at.footprint.map(lanes::Vec2::from);
            let length = Probes::<f32>::new(footprint, m, mipmap.size, Shape::Round).length;
            let length = length.max(1.0);
            let uv: Vec2 = transformed::<f32>(m, at.uv.into()).into();
            let w = std::slice::from_ref(wavelengths);
            let value =
                |uv: Vec2| -> C::Sample { mipmap.eval::<f32>(uv.into(), length, w).sample(0) };
            let [along_x, along_y] = [Vec2::X, Vec2::Y].map(|axis| {
                let step = length / axis.dot(Vec2::from(mipmap.size.map(|n| n as f32)));
                let half = axis * (0.5 * step);
                (value(uv + half) - value(uv - half)) * step.recip()
            });
            return [m.x_axis, m.y_axis].map(|axis| along_x * axis.x + along_y * axis.y);
        }
        let cell = self.cell::<f32>(at.uv.into(), std::slice::from_ref(wavelengths));
        let f = Vec2::from(cell.f);
        let [[a, b], [c, d]]: [[C::Sample; 2]; 2] =
            cell.corners.map(|row| row.map(|texel| texel.sample(0)));
        let [width, height] = self.texels.size.map(|n| n as f32);
        let along_x = ((b - a) * (1.0 - f.y) + (d - c) * f.y) * width;
        let along_y = ((c - a) * (1.0 - f.x) + (d - b) * f.x) * height;
        [m.x_axis, m.y_axis].map(|axis| along_x * axis.x + along_y * axis.y)
    }

    fn resolution(&self) -> [usize; 2] {
        self.texels.size
    }
}
