//! `rawconstant`: the same three numbers (a vector) or number everywhere, neither bounded nor upsampled in
//! RGB: a normal for `normalmap`.

use super::{Palette, Pattern};
use crate::color::{Color, ColorModel, Role};
use crate::description::declared::{Plugin, float};
use crate::description::{Properties, Property, Value};
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored value.
#[derive(Clone, Debug)]
pub struct RawConstant<C: ColorModel> {
    value: C::Stored,
}

impl<C: ColorModel> RawConstant<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "three numbers, or one, as they are",
        properties: &[&[float("value", 0.0, "a number, or a vector").required()]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let value = match properties.value("value") {
            Some(Property {
                value: Value::Vector(v),
                ..
            }) => Color::Rgb(v.to_array()),
            _ => Color::Grey(properties.float("value")?),
        };
        if let Color::Grey(value) = value {
            palette.refuse_negative_light(properties, "value", &[value])?;
        }
        let value = palette.store(properties, "value", &value, Role::Quantity)?;
        Ok(Self { value })
    }
}

impl<C: ColorModel> Pattern<C> for RawConstant<C> {
    fn eval(&self, _at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.value, wavelengths)
    }

    fn constant(&self) -> Option<&C::Stored> {
        Some(&self.value)
    }
}
