//! Point, spot and directional lights (the extension `KHR_lights_punctual`) in their places in the world.

use glam::{DMat4, DVec3};
use serde::Deserialize;
use serde_json::Value;

use super::json::{Root, at};
use super::stage::Stage;
use super::{GltfLight, GltfLightKind, Notes, OrWhy};

/// What the extension says at the top of the file.
#[derive(Deserialize, Default)]
#[serde(default)]
struct Lights {
    lights: Vec<Light>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Light {
    #[serde(rename = "type")]
    kind: String,
    /// Linear red, green and blue.
    color: Option<[f64; 3]>,
    /// Candela; of a directional light lux.
    intensity: Option<f64>,
    range: Option<f64>,
    spot: Spot,
}

/// Angles from the axis, in radians.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct Spot {
    inner_cone_angle: f64,
    outer_cone_angle: Option<f64>,
}

/// The lights of a scene, in the order of its nodes; `None` in place of what cannot shine.
pub(super) fn placed(
    root: &Root<'_>,
    stage: &Stage<'_>,
    notes: &mut Notes,
) -> OrWhy<Vec<Option<GltfLight>>> {
    if stage.lights.is_empty() {
        return Ok(Vec::new());
    }
    let extension = root.extensions.lights.clone().unwrap_or(Value::Null);
    let file: Lights = match extension {
        Value::Null => Lights::default(),
        value => serde_json::from_value(value)
            .map_err(|e| format!("KHR_lights_punctual is malformed: {e}"))?,
    };
    let mut lights = Vec::new();
    for (index, to_world) in &stage.lights {
        let light = at(&file.lights, *index, "light")?;
        let placed = light.placed(to_world, notes);
        lights.push(placed.map_err(|why| format!("light {index}: {why}"))?);
    }
    Ok(lights)
}

impl Light {
    /// `None` where it gives no light, or is of a kind that is left out.
    fn placed(&self, to_world: &DMat4, notes: &mut Notes) -> OrWhy<Option<GltfLight>> {
        let kind = match self.kind.as_str() {
            "point" => GltfLightKind::Point,
            "directional" => GltfLightKind::Directional,
            "spot" => self.spot.kind()?,
            _ => {
                notes.add("lights of unknown kinds are left out (KHR_lights_punctual)");
                return Ok(None);
            }
        };
        let strength = self.intensity.unwrap_or(1.0);
        let color = self.color.unwrap_or([1.0; 3]);
        if strength < 0.0 || color.iter().any(|part| *part < 0.0) {
            return Err("its intensity or its colour is negative".to_owned());
        }
        if strength == 0.0 || color == [0.0; 3] {
            return Ok(None);
        }
        let axis = to_world.transform_vector3(DVec3::NEG_Z).try_normalize();
        let Some(direction) = axis.filter(|_| to_world.is_finite()) else {
            notes.add("lights of nodes without an extent are left out (KHR_lights_punctual)");
            return Ok(None);
        };
        if self.range.is_some() {
            notes.add("lights reach beyond their range (KHR_lights_punctual)");
        }
        Ok(Some(GltfLight {
            position: to_world.transform_point3(DVec3::ZERO),
            direction,
            intensity: color.map(|part| part * strength),
            kind,
        }))
    }
}

impl Spot {
    fn kind(&self) -> OrWhy<GltfLightKind> {
        let outer = self.outer_cone_angle.unwrap_or(std::f64::consts::FRAC_PI_4);
        let inner = self.inner_cone_angle;
        if !(inner >= 0.0 && inner <= outer && outer > 0.0) || outer > std::f64::consts::FRAC_PI_2 {
            return Err(format!(
                "innerConeAngle {inner} and outerConeAngle {outer} are not between 0 and π/2, or not in this order"
            ));
        }
        Ok(GltfLightKind::Spot { inner, outer })
    }
}
