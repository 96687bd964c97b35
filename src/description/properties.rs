//! One node as the plugin that is built from it sees it: typed access to its properties by name. What is absent
//! has the value that the plugin's table declares, and a value of the wrong type or out of its range is an error that
//! points at it.

use std::path::PathBuf;

use glam::{DMat4, DVec3};

use super::declared::{Plugin, Preset, Row, Short, Takes};
use super::{Description, Kind, Node, NodeId, Property, Value};
use crate::budget::Budget;
use crate::error::{Error, Location, Result};
use crate::math::{Moving, Transform};

/// Why what is Étendue's own is refused.
pub(crate) const STRICT: &str = "Mitsuba 3 would not read it, which --strict refuses";

/// What a transform that may move is, in words.
const MOTION: &str = "a transform or an animation";

/// A view of one node, with the table of the plugin that reads it.
#[derive(Clone, Copy, Debug)]
pub struct Properties<'a> {
    description: &'a Description,
    id: NodeId,
    node: &'a Node,
    table: Option<&'static Plugin>,
}

/// A type that a property's value can have.
pub trait FromValue<'a>: Sized {
    /// The type in words, as in "expected a float".
    const EXPECTED: &'static str;

    /// The value, if it is of this type.
    fn from_value(value: &'a Value) -> Option<Self>;

    /// What a table declares, if it is of this type.
    fn from_preset(preset: &Preset) -> Option<Self>;

    /// The number that is held against a row's range.
    fn number(&self) -> Option<f64> {
        None
    }
}

impl FromValue<'_> for bool {
    const EXPECTED: &'static str = "a boolean";

    fn from_value(value: &Value) -> Option<Self> {
        match *value {
            Value::Boolean(b) => Some(b),
            _ => None,
        }
    }

    fn from_preset(preset: &Preset) -> Option<Self> {
        match *preset {
            Preset::Boolean(b) => Some(b),
            _ => None,
        }
    }
}

impl FromValue<'_> for i64 {
    const EXPECTED: &'static str = "an integer";

    fn from_value(value: &Value) -> Option<Self> {
        match *value {
            Value::Integer(i) => Some(i),
            _ => None,
        }
    }

    fn from_preset(preset: &Preset) -> Option<Self> {
        match *preset {
            Preset::Integer(i) => Some(i),
            _ => None,
        }
    }

    fn number(&self) -> Option<f64> {
        Some(*self as f64)
    }
}

impl FromValue<'_> for f64 {
    const EXPECTED: &'static str = "a float";

    /// Always finite.
    fn from_value(value: &Value) -> Option<Self> {
        match *value {
            Value::Float(x) => Some(x),
            Value::Integer(i) => Some(i as f64),
            _ => None,
        }
    }

    fn from_preset(preset: &Preset) -> Option<Self> {
        match *preset {
            Preset::Float(x) => Some(x),
            _ => None,
        }
    }

    fn number(&self) -> Option<f64> {
        Some(*self)
    }
}

impl<'a> FromValue<'a> for &'a str {
    const EXPECTED: &'static str = "a string";

    fn from_value(value: &'a Value) -> Option<Self> {
        match value {
            Value::String(s) => Some(s.as_str()),
            _ => None,
        }
    }

    fn from_preset(preset: &Preset) -> Option<Self> {
        match *preset {
            Preset::Text(text) => Some(text),
            _ => None,
        }
    }
}

impl FromValue<'_> for DVec3 {
    const EXPECTED: &'static str = "a point or a vector";

    fn from_value(value: &Value) -> Option<Self> {
        match *value {
            Value::Vector(v) => Some(v),
            _ => None,
        }
    }

    fn from_preset(preset: &Preset) -> Option<Self> {
        match *preset {
            Preset::Vector(v) => Some(v.into()),
            _ => None,
        }
    }
}

impl FromValue<'_> for DMat4 {
    const EXPECTED: &'static str = "a transform";

    /// Affine and invertible.
    fn from_value(value: &Value) -> Option<Self> {
        match *value {
            Value::Transform(m) => Some(m),
            _ => None,
        }
    }

    fn from_preset(preset: &Preset) -> Option<Self> {
        match preset {
            Preset::Identity => Some(Self::IDENTITY),
            _ => None,
        }
    }
}

impl<'a> Properties<'a> {
    pub(super) fn new(description: &'a Description, id: NodeId) -> Self {
        let node = &description.nodes[id.index()];
        Self {
            description,
            id,
            node,
            table: None,
        }
    }

