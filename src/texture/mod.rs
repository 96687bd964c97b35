//! Textures and spectra, one family under either tag: colours (or numbers) that vary over a surface or are the same
//! everywhere. A texture is a value: materials and lights own theirs, large images are shared underneath.

mod bitmap;
mod blackbody;
mod cauchy;
mod checkerboard;
mod d65;
mod glass;
mod irregular;
mod mesh_attribute;
mod picture;
mod probes;
mod product;
mod pyramid;
mod rawconstant;
mod regular;
mod sellmeier;
mod srgb;
mod uniform;
pub mod volume;
mod zoneplate;

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use glam::{Mat3, Vec3};

use crate::color::{Color, ColorModel, Mono, Rgb, Role, Spectra, Spectral};
use crate::description::declared::{Preset, Row, transform};
use crate::description::{Kind, Properties, Property, Spectrum, Value};
use crate::error::{Error, Problem, Result};
use crate::family::family;
use crate::interaction::{Interaction, Points};
use crate::lanes::{self, Call, Lanes, MAX_LANES, Mask as _};

use bitmap::Texels;

pub use picture::{Picture, Wanted};

/// What every texture does.
pub trait Pattern<C: ColorModel>: std::fmt::Debug + Send + Sync {
    /// The value at a point of a surface.
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample;

    /// How the value changes with u and with v; zero where it is constant or does so in steps.
    fn gradient(&self, _at: &Interaction<'_>, _wavelengths: &C::Wavelengths) -> [C::Sample; 2] {
        [C::Sample::zero(); 2]
    }

    /// Columns and rows of the image, if it is one; 1 × 1 otherwise.
    fn resolution(&self) -> [usize; 2] {
        [1, 1]
    }

    /// The value, where it is the same everywhere.
    fn constant(&self) -> Option<&C::Stored> {
        None
    }
}

family! {
    /// Every texture there is.
    #[derive(Clone, Debug)]
    pub enum Texture<C>: Pattern, context Palette<C> {
        "bitmap" => Bitmap(bitmap::Bitmap<C>),
        "blackbody" => Blackbody(blackbody::Blackbody<C>),
        "cauchy" => Cauchy(cauchy::Cauchy<C>),
        "checkerboard" => Checkerboard(checkerboard::Checkerboard<C>),
        "d65" => D65(d65::D65<C>),
        "glass" => Glass(glass::Glass<C>),
        "irregular" => Irregular(irregular::Irregular<C>),
        "mesh_attribute" => MeshAttribute(mesh_attribute::MeshAttribute<C>),
        "product" => Product(product::Product<C>),
        "rawconstant" => RawConstant(rawconstant::RawConstant<C>),
        "regular" => Regular(regular::Regular<C>),
        "sellmeier" => Sellmeier(sellmeier::Sellmeier<C>),
        "srgb" => Srgb(srgb::Srgb<C>),
        "uniform" => Uniform(uniform::Uniform<C>),
        "volume" => Volume(volume::Cut<C>),
        "zoneplate" => ZonePlate(zoneplate::ZonePlate<C>),
    }
}

impl<C: ColorModel> Texture<C> {
    /// The values at points in lanes, whose paths' wavelengths are given from the first lane on.
    #[inline(always)]
    pub fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wavelengths: &[C::Wavelengths],
    ) -> C::Columns<F> {
        match self {
            Self::Uniform(uniform) => C::evaluate_lanes(uniform.value(), wavelengths),
            texture => F::call(LookUp {
                texture,
                at,
                wavelengths,
            }),
        }
    }
}

/// The arguments of [`Texture::eval_lanes`], of a texture that varies.
struct LookUp<'a, C: ColorModel, F: Lanes> {
    texture: &'a Texture<C>,
    at: &'a Points<'a, F>,
    wavelengths: &'a [C::Wavelengths],
}

