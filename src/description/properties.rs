//! One node as the plugin that is built from it sees it: typed access to its properties by name. Whatever
//! is asked for counts as read, present or not, and a value of the wrong type is an error that points at
//! it.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use glam::{DMat4, DVec3};

use super::{Description, Kind, Node, NodeId, Property, Value};
use crate::error::{Error, Location, Result};

/// Why what is Étendue's own is refused.
pub(crate) const STRICT: &str = "Mitsuba 3 would not read it, which --strict refuses";

/// A view of one node, which records what was read. Every typed question answers `Ok(None)` where the property is
/// absent and an error at the property where it is of another type.
#[derive(Clone, Copy, Debug)]
pub struct Properties<'a> {
    description: &'a Description,
    id: NodeId,
    node: &'a Node,
}

impl<'a> Properties<'a> {
    pub(super) fn new(description: &'a Description, id: NodeId) -> Self {
        let node = &description.nodes[id.index()];
        Self {
            description,
            id,
            node,
        }
    }

    /// Which node this is.
    pub fn node_id(&self) -> NodeId {
        self.id
    }

    /// What sort of plugin it describes.
    pub fn kind(&self) -> Kind {
        self.node.kind
    }

    /// The plugin's name: the tag's `type`, and `"scene"` for the root. Whoever asks is taken to build the plugin, even
    /// where that has no properties.
    pub fn plugin(&self) -> &'a str {
        self.node.visited.store(true, Ordering::Relaxed);
        &self.node.plugin
    }

    /// The plugin's name, asked by somebody who does not build it.
    pub fn peek_plugin(&self) -> &'a str {
        &self.node.plugin
    }

    /// The nested plugins of that kind, asked by somebody who does not build them: none counts as read.
    pub fn peek_children(&self, kind: Kind) -> impl Iterator<Item = Properties<'a>> {
        let description = self.description;
        let children = self
            .node
            .properties
            .iter()
            .filter_map(move |p| match p.value {
                Value::Object(id) => Some(description.node(id)),
                _ => None,
            });
        children.filter(move |child| child.kind() == kind)
    }

    /// The name that references use.
    pub fn id(&self) -> Option<&'a str> {
        self.node.id.as_deref()
    }

    /// Where its tag stands.
    pub fn location(&self) -> &'a Location {
        &self.node.location
    }

    /// A `<boolean>`.
    pub fn boolean(&self, name: &'static str) -> Result<Option<bool>> {
        self.typed(name, "a boolean", |value| match *value {
            Value::Boolean(b) => Some(b),
            _ => None,
        })
    }

    /// An `<integer>`.
    pub fn integer(&self, name: &'static str) -> Result<Option<i64>> {
        self.typed(name, "an integer", |value| match *value {
            Value::Integer(i) => Some(i),
            _ => None,
        })
    }

    /// A `<float>` or an `<integer>`, always finite.
    pub fn float(&self, name: &'static str) -> Result<Option<f64>> {
        self.typed(name, "a float", |value| match *value {
            Value::Float(x) => Some(x),
            Value::Integer(i) => Some(i as f64),
            _ => None,
        })
    }

    /// A `<string>`.
    pub fn string(&self, name: &'static str) -> Result<Option<&'a str>> {
        self.typed(name, "a string", |value| match value {
            Value::String(s) => Some(s.as_str()),
            _ => None,
        })
    }

    /// A `<point>` or a `<vector>`.
    pub fn vector(&self, name: &'static str) -> Result<Option<DVec3>> {
        self.typed(name, "a point or a vector", |value| match *value {
            Value::Vector(v) => Some(v),
            _ => None,
        })
    }

    /// A `<transform>`: affine and invertible.
    pub fn transform(&self, name: &'static str) -> Result<Option<DMat4>> {
        self.typed(name, "a transform", |value| match *value {
            Value::Transform(m) => Some(m),
            _ => None,
        })
    }

    /// An `<animation>`: (time, transform), times strictly increasing. A `<transform>` counts as one keyframe at
    /// time 0.
    pub fn animation(&self, name: &'static str) -> Result<Option<Vec<(f64, DMat4)>>> {
        self.typed(name, "an animation or a transform", |value| match *value {
            Value::Animation(ref keyframes) => Some(keyframes.clone()),
            Value::Transform(m) => Some(vec![(0.0, m)]),
            _ => None,
        })
    }

    /// The existing file that a `<string>` names, looked for in the `<path>` folders, then in the folder of the scene
    /// file that it stands in, then in those of the files that include that one, then in the working directory.
    pub fn file(&self, name: &'static str) -> Result<Option<PathBuf>> {
        let Some(file) = self.string(name)? else {
            return Ok(None);
        };
        let scope = self.find(name).map_or(0, |property| property.scope);
        match self.description.scopes.find(scope, file) {
            Ok(path) if path.is_dir() => {
                Err(self.error(name, format!("{} is a folder", path.display())))
            }
            Ok(path) => Ok(Some(path)),
            Err(error) => Err(self.at(name, error)),
        }
    }

    /// The property, whatever it holds.
    pub fn value(&self, name: &'static str) -> Option<&'a Property> {
        self.ask(name);
        let property = self.find(name)?;
        property.mark_read();
        Some(property)
    }

    /// A nested plugin of that name, or the one that a reference of that name stands for.
    pub fn object(&self, name: &'static str) -> Result<Option<Properties<'a>>> {
        let description = self.description;
        self.typed(name, "a nested plugin", |value| match *value {
            Value::Object(id) => Some(description.node(id)),
            _ => None,
        })
    }

    /// The nested plugins of that kind, named or not, in file order.
    pub fn children(&self, kind: Kind) -> Vec<Properties<'a>> {
        self.node.visited.store(true, Ordering::Relaxed);
        let mut children = Vec::new();
        for property in &self.node.properties {
            if let Value::Object(id) = property.value {
                let child = self.description.node(id);
                if child.kind() == kind {
                    property.mark_read();
                    children.push(child);
                }
            }
        }
        children
    }

    /// The nested object of a kind, of which there can be one.
    ///
    /// # Errors
    /// Where there is a second.
    pub fn child(&self, kind: Kind) -> Result<Option<Properties<'a>>> {
        let children = self.children(kind);
        match children.get(1) {
            None => Ok(children.first().copied()),
            Some(second) => {
                let message = format!("{} {:?} has a second {kind}", self.kind(), self.plugin());
                let error = Error::input(message).at(second.location());
                Err(error.related(children[0].location(), "the first"))
            }
        }
    }

    /// All properties in file order, for plugins whose property names are the user's. None counts as read by it: see
    /// [`Property::mark_read`].
    pub fn all(&self) -> &'a [Property] {
        self.node.visited.store(true, Ordering::Relaxed);
        &self.node.properties
    }

    /// Whether what Mitsuba 3 does not read is an error.
    pub fn is_strict(&self) -> bool {
        self.description.strict
    }

    /// Says of properties, before they are asked for, that they are Étendue's own.
    ///
    /// # Errors
    /// At the first that is there, where the scene is read strictly.
    pub fn own(&self, names: &[&str]) -> Result<()> {
        let present = |name: &&&str| self.is_strict() && self.has(name);
        match names.iter().find(present) {
            None => Ok(()),
            Some(name) => Err(self
                .error(
                    name,
                    format!(
                        "property {name:?} of {} {:?} is Étendue's own",
                        self.kind(),
                        self.plugin()
                    ),
                )
                .help(STRICT)),
        }
    }

    /// Counts the property as read without using it.
    pub fn ignore(&self, name: &'static str) {
        self.value(name);
    }

    /// Whether the property is there; this does not count as reading it.
    pub fn has(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    /// An error that points at the property, or at the node where that is absent.
    pub fn error(&self, name: &str, message: impl Into<String>) -> Error {
        self.at(name, Error::input(message))
    }

    fn at(&self, name: &str, error: Error) -> Error {
        // Nested plugins have no name, unless the file gives them one.
        let named = self.find(name).filter(|_| !name.is_empty());
        error.at(named.map_or(&self.node.location, |property| &property.location))
    }

    fn find(&self, name: &str) -> Option<&'a Property> {
        self.node.properties.iter().find(|p| p.name == name)
    }

    fn ask(&self, name: &'static str) {
        self.node.visited.store(true, Ordering::Relaxed);
        let mut asked = self.node.asked.lock().unwrap_or_else(|e| e.into_inner());
        asked.insert(name);
    }

    fn typed<T>(
        &self,
        name: &'static str,
        expected: &str,
        of: impl Fn(&'a Value) -> Option<T>,
    ) -> Result<Option<T>> {
        let Some(property) = self.value(name) else {
            return Ok(None);
        };
        let found = || match property.value {
            Value::Boolean(_) => "a boolean".to_owned(),
            Value::Integer(_) => "an integer".to_owned(),
            Value::Float(_) => "a float".to_owned(),
            Value::String(_) => "a string".to_owned(),
            Value::Vector(_) => "a vector".to_owned(),
            Value::Rgb(_) => "an rgb".to_owned(),
            Value::Spectrum(_) => "a spectrum".to_owned(),
            Value::Transform(_) => "a transform".to_owned(),
            Value::Animation(_) => "an animation".to_owned(),
            Value::Object(id) => format!("a nested {}", self.description.node(id).kind()),
        };
        match of(&property.value) {
            Some(value) => Ok(Some(value)),
            None => Err(Error::input(format!(
                "property {name:?}: expected {expected}, found {}",
                found()
            ))
            .at(&property.location)),
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

    #[test]
    fn a_value_of_another_type_is_named_and_located() {
        let scene = scene("\n<shape type='sphere'>\n  <string name='radius' value='x'/></shape>");
        let sphere = scene.root().children(Kind::Shape)[0];
        assert_eq!(
            sphere.float("radius").unwrap_err().to_string(),
            "test.xml:3:3: property \"radius\": expected a float, found a string"
        );
        assert!(sphere.float("height").unwrap().is_none());
    }

    #[test]
    fn an_error_without_a_name_points_at_the_node_and_not_at_what_is_nested() {
        let scene = scene("\n<shape type='sphere'>\n  <bsdf type='diffuse'/></shape>");
        let error = scene.root().children(Kind::Shape)[0].error("", "wrong");
        assert_eq!(error.to_string(), "test.xml:2:1: wrong");
    }

    #[test]
    fn an_integer_serves_as_a_float_but_not_the_other_way_round() {
        let scene = scene(
            "<shape type='a'><integer name='i' value='-7'/><float name='x' value='2'/></shape>",
        );
        let shape = scene.root().children(Kind::Shape)[0];
        assert_eq!(shape.float("i").unwrap(), Some(-7.0));
        assert!(shape.integer("x").is_err());
    }

    #[test]
    fn a_transform_serves_as_an_animation_of_one_keyframe() {
        let scene = scene(
            "<shape type='a'><transform name='to_world'><translate x='2'/></transform></shape>",
        );
        let shape = scene.root().children(Kind::Shape)[0];
        let keyframes = shape.animation("to_world").unwrap().unwrap();
        assert_eq!(keyframes.len(), 1);
        assert_eq!(keyframes[0].1.w_axis.x, 2.0);
    }

    #[test]
    fn what_nobody_read_is_reported_with_the_name_that_was_meant() {
        let scene = scene(
            "<bsdf type='unused' id='spare'><float name='x' value='1'/></bsdf>
             <shape type='sphere'><float name='raduis' value='1'/><bsdf type='diffuse'/></shape>",
        );
        let sphere = scene.root().children(Kind::Shape)[0];
        assert!(sphere.float("radius").unwrap().is_none());
        let unread: Vec<_> = scene.unread().iter().map(ToString::to_string).collect();
        assert_eq!(unread.len(), 2, "{unread:?}");
        assert!(
            unread[0]
                .ends_with("shape \"sphere\" has no property \"raduis\"; did you mean \"radius\"?")
        );
        assert!(unread[1].contains("no use for the bsdf \"diffuse\""));
    }

    #[test]
    fn nothing_is_unread_once_all_was_read_or_ignored() {
        let scene =
            scene("<shape type='a'><float name='x' value='1'/><float name='y' value='1'/></shape>");
        let shape = scene.root().children(Kind::Shape)[0];
        shape.float("x").unwrap();
        assert_eq!(scene.unread().len(), 1);
        shape.ignore("y");
        assert!(scene.unread().is_empty());
    }

    #[test]
    fn a_missing_file_lists_the_places_where_it_was_looked_for() {
        let scene =
            scene("<shape type='obj'><string name='filename' value='no/such.obj'/></shape>");
        let shape = scene.root().children(Kind::Shape)[0];
        let message = shape.file("filename").unwrap_err().to_string();
        assert!(
            message.contains("cannot find the file \"no/such.obj\""),
            "{message}"
        );
        assert!(message.contains("tried no/such.obj"), "{message}");
    }
}
