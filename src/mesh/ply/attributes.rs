//! Which properties of a PLY element make mesh attributes, and under which names: exactly those of Mitsuba
//! 3.9.1 (probed). `r g b` or `red green blue`, with `a` or `alpha` after them, make `vertex_color` (of a
//! face: `face_color`). Of the others, neighbours `p_0 p_1 p_2` (counted from 0 or 1) or `p_x p_y p_z` make
//! `vertex_p`; `p_r p_g p_b` make `vertex_p_color`; a single `p_0` makes an attribute of one channel, and
//! two or more than three are refused with a warning. Numbers are taken as they stand: bytes are not
//! divided by 255.

use super::header::{Element, Kind};

/// An attribute to read from an element's rows.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Plan {
    /// With its prefix.
    pub(super) name: String,
    /// The properties of the element that are its channels.
    pub(super) properties: Vec<usize>,
}

/// The attributes of `element`, but for the properties in `taken`; `prefix` is `vertex_` or `face_`.
pub(super) fn plan(
    element: &Element,
    prefix: &str,
    taken: &[usize],
    warnings: &mut Vec<String>,
) -> Vec<Plan> {
    let mut plans = Vec::new();
    let mut taken = taken.to_vec();
    if let Some(properties) = color(element) {
        taken.extend(&properties);
        let integers = |&i: &usize| matches!(element.properties[i].kind, Kind::Scalar(scalar) if scalar.is_integer());
        if properties.iter().any(integers) {
            warnings.push(format!(
                "attribute \"{prefix}color\" is stored in whole numbers and taken as they stand, as Mitsuba does; \
                 store colors as floats in [0, 1]"
            ));
        }
        plans.push(Plan {
            name: format!("{prefix}color"),
            properties,
        });
    }
    for group in groups(element, &taken) {
        match group.name() {
            Ok(name) => plans.push(Plan {
                name: format!("{prefix}{name}"),
                properties: group.properties,
            }),
            Err(why) => warnings.push(format!(
                "attribute \"{prefix}{}\" left out: {why}",
                group.stem
            )),
        }
    }
    let mut seen = Vec::new();
    plans.retain(|plan| {
        let first = !seen.contains(&plan.name);
        if first {
            seen.push(plan.name.clone());
        } else {
            warnings.push(format!(
                "attribute {:?} left out: another has its name",
                plan.name
            ));
        }
        first
    });
    plans
}

fn color(element: &Element) -> Option<Vec<usize>> {
    [["r", "g", "b", "a"], ["red", "green", "blue", "alpha"]]
        .iter()
        .find_map(|names| {
            let channels = names.map(|name| element.scalar(&[name]));
            let [Some(r), Some(g), Some(b), a] = channels else {
                return None;
            };
            Some([r, g, b].into_iter().chain(a).collect())
        })
}

/// Neighbouring properties of one stem.
struct Group<'a> {
    stem: &'a str,
    endings: Vec<&'a str>,
    properties: Vec<usize>,
}

impl Group<'_> {
    /// The attribute's name, or why it has none.
    fn name(&self) -> Result<String, String> {
        const SEQUENCES: [(&[&str], &str); 4] = [
            (&["0", "1", "2", "3"], ""),
            (&["1", "2", "3", "4"], ""),
            (&["x", "y", "z", "w"], ""),
            (&["r", "g", "b", "a"], "_color"),
        ];
        if self.endings == [""] {
            return Err("its name does not end in a channel, such as \"_0\"".to_owned());
        }
        let sequence = SEQUENCES
            .iter()
            .find(|(names, _)| names.starts_with(&self.endings));
        match (sequence, self.endings.len()) {
            (Some((_, ending)), 1 | 3) => Ok(format!("{}{ending}", self.stem)),
            (Some(_), n) => Err(format!("it has {n} channels, and 1 or 3 are possible")),
            (None, _) => {
                Err("its channels must be 0 1 2, 1 2 3, x y z or r g b, in this order".to_owned())
            }
        }
    }
}

fn groups<'a>(element: &'a Element, taken: &[usize]) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    for (i, property) in element.properties.iter().enumerate() {
        if taken.contains(&i) || !matches!(property.kind, Kind::Scalar(_)) {
            continue;
        }
        let (stem, ending) = property
            .name
            .rsplit_once('_')
            .unwrap_or((&property.name, ""));
        match groups.last_mut() {
            Some(last) if last.stem == stem && !ending.is_empty() => {
                last.endings.push(ending);
                last.properties.push(i);
            }
            _ => groups.push(Group {
                stem,
                endings: vec![ending],
                properties: vec![i],
            }),
        }
    }
    groups
}
