//! A mesh as a binary little-endian PLY file that Étendue and Mitsuba 3 read alike: `x y z`, `nx ny nz` and `s t` (which
//! more programs know as texture coordinates than `u v`) as far as the mesh has them, attributes under the names that [`attributes`](super::attributes) gives back, and faces of a
//! byte and three indices. Rows are made some at a time, so that the mesh is in memory once.

use std::io::{self, Write};
use std::path::Path;

use crate::error::Result;
use crate::file;
use crate::mesh::{Attribute, Mesh, Per};

/// Rows that are handed on at a time.
const ROWS: usize = 1 << 12;

/// Finds out, without leaving anything behind, whether [`write_ply`] could write `path`.
///
/// # Errors
/// Where it could not.
pub fn check_writable(path: &Path) -> Result<()> {
    file::check_writable(path)
}

/// Writes `mesh` as the file `path`, which is there whole or not at all.
///
/// # Errors
/// Where the file system refuses.
pub fn write_ply(path: &Path, mesh: &Mesh) -> Result<()> {
    file::stream_atomically(path, |out| write(out, mesh))
}

/// Writes a text, such as a scene around meshes, as the file `path`, which is there whole or not at all.
///
/// # Errors
/// Where the file system refuses.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    file::write_atomically(path, text.as_bytes())
}

fn write(out: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    out.write_all(header(mesh).as_bytes())?;
    let vertices = rows(mesh, Per::Vertex);
    stream(out, mesh.positions.len(), |i, row| {
        let mut push = |numbers: &[f32]| {
            numbers
                .iter()
                .for_each(|x| row.extend_from_slice(&x.to_le_bytes()));
        };
        push(&mesh.positions[i].to_array());
        if let Some(normal) = mesh.normals.get(i) {
            push(&normal.to_array());
        }
        if let Some(uv) = mesh.uvs.get(i) {
            push(&uv.to_array());
        }
        for attribute in &vertices {
            push(attribute.row(i));
        }
    })?;
    let faces = rows(mesh, Per::Face);
    stream(out, mesh.triangles.len(), |i, row| {
        row.push(3);
        for corner in mesh.triangles[i] {
            row.extend_from_slice(&corner.to_le_bytes());
        }
        for x in faces.iter().flat_map(|attribute| attribute.row(i)) {
            row.extend_from_slice(&x.to_le_bytes());
        }
    })
}

fn rows(mesh: &Mesh, per: Per) -> Vec<&Attribute> {
    mesh.attributes.iter().filter(|a| a.per == per).collect()
}

fn stream(out: &mut dyn Write, count: usize, row: impl Fn(usize, &mut Vec<u8>)) -> io::Result<()> {
    let mut bytes = Vec::new();
    for first in (0..count).step_by(ROWS) {
        bytes.clear();
        (first..count.min(first + ROWS)).for_each(|i| row(i, &mut bytes));
        out.write_all(&bytes)?;
    }
    Ok(())
}

fn header(mesh: &Mesh) -> String {
    let mut names = vec!["x", "y", "z"];
    if !mesh.normals.is_empty() {
        names.extend(["nx", "ny", "nz"]);
    }
    if !mesh.uvs.is_empty() {
        names.extend(["s", "t"]);
    }
    let mut names: Vec<String> = names.into_iter().map(str::to_owned).collect();
    names.extend(rows(mesh, Per::Vertex).into_iter().flat_map(channels));
    let properties = |names: &[String]| -> String {
        let lines = names.iter().map(|name| format!("property float {name}\n"));
        lines.collect()
    };
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    // What every program reads, unless it does not reach.
    let index = match i32::try_from(vertices) {
        Ok(_) => "int",
        Err(_) => "uint",
    };
    let faces: Vec<String> = rows(mesh, Per::Face)
        .into_iter()
        .flat_map(channels)
        .collect();
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment etendue {}\nelement vertex {vertices}\n{}\
         element face {triangles}\nproperty list uchar {index} vertex_indices\n{}end_header\n",
        env!("CARGO_PKG_VERSION"),
        properties(&names),
        properties(&faces),
    )
}

/// The properties that are read as this attribute again.
fn channels(attribute: &Attribute) -> Vec<String> {
    let stem = match attribute.per {
        Per::Vertex => attribute.name.strip_prefix("vertex_"),
        Per::Face => attribute.name.strip_prefix("face_"),
    };
    let stem = stem.unwrap_or(&attribute.name);
    let count = attribute.channels;
    match (stem, count) {
        ("color", 3 | 4) => (["r", "g", "b", "a"].into_iter().take(count))
            .map(str::to_owned)
            .collect(),
        _ => (0..count).map(|i| format!("{stem}_{i}")).collect(),
    }
}
