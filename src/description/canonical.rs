//! A description as text that says what the image depends on and nothing else: not where a tag stands, how
//! a parameter was given or what a plugin is called. Two descriptions of the same text, with files of the
//! same content, are the same scene.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::PathBuf;

use super::{Description, Kind, NodeId, Property, Value};

/// Which part of a description is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Everything that light meets: the root without what looks at it.
    Scene,
    /// A sensor with its film and sampler, and the integrator.
    View(NodeId),
}

/// A part of a description in its canonical form.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Canonical {
    /// A line for each node and property; each node is written once, where it is met first.
    pub text: String,
    /// The existing files that the part names, in the order of the text.
    pub files: Vec<PathBuf>,
}

/// Whether plugins of a kind belong to the view when they stand at the root.
fn looks(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::Sensor | Kind::Film | Kind::Sampler | Kind::Integrator
    )
}

impl Description {
    /// A part in its canonical form. Nothing counts as read by it.
    pub fn canonical(&self, part: Part) -> Canonical {
        let Writer { text, files, .. } = self.write(part, Some(String::new()));
        let text = text.unwrap_or_default();
        Canonical { text, files }
    }

    /// The files of a part's canonical form alone.
    pub fn files(&self, part: Part) -> Vec<PathBuf> {
        self.write(part, None).files
    }

    fn write(&self, part: Part, text: Option<String>) -> Writer<'_> {
        let mut writer = Writer {
            description: self,
            text,
            files: Vec::new(),
            numbers: HashMap::new(),
        };
        match part {
            Part::Scene => {
                let root = &self.nodes[NodeId::ROOT.index()].properties;
                writer.properties(root.iter().filter(|p| !self.is_nested(p, looks)));
            }
            Part::View(sensor) => {
                writer.node(sensor);
                let root = &self.nodes[NodeId::ROOT.index()].properties;
                writer.properties(
                    root.iter()
                        .filter(|p| self.is_nested(p, |kind| kind == Kind::Integrator)),
                );
            }
        }
        writer
    }

    /// Every node of a kind, in file order; those that nothing uses are among them.
    pub fn nodes_of(&self, kind: Kind) -> impl Iterator<Item = super::Properties<'_>> {
        (0..self.nodes.len() as u32)
            .map(|index| self.node(NodeId(index)))
            .filter(move |node| node.kind() == kind)
    }

    fn is_nested(&self, property: &Property, of: impl Fn(Kind) -> bool) -> bool {
        matches!(property.value, Value::Object(id) if of(self.nodes[id.index()].kind))
    }
}

struct Writer<'d> {
    description: &'d Description,
    /// Where it is wanted.
    text: Option<String>,
    files: Vec<PathBuf>,
    /// The nodes that were written already, numbered as they came.
    numbers: HashMap<NodeId, usize>,
}

impl<'d> Writer<'d> {
    fn line(&mut self, arguments: std::fmt::Arguments<'_>) {
        if let Some(text) = &mut self.text {
            writeln!(text, "{arguments}").expect("a string takes everything");
        }
    }

    /// Recursive: the depth of a description is bounded.
    fn node(&mut self, id: NodeId) {
        if let Some(number) = self.numbers.get(&id).copied() {
            return self.line(format_args!("node {number}"));
        }
        let number = self.numbers.len();
        self.numbers.insert(id, number);
        let node = &self.description.nodes[id.index()];
        self.line(format_args!("{number} {} {:?} {{", node.kind, node.plugin));
        self.properties(node.properties.iter());
        self.line(format_args!("}}"));
    }

