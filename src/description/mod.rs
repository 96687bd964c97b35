//! The scene file as it was written: Mitsuba 3's XML becomes a flat list of nodes, each a plugin's kind,
//! type, id and located properties, with parameters, includes, references and versions already dealt
//! with. Nothing here knows what a plugin is; the families declare tables of properties ([`declared`]) and read
//! them through [`Properties`].

pub mod declared;
pub mod properties;

mod canonical;
mod defines;
mod element;
mod encoding;
mod graft;
mod legacy;
mod overrides;
mod reader;
mod report;
mod resolve;
mod transform;
mod upgrade;
mod values;
mod written;
mod xml;

#[cfg(test)]
mod tests;

use std::fmt;
use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};

pub use self::canonical::{Canonical, Part};
pub use self::properties::Properties;
use self::reader::Reader;
use self::resolve::Scopes;
pub(crate) use self::transform::LATEST;
pub use self::values::spectrum_file;
pub use self::written::escaped;
use crate::budget::Budget;
use crate::error::{Location, Problem, Result};

/// A node's place in its [`Description`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(u32);

impl NodeId {
    const ROOT: Self = Self(0);

    fn index(self) -> usize {
        self.0 as usize
    }
}

/// What sort of plugin a node describes; each has its own XML tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "each variant is named like its tag")]
pub enum Kind {
    Scene,
    Integrator,
    Sensor,
    Film,
    Filter,
    Sampler,
    Shape,
    Bsdf,
    Texture,
    Emitter,
    Medium,
    Phase,
    Volume,
    Spectrum,
}

impl Kind {
    /// Every kind, in the order of their declaration.
    pub const ALL: [Self; 14] = [
        Self::Scene,
        Self::Integrator,
        Self::Sensor,
        Self::Film,
        Self::Filter,
        Self::Sampler,
        Self::Shape,
        Self::Bsdf,
        Self::Texture,
        Self::Emitter,
        Self::Medium,
        Self::Phase,
        Self::Volume,
        Self::Spectrum,
    ];

    /// The XML tag.
    pub fn tag(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Integrator => "integrator",
            Self::Sensor => "sensor",
            Self::Film => "film",
            Self::Filter => "rfilter",
            Self::Sampler => "sampler",
            Self::Shape => "shape",
            Self::Bsdf => "bsdf",
            Self::Texture => "texture",
            Self::Emitter => "emitter",
            Self::Medium => "medium",
            Self::Phase => "phase",
            Self::Volume => "volume",
            Self::Spectrum => "spectrum",
        }
    }

    fn of_tag(tag: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.tag() == tag)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.tag())
    }
}

/// What a property holds. Numbers are finite.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `<boolean>`
    Boolean(bool),
    /// `<integer>`
    Integer(i64),
    /// `<float>`
    Float(f64),
    /// `<string>`
    String(String),
    /// `<point>` or `<vector>`
    Vector(DVec3),
    /// `<rgb>`: linear sRGB, unbounded.
    Rgb(DVec3),
    /// `<spectrum>` without a type.
    Spectrum(Spectrum),
    /// `<transform>`: affine, for column vectors.
    Transform(DMat4),
    /// `<animation>`: at least one (time, transform), times strictly increasing, transforms as above.
    Animation(Vec<(f64, DMat4)>),
    /// A nested plugin or a reference to one.
    Object(NodeId),
}

/// What a `<spectrum>` tag says.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    /// The same value at every wavelength.
    Uniform(f64),
    /// (Wavelength in nm, value), at least two, wavelengths positive and strictly increasing.
    Curve(Vec<(f64, f64)>),
}

/// One property of a node.
#[derive(Clone, Debug)]
pub struct Property {
    /// Its name; empty for a nested plugin without one.
    pub name: String,
    /// What it holds.
    pub value: Value,
    /// Where its tag stands.
    pub location: Location,
    /// The folders that a file named by it is looked for in.
    scope: u32,
    /// Of a transform that a `<lookat>` made: the point that it looks at.
    target: Option<DVec3>,
}

impl Property {
    fn new(name: &str, value: Value, location: Location, scope: u32) -> Self {
        Self {
            name: name.to_owned(),
            value,
            location,
            scope,
            target: None,
        }
    }
}

