//! Light from all around on one point: the directions from which an environment shines, as many at once as there are lanes.

use glam::Vec3;

use crate::color::{ColorModel, Spectra as _, Spectral as _};
use crate::interaction::{Interaction, Points};
use crate::lanes::{self, Frame, Kernel, Lanes, MAX_LANES, Mask as _, Task};
use crate::material::Material;

/// How many there are.
pub(super) const DIRECTIONS: usize = MAX_LANES;

/// Directions, each with what it brings at right angles.
#[derive(Clone, Debug)]
pub(super) struct Around<S> {
    directions: [[f32; DIRECTIONS]; 3],
    brought: [S; DIRECTIONS],
}

impl<S: crate::color::Spectral> Around<S> {
    /// Those that `draw` gives for their numbers; one that is not there brings nothing.
    pub(super) fn new(mut draw: impl FnMut(u32) -> Option<(Vec3, S)>) -> Self {
        let mut around = Self {
            directions: [[0.0; DIRECTIONS]; 3],
            brought: [S::zero(); DIRECTIONS],
        };
        for i in 0..DIRECTIONS {
            let Some((direction, brought)) = draw(i as u32) else {
                continue;
            };
            for (row, value) in around.directions.iter_mut().zip(direction.to_array()) {
                row[i] = value;
            }
            around.brought[i] = brought;
        }
        around
    }

    /// What a material returns of it toward where a point is seen from, by Phong's equation.
    pub(super) fn lit<C: ColorModel<Sample = S>>(
        &self,
        kernel: Kernel,
        at: &Interaction<'_>,
        material: &Material<C>,
        wavelengths: &C::Wavelengths,
    ) -> S {
        C::run(
            kernel,
            Lit {
                around: self,
                at,
                material,
                wavelengths,
            },
        )
    }
}

/// See [`Around::lit`].
struct Lit<'a, C: ColorModel> {
    around: &'a Around<C::Sample>,
    at: &'a Interaction<'a>,
    material: &'a Material<C>,
    wavelengths: &'a C::Wavelengths,
}

impl<C: ColorModel> Task for Lit<'_, C> {
    type Output = C::Sample;

    #[inline(always)]
    fn run<F: Lanes>(self) -> C::Sample {
        let at = self.at;
        let all = lanes::Vec3::<F>::all;
        let frame = Frame {
            s: all(at.frame.s),
            t: all(at.frame.t),
            n: all(at.frame.n),
        };
        let points = Points {
            active: F::Mask::splat(true),
            position: all(at.position),
            error: all(at.error),
            normal: all(at.normal),
            frame,
            uv: lanes::Vec2::all(at.uv),
            dp_du: all(at.dp_du),
            dp_dv: all(at.dp_dv),
            footprint: at.footprint.map(lanes::Vec2::all),
            wi: all(at.wi),
            source: at,
        };
        let wavelengths = [*self.wavelengths; MAX_LANES];
        let [x, y, z] = &self.around.directions;
        let mut sum = C::Sample::zero();
        for first in (0..DIRECTIONS).step_by(F::WIDTH) {
            let direction = lanes::Vec3::new(
                F::from_slice(&x[first..]),
                F::from_slice(&y[first..]),
                F::from_slice(&z[first..]),
            );
            let wo = frame.to_local(direction);
            let terms = self
                .material
                .phong_lanes(&points, points.wi, wo, &wavelengths);
            let returned = (terms.diffuse + terms.specular).rows();
            for lane in 0..F::WIDTH {
                let returned: C::Sample = C::Columns::<F>::of(&returned, lane);
                sum += returned * self.around.brought[first + lane];
            }
        }
        sum
    }
}
