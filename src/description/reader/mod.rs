//! Walks the XML tree and writes down nodes and properties: what each tag of the format means. Errors are
//! gathered and the walk goes on with the next tag; depth, elements and bytes are bounded over all files
//! together, so that no arrangement of includes can run away.

mod structure;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::defines::Defines;
use super::element::{Element, File};
use super::report::Report;
use super::resolve::{self, Reference, Scopes};
use super::upgrade::{self, Version};
use super::xml::{self, Lines};
use super::{Description, Kind, Node, NodeId, Options, Property, Value, legacy, transform, values};
use crate::budget::{Account, Budget};
use crate::error::{Error, Location, Problem, Result};

/// Levels of nested plugins and includes.
pub(super) const MAX_DEPTH: usize = 64;
/// The shape that Mitsuba's writer puts around what it merges, be that no shape at all: what is in it stands as if the
/// tag were not there.
const MERGE: &str = "merge";

/// Whether the tag is of a place, or of several over time.
fn is_motion(tag: &str) -> bool {
    matches!(tag, "transform" | "animation")
}
/// Warnings that are kept.
const MOST_WARNINGS: usize = 100;
/// Elements in all files together.
const MAX_ELEMENTS: usize = 4_000_000;

/// Tags that are neither plugins nor plain values.
const STRUCTURE: [&str; 7] = [
    "default",
    "path",
    "include",
    "alias",
    "ref",
    "transform",
    "animation",
];

#[derive(Debug)]
pub(super) struct Reader<'o> {
    options: &'o Options,
    /// What the scene's texts take of the budget.
    account: Account,
    pub(super) nodes: Vec<Node>,
    pub(super) ids: BTreeMap<String, (NodeId, Location)>,
    pub(super) references: Vec<Reference>,
    pub(super) lost_ids: LostIds,
    scopes: Scopes,
    defines: Defines,
    report: Report,
    warnings: Vec<Problem>,
    /// Nodes of files older than Mitsuba 3, with the version.
    old_nodes: Vec<(NodeId, Version)>,
    elements: usize,
    includes: usize,
    /// Read from files beside the scene's own.
    bytes: u64,
    /// The files being read, outermost first, each with the place that asked for it.
    open_files: Vec<(PathBuf, Location)>,
    /// The texts that were read, the scene first.
    sources: Vec<PathBuf>,
}

impl<'o> Reader<'o> {
    pub(super) fn new(options: &'o Options, budget: &Budget) -> Self {
        Self {
            options,
            account: budget.open(),
            nodes: Vec::new(),
            ids: BTreeMap::new(),
            references: Vec::new(),
            lost_ids: LostIds::Some(BTreeSet::new()),
            scopes: Scopes::new(),
            defines: Defines::new(&options.defines, &options.offers),
            report: Report::default(),
            warnings: Vec::new(),
            old_nodes: Vec::new(),
            elements: 0,
            includes: 0,
            bytes: 0,
            open_files: Vec::new(),
            sources: Vec::new(),
        }
    }

    /// Reads the scene file at `path`.
    pub(super) fn file(mut self, path: &Path) -> Result<Description> {
        let text = self.read_text(path)?;
        self.scene(&text, path)
    }

    /// Reads the whole scene and resolves it.
    pub(super) fn scene(mut self, text: &str, path: &Path) -> Result<Description> {
        self.open_files
            .push((structure::canonical(path), Location::of_file(path)));
        self.sources.push(path.to_owned());
        let scope = self.scopes.open(path, Scopes::WORKING_DIRECTORY);
        self.document(text, path, scope, None)?;
        let mut report = std::mem::take(&mut self.report);
        self.defines.report_unused(&mut report);
        for (name, value) in self.defines.implied().to_vec() {
            let message = format!("${name} is {value}, so that the picture keeps its shape");
            let note = Error::input(message).at(&Location::of_file(path));
            self.warn(note.help(format!("-D {name}= says otherwise")));
        }
        resolve::references(&mut self, &mut report);
        for (id, version) in std::mem::take(&mut self.old_nodes) {
            let node = &mut self.nodes[id.index()];
            if version < Version::CURRENT_NAMES
                && let Err(error) = upgrade::texture_placement(node)
            {
                report.push(error);
            }
            if !self.options.strict {
                for told in legacy::update(node) {
                    self.warn(told);
                }
            }
        }
        resolve::duplicates(&self.nodes, &mut report);
        // What an unresolved reference stands for is unknown, so there may be no loop to speak of.
        if report.is_empty() {
            resolve::nesting(&self.nodes, &mut report);
        }
        if report.is_empty() {
            resolve::expansion(&self.nodes, &mut report);
        }
        report.finish()?;
        Ok(Description {
            nodes: self.nodes,
            scopes: self.scopes,
            warnings: self.warnings,
            sources: self.sources,
            implied: self.defines.implied().to_vec(),
            strict: self.options.strict,
            budget: Budget::default(),
        })
    }

