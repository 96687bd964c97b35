//! Projections: from the world to a picture. That of a sensor is fitted to the sensor's own rays, so that a pixel's centre
//! means the same to a ray and to a triangle, whatever moves or shears the picture; a sensor whose rays are no pinhole's and
//! no parallel ones has none.
//!
//! With the pinhole O and the way d(x, y) = d₀ + x·d_x + y·d_y from near to far through the place (x, y), a point is
//! P = O + a·d(x, y): [d_x d_y d₀]⁻¹ (P − O) = (a·x, a·y, a) are its homogeneous coordinates, of which a, proportional to
//! depth, is at `near` and `far` where the ray begins and ends. Parallel rays are P = O + x·d_x + y·d_y + a·d₀.

use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};

use crate::error::{Error, Result};
use crate::math::Transform;
use crate::sensor::{Film, Sensor, Window};

/// From the world to a picture in pixels, from its upper left corner on.
#[derive(Clone, Debug)]
pub struct Projection {
    /// Where the rays come from; with parallel ones where that of the place (0, 0) begins.
    origin: DVec3,
    /// [d_x d_y d₀].
    ways: DMat3,
    /// Its inverse.
    inverse: DMat3,
    /// The same of world space: see [`Projection::along_ways`].
    of_world: (DMat3, DVec3),
    /// Whether they come from one point.
    is_perspective: bool,
    /// What `a` is where the picture begins.
    near: f64,
    /// And where it ends.
    far: f64,
    /// Of the whole picture, in pixels.
    size: DVec2,
}

/// A point in homogeneous coordinates: the place in the picture is (x/w, y/w).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Place {
    /// To the right, in pixels, times `w`.
    pub x: f64,
    /// Down, in pixels, times `w`.
    pub y: f64,
    /// How far along the ray: between the projection's near and far.
    pub a: f64,
    /// `a` in perspective, else 1.
    pub w: f64,
}

impl Place {
    /// The point between two at `part` of the way.
    pub(super) fn toward(self, other: Self, part: f64) -> Self {
        let mix = |from: f64, to: f64| from + part * (to - from);
        Self {
            x: mix(self.x, other.x),
            y: mix(self.y, other.y),
            a: mix(self.a, other.a),
            w: mix(self.w, other.w),
        }
    }

    /// Whether all of it is finite.
    pub(super) fn is_finite(self) -> bool {
        (self.x + self.y + self.a + self.w).is_finite()
    }
}

/// A world-space line: `origin + a·way`.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// World space.
    pub origin: DVec3,
    /// World space; its length is what `a` is measured in.
    pub way: DVec3,
}

impl Line {
    /// The point at `a`.
    pub fn at(&self, a: f64) -> DVec3 {
        self.origin + a * self.way
    }
}

/// Lines of the grid of places at which a sensor is asked for rays.
const GRID: u32 = 9;

