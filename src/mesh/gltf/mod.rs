//! glTF 2.0, as JSON or GLB: the meshes of the default scene in world space with their colours, and its setting: the first camera and the lights.
//! Morph targets stand at their default weights, skins at their nodes' places, or both as the first animation has them at
//! a time that is asked for. Of materials their factors and textures are read, or their base colours alone. Both sides of a triangle are
//! there, whatever `doubleSided` says. Lights are left out where they are not asked for, and animations where no time is, with a warning for each kind. Texture coordinates are those of the base colour or the first texture, with their origin at the
//! top left, as Mitsuba's bitmaps have it, and stay as they are. A primitive without normals is flat, says the
//! specification: its mesh has none. Under a mirroring transform the winding turns, so that the outside stays outside.

mod json;

mod accessor;
mod animation;
mod container;
mod image;
mod lights;
mod material;
mod places;
mod primitive;
mod skin;
mod stage;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3, Vec2};

use super::read::{Decoded, Input, Loaded, ReadOptions, warnings, with_input};
use super::surface::{Surface, Surfaces};
use super::{Attribute, Mesh, Per};
use crate::budget::{Account, Budget};
use crate::error::{Error, Location, Problem, Result};
use accessor::Accessors;
pub use animation::GltfAnimation;
use container::{Buffers, Container};
use image::Textures;
pub use image::gltf_image;
use json::{Primitive, Root, at};
use material::Coordinates;
use places::Places;
use primitive::{Mode, Recipe, Size};
use stage::{Placed, Stage};

/// A glTF scene.
#[derive(Clone, Debug, Default)]
pub struct GltfScene {
    /// Its primitives, in world space.
    pub parts: Vec<GltfPart>,
    /// The first camera of the scene.
    pub camera: Option<GltfCamera>,
    /// Triangles left out because a corner was not finite.
    pub dropped_triangles: usize,
    /// What was odd in the file and did not prevent reading it.
    pub warnings: Vec<Problem>,
}

/// A primitive: a mesh of one material.
#[derive(Clone, Debug)]
pub struct GltfPart {
    /// In world space. Without normals it is meant to be flat. Where the file has colours, they are its attribute
    /// `vertex_color` or `face_color`: linear red, green and blue.
    pub mesh: Mesh,
    /// Linear red, green, blue, and alpha, in [0, 1]: the material's base colour factor.
    pub base_color: [f32; 4],
    /// The node's name, or its mesh's; empty where neither has one.
    pub name: String,
}

/// A camera: it looks along −Z of its own frame, with +Y up and +X to the right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GltfCamera {
    /// From the camera's frame to the world, without the scaling of its node.
    pub to_world: DMat4,
    /// What it sees.
    pub projection: Projection,
    /// Distance of the near plane.
    pub near: f64,
    /// Distance of the far plane; `None`: infinite.
    pub far: Option<f64>,
}

/// A camera's field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole.
    Perspective {
        /// The vertical angle of view, in radians.
        fov_y: f64,
        /// Width over height; `None`: that of the film.
        aspect: Option<f64>,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the width.
        half_width: f64,
        /// Half the height.
        half_height: f64,
    },
}

/// A light without an extent.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfLight {
    /// Where it is, in world space.
    pub position: DVec3,
    /// Whereto it shines, of unit length.
    pub direction: DVec3,
    /// Linear red, green and blue: candela, or lux of a directional light. Not negative.
    pub intensity: [f64; 3],
    /// How it shines.
    pub kind: GltfLightKind,
}

/// How a light shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GltfLightKind {
    /// Everywhere alike.
    Point,
    /// About its direction.
    Spot {
        /// How far from the direction its light begins to fade, in radians, from 0 to `outer`.
        inner: f64,
        /// And where it ends, up to π/2.
        outer: f64,
    },
    /// In its direction alone, from infinitely far.
    Directional,
}

/// What a file says beside its meshes.
#[derive(Clone, Debug, Default)]
pub struct GltfSetting {
    /// The first camera of the scene.
    pub camera: Option<GltfCamera>,
    /// Its lights that shine.
    pub lights: Vec<GltfLight>,
    /// What is left out of the lights.
    pub warnings: Vec<Problem>,
}

