//! What a scene holds, counted.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::named;
use super::options::Options;
use super::prepare::{self, View};
use super::progress::Progress;
use super::session::{Session, Task};
use crate::color::ColorModel;
use crate::description::{Description, Kind, NodeId, Part, Properties};
use crate::error::{Problem, Result};
use crate::shape;

/// What a scene holds.
#[derive(Clone, Debug, Serialize)]
pub struct SceneInfo {
    /// Triangles and other primitives; each instance's are counted once.
    pub primitives: u64,
    /// Copies of shape groups.
    pub instances: usize,
    /// Low and high corner of the box around the scene, absent where it is empty.
    #[serde(serialize_with = "named::bounds")]
    pub bounds: Option<[[f32; 3]; 2]>,
    /// Bytes of geometry in memory.
    pub geometry_bytes: usize,
    /// Bytes of trees in memory.
    pub tree_bytes: usize,
    /// Plugins in the file by kind and name, those included that nothing refers to.
    pub plugins: BTreeMap<&'static str, BTreeMap<String, usize>>,
    /// The sensors, in file order.
    pub sensors: Vec<SensorInfo>,
    /// What moves while time goes on, whether a shutter sees it or not.
    pub motion: MotionInfo,
    /// Meshes and images that the scene names.
    pub files: Vec<NamedFile>,
    /// What the user should know.
    #[serde(skip)]
    pub warnings: Vec<Problem>,
}

/// A sensor's film and sampler.
#[derive(Clone, Debug, Serialize)]
pub struct SensorInfo {
    /// As references name it.
    pub id: Option<String>,
    /// The plugin.
    pub plugin: String,
    /// Pixels across and down the film.
    #[serde(serialize_with = "named::size")]
    pub size: [u32; 2],
    /// Samples a pixel.
    pub spp: u32,
    /// When its shutter opens and closes, in the units of keyframes.
    pub shutter: [f32; 2],
    /// Whether it moves, at whatever time.
    pub moves: bool,
}

/// What of a scene's file moves, that included which nothing refers to.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct MotionInfo {
    /// Shapes, groups and instances with keyframes of their own.
    pub shapes: usize,
    /// Meshes with several sets of vertices.
    pub deforming_meshes: usize,
    /// Lights with keyframes of their own; those on shapes move with these.
    pub lights: usize,
}

/// A file that a scene names.
#[derive(Clone, Debug, Serialize)]
pub struct NamedFile {
    /// Where it was found.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
}

impl Session {
    /// Counts what a scene holds; it is loaded and its trees are built.
    ///
    /// # Errors
    /// As [`Session::render`].
    pub fn info(
        &mut self,
        description: &Description,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<SceneInfo> {
        let contents = self.contents(description, options, progress)?;
        let sensors = description.sensors();
        let sensor = |id: &NodeId| {
            let look = Look {
                description,
                sensor: *id,
            };
            look.run_in(description, options).ok()
        };
        let bounds = contents.bounds;
        let corners = [bounds.min, bounds.max].map(|corner| corner.to_array());
        let mut files = description.files(Part::Scene);
        files.sort();
        files.dedup();
        let file = |path: PathBuf| NamedFile {
            bytes: std::fs::metadata(&path).map_or(0, |m| m.len()),
            path,
        };
        Ok(SceneInfo {
            primitives: contents.primitives,
            instances: contents.instances,
            bounds: (!bounds.is_empty()).then_some(corners),
            geometry_bytes: contents.bytes[0],
            tree_bytes: contents.bytes[1],
            plugins: plugins(description),
            motion: motion(description),
            // One that cannot be built is among the warnings.
            sensors: sensors.iter().filter_map(sensor).collect(),
            files: files.into_iter().map(file).collect(),
            warnings: contents.warnings,
        })
    }
}

/// Reads a sensor.
struct Look<'a> {
    description: &'a Description,
    sensor: NodeId,
}

impl Task for Look<'_> {
    type Output = SensorInfo;

    fn run<C: ColorModel>(self, _color: C) -> Result<SensorInfo> {
        let View {
            sensor,
            film,
            sampler,
            ..
        } = prepare::view::<C>(self.description, self.sensor)?;
        let properties = self.description.node(self.sensor);
        Ok(SensorInfo {
            id: properties.id().map(str::to_owned),
            plugin: properties.plugin().to_owned(),
            size: [film.width, film.height],
            spp: sampler.sample_count(),
            shutter: sensor.shutter().into(),
            moves: moves(&properties),
        })
    }
}

/// Whether something has keyframes that differ, and a place that they are of.
fn moves(properties: &Properties<'_>) -> bool {
    let keyframes = properties.animation("to_world").ok().flatten();
    keyframes.is_some_and(|keyframes| keyframes.iter().any(|(_, pose)| *pose != keyframes[0].1))
}

fn motion(description: &Description) -> MotionInfo {
    let mut motion = MotionInfo::default();
    for node in description.nodes_of(Kind::Shape) {
        let Ok(node) = shape::declared(&node) else {
            continue;
        };
        let is_placed = ![shape::GROUP, shape::MERGE].contains(&node.plugin());
        motion.shapes += usize::from(is_placed && moves(&node));
        motion.deforming_meshes += usize::from(shape::deforms(&node));
    }
    motion.lights = (description.nodes_of(Kind::Emitter)).filter(moves).count();
    motion
}

/// How often each plugin stands in the file.
fn plugins(description: &Description) -> BTreeMap<&'static str, BTreeMap<String, usize>> {
    let mut all = BTreeMap::new();
    for kind in Kind::ALL.into_iter().filter(|kind| *kind != Kind::Scene) {
        let mut counts = BTreeMap::new();
        for node in description.nodes_of(kind) {
            *counts.entry(node.plugin().to_owned()).or_default() += 1;
        }
        if !counts.is_empty() {
            all.insert(kind.tag(), counts);
        }
    }
    all
}