impl Projection {
    /// That of a sensor at a time, in pixels of the film.
    ///
    /// # Errors
    /// Where the sensor's rays are neither a pinhole's nor parallel.
    pub fn of_sensor(sensor: &Sensor, film: &Film, time: f32) -> Result<Self> {
        let size = DVec2::new(film.width.into(), film.height.into());
        let mut rays = Vec::new();
        for i in 0..GRID * GRID {
            let step = |i: u32| f64::from(i) / f64::from(GRID - 1);
            let place = DVec2::new(step(i % GRID), step(i / GRID));
            let ray = sensor.ray(place.as_vec2(), Vec2::splat(0.5), time);
            let way = ray.direction.as_dvec3() * f64::from(ray.t_max);
            rays.push((place, ray.origin.as_dvec3(), way));
        }
        let unfit = || {
            let error = Error::unsupported("this sensor's rays are no pinhole's and not parallel");
            error.help("a z-buffer draws what perspective, thinlens and orthographic see")
        };
        let ways = Affine::fit(rays.iter().map(|(place, _, way)| (*place, *way)));
        let length = ways.constant.length();
        if !(length > 0.0 && length.is_finite()) {
            return Err(unfit());
        }
        let spread = ways.x.length().max(ways.y.length());
        let is_perspective = spread > 1e-5 * length;
        let (origin, basis, near) = if is_perspective {
            // Rays begin at O + near·d.
            let count = rays.len() as f64;
            let mean_start = rays.iter().map(|ray| ray.1).sum::<DVec3>() / count;
            let mean_way = rays.iter().map(|ray| ray.2).sum::<DVec3>() / count;
            let (mut with, mut of) = (0.0, 0.0);
            for (_, start, way) in &rays {
                let way = *way - mean_way;
                with += (*start - mean_start).dot(way);
                of += way.length_squared();
            }
            let near = with / of;
            let basis = DMat3::from_cols(ways.x, ways.y, ways.constant);
            (mean_start - near * mean_way, basis, near)
        } else {
            let starts = Affine::fit(rays.iter().map(|(place, start, _)| (*place, *start)));
            let basis = DMat3::from_cols(starts.x, starts.y, ways.constant);
            (starts.constant, basis, 0.0)
        };
        let film =
            Self::new(origin, basis, is_perspective, [near, near + 1.0]).ok_or_else(unfit)?;
        for (place, start, way) in &rays {
            let line = film.line(*place);
            let (begin, end) = (line.at(film.near), line.at(film.far));
            let off = (begin - *start)
                .length()
                .max((end - (*start + *way)).length());
            if off.is_nan() || off > 1e-4 * length {
                return Err(unfit());
            }
        }
        film.in_pixels(size).ok_or_else(unfit)
    }

    /// Out of its parts: see the fields.
    pub(super) fn new(
        origin: DVec3,
        ways: DMat3,
        is_perspective: bool,
        [near, far]: [f64; 2],
    ) -> Option<Self> {
        let inverse = ways.inverse();
        let sound = inverse.is_finite() && origin.is_finite() && near < far;
        let sound = sound && (!is_perspective || near > 0.0);
        sound.then_some(Self {
            origin,
            ways,
            inverse,
            of_world: (inverse, inverse * -origin),
            is_perspective,
            near,
            far,
            size: DVec2::ONE,
        })
    }

    /// The same whose unit square is that many pixels.
    pub(super) fn in_pixels(&self, size: DVec2) -> Option<Self> {
        let DMat3 {
            x_axis,
            y_axis,
            z_axis,
        } = self.ways;
        let ways = DMat3::from_cols(x_axis / size.x, y_axis / size.y, z_axis);
        let range = [self.near, self.far];
        let pixels = Self::new(self.origin, ways, self.is_perspective, range)?;
        Some(Self { size, ..pixels })
    }

    /// Where a point is.
    #[inline]
    pub fn place(&self, point: DVec3) -> Place {
        self.placed(self.inverse * (point - self.origin))
    }

    /// A place by its coordinates along the ways.
    #[inline]
    pub(super) fn placed(&self, along: DVec3) -> Place {
        let DVec3 { x, y, z } = along;
        let w = if self.is_perspective { z } else { 1.0 };
        Place { x, y, a: z, w }
    }

    /// The matrix and the vector that [`Projection::placed`] wants of a point of a space that stands so in the world.
    pub(super) fn along_ways(&self, to_world: Option<&Transform>) -> (DMat3, DVec3) {
        let Some(to_world) = to_world else {
            return self.of_world;
        };
        let matrix = self.inverse * to_world.linear().as_dmat3();
        let translation = to_world.translation().as_dvec3();
        (matrix, self.inverse * (translation - self.origin))
    }

    /// The line of all points that are seen at a place, in pixels.
    pub fn line(&self, place: DVec2) -> Line {
        let across = self.ways.x_axis * place.x + self.ways.y_axis * place.y;
        match self.is_perspective {
            true => Line {
                origin: self.origin,
                way: across + self.ways.z_axis,
            },
            false => Line {
                origin: self.origin + across,
                way: self.ways.z_axis,
            },
        }
    }

