//! What can only be known once everything is read: which node a reference means, that no node contains
//! itself, that nothing is nested too deeply through references; and that no property is there
//! twice; and where a file that the scene names is to be found.

use std::path::{Path, PathBuf};

use super::reader::{MAX_DEPTH, Reader};
use super::report::{CANDIDATES, Report};
use super::{Kind, Node, NodeId, Value};
use crate::error::Error;

/// A `<ref>` whose target is not known yet.
#[derive(Debug)]
pub(super) struct Reference {
    pub(super) node: NodeId,
    /// Which of the node's properties it is.
    pub(super) property: usize,
    pub(super) target: String,
}

/// As many ids are listed where none is near.
const SHOWN: usize = 10;

/// Gives every reference its node and notes those that have none.
pub(super) fn references(reader: &mut Reader<'_>, report: &mut Report) {
    for reference in &reader.references {
        if report.is_full() {
            return;
        }
        let Reference {
            node,
            property,
            target,
        } = reference;
        let property = &mut reader.nodes[node.index()].properties[*property];
        match reader.ids.get(target) {
            Some(&(id, _)) => property.value = Value::Object(id),
            None if reader.lost_ids.contains(target) => {}
            None => {
                let ids = || reader.ids.keys().map(String::as_str);
                let error = Error::input(format!("nothing has the id {target:?}"));
                let error = error.at(&property.location);
                // What is near weighs more than what there is.
                let error = error.suggest(target, ids().take(CANDIDATES));
                let few: Vec<&str> = ids().take(SHOWN + 1).collect();
                report.push(match few.len() {
                    0 => error.help(format!(
                        "say what is meant, as in <bsdf type=\"diffuse\" id={target:?}>"
                    )),
                    1..=SHOWN => error.help(format!("the scene's ids are {}", few.join(", "))),
                    _ => error,
                });
            }
        }
    }
}

/// Notes properties that a node has twice.
pub(super) fn duplicates(nodes: &[Node], report: &mut Report) {
    for node in nodes {
        let mut named: Vec<_> = node
            .properties
            .iter()
            .filter(|p| !p.name.is_empty())
            .collect();
        // Stable, so that of two of the same name the one further up comes first.
        named.sort_by_key(|p| &p.name);
        for pair in named.windows(2).filter(|w| w[0].name == w[1].name) {
            report.push(
                Error::input(format!(
                    "{} {:?} has a second property {:?}",
                    node.kind, node.plugin, pair[1].name
                ))
                .at(&pair[1].location)
                .related(&pair[0].location, "the first"),
            );
        }
    }
}

/// The most nodes that a material or a texture may stand for.
const MAX_PARTS: u64 = 1 << 12;

/// Notes nodes that contain themselves and nodes nested more deeply than [`MAX_DEPTH`]; what is built from the nodes
/// may then safely recurse.
pub(super) fn nesting(nodes: &[Node], report: &mut Report) {
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        New,
        Open,
        /// With so many levels of nodes below.
        Closed(usize),
    }
    let mut states = vec![State::New; nodes.len()];
    for start in 0..nodes.len() {
        // Nodes from `start` downwards, each with the property to look at next and the levels seen below.
        let mut path = Vec::new();
        if states[start] == State::New {
            states[start] = State::Open;
            path.push((start, 0, 0));
        }
        while let Some((index, next, below)) = path.pop() {
            let Some(property) = nodes[index].properties.get(next) else {
                states[index] = State::Closed(below);
                if let Some((_, _, seen)) = path.last_mut() {
                    *seen = (*seen).max(below + 1);
                }
                continue;
            };
            let Value::Object(child) = property.value else {
                path.push((index, next + 1, below));
                continue;
            };
            let child = child.index();
            let known = match states[child] {
                State::Closed(levels) => below.max(levels + 1),
                _ => below,
            };
            path.push((index, next + 1, known));
            match states[child] {
                State::New => {
                    states[child] = State::Open;
                    path.push((child, 0, 0));
                }
                State::Open => report.push(
                    Error::input(format!("this {} contains itself", describe(&nodes[child])))
                        .at(&property.location)
                        .related(&nodes[child].location, "it begins"),
                ),
                State::Closed(_) => {}
            }
        }
        if matches!(states[start], State::Closed(below) if below > MAX_DEPTH) {
            report.push(
                Error::input(format!(
                    "nested more than {MAX_DEPTH} levels deep through references"
                ))
                .at(&nodes[start].location),
            );
            return;
        }
    }
}

