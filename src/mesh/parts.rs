//! The meshes of a file one by one: the primitives of a glTF scene, the meshes of a `serialized` file, the objects of an
//! OBJ file (its groups, where it has no objects). A scene's shape takes an OBJ file as one mesh, with smooth normals
//! across its objects; so that the parts look as the whole does, they keep those normals.

use std::collections::HashMap;
use std::path::Path;

use super::far::Far;
use super::read::{
    Decoded, Input, Loaded, ReadOptions, extension, read_near, read_on, warnings, with_input,
};
use super::select::{NOWHERE, select};
use super::surface::{FACE_SURFACE, Surface};
use super::{Attribute, Mesh, Per, gltf, obj, serialized};
use crate::budget::{Account, Budget};
use crate::error::{Error, Location, Problem, Result};
use crate::file::text;

/// One of the meshes of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What the file calls it; may be empty, and need not be unique.
    pub name: String,
    /// With finite triangles.
    pub mesh: Mesh,
}

/// The meshes of a file.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// At least one.
    pub parts: Vec<Part>,
    /// Triangles left out because a corner was not finite.
    pub dropped_triangles: usize,
    /// What was odd in the file and did not prevent reading it.
    pub warnings: Vec<Problem>,
}

/// No file is taken apart into more.
const MOST: usize = 1 << 16;

/// Reads the file `path` part by part, whose extension says the format, as [bare](ReadOptions::bare).
///
/// # Errors
/// As [`read`](super::read()) has them; where there are more than 65536 parts.
pub fn read_parts(path: &Path, budget: &Budget) -> Result<Parts> {
    let account = budget.open();
    let parts = match extension(path).as_str() {
        "gltf" | "glb" => gltf_parts(path, &account)?,
        "obj" => obj_parts(path, &account)?,
        "serialized" => serialized_parts(path, &account)?,
        _ => {
            let loaded = read_on(path, &ReadOptions::BARE, &account)?;
            let mut parts = Parts {
                warnings: unkept(path, &loaded),
                ..Parts::default()
            };
            parts.add(String::new(), loaded);
            parts
        }
    };
    if parts.parts.len() > MOST {
        let message = format!(
            "the file has {} meshes, more than the {MOST} that it can be taken apart into",
            parts.parts.len()
        );
        return Err(Error::input(message).at(&Location::of_file(path)));
    }
    account.keep(parts.parts.iter().map(|part| part.mesh.room()).sum());
    Ok(parts)
}

impl Parts {
    fn add(&mut self, name: String, loaded: Loaded) {
        self.dropped_triangles += loaded.dropped_triangles;
        self.warnings.extend(loaded.warnings);
        let mesh = loaded.mesh;
        self.parts.push(Part { name, mesh });
    }

    /// All as one mesh. Texture coordinates and attributes that some of them lack are lost.
    #[must_use]
    pub fn merged(self) -> Mesh {
        let mut parts = self.parts.into_iter();
        let mut mesh = parts.next().map(|part| part.mesh).unwrap_or_default();
        parts.for_each(|part| mesh.append(part.mesh));
        mesh
    }
}

/// What parts lose of a file's materials, in a word.
fn unkept(path: &Path, loaded: &Loaded) -> Vec<Problem> {
    let mut surfaces = loaded.surfaces.iter();
    let message = surfaces.any(|surface| *surface != Surface::MATTE).then(|| {
        "materials are kept by their colours alone: without images, finish, emission and transparency"
            .to_owned()
    });
    warnings(path, Vec::from_iter(message))
}

fn gltf_parts(path: &Path, account: &Account) -> Result<Parts> {
    let scene = gltf::read_gltf(path, &ReadOptions::default(), account)?;
    let part = |part: gltf::GltfPart| {
        let mut mesh = part.mesh;
        if mesh.normals.is_empty() {
            // It is meant to be flat.
            mesh.unshare_vertices();
        }
        let name = part.name;
        Part { name, mesh }
    };
    Ok(Parts {
        parts: scene.parts.into_iter().map(part).collect(),
        dropped_triangles: scene.dropped_triangles,
        warnings: scene.warnings,
    })
}

fn serialized_parts(path: &Path, account: &Account) -> Result<Parts> {
    let mut parts = Parts::default();
    let mut meshes = with_input(path, account, serialized::read_all)?;
    let bounds = meshes.iter().filter_map(Mesh::bounds);
    let bounds = bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    // One origin for all, so that they stay together.
    if let Some(far) = bounds.and_then(Far::of_bounds) {
        let origin = far.origin;
        drop(meshes);
        account.clear();
        meshes = with_input(path, account, |input| {
            serialized::read_all(Input { origin, ..input })
        })?;
        parts.warnings = warnings(path, vec![far.moved()]);
    }
    for mesh in meshes {
        let decoded = Decoded {
            mesh,
            ..Decoded::default()
        };
        parts.add(String::new(), decoded.finish(path));
    }
    Ok(parts)
}