/// What is read, or what is wrong, in words.
type OrWhy<T> = std::result::Result<T, String>;

/// Vertices, and corners of triangles, that a scene may come to when its nodes share meshes.
const MOST: usize = 1 << 28;

/// Reads the default scene of the glTF or GLB file `path`, part by part. The account is asked for all that this takes.
///
/// # Errors
/// Where the file or a buffer that it names cannot be read or is malformed.
pub fn read_gltf(path: &Path, options: &ReadOptions, account: &Account) -> Result<GltfScene> {
    let walk = with_input(path, account, |input| walk(input, options, Look::Color))?;
    let mut scene = GltfScene {
        camera: walk.camera,
        ..GltfScene::default()
    };
    for part in walk.parts {
        let Loaded {
            mesh,
            dropped_triangles,
            warnings,
            ..
        } = Decoded {
            mesh: part.mesh,
            ..Decoded::default()
        }
        .finish(path);
        scene.dropped_triangles += dropped_triangles;
        scene.warnings.extend(warnings);
        scene.parts.push(GltfPart { mesh, ..part });
    }
    scene.warnings.extend(warnings(path, walk.notes.told()));
    Ok(scene)
}

/// The first camera and the lights of the default scene of the glTF or GLB file `path` at each of these times of its first
/// animation, in seconds, or once at rest where there are none; no mesh is read for them.
///
/// # Errors
/// Where the file or a buffer that it names cannot be read or is malformed.
pub fn read_gltf_settings(path: &Path, times: &[f32], budget: &Budget) -> Result<Vec<GltfSetting>> {
    with_accessors(path, budget, !times.is_empty(), |json, accessors| {
        let changes = times
            .iter()
            .map(|time| animation::changes(accessors, *time));
        let mut changes = changes.collect::<OrWhy<Vec<_>>>()?;
        if times.is_empty() {
            changes.push(Vec::new());
        }
        let (mut cameras, mut lights, mut told) = (Vec::new(), Vec::new(), Vec::new());
        for changes in changes {
            let mut root = Root::parse(json)?;
            root.apply(changes);
            let stage = Stage::set(&root, &mut Notes::default())?;
            let mut notes = Notes::default();
            lights.push(lights::placed(&root, &stage, &mut notes)?);
            cameras.push(stage.camera);
            told = notes.told();
        }
        // What has no extent for a moment is where it was, or will be first.
        filled(&mut cameras);
        for number in 0..lights[0].len() {
            let mut one: Vec<_> = lights.iter().map(|all| all[number].clone()).collect();
            filled(&mut one);
            for (all, light) in lights.iter_mut().zip(one) {
                all[number] = light;
            }
        }
        let settings = cameras.into_iter().zip(lights);
        let settings = settings.map(|(camera, lights)| GltfSetting {
            camera,
            lights: lights.into_iter().flatten().collect(),
            warnings: warnings(path, told.clone()),
        });
        Ok(settings.collect())
    })
}

/// Gives what is missing the value before it, or the first there is.
fn filled<T: Clone>(values: &mut [Option<T>]) {
    let mut last = values.iter().flatten().next().cloned();
    for value in values {
        match value {
            Some(value) => last = Some(value.clone()),
            None => value.clone_from(&last),
        }
    }
}

/// When to look at the first animation of the glTF or GLB file `path` from when a shutter opens to when it closes; `None`
/// where there is none. No mesh is read for it.
///
/// # Errors
/// As [`read_gltf_settings`].
pub fn read_gltf_animation(
    path: &Path,
    shutter: [f32; 2],
    budget: &Budget,
) -> Result<Option<GltfAnimation>> {
    with_accessors(path, budget, true, |_, accessors| {
        animation::moments(accessors, shutter)
    })
}

