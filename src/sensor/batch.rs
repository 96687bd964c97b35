//! `batch`: several sensors side by side on one film, each on a stripe of the same width, in file order. The film, the
//! sampler and the shutter are the batch's own. A nested shape stands for the sensor that stands in it.

use glam::{Mat4, Vec2};

use super::{Camera, Film, Sensor};
use crate::description::declared::{Plugin, nested};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::Ray;
use crate::shape::Bounds;

/// Sensors side by side.
#[derive(Clone, Debug)]
pub struct Batch {
    /// At least one, from left to right.
    sensors: Vec<Sensor>,
    shutter: (f32, f32),
}

impl Batch {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "several sensors side by side on one film",
        properties: &[
            &[
                nested(Kind::Sensor, "from left to right"),
                nested(Kind::Shape, "such as a sensor stands in"),
                super::TO_WORLD.without_effect(),
            ],
            super::COMMON,
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, film: &Film) -> Result<Self> {
        let mut children = Vec::new();
        for child in properties.all().iter().filter_map(|p| properties.held(p)) {
            match child.kind() {
                Kind::Sensor if child.plugin() == "batch" => {
                    return Err(child.error("", "a batch cannot hold a batch"));
                }
                Kind::Sensor => children.push(child),
                Kind::Shape => match child.child(Kind::Sensor)? {
                    Some(sensor) => children.push(sensor),
                    None => return Err(child.error("", "no sensor stands in this shape")),
                },
                _ => {}
            }
        }
        let count = children.len() as u32;
        if count == 0 || !film.width.is_multiple_of(count) {
            let message = match count {
                0 => "a batch needs a nested sensor".to_owned(),
                _ => format!("{} pixels cannot be shared by {count} sensors", film.width),
            };
            return Err(properties
                .error("", message)
                .help("the film's width is a multiple of the number of sensors"));
        }
        let part = Film {
            width: film.width / count,
            ..film.clone()
        };
        let sensors = children.iter().map(|child| Sensor::build(child, &part));
        Ok(Self {
            sensors: sensors.collect::<Result<_>>()?,
            shutter: super::shutter(properties)?,
        })
    }

    pub(super) fn enclose(&mut self, scene: Bounds) {
        self.sensors
            .iter_mut()
            .for_each(|sensor| sensor.enclose(scene));
    }

    /// The sensor that a place on the film belongs to, and the place on that one's part.
    fn part(&self, film: Vec2) -> (&Sensor, Vec2) {
        let count = self.sensors.len();
        let x = film.x * count as f32;
        let index = (x.max(0.0) as usize).min(count - 1);
        (&self.sensors[index], Vec2::new(x - index as f32, film.y))
    }
}

impl Camera for Batch {
    fn ray(&self, film: Vec2, lens: Vec2, time: f32) -> Ray {
        let (sensor, place) = self.part(film);
        sensor.ray(place, lens, time)
    }

    fn has_lens(&self) -> bool {
        self.sensors.iter().any(|sensor| sensor.has_lens())
    }

    fn is_projective(&self) -> bool {
        false
    }

    fn weight(&self, film: Vec2) -> f32 {
        let (sensor, place) = self.part(film);
        sensor.weight(place)
    }

    fn neighbours(&self, ray: &Ray, _step: Vec2) -> [Ray; 2] {
        [*ray; 2]
    }

    /// Of the first.
    fn world_to_camera(&self, time: f32) -> Mat4 {
        self.sensors[0].world_to_camera(time)
    }

    /// Of the first.
    fn projection(&self) -> Mat4 {
        self.sensors[0].projection()
    }

    fn shutter(&self) -> (f32, f32) {
        self.shutter
    }
}
