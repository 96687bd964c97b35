//! `distant`: the radiance that leaves the scene against `direction` (or the z axis of `to_world`), as from infinitely
//! far, averaged over where rays aim: the disc across the sphere around the scene, or the `target`, which is a point or
//! a nested shape whose surface is drawn evenly. Rays start outside of the scene. Every pixel shows the same.

use std::sync::Arc;

use glam::{DVec3, Mat4, Vec2, Vec3};

use super::radiancemeter::unit;
use super::{Camera, Film};
use crate::description::declared::{Plugin, vector};
use crate::description::{Kind, Properties, Value};
use crate::error::{Error, Result};
use crate::interaction::Ray;
use crate::lanes::warp;
use crate::math::{Frame, Moving};
use crate::shape::{self, Bounds, Geometry};

/// Parallel rays.
#[derive(Clone, Debug)]
pub struct Distant {
    direction: Direction,
    target: Target,
    shutter: (f32, f32),
    /// The sphere around the scene.
    center: Vec3,
    radius: f32,
}

/// Where rays go, unit length.
#[derive(Clone, Debug)]
enum Direction {
    Still(Vec3),
    /// Along the z axis.
    Moving(Moving),
}

/// Where rays aim.
#[derive(Clone, Debug)]
enum Target {
    Scene,
    Point(Vec3),
    Shape(Arc<Geometry>),
}

impl Distant {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the radiance that leaves the scene in one direction",
        properties: &[
            &[
                super::TO_WORLD,
                vector("direction", [0.0, 0.0, 1.0], "where rays go").absent("+z of to_world"),
                vector(
                    "target",
                    [0.0; 3],
                    "where rays aim: a point, or a nested shape",
                )
                .absent("the disc across the sphere around the scene"),
            ],
            super::COMMON,
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, _film: &Film) -> Result<Self> {
        let direction = match properties.given::<DVec3>("direction")? {
            Some(_) if properties.has("to_world") => {
                return Err(
                    properties.error("direction", "direction and to_world exclude each other")
                );
            }
            Some(direction) => Direction::Still(unit(properties, direction)?.as_vec3()),
            None => Direction::Moving(properties.motion("to_world")?),
        };
        let target = match properties.value("target").map(|property| &property.value) {
            None => Target::Scene,
            Some(Value::Object(_)) => {
                let shape = properties.object("target")?.expect("it is an object");
                Target::Shape(surface(properties, &shape)?)
            }
            Some(_) => Target::Point(properties.vector("target")?.as_vec3()),
        };
        Ok(Self {
            direction,
            target,
            shutter: super::shutter(properties)?,
            center: Vec3::ZERO,
            radius: 1.0,
        })
    }

    pub(super) fn enclose(&mut self, scene: Bounds) {
        if scene.is_empty() || scene.is_unbounded() {
            return;
        }
        self.center = 0.5 * (scene.min + scene.max);
        // With room for rounding.
        self.radius = 1.0001 * self.center.distance(scene.max).max(f32::MIN_POSITIVE);
    }
}

/// The surface of a shape that stands still and can be drawn evenly.
pub(super) fn surface(sensor: &Properties<'_>, shape: &Properties<'_>) -> Result<Arc<Geometry>> {
    if shape.kind() != Kind::Shape {
        let message = format!("expected a point or a shape, found a {}", shape.kind());
        return Err(sensor.error("target", message));
    }
    let fails = |message: &str| {
        let name = shape.plugin();
        let error = Error::unsupported(format!("a sensor cannot measure a {name} {message}"));
        error
            .at(shape.location())
            .related(sensor.location(), "the sensor")
    };
    let declared = shape::declared(shape)?;
    if declared.animation("to_world")?.is_some() {
        return Err(fails("that moves"));
    }
    let geometry = shape::build(shape)?.geometry;
    if geometry.evenly(Vec2::splat(0.5)).is_none() {
        return Err(fails("whose surface cannot be drawn evenly"));
    }
    Ok(Arc::new(geometry))
}

impl Camera for Distant {
    fn ray(&self, _film: Vec2, lens: Vec2, time: f32) -> Ray {
        let direction = match &self.direction {
            Direction::Still(direction) => *direction,
            Direction::Moving(moving) => moving.at(time).vector(Vec3::Z).normalize(),
        };
        let origin = match &self.target {
            Target::Scene => {
                let p = Vec2::from(warp::concentric_disk::<f32>(lens.into()));
                let across = Frame::around(direction).to_world(p.extend(0.0));
                self.center + (across - direction) * self.radius
            }
            Target::Point(point) => *point - 2.0 * self.radius * direction,
            Target::Shape(shape) => {
                let point = shape
                    .evenly(lens)
                    .map_or(self.center, |point| point.position);
                point - 2.0 * self.radius * direction
            }
        };
        Ray {
            origin,
            direction,
            t_max: f32::INFINITY,
            time,
        }
    }

    fn has_lens(&self) -> bool {
        !matches!(self.target, Target::Point(_))
    }

    fn is_projective(&self) -> bool {
        false
    }

    fn neighbours(&self, ray: &Ray, _step: Vec2) -> [Ray; 2] {
        [*ray; 2]
    }

    fn world_to_camera(&self, time: f32) -> Mat4 {
        match &self.direction {
            Direction::Still(direction) => {
                let Frame { s, t, n } = Frame::around(*direction);
                Mat4::from_mat3(glam::Mat3::from_cols(s, t, n).transpose())
            }
            Direction::Moving(moving) => super::inverse(moving, time),
        }
    }

    fn projection(&self) -> Mat4 {
        Mat4::IDENTITY
    }

    fn shutter(&self) -> (f32, f32) {
        self.shutter
    }
}
