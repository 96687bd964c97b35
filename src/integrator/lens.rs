//! The sensor as light finds it: where a path from a light is connected with it.

use glam::Vec2;

use super::Context;
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Mask as _, Vec3};
use crate::sensor::{Film, Sensor};

/// A sensor that light finds.
#[derive(Clone, Debug)]
pub struct Lens {
    sensor: Sensor,
    /// The corners of what samples are taken of, on the film.
    corners: [Vec2; 2],
}

/// Connections of points in lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Connections<F: Lanes> {
    /// Those that are.
    pub(super) found: F::Mask,
    /// Where the sensor's rays begin.
    pub(super) target: Vec3<F>,
    /// Toward there.
    pub(super) direction: Vec3<F>,
    /// See [`crate::sensor::Connection`].
    pub(super) density: F,
    /// The places on the film.
    pub(super) film: [F::Row; 2],
}

impl Lens {
    /// `None` of a sensor that light does not find.
    pub fn new(sensor: &Sensor, film: &Film) -> Option<Self> {
        let margin = Vec2::splat(film.margin() as f32);
        let margin = margin / Vec2::new(film.width as f32, film.height as f32);
        sensor.is_found().then(|| Self {
            sensor: sensor.clone(),
            corners: [-margin, Vec2::ONE + margin],
        })
    }

    /// The sensor that an integrator asks light to find.
    pub(super) fn wanted(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        context.lens.clone().ok_or_else(|| {
            let message = format!("{} needs a sensor that light finds", properties.plugin());
            let error = properties.error("", message);
            error.help("a perspective, thinlens or orthographic one")
        })
    }

    /// Connections of those points that are `active`, through points of the lens that `u` places.
    #[inline(always)]
    pub(super) fn connect<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        active: F::Mask,
        u: impl Fn(usize) -> Vec2,
    ) -> Connections<F> {
        let positions = at.position.rows();
        let (mut target, mut direction) = ([F::ROW; 3], [F::ROW; 3]);
        let (mut density, mut film, mut found) = (F::ROW, [F::ROW; 2], 0);
        for lane in active.lanes() {
            let from = Vec3::<F>::of(&positions, lane);
            let time = at.source.time(lane);
            let connection = self.sensor.connect(from, u(lane), time);
            let Some(connection) = connection.filter(|found| self.takes(found.film)) else {
                continue;
            };
            found |= 1 << lane;
            for axis in 0..3 {
                target[axis][lane] = connection.target[axis];
                direction[axis][lane] = connection.direction[axis];
            }
            density[lane] = connection.density;
            (film[0][lane], film[1][lane]) = (connection.film.x, connection.film.y);
        }
        Connections {
            found: F::Mask::from_bits(found),
            target: Vec3::<F>::load(&target),
            direction: Vec3::<F>::load(&direction),
            density: F::load(&density),
            film,
        }
    }

    /// Whether samples are taken there, so that light that comes there counts.
    fn takes(&self, film: Vec2) -> bool {
        let [least, end] = self.corners;
        (film.cmpge(least) & film.cmplt(end)).all()
    }

    /// The density of the sensor's rays that have come to the points along `direction` from them.
    #[inline(always)]
    pub(super) fn density<F: Lanes>(&self, at: &Points<'_, F>, direction: Vec3<F>) -> F {
        let (positions, directions) = (at.position.rows(), direction.rows());
        let mut density = F::ROW;
        for lane in at.lanes() {
            let from = Vec3::<F>::of(&positions, lane);
            let toward = Vec3::<F>::of(&directions, lane);
            density[lane] = self.sensor.density(from, toward, at.source.time(lane));
        }
        F::load(&density)
    }

    /// Whether the place on the lens matters.
    pub(super) fn has_lens(&self) -> bool {
        self.sensor.has_lens()
    }
}
