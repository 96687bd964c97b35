//! Where the camera of a bare mesh stands: as near as it can without leaving anything out.

use glam::{DVec3, Vec3};

use super::staging::Staging;

/// The film's part that the mesh may fill.
const FILLED: f64 = 0.92;

/// The smaller field of view in degrees, unless asked for.
pub(super) const FOV: f32 = 30.0;

/// Degrees to the right of the front, and above the horizon, unless asked for.
const AZIMUTH: f32 = 27.0;
const ELEVATION: f32 = 19.0;

/// Where a camera stands, where it looks, and which way is up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) eye: DVec3,
    pub(super) target: DVec3,
    pub(super) up: DVec3,
    /// To the right of who stands at the front, and toward them, about which the lamp is placed: it goes around with the
    /// camera.
    pub(super) right: Vec3,
    pub(super) front: Vec3,
}

/// Frames those of some points that lie between `min` and `max`.
pub(super) fn pose(points: &[Vec3], (min, max): (Vec3, Vec3), staging: &Staging) -> Pose {
    let (center, radius) = ball(min, max);
    // Vertices of no triangle may lie anywhere.
    let vertices = points
        .iter()
        .filter(|p| p.cmpge(min).all() && p.cmple(max).all());
    let up = staging.up.direction().as_dvec3();
    let (front, right) = (staging.up.front().as_dvec3(), DVec3::X);
    let azimuth = f64::from(staging.azimuth.unwrap_or(AZIMUTH)).to_radians();
    let elevation = f64::from(staging.elevation.unwrap_or(ELEVATION)).to_radians();
    let level = azimuth.sin() * right + azimuth.cos() * front;
    let toward_eye = elevation.cos() * level + elevation.sin() * up;
    // Straight from above, the front is below in the image.
    let upright = elevation.cos() * up - elevation.sin() * level;
    let forward = -toward_eye;
    let sideways = forward.cross(upright);
    let center = center.as_dvec3();
    let half = f64::from(staging.fov.unwrap_or(FOV)).to_radians() / 2.0;
    let aspect = staging.aspect();
    let tangents = [
        half.tan() * aspect.max(1.0),
        half.tan() * (1.0 / aspect).max(1.0),
    ];
    let film = tangents.map(|tangent| FILLED * tangent);
    let place = |p: &Vec3| {
        let p = p.as_dvec3() - center;
        [p.dot(sideways), p.dot(upright), p.dot(forward)]
    };
    let radius = f64::from(radius);
    let at = staging.target.map(|target| target - center);
    let (aside, depth) = match (at, staging.all_around) {
        (None, true) => ([0.0; 2], -radius / half.sin()),
        (Some(target), _) => {
            let aside = [target.dot(sideways), target.dot(upright)];
            let nearest = vertices.map(|p| {
                let place = place(p);
                let back = |axis: usize| (place[axis] - aside[axis]).abs() / film[axis];
                place[2] - back(0).max(back(1))
            });
            (aside, nearest.fold(f64::INFINITY, f64::min))
        }
        (None, false) => tight(vertices.map(place), film),
    };
    // What is seen from its edge still is not touched.
    let depth = depth.min(at.map_or(0.0, |target| target.dot(forward)) - 0.05 * radius);
    let eye = center + aside[0] * sideways + aside[1] * upright + depth * forward;
    let away = at.map_or(-depth, |target| target.dot(forward) - depth);
    let target = eye + away * forward;
    let distance = f64::from(staging.distance.unwrap_or(1.0));
    let turned = azimuth - f64::from(AZIMUTH).to_radians();
    Pose {
        eye: target - distance * away * forward,
        target,
        up: upright,
        right: (turned.cos() * right - turned.sin() * front).as_vec3(),
        front: (turned.sin() * right + turned.cos() * front).as_vec3(),
    }
}

/// The centre and the radius of the ball around a box.
pub(super) fn ball(min: Vec3, max: Vec3) -> (Vec3, f32) {
    let radius = 0.5 * (max - min).length();
    (0.5 * (min + max), radius.max(f32::MIN_POSITIVE))
}

