//! A glTF primitive as a mesh: vertices with their morph targets, triangles from lists, strips and fans, and colours.

use std::collections::BTreeMap;

use glam::Vec3;

use super::OrWhy;
use super::accessor::Accessors;
use super::json::{ElementKind, Primitive, draco};
use super::material::Coordinates;
use crate::mesh::{Attribute, Mesh, Per};

/// What the vertices of a primitive are put together from.
pub(super) struct Recipe<'a> {
    pub(super) accessors: &'a Accessors<'a>,
    pub(super) primitive: &'a Primitive,
    /// Of the morph targets.
    pub(super) weights: &'a [f32],
    pub(super) coordinates: Coordinates,
    /// The material's, linear.
    pub(super) base_color: [f32; 4],
}

/// How large a primitive is.
pub(super) struct Size {
    pub(super) vertices: usize,
    /// Indices, or vertices where there are none.
    pub(super) corners: usize,
}

/// How vertices become triangles.
#[derive(Clone, Copy)]
pub(super) enum Mode {
    List,
    Strip,
    Fan,
}

impl Mode {
    /// `None` for points and lines.
    pub(super) fn of(primitive: &Primitive) -> OrWhy<Option<Self>> {
        Ok(match primitive.mode {
            None | Some(4) => Some(Self::List),
            Some(5) => Some(Self::Strip),
            Some(6) => Some(Self::Fan),
            Some(0..4) => None,
            Some(other) => return Err(format!("its mode {other} is unknown")),
        })
    }
}

