//! `srgb`: the same linear BT.709 `color` everywhere, each component in [0, 1] unless `unbounded`: in bands a smooth
//! spectrum of that colour, without an illuminant even where it is light.

use super::{Palette, Pattern};
use crate::color::{Color, ColorModel, Role};
use crate::description::declared::{Plugin, Row, boolean, color};
use crate::description::{Properties, Value};
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored colour.
#[derive(Clone, Debug)]
pub struct Srgb<C: ColorModel> {
    value: C::Stored,
}

/// A colour.
pub(super) const COLOR: Row = color("color", 1.0, "linear BT.709, as <rgb>");

impl<C: ColorModel> Srgb<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the same colour everywhere, without an illuminant",
        properties: &[&[
            COLOR.required(),
            boolean("unbounded", false, "whether components may be above 1"),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let Some(rgb) = rgb(properties)? else {
            return Err(properties.missing("color"));
        };
        let unbounded = properties.boolean("unbounded")?;
        if !unbounded && rgb.iter().any(|v| !(0.0..=1.0).contains(v)) {
            let error = properties.error("color", "the components of a color lie in [0, 1]");
            return Err(error.help("write <boolean name=\"unbounded\" value=\"true\"/>"));
        }
        palette.refuse_negative_light(properties, "color", &rgb)?;
        let role = if unbounded {
            Role::Quantity
        } else {
            Role::Reflectance
        };
        let value = palette.store(properties, "color", &Color::Rgb(rgb), role)?;
        Ok(Self { value })
    }
}

/// The property `color`.
pub(super) fn rgb(properties: &Properties<'_>) -> Result<Option<[f64; 3]>> {
    match properties.value("color").map(|property| &property.value) {
        None => Ok(None),
        Some(Value::Rgb(rgb) | Value::Vector(rgb)) => Ok(Some(rgb.to_array())),
        Some(_) => Err(properties
            .error("color", "expected an rgb")
            .help(r#"such as <rgb name="color" value="0.5, 0.2, 0.1"/>"#)),
    }
}

impl<C: ColorModel> Pattern<C> for Srgb<C> {
    fn eval(&self, _at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.value, wavelengths)
    }

    fn constant(&self) -> Option<&C::Stored> {
        Some(&self.value)
    }
}
