//! A camera that goes around a point, as a rule the one that it looks at: its pose is turned about the vertical
//! axis through it. The vertical axis is the axis of the world that is nearest to the camera's own, so that a
//! camera that looks down a little goes around in a level circle.

use etendue::description::{Description, NodeId, Value};
use etendue::math::Moving;
use etendue::shape::Bounds;
use glam::{DMat4, DVec3, DVec4};

/// The point that a sensor looks at: the target of its `<lookat>`, else the centre of the scene's `bounds`, the origin
/// of a scene without any.
pub(super) fn pivot(description: &Description, sensor: NodeId, bounds: &Bounds) -> DVec3 {
    let center = || match bounds.is_empty() {
        true => DVec3::ZERO,
        false => 0.5 * (bounds.min.as_dvec3() + bounds.max.as_dvec3()),
    };
    let target = description.target(sensor, "to_world");
    target.unwrap_or_else(center)
}

/// A way around a point, counter-clockwise as seen from above.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orbit {
    pub(super) center: DVec3,
    /// How far it has come when the shutter opens, or at the frame's time; 1 is all around.
    pub(super) turns: f64,
    /// Turns in a unit of time.
    pub(super) speed: f64,
    /// When the frame's shutter opens and closes; where absent the camera does not move in a frame.
    pub(super) shutter: Option<(f64, f64)>,
}

/// Between two keyframes of a turn, in turns: the camera goes straight from one to the next, and strays from the circle
/// by 10⁻⁵ of its radius.
const STEP: f64 = 1.0 / 360.0;
/// Keyframes of a frame.
const MOST_STEPS: f64 = 1e4;

impl Orbit {
    /// Puts the sensor on its way.
    pub(super) fn place(&self, description: &mut Description, sensor: NodeId) {
        let begin = self.turns.rem_euclid(1.0);
        let set = |description: &mut Description, value| description.set(sensor, "to_world", value);
        let own = match description.get(sensor, "to_world") {
            Some(Value::Animation(keyframes)) => keyframes.clone(),
            Some(Value::Transform(pose)) => vec![(0.0, *pose)],
            _ => vec![(0.0, DMat4::IDENTITY)],
        };
        let first = own[0].1;
        let turn = |turns: f64| rotation(&first, self.center, turns);
        let moves = self.shutter.filter(|(open, close)| open < close);
        let Some((open, close)) = moves else {
            let turned = own.iter().map(|(time, pose)| (*time, turn(begin) * *pose));
            match own.len() {
                1 if begin == 0.0 => {}
                1 => set(description, Value::Transform(turn(begin) * first)),
                _ => set(description, Value::Animation(turned.collect())),
            }
            return;
        };
        let steps = (self.speed * (close - open) / STEP)
            .ceil()
            .clamp(1.0, MOST_STEPS);
        let step = |step: u32| open + (close - open) * f64::from(step) / steps;
        let mut times: Vec<f64> = (0..=steps as u32).map(step).collect();
        let keys = own.iter().map(|(time, _)| *time);
        times.extend(keys.filter(|time| open < *time && *time < close));
        times.sort_by(f64::total_cmp);
        times.dedup();
        let moving = match own.len() {
            1 => None,
            _ => Moving::new(&own).ok(),
        };
        let keyframe = |time: f64| {
            let pose = match &moving {
                Some(moving) => {
                    let pose = moving.at(time as f32);
                    DMat4::from_mat3_translation(
                        pose.linear().as_dmat3(),
                        pose.translation().as_dvec3(),
                    )
                }
                None => first,
            };
            (time, turn(begin + self.speed * (time - open)) * pose)
        };
        let keyframes = times.into_iter().map(keyframe);
        set(description, Value::Animation(keyframes.collect()));
    }
}

fn rotation(pose: &DMat4, center: DVec3, turns: f64) -> DMat4 {
    let angle = turns * std::f64::consts::TAU;
    DMat4::from_translation(center)
        * DMat4::from_axis_angle(vertical(pose.y_axis), angle)
        * DMat4::from_translation(-center)
}

