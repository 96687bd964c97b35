//! What is seen at many places, over lanes, as far as shading needs it: of triangles the same bits as those of [`Fragment`]s,
//! one by one. Points of surfaces with equations are searched for by those.
//!
//! [`Fragment`]: super::fragment::Fragment

use glam::DVec2;

use super::corners::transformed;
use super::drawn::{Drawn, Facets, FacetsOf, Placed};
use super::fragment::Face;
use super::projection::Projection;
use crate::interaction::{Hit, Ray};
use crate::lanes::{Doubles, Lanes, Task};

/// A place of the picture, and what is seen there.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// In pixels of the film.
    pub place: DVec2,
    /// Of the triangle.
    pub number: u32,
    /// The ray that goes through the place.
    pub ray: Ray,
}

/// The point of a surface that is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Of the ray through the place.
    pub hit: Hit,
    /// How far along the projection's line.
    pub a: f32,
    /// The barycentric coordinates of the place on the triangle.
    pub weights: [f32; 3],
}

/// Finds what is seen at places.
#[derive(Debug)]
pub struct Fragments<'a, 's> {
    /// The triangles.
    pub drawn: &'a Drawn<'s>,
    /// From the world to the picture.
    pub projection: &'a Projection,
    /// Where.
    pub looks: &'a [Look],
    /// Where the answers go, one a place.
    pub to: &'a mut Vec<Seen>,
}

/// Of each of three corners or axes.
type Three<T> = [T; 3];

impl Task for Fragments<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(mut self) {
        let drawn = self.drawn;
        let mut looks = self.looks;
        while let Some(first) = looks.first() {
            // The memory of a fine mesh is far off.
            for number in new_numbers(looks, 2 * F::WIDTH, F::WIDTH) {
                drawn.fetch(number);
            }
            for number in new_numbers(looks, F::WIDTH, F::WIDTH) {
                drawn.fetch_corners(number);
            }
            let placed = drawn.find(first.number).0;
            let facets = drawn.facets(placed);
            let of_shape = placed.first..placed.first + facets.triangles.len() as u32;
            let first_few = looks.iter().take(F::WIDTH);
            let count = first_few
                .take_while(|look| of_shape.contains(&look.number))
                .count();
            let (of_shape, rest) = looks.split_at(count);
            match facets.kind {
                FacetsOf::Patches { .. } => self.one_by_one(of_shape),
                _ => self.of_triangles::<F>(of_shape, placed, facets),
            }
            looks = rest;
        }
    }
}

/// The triangles of `count` places from `first` on that are not those of the places before.
fn new_numbers(looks: &[Look], first: usize, count: usize) -> impl Iterator<Item = u32> {
    let end = looks.len().min(first + count);
    let pairs = looks[first.min(end) - 1..end].windows(2);
    let changes = pairs.filter(|pair| pair[0].number != pair[1].number);
    changes.map(|pair| pair[1].number)
}

impl Fragments<'_, '_> {
    fn one_by_one(&mut self, looks: &[Look]) {
        for looks in looks.chunk_by(|a, b| a.number == b.number) {
            let face = Face::new(self.drawn, self.projection, looks[0].number);
            for Look { place, ray, .. } in looks {
                let fragment = face.at(*place);
                self.to.push(Seen {
                    hit: fragment.hit_of(ray),
                    a: fragment.a as f32,
                    weights: fragment.weights.map(|weight| weight as f32),
                });
            }
        }
    }

    /// At most as many as there are lanes, all of triangles of one shape.
    #[inline(always)]
    fn of_triangles<F: Lanes>(&mut self, looks: &[Look], placed: &Placed, facets: &Facets<'_>) {
        let wide = <F::Double as Doubles>::splat;
        let mut corners = [[F::ROW; 3]; 3];
        let (mut pixels, mut within) = ([F::ROW; 2], [F::ROW; 2]);
        let (mut origins, mut directions) = ([F::ROW; 3], [F::ROW; 3]);
        for (lane, look) in looks.iter().enumerate() {
            let triangle = facets.triangles[(look.number - placed.first) as usize];
            for corner in 0..3 {
                let position = facets.positions[triangle[corner] as usize];
                for axis in 0..3 {
                    corners[corner][axis][lane] = position[axis];
                }
            }
            // Both parts are numbers of single precision.
            let pixel = look.place.floor();
            for axis in 0..2 {
                pixels[axis][lane] = pixel[axis] as f32;
                within[axis][lane] = (look.place[axis] - pixel[axis]) as f32;
            }
            for axis in 0..3 {
                origins[axis][lane] = look.ray.origin[axis];
                directions[axis][lane] = look.ray.direction[axis];
            }
        }
        let [p, q, r] = [
            widened::<F>(&corners[0]),
            widened::<F>(&corners[1]),
            widened::<F>(&corners[2]),
        ];
        let (matrix, offset) = self.projection.along_ways(placed.to_world.as_ref());
        let [mut i, mut j, mut k] = [
            transformed::<F>(&matrix, offset, p),
            transformed::<F>(&matrix, offset, q),
            transformed::<F>(&matrix, offset, r),
        ];
        let depths = [i[2], j[2], k[2]];
        if !self.projection.is_perspective() {
            (i[2], j[2], k[2]) = (wide(1.0), wide(1.0), wide(1.0));
        }
        let place = [
            F::load(&pixels[0]).widen() + F::load(&within[0]).widen(),
            F::load(&pixels[1]).widen() + F::load(&within[1]).widen(),
            wide(1.0),
        ];
        let weights = weights::<F>([
            dot::<F>(cross::<F>(j, k), place),
            dot::<F>(cross::<F>(k, i), place),
            dot::<F>(cross::<F>(i, j), place),
        ]);
        let local = [
            dot::<F>([p[0], q[0], r[0]], weights),
            dot::<F>([p[1], q[1], r[1]], weights),
            dot::<F>([p[2], q[2], r[2]], weights),
        ];
        let (linear, translation) = placed.matrix();
        let position = transformed::<F>(&linear, translation, local);
        let origin = widened::<F>(&origins);
        let way = [
            position[0] - origin[0],
            position[1] - origin[1],
            position[2] - origin[2],
        ];
        let t = dot::<F>(way, widened::<F>(&directions)).narrow().row();
        let a = dot::<F>(depths, weights).narrow().row();
        let weights = [
            weights[0].narrow().row(),
            weights[1].narrow().row(),
            weights[2].narrow().row(),
        ];
        for (lane, look) in looks.iter().enumerate() {
            self.to.push(Seen {
                hit: Hit {
                    t: t[lane],
                    u: weights[1][lane],
                    v: weights[2][lane],
                    instance: placed.instance,
                    shape: placed.shape,
                    primitive: facets.primitive((look.number - placed.first) as usize),
                },
                a: a[lane],
                weights: [weights[0][lane], weights[1][lane], weights[2][lane]],
            });
        }
    }
}