/// How far aside (in x and y) and at which depth a camera sees all of some points within these tangents, and is nearest.
///
/// A point is within the left and the right side of what is seen where |x − c| ≤ t·(z − d), so that the greatest x − t·z and
/// the least x + t·z bound c + t·d and c − t·d; likewise for y. The one of the two that is further away decides d, and
/// the other is put in the middle.
fn tight(points: impl Iterator<Item = [f64; 3]>, tangents: [f64; 2]) -> ([f64; 2], f64) {
    let mut bounds = [[f64::NEG_INFINITY, f64::INFINITY]; 2];
    for point in points {
        for (axis, [low, high]) in bounds.iter_mut().enumerate() {
            let slant = tangents[axis] * point[2];
            *low = low.max(point[axis] - slant);
            *high = high.min(point[axis] + slant);
        }
    }
    let depth = |axis: usize| (bounds[axis][1] - bounds[axis][0]) / (2.0 * tangents[axis]);
    let aside = bounds.map(|[low, high]| 0.5 * (low + high));
    (aside, depth(0).min(depth(1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random;
    use crate::mesh::Mesh;

    fn cloud(stretch: Vec3) -> Mesh {
        let number = |i: u32| random::unit(random::bits(3, i)) - 0.5;
        let place =
            |i: u32| Vec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2)) * stretch;
        let points = (0..500).map(|i| place(i) + Vec3::new(7.0, -3.0, 2.0));
        // The last is one of no triangle.
        Mesh {
            positions: points.chain([Vec3::splat(1e6)]).collect(),
            triangles: (0..498).map(|i| [i, i + 1, i + 2]).collect(),
            ..Mesh::default()
        }
    }

    /// Points on the film, whose edges are at ±1.
    fn seen(mesh: &Mesh, pose: &Pose, staging: &Staging) -> Vec<[f64; 2]> {
        let forward = (pose.target - pose.eye).normalize();
        let sideways = forward.cross(pose.up).normalize();
        let half = f64::from(staging.fov.unwrap_or(FOV)).to_radians() / 2.0;
        let aspect = staging.aspect();
        let tangents = [
            half.tan() * aspect.max(1.0),
            half.tan() * (1.0 / aspect).max(1.0),
        ];
        let on_film = |p: &Vec3| {
            let p = p.as_dvec3() - pose.eye;
            assert!(p.dot(forward) > 0.0);
            [p.dot(sideways), p.dot(pose.up)].map(|v| v / p.dot(forward))
        };
        let scaled = |[x, y]: [f64; 2]| [x / tangents[0], y / tangents[1]];
        mesh.positions[..500]
            .iter()
            .map(on_film)
            .map(scaled)
            .collect()
    }

    #[test]
    fn all_of_the_mesh_is_seen_and_it_touches_two_edges() {
        for stretch in [
            Vec3::ONE,
            Vec3::new(10.0, 0.1, 1.0),
            Vec3::new(0.01, 5.0, 0.3),
        ] {
            let mesh = cloud(stretch);
            for (up, size, fov) in [
                (super::super::UpAxis::Y, [4, 3], None),
                (super::super::UpAxis::Z, [1, 2], Some(60.0)),
            ] {
                for angles in [
                    None,
                    Some((0.0, 0.0)),
                    Some((200.0, 90.0)),
                    Some((-35.0, -60.0)),
                ] {
                    let staging = Staging {
                        up,
                        size,
                        fov,
                        azimuth: angles.map(|a| a.0),
                        elevation: angles.map(|a| a.1),
                        ..Staging::default()
                    };
                    let points = seen(
                        &mesh,
                        &pose(&mesh.positions, mesh.bounds().unwrap(), &staging),
                        &staging,
                    );
                    let least =
                        |c: usize| points.iter().map(|p| p[c]).fold(f64::INFINITY, f64::min);
                    let most = |c: usize| {
                        points
                            .iter()
                            .map(|p| p[c])
                            .fold(f64::NEG_INFINITY, f64::max)
                    };
                    let edges = [0, 1].map(|c| [least(c), most(c)]);
                    let within = edges.iter().flatten().all(|e| e.abs() < FILLED + 1e-3);
                    let touched = edges.iter().any(|[low, high]| {
                        (low + FILLED).abs() < 1e-3 && (high - FILLED).abs() < 1e-3
                    });
                    assert!(within && touched, "{stretch} {up:?} {angles:?}: {edges:?}");
                }
            }
        }
    }

    #[test]
    fn a_target_is_in_the_middle_and_distances_are_multiples() {
        let mesh = cloud(Vec3::ONE);
        let target = DVec3::new(7.2, -3.1, 2.2);
        let mut staging = Staging {
            target: Some(target),
            ..Staging::default()
        };
        let near = pose(&mesh.positions, mesh.bounds().unwrap(), &staging);
        assert!(near.target.distance(target) < 1e-9, "{near:?}");
        let points = seen(&mesh, &near, &staging);
        let most = points
            .iter()
            .flatten()
            .fold(0.0_f64, |most, v| most.max(v.abs()));
        assert!((most - FILLED).abs() < 1e-3, "{most}");
        staging.distance = Some(2.0);
        let far = pose(&mesh.positions, mesh.bounds().unwrap(), &staging);
        let ratio = far.eye.distance(target) / near.eye.distance(target);
        assert!((ratio - 2.0).abs() < 1e-9, "{ratio}");
    }
}