    fn properties(&mut self, properties: impl Iterator<Item = &'d Property>) {
        for property in properties {
            let name = &property.name;
            match &property.value {
                Value::Object(id) => {
                    self.line(format_args!("{name:?}"));
                    self.node(*id);
                }
                // There may be millions, and bits are sooner written than digits.
                Value::Transform(matrix) => {
                    let [a, b, c, d] = matrix.to_cols_array_2d().map(|c| c.map(f64::to_bits));
                    self.line(format_args!("{name:?} {a:x?} {b:x?} {c:x?} {d:x?}"));
                }
                // Floats are written such that they are read back to the same bits.
                value => self.line(format_args!("{name:?} {value:?}")),
            }
            if let Value::String(text) = &property.value {
                let found = self.description.scopes.find(property.scope, text);
                self.files.extend(found.ok().filter(|f| f.is_file()));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::Options;

    fn scene(text: &str) -> Description {
        let text = format!("<scene version='3.0.0'>{text}</scene>");
        Description::parse(&text, Path::new("test.xml"), &Options::default())
            .expect("a valid scene")
    }

    const SENSOR: &str = "<sensor type='perspective'><float name='fov' value='40'/></sensor>";

    #[test]
    fn where_a_tag_stands_and_what_it_is_called_makes_no_difference() {
        let a = scene("<bsdf type='a' id='x'/><shape type='s'><ref id='x'/></shape>");
        let b = scene("\n <bsdf type='a' id='y'/>\n<shape type='s'>\n<ref id='y'/></shape>");
        assert_eq!(a.canonical(Part::Scene), b.canonical(Part::Scene));
    }

    #[test]
    fn every_value_and_every_sharing_makes_a_difference() {
        let texts = [
            "<shape type='s'><float name='x' value='0.1'/></shape>",
            "<shape type='s'><float name='x' value='0.10000000000000002'/></shape>",
            "<shape type='s'><float name='y' value='0.1'/></shape>",
            "<shape type='t'><float name='x' value='0.1'/></shape>",
            "<shape type='s'><float name='x' value='-0'/></shape>",
            "<shape type='s'><float name='x' value='0'/></shape>",
            "<shape type='s'><string name='x' value='0.1'/></shape>",
            "<shape type='s'><transform name='x'><scale value='2'/></transform></shape>",
            "<shape type='s'><transform name='x'><scale value='2.0000000000000004'/></transform></shape>",
            "<shape type='s'><bsdf type='a' id='a'/><ref id='a'/></shape>",
            "<shape type='s'><bsdf type='a' id='a'/><bsdf type='a' id='b'/></shape>",
        ];
        let all: std::collections::BTreeSet<_> = texts
            .iter()
            .map(|t| scene(t).canonical(Part::Scene).text)
            .collect();
        assert_eq!(all.len(), texts.len());
    }

    #[test]
    fn the_scene_does_not_know_who_looks_and_the_view_does_not_know_at_what() {
        let (shape, other) = ("<shape type='s'/>", "<shape type='t'/>");
        let a = scene(&format!("{SENSOR}{shape}<integrator type='path'/>"));
        let b = scene(&format!("{SENSOR}{other}<integrator type='path'/>"));
        let view = |d: &Description| {
            let sensor = d.root().children(Kind::Sensor)[0].node_id();
            d.canonical(Part::View(sensor)).text
        };
        assert_eq!(
            a.canonical(Part::Scene),
            scene(shape).canonical(Part::Scene)
        );
        assert_eq!(view(&a), view(&b));
        let wider = scene(&format!("{}{shape}", SENSOR.replace("40", "50")));
        assert_ne!(view(&a), view(&wider));
    }

    #[test]
    fn existing_files_are_listed() {
        let folder = tempfile::tempdir().unwrap();
        let there = folder.path().join("there.ply");
        std::fs::write(&there, "").unwrap();
        let text =
            "<scene version='3.0.0'><shape type='ply'><string name='filename' value='there.ply'/>
            <string name='other' value='missing.ply'/></shape></scene>";
        let path = folder.path().join("scene.xml");
        let scene = Description::parse(text, &path, &Options::default()).unwrap();
        assert_eq!(scene.canonical(Part::Scene).files, [there]);
    }
}
