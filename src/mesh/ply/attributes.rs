//! Which properties of a PLY element make mesh attributes, and under which names: exactly those of Mitsuba
//! 3.9.1 (probed). `r g b` or `red green blue`, with `a` or `alpha` after them, make `vertex_color` (of a
//! face: `face_color`). Of the others, neighbours `p_0 p_1 p_2` (counted from 0 or 1) or `p_x p_y p_z` make
//! `vertex_p`; `p_r p_g p_b` make `vertex_p_color`; a single `p_0` makes an attribute of one channel, and
//! two or more than three are refused with a warning. Numbers are taken as they stand: bytes are not
//! divided by 255. In a bare mesh the colours are divided by the greatest number of their type, and may be called
//! `diffuse_red` and so on.

use super::header::{Element, Kind};

/// An attribute to read from an element's rows.
#[derive(Debug, PartialEq)]
pub(super) struct Plan {
    /// With its prefix.
    pub(super) name: String,
    /// The properties of the element that are its channels.
    pub(super) properties: Vec<usize>,
    /// The greatest number of each channel's type, `None` for floats, where it is a colour to be divided by it.
    pub(super) ranges: Option<Vec<Option<f32>>>,
}

/// Which attributes are wanted.
pub(super) struct Wanted<'a> {
    /// `vertex_` or `face_`.
    pub(super) prefix: &'a str,
    /// Properties that are something else.
    pub(super) taken: &'a [usize],
    /// Whether they are those of a bare mesh.
    pub(super) bare: bool,
}

/// The attributes of `element`.
pub(super) fn plan(
    element: &Element,
    wanted: &Wanted<'_>,
    warnings: &mut Vec<String>,
) -> Vec<Plan> {
    let Wanted {
        prefix,
        taken,
        bare,
    } = *wanted;
    let mut plans = Vec::new();
    let mut taken = taken.to_vec();
    if let Some(properties) = color(element, bare) {
        taken.extend(&properties);
        let ranges = properties
            .iter()
            .map(|&i| match element.properties[i].kind {
                Kind::Scalar(scalar) => scalar.greatest(),
                Kind::List { .. } => None,
            });
        let ranges: Vec<Option<f32>> = ranges.collect();
        if !bare && ranges.iter().any(Option::is_some) {
            warnings.push(format!(
                "attribute \"{prefix}color\" is stored in whole numbers and taken as they stand, as Mitsuba does; \
                 store colors as floats in [0, 1]"
            ));
        }
        plans.push(Plan {
            name: format!("{prefix}color"),
            properties,
            ranges: bare.then_some(ranges),
        });
    }
    for group in groups(element, &taken) {
        match group.name() {
            Ok(name) => plans.push(Plan {
                name: format!("{prefix}{name}"),
                properties: group.properties,
                ranges: None,
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

fn color(element: &Element, bare: bool) -> Option<Vec<usize>> {
    const NAMES: [[&str; 4]; 3] = [
        ["r", "g", "b", "a"],
        ["red", "green", "blue", "alpha"],
        [
            "diffuse_red",
            "diffuse_green",
            "diffuse_blue",
            "diffuse_alpha",
        ],
    ];
    let names = if bare { &NAMES[..] } else { &NAMES[..2] };
    names.iter().find_map(|names| {
        let channels = names.map(|name| element.scalar(name));
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

#[cfg(test)]
mod tests {
    use super::super::header::{Property, Scalar};
    use super::*;

    /// The names and channels that `properties` make, and how many warnings.
    fn planned(properties: &str) -> (Vec<String>, usize) {
        let property = |word: &str| {
            let (name, scalar) = match word.strip_prefix("uchar:") {
                Some(name) => (name, Scalar::U8),
                None => (word, Scalar::F32),
            };
            Property {
                name: name.to_owned(),
                kind: Kind::Scalar(scalar),
            }
        };
        let properties: Vec<Property> = properties.split_whitespace().map(property).collect();
        let element = Element {
            name: "vertex".into(),
            count: 0,
            properties,
        };
        let mut warnings = Vec::new();
        let wanted = Wanted {
            prefix: "vertex_",
            taken: &[],
            bare: false,
        };
        let plans = plan(&element, &wanted, &mut warnings);
        let shown = plans.iter().map(|p| {
            let names = p
                .properties
                .iter()
                .map(|&i| element.properties[i].name.as_str());
            format!("{}={}", p.name, names.collect::<Vec<_>>().join(","))
        });
        (shown.collect(), warnings.len())
    }

    #[test]
    fn attributes_are_named_as_mitsuba_names_them() {
        for (properties, wanted, warnings) in [
            ("r g b", &["vertex_color=r,g,b"][..], 0),
            ("b g r a", &["vertex_color=r,g,b,a"], 0),
            (
                "uchar:red uchar:green uchar:blue uchar:alpha",
                &["vertex_color=red,green,blue,alpha"],
                1,
            ),
            (
                "color_0 color_1 color_2",
                &["vertex_color=color_0,color_1,color_2"],
                0,
            ),
            (
                "color_r color_g color_b",
                &["vertex_color_color=color_r,color_g,color_b"],
                0,
            ),
            ("foo_x foo_y foo_z", &["vertex_foo=foo_x,foo_y,foo_z"], 0),
            ("foo_1 foo_2 foo_3", &["vertex_foo=foo_1,foo_2,foo_3"], 0),
            ("foo_r", &["vertex_foo_color=foo_r"], 0),
            ("weight_0 foo_0 foo_1", &["vertex_weight=weight_0"], 1),
            ("a_b_0", &["vertex_a_b=a_b_0"], 0),
            ("foo_0 foo_1 foo_2 foo_3", &[], 1),
            ("foo_1 foo_0", &[], 1),
            ("foo_u foo_v foo_w", &[], 1),
            ("foo", &[], 1),
            ("r g", &[], 2),
            (
                "foo_0 r g b",
                &["vertex_color=r,g,b", "vertex_foo=foo_0"],
                0,
            ),
            (
                "foo_0 bar_0 foo_1",
                &["vertex_foo=foo_0", "vertex_bar=bar_0"],
                1,
            ),
            ("r g b color_0 color_1 color_2", &["vertex_color=r,g,b"], 1),
        ] {
            assert_eq!(
                planned(properties),
                (wanted.iter().map(|w| w.to_string()).collect(), warnings),
                "{properties}"
            );
        }
    }
}
