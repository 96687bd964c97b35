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
use super::drawn::{Drawn, Placed};
use super::projection::Projection;
use super::visibility::{Canvas, Visibility};
use crate::error::Result;
use crate::lanes::{self, Doubles, Lanes, Mask};
use crate::sensor::Window;
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
    /// The texels that are drawn. In others nothing is before anything else.
    window: Window,
    seen: Visibility,
}

impl ShadowMap {
    /// Draws what casts shadows on some receivers, within `bounds`, which have an end. What casts some receives them too.
    pub(super) fn draw(
        source: Source,
        [casters, receivers]: [&Drawn<'_>; 2],
        bounds: &Bounds,
        settings: ShadowSettings,
    ) -> Result<Self> {
        let size = settings.size;
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let (centre, radius) = (0.5 * (min + max), 0.5 * max.distance(min));
        let radius = if radius > 0.0 { 1.01 * radius } else { 1.0 };
        let whole = Canvas::whole([size; 2]);
        let pixels = DVec2::splat(size.into());
        let mut faces = Vec::new();
        let projections: Vec<Option<Projection>> = match source {
            Source::At(place) => {
                let place = place.as_dvec3();
                let far = place.distance(centre) + radius;
                // What stands in the middle is best seen by one face.
                let toward = (centre - place).try_normalize().unwrap_or(DVec3::X);
                let (right, down) = toward.any_orthonormal_pair();
                let ways = [toward, right, down]
                    .into_iter()
                    .flat_map(|axis| [axis, -axis]);
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
            let extent = match settings.bias {
                // What it does to a surface alone is to be seen too.
                Some(_) => {
                    let place = |corner: Vec3| projection.place(corner.as_dvec3());
                    projection.extent(&bounds.corners().map(place))
                }
                None => overlapped(&projection, receivers),
            };
            let Some([first, last]) = extent else {
                continue;
            };
            let (first, last) = (first.floor().as_uvec2(), last.ceil().as_uvec2());
            let asked = Window {
                x: first.x,
                y: first.y,
                width: last.x - first.x,
                height: last.y - first.y,
            };
            // With the texels that filters take, and one for corners that lie beside their places.
            let window = asked.grown(settings.filter + 1, &whole.window);
            let canvas = Canvas { window, ..whole };
            faces.push(Face {
                seen: Visibility::draw(casters, &projection, &canvas)?,
                code: DepthCode::new(&projection, DepthFormat::Float),
                projection,
                window,
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
            let window = &face.window;
            let inside = wide(near.next_down()).lt(a)
                & a.lt(wide(far.next_up()))
                & F::splat(window.x as f32).le(x)
                & x.lt(F::splat((window.x + window.width) as f32))
                & F::splat(window.y as f32).le(y)
                & y.lt(F::splat((window.y + window.height) as f32))
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
        let filter = self.settings.filter.max(1);
        let Window { width, height, .. } = face.window;
        let texel = |v: f32, start: u32, count: u32, step: u32| {
            let first = v - start as f32 - 0.5 * (filter - 1) as f32;
            ((first + step as f32).max(0.0) as usize).min(count as usize - 1)
        };
        let mut lit = 0;
        for row in 0..filter {
            let row = texel(y, face.window.y, height, row) * width as usize;
            for column in 0..filter {
                let pixel = row + texel(x, face.window.x, width, column);
                lit += u32::from(face.seen.depth(pixel, 0) <= code);
            }
        }
        lit as f32 / (filter * filter) as f32
    }
}

/// The rectangle of a picture in which anything may stand before anything else, in pixels: around all that is drawn but its
/// largest flat surface, which has no shadow on itself.
fn overlapped(projection: &Projection, drawn: &Drawn<'_>) -> Option<[DVec2; 2]> {
    let extent = |placed: &Placed| {
        let bounds = drawn.facets(placed).bounds(drawn.kernel());
        if bounds.is_empty() {
            return None;
        }
        let (linear, translation) = placed.matrix();
        let place = |corner: Vec3| projection.place(linear * corner.as_dvec3() + translation);
        projection.extent(&bounds.corners().map(place))
    };
    let with_flatness = |placed: &Placed| {
        let is_flat = drawn.facets(placed).geometry.is_flat();
        Some((extent(placed)?, is_flat))
    };
    let mut extents: Vec<_> = drawn.placed().iter().filter_map(with_flatness).collect();
    let area = |i: &usize| {
        let ([first, last], _) = extents[*i];
        (last - first).element_product()
    };
    let flat = (0..extents.len()).filter(|i| extents[*i].1);
    if let Some(largest) = flat.max_by(|a, b| area(a).total_cmp(&area(b))) {
        extents.swap_remove(largest);
    }
    extents
        .into_iter()
        .map(|(extent, _)| extent)
        .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

#[cfg(test)]
mod tests {
    use super::super::tests::{scene, sensor};
    use super::*;

    const SQUARE: &str =
        "<shape type='rectangle'><transform name='to_world'><translate z='1'/></transform></shape>";
    const FLOOR: &str =
        "<shape type='rectangle'><transform name='to_world'><scale value='8'/></transform></shape>";

    /// What a light sees of some shapes.
    fn map_of(bodies: &[&str], source: Source, settings: ShadowSettings) -> ShadowMap {
        let bodies = bodies.concat();
        let (scene, sensor, film) = scene(&format!("{}{bodies}", sensor("perspective", "")));
        let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
        let drawn = Drawn::new(scene.tracer(), &projection, 0.0, |_| true).unwrap();
        let bounds = scene.tracer().bounds();
        ShadowMap::draw(source, [&drawn; 2], &bounds, settings).unwrap()
    }

    /// Of a square of side 2 at height 1 over a floor.
    fn map(source: Source, settings: ShadowSettings) -> ShadowMap {
        map_of(&[SQUARE, FLOOR], source, settings)
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

    #[test]
    fn texels_are_drawn_where_something_may_stand_before_another() {
        for source in [
            Source::At(Vec3::new(0.0, 0.0, 4.0)),
            Source::Along(Vec3::NEG_Z),
        ] {
            let drawn = |bodies: &[&str], settings| {
                let map = map_of(bodies, source, settings);
                let texels = map
                    .faces
                    .iter()
                    .map(|face| face.window.width * face.window.height);
                (texels.sum::<u32>(), map)
            };
            let (none, alone) = drawn(&[FLOOR], SETTINGS);
            assert_eq!(none, 0, "{source:?}");
            assert_eq!(at(&alone, Vec3::new(1.0, 2.0, 0.0), 1.0), 1.0);
            let shown = ShadowSettings {
                bias: Some(0.0),
                ..SETTINGS
            };
            let (all, _) = drawn(&[FLOOR], shown);
            let (some, _) = drawn(&[SQUARE, FLOOR], SETTINGS);
            assert!(0 < some && some < all / 2, "{source:?} {some} {all}");
            // What is behind a flat surface is in its shadow.
            let below = "<shape type='sphere'><point name='center' x='3' y='2' z='-2'/></shape>";
            let (_, map) = drawn(&[FLOOR, below], SETTINGS);
            for turn in 0..100 {
                let (y, x) = (0.1 * turn as f32).sin_cos();
                let place = Vec3::new(3.0 + 0.9 * x, 2.0 + 0.9 * y, -1.6);
                assert_eq!(at(&map, place, 0.4), 0.0, "{source:?} {place}");
            }
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