/// Opens a file for what it says beside its meshes, with its buffers only where it moves; `work` gets its JSON text too.
fn with_accessors<T>(
    path: &Path,
    budget: &Budget,
    moves: bool,
    work: impl FnOnce(&[u8], &Accessors<'_>) -> OrWhy<T>,
) -> Result<T> {
    let account = &budget.open();
    let bytes = with_input(path, account, |input| input.bytes())?;
    let done = || -> OrWhy<T> {
        let Container { json, binary } = Container::open(&bytes)?;
        take_tree(json, account)?;
        let mut root = Root::parse(json)?;
        if !moves {
            root.buffers.clear();
        }
        let (root, buffers) = (&root, &Buffers::load(&root, binary, path, account));
        let accessors = Accessors {
            root,
            buffers,
            account,
        };
        work(json, &accessors)
    };
    done().map_err(|why| Error::input(why).at(&Location::of_file(path)))
}

/// Asks for the memory of a JSON text's objects and numbers.
fn take_tree(json: &[u8], account: &Account) -> OrWhy<()> {
    const OBJECT: usize = 512;
    const MEMBER: usize = 32;
    let count = |wanted: u8| json.iter().filter(|byte| **byte == wanted).count();
    let bytes = count(b'{') * OBJECT + count(b',') * MEMBER;
    account.take(bytes as u64).map_err(|e| e.to_string())
}

/// All parts as one mesh, with their colours, and with the rest of their materials where the file is all there is.
pub(super) fn read(input: Input<'_>, options: &ReadOptions) -> Result<Decoded> {
    let look = if options.bare {
        Look::Whole
    } else {
        Look::Color
    };
    let mut walk = walk(input, options, look)?;
    if look == Look::Whole {
        walk.fill_uvs();
    }
    let (mut mesh, mut runs) = (Mesh::default(), Vec::new());
    for (part, surface) in walk.parts.into_iter().zip(walk.of_parts) {
        runs.push((part.mesh.triangles.len(), surface));
        mesh.append(part.mesh);
    }
    if let Some(message) = walk.surfaces.excess() {
        walk.notes.add(message);
    }
    let surfaces = match look == Look::Whole && walk.made {
        true => walk.surfaces.of_faces(&mut mesh, &runs),
        false => Vec::new(),
    };
    Ok(Decoded {
        mesh,
        surfaces,
        warnings: walk.notes.told(),
        files: walk.files,
        ..Decoded::default()
    })
}

/// What is taken from materials.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Look {
    /// Their base colours.
    #[default]
    Color,
    /// All of their factors and textures.
    Whole,
}

/// What is left out of a file: told once for each kind.
#[derive(Default)]
struct Notes {
    look: Look,
    counts: BTreeMap<&'static str, usize>,
    /// Names of vertex data.
    unread: BTreeSet<String>,
    /// Of materials.
    unseen: BTreeSet<String>,
}

impl Notes {
    fn add(&mut self, message: &'static str) {
        *self.counts.entry(message).or_default() += 1;
    }

    fn told(self) -> Vec<String> {
        let mut told: Vec<String> = (self.counts.into_iter())
            .map(|(message, count)| match count {
                1 => message.to_owned(),
                _ => format!("{message} ({count} times)"),
            })
            .collect();
        if let Some(names) = listed(&self.unread) {
            told.push(format!("vertex data left out: {names}"));
        }
        if let Some(names) = listed(&self.unseen) {
            told.push(match self.look {
                Look::Color => {
                    format!(
                        "materials are shown by their base colour factor alone, without {names}"
                    )
                }
                Look::Whole => format!("materials are shown without {names}"),
            });
        }
        told
    }
}

/// The first names of some; `None` where there are none.
fn listed(names: &BTreeSet<String>) -> Option<String> {
    const SHOWN: usize = 8;
    let shown: Vec<&str> = names.iter().take(SHOWN).map(String::as_str).collect();
    let more = match names.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!shown.is_empty()).then(|| shown.join(", ") + &more)
}

