//! The sensors of a scene by the names that people give them: an id, or a number in file order from 0.

use crate::description::{Description, NodeId};
use crate::error::{Error, Result};

/// The sensors of a scene, in file order.
pub fn sensors(description: &Description) -> Vec<NodeId> {
    description.sensors()
}

/// The sensors' ids, or their numbers where they have none, in file order.
pub fn sensor_names(description: &Description) -> Vec<String> {
    let name = |(number, id): (usize, NodeId)| {
        let id = description.node(id).id();
        id.map_or_else(|| number.to_string(), str::to_owned)
    };
    sensors(description)
        .into_iter()
        .enumerate()
        .map(name)
        .collect()
}

/// The number of the sensor that `name` means: the one of that id, else the one of that number.
///
/// # Errors
/// Where there is none, with the names that there are.
pub fn find_sensor(description: &Description, name: &str) -> Result<usize> {
    let names = sensor_names(description);
    let by_id = names.iter().position(|id| id == name);
    let by_number = || name.parse().ok().filter(|n| *n < names.len());
    by_id.or_else(by_number).ok_or_else(|| {
        let root = description.root();
        let message = match &names[..] {
            [] => "the scene has no sensor".to_owned(),
            [only] => format!("the scene has no sensor {name:?}: its only one is {only:?}"),
            names => format!(
                "the scene has no sensor {name:?}; there are {}",
                names.join(", ")
            ),
        };
        let error = Error::input(message).at(root.location());
        // Of numbers one is as close as another.
        if name.parse::<usize>().is_ok() {
            return error;
        }
        error.suggest(name, names.iter().map(String::as_str))
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::Options;

    #[test]
    fn a_sensor_is_found_by_its_id_and_else_by_its_number() {
        let text =
            "<scene version='3.0.0'><sensor type='perspective' id='1'/><sensor type='perspective'/>
            <sensor type='perspective' id='side'/></scene>";
        let scene = Description::parse(text, Path::new("a.xml"), &Options::default()).unwrap();
        let found = |name: &str| find_sensor(&scene, name).ok();
        assert_eq!(sensor_names(&scene), ["1", "1", "side"]);
        assert_eq!(
            ["1", "side", "0", "2", "3", "sied"].map(found),
            [Some(0), Some(2), Some(0), Some(2), None, None]
        );
        let error = find_sensor(&scene, "sied").unwrap_err().to_string();
        assert!(error.contains("did you mean \"side\""), "{error}");
    }
}