/// One plugin's description.
#[derive(Clone, Debug)]
struct Node {
    kind: Kind,
    plugin: String,
    id: Option<String>,
    location: Location,
    /// In file order.
    properties: Vec<Property>,
}

impl Node {
    fn new(kind: Kind, plugin: &str, location: Location) -> Self {
        Self {
            kind,
            plugin: plugin.to_owned(),
            id: None,
            location,
            properties: Vec::new(),
        }
    }
}

/// How a scene file is to be read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Values for the file's `$name` parameters, as `-D name=value` gives them; a later one wins.
    pub defines: Vec<(String, String)>,
    /// Values for parameters that the file may have or not, such as the number of a frame; `defines` come first.
    pub offers: Vec<(String, String)>,
    /// Whether what Mitsuba 3 does not read (keyframes, `#rrggbb`, `<lookAt>`, Étendue's own plugins and
    /// properties) is an error: at once, or of plugins and properties when they are built.
    pub strict: bool,
}

/// A scene file with everything it includes, as a flat list of nodes.
#[derive(Clone, Debug)]
pub struct Description {
    nodes: Vec<Node>,
    scopes: Scopes,
    warnings: Vec<Problem>,
    /// As [`Description::sources`].
    sources: Vec<PathBuf>,
    /// As [`Description::implied`].
    implied: Vec<(String, String)>,
    /// As [`Options::strict`].
    strict: bool,
    /// What reading files that it names may take.
    budget: Budget,
}

impl Description {
    /// The scene's sensors in file order: those at the top, and those in shapes at the top.
    pub fn sensors(&self) -> Vec<NodeId> {
        let mut sensors = Vec::new();
        for property in &self.nodes[NodeId::ROOT.index()].properties {
            let Value::Object(id) = property.value else {
                continue;
            };
            match self.nodes[id.index()].kind {
                Kind::Sensor => sensors.push(id),
                Kind::Shape => sensors.extend(self.children_of(id, Kind::Sensor)),
                _ => {}
            }
        }
        sensors
    }

    /// Whether the `to_world` of a shape is an animation.
    pub fn has_motion(&self) -> bool {
        let moves = |property: &Property| matches!(property.value, Value::Animation(_));
        let mut shapes = self.nodes.iter().filter(|node| node.kind == Kind::Shape);
        shapes.any(|shape| shape.properties.iter().any(moves))
    }

    /// The texts that the description was read from: the scene, what it includes, and files of spectra; each once.
    pub fn sources(&self) -> &[PathBuf] {
        &self.sources
    }

    /// Values of the scene's parameters that follow from those that the options give: of `resx` and `resy`, where the
    /// scene has both, one follows from the other, so that the picture keeps its shape.
    pub fn implied(&self) -> &[(String, String)] {
        &self.implied
    }

    /// Reads the scene file at `path`, within a budget that the files which it names will share.
    ///
    /// # Errors
    /// Names every place in the file, or in one it includes, that says something wrong; an XML syntax error alone
    /// ends the search at once.
    pub fn read(path: &Path, options: &Options, budget: &Budget) -> Result<Self> {
        let mut description = Reader::new(options, budget).file(path)?;
        description.budget = budget.clone();
        Ok(description)
    }

    /// What reading the files that it names may take.
    pub fn budget(&self) -> &Budget {
        &self.budget
    }

    /// The same, with another budget.
    #[must_use]
    pub fn within(mut self, budget: &Budget) -> Self {
        self.budget = budget.clone();
        self
    }

    /// Reads a scene from `text`. Messages name `path`, and its folder is the base of relative file names.
    ///
    /// # Errors
    /// As [`Description::read`], without a limit on memory.
    pub fn parse(text: &str, path: &Path, options: &Options) -> Result<Self> {
        Reader::new(options, &Budget::default()).scene(text, path)
    }

    /// The scene itself.
    pub fn root(&self) -> Properties<'_> {
        self.node(NodeId::ROOT)
    }

    /// The node called `id`, which must be of this description.
    pub fn node(&self, id: NodeId) -> Properties<'_> {
        Properties::new(self, id)
    }

    /// Things that are right but worth knowing, such as an upgrade from an older version of the format.
    pub fn warnings(&self) -> &[Problem] {
        &self.warnings
    }
}
