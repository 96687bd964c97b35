//! `mesh_attribute`: the attribute `name` (`vertex_…` or `face_…`) of the mesh that the texture lies on, times
//! `scale`: one number or a linear BT.709 triple, interpolated over a triangle or the same on all of it. A reflectance
//! may leave [0, 1], as in Mitsuba: it is the mesh's number, whatever it is.

use super::{Palette, Pattern};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, float, string};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::mesh::{Attribute, Mesh, Per};

/// A mesh's own colours.
#[derive(Clone, Debug)]
pub struct MeshAttribute<C: ColorModel> {
    name: String,
    scale: f32,
    color: C,
    role: Role,
}

impl<C: ColorModel> MeshAttribute<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a value that the mesh has at its vertices or faces",
        properties: &[&[
            string("name", "", "vertex_… or face_…, as the mesh names it").required(),
            float("scale", 1.0, "what it is multiplied by"),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let name = properties.string("name")?;
        if !name.starts_with("vertex_") && !name.starts_with("face_") {
            let message =
                format!("an attribute's name starts with vertex_ or face_, and {name:?} does not");
            return Err(properties.error("name", message));
        }
        Ok(Self {
            name: name.to_owned(),
            scale: properties.float("scale")? as f32,
            color: palette.color.clone(),
            // A spectrum of what the mesh says, without an illuminant and clamped, as Mitsuba has it.
            role: match palette.inner_role() {
                Role::Quantity if palette.color.upsamples() => Role::Reflectance,
                role => role,
            },
        })
    }
}

/// The attribute's first three numbers at a point, a single one three times.
fn value(attribute: &Attribute, mesh: &Mesh, at: &Interaction<'_>) -> Option<[f32; 3]> {
    let row = |i: u32| {
        let first = i as usize * attribute.channels;
        attribute.values.get(first..first + attribute.channels)
    };
    let rgb = |row: &[f32]| match *row {
        [r, g, b, ..] => [r, g, b],
        [v, ..] => [v; 3],
        [] => [0.0; 3],
    };
    if attribute.per == Per::Face {
        return row(at.primitive).map(rgb);
    }
    let [a, b, c] = mesh
        .triangles
        .get(at.primitive as usize)?
        .map(|i| row(i).map(rgb));
    let (a, b, c, [u, v]) = (a?, b?, c?, at.barycentric.to_array());
    Some(std::array::from_fn(|i| {
        (1.0 - u - v) * a[i] + u * b[i] + v * c[i]
    }))
}

impl<C: ColorModel> Pattern<C> for MeshAttribute<C> {
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        // That the shape has the attribute was checked while the scene was built.
        let find = |mesh: &Mesh| {
            let attribute = mesh.attributes.iter().find(|a| a.name == self.name)?;
            value(attribute, mesh, at)
        };
        let rgb = at.mesh.and_then(find).unwrap_or_default();
        let rgb = rgb.map(|v| if v.is_finite() { v } else { 0.0 });
        // As in Mitsuba nothing is clamped but what becomes a spectrum, which is scaled afterwards.
        let role = if self.color.is_rgb() {
            self.role.unbounded()
        } else {
            self.role
        };
        self.color.evaluate_rgb(rgb, role, wavelengths) * self.scale
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::color::{Bands, Color, Rgb};
    use crate::math::Frame;

    #[test]
    fn vertex_attributes_are_interpolated_and_face_attributes_are_not() {
        let mut mesh = crate::mesh::rectangle();
        let attribute = |name: &str, channels, per, values: &[f32]| Attribute {
            name: name.to_owned(),
            channels,
            per,
            values: values.to_vec(),
        };
        mesh.attributes = vec![
            attribute(
                "vertex_c",
                3,
                Per::Vertex,
                &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 9.0, 9.0, 9.0],
            ),
            attribute("face_w", 1, Per::Face, &[0.25, 0.5]),
        ];
        let at = |primitive| Interaction {
            primitive,
            barycentric: Vec2::new(0.5, 0.3),
            t: 1.0,
            position: Vec3::ZERO,
            error: Vec3::ZERO,
            normal: Vec3::Z,
            frame: Frame::around(Vec3::Z),
            uv: Vec2::ZERO,
            dp_du: Vec3::X,
            dp_dv: Vec3::Y,
            footprint: [Vec2::ZERO; 2],
            wi: Vec3::Z,
            time: 0.0,
            shape: 0,
            mesh: None,
        };
        let of = |i: usize, primitive| value(&mesh.attributes[i], &mesh, &at(primitive)).unwrap();
        for (ours, expected) in of(0, 0).into_iter().zip([0.2, 0.5, 0.3]) {
            assert!((ours - expected).abs() < 1e-6);
        }
        assert_eq!(of(1, 0), [0.25; 3]);
        assert_eq!(of(1, 1), [0.5; 3]);
    }

    /// The attribute `numbers` of a rectangle's vertices, as a reflectance.
    fn reflectance<C: ColorModel>(
        color: C,
        numbers: [f32; 3],
        scale: f32,
        wavelengths: &C::Wavelengths,
    ) -> C::Sample {
        let mut mesh = crate::mesh::rectangle();
        mesh.attributes = vec![Attribute {
            name: "vertex_color".to_owned(),
            channels: 3,
            per: Per::Vertex,
            values: numbers.repeat(4),
        }];
        let texture = MeshAttribute {
            name: "vertex_color".to_owned(),
            scale,
            color,
            role: Role::Reflectance,
        };
        let at = Interaction {
            mesh: Some(&mesh),
            ..Interaction::at_uv(Vec2::splat(0.5))
        };
        texture.eval(&at, wavelengths)
    }

    /// Mitsuba 3.9.1 `scalar_rgb`: the `specular_reflectance` of a `conductor` under a constant sky.
    #[test]
    fn a_reflectance_of_rgb_may_be_any_number() {
        let numbers = [1.0, 0.5, -0.5];
        for (scale, expected) in [(2.0, [2.0, 1.0, -1.0]), (-1.0, [-1.0, -0.5, 0.5])] {
            assert_eq!(reflectance(Rgb, numbers, scale, &()).0, expected);
        }
    }

    /// Mitsuba 3.9.1 `scalar_spectral`: a `diffuse` of (2, 0.5, 0.2) or (1, 0.5, 0.2) under a constant sky.
    #[test]
    fn a_reflectance_becomes_a_spectrum_before_it_is_scaled() {
        let bands = Bands::<8>::visible(8).expect("8 bands fit");
        let sky = bands
            .store(&Color::Grey(1.0), Role::Emission)
            .expect("light");
        for first in [1.0, 2.0] {
            let mut mean = [0.0; 3];
            for i in 0..200_u8 {
                let wavelengths = bands.wavelengths(|| (f32::from(i) + 0.5) / 200.0);
                let value = reflectance(bands.clone(), [first, 0.5, 0.2], 2.0, &wavelengths)
                    * Bands::evaluate(&sky, &wavelengths);
                let mut out = [0.0; 11];
                bands.develop(0, &value, &wavelengths, &mut out);
                for (mean, v) in mean.iter_mut().zip(out) {
                    *mean += v / 200.0;
                }
            }
            for (ours, expected) in mean.into_iter().zip([2.0049, 1.0011, 0.4026]) {
                assert!((ours / expected - 1.0).abs() < 0.02, "{mean:?}");
            }
        }
    }
}