    /// Reads one file: the scene itself, or what `include` asks for.
    fn document(
        &mut self,
        text: &str,
        path: &Path,
        scope: u32,
        include: Option<Place<'_>>,
    ) -> Result<()> {
        let lines = Lines::new(text, path);
        // Of a tag a node of the XML tree, and a node or a property of ours; and the text, with what is made of it.
        let tags = text.bytes().filter(|byte| *byte == b'<').count();
        let taken = self.account.take((200 * tags + 3 * text.len()) as u64);
        taken.map_err(|e| e.at(&Location::of_file(path)))?;
        let text = xml::tidy(text);
        let tree = xml::parse(&text, &lines)?;
        let root = Element::open(tree.root_element(), &lines, &mut self.defines)?;
        if include.is_none() && root.tag != "scene" {
            return Err(root.error(format!("expected <scene>, found <{}>", root.tag)));
        }
        let version = root
            .required("version")
            .map_err(|e| e.help("write version=\"3.0.0\""))?
            .parse::<Version>()
            .map_err(|e| e.at(root.attribute_location("version")))?;
        let file = File {
            lines,
            version,
            scope,
        };
        if version < Version::CURRENT_NAMES {
            self.warn_of_upgrade(&root);
        }
        match include {
            None => self.root(&root, &file),
            Some(place) if root.tag == "scene" => {
                root.only(&["version", "type", "id", "name"])?;
                self.children(&root, &file, place.parent, place.depth);
                Ok(())
            }
            Some(place) => self.plugin(&root, &file, place, &["version", "type", "id", "name"]),
        }
    }

    fn root(&mut self, root: &Element<'_>, file: &File<'_>) -> Result<()> {
        root.only(&["version", "type", "id", "name"])?;
        let id = self.node(root, file, Kind::Scene, "scene")?;
        self.children(root, file, id, 1);
        Ok(())
    }

    fn children(&mut self, element: &Element<'_>, file: &File<'_>, parent: NodeId, depth: usize) {
        for child in element.children() {
            if self.report.is_full() {
                return;
            }
            if let Err(error) = self.child(child, file, parent, depth) {
                self.report.push(error);
                self.lose_ids(child);
            }
        }
    }

    /// Notes which ids are unknown because `child` could not be read.
    fn lose_ids(&mut self, child: roxmltree::Node<'_, '_>) {
        if child.has_tag_name("include") || self.report.is_full() {
            self.lost_ids = LostIds::Any;
        }
        if let LostIds::Some(ids) = &mut self.lost_ids {
            for node in child.descendants() {
                let names = ["id", "as"].map(|attribute| node.attribute(attribute));
                ids.extend(names.into_iter().flatten().map(str::to_owned));
            }
        }
    }

