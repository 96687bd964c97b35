//! `d65`: daylight, the CIE illuminant D65, times `scale` and a `color` or nested texture: what a plain colour becomes
//! as light, whatever it is used for here. Without them it is the white of RGB.

use super::{Palette, Pattern, Texture, srgb};
use crate::color::{Color, ColorModel, Role, Spectral};
use crate::description::declared::{Plugin, float, nested};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::Lanes;

/// A stored spectrum, and what varies it over a surface.
#[derive(Clone, Debug)]
pub struct D65<C: ColorModel> {
    light: C::Stored,
    texture: Option<Box<Texture<C>>>,
}

impl<C: ColorModel> D65<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "daylight, the white of RGB",
        properties: &[&[
            float("scale", 1.0, "what it is multiplied by"),
            srgb::COLOR.absent("white"),
            nested(
                Kind::Texture,
                "what it is multiplied by, in place of a color",
            ),
            nested(
                Kind::Spectrum,
                "what it is multiplied by, in place of a color",
            ),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let scale = properties.float("scale")?;
        palette.refuse_negative_light(properties, "scale", &[scale])?;
        let rgb = srgb::rgb(properties)?;
        palette.refuse_negative_light(properties, "color", rgb.as_slice().as_flattened())?;
        let mut nested = properties.children(Kind::Texture);
        nested.extend(properties.children(Kind::Spectrum));
        if let (Some(second), [first, ..]) = (nested.get(1), &nested[..]) {
            let error = second.error("", "d65 has a second nested texture");
            return Err(error.related(first.location(), "the first"));
        }
        let texture = match nested.first() {
            None => None,
            Some(child) if rgb.is_some() => {
                return Err(child.error("", "d65 takes either a color or a nested texture"));
            }
            Some(child) => {
                let palette = palette.with_role(Role::Quantity);
                Some(Box::new(Texture::build(child, &palette)?))
            }
        };
        let color = Color::D65(rgb.unwrap_or([1.0; 3]).map(|v| v * scale));
        Ok(Self {
            light: palette.store(properties, "color", &color, palette.role)?,
            texture,
        })
    }
}

impl<C: ColorModel> D65<C> {
    /// The values at points.
    #[inline(always)]
    pub(super) fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wavelengths: &[C::Wavelengths],
    ) -> C::Columns<F> {
        let light = C::evaluate_lanes(&self.light, wavelengths);
        match &self.texture {
            Some(texture) => light * texture.eval_lanes(at, wavelengths),
            None => light,
        }
    }
}

impl<C: ColorModel> Pattern<C> for D65<C> {
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        let light = C::evaluate(&self.light, wavelengths);
        match &self.texture {
            Some(texture) => light * texture.eval(at, wavelengths),
            None => light,
        }
    }

    fn gradient(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> [C::Sample; 2] {
        let light = C::evaluate(&self.light, wavelengths);
        match &self.texture {
            Some(texture) => texture.gradient(at, wavelengths).map(|slope| light * slope),
            None => [C::Sample::zero(); 2],
        }
    }

    fn resolution(&self) -> [usize; 2] {
        self.texture
            .as_ref()
            .map_or([1, 1], |texture| texture.resolution())
    }

    fn constant(&self) -> Option<&C::Stored> {
        self.texture.is_none().then_some(&self.light)
    }
}
