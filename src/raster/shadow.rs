//! Shadow maps (Williams, *Casting curved shadows on curved surfaces*, 1978): what a light sees, drawn by the z-buffer, so that
//! a point is in shadow where the light sees something nearer. A light at a place looks through the six faces of a cube, one
//! that is infinitely far through a rectangle around the scene. Percentage-closer filtering (Reeves, Salesin and Cook,
//! *Rendering antialiased shadows with depth maps*, 1987) takes the mean of the answers of several texels.
//!
//! A map has faults that rays do not have, and the settings show them: without a bias surfaces shadow themselves between
//! texels (acne), with a large one shadows come off what casts them (peter-panning), and with few texels their edges are stairs.

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::corners::transformed;
use super::depth::{DepthCode, DepthFormat};
use super::drawn::Drawn;
use super::projection::Projection;
use super::visibility::{Canvas, Visibility};
use crate::error::Result;
use crate::lanes::{self, Doubles, Lanes, Mask};
use crate::shape::Bounds;

/// How maps are made and asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowSettings {
    /// Texels along a side.
    pub size: u32,
    /// How much nearer something must be to cast a shadow, in scene units; what a texel's size and the surface's slope ask
    /// for where absent.
    pub bias: Option<f64>,
    /// Texels along a side of the square whose answers are averaged; 1 asks a single one.
    pub filter: u32,
}

/// From where a light shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Source {
    /// From a place.
    At(Vec3),
    /// From infinitely far, in that direction.
    Along(Vec3),
}

/// What a light sees.
#[derive(Debug)]
pub(super) struct ShadowMap {
    settings: ShadowSettings,
    faces: Vec<Face>,
}

#[derive(Debug)]
struct Face {
    projection: Projection,
    code: DepthCode,
    seen: Visibility,
}

impl ShadowMap {
    /// Draws what casts shadows within `bounds`, which have an end.
    pub(super) fn draw(
        source: Source,
        casters: &Drawn<'_>,
        bounds: &Bounds,
        settings: ShadowSettings,
    ) -> Result<Self> {
        let size = settings.size;
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let (centre, radius) = (0.5 * (min + max), 0.5 * max.distance(min));
        let radius = if radius > 0.0 { 1.01 * radius } else { 1.0 };
        let canvas = Canvas::whole([size; 2]);
        let pixels = DVec2::splat(size.into());
        let mut faces = Vec::new();
        let projections: Vec<Option<Projection>> = match source {
            Source::At(place) => {
                let place = place.as_dvec3();
                let far = place.distance(centre) + radius;
                let axes = [DVec3::X, DVec3::Y, DVec3::Z];
                let ways = axes.into_iter().flat_map(|axis| [axis, -axis]);
                let of = |forward: DVec3| {
                    let (right, down) = forward.any_orthonormal_pair();
                    let corner = forward - right - down;
                    let ways = DMat3::from_cols(2.0 * right, 2.0 * down, corner);
                    Projection::new(place, ways, true, [1e-5 * far, far])
                };
                ways.map(of).collect()
            }
            Source::Along(direction) => {
                let forward = direction.as_dvec3().normalize();
                let (right, down) = forward.any_orthonormal_pair();
                let corner = centre - radius * (forward + right + down);
                let ways = DMat3::from_cols(2.0 * radius * right, 2.0 * radius * down, forward);
                vec![Projection::new(corner, ways, false, [0.0, 2.0 * radius])]
            }
        };
        for projection in projections.into_iter().flatten() {
            let Some(projection) = projection.in_pixels(pixels) else {
                continue;
            };
            let corners = bounds
                .corners()
                .map(|corner| projection.place(corner.as_dvec3()));
            if projection.misses_all(&corners) {
                continue;
            }
            faces.push(Face {
                seen: Visibility::draw(casters, &projection, &canvas)?,
                code: DepthCode::new(&projection, DepthFormat::Float),
                projection,
            });
        }
        Ok(Self { settings, faces })
    }

    /// How much of the light the `asked` of some points receive, in [0, 1]; the cosines are those between the surfaces' normals
    /// and the light's direction.
    #[inline(always)]
    pub(super) fn lit<F: Lanes>(&self, position: lanes::Vec3<F>, cosine: F, asked: F::Mask) -> F {
        let wide = <F::Double as Doubles>::splat;
        let position = [position.x.widen(), position.y.widen(), position.z.widen()];
        let cosine = cosine.abs().max(F::splat(0.1));
        let slope = (F::one() - cosine * cosine).max(F::zero()).sqrt() / cosine;
        let texels = 0.75 * (self.settings.filter.max(1) + 1) as f32;
        let texels = ((slope + F::splat(0.1)) * F::splat(texels)).widen();
        // What no map covers has nothing before it.
        let mut lit = F::one().row();
        let mut left = asked;
        for face in &self.faces {
            let [x, y, a] = {
                let (matrix, offset) = face.projection.along_ways(None);
                transformed::<F>(&matrix, offset, position)
            };
            let is_perspective = face.projection.is_perspective();
            let (x, y) = match is_perspective {
                true => ((x / a).narrow(), (y / a).narrow()),
                false => (x.narrow(), y.narrow()),
            };
            let [near, far] = face.projection.range();
            let size = F::splat(self.settings.size as f32);
            let inside = wide(near.next_down()).lt(a)
                & a.lt(wide(far.next_up()))
                & F::zero().le(x)
                & x.lt(size)
                & F::zero().le(y)
                & y.lt(size)
                & left;
            if !inside.any() {
                continue;
            }
            let bias = match (self.settings.bias, is_perspective) {
                (Some(bias), _) => wide(bias),
                (None, true) => texels * a * wide(face.projection.pixel(1.0)),
                (None, false) => texels * wide(face.projection.pixel(1.0)),
            };
            let codes = face.code.codes::<F>((a - bias).max(wide(near)));
            let (x, y) = (x.row(), y.row());
            for lane in inside.lanes() {
                lit[lane] = self.share(face, [x[lane], y[lane]], codes[lane]);
            }
            left = left & !inside;
        }
        F::load(&lit)
    }