impl<C: ColorModel, F: Lanes> Call<F> for LookUp<'_, C, F> {
    type Output = C::Columns<F>;

    #[inline(always)]
    fn run(self) -> C::Columns<F> {
        let Self {
            texture,
            at,
            wavelengths,
        } = self;
        match texture {
            Texture::Bitmap(bitmap) => bitmap.eval_lanes(at.uv, at.footprint, wavelengths),
            Texture::Checkerboard(board) => board.eval_lanes(at, wavelengths),
            Texture::D65(light) => light.eval_lanes(at, wavelengths),
            Texture::Product(product) => product.eval_lanes(at, wavelengths),
            Texture::Volume(volume) => volume.eval_lanes(at, wavelengths),
            other => eval_each(other, at, wavelengths),
        }
    }
}

/// The values of a texture that is asked lane by lane.
#[inline(always)]
fn eval_each<C: ColorModel, F: Lanes>(
    texture: &Texture<C>,
    at: &Points<'_, F>,
    wavelengths: &[C::Wavelengths],
) -> C::Columns<F> {
    let (there, uv) = (at.active.to_bits(), at.uv.rows());
    Spectra::from_samples(|lane| match there >> lane & 1 {
        0 => C::Sample::zero(),
        _ => texture.eval(&at.texture_point(lane, &uv), &wavelengths[lane]),
    })
}

impl Texture<Mono> {
    /// The numbers at points in lanes.
    #[inline(always)]
    pub fn numbers<F: Lanes>(&self, at: &Points<'_, F>) -> F {
        self.eval_lanes(at, &[(); MAX_LANES])[0]
    }
}

/// What textures are made with: the colour model, and the images that were loaded already.
#[derive(Debug)]
pub struct Palette<C: ColorModel> {
    /// The colour model.
    pub color: C,
    /// What the colours stand for.
    pub role: Role,
    texels: TexelCache<C>,
    /// Whether any image has levels.
    mipmaps: Arc<AtomicBool>,
    warnings: Warnings,
}

/// What is worth knowing about the colours that were made.
type Warnings = Arc<Mutex<Vec<Problem>>>;

type TexelCache<C> = Arc<Mutex<HashMap<TexelKey, Arc<Texels<C>>>>>;

/// What two textures must agree in to share their texels.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct TexelKey {
    wanted: Wanted,
    role: Role,
    mipmapped: bool,
}

impl<C: ColorModel> Palette<C> {
    /// Nothing loaded yet.
    pub fn new(color: C) -> Self {
        Self {
            color,
            role: Role::Reflectance,
            texels: TexelCache::default(),
            mipmaps: Arc::default(),
            warnings: Warnings::default(),
        }
    }

    /// The same palette for colours that stand for something else.
    #[must_use]
    pub fn with_role(&self, role: Role) -> Self {
        Self {
            color: self.color.clone(),
            role,
            texels: self.texels.clone(),
            mipmaps: self.mipmaps.clone(),
            warnings: self.warnings.clone(),
        }
    }

    /// The colour called `name`, or the declared grey; what varies over a surface is refused.
    pub fn color(
        &self,
        properties: &Properties<'_>,
        name: &'static str,
        role: Role,
    ) -> Result<C::Stored> {
        let texture = self.texture(properties, name, role)?;
        let refused = || {
            let error = properties.error(name, format!("{name:?} must be the same everywhere"));
            error.help("give a color or a spectrum instead of this texture")
        };
        texture.constant().cloned().ok_or_else(refused)
    }

    /// The colour or texture called `name`, or the declared grey everywhere.
    pub fn texture(
        &self,
        properties: &Properties<'_>,
        name: &'static str,
        role: Role,
    ) -> Result<Texture<C>> {
        let color = match properties.value(name) {
            None => match properties.preset(name) {
                Preset::Float(value) => Color::Grey(value),
                _ => return Err(properties.missing(name)),
            },
            Some(Property {
                value: Value::Object(_),
                ..
            }) => {
                let child = properties.object(name)?.expect("the property is an object");
                if matches!(child.kind(), Kind::Texture | Kind::Spectrum) {
                    return self.nested(&child, role);
                }
                let message = format!("{name:?} must be a colour or a texture");
                return Err(child.error("", message));
            }
            Some(property) => color(property)?,
        };
        let stored = self.store(properties, name, &color, role)?;
        Ok(Texture::Uniform(uniform::Uniform::new(stored)))
    }

