//! Where on a shape a textured light is bright. Points are drawn in proportion to that: over the square of a
//! surface's parameters, or triangle by triangle of a mesh. A part of them is still drawn as the shape itself
//! draws, which knows what is near: the fraction E[L]²/E[L²] over the area, the efficiency of drawing evenly;
//! all of them where the texture is even, next to none where it is dark but for a spot. One density is that of
//! the mixture, whichever drew (Veach and Guibas's one-sample model, 1995).

use glam::{Vec2, Vec3};

use super::grid::Grid;
use super::{interaction, mean_lane};
use crate::color::ColorModel;
use crate::interaction::Interaction;
use crate::math::distribution::Discrete;
use crate::shape::{Geometry, Surface, SurfaceSample, area_to_solid_angle};
use crate::texture::Texture;

/// A density over a shape.
#[derive(Clone, Debug)]
pub(super) struct Brightness {
    places: Places,
    /// The fraction of points that is drawn by brightness.
    share: f32,
}

#[derive(Clone, Debug)]
enum Places {
    /// Over the square of the surface's parameters.
    Square(Grid),
    /// Over triangles, and evenly over each.
    Triangles(Discrete),
}

/// A texture's radiance over a shape, as a mean over the channels.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    area: f64,
    first: f64,
    second: f64,
}

impl Sums {
    fn add(&mut self, area: f64, radiance: f64) {
        self.area += area;
        self.first += area * radiance;
        self.second += area * radiance * radiance;
    }

    fn mean(&self) -> f64 {
        if self.area > 0.0 {
            self.first / self.area
        } else {
            0.0
        }
    }

    /// 1 − E[L]²/E[L²].
    fn unevenness(&self) -> f64 {
        if self.second > 0.0 {
            (1.0 - self.first * self.first / (self.second * self.area)).max(0.0)
        } else {
            0.0
        }
    }
}

/// Bounds of the cells along a side of the square, whatever the texture's resolution.
const CELLS: std::ops::RangeInclusive<usize> = 16..=512;
/// Along each side of a cell, how many points are looked at.
const PROBES: usize = 2;
/// About how many points of a mesh are looked at, and bounds for a triangle.
const MESH_PROBES: usize = 1 << 20;
const TRIANGLE_PROBES: std::ops::RangeInclusive<usize> = 4..=256;
/// What is added to each brightness, as a fraction of the mean: what shines between the points that were
/// looked at is drawn too.
const FLOOR: f64 = 0.05;
/// A texture less uneven than this is drawn as the shape draws.
const EVEN: f64 = 1e-3;