fn obj_parts(path: &Path, account: &Account) -> Result<Parts> {
    /// Keeps step with the triangles where some are dropped.
    const PART: &str = "face_part";
    let bytes = with_input(path, account, |input| input.bytes())?;
    let groups = Groups::of(&bytes);
    let is_split = (2..=MOST).contains(&groups.names.len());
    let mut loaded = read_near(path, &ReadOptions::BARE, account, |origin| {
        let input = Input {
            path,
            length: bytes.len() as u64,
            origin,
            account,
            reader: &mut &bytes[..],
        };
        let mut decoded = obj::read(input, &ReadOptions::BARE)?;
        if is_split {
            decoded.mesh.attributes.push(Attribute {
                name: PART.to_owned(),
                channels: 1,
                per: Per::Face,
                // Exact, for there are not so many parts.
                values: groups.triangles.iter().map(|&part| part as f32).collect(),
            });
        }
        Ok(decoded)
    })?;
    drop(bytes);
    (loaded.mesh.attributes).retain(|attribute| attribute.name != FACE_SURFACE);
    let mut parts = Parts {
        warnings: unkept(path, &loaded),
        ..Parts::default()
    };
    if !is_split {
        parts.add(String::new(), loaded);
        return Ok(parts);
    }
    let of = loaded.mesh.attributes.pop().expect("it was pushed last");
    if loaded.mesh.normals.is_empty() {
        loaded.mesh.compute_normals();
    }
    let mut members = vec![Vec::new(); groups.names.len()];
    for (triangle, part) in (0_u32..).zip(&of.values) {
        members[*part as usize].push(triangle);
    }
    let mut places = vec![NOWHERE; loaded.mesh.positions.len()];
    for (name, members) in groups.names.into_iter().zip(members) {
        if !members.is_empty() {
            let mesh = select(&loaded.mesh, &members, &mut places);
            parts.parts.push(Part { name, mesh });
        }
    }
    parts.dropped_triangles = loaded.dropped_triangles;
    parts.warnings = loaded.warnings;
    Ok(parts)
}

/// Which triangles of an OBJ file belong together.
struct Groups {
    /// In the order of their first lines.
    names: Vec<String>,
    /// The group of each triangle.
    triangles: Vec<u32>,
}

impl Groups {
    /// By the lines `o`, or by `g` where there are none.
    fn of(bytes: &[u8]) -> Self {
        let objects = Self::by(b"o", bytes);
        match objects.names.len() {
            0 | 1 => Self::by(b"g", bytes),
            _ => objects,
        }
    }

    fn by(keyword: &[u8], bytes: &[u8]) -> Self {
        let mut groups = Self {
            names: Vec::new(),
            triangles: Vec::new(),
        };
        let mut known: HashMap<String, u32> = HashMap::new();
        let mut current = None;
        let mut enter = |name: String, names: &mut Vec<String>| {
            *known.entry(name).or_insert_with_key(|name| {
                names.push(name.clone());
                names.len() as u32 - 1
            })
        };
        let mut lines = text::lines(bytes).map(<[u8]>::trim_ascii_end);
        while let Some(mut line) = lines.next() {
            let mut words = line.split(u8::is_ascii_whitespace);
            let first = words.find(|word| !word.is_empty()).unwrap_or_default();
            if first.eq_ignore_ascii_case(keyword) {
                let name: Vec<&[u8]> = words.filter(|word| !word.is_empty()).collect();
                let name = String::from_utf8_lossy(&name.join(&b' ')).into_owned();
                current = Some(enter(name, &mut groups.names));
            }
            let mut corners = 0_usize;
            let mut comment = false;
            loop {
                let continued = line.strip_suffix(b"\\");
                let words = continued
                    .unwrap_or(line)
                    .split(u8::is_ascii_whitespace)
                    .filter(|word| !word.is_empty());
                for word in words {
                    comment |= word[0] == b'#';
                    corners += usize::from(!comment);
                }
                match continued.and_then(|_| lines.next()) {
                    Some(next) => line = next,
                    None => break,
                }
            }
            // The keyword counts as one.
            if first.eq_ignore_ascii_case(b"f") && corners > 3 {
                let group = *current.get_or_insert_with(|| enter(String::new(), &mut groups.names));
                groups.triangles.extend((3..corners).map(|_| group));
            }
        }
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 # 4\no floor one\nf 1 2 3 4\n\
        o wall\ng ignored\nf 1 2 \\\n 5\nv nan 0 0\nf 1 2 6\no floor  one\nf 4 3 5\n";

    fn parts(name: &str, bytes: &[u8]) -> Parts {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        read_parts(&path, &Budget::default()).unwrap()
    }

    #[test]
    fn the_objects_of_an_obj_file_keep_their_triangles_and_the_whole_s_normals() {
        let read = parts("two.obj", TWO.as_bytes());
        let names: Vec<&str> = read.parts.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["", "floor one", "wall"]);
        let counts: Vec<_> = (read.parts.iter())
            .map(|p| (p.mesh.positions.len(), p.mesh.triangles.len()))
            .collect();
        assert_eq!(counts, [(3, 1), (5, 3), (3, 1)]);
        assert_eq!(read.dropped_triangles, 1);
        let mut whole = parts(
            "whole.obj",
            TWO.replace("o ", "# ").replace("g ", "# ").as_bytes(),
        );
        assert_eq!(whole.parts.len(), 1);
        let whole = &mut whole.parts[0].mesh;
        whole.compute_normals();
        let corners = |mesh: &Mesh| -> Vec<_> {
            let of = |i: u32| {
                [mesh.positions[i as usize], mesh.normals[i as usize]].map(|v| v.to_array())
            };
            let mut corners: Vec<_> = mesh.triangles.iter().map(|t| t.map(of)).collect();
            corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
            corners
        };
        let mut apart: Vec<_> = read.parts.iter().flat_map(|p| corners(&p.mesh)).collect();
        apart.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(apart, corners(whole));
    }

    #[test]
    fn groups_serve_where_there_are_no_objects_and_merging_gives_the_triangles_back() {
        let text = TWO.replace("o ", "g ");
        let read = parts("groups.obj", text.as_bytes());
        let names: Vec<&str> = read.parts.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["", "floor one", "ignored"]);
        assert_eq!(read.merged().triangles.len(), 5);
    }
}
