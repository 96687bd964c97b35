//! glTF 2.0, as JSON or GLB: the meshes of the default scene in world space, their base colours, and the
//! first camera. No images, skins, morph targets or animations. Texture coordinates have their origin at the
//! top left, as Mitsuba's bitmaps have it, and stay as they are. A primitive without normals is flat, says
//! the specification: its mesh has none. Under a mirroring transform the winding turns, so that the outside
//! stays outside.

mod buffers;

use std::path::Path;

use glam::{DMat4, DVec4, Vec2, Vec3};
use gltf::mesh::Mode;
use gltf::{Document, Node, Primitive, Semantic};

use super::read::{Decoded, Input, Loaded, ReadOptions, warnings, with_input};
use super::{Attribute, Mesh, Per};
use crate::error::{Error, Location, Problem, Result};
use buffers::{Buffers, Container};

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
    /// In world space. Without normals it is meant to be flat.
    pub mesh: Mesh,
    /// Linear red, green, blue, and alpha, in [0, 1]: the material's base colour factor.
    pub base_color: [f32; 4],
    /// The node's name, or its mesh's; empty where neither has one.
    pub name: String,
}

/// A camera: it looks along −Z of its own frame, with +Y up and +X to the right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GltfCamera {
    /// From the camera's frame to the world.
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

/// What is read, or what is wrong, in words.
type OrWhy<T> = std::result::Result<T, String>;

/// Vertices, and corners of triangles, that a scene may come to when its nodes share meshes.
const MOST: usize = 1 << 28;

/// Reads the default scene of the glTF or GLB file `path`, part by part.
///
/// # Errors
/// Where the file or a buffer that it names cannot be read or is malformed.
pub fn read_gltf(path: &Path, options: &ReadOptions) -> Result<GltfScene> {
    let walk = with_input(path, |input| walk(input, options))?;
    let mut scene = GltfScene {
        camera: walk.camera,
        ..GltfScene::default()
    };
    for part in walk.parts {
        let Loaded {
            mesh,
            dropped_triangles,
            warnings,
        } = Decoded {
            mesh: part.mesh,
            ..Decoded::default()
        }
        .finish(path);
        scene.dropped_triangles += dropped_triangles;
        scene.warnings.extend(warnings);
        scene.parts.push(GltfPart { mesh, ..part });
    }
    scene.warnings.extend(warnings(path, walk.warnings));
    Ok(scene)
}

/// All parts as one mesh; where the file gives base colours, they are its attribute `face_color`.
pub(super) fn read(input: Input<'_>, options: &ReadOptions) -> Result<Decoded> {
    let walk = walk(input, options)?;
    let colored = walk.parts.iter().any(|part| part.base_color != [1.0; 4]);
    let mut mesh = Mesh::default();
    for mut part in walk.parts {
        if colored {
            let [r, g, b, _] = part.base_color;
            part.mesh.attributes.push(Attribute {
                name: "face_color".to_owned(),
                channels: 3,
                per: Per::Face,
                values: [r, g, b].repeat(part.mesh.triangles.len()),
            });
        }
        mesh.append(part.mesh);
    }
    Ok(Decoded {
        mesh,
        warnings: walk.warnings,
        ..Decoded::default()
    })
}

fn walk(input: Input<'_>, options: &ReadOptions) -> Result<Walk> {
    let path = input.path;
    let bytes = input.bytes()?;
    let walked = || -> OrWhy<Walk> {
        let container = Container::open(&bytes)?;
        let root = gltf::json::deserialize::from_slice(container.json);
        let root = root.map_err(|e| format!("the JSON is malformed: {e}"))?;
        check_attributes(&root)?;
        let document = Document::from_json(root).map_err(|e| e.to_string())?;
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        let scene = scene.ok_or("the file has no scene")?;
        let buffers = Buffers::load(&document, container.binary, path)?;
        let mut walk = Walk {
            flip: options.flip_tex_coords.unwrap_or(false),
            ..Walk::default()
        };
        walk.nodes(&document, scene.nodes(), &buffers)?;
        Ok(walk)
    };
    walked().map_err(|why| Error::input(why).at(&Location::of_file(path)))
}

/// The crate's own validation indexes with these before it looks at their range.
fn check_attributes(root: &gltf::json::Root) -> OrWhy<()> {
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut accessors = primitives.flat_map(|p| p.attributes.values());
    match accessors.find(|index| index.value() >= root.accessors.len()) {
        Some(index) => Err(format!(
            "accessor {index} is out of range; there are {}",
            root.accessors.len()
        )),
        None => Ok(()),
    }
}

/// What was found on the way through the nodes.
#[derive(Default)]
struct Walk {
    flip: bool,
    parts: Vec<GltfPart>,
    camera: Option<GltfCamera>,
    warnings: Vec<String>,
    /// Vertices and corners so far.
    size: usize,
}

