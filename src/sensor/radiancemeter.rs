//! `radiancemeter`: the radiance that arrives along one ray, from `origin` in `direction`, or along the z axis of
//! `to_world`, which goes before both as in Mitsuba. Every pixel shows the same.

use glam::{DVec3, Mat4, Vec2, Vec3};

use super::{Camera, Film};
use crate::description::Properties;
use crate::description::declared::{Plugin, vector};
use crate::error::Result;
use crate::interaction::Ray;
use crate::math::{Frame, Moving, Transform};

/// A single ray.
#[derive(Clone, Debug)]
pub struct RadianceMeter {
    /// From the ray along +z.
    to_world: Moving,
    shutter: (f32, f32),
}

impl RadianceMeter {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the radiance along one ray",
        properties: &[
            &[
                super::TO_WORLD,
                vector("origin", [0.0; 3], "where the ray starts").absent("that of to_world"),
                vector("direction", [0.0, 0.0, 1.0], "where it goes").absent("+z of to_world"),
            ],
            super::COMMON,
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, _film: &Film) -> Result<Self> {
        let origin = properties.given::<DVec3>("origin")?;
        let direction = properties.given::<DVec3>("direction")?;
        let to_world = match (origin, direction) {
            _ if properties.has("to_world") => properties.motion("to_world")?,
            (None, None) => Moving::IDENTITY,
            (Some(origin), Some(direction)) => {
                let z = unit(properties, direction)?;
                let frame = Frame::around(z.as_vec3());
                let column = |axis: Vec3| axis.as_dvec3().extend(0.0);
                let matrix = glam::DMat4::from_cols(
                    column(frame.s),
                    column(frame.t),
                    z.extend(0.0),
                    origin.extend(1.0),
                );
                Moving::Still(Transform::new(&matrix).expect("a frame can be inverted"))
            }
            _ => {
                return Err(properties.error("", "a ray needs both its origin and its direction"));
            }
        };
        Ok(Self {
            to_world,
            shutter: super::shutter(properties)?,
        })
    }
}

/// The property `direction`, made to unit length.
pub(super) fn unit(properties: &Properties<'_>, direction: DVec3) -> Result<DVec3> {
    match direction.normalize_or_zero() {
        DVec3::ZERO => Err(properties.error("direction", "a direction cannot have length 0")),
        direction => Ok(direction),
    }
}

impl Camera for RadianceMeter {
    fn ray(&self, _film: Vec2, _lens: Vec2, time: f32) -> Ray {
        let to_world = self.to_world.at(time);
        Ray {
            origin: to_world.translation(),
            direction: to_world.vector(Vec3::Z).normalize(),
            t_max: f32::INFINITY,
            time,
        }
    }

    fn is_projective(&self) -> bool {
        false
    }

    fn neighbours(&self, ray: &Ray, _step: Vec2) -> [Ray; 2] {
        [*ray; 2]
    }

    fn world_to_camera(&self, time: f32) -> Mat4 {
        super::inverse(&self.to_world, time)
    }

    fn projection(&self) -> Mat4 {
        Mat4::IDENTITY
    }

    fn shutter(&self) -> (f32, f32) {
        self.shutter
    }
}
