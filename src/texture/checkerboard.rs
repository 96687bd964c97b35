//! `checkerboard`: `color0` (0.4) and `color1` (0.2) in alternate quarters of each unit square of
//! texture coordinates, after `to_uv`.

use glam::Mat3;

use super::{Palette, Pattern, Texture, to_uv, transformed};
use crate::color::{Color, ColorModel};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::Interaction;

/// Two textures in a pattern of squares.
#[derive(Clone, Debug)]
pub struct Checkerboard<C: ColorModel> {
    colors: Box<[Texture<C>; 2]>,
    to_uv: Mat3,
}

impl<C: ColorModel> Checkerboard<C> {
    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let color0 = palette.texture(properties, "color0", palette.role, Color::Grey(0.4))?;
        let color1 = palette.texture(properties, "color1", palette.role, Color::Grey(0.2))?;
        Ok(Self {
            colors: Box::new([color0, color1]),
            to_uv: to_uv(properties)?,
        })
    }
}

impl<C: ColorModel> Pattern<C> for Checkerboard<C> {
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        let uv = transformed(&self.to_uv, at.uv);
        let upper = (uv - uv.floor()).cmpgt(glam::Vec2::splat(0.5));
        self.colors[usize::from(upper.x != upper.y)].eval(at, wavelengths)
    }
}