    /// The same node as the plugin sees it that has this table.
    #[must_use]
    pub fn declared(self, table: &'static Plugin) -> Self {
        Self {
            table: Some(table),
            ..self
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

    /// The plugin's name: the tag's `type`, and `"scene"` for the root.
    pub fn plugin(&self) -> &'a str {
        &self.node.plugin
    }

    /// The name that references use.
    pub fn id(&self) -> Option<&'a str> {
        self.node.id.as_deref()
    }

    /// Where its tag stands.
    pub fn location(&self) -> &'a Location {
        &self.node.location
    }

    /// The row that the plugin's table has for the property; none where nobody has said which plugin reads it.
    ///
    /// # Panics
    /// Where a plugin reads what it has not declared, which the families' tests would see.
    fn row(&self, name: &str) -> Option<&'static Row> {
        let row = self.table?.row(name);
        #[cfg(test)]
        asked::note(self.kind(), self.plugin(), name);
        assert!(
            row.is_some(),
            "{} {:?} reads {name:?}, which it does not declare",
            self.kind(),
            self.plugin()
        );
        row
    }

    /// The value that the scene gives, checked against the range that is declared.
    ///
    /// # Errors
    /// At the property where it is of another type or out of range.
    pub fn given<T: FromValue<'a>>(&self, name: &str) -> Result<Option<T>> {
        let row = self.row(name);
        let Some(value) = self.typed(name, T::EXPECTED, T::from_value)? else {
            return Ok(None);
        };
        let outside = row.zip(value.number());
        match outside.filter(|(row, number)| !row.range.contains(*number)) {
            Some((row, number)) => {
                let message = format!("{name} must be {}, and {} is not", row.range, Short(number));
                Err(self.error(name, message))
            }
            None => Ok(Some(value)),
        }
    }

    /// The value that the scene gives, or else the declared one.
    ///
    /// # Errors
    /// As [`Properties::given`]; and where there has to be a value and is none.
    fn get<T: FromValue<'a>>(&self, name: &str) -> Result<T> {
        if let Some(value) = self.given(name)? {
            return Ok(value);
        }
        T::from_preset(&self.preset(name)).ok_or_else(|| self.missing(name))
    }

    /// What is declared for the property where a scene does not give it.
    pub fn preset(&self, name: &str) -> Preset {
        self.row(name).map_or(Preset::Required, |row| row.preset)
    }

    /// The error where a property has to be given and is not.
    pub fn missing(&self, name: &str) -> Error {
        let message = format!("{} {:?} needs {name:?}", self.kind(), self.plugin());
        let error = self.error("", message);
        match self.row(name) {
            Some(row) => error.help(format!("{name} ({}): {}", row.takes, row.about)),
            None => error,
        }
    }

    /// A `<boolean>`, or the declared one.
    pub fn boolean(&self, name: &str) -> Result<bool> {
        self.get(name)
    }

    /// An `<integer>`, or the declared one.
    pub fn integer(&self, name: &str) -> Result<i64> {
        self.get(name)
    }

    /// A `<float>` or an `<integer>`, or the declared one; finite.
    pub fn float(&self, name: &str) -> Result<f64> {
        self.get(name)
    }

    /// A `<string>`, or the declared one.
    pub fn string(&self, name: &str) -> Result<&'a str> {
        self.get(name)
    }

    /// A `<point>` or a `<vector>`, or the declared one.
    pub fn vector(&self, name: &str) -> Result<DVec3> {
        self.get(name)
    }

    /// A `<transform>`, affine and invertible, or the declared one.
    pub fn transform(&self, name: &str) -> Result<DMat4> {
        self.get(name)
    }

    /// The one of the declared choices that a `<string>` names, in upper or lower case.
    ///
    /// # Errors
    /// Where it is none of them.
    pub fn choice(&self, name: &str) -> Result<&'static str> {
        let Some(Takes::Choice(choices)) = self.row(name).map(|row| row.takes) else {
            panic!("{name:?} is declared as no choice");
        };
        let chosen: &str = self.get(name)?;
        let same = |choice: &&&str| choice.eq_ignore_ascii_case(chosen);
        choices.iter().find(same).copied().ok_or_else(|| {
            self.error(name, format!("unknown {name} {chosen:?}"))
                .suggest(chosen, choices.iter().copied())
                .help(format!("there are {}", choices.join(", ")))
        })
    }

    /// The keyframes of an `<animation>`: (time, transform), times strictly increasing; `None` where there is a
    /// `<transform>` or nothing.
    pub fn animation(&self, name: &str) -> Result<Option<&'a [(f64, DMat4)]>> {
        self.row(name);
        let keyframes = self.typed(name, MOTION, |value| match value {
            Value::Animation(keyframes) => Some(Some(&keyframes[..])),
            Value::Transform(_) => Some(None),
            _ => None,
        })?;
        Ok(keyframes.flatten())
    }

    /// A `<transform>` or an `<animation>`, or what is declared: affine and invertible at all times.
    ///
    /// # Errors
    /// Where it is not.
    pub fn motion(&self, name: &str) -> Result<Moving> {
        match self.animation(name)? {
            Some(keyframes) => {
                Moving::new(keyframes).map_err(|why| self.error(name, why.to_string()))
            }
            None => {
                let still = Transform::new(&self.transform(name)?);
                still
                    .map(Moving::Still)
                    .ok_or_else(|| self.error(name, "the transform must be affine and invertible"))
            }
        }
    }

    /// The existing file that a `<string>` names, looked for in the `<path>` folders, then in the folder of the scene
    /// file that it stands in, then in those of the files that include that one, then in the working directory.
    ///
    /// # Errors
    /// Where the scene names none, or one that is not there.
    pub fn file(&self, name: &str) -> Result<PathBuf> {
        let file = self.string(name)?;
        let scope = self.find(name).map_or(0, |property| property.scope);
        match self.description.scopes.find(scope, file) {
            Ok(path) if path.is_dir() => {
                Err(self.error(name, format!("{} is a folder", path.display())))
            }
            Ok(path) => Ok(path),
            Err(error) => Err(self.at(name, error)),
        }
    }

    /// The property, whatever it holds.
    pub fn value(&self, name: &str) -> Option<&'a Property> {
        self.row(name);
        self.find(name)
    }

    /// A nested plugin of that name, or the one that a reference of that name stands for.
    pub fn object(&self, name: &str) -> Result<Option<Properties<'a>>> {
        self.row(name);
        let description = self.description;
        self.typed(name, "a nested plugin", |value| match *value {
            Value::Object(id) => Some(description.node(id)),
            _ => None,
        })
    }

    /// The nested plugins of that kind, named or not, in file order.
    pub fn children(&self, kind: Kind) -> Vec<Properties<'a>> {
        let nested = |property: &Property| match property.value {
            Value::Object(id) => Some(self.description.node(id)),
            _ => None,
        };
        let children = self.node.properties.iter().filter_map(nested);
        children.filter(|child| child.kind() == kind).collect()
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

    /// The first plugin of that kind, in file order, that this one is nested in.
    pub fn holder(&self, kind: Kind) -> Option<Properties<'a>> {
        let holds = |p: &Property| matches!(p.value, Value::Object(id) if id == self.id);
        let mut nodes = self.description.nodes_of(kind);
        nodes.find(|node| node.node.properties.iter().any(holds))
    }

    /// The plugin that one of the properties holds.
    pub fn held(&self, property: &Property) -> Option<Properties<'a>> {
        match property.value {
            Value::Object(id) => Some(self.description.node(id)),
            _ => None,
        }
    }

    /// All properties in file order.
    pub fn all(&self) -> &'a [Property] {
        &self.node.properties
    }

    /// What reading files that the scene names may take.
    pub fn budget(&self) -> &'a Budget {
        &self.description.budget
    }

    /// Whether what Mitsuba 3 does not read is an error.
    pub fn is_strict(&self) -> bool {
        self.description.strict
    }

    /// Whether the property is there.
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

    fn typed<T>(
        &self,
        name: &str,
        expected: &str,
        of: impl Fn(&'a Value) -> Option<T>,
    ) -> Result<Option<T>> {
        let Some(property) = self.find(name) else {
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
            None => {
                let error = Error::input(format!(
                    "property {name:?}: expected {expected}, found {}",
                    found()
                ));
                let error = error.at(&property.location);
                Err(match expected.rsplit_once(' ') {
                    Some((_, tag @ ("boolean" | "float" | "integer" | "string"))) => {
                        error.help(format!("write <{tag} name={name:?} value=\"…\"/>"))
                    }
                    _ => error,
                })
            }
        }
    }
}