/// Notes the first material or texture that stands for more than [`MAX_PARTS`] nodes once every reference is followed:
/// each use of a node builds it anew, so that a chain of double references would double at every link. The nodes must
/// have passed [`nesting`].
pub(super) fn expansion(nodes: &[Node], report: &mut Report) {
    let mut known = vec![0; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        let is_value = matches!(node.kind, Kind::Bsdf | Kind::Texture);
        if is_value && parts(nodes, index, &mut known) > MAX_PARTS {
            let message = format!(
                "{} stands for more than {MAX_PARTS} nested objects through references",
                describe(node)
            );
            report.push(Error::input(message).at(&node.location));
            return;
        }
    }
}

/// How many nodes `index` stands for, itself included; `known` holds those that were counted, else 0.
fn parts(nodes: &[Node], index: usize, known: &mut [u64]) -> u64 {
    if known[index] == 0 {
        let mut sum: u64 = 1;
        for property in &nodes[index].properties {
            if let Value::Object(child) = property.value {
                sum = sum.saturating_add(parts(nodes, child.index(), known));
            }
        }
        known[index] = sum;
    }
    known[index]
}

fn describe(node: &Node) -> String {
    match &node.id {
        Some(id) => format!("{} {id:?}", node.kind),
        None => node.kind.to_string(),
    }
}

/// The folders in which files are looked for: each scene file has its own and goes on with those of the file that
/// includes it.
#[derive(Clone, Debug)]
pub(super) struct Scopes(Vec<Scope>);

#[derive(Clone, Debug)]
struct Scope {
    /// The latest is looked into first.
    folders: Vec<PathBuf>,
    parent: Option<u32>,
}

impl Scopes {
    /// The scope of no file: the working directory.
    pub(super) const WORKING_DIRECTORY: u32 = 0;

    pub(super) fn new() -> Self {
        Self(vec![Scope {
            folders: vec![PathBuf::new()],
            parent: None,
        }])
    }

    /// A scope for the scene file `path`, included from `parent`.
    pub(super) fn open(&mut self, path: &Path, parent: u32) -> u32 {
        let folder = path.parent().map(Path::to_path_buf);
        self.0.push(Scope {
            folders: folder.into_iter().collect(),
            parent: Some(parent),
        });
        u32::try_from(self.0.len() - 1).expect("a file has far fewer than 2^32 includes")
    }

    /// Adds all scopes of another file; the answer is by how much their numbers have grown.
    pub(super) fn append(&mut self, other: &Self) -> u32 {
        let grown = self.0.len() as u32;
        self.0.extend(other.0.iter().map(|scope| Scope {
            folders: scope.folders.clone(),
            parent: scope.parent.map(|parent| parent + grown),
        }));
        grown
    }

    /// Adds a folder, to be looked into before the others of the scope.
    pub(super) fn add(&mut self, scope: u32, folder: PathBuf) {
        self.0[scope as usize].folders.push(folder);
    }

    /// The first existing file or folder called `name`, or an error without a place.
    pub(super) fn find(&self, scope: u32, name: &str) -> Result<PathBuf, Error> {
        if name.trim().is_empty() {
            return Err(Error::input("the file's name is empty"));
        }
        let mut tried: Vec<PathBuf> = Vec::new();
        let mut next = Some(scope);
        while let Some(scope) = next.map(|i| &self.0[i as usize]) {
            for folder in scope.folders.iter().rev() {
                let path = folder.join(name);
                if path.exists() {
                    return Ok(path);
                }
                if !tried.contains(&path) {
                    tried.push(path);
                }
            }
            next = scope.parent;
        }
        let places: Vec<_> = tried.iter().map(|p| p.display().to_string()).collect();
        Err(Error::input(format!("cannot find the file {name:?}"))
            .help(format!("tried {}", places.join(", "))))
    }
}