/// What was found on the way through the nodes.
#[derive(Default)]
struct Walk {
    parts: Vec<GltfPart>,
    surfaces: Surfaces,
    /// The surface of each part.
    of_parts: Vec<u32>,
    /// The file.
    path: PathBuf,
    camera: Option<GltfCamera>,
    notes: Notes,
    /// The files of buffers.
    files: Vec<PathBuf>,
    /// Vertices and corners so far.
    size: usize,
    /// Whether a part has a material.
    made: bool,
    /// Whether one has a base colour that is not a texture's.
    painted: bool,
}

fn walk(input: Input<'_>, options: &ReadOptions, look: Look) -> Result<Walk> {
    let (path, account) = (input.path, input.account);
    let bytes = input.bytes()?;
    let walked = || -> OrWhy<Walk> {
        let container = Container::open(&bytes)?;
        take_tree(container.json, account)?;
        let mut root = Root::parse(container.json)?;
        let mut walk = Walk {
            path: path.to_owned(),
            ..Walk::default()
        };
        walk.notes.look = look;
        let buffers = Buffers::load(&root, container.binary, path, account);
        if let Some(time) = options.time {
            let accessors = Accessors {
                root: &root,
                buffers: &buffers,
                account,
            };
            let changes = animation::changes(&accessors, time.seconds())?;
            for what in animation::left_out(&root) {
                walk.notes.add(what);
            }
            root.apply(changes);
        }
        let stage = Stage::set(&root, &mut walk.notes)?;
        walk.camera = stage.camera;
        if !options.bare {
            for _ in &stage.lights {
                (walk.notes).add("lights are left out (KHR_lights_punctual)");
            }
        }
        if !root.animations.is_empty() && options.time.is_none() {
            (walk.notes).add("animations are left out: nodes and weights stand at rest (`etendue render` shows them by --frames and --shutter)");
        }
        let accessors = Accessors {
            root: &root,
            buffers: &buffers,
            account,
        };
        for placed in &stage.nodes {
            walk.node(placed, &stage, &accessors)?;
        }
        walk.color();
        walk.files = buffers.files;
        if options.flip_tex_coords.unwrap_or(false) {
            for part in &mut walk.parts {
                part.mesh.flip_uvs();
            }
        }
        Ok(walk)
    };
    walked().map_err(|why| Error::input(why).at(&Location::of_file(path)))
}

