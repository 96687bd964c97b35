//! Scenes of versions below 2.0 wrote property names in camel case and placed textures by offsets and
//! scales; both become what the current version says, as in Mitsuba 3.

use std::borrow::Cow;
use std::str::FromStr;

use glam::{DMat4, DVec3};

use super::{Node, Property, Value};
use crate::error::{Error, Location, Result};

/// A version of the scene format, `major.minor.patch`; what is not written is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Version([u32; 3]);

impl Version {
    /// The first that spells names as they are spelt now.
    pub(super) const CURRENT_NAMES: Self = Self([2, 0, 0]);
    /// Mitsuba 3.
    pub(super) const CURRENT: Self = Self([3, 0, 0]);
}

impl FromStr for Version {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || {
            Error::input(format!("{text:?} is not a version"))
                .help("write three numbers, such as \"3.0.0\"")
        };
        let mut version = [0; 3];
        let mut slots = version.iter_mut();
        for part in text.trim().split('.') {
            *slots.next().ok_or_else(wrong)? = part.parse().map_err(|_| wrong())?;
        }
        Ok(Self(version))
    }
}

/// The current name of the property that was called `name` before version 2.0.
pub(super) fn name<'n>(plugin: &str, name: &'n str) -> Cow<'n, str> {
    let name = snake_case(name);
    if plugin == "diffuse" && name == "diffuse_reflectance" {
        return "reflectance".into();
    }
    name
}

/// `maxDepth` becomes `max_depth`, `intIOR` becomes `int_ior`.
fn snake_case(name: &str) -> Cow<'_, str> {
    let boundary = |pair: &[u8]| pair[0].is_ascii_lowercase() && pair[1].is_ascii_uppercase();
    if !name.as_bytes().windows(2).any(boundary) {
        return Cow::Borrowed(name);
    }
    let mut out = String::new();
    let mut previous = ' ';
    let mut lowering = false;
    for c in name.chars() {
        if previous.is_ascii_lowercase() && c.is_ascii_uppercase() {
            out.push('_');
            lowering = true;
        }
        lowering &= c.is_ascii_uppercase();
        out.push(if lowering { c.to_ascii_lowercase() } else { c });
        previous = c;
    }
    Cow::Owned(out)
}

/// Replaces `uoffset`, `voffset`, `uscale` and `vscale` by `to_uv`: the offset first, then the scale.
pub(super) fn texture_placement(node: &mut Node) -> Result<()> {
    let mut place: Option<(Location, u32)> = None;
    let mut take = |name: &str| -> Result<Option<f64>> {
        let Some(index) = node.properties.iter().position(|p| p.name == name) else {
            return Ok(None);
        };
        let property = node.properties.remove(index);
        let number = match property.value {
            Value::Float(x) => x,
            Value::Integer(i) => i as f64,
            _ => {
                return Err(Error::input(format!("property {name:?}: expected a float"))
                    .at(&property.location));
            }
        };
        place.get_or_insert((property.location, property.scope));
        Ok(Some(number))
    };
    let offset = DVec3::new(
        take("uoffset")?.unwrap_or(0.0),
        take("voffset")?.unwrap_or(0.0),
        0.0,
    );
    let scale = DVec3::new(
        take("uscale")?.unwrap_or(1.0),
        take("vscale")?.unwrap_or(1.0),
        1.0,
    );
    let Some((location, scope)) = place else {
        return Ok(());
    };
    if scale.x == 0.0 || scale.y == 0.0 {
        return Err(Error::input("a texture's scale must not be 0").at(&location));
    }
    let to_uv = DMat4::from_scale(scale) * DMat4::from_translation(offset);
    let value = Value::Transform(to_uv);
    node.properties
        .push(Property::new("to_uv", value, location, scope));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn camel_case_becomes_snake_case_and_the_rest_stays() {
        for (old, new) in [
            ("maxDepth", "max_depth"),
            ("intIOR", "int_ior"),
            ("kNN", "k_nn"),
            ("toWorld", "to_world"),
            ("fovAxisX", "fov_axis_x"),
            ("already_good", "already_good"),
            ("Upper", "Upper"),
        ] {
            assert_eq!(snake_case(old), new);
        }
        assert_eq!(name("diffuse", "diffuseReflectance"), "reflectance");
        assert_eq!(name("plastic", "diffuseReflectance"), "diffuse_reflectance");
    }

    #[test]
    fn versions_compare_by_their_numbers() {
        let version = |text: &str| text.parse::<Version>().unwrap();
        assert!(version("0.6.0") < Version::CURRENT_NAMES);
        assert!(version("10.0") > Version::CURRENT_NAMES);
        assert_eq!(version("2"), Version::CURRENT_NAMES);
        for wrong in ["", "x", "1.2.3.4", "-1.0.0", "1..2"] {
            assert!(wrong.parse::<Version>().is_err(), "{wrong}");
        }
    }
}
