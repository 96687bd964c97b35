//! The lights of a glTF file as emitters. Their units are candela and lux, and a radiance of 1 is taken for 1 cd/m², as
//! viewers do: white paper at right angles to one lux has the radiance 1/π. A spot fades from its inner to its outer cone,
//! linearly in the angle as Mitsuba's does; the extension leaves the curve to who renders.

use std::f64::consts::PI;
use std::fmt::Write as _;

use glam::Vec3;

use crate::mesh::{GltfLight, GltfLightKind};

/// The lights as a scene file says them.
pub(super) fn emitters(lights: &[GltfLight]) -> String {
    let mut text = String::new();
    for light in lights {
        let [r, g, b] = light.intensity;
        let (p, d) = (light.position, light.direction);
        let _ = match light.kind {
            GltfLightKind::Point => write!(
                text,
                r#"
    <emitter type="point">
        <point name="position" value="{}, {}, {}"/>
        <rgb name="intensity" value="{r}, {g}, {b}"/>
    </emitter>"#,
                p.x, p.y, p.z
            ),
            GltfLightKind::Directional => write!(
                text,
                r#"
    <emitter type="directional">
        <vector name="direction" value="{}, {}, {}"/>
        <rgb name="irradiance" value="{r}, {g}, {b}"/>
    </emitter>"#,
                d.x, d.y, d.z
            ),
            GltfLightKind::Spot { inner, outer } => {
                let (target, up) = (p + d, d.any_orthonormal_vector());
                // A beam as wide as the cutoff would have no edge to fade along.
                let beam = inner.min(0.999 * outer).to_degrees();
                write!(
                    text,
                    r#"
    <emitter type="spot">
        <rgb name="intensity" value="{r}, {g}, {b}"/>
        <float name="cutoff_angle" value="{}"/>
        <float name="beam_width" value="{beam}"/>
        <transform name="to_world">
            <lookat origin="{}, {}, {}" target="{}, {}, {}" up="{}, {}, {}"/>
        </transform>
    </emitter>"#,
                    outer.to_degrees(),
                    p.x,
                    p.y,
                    p.z,
                    target.x,
                    target.y,
                    target.z,
                    up.x,
                    up.y,
                    up.z
                )
            }
        };
    }
    text
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
