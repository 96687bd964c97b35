//! `zoneplate`, an extension of Étendue's: rings around the middle of the texture, ½ + ½ cos(2π·`rings`·(2r)²),
//! from `color1` (1) in the middle to `color0` (0) and back, `rings` (32) times up to the nearest edge. There
//! they have 4·`rings` periods a unit, and on the way every frequency below, in every direction: an image of
//! it shows what a sampler does to each, and rings around other middles are aliases.

use std::f32::consts::TAU;

use glam::{Mat3, Vec2};

use super::{Palette, Pattern, Texture, to_uv, transformed};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, float, texture};
use crate::error::Result;
use crate::interaction::Interaction;

/// Two textures, mixed.
#[derive(Clone, Debug)]
pub struct ZonePlate<C: ColorModel> {
    /// In dark rings, and in light ones.
    colors: Box<[Texture<C>; 2]>,
    /// Periods from the middle to the nearest edge.
    rings: f32,
    to_uv: Mat3,
}

/// The most rings: the phase of more is lost in rounding.
const MAX_RINGS: f64 = 1e6;

impl<C: ColorModel> ZonePlate<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "rings that grow finer outwards: what aliases first",
        properties: &[&[
            float("rings", 32.0, "from the middle to the nearest edge").between(0.0, MAX_RINGS),
            texture("color0", 0.0, "in dark rings"),
            texture("color1", 1.0, "in light ones"),
            super::TO_UV,
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let rings = properties.float("rings")?;
        let role = palette.inner_role();
        Ok(Self {
            colors: Box::new([
                palette.texture(properties, "color0", role)?,
                palette.texture(properties, "color1", role)?,
            ]),
            rings: rings as f32,
            to_uv: to_uv(properties)?,
        })
    }

    /// The phase in periods, and where it is, from the middle of the tile.
    fn phase(&self, uv: Vec2) -> (f32, Vec2) {
        let uv = Vec2::from(transformed::<f32>(&self.to_uv, uv.into()));
        let from_middle = uv - uv.floor() - 0.5;
        let turns = 4.0 * self.rings * from_middle.length_squared();
        (turns - turns.floor(), from_middle)
    }
}

impl<C: ColorModel> Pattern<C> for ZonePlate<C> {
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        let (phase, _) = self.phase(at.uv);
        let light = 0.5 + 0.5 * (TAU * phase).cos();
        let [dark, bright] = [0, 1].map(|i| self.colors[i].eval(at, wavelengths));
        dark * (1.0 - light) + bright * light
    }

    fn gradient(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> [C::Sample; 2] {
        let (phase, from_middle) = self.phase(at.uv);
        let light = 0.5 + 0.5 * (TAU * phase).cos();
        let slope = from_middle * (8.0 * self.rings * TAU * -0.5 * (TAU * phase).sin());
        let [dark, bright] = [0, 1].map(|i| self.colors[i].eval(at, wavelengths));
        let [in_dark, in_bright] = [0, 1].map(|i| self.colors[i].gradient(at, wavelengths));
        let axes = [self.to_uv.x_axis, self.to_uv.y_axis];
        [0, 1].map(|i| {
            let along = slope.dot(axes[i].truncate());
            (bright - dark) * along + in_dark[i] * (1.0 - light) + in_bright[i] * light
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Mono;
    use crate::description::{Description, Kind, Options};

    #[test]
    fn rings_grow_finer_outwards_and_the_gradient_is_that_of_the_value() {
        let text = r#"<scene version="3.0.0"><texture type="zoneplate"><float name="rings" value="4"/>
            <transform name="to_uv"><scale x="2" y="1"/></transform></texture></scene>"#;
        let path = std::path::Path::new("test.xml");
        let scene = Description::parse(text, path, &Options::default()).unwrap();
        let texture = scene.root().children(Kind::Texture)[0];
        let rings = Texture::build(&texture, &Palette::new(Mono)).unwrap();
        let value = |u, v| rings.eval(&Interaction::at_uv(Vec2::new(u, v)), &())[0];
        assert_eq!(value(0.25, 0.5), 1.0);
        for ring in 1..=4 {
            let r = 0.5 * (ring as f32 / 4.0).sqrt();
            let half = 0.5 * ((ring as f32 - 0.5) / 4.0).sqrt();
            assert!(value(0.25, 0.5 - r * 0.999) > 0.99, "{ring}");
            assert!(value(0.25 + half / 2.0, 0.5) < 0.01, "{ring}");
        }
        for (u, v) in [(0.3, 0.6), (0.1, 0.2), (0.9, 0.7)] {
            let at = Interaction::at_uv(Vec2::new(u, v));
            let [along_u, along_v] = rings.gradient(&at, &()).map(|g| g[0]);
            let h = 1e-3;
            let expected = [
                (value(u + h, v) - value(u - h, v)) / (2.0 * h),
                (value(u, v + h) - value(u, v - h)) / (2.0 * h),
            ];
            for (along, expected) in [along_u, along_v].into_iter().zip(expected) {
                let tolerance = 0.02 * (1.0 + expected.abs());
                assert!((along - expected).abs() < tolerance, "{along} {expected}");
            }
        }
    }
}
