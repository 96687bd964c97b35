//! `projector`: a camera turned round: `irradiance` is an image that it throws out, times `scale`, through the
//! field of view `fov`, `fov_axis` or `focal_length` as of a `perspective` sensor with the image's aspect. A
//! plane at distance 1 across the axis gets π times the image's values, at distance z that over z².

use std::f64::consts::PI;

use glam::{Vec2, Vec3};

use super::emission::from_point;
use super::{
    Ball, Draw, Emission, Emitter, LightContext, LightSample, Seen, mean_over_square,
    texture_point, to_world,
};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, float, texture};
use crate::error::Result;
use crate::interaction::Reference;
use crate::math::Moving;
use crate::sensor::tangent_x;
use crate::texture::Texture;

/// A point that throws an image.
#[derive(Clone, Debug)]
pub struct Projector<C: ColorModel> {
    image: Texture<C>,
    scale: f32,
    to_world: Moving,
    /// Half the image's extent at distance 1.
    half: Vec2,
}

impl<C: ColorModel> Projector<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "an image thrown from a point",
        properties: &[
            &[
                texture("irradiance", 1.0, "the image; W/m² at distance 1").required(),
                float("scale", 1.0, "what the image is multiplied by"),
                super::TO_WORLD,
            ],
            crate::sensor::FIELD_OF_VIEW,
            super::SAMPLING,
        ],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let colors = &context.palettes.colors;
        let image = colors.texture(properties, "irradiance", Role::Emission)?;
        let [width, height] = image.resolution();
        let aspect = width as f64 / height as f64;
        let tangent = tangent_x(properties, aspect)?;
        Ok(Self {
            image,
            scale: properties.float("scale")? as f32,
            to_world: to_world(properties)?,
            half: Vec2::new(tangent as f32, (tangent / aspect) as f32),
        })
    }
}

impl<C: ColorModel> Projector<C> {
    /// The density of directions toward points drawn evenly over the image, at that cosine from the axis.
    fn pdf(&self, cosine: f32) -> f32 {
        let area = 4.0 * self.half.x * self.half.y;
        1.0 / (area * cosine * cosine * cosine)
    }
}

impl<C: ColorModel> Emitter<C> for Projector<C> {
    fn sample(
        &self,
        from: Reference,
        _u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let to_world = self.to_world.at(from.time);
        let local = to_world.inverse().point(from.position);
        // As a camera sees it, +x is to the image's left and +y up.
        let uv = 0.5 - 0.5 * local.truncate() / (local.z * self.half);
        if local.z <= 0.0 || !(uv.cmpge(Vec2::ZERO) & uv.cmple(Vec2::ONE)).all() {
            return None;
        }
        let position = to_world.translation();
        let way = position - from.position;
        let direction = way.normalize();
        let cosine = -to_world.vector(Vec3::Z).dot(direction);
        let image = self
            .image
            .eval(&texture_point(position, Vec3::Z, uv), wavelengths);
        Some(LightSample {
            direction,
            target: Some(position),
            radiance: image * (PI as f32 * self.scale / (local.z * local.z * cosine)),
            pdf: 1.0,
            delta: true,
        })
    }

    fn emit(
        &self,
        _ball: &Ball,
        draw: &Draw,
        wavelengths: &C::Wavelengths,
    ) -> Option<Emission<'_, C::Sample>> {
        let to_world = self.to_world.at(draw.time);
        let local = ((1.0 - 2.0 * draw.direction) * self.half).extend(1.0);
        let direction = to_world.vector(local).normalize();
        let pdf = self.pdf(local.length().recip());
        let position = to_world.translation();
        from_point(self, position, direction, pdf, draw.time, wavelengths)
    }

    fn emission_density(&self, _ball: &Ball, seen: &Seen) -> f32 {
        let axis = self.to_world.at(seen.time).vector(Vec3::Z).normalize();
        let cosine = -axis.dot(seen.direction);
        self.pdf(cosine) / (seen.distance * seen.distance)
    }

    fn power(&self, color: &C, _radius: f64) -> f64 {
        let area = 4.0 * f64::from(self.half.x * self.half.y);
        PI * area * f64::from(self.scale) * mean_over_square(color, &self.image)
    }
}