    /// The share of texels around a place that see nothing nearer.
    #[inline(always)]
    fn share(&self, face: &Face, [x, y]: [f32; 2], code: u32) -> f32 {
        let (size, filter) = (self.settings.size as usize, self.settings.filter.max(1));
        let texel = |v: f32, step: u32| {
            let first = v - 0.5 * (filter - 1) as f32;
            ((first + step as f32).max(0.0) as usize).min(size - 1)
        };
        let mut lit = 0;
        for row in 0..filter {
            for column in 0..filter {
                let pixel = texel(y, row) * size + texel(x, column);
                lit += u32::from(face.seen.depth(pixel, 0) <= code);
            }
        }
        lit as f32 / (filter * filter) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{scene, sensor};
    use super::*;

    /// A square of side 2 at height 1 over a floor, and what a light sees of them.
    fn map(source: Source, settings: ShadowSettings) -> ShadowMap {
        let body = "<shape type='rectangle'><transform name='to_world'><translate z='1'/></transform></shape>
            <shape type='rectangle'><transform name='to_world'><scale value='8'/></transform></shape>";
        let (scene, sensor, film) = scene(&format!("{}{body}", sensor("perspective", "")));
        let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
        let drawn = Drawn::new(scene.tracer(), &projection, 0.0, |_| true).unwrap();
        ShadowMap::draw(source, &drawn, &scene.tracer().bounds(), settings).unwrap()
    }

    fn at(map: &ShadowMap, position: Vec3, cosine: f32) -> f32 {
        map.lit::<f32>(position.into(), cosine, Mask::splat(true))
    }

    const SETTINGS: ShadowSettings = ShadowSettings {
        size: 512,
        bias: None,
        filter: 1,
    };

    #[test]
    fn shadows_lie_where_straight_lines_put_them() {
        // From height 4 the square's shadow on the floor has sides of 2·4/3; from straight above they are 2.
        for (source, half) in [
            (Source::At(Vec3::new(0.0, 0.0, 4.0)), 4.0 / 3.0),
            (Source::Along(Vec3::NEG_Z), 1.0),
        ] {
            let map = map(source, SETTINGS);
            for step in 0..200 {
                let x = step as f32 * 0.02;
                if (x - half).abs() < 0.03 {
                    continue; // a texel
                }
                let lit = at(&map, Vec3::new(x, 0.3, 0.0), 1.0);
                assert_eq!(lit, if x < half { 0.0 } else { 1.0 }, "{source:?} {x}");
            }
            assert_eq!(at(&map, Vec3::new(0.2, 0.3, 1.0), 1.0), 1.0, "{source:?}");
        }
    }

    /// Which part of a slanted light falls on the floor beside the shadow, and in it.
    fn lit(settings: ShadowSettings) -> [f32; 2] {
        let direction = Vec3::new(-1.0, 0.3, -0.7).normalize();
        let map = map(Source::Along(direction), settings);
        let mean = |x: f32| {
            let points = (0..1000).map(|i| {
                let i = i as f32;
                Vec3::new(x + 0.3 * (i * 0.37).sin(), -0.3 * (i * 0.73).cos(), 0.0)
            });
            points.map(|p| at(&map, p, -direction.z)).sum::<f32>() / 1000.0
        };
        [mean(5.0), mean(-1.4)]
    }

    #[test]
    fn no_bias_gives_acne_and_a_large_one_loses_the_shadow() {
        let none = lit(ShadowSettings {
            size: 64,
            bias: Some(0.0),
            ..SETTINGS
        });
        assert!(none[0] < 0.8, "{none:?}");
        let right = lit(SETTINGS);
        assert_eq!(right, [1.0, 0.0]);
        let large = lit(ShadowSettings {
            bias: Some(3.0),
            ..SETTINGS
        });
        assert_eq!(large, [1.0, 1.0]);
    }

    #[test]
    fn a_filter_makes_steps_of_an_edge() {
        let map = map(
            Source::Along(Vec3::NEG_Z),
            ShadowSettings {
                size: 64,
                filter: 4,
                ..SETTINGS
            },
        );
        let values: Vec<f32> = (0..100)
            .map(|i| at(&map, Vec3::new(0.02 * i as f32, 0.1, 0.0), 1.0))
            .collect();
        assert!(
            values.is_sorted() && values[0] == 0.0 && values[99] == 1.0,
            "{values:?}"
        );
        assert!(values.iter().any(|v| *v > 0.2 && *v < 0.8));
    }
}
