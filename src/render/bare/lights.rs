//! The lights of a glTF file as emitters. Their units are candela and lux, and a radiance of 1 is taken for 1 cd/m², as
//! viewers do: white paper at right angles to one lux has the radiance 1/π. A spot fades from its inner to its outer cone,
//! linearly in the angle as Mitsuba's does; the extension leaves the curve to who renders.

use std::f64::consts::PI;
use std::fmt::Write as _;

use glam::{DVec3, Vec3};

use super::staging::placed;
use crate::mesh::{GltfLight, GltfLightKind};

/// A light's position, direction, and an axis beside that.
type Place = [DVec3; 3];

/// The lights at some `moments`, or once where there are none, as a scene file says them.
pub(super) fn emitters(lights: &[Vec<GltfLight>], moments: &[f32]) -> String {
    let mut text = String::new();
    for (number, light) in lights[0].iter().enumerate() {
        let [r, g, b] = light.intensity;
        let (mut places, mut beside) = (
            Vec::<Place>::new(),
            light.direction.any_orthonormal_vector(),
        );
        for light in lights.iter().filter_map(|lights| lights.get(number)) {
            let (at, d) = (light.position, light.direction);
            // Turned no more than the direction is.
            let turned = beside.reject_from_normalized(d).try_normalize();
            beside = turned.unwrap_or_else(|| d.any_orthonormal_vector());
            places.push([at, d, beside]);
        }
        let to_world = |one: fn(&Place) -> String| placed(&places, moments, one);
        let _ = match light.kind {
            GltfLightKind::Point => {
                let to_world = to_world(|[at, ..]| {
                    format!(r#"<translate x="{}" y="{}" z="{}"/>"#, at.x, at.y, at.z)
                });
                write!(
                    text,
                    r#"
    <emitter type="point">
        <rgb name="intensity" value="{r}, {g}, {b}"/>
        {to_world}
    </emitter>"#
                )
            }
            GltfLightKind::Directional => {
                let to_world = to_world(|[_, d, beside]| lookat(DVec3::ZERO, *d, *beside));
                write!(
                    text,
                    r#"
    <emitter type="directional">
        <rgb name="irradiance" value="{r}, {g}, {b}"/>
        {to_world}
    </emitter>"#
                )
            }
            GltfLightKind::Spot { inner, outer } => {
                let to_world = to_world(|[at, d, beside]| lookat(*at, *at + *d, *beside));
                // A beam as wide as the cutoff would have no edge to fade along.
                let beam = inner.min(0.999 * outer).to_degrees();
                write!(
                    text,
                    r#"
    <emitter type="spot">
        <rgb name="intensity" value="{r}, {g}, {b}"/>
        <float name="cutoff_angle" value="{}"/>
        <float name="beam_width" value="{beam}"/>
        {to_world}
    </emitter>"#,
                    outer.to_degrees()
                )
            }
        };
    }
    text
}

fn lookat(origin: DVec3, target: DVec3, up: DVec3) -> String {
    let [origin, target, up] = [origin, target, up].map(|p| format!("{}, {}, {}", p.x, p.y, p.z));
    format!(r#"<lookat origin="{origin}" target="{target}" up="{up}"/>"#)
}

/// What to say where white paper in the middle of the mesh would be far darker or brighter than a picture's white.
pub(super) fn warning(lights: &[GltfLight], center: Vec3, radius: f32) -> Option<String> {
    let illuminance = |light: &GltfLight| {
        let strength = light.intensity.into_iter().fold(0.0, f64::max);
        let nearest = f64::from(radius).powi(2);
        let squared = center.as_dvec3().distance_squared(light.position);
        match light.kind {
            GltfLightKind::Directional => strength,
            GltfLightKind::Point | GltfLightKind::Spot { .. } => strength / squared.max(nearest),
        }
    };
    let lux: f64 = lights.iter().map(illuminance).sum();
    let radiance = lux / PI;
    (!(0.02..=20.0).contains(&radiance)).then(|| {
        format!(
            "the file's lights give about {lux:.2e} lux, by which white has the radiance {radiance:.2e}: --exposure auto \
             makes a picture of it"
        )
    })
}
