//! Textures: colours (or numbers) that vary over a surface. A texture is a value: materials and lights
//! own theirs, large images are shared underneath.

mod bitmap;
mod checkerboard;
mod mesh_attribute;
mod picture;
mod rawconstant;
mod uniform;
mod zoneplate;

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use glam::{Mat3, Vec2, Vec3};

use crate::color::{Color, ColorModel, Mono, Rgb, Role, Spectral};
use crate::description::{Kind, Properties, Property, Spectrum, Value};
use crate::error::{Error, Result};
use crate::family::{self, family};
use crate::interaction::Interaction;

use bitmap::Texels;

pub use picture::Picture;

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
}

family! {
    /// Every texture there is.
    #[derive(Clone, Debug)]
    pub enum Texture<C>: Pattern, kind "texture", context Palette<C> {
        "bitmap" => Bitmap(bitmap::Bitmap<C>),
        "checkerboard" => Checkerboard(checkerboard::Checkerboard<C>),
        "mesh_attribute" => MeshAttribute(mesh_attribute::MeshAttribute<C>),
        "rawconstant" => RawConstant(rawconstant::RawConstant<C>),
        "uniform" => Uniform(uniform::Uniform<C>),
        "zoneplate" => ZonePlate(zoneplate::ZonePlate<C>),
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
}

type TexelCache<C> = Arc<Mutex<HashMap<(PathBuf, Role, bool), Arc<Texels<C>>>>>;

impl<C: ColorModel> Palette<C> {
    /// Nothing loaded yet.
    pub fn new(color: C) -> Self {
        Self {
            color,
            role: Role::Reflectance,
            texels: TexelCache::default(),
        }
    }

    /// The same palette for colours that stand for something else.
    #[must_use]
    pub fn with_role(&self, role: Role) -> Self {
        Self {
            color: self.color.clone(),
            role,
            texels: self.texels.clone(),
        }
    }

    /// The colour called `name`, or `default`; textures are refused.
    pub fn color(
        &self,
        properties: &Properties<'_>,
        name: &'static str,
        role: Role,
        default: Color,
    ) -> Result<C::Stored> {
        let store = |color: &Color| self.color.store(color, role);
        match properties.value(name) {
            None => store(&default).map_err(|e| properties.error(name, e)),
            Some(Property {
                value: Value::Object(_),
                ..
            }) => {
                let child = properties.object(name)?.expect("the property is an object");
                store(&spectrum(&child)?).map_err(|e| child.error("value", e))
            }
            Some(property) => store(&color(property)?).map_err(|e| properties.error(name, e)),
        }
    }

    /// The colour or texture called `name`, or `default` everywhere.
    pub fn texture(
        &self,
        properties: &Properties<'_>,
        name: &'static str,
        role: Role,
        default: Color,
    ) -> Result<Texture<C>> {
        if let Some(Property {
            value: Value::Object(_),
            ..
        }) = properties.value(name)
        {
            let child = properties.object(name)?.expect("the property is an object");
            if child.kind() == Kind::Texture {
                return Texture::build(&child, &self.with_role(role));
            }
        }
        Ok(Texture::Uniform(uniform::Uniform::new(
            self.color(properties, name, role, default)?,
        )))
    }

    /// The same value, which must be valid for the palette's role, everywhere.
    pub fn uniform(&self, color: &Color) -> std::result::Result<Texture<C>, String> {
        Ok(Texture::Uniform(uniform::Uniform::new(
            self.color.store(color, self.role)?,
        )))
    }
}

impl Palette<Mono> {
    /// The number or texture called `name`, or `default` everywhere.
    pub fn number(
        &self,
        properties: &Properties<'_>,
        name: &'static str,
        default: f64,
    ) -> Result<Texture<Mono>> {
        self.texture(properties, name, Role::Quantity, Color::Grey(default))
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
        Self {
            colors: Palette::new(color),
            numbers: Palette::new(Mono),
            vectors: Palette::new(Rgb).with_role(Role::Quantity),
        }
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

/// The colour of a `<spectrum type="…">`.
fn spectrum(properties: &Properties<'_>) -> Result<Color> {
    const NAMES: &[&str] = &["d65", "uniform"];
    match properties.plugin() {
        "d65" => Ok(Color::D65(properties.float("scale")?.unwrap_or(1.0))),
        "uniform" => Ok(Color::Grey(properties.float("value")?.unwrap_or(1.0))),
        other => Err(family::unknown(properties, "spectrum", other, NAMES)),
    }
}

/// The property `to_uv`: what is done to texture coordinates before they are looked up.
fn to_uv(properties: &Properties<'_>) -> Result<Mat3> {
    let Some(m) = properties.transform("to_uv")? else {
        return Ok(Mat3::IDENTITY);
    };
    let column = |c: glam::DVec4| Vec3::new(c.x as f32, c.y as f32, 0.0);
    Ok(Mat3::from_cols(
        column(m.x_axis),
        column(m.y_axis),
        Vec3::new(m.w_axis.x as f32, m.w_axis.y as f32, 1.0),
    ))
}

/// Texture coordinates after `to_uv`.
fn transformed(to_uv: &Mat3, uv: Vec2) -> Vec2 {
    (*to_uv * uv.extend(1.0)).truncate()
}
