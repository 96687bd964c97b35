//! Two looks at a scene, from where two eyes would be: the sensor is moved to both sides along its own horizontal axis,
//! by half the distance between the eyes. Both look the same way (their axes are parallel), so that a pinhole camera whose
//! focal length is f pixels sees a point at depth z by f·d/z pixels further left with the right eye than with the left one, and what
//! is infinitely far at one place with both.

use clap::ValueEnum;
use etendue::description::{Description, NodeId, Value};
use etendue::error::{Error, Result};
use glam::{DMat4, DVec3};

/// One of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Eye {
    /// The left one
    Left,
    /// The right one
    Right,
}

impl Eye {
    /// As names of files and messages have it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// Moves the sensor to where this eye is, of two that are `distance` apart in units of the scene.
    ///
    /// # Errors
    /// Where the sensor makes no picture for an eye.
    pub(super) fn place(
        self,
        description: &mut Description,
        sensor: NodeId,
        distance: f64,
    ) -> Result<()> {
        let plugin = description.node(sensor).plugin();
        if !matches!(plugin, "perspective" | "thinlens") {
            let error = Error::input(format!("--stereo has no meaning for the sensor {plugin:?}"));
            return Err(error.help("look through a perspective or a thinlens"));
        }
        let right = match self {
            Self::Left => -0.5 * distance,
            Self::Right => 0.5 * distance,
        };
        let moved = |pose: &DMat4| moved(pose, right);
        let value = match description.get(sensor, "to_world") {
            Some(Value::Animation(keyframes)) => {
                let keyframes = keyframes.iter().map(|(time, pose)| (*time, moved(pose)));
                Value::Animation(keyframes.collect())
            }
            Some(Value::Transform(pose)) => Value::Transform(moved(pose)),
            _ => Value::Transform(moved(&DMat4::IDENTITY)),
        };
        description.set(sensor, "to_world", value);
        Ok(())
    }
}

/// The pose moved along its right-hand axis, which is -x: a camera looks along +z, with +y up.
fn moved(pose: &DMat4, right: f64) -> DMat4 {
    let axis: DVec3 = -pose.x_axis.truncate().normalize_or_zero();
    DMat4::from_translation(right * axis) * *pose
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use etendue::description::{Kind, Options};

    use super::*;

    fn origin(eye: Eye, sensor: &str) -> Result<DVec3> {
        let text = format!("<scene version='3.0.0'>{sensor}</scene>");
        let mut scene =
            Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
        let sensor = scene.children_of(scene.root().node_id(), Kind::Sensor)[0];
        eye.place(&mut scene, sensor, 0.5)?;
        Ok(match scene.get(sensor, "to_world") {
            Some(Value::Transform(pose)) => pose.w_axis.truncate(),
            Some(Value::Animation(keyframes)) => keyframes[1].1.w_axis.truncate(),
            other => panic!("{other:?}"),
        })
    }

    #[test]
    fn eyes_stand_apart_on_the_horizontal_axis_however_large_the_camera() {
        let looks = "<lookat origin='1, 2, 3' target='1, 2, 0' up='0, 1, 0'/>";
        let mirrored = format!("<scale x='-3' y='2'/>{looks}");
        for (to_world, sign) in [(looks.to_owned(), 1.0), (mirrored, -1.0)] {
            let sensor = format!(
                "<sensor type='thinlens'><transform name='to_world'>{to_world}</transform></sensor>"
            );
            for (eye, x) in [(Eye::Left, 0.75), (Eye::Right, 1.25)] {
                let origin = origin(eye, &sensor).unwrap();
                let wanted = DVec3::new(1.0 + sign * (x - 1.0), 2.0, 3.0);
                assert!(origin.distance(wanted) < 1e-12, "{eye:?}: {origin}");
            }
        }
        // Without a pose a camera looks along +z, so that its right is -x.
        let still = origin(Eye::Right, "<sensor type='perspective'/>").unwrap();
        assert_eq!(still, DVec3::new(-0.25, 0.0, 0.0));
    }

    #[test]
    fn a_camera_on_its_way_has_eyes_at_every_time() {
        let sensor = "<sensor type='perspective'><animation name='to_world'>
            <transform time='0'><translate x='1'/></transform>
            <transform time='1'><rotate y='1' angle='180'/><translate x='5'/></transform></animation></sensor>";
        let origin = origin(Eye::Left, sensor).unwrap();
        assert!(
            origin.distance(DVec3::new(4.75, 0.0, 0.0)) < 1e-12,
            "{origin}"
        );
    }

    #[test]
    fn what_makes_no_picture_for_an_eye_is_refused() {
        let error = origin(Eye::Left, "<sensor type='orthographic'/>").unwrap_err();
        assert!(error.to_string().contains("orthographic"), "{error}");
    }
}