impl Brightness {
    /// Looks at the texture all over the shape: the mean over the area, and a density where it pays to have one.
    pub(super) fn survey<C: ColorModel>(
        radiance: &Texture<C>,
        shape: &Geometry,
        color: &C,
    ) -> (f64, Option<Self>) {
        let wavelengths = color.wavelengths(|| 0.5);
        let look = |at: &Interaction<'_>| mean_lane(color, radiance.eval(at, &wavelengths));
        let mut sums = Sums::default();
        let (weights, areas): (Vec<f64>, Vec<f64>);
        let places = if shape.chart(Vec2::splat(0.5)).is_some() {
            let [width, height] = radiance
                .resolution()
                .map(|n| n.clamp(*CELLS.start(), *CELLS.end()));
            (weights, areas) = (0..width * height)
                .map(|i| {
                    let mut cell = Sums::default();
                    for probe in 0..PROBES * PROBES {
                        let p = Vec2::new(
                            (i % width) as f32 + share(probe % PROBES, PROBES),
                            (i / width) as f32 + share(probe / PROBES, PROBES),
                        ) / Vec2::new(width as f32, height as f32);
                        let place = shape.chart(p).expect("there is a chart");
                        let l = look(&interaction(shape, &place.point));
                        cell.add(place.stretch, l);
                        sums.add(place.stretch, l);
                    }
                    (cell.first, cell.area)
                })
                .unzip();
            Grid::new(width, &floored(&weights, &areas, &sums)).map(Places::Square)
        } else if let Geometry::Mesh(mesh) = shape {
            let count = mesh.primitive_count();
            let probes = (MESH_PROBES / (count as usize).max(1))
                .clamp(*TRIANGLE_PROBES.start(), *TRIANGLE_PROBES.end());
            (weights, areas) = (0..count)
                .map(|t| {
                    let area = mesh.triangle_area(t);
                    let mut triangle = Sums::default();
                    for i in 0..probes {
                        // The golden ratio's sequence of points (Roberts, 2018).
                        let u = Vec2::new(0.754_877_7, 0.569_840_3) * (i as f32 + 0.5);
                        let point = mesh.triangle_point(t, u - u.floor());
                        let l = look(&interaction(shape, &point));
                        triangle.add(area / probes as f64, l);
                        sums.add(area / probes as f64, l);
                    }
                    (triangle.first, triangle.area)
                })
                .unzip();
            Discrete::new(floored(&weights, &areas, &sums)).map(Places::Triangles)
        } else {
            // What is drawn of it will do for choosing lights.
            let beside = shape.bounds(0).min - 1.0;
            for i in 0..*TRIANGLE_PROBES.end() {
                let u = Vec2::new(0.754_877_7, 0.569_840_3) * (i as f32 + 0.5);
                if let Some(point) = shape.sample(beside, u - u.floor()) {
                    sums.add(1.0, look(&interaction(shape, &point)));
                }
            }
            return (sums.mean(), None);
        };
        let share = sums.unevenness();
        let density = places.filter(|_| share > EVEN).map(|places| Self {
            places,
            share: share as f32,
        });
        (sums.mean(), density)
    }

    /// A point of the shape, for light at `from`.
    pub(super) fn sample(&self, shape: &Geometry, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let sample = if u.x < self.share {
            let u = Vec2::new((u.x / self.share).min(1f32.next_down()), u.y);
            match (&self.places, shape) {
                (Places::Square(grid), _) => {
                    let (place, _) = grid.sample::<f32>(u.into());
                    shape.chart(place.into())?.point
                }
                (Places::Triangles(triangles), Geometry::Mesh(mesh)) => {
                    let drawn = triangles.sample(u.x);
                    mesh.triangle_point(drawn.index as u32, Vec2::new(drawn.rest, u.y))
                }
                (Places::Triangles(_), _) => return None,
            }
        } else {
            let rest = (u.x - self.share) / (1.0 - self.share);
            shape.sample(from, Vec2::new(rest.min(1f32.next_down()), u.y))?
        };
        let pdf = self.pdf(shape, from, &interaction(shape, &sample));
        (pdf > 0.0 && pdf.is_finite()).then_some(SurfaceSample { pdf, ..sample })
    }

    /// The density per solid angle with which [`Self::sample`] draws the point `at`.
    pub(super) fn pdf(&self, shape: &Geometry, from: Vec3, at: &Interaction<'_>) -> f32 {
        let bright = match (&self.places, shape) {
            (Places::Square(grid), _) => {
                let p = shape.parameters(at.primitive, at.barycentric, at.uv);
                let stretch = shape.chart(p).map_or(0.0, |place| place.stretch);
                grid.pdf::<f32>(p.into())
                    * area_to_solid_angle(stretch, from, at.position, at.normal)
            }
            (Places::Triangles(triangles), Geometry::Mesh(mesh)) => {
                let probability = triangles.probability(at.primitive as usize);
                let area = mesh.triangle_area(at.primitive) / probability;
                area_to_solid_angle(area, from, at.position, at.normal)
            }
            (Places::Triangles(_), _) => 0.0,
        };
        self.share * bright + (1.0 - self.share) * shape.pdf(from, at)
    }
}

/// The middle of part `i` of `n` parts of the unit interval.
fn share(i: usize, n: usize) -> f32 {
    (i as f32 + 0.5) / n as f32
}

/// Weights with the floor under them.
fn floored(weights: &[f64], areas: &[f64], sums: &Sums) -> Vec<f64> {
    let floor = FLOOR * sums.mean();
    let both = weights.iter().zip(areas);
    both.map(|(w, area)| w + floor * area).collect()
}