/// What plugins have asked for, in tests.
#[cfg(test)]
pub(crate) mod asked {
    use std::collections::HashSet;
    use std::sync::{LazyLock, Mutex};

    use crate::description::Kind;

    type Asked = HashSet<(Kind, String, String)>;
    static ASKED: LazyLock<Mutex<Asked>> = LazyLock::new(Mutex::default);

    pub(super) fn note(kind: Kind, plugin: &str, name: &str) {
        let entry = (kind, plugin.to_owned(), name.to_owned());
        ASKED.lock().unwrap().insert(entry);
    }

    /// Whether the property was asked for anywhere.
    pub(crate) fn for_(kind: Kind, plugin: &str, name: &str) -> bool {
        let entry = (kind, plugin.to_owned(), name.to_owned());
        ASKED.lock().unwrap().contains(&entry)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::Options;
    use crate::description::declared::{choice, file, float, integer, motion, string};

    static TABLE: Plugin = Plugin {
        about: "a plugin of these tests",
        properties: &[&[
            float("radius", 1.5, "").positive(),
            float("height", 0.0, "").required(),
            float("i", 0.0, ""),
            integer("x", 0, ""),
            string("name", "nobody", ""),
            choice("side", &["Left", "right"], ""),
            file("filename", "the mesh"),
            motion("to_world", ""),
        ]],
    };

    fn shape(scene: &Description) -> Properties<'_> {
        scene.root().children(Kind::Shape)[0].declared(&TABLE)
    }

