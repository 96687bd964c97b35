//! Ray cones: what a ray stands for, as a circle around it that grows with the distance (Amanatides, *Ray tracing with cones*,
//! 1984; Akenine-Möller et al., *Texture level of detail strategies for real-time ray tracing*, Ray Tracing Gems, 2019). On a
//! surface the circle is an ellipse, and so it is in texture coordinates, where textures look up as much of an image as that
//! covers.

use glam::Vec3;

use super::{Interaction, Points};
use crate::lanes::{self, Frame, Lanes};

/// A circle around a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cone {
    /// Its diameter where the ray begins, in scene units.
    pub width: f32,
    /// By how much that grows with each unit of distance.
    pub spread: f32,
}

impl Cone {
    /// The diameter at a distance.
    pub fn at(&self, distance: f32) -> f32 {
        self.width + self.spread * distance
    }

    /// Behind a surface, or a point of a medium, at a distance, where directions are scattered with a density `pdf` in 1/sr of
    /// which the sample stands for a `share`, measured as a length; without a density the ray goes on as it is, or
    /// as a plane mirror has it.
    #[must_use]
    pub fn scattered(&self, distance: f32, pdf: Option<f32>, share: f32) -> Self {
        /// A radian to either side: further a lobe does not go.
        const WIDEST: f32 = 2.0;
        // A circle of that solid angle.
        let lobe = pdf.map_or(0.0, |pdf| {
            let diameter = 2.0 * (std::f32::consts::FRAC_1_PI / pdf).sqrt();
            share * diameter.min(WIDEST)
        });
        Self {
            width: self.at(distance),
            spread: self.spread + lobe,
        }
    }
}

impl<F: Lanes> Points<'_, F> {
    /// How far texture coordinates go over circles of these diameters around the rays.
    #[inline(always)]
    pub fn within(&self, width: F) -> [lanes::Vec2<F>; 2] {
        let toward = self.frame.to_world(self.wi);
        let Frame { s, t, .. } = Frame::around(toward);
        self.beside(toward, [s * width, t * width])
    }

    /// By how much texture coordinates change with `steps` to the side of rays that come from `toward`: these go on along the
    /// rays to the plane that touches the surface, and are written, by least squares, as steps of u and v. 0 where that has no
    /// solution.
    #[inline(always)]
    pub fn beside(
        &self,
        toward: lanes::Vec3<F>,
        steps: [lanes::Vec3<F>; 2],
    ) -> [lanes::Vec2<F>; 2] {
        let (n, a, b) = (self.normal, self.dp_du, self.dp_dv);
        let along = F::one() / n.dot(toward);
        let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
        let scale = F::one() / (aa * bb - ab * ab);
        let mut ways = [lanes::Vec2::splat(0.0); 2];
        for i in 0..2 {
            let step = steps[i] - toward * (n.dot(steps[i]) * along);
            let (with_a, with_b) = (a.dot(step), b.dot(step));
            let u = (bb * with_a - ab * with_b) * scale;
            let v = (aa * with_b - ab * with_a) * scale;
            let told = u.is_finite() & v.is_finite();
            ways[i] = lanes::Vec2::select(told, lanes::Vec2::new(u, v), ways[i]);
        }
        ways
    }
}

impl Interaction<'_> {
    /// The same with the footprint of a ray whose circle has that diameter here.
    #[must_use]
    pub fn seen_within(mut self, width: f32) -> Self {
        self.footprint = Points::one(&self).within(width).map(glam::Vec2::from);
        self
    }

    /// The same with the footprint of a ray that comes from `toward`, whose neighbours are these `steps` aside.
    #[must_use]
    pub fn seen_beside(mut self, toward: Vec3, steps: [Vec3; 2]) -> Self {
        let ways = Points::one(&self).beside(toward.into(), steps.map(lanes::Vec3::from));
        self.footprint = ways.map(glam::Vec2::from);
        self
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use glam::Vec2;

    use super::*;
    use crate::math;

    /// A point of the plane z = 0 with u along 2x and v along 3y, seen from a direction.
    fn seen_from(toward: Vec3) -> Interaction<'static> {
        Interaction {
            dp_du: Vec3::X * 2.0,
            dp_dv: Vec3::Y * 3.0,
            frame: math::Frame::around(Vec3::Z),
            wi: math::Frame::around(Vec3::Z).to_local(toward),
            ..Interaction::at_uv(Vec2::ZERO)
        }
    }

    #[test]
    fn a_cone_seen_at_an_angle_is_an_ellipse_that_is_long_by_the_cosine() {
        for degrees in [0.0_f32, 30.0, 60.0, 85.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let [a, b] = seen_from(Vec3::new(sin, 0.0, cos))
                .seen_within(0.1)
                .footprint;
            // The matrix of the ellipse: conjugate diameters differ, and it does not.
            let along_u = a.x * a.x + b.x * b.x;
            let along_v = a.y * a.y + b.y * b.y;
            let mixed = a.x * a.y + b.x * b.y;
            let (long, short) = (0.1 / cos / 2.0, 0.1 / 3.0);
            assert!((along_u.sqrt() / long - 1.0).abs() < 1e-3, "{degrees}");
            assert!((along_v.sqrt() / short - 1.0).abs() < 1e-3, "{degrees}");
            assert!(mixed.abs() < 1e-3 * long * short, "{degrees}");
        }
    }

    #[test]
    fn what_has_no_texture_coordinates_has_no_footprint() {
        let mut at = seen_from(Vec3::Z);
        (at.dp_du, at.dp_dv) = (Vec3::ZERO, Vec3::ZERO);
        assert_eq!(at.seen_within(0.1).footprint, [Vec2::ZERO; 2]);
        let flat = seen_from(Vec3::X).seen_within(0.1).footprint;
        assert!(flat.iter().all(|way| way.is_finite()), "{flat:?}");
    }

    #[test]
    fn a_cone_grows_with_the_distance_and_by_what_it_is_scattered() {
        let cone = Cone {
            width: 0.5,
            spread: 0.01,
        };
        assert_eq!(cone.at(10.0), 0.6);
        let mirrored = cone.scattered(10.0, None, 1.0);
        assert_eq!((mirrored.width, mirrored.spread), (0.6, 0.01));
        // 1 / (100 π) sr is a circle of radius 1/10 π⁻¹… and so of diameter 2/(10 π).
        let rough = cone.scattered(10.0, Some(100.0 * PI), 0.5);
        assert!((rough.spread - (0.01 + 0.5 * 2.0 / (10.0 * PI))).abs() < 1e-6);
        let even = cone.scattered(0.0, Some(0.0), 1.0);
        assert_eq!(even.spread, 2.01);
    }
}
