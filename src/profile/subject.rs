//! What is rendered: a generated landscape of any number of triangles, or the user's own mesh by parts and
//! subdivision, both under point lights so high above that every point is lit by each; or a scene of the user's,
//! to which lights are added.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use glam::Vec3;
use tempfile::TempDir;

use super::measure::Settings;
use super::resize::{ply, resized};
use super::sweep::{Look, Setting};
use crate::description::{self, Description};
use crate::error::{Error, Problem, Result};
use crate::mesh::{Mesh, ReadOptions, read, terrain};
use crate::render::{Options, Overrides, Session, Silent, UpAxis, find_sensor, is_mesh};

/// What a profile is of.
#[derive(Clone, Debug)]
pub enum Subject {
    /// The generated landscape.
    Terrain,
    /// A mesh file.
    Mesh {
        /// The file.
        path: PathBuf,
        /// Which way is up in it.
        up: UpAxis,
    },
    /// A scene file.
    Scene {
        /// The file.
        path: PathBuf,
        /// How it is read.
        options: description::Options,
    },
}

impl Subject {
    /// A mesh or a scene by its file; the landscape without one.
    pub fn of(input: Option<PathBuf>, up: UpAxis, options: description::Options) -> Self {
        match input {
            None => Self::Terrain,
            Some(path) if is_mesh(&path) => Self::Mesh { path, up },
            Some(path) => Self::Scene { path, options },
        }
    }

    /// For the report.
    pub(super) fn name(&self) -> String {
        match self {
            Self::Terrain => "generated terrain".to_owned(),
            Self::Mesh { path, .. } | Self::Scene { path, .. } => path.display().to_string(),
        }
    }
}

/// The triangles that the landscape's hills come from.
const TERRAIN_SEED: u64 = 1;

/// A subject with the files that it needs.
#[derive(Debug)]
pub(super) struct Stage {
    subject: Source,
    /// Values in place of the subject's, where a setting has none.
    overrides: Overrides,
    folder: TempDir,
    /// Meshes in the folder, by number of triangles.
    meshes: HashMap<u32, PathBuf>,
    /// What was left out in reading it.
    notes: Vec<String>,
}

#[derive(Debug)]
enum Source {
    Terrain,
    Mesh {
        mesh: Mesh,
        up: Vec3,
    },
    Scene {
        path: PathBuf,
        options: description::Options,
        place: Place,
        /// In file order from 0.
        sensor: usize,
        /// Whether the integrator has a `max_depth`.
        has_depth: bool,
    },
}

/// Where things stand around a subject.
#[derive(Clone, Copy, Debug)]
struct Place {
    center: Vec3,
    radius: f32,
    up: Vec3,
}

impl Stage {
    /// Reads what has to be read.
    pub(super) fn new(settings: &Settings) -> Result<Self> {
        let Settings {
            subject,
            overrides,
            budget,
            ..
        } = settings;
        let folder = tempfile::tempdir()
            .map_err(|e| Error::system("make a folder for meshes", &std::env::temp_dir(), &e))?;
        let mut notes = Vec::new();
        let source = match subject {
            Subject::Terrain => Source::Terrain,
            Subject::Mesh { path, up } => {
                let read = read(path, &ReadOptions::BARE, budget)?;
                notes.extend(read.warnings.iter().map(Problem::to_string));
                let mesh = read.mesh;
                if mesh.triangles.is_empty() {
                    return Err(Error::input(format!(
                        "{} holds no triangle",
                        path.display()
                    )));
                }
                Source::Mesh {
                    up: up.of(path, &mesh).direction(),
                    mesh,
                }
            }
            Subject::Scene { path, options } => {
                let mut description = Description::read(path, options, budget)?;
                let sensor = match &settings.sensor {
                    Some(name) => find_sensor(&description, name)?,
                    None => 0,
                };
                overrides.apply(&mut description);
                let run = Options {
                    sensor,
                    ..Options::default()
                };
                let mut session = Session::default();
                let bounds = session.bounds(&description, &run, &Silent)?;
                let deep = Overrides {
                    max_depth: Some(2),
                    ..Overrides::default()
                };
                deep.apply(&mut description);
                let has_depth = session.bounds(&description, &run, &Silent).is_ok();
                let (low, high) = if bounds.is_empty() {
                    (Vec3::NEG_ONE, Vec3::ONE)
                } else {
                    (bounds.min, bounds.max)
                };
                let path = path
                    .canonicalize()
                    .map_err(|e| Error::system("find", path, &e))?;
                let place = Place::around(low, high, Vec3::Y);
                Source::Scene {
                    path,
                    options: options.clone(),
                    place,
                    sensor,
                    has_depth,
                }
            }
        };
        Ok(Self {
            subject: source,
            overrides: overrides.clone(),
            folder,
            meshes: HashMap::new(),
            notes,
        })
    }

    /// What was left out in reading it.
    pub(super) fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Whether the number of triangles is ours to choose.
    pub(super) fn is_scalable(&self) -> bool {
        !matches!(self.subject, Source::Scene { .. })
    }

    /// Which of the scene's sensors is looked through.
    pub(super) fn sensor(&self) -> usize {
        match self.subject {
            Source::Scene { sensor, .. } => sensor,
            _ => 0,
        }
    }

    /// Whether the longest path is ours to choose.
    pub(super) fn has_depth(&self) -> bool {
        match self.subject {
            Source::Scene { has_depth, .. } => has_depth,
            _ => true,
        }
    }

    /// The most triangles that make sense, if there is an end.
    pub(super) fn own_triangles(&self) -> Option<u32> {
        match &self.subject {
            Source::Mesh { mesh, .. } => Some(mesh.triangles.len() as u32),
            _ => None,
        }
    }