    fn scene(text: &str) -> Description {
        let text = format!("<scene version='3.0.0'>{text}</scene>");
        Description::parse(&text, Path::new("test.xml"), &Options::default())
            .expect("a valid scene")
    }

    #[test]
    fn a_value_of_another_type_is_named_and_located() {
        let scene = scene("\n<shape type='sphere'>\n  <string name='radius' value='x'/></shape>");
        let sphere = shape(&scene);
        assert_eq!(
            sphere.float("radius").unwrap_err().to_string(),
            "test.xml:3:3: property \"radius\": expected a float, found a string; \
             write <float name=\"radius\" value=\"…\"/>"
        );
        assert_eq!(sphere.given::<f64>("height").unwrap(), None);
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
        let shape = shape(&scene);
        assert_eq!(shape.float("i").unwrap(), -7.0);
        assert!(shape.integer("x").is_err());
    }

    #[test]
    fn a_transform_stands_still_and_keyframes_make_a_motion() {
        let at = |inside: &str, time: f32| {
            let scene = scene(&format!("<shape type='a'>{inside}</shape>"));
            let moving = shape(&scene).motion("to_world").unwrap();
            (moving.is_still(), moving.at(time).translation().x)
        };
        let still = "<transform name='to_world'><translate x='2'/></transform>";
        assert_eq!(at("", 3.0), (true, 0.0));
        assert_eq!(at(still, 3.0), (true, 2.0));
        let keyframe =
            |time, x| format!("<transform time='{time}'><translate x='{x}'/></transform>");
        let animation = |frames: &str| format!("<animation name='to_world'>{frames}</animation>");
        assert_eq!(at(&animation(&keyframe(7, 4)), 3.0), (true, 4.0));
        let two = animation(&(keyframe(1, 4) + &keyframe(5, 8)));
        assert_eq!(at(&two, 3.0), (false, 6.0));
    }

    #[test]
    fn what_is_absent_is_what_the_table_declares() {
        let scene = scene("\n<shape type='sphere'/>");
        let sphere = shape(&scene);
        assert_eq!(sphere.float("radius").unwrap(), 1.5);
        assert_eq!(sphere.string("name").unwrap(), "nobody");
        assert_eq!(sphere.choice("side").unwrap(), "Left");
        let message = sphere.float("height").unwrap_err().to_string();
        assert!(
            message.starts_with("test.xml:2:1: shape \"sphere\" needs \"height\""),
            "{message}"
        );
    }

    #[test]
    fn what_is_out_of_range_or_no_choice_is_told_with_what_would_be_right() {
        let scene = scene(
            "\n<shape type='sphere'>\n<float name='radius' value='0'/>\n<string name='side' value='rihgt'/></shape>",
        );
        let sphere = shape(&scene);
        assert_eq!(
            sphere.float("radius").unwrap_err().to_string(),
            "test.xml:3:1: radius must be above 0, and 0 is not"
        );
        let message = sphere.choice("side").unwrap_err().to_string();
        assert!(
            message.starts_with("test.xml:4:1: unknown side \"rihgt\""),
            "{message}"
        );
        assert!(message.contains("did you mean \"right\""), "{message}");
    }

    #[test]
    #[should_panic(expected = "does not declare")]
    fn reading_what_is_not_declared_is_a_mistake_of_the_plugin() {
        let scene = scene("<shape type='sphere'/>");
        let _ = shape(&scene).float("undeclared");
    }

    #[test]
    fn a_missing_file_lists_the_places_where_it_was_looked_for() {
        let scene =
            scene("<shape type='obj'><string name='filename' value='no/such.obj'/></shape>");
        let shape = shape(&scene);
        let message = shape.file("filename").unwrap_err().to_string();
        assert!(
            message.contains("cannot find the file \"no/such.obj\""),
            "{message}"
        );
        assert!(message.contains("tried no/such.obj"), "{message}");
    }
}
