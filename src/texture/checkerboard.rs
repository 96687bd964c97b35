//! `checkerboard`: squares of half a unit of texture coordinates after `to_uv`, `color0` (0.4) in the one at
//! the origin and on its diagonal, `color1` (0.2) in the others. Where it gives a number, such as a
//! roughness, Mitsuba 3.9.1 has the two the other way round, and scenes rely on it.

use std::any::TypeId;

use glam::Mat3;

use super::{Palette, Pattern, Texture, to_uv, transformed};
use crate::color::{ColorModel, Mono, PerLane as _, Spectra};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::{self, Lanes, Mask as _};

/// Two textures in a pattern of squares.
#[derive(Clone, Debug)]
pub struct Checkerboard<C: ColorModel> {
    /// In the square at the origin, and beside it.
    colors: Box<[Texture<C>; 2]>,
    to_uv: Mat3,
}

impl<C: ColorModel> Checkerboard<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "squares",
        properties: &[&[
            texture(
                "color0",
                0.4,
                "in the square at the origin and on its diagonal",
            ),
            texture("color1", 0.2, "in the others"),
            super::TO_UV,
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let role = palette.inner_role();
        let color0 = palette.texture(properties, "color0", role)?;
        let color1 = palette.texture(properties, "color1", role)?;
        let numbers = TypeId::of::<C>() == TypeId::of::<Mono>();
        Ok(Self {
            colors: Box::new(if numbers {
                [color1, color0]
            } else {
                [color0, color1]
            }),
            to_uv: to_uv(properties)?,
        })
    }
}

impl<C: ColorModel> Checkerboard<C> {
    /// Where the second colour is.
    #[inline(always)]
    fn second<F: Lanes>(&self, uv: lanes::Vec2<F>) -> F::Mask {
        let uv = transformed(&self.to_uv, uv);
        let half = F::splat(0.5);
        (uv.x - uv.x.floor()).gt(half) ^ (uv.y - uv.y.floor()).gt(half)
    }

    /// The values at points.
    #[inline(always)]
    pub(super) fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wavelengths: &[C::Wavelengths],
    ) -> C::Columns<F> {
        let [first, second] = &*self.colors;
        let is_second = self.second(at.uv);
        if let (Some(first), Some(second)) = (first.constant(), second.constant()) {
            let mut colors = C::PerLane::<F>::zero();
            colors.put(F::Mask::splat(true), first, F::one(), wavelengths);
            colors.put(is_second, second, F::one(), wavelengths);
            return colors.evaluate(wavelengths);
        }
        C::Columns::<F>::select(
            is_second,
            second.eval_lanes(at, wavelengths),
            first.eval_lanes(at, wavelengths),
        )
    }
}

impl<C: ColorModel> Pattern<C> for Checkerboard<C> {
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        let second = self.second::<f32>(at.uv.into());
        self.colors[usize::from(second)].eval(at, wavelengths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;
    use crate::description::{Description, Kind, Options};

    /// Mitsuba 3.9.1.
    #[test]
    fn the_square_at_the_origin_has_the_first_colour_and_the_second_number() {
        let text = r#"<scene version="3.0.0"><texture type="checkerboard"><transform name="to_uv">
            <scale x="25" y="2.5"/></transform></texture></scene>"#;
        let path = std::path::Path::new("test.xml");
        let scene = Description::parse(text, path, &Options::default()).unwrap();
        let texture = scene.root().children(Kind::Texture)[0];
        let numbers = Texture::build(&texture, &Palette::new(Mono)).unwrap();
        let colors = Texture::build(&texture, &Palette::new(Rgb)).unwrap();
        for (u, v, number, color) in [
            (0.01, 0.1, 0.2, 0.4),
            (0.03, 0.1, 0.4, 0.2),
            (0.01, 0.3, 0.4, 0.2),
            (0.03, 0.3, 0.2, 0.4),
        ] {
            let at = Interaction::at_uv(glam::Vec2::new(u, v));
            assert_eq!(numbers.eval(&at, &())[0], number, "{u} {v}");
            assert_eq!(colors.eval(&at, &())[0], color, "{u} {v}");
        }
    }
}