    /// The spectrum that a property of any name gives, if it gives one that is the same everywhere.
    pub fn spectrum(
        &self,
        properties: &Properties<'_>,
        property: &Property,
        role: Role,
    ) -> Result<Option<C::Stored>> {
        match &property.value {
            Value::Spectrum(_) => {
                let color = color(property)?;
                self.store(properties, &property.name, &color, role)
                    .map(Some)
            }
            Value::Object(_) => {
                let child = properties.held(property);
                let spectral =
                    |child: &Properties<'_>| matches!(child.kind(), Kind::Texture | Kind::Spectrum);
                let Some(child) = child.filter(spectral) else {
                    return Ok(None);
                };
                let texture = self.nested(&child, role)?;
                let refused = || child.error("", "a response must be the same everywhere");
                texture.constant().cloned().ok_or_else(refused).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// The texture that a node describes; one that is the same everywhere becomes [`Texture::Uniform`].
    pub fn nested(&self, properties: &Properties<'_>, role: Role) -> Result<Texture<C>> {
        let texture = Texture::build(properties, &self.with_role(role))?;
        Ok(match texture.constant() {
            Some(value) => Texture::Uniform(uniform::Uniform::new(value.clone())),
            None => texture,
        })
    }

    /// A colour in its stored form; what is wrong with it, or worth knowing, is told of the property.
    fn store(
        &self,
        properties: &Properties<'_>,
        name: &str,
        color: &Color,
        role: Role,
    ) -> Result<C::Stored> {
        if let Some(message) = self.color.remark(color, role) {
            self.warn(properties.error(name, message));
        }
        let stored = self.color.store(color, role);
        stored.map_err(|message| properties.error(name, message))
    }

    /// The spectrum of points (nm, value) that the node describes.
    fn curve(&self, properties: &Properties<'_>, points: Vec<(f64, f64)>) -> Result<C::Stored> {
        if self.color.is_rgb() {
            let message = format!(
                "Mitsuba renders {:?} in its spectral variants only; here it is seen by the standard observer",
                properties.plugin()
            );
            self.warn(properties.error("", message));
        }
        self.store(properties, "values", &Color::Curve(points), self.role)
    }

    /// The index of refraction of points (nm, value) that the node describes.
    fn index(&self, properties: &Properties<'_>, points: Vec<(f64, f64)>) -> Result<C::Stored> {
        self.store(properties, "", &Color::Curve(points), Role::Quantity)
    }

    /// What colours inside of a texture stand for. Of light that varies over a surface Mitsuba's spectral variants take
    /// them without an illuminant.
    fn inner_role(&self) -> Role {
        match self.role {
            Role::Emission if self.color.upsamples() => Role::Quantity,
            role => role,
        }
    }

    /// Refuses values below 0 of what is light.
    fn refuse_negative_light(
        &self,
        properties: &Properties<'_>,
        name: &'static str,
        values: &[f64],
    ) -> Result<()> {
        match values
            .iter()
            .find(|v| self.role == Role::Emission && **v < 0.0)
        {
            Some(v) => {
                Err(properties.error(name, format!("emission cannot be negative, and {v} is")))
            }
            None => Ok(()),
        }
    }

    /// Notes what is right but worth knowing.
    pub fn warn(&self, warning: Error) {
        let mut warnings = self
            .warnings
            .lock()
            .expect("no thread panics while it holds them");
        for problem in warning.problems() {
            if !warnings.contains(problem) {
                warnings.push(problem.clone());
            }
        }
    }

    /// The same value, which must be valid for the palette's role, everywhere.
    pub fn uniform(&self, color: &Color) -> std::result::Result<Texture<C>, String> {
        Ok(Texture::Uniform(uniform::Uniform::new(
            self.color.store(color, self.role)?,
        )))
    }
}

impl Palette<Mono> {
    /// The number or texture called `name`, or the declared number everywhere.
    pub fn number(&self, properties: &Properties<'_>, name: &'static str) -> Result<Texture<Mono>> {
        self.texture(properties, name, Role::Quantity)
    }
}

/// What materials and lights are made with: a palette of colours and one of numbers.
#[derive(Debug)]
pub struct Palettes<C: ColorModel> {
    /// For colours.
    pub colors: Palette<C>,
    /// For numbers.
    pub numbers: Palette<Mono>,
    /// For vectors: a normal's components in place of red, green and blue.
    pub vectors: Palette<Rgb>,
}

impl<C: ColorModel> Palettes<C> {
    /// Nothing loaded yet.
    pub fn new(color: C) -> Self {
        let colors = Palette::new(color);
        let (warnings, mipmaps) = (colors.warnings.clone(), colors.mipmaps.clone());
        Self {
            numbers: Palette {
                warnings: warnings.clone(),
                mipmaps: mipmaps.clone(),
                ..Palette::new(Mono)
            },
            vectors: Palette {
                warnings,
                mipmaps,
                role: Role::Quantity,
                ..Palette::new(Rgb)
            },
            colors,
        }
    }

    /// Whether any image that was loaded has levels, so that textures ask for footprints.
    pub fn have_mipmaps(&self) -> bool {
        self.colors.mipmaps.load(Ordering::Relaxed)
    }

    /// What was noted so far by any of the palettes.
    pub fn warnings(&self) -> Vec<Problem> {
        let warnings = &self.colors.warnings;
        warnings
            .lock()
            .expect("no thread panics while it holds them")
            .clone()
    }
}

/// The colour that a property gives.
fn color(property: &Property) -> Result<Color> {
    Ok(match &property.value {
        Value::Float(value) => Color::Grey(*value),
        Value::Integer(value) => Color::Grey(*value as f64),
        Value::Rgb(rgb) => Color::Rgb(rgb.to_array()),
        Value::Spectrum(Spectrum::Uniform(value)) => Color::Flat(*value),
        Value::Spectrum(Spectrum::Curve(points)) => Color::Curve(points.clone()),
        _ => {
            return Err(Error::input(format!(
                "{:?} must be a colour, a spectrum or a texture",
                property.name
            ))
            .at(&property.location)
            .help(r#"such as <rgb name="…" value="0.5, 0.5, 0.5"/>"#));
        }
    })
}

/// What is done to texture coordinates.
const TO_UV: Row = transform("to_uv", "of texture coordinates, before they are looked up");

/// The property `to_uv`: what is done to texture coordinates before they are looked up.
fn to_uv(properties: &Properties<'_>) -> Result<Mat3> {
    let m = properties.transform("to_uv")?;
    let column = |c: glam::DVec4| Vec3::new(c.x as f32, c.y as f32, 0.0);
    Ok(Mat3::from_cols(
        column(m.x_axis),
        column(m.y_axis),
        Vec3::new(m.w_axis.x as f32, m.w_axis.y as f32, 1.0),
    ))
}

/// Texture coordinates after `to_uv`.
#[inline(always)]
fn transformed<F: Lanes>(to_uv: &Mat3, uv: lanes::Vec2<F>) -> lanes::Vec2<F> {
    let all = |axis: Vec3| lanes::Vec2::all(axis.truncate());
    all(to_uv.x_axis) * uv.x + all(to_uv.y_axis) * uv.y + all(to_uv.z_axis)
}

#[cfg(test)]
mod mipmap_tests;
#[cfg(test)]
mod tests;