    /// The scene for a setting.
    pub(super) fn describe(&mut self, setting: &Setting) -> Result<Description> {
        let mut overrides = Overrides {
            size: Some((setting.size[0], setting.size[1])),
            spp: Some(setting.spp),
            ..self.overrides.clone()
        };
        if let Some(integrator) = setting.look.integrator() {
            overrides.integrator = Some(integrator.to_owned());
        }
        if let Some(depth) = setting.depth {
            overrides.max_depth = Some(depth.into());
        }
        let mut description = match &self.subject {
            Source::Scene {
                path,
                options,
                place,
                ..
            } => {
                let mut text = format!(
                    r#"<scene version="3.0.0"><include filename="{}"/>"#,
                    escaped(path)
                );
                text += &place.lights(setting.lights, place.height(setting.look));
                text += "</scene>";
                // The text has a name of its own: a file that includes itself is refused.
                Description::parse(&text, &path.with_extension("profiled"), options)?
            }
            _ => {
                let (path, place) = self.mesh(setting.triangles)?;
                let text = place.scene(&path, setting);
                Description::parse(&text, &path, &description::Options::default())?
            }
        };
        overrides.apply(&mut description);
        Ok(description)
    }

    /// The file of a mesh of about so many triangles, and its place.
    fn mesh(&mut self, triangles: u32) -> Result<(PathBuf, Place)> {
        let place = match &self.subject {
            Source::Mesh { mesh, up } => {
                let (low, high) = mesh.bounds().expect("it has triangles");
                Place::around(low, high, *up)
            }
            _ => Place::around(
                Vec3::new(-1.0, -1.0, -0.4),
                Vec3::new(1.0, 1.0, 0.4),
                Vec3::Z,
            ),
        };
        if let Some(path) = self.meshes.get(&triangles) {
            return Ok((path.clone(), place));
        }
        let mesh = match &self.subject {
            Source::Mesh { mesh, .. } => resized(mesh, triangles),
            _ => terrain(triangles, TERRAIN_SEED),
        };
        let path = self.folder.path().join(format!("{triangles}.ply"));
        fs::write(&path, ply(&mesh)).map_err(|e| Error::system("write", &path, &e))?;
        self.meshes.insert(triangles, path.clone());
        Ok((path, place))
    }
}

impl Place {
    fn around(low: Vec3, high: Vec3, up: Vec3) -> Self {
        Self {
            center: 0.5 * (low + high),
            radius: (0.5 * (high - low).length()).max(f32::MIN_POSITIVE),
            up,
        }
    }

    /// How high lights hang over the center, in radii.
    fn height(&self, look: Look) -> f32 {
        if look == Look::Room { 1.3 } else { 40.0 }
    }

    /// So many point lights, around the point that high above the center.
    fn lights(&self, count: u32, height: f32) -> String {
        let (right, front) = self.axes();
        let mut text = String::new();
        for i in 0..count {
            let turn = i as f32 / count as f32 * std::f32::consts::TAU;
            let aside = 0.3 * (turn.cos() * right + turn.sin() * front);
            let at = self.center + self.radius * (height * self.up + aside);
            // All lights together are as bright whatever their number.
            let intensity = (height * self.radius).powi(2) / count as f32;
            let _ = write!(
                text,
                r#"<emitter type="point"><point name="position" value="{}"/><rgb name="intensity" value="{intensity}"/></emitter>"#,
                triple(at)
            );
        }
        text
    }

    fn axes(&self) -> (Vec3, Vec3) {
        let right = if self.up.x == 0.0 { Vec3::X } else { Vec3::Y };
        (right, right.cross(self.up))
    }

    /// The scene around a mesh file.
    fn scene(&self, mesh: &Path, setting: &Setting) -> String {
        let (right, front) = self.axes();
        let eye = self.center
            + 1.5 * self.radius * (0.25 * right - 0.8 * front + 0.75 * self.up).normalize();
        let height = self.height(setting.look);
        let room = match setting.look {
            Look::Room => format!(
                r#"<shape type="cube"><boolean name="flip_normals" value="true"/>
                <transform name="to_world"><scale value="{}"/><translate value="{}"/></transform>
                <bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf></shape>"#,
                2.5 * self.radius,
                triple(self.center)
            ),
            _ => String::new(),
        };
        format!(
            r#"<scene version="3.0.0">
    <integrator type="{integrator}">
        <integer name="max_depth" value="{depth}"/><integer name="rr_depth" value="1000000"/>
    </integrator>
    <sensor type="perspective">
        <float name="fov" value="45"/>
        <float name="near_clip" value="{near}"/><float name="far_clip" value="{far}"/>
        <transform name="to_world"><lookat origin="{eye}" target="{target}" up="{up}"/></transform>
        <film type="hdrfilm"><rfilter type="box"/></film>
        <sampler type="independent"/>
    </sensor>
    {lights}{room}
    <shape type="ply">
        <string name="filename" value="{mesh}"/><boolean name="face_normals" value="true"/>
        <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></bsdf>
    </shape>
</scene>"#,
            integrator = setting.look.integrator().unwrap_or("path"),
            depth = setting.depth.unwrap_or(2),
            near = 1e-3 * self.radius,
            far = 100.0 * self.radius,
            eye = triple(eye),
            target = triple(self.center),
            up = triple(self.up),
            lights = self.lights(setting.lights, height),
            mesh = escaped(mesh),
        )
    }
}

fn triple(p: Vec3) -> String {
    format!("{}, {}, {}", p.x, p.y, p.z)
}

/// A path as an attribute's value.
fn escaped(path: &Path) -> String {
    let text = path.display().to_string();
    text.replace('&', "&amp;")
        .replace('"', "&quot;")
        .replace('<', "&lt;")
        .replace('$', "&#36;")
}