/// The axis of the world nearest to a camera's own vertical.
fn vertical(up: DVec4) -> DVec3 {
    [DVec3::Y, DVec3::Z, DVec3::X]
        .into_iter()
        .flat_map(|axis| [axis, -axis])
        .max_by(|a, b| {
            let [a, b] = [a, b].map(|axis| axis.dot(up.truncate()));
            a.total_cmp(&b)
        })
        .unwrap_or(DVec3::Y)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use etendue::description::{Kind, Options};
    use glam::Vec3;

    use super::*;

    fn orbit(center: DVec3, turns: f64, shutter: Option<(f64, f64)>) -> Orbit {
        Orbit {
            center,
            turns,
            speed: 1.0,
            shutter,
        }
    }

    #[test]
    fn while_the_shutter_is_open_the_camera_goes_on_around() {
        let text = "<scene version='3.0.0'><sensor type='perspective'><transform name='to_world'>
            <lookat origin='0, 0, 4' target='0, 0, 0' up='0, 1, 0'/></transform></sensor></scene>";
        let mut scene =
            Description::parse(text, Path::new("test.xml"), &Options::default()).unwrap();
        let sensor = scene.children_of(scene.root().node_id(), Kind::Sensor)[0];
        orbit(DVec3::ZERO, 0.25, Some((7.0, 7.25))).place(&mut scene, sensor);
        let Some(Value::Animation(keyframes)) = scene.get(sensor, "to_world") else {
            panic!("it moves")
        };
        let at = |i: usize| (keyframes[i].0, keyframes[i].1.w_axis.truncate());
        let last = keyframes.len() - 1;
        let [first, last] = [at(0), at(last)];
        assert_eq!((first.0, last.0), (7.0, 7.25));
        assert!(first.1.distance(DVec3::new(4.0, 0.0, 0.0)) < 1e-9);
        assert!(last.1.distance(DVec3::new(0.0, 0.0, -4.0)) < 1e-9);
        let moving = Moving::new(keyframes).unwrap();
        let radius = moving.at(7.1234).translation().length();
        assert!((radius - 4.0).abs() < 2e-4, "{radius}");
    }

    /// From z = 4 to z = 6 in a second, on a quarter of a turn: half way it is 5 from the middle, and has turned by 45°.
    #[test]
    fn a_camera_that_moves_goes_around_while_it_does() {
        let text = "<scene version='3.0.0'><sensor type='perspective'><animation name='to_world'>
            <transform time='0'><lookat origin='0, 0, 4' target='0, 0, 0' up='0, 1, 0'/></transform>
            <transform time='1'><lookat origin='0, 0, 6' target='0, 0, 0' up='0, 1, 0'/></transform>
            </animation></sensor></scene>";
        let mut scene =
            Description::parse(text, Path::new("test.xml"), &Options::default()).unwrap();
        let sensor = scene.children_of(scene.root().node_id(), Kind::Sensor)[0];
        let orbit = Orbit {
            speed: 0.25,
            ..orbit(DVec3::ZERO, 0.0, Some((0.0, 1.0)))
        };
        orbit.place(&mut scene, sensor);
        let Some(Value::Animation(keyframes)) = scene.get(sensor, "to_world") else {
            panic!("it moves")
        };
        let moving = Moving::new(keyframes).unwrap();
        for (time, distance, degrees) in [(0.0, 4.0, 0.0_f32), (0.5, 5.0, 45.0), (1.0, 6.0, 90.0)] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let expected = distance * Vec3::new(sin, 0.0, cos);
            let found = moving.at(time).translation();
            assert!(found.distance(expected) < 1e-3, "{time}: {found}");
        }
    }

    fn turned(to_world: &str, turns: f64) -> DMat4 {
        let text = format!(
            "<scene version='3.0.0'><sensor type='perspective'>{to_world}</sensor></scene>"
        );
        let mut scene =
            Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
        let sensor = scene.children_of(scene.root().node_id(), Kind::Sensor)[0];
        let bounds = Bounds {
            min: Vec3::new(0.0, -5.0, -1.0),
            max: Vec3::new(2.0, 5.0, 1.0),
        };
        let center = pivot(&scene, sensor, &bounds);
        orbit(center, turns, None).place(&mut scene, sensor);
        match scene.get(sensor, "to_world") {
            Some(Value::Transform(pose)) => *pose,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_camera_that_looks_down_goes_around_in_a_level_circle() {
        let to_world = "<transform name='to_world'><lookat origin='1, 4, 6' target='1, 0, 0' up='0, 1, 0'/></transform>";
        let still = turned(to_world, 0.0);
        for quarter in 1..8 {
            let pose = turned(to_world, f64::from(quarter) / 4.0);
            let origin = pose.w_axis.truncate();
            let expected = [
                DVec3::new(1.0, 4.0, 6.0),
                DVec3::new(7.0, 4.0, 0.0),
                DVec3::new(1.0, 4.0, -6.0),
                DVec3::new(-5.0, 4.0, 0.0),
            ][quarter as usize % 4];
            assert!((origin - expected).length() < 1e-9, "{quarter}: {origin}");
            assert!((pose.y_axis.y - still.y_axis.y).abs() < 1e-12);
        }
    }

    #[test]
    fn what_is_up_for_the_camera_is_up_for_the_turn() {
        let to_world = "<transform name='to_world'><lookat origin='1, 6, 2' target='1, 0, 0' up='0, 0, 1'/></transform>";
        let origin = turned(to_world, 0.5).w_axis.truncate();
        assert!((origin - DVec3::new(1.0, -6.0, 2.0)).length() < 1e-9);
    }

    #[test]
    fn the_pivot_is_what_the_camera_looks_at_wherever_the_scene_is() {
        let to_world =
            "<transform name='to_world'><lookat origin='5, 0, 3' target='5, 0, -1' up='0, 1, 0'/>
            <translate y='2'/></transform>";
        let origin = turned(to_world, 0.5).w_axis.truncate();
        assert!(
            (origin - DVec3::new(5.0, 2.0, -5.0)).length() < 1e-9,
            "{origin}"
        );
    }

    #[test]
    fn a_camera_without_a_pose_turns_too() {
        let origin = turned("", 0.5).w_axis.truncate();
        assert!((origin - DVec3::new(2.0, 0.0, 0.0)).length() < 1e-9);
    }
}