impl Walk {
    /// Visits `roots` and all below them in the order of the file.
    fn nodes<'a>(
        &mut self,
        document: &'a Document,
        roots: impl Iterator<Item = Node<'a>>,
        buffers: &Buffers,
    ) -> OrWhy<()> {
        let mut seen = vec![false; document.nodes().len()];
        let mut left: Vec<(Node<'a>, DMat4)> = roots.map(|node| (node, DMat4::IDENTITY)).collect();
        left.reverse();
        while let Some((node, parent)) = left.pop() {
            let index = node.index();
            if std::mem::replace(&mut seen[index], true) {
                return Err(format!(
                    "node {index} has two parents, or is its own ancestor"
                ));
            }
            let columns = node
                .transform()
                .matrix()
                .map(|c| DVec4::from(c.map(f64::from)));
            let to_world =
                parent * DMat4::from_cols(columns[0], columns[1], columns[2], columns[3]);
            if self.camera.is_none() {
                self.camera = camera(document, &node, to_world);
            }
            if let Some(mesh) = node.mesh() {
                let name = node.name().or(mesh.name()).unwrap_or_default();
                for primitive in mesh.primitives() {
                    let read = self.primitive(&primitive, &to_world, name, buffers);
                    read.map_err(|e| {
                        format!(
                            "mesh {}, primitive {}: {e}",
                            mesh.index(),
                            primitive.index()
                        )
                    })?;
                }
            }
            let first = left.len();
            left.extend(node.children().map(|child| (child, to_world)));
            left[first..].reverse();
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        primitive: &Primitive<'_>,
        to_world: &DMat4,
        name: &str,
        buffers: &Buffers,
    ) -> OrWhy<()> {
        if !matches!(
            primitive.mode(),
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            self.warnings.push(format!(
                "{:?} of {name:?} left out: only triangles are read",
                primitive.mode()
            ));
            return Ok(());
        }
        let positions = primitive
            .get(&Semantic::Positions)
            .ok_or("it has no positions")?;
        let corners = primitive.indices().map_or(positions.count(), |i| i.count());
        self.size = self
            .size
            .saturating_add(positions.count())
            .saturating_add(corners);
        if self.size > MOST {
            return Err(format!(
                "the scene has more than {MOST} vertices and corners when its meshes are placed"
            ));
        }
        let mut mesh = Mesh {
            positions: buffers
                .rows(&positions)?
                .into_iter()
                .map(Vec3::from_array)
                .collect(),
            ..Mesh::default()
        };
        let vertices = mesh.positions.len();
        let same_count = |what: &str, count: usize| match count == vertices {
            true => Ok(()),
            false => Err(format!("{count} {what} for {vertices} vertices")),
        };
        if let Some(normals) = primitive.get(&Semantic::Normals) {
            mesh.normals = buffers
                .rows(&normals)?
                .into_iter()
                .map(Vec3::from_array)
                .collect();
            same_count("normals", mesh.normals.len())?;
        }
        if let Some(uvs) = primitive.get(&Semantic::TexCoords(0)) {
            mesh.uvs = buffers
                .rows(&uvs)?
                .into_iter()
                .map(Vec2::from_array)
                .collect();
            same_count("texture coordinates", mesh.uvs.len())?;
            if self.flip {
                mesh.flip_uvs();
            }
        }
        let indices = match primitive.indices() {
            Some(accessor) => buffers.indices(&accessor)?,
            None => (0..u32::try_from(vertices).map_err(|e| e.to_string())?).collect(),
        };
        if let Some(at) = indices.iter().position(|&i| i as usize >= vertices) {
            return Err(format!(
                "index {at} is {}, out of range; there are {vertices} vertices",
                indices[at]
            ));
        }
        mesh.triangles = triangles(&indices, primitive.mode());
        mesh.transform(to_world);
        if to_world.determinant() < 0.0 {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let base_color = primitive
            .material()
            .pbr_metallic_roughness()
            .base_color_factor();
        self.parts.push(GltfPart {
            mesh,
            base_color,
            name: name.to_owned(),
        });
        Ok(())
    }
}

fn triangles(indices: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| {
                if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[1], w[0], w[2]]
                }
            })
            .collect(),
        Mode::TriangleFan => indices
            .windows(2)
            .skip(1)
            .map(|w| [indices[0], w[0], w[1]])
            .collect(),
        _ => indices.as_chunks().0.to_vec(),
    }
}

/// The node's camera, unless the file says its kind and leaves out the numbers.
fn camera(document: &Document, node: &Node<'_>, to_world: DMat4) -> Option<GltfCamera> {
    // The crate's own accessor panics where the numbers are left out.
    let json = document.as_json().cameras.get(node.camera()?.index())?;
    let (projection, near, far) = if let Some(p) = &json.perspective {
        let projection = Projection::Perspective {
            fov_y: p.yfov.into(),
            aspect: p.aspect_ratio.map(f64::from),
        };
        (projection, p.znear, p.zfar)
    } else if let Some(o) = &json.orthographic {
        let projection = Projection::Orthographic {
            half_width: o.xmag.into(),
            half_height: o.ymag.into(),
        };
        (projection, o.znear, Some(o.zfar))
    } else {
        return None;
    };
    Some(GltfCamera {
        to_world,
        projection,
        near: near.into(),
        far: far.map(f64::from),
    })
}