impl Recipe<'_> {
    /// How large the mesh will be; `None` where the primitive has no positions.
    pub(super) fn size(&self) -> OrWhy<Option<Size>> {
        let Some(&positions) = self.primitive.attributes.get("POSITION") else {
            return Ok(None);
        };
        let vertices = self.accessors.count(positions)?;
        let corners = match self.primitive.indices {
            Some(indices) => self.accessors.count(indices)?,
            None => vertices,
        };
        Ok(Some(Size { vertices, corners }))
    }

    /// The mesh in its own space; where the primitive has colours, they are times the base colour its attribute
    /// `vertex_color`.
    pub(super) fn mesh(&self, mode: Mode) -> OrWhy<Mesh> {
        let accessors = self.accessors;
        let read = |index| accessors.rows::<3>(index);
        let positions = self
            .morphed("POSITION", &read)?
            .ok_or("it has no positions")?;
        let vertices = positions.len();
        let same_count = |what: &str, count: usize| match count == vertices {
            true => Ok(()),
            false => Err(format!("{count} {what} for {vertices} vertices")),
        };
        let mut mesh = Mesh {
            positions: positions.into_iter().map(Vec3::from_array).collect(),
            ..Mesh::default()
        };
        if let Some(normals) = self.morphed("NORMAL", &read)? {
            same_count("normals", normals.len())?;
            mesh.normals = normals.into_iter().map(Vec3::from_array).collect();
        }
        let set = format!("TEXCOORD_{}", self.coordinates.set);
        if let Some(uvs) = self.morphed(&set, &|index| accessors.rows::<2>(index))? {
            same_count("texture coordinates", uvs.len())?;
            mesh.uvs = (uvs.into_iter())
                .map(|uv| self.coordinates.apply(uv))
                .collect();
        }
        if let Some(colors) = self.morphed("COLOR_0", &|index| accessors.colors(index))? {
            same_count("colours", colors.len())?;
            let [r, g, b, _] = self.base_color;
            let colors = colors
                .iter()
                .map(|color| [color[0] * r, color[1] * g, color[2] * b]);
            mesh.attributes.push(Attribute {
                name: "vertex_color".to_owned(),
                channels: 3,
                per: Per::Vertex,
                values: colors.flatten().collect(),
            });
        }
        mesh.triangles = triangles(&self.indices(vertices)?, mode);
        Ok(mesh)
    }

    /// A vertex attribute with its morph targets by their weights; `None`: the primitive has none.
    fn morphed<const N: usize>(
        &self,
        name: &str,
        read: &impl Fn(usize) -> OrWhy<Vec<[f32; N]>>,
    ) -> OrWhy<Option<Vec<[f32; N]>>> {
        let Some(&base) = self.primitive.attributes.get(name) else {
            return Ok(None);
        };
        let mut rows = read(base)?;
        for (target, &weight) in self.primitive.targets.iter().zip(self.weights) {
            let Some(&target) = target.get(name).filter(|_| weight != 0.0) else {
                continue;
            };
            let added = read(target)?;
            if added.len() != rows.len() {
                return Err(format!(
                    "a morph target moves {} vertices of {}",
                    added.len(),
                    rows.len()
                ));
            }
            let numbers = rows.as_flattened_mut().iter_mut();
            for (number, added) in numbers.zip(added.as_flattened()) {
                *number += weight * added;
            }
        }
        Ok(Some(rows))
    }

    /// Whether colours of vertices have a fourth number.
    pub(super) fn has_vertex_alpha(&self) -> bool {
        let colors = self.primitive.attributes.get("COLOR_0");
        let accessor = colors.and_then(|&index| self.accessors.root.accessors.get(index));
        accessor.is_some_and(|accessor| accessor.kind == ElementKind::Vec4)
    }

    /// Which texture coordinates the mesh has, if it has any.
    pub(super) fn set(&self) -> Option<u32> {
        let name = format!("TEXCOORD_{}", self.coordinates.set);
        let is_there = self.primitive.attributes.contains_key(&name);
        is_there.then_some(self.coordinates.set)
    }

    /// The corners: of each a vertex that there is.
    fn indices(&self, vertices: usize) -> OrWhy<Vec<u32>> {
        let Some(accessor) = self.primitive.indices else {
            return Ok((0..u32::try_from(vertices).map_err(|e| e.to_string())?).collect());
        };
        let indices = self.accessors.whole_rows::<1>(accessor)?;
        let indices = indices.into_iter().flatten().collect::<Vec<u32>>();
        match indices.iter().position(|&i| i as usize >= vertices) {
            Some(at) => Err(format!(
                "index {at} is {}, out of range; there are {vertices} vertices",
                indices[at]
            )),
            None => Ok(indices),
        }
    }

    /// Where the vertices are compressed, and nothing stands for them.
    pub(super) fn check_compression(&self) -> OrWhy<()> {
        let Primitive {
            attributes,
            extensions,
            ..
        } = self.primitive;
        let position = attributes.get("POSITION").copied();
        let accessor = position.and_then(|p| self.accessors.root.accessors.get(p));
        let empty = accessor.is_some_and(|a| a.buffer_view.is_none() && a.sparse.is_none());
        match extensions.draco {
            Some(_) if empty => Err(draco()),
            _ => Ok(()),
        }
    }

    /// The names of vertex data that are not read.
    pub(super) fn unread(&self) -> impl Iterator<Item = &str> {
        let attributes: &BTreeMap<String, usize> = &self.primitive.attributes;
        let names = attributes.keys().map(String::as_str);
        names.filter(|name| {
            let set = name
                .strip_prefix("TEXCOORD_")
                .and_then(|set| set.parse().ok());
            set != Some(self.coordinates.set)
                && !["POSITION", "NORMAL", "TANGENT", "COLOR_0"].contains(name)
                && !name.starts_with("JOINTS_")
                && !name.starts_with("WEIGHTS_")
        })
    }
}

fn triangles(indices: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::List => indices.as_chunks().0.to_vec(),
        Mode::Strip => (indices.windows(3).enumerate())
            .map(|(i, w)| match i % 2 {
                0 => [w[0], w[1], w[2]],
                _ => [w[1], w[0], w[2]],
            })
            .collect(),
        Mode::Fan => (indices.windows(2).skip(1))
            .map(|w| [indices[0], w[0], w[1]])
            .collect(),
    }
}
