//! `directionalarea`: a shape whose every point emits along its normal alone. No direction that is drawn from elsewhere
//! is that one, so that integrators which start at the camera find none of its light, here as in Mitsuba; the shape is
//! black, as one that gives light is.

use std::marker::PhantomData;

use glam::Vec2;

use super::{Emitter, LightContext, LightSample};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Reference;
use crate::texture::Palettes;

/// A shape that emits along its normals.
#[derive(Clone, Debug)]
pub struct DirectionalArea<C: ColorModel> {
    colors: PhantomData<C>,
}

impl<C: ColorModel> DirectionalArea<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "light from the shape that it stands in, along the normals alone",
        properties: &[
            &[texture(
                "radiance",
                1.0,
                "what leaves along the normal; W/m²",
            )],
            super::SAMPLING,
        ],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        if context.shape.is_none() {
            let message = "a directionalarea emitter gives light from a shape, and stands in none";
            return Err(properties.error("", message).help("nest it in a <shape>"));
        }
        let Palettes { colors, .. } = context.palettes;
        // Nobody asks for it, but it has to be right.
        colors.texture(properties, "radiance", Role::Emission)?;
        let warning = properties.error(
            "",
            "paths from the camera find no light of a directionalarea",
        );
        colors.warn(
            warning.help("an area emitter shines in all directions, a projector throws a picture"),
        );
        Ok(Self {
            colors: PhantomData,
        })
    }
}

impl<C: ColorModel> Emitter<C> for DirectionalArea<C> {
    fn sample(
        &self,
        _from: Reference,
        _u: Vec2,
        _wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        None
    }
}