    /// By how much the points that far along their rays differ from a pixel to the next, to the right and down, world space.
    pub fn steps(&self, a: f64) -> [DVec3; 2] {
        let scale = if self.is_perspective { a } else { 1.0 };
        [self.ways.x_axis * scale, self.ways.y_axis * scale]
    }

    /// Whether nothing of what these places are the corners of is seen in the picture, as [`Projection::misses`] has it.
    pub(super) fn misses_all(&self, corners: &[Place]) -> bool {
        self.misses_between(corners, DVec2::ZERO, self.size)
    }

    /// Whether nothing of what these places are the corners of is seen in a window: all of it is before the range or beyond it,
    /// or to one side of the window.
    pub(super) fn misses(&self, corners: &[Place], window: &Window) -> bool {
        let first = DVec2::new(window.x.into(), window.y.into());
        let size = DVec2::new(window.width.into(), window.height.into());
        self.misses_between(corners, first, first + size)
    }

    fn misses_between(&self, corners: &[Place], first: DVec2, last: DVec2) -> bool {
        let all = |out: &dyn Fn(&Place) -> bool| corners.iter().all(out);
        all(&|p| p.a < self.near)
            || all(&|p| p.a > self.far)
            || all(&|p| p.x < first.x * p.w)
            || all(&|p| p.x > last.x * p.w)
            || all(&|p| p.y < first.y * p.w)
            || all(&|p| p.y > last.y * p.w)
    }

    /// Two corners of a rectangle outside of which nothing is seen of what these places are the corners of, in pixels; `None`
    /// where all of it is elsewhere.
    pub(super) fn extent(&self, corners: &[Place]) -> Option<[DVec2; 2]> {
        if self.misses_all(corners) {
            return None;
        }
        // What is behind the pinhole in part may be anywhere, as what has no end.
        let is_behind = |p: &Place| self.is_perspective && p.w < self.near;
        if corners.iter().any(|p| is_behind(p) || !p.is_finite()) {
            return Some([DVec2::ZERO, self.size]);
        }
        let places = corners.iter().map(|p| DVec2::new(p.x, p.y) / p.w);
        let none = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        let [first, last] = places.fold(none, |[first, last], p| [first.min(p), last.max(p)]);
        Some([first.max(DVec2::ZERO), last.min(self.size)])
    }

    /// How large a pixel is at a place that far along its ray, in world units.
    pub fn pixel(&self, a: f64) -> f64 {
        let size = self.ways.x_axis.length().max(self.ways.y_axis.length());
        if self.is_perspective { size * a } else { size }
    }

    /// Where the picture begins and where it ends.
    pub fn range(&self) -> [f64; 2] {
        [self.near, self.far]
    }

    /// How far from each other these are in the world, in the middle of the picture at least.
    pub(super) fn reach(&self) -> f64 {
        self.ways.z_axis.length()
    }

    /// Whether all rays come from one point.
    pub fn is_perspective(&self) -> bool {
        self.is_perspective
    }

    /// Where rays come from.
    pub fn origin(&self) -> Vec3 {
        self.origin.as_vec3()
    }
}

/// A vector that depends on a place.
struct Affine {
    constant: DVec3,
    x: DVec3,
    y: DVec3,
}

impl Affine {
    /// By least squares over a grid on the unit square, whose places are uncorrelated.
    fn fit(values: impl Iterator<Item = (DVec2, DVec3)> + Clone) -> Self {
        let count = values.clone().count() as f64;
        let mean = values.clone().map(|(_, v)| v).sum::<DVec3>() / count;
        let (mut x, mut y, mut square) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for (place, value) in values {
            let off = place - 0.5;
            x += value * off.x;
            y += value * off.y;
            square += off.x * off.x;
        }
        let (x, y) = (x / square, y / square);
        Self {
            constant: mean - 0.5 * (x + y),
            x,
            y,
        }
    }
}