/// Rows in double precision.
#[inline(always)]
fn widened<F: Lanes>(rows: &Three<F::Row>) -> Three<F::Double> {
    [
        F::load(&rows[0]).widen(),
        F::load(&rows[1]).widen(),
        F::load(&rows[2]).widen(),
    ]
}

#[inline(always)]
fn cross<F: Lanes>(a: Three<F::Double>, b: Three<F::Double>) -> Three<F::Double> {
    [
        a[1] * b[2] - b[1] * a[2],
        a[2] * b[0] - b[2] * a[0],
        a[0] * b[1] - b[0] * a[1],
    ]
}

#[inline(always)]
fn dot<F: Lanes>(a: Three<F::Double>, b: Three<F::Double>) -> F::Double {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The barycentric coordinates by those that are not scaled, as `fragment` has them.
#[inline(always)]
fn weights<F: Lanes>([u, v, w]: Three<F::Double>) -> Three<F::Double> {
    let wide = <F::Double as Doubles>::splat;
    let zero = wide(0.0);
    let sign = F::Double::select((u + v + w).lt(zero), wide(-1.0), wide(1.0));
    let [u, v, w] = [
        (u * sign).max(zero),
        (v * sign).max(zero),
        (w * sign).max(zero),
    ];
    let sum = u + v + w;
    let sound = zero.lt(sum) & sum.lt(wide(f64::INFINITY));
    let third = wide(1.0 / 3.0);
    [
        F::Double::select(sound, u / sum, third),
        F::Double::select(sound, v / sum, third),
        F::Double::select(sound, w / sum, third),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::tests::{scene, sensor};
    use super::super::{Canvas, Fragment, Pattern, Visibility};
    use super::*;
    use crate::lanes::Kernel;

    #[test]
    fn fragments_over_lanes_are_those_one_by_one() {
        let bodies = "<shape type='cube'><transform name='to_world'><rotate x='1' y='2' z='-1' angle='40'/><scale value='.7'/></transform></shape>
            <shape type='sphere'><point name='center' x='1.3' y='0' z='-1'/><float name='radius' value='.6'/></shape>
            <shape type='shapegroup' id='g'><shape type='cube'/></shape>
            <shape type='instance'><ref id='g'/><transform name='to_world'><scale x='.4' y='-.3' z='.5'/><translate x='-1.2'/></transform></shape>
            <shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='40'/><translate y='-1'/></transform></shape>";
        for plugin in ["perspective", "orthographic"] {
            let (scene, sensor, film) = scene(&format!("{}{bodies}", sensor(plugin, "")));
            let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
            let drawn = Drawn::new(scene.tracer(), &projection, 0.0, |_| true).unwrap();
            let pattern = Pattern::of(4).unwrap();
            let canvas = Canvas {
                pattern,
                ..Canvas::whole([80, 60])
            };
            let seen = Visibility::draw(&drawn, &projection, &canvas).unwrap();
            let mut looks = Vec::new();
            for (pixel, sample) in (0..80 * 60).flat_map(|pixel| (0..4).map(move |s| (pixel, s))) {
                let Some(number) = seen.number(pixel, sample) else {
                    continue;
                };
                let corner = DVec2::new((pixel % 80) as f64, (pixel / 80) as f64);
                let place = corner + DVec2::from(pattern.place(sample));
                let on_film = place / DVec2::new(80.0, 60.0);
                let ray = sensor.ray(on_film.as_vec2(), glam::Vec2::splat(0.5), 0.0);
                looks.push(Look { place, number, ray });
            }
            let shapes: std::collections::HashSet<u32> = looks
                .iter()
                .map(|look| drawn.find(look.number).0.shape)
                .collect();
            assert!(shapes.len() == 4 || plugin == "orthographic", "{shapes:?}");
            let expected: Vec<Seen> = looks
                .iter()
                .map(|look| {
                    let fragment = Fragment::new(&drawn, &projection, look.number, look.place);
                    Seen {
                        hit: fragment.hit_of(&look.ray),
                        a: fragment.a as f32,
                        weights: fragment.weights.map(|weight| weight as f32),
                    }
                })
                .collect();
            for kernel in Kernel::all() {
                let mut found = Vec::new();
                kernel.run(Fragments {
                    drawn: &drawn,
                    projection: &projection,
                    looks: &looks,
                    to: &mut found,
                });
                assert!(found == expected, "{plugin} {}", kernel.name());
            }
        }
    }
}
