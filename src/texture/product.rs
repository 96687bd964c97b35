//! `product`: the textures or colours `color0` and `color1` (1) multiplied with each other. Étendue's own: glTF multiplies
//! images by factors and by the colours of vertices.

use super::{Palette, Pattern, Texture};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::Lanes;

/// Two textures, one times the other.
#[derive(Clone, Debug)]
pub struct Product<C: ColorModel>(Box<[Texture<C>; 2]>);

impl<C: ColorModel> Product<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "two textures multiplied with each other",
        properties: &[&[
            texture("color0", 1.0, "one of them"),
            texture("color1", 1.0, "the other"),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let role = palette.inner_role();
        let color = |name| palette.texture(properties, name, role);
        Ok(Self(Box::new([color("color0")?, color("color1")?])))
    }

    /// The values at points.
    #[inline(always)]
    pub(super) fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wavelengths: &[C::Wavelengths],
    ) -> C::Columns<F> {
        let [first, second] = &*self.0;
        first.eval_lanes(at, wavelengths) * second.eval_lanes(at, wavelengths)
    }
}

impl<C: ColorModel> Pattern<C> for Product<C> {
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        let [first, second] = &*self.0;
        first.eval(at, wavelengths) * second.eval(at, wavelengths)
    }

    fn gradient(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> [C::Sample; 2] {
        let [first, second] = &*self.0;
        let [a, b] = [first, second].map(|texture| texture.eval(at, wavelengths));
        let (da, db) = (
            first.gradient(at, wavelengths),
            second.gradient(at, wavelengths),
        );
        std::array::from_fn(|axis| da[axis] * b + a * db[axis])
    }

    fn resolution(&self) -> [usize; 2] {
        let [[w0, h0], [w1, h1]] = [&self.0[0], &self.0[1]].map(|texture| texture.resolution());
        [w0.max(w1), h0.max(h1)]
    }
}