    fn child(
        &mut self,
        node: roxmltree::Node<'_, '_>,
        file: &File<'_>,
        parent: NodeId,
        depth: usize,
    ) -> Result<()> {
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            self.report.close(
                Error::input(format!("more than {MAX_ELEMENTS} elements"))
                    .at(&file.lines.at(node.range().start)),
            );
            return Ok(());
        }
        let element = Element::open(node, &file.lines, &mut self.defines)?;
        let place = Place {
            parent,
            depth,
            name: None,
        };
        match element.tag {
            "spectrum" if element.optional("type").is_some() => {
                self.plugin(&element, file, place, &["type", "id", "name"])
            }
            tag if values::TAGS.contains(&tag) => self.value(&element, file, parent),
            tag if is_motion(tag) => self.motion(&element, file, parent),
            "ref" => self.reference(&element, file, parent),
            "include" => self.include(&element, file, place),
            "default" => self.default(&element, file),
            "path" => self.path(&element, file, parent),
            "alias" => self.alias(&element, file),
            _ => self.plugin(&element, file, place, &["type", "id", "name"]),
        }
    }

    fn plugin(
        &mut self,
        element: &Element<'_>,
        file: &File<'_>,
        place: Place<'_>,
        attributes: &[&str],
    ) -> Result<()> {
        let tag = element.tag;
        let old = file.version < Version::CURRENT && !self.options.strict;
        let legacy_kind = || legacy::kind(tag).filter(|_| old);
        let kind = Kind::of_tag(tag)
            .or_else(legacy_kind)
            .ok_or_else(|| match tag {
                "translate" | "rotate" | "scale" | "lookat" | "lookAt" | "matrix" => {
                    element.error(format!("<{tag}> stands inside <transform>"))
                }
                _ => {
                    let plugins = Kind::ALL.iter().map(|kind| kind.tag());
                    let error = element.error(format!("unknown tag <{tag}>"));
                    match tag {
                        "light" | "lamp" | "luminaire" => error.help("lights are <emitter>"),
                        "camera" => error.help("cameras are <sensor>"),
                        "material" => error.help("materials are <bsdf>"),
                        "mesh" | "object" => error.help("objects are <shape>"),
                        _ => error.suggest(tag, plugins.chain(values::TAGS).chain(STRUCTURE)),
                    }
                }
            })?;
        if kind == Kind::Scene {
            return Err(element.error("<scene> cannot stand inside another tag"));
        }
        if place.depth >= MAX_DEPTH {
            return Err(element.error(format!("nested more than {MAX_DEPTH} levels deep")));
        }
        element.only(attributes)?;
        let name = element.optional("name").or(place.name).unwrap_or_default();
        let mut plugin = element.filled("type")?;
        if (kind, plugin) == (Kind::Shape, MERGE) {
            let mut children = element.children();
            if let Some(child) = children.find(|child| is_motion(child.tag_name().name())) {
                let child = Element::open(child, &file.lines, &mut self.defines)?;
                let message =
                    "a merge has no place of its own: what is in it stands as if it were not there";
                let help = "let each shape have a to_world, or write type=\"group\", Étendue's own, which has one";
                return Err(child.error(message).help(help));
            }
            self.children(element, file, place.parent, place.depth + 1);
            return Ok(());
        }
        if let Some(today) = legacy::plugin(kind, plugin).filter(|_| old) {
            self.warn(element.error(format!("{kind} {plugin:?} is read as {today:?}")));
            plugin = today;
        }
        let id = self.node(element, file, kind, plugin)?;
        self.property(
            file,
            place.parent,
            name,
            Value::Object(id),
            &element.location,
        );
        self.children(element, file, id, place.depth + 1);
        Ok(())
    }

    /// A new node, registered under its id.
    fn node(
        &mut self,
        element: &Element<'_>,
        file: &File<'_>,
        kind: Kind,
        plugin: &str,
    ) -> Result<NodeId> {
        let node = NodeId(u32::try_from(self.nodes.len()).expect("elements are limited"));
        let id = element.optional("id").filter(|id| !id.is_empty());
        if let Some(id) = id {
            self.register(id, node, element, "id")?;
        }
        let description = Node::new(kind, plugin, element.location.clone());
        self.nodes.push(Node {
            id: id.map(str::to_owned),
            ..description
        });
        if file.version < Version::CURRENT {
            self.old_nodes.push((node, file.version));
        }
        Ok(node)
    }

    fn register(
        &mut self,
        id: &str,
        node: NodeId,
        element: &Element<'_>,
        attribute: &str,
    ) -> Result<()> {
        if let Some((_, first)) = self.ids.get(id) {
            return Err(element
                .attribute_error(attribute, format!("the id {id:?} is taken"))
                .related(first, "the first"));
        }
        let location = element.attribute_location(attribute).clone();
        self.ids.insert(id.to_owned(), (node, location));
        Ok(())
    }

    fn property(
        &mut self,
        file: &File<'_>,
        parent: NodeId,
        name: &str,
        value: Value,
        location: &Location,
    ) {
        let parent = &mut self.nodes[parent.index()];
        let name = if file.version < Version::CURRENT_NAMES {
            upgrade::name(&parent.plugin, name)
        } else {
            name.into()
        };
        let property = Property::new(&name, value, location.clone(), file.scope);
        parent.properties.push(property);
    }

    fn value(&mut self, element: &Element<'_>, file: &File<'_>, parent: NodeId) -> Result<()> {
        let name = element.filled("name")?;
        let value = values::value(element, self.options.strict, |name| {
            let path = self.scopes.find(file.scope, name)?;
            Ok((self.text(&path)?, path))
        })?;
        element.no_children(&file.lines)?;
        self.property(file, parent, name, value, &element.location);
        Ok(())
    }

    fn motion(&mut self, element: &Element<'_>, file: &File<'_>, parent: NodeId) -> Result<()> {
        element.only(&["name"])?;
        let name = element.filled("name")?;
        let mut reading = transform::Reading {
            file,
            defines: &mut self.defines,
            strict: self.options.strict,
            warnings: Vec::new(),
            target: None,
        };
        let value = match element.tag {
            "animation" => Value::Animation(reading.animation(element)?),
            _ => Value::Transform(reading.transform(element)?),
        };
        let target = reading.target;
        for warning in reading.warnings {
            self.warn(warning);
        }
        if let Value::Transform(matrix) = value
            && transform::is_singular(matrix)
            && self.nodes[parent.index()].kind == Kind::Shape
        {
            let warning = element.error("the transform is singular: it flattens the shape");
            self.warn(warning.help("Mitsuba renders a flattened mesh black where it has normals"));
        }
        self.property(file, parent, name, value, &element.location);
        if let Some(property) = self.nodes[parent.index()].properties.last_mut() {
            property.target = target;
        }
        Ok(())
    }

    fn reference(&mut self, element: &Element<'_>, file: &File<'_>, parent: NodeId) -> Result<()> {
        element.only(&["id", "name"])?;
        element.no_children(&file.lines)?;
        let target = element.filled("id")?.to_owned();
        let name = element.optional("name").unwrap_or_default();
        // Which node it is may be known only at the end; until then the parent itself stands in.
        self.property(file, parent, name, Value::Object(parent), &element.location);
        self.references.push(Reference {
            node: parent,
            property: self.nodes[parent.index()].properties.len() - 1,
            target,
        });
        Ok(())
    }

    fn warn_of_upgrade(&mut self, root: &Element<'_>) {
        let version = root.optional("version").unwrap_or_default();
        let message = format!(
            "version {version} is read with the names of version 2.0 (maxDepth as max_depth)"
        );
        self.warn(root.error(message));
    }

    /// Notes what is right but worth knowing, once.
    fn warn(&mut self, warning: Error) {
        for problem in warning.problems() {
            if !self.warnings.contains(problem) && self.warnings.len() < MOST_WARNINGS {
                self.warnings.push(problem.clone());
            }
        }
    }
}

/// Ids whose absence is no news, as the tags that have them could not be read.
#[derive(Debug)]
pub(super) enum LostIds {
    /// These.
    Some(BTreeSet<String>),
    /// There is no telling which.
    Any,
}

impl LostIds {
    pub(super) fn contains(&self, id: &str) -> bool {
        match self {
            Self::Some(ids) => ids.contains(id),
            Self::Any => true,
        }
    }
}

/// Where a plugin goes.
#[derive(Clone, Copy, Debug)]
struct Place<'n> {
    parent: NodeId,
    /// Levels above it.
    depth: usize,
    /// Its property's name, where an `<include>` gives one.
    name: Option<&'n str>,
}