impl Walk {
    fn node(
        &mut self,
        placed: &Placed<'_>,
        stage: &Stage<'_>,
        accessors: &Accessors<'_>,
    ) -> OrWhy<()> {
        let Some(index) = placed.node.mesh else {
            return Ok(());
        };
        let mesh = at(&accessors.root.meshes, index, "mesh")?;
        let name = placed.node.name.as_ref().or(mesh.name.as_ref());
        let weights = placed.node.weights.as_ref().unwrap_or(&mesh.weights);
        let places = Places::of(placed, accessors)?;
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let own = Own {
                primitive,
                weights,
                places: &places,
            };
            let part = self.primitive(&own, placed, stage, accessors);
            let part = part.map_err(|why| format!("mesh {index}, primitive {i}: {why}"))?;
            self.parts.extend(part.map(|part| GltfPart {
                name: name.cloned().unwrap_or_default(),
                ..part
            }));
        }
        Ok(())
    }

    /// A primitive in the world, as often as it stands there.
    fn primitive(
        &mut self,
        own: &Own<'_>,
        placed: &Placed<'_>,
        stage: &Stage<'_>,
        accessors: &Accessors<'_>,
    ) -> OrWhy<Option<GltfPart>> {
        let Some(mode) = Mode::of(own.primitive)? else {
            self.notes.add("points and lines are left out");
            return Ok(None);
        };
        let root = accessors.root;
        let material = own.primitive.material;
        let material = material.map(|m| at(&root.materials, m, "material"));
        let material = material.transpose()?;
        let base_color = material.map_or([1.0; 4], |m| m.base_color());
        let recipe = Recipe {
            accessors,
            primitive: own.primitive,
            weights: own.weights,
            coordinates: Coordinates::of(material, self.notes.look),
            base_color,
        };
        recipe.check_compression()?;
        let Some(Size { vertices, corners }) = recipe.size()? else {
            self.notes.add("primitives without positions are left out");
            return Ok(None);
        };
        if matches!(mode, Mode::List) && corners % 3 != 0 {
            (self.notes).add("corners after a primitive's last whole triangle are left out");
        }
        // That of a primitive without a material.
        let mut surface = Surface {
            metallic: 1.0,
            ..Surface::MATTE
        };
        if let Some(material) = material {
            material.note_unseen(self.notes.look, &mut self.notes.unseen);
            self.made = true;
            self.painted |= material.has_color();
            if self.notes.look == Look::Whole {
                let textures = Textures {
                    root,
                    path: &self.path,
                    set: recipe.set(),
                };
                surface = material.surface(&textures, &mut self.notes.unseen)?;
                if material.has_alpha() && recipe.has_vertex_alpha() {
                    let what = "the alpha of vertex colours";
                    self.notes.unseen.insert(what.to_owned());
                }
            }
        }
        self.of_parts.push(self.surfaces.number(surface));
        // Textures that ask for other coordinates are told.
        let is_needless =
            |name: &&str| self.notes.look == Look::Whole && name.starts_with("TEXCOORD_");
        let unread = recipe.unread().filter(|name| !is_needless(name));
        let unread: Vec<String> = unread.map(str::to_owned).collect();
        self.notes.unread.extend(unread);
        let size = vertices.saturating_add(corners);
        self.size = (self.size).saturating_add(size.saturating_mul(own.places.len()));
        if self.size > MOST {
            return Err(format!(
                "the scene has more than {MOST} vertices and corners when its meshes are placed"
            ));
        }
        // With what is put together on the way, and the mesh that all parts are appended to.
        const VERTEX: usize = 100;
        const CORNER: usize = 36;
        let bytes = vertices
            .saturating_mul(VERTEX)
            .saturating_add(corners.saturating_mul(CORNER));
        let taken = accessors.account.take_rows(own.places.len() as u64, bytes);
        taken.map_err(|e| e.to_string())?;
        let mut mesh = recipe.mesh(mode)?;
        if let Some(skin) = placed.node.skin {
            let skin = at(&root.skins, skin, "skin")?;
            skin.pose(
                &mut mesh,
                &own.primitive.attributes,
                accessors,
                &stage.world,
            )?;
        } else {
            mesh = own.places.put(mesh);
        }
        Ok(Some(GltfPart {
            mesh,
            base_color,
            name: String::new(),
        }))
    }

    /// Gives all parts texture coordinates if any has them, so that they can be put together.
    fn fill_uvs(&mut self) {
        if self.parts.iter().any(|part| !part.mesh.uvs.is_empty()) {
            for GltfPart { mesh, .. } in &mut self.parts {
                mesh.uvs.resize(mesh.positions.len(), Vec2::ZERO);
            }
        }
    }

    /// Gives the parts their colours, all in one way so that they can be put together: those of vertices where any
    /// part has them, else those of materials where any is not white, or is white and all of its look.
    fn color(&mut self) {
        let by_vertex = self.parts.iter().any(|p| !p.mesh.attributes.is_empty());
        let colored = self.parts.iter().any(|p| p.base_color != [1.0; 4])
            || self.notes.look == Look::Whole && self.painted;
        if !by_vertex && !colored {
            return;
        }
        for GltfPart {
            mesh, base_color, ..
        } in &mut self.parts
        {
            if !mesh.attributes.is_empty() {
                continue;
            }
            let (name, per, count) = match by_vertex {
                true => ("vertex_color", Per::Vertex, mesh.positions.len()),
                false => ("face_color", Per::Face, mesh.triangles.len()),
            };
            mesh.attributes.push(Attribute {
                name: name.to_owned(),
                channels: 3,
                per,
                values: base_color[..3].repeat(count),
            });
        }
    }
}

/// What a node shows of its mesh.
struct Own<'a> {
    primitive: &'a Primitive,
    /// Of the morph targets.
    weights: &'a [f32],
    places: &'a Places,
}
