//! Texture coordinates of faces' corners, as MeshLab writes them, become those of vertices: a vertex whose corners differ
//! in them is there several times.

use std::collections::HashMap;

use glam::Vec2;

use crate::budget::Account;
use crate::error::{Error, Result};
use crate::mesh::{Mesh, Per};

/// Gives the mesh the texture coordinates of its triangles' corners. Normals that it lacks are computed before, so that it
/// stays smooth where vertices part.
pub(super) fn settle(mesh: &mut Mesh, wedges: &[[Vec2; 3]], account: &Account) -> Result<()> {
    const CORNER: usize = 64;
    account.take_rows(3 * wedges.len() as u64, CORNER)?;
    if mesh.normals.is_empty() {
        mesh.compute_normals();
    }
    let count = mesh.positions.len();
    let bits = |uv: Vec2| uv.to_array().map(f32::to_bits);
    let mut uvs = vec![Vec2::ZERO; count];
    let mut met = vec![false; count];
    let mut others: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
    // Of each new vertex the old one.
    let mut copies: Vec<u32> = Vec::new();
    for (triangle, corners) in mesh.triangles.iter_mut().zip(wedges) {
        for (vertex, &uv) in triangle.iter_mut().zip(corners) {
            let old = *vertex as usize;
            if !met[old] {
                met[old] = true;
                uvs[old] = uv;
            } else if bits(uvs[old]) != bits(uv) {
                let next = u32::try_from(count + copies.len());
                let next = next.map_err(|_| {
                    Error::input(
                        "vertices by texture coordinates are more than 32-bit indices reach",
                    )
                })?;
                *vertex = *others.entry((*vertex, bits(uv))).or_insert(next);
                if *vertex == next {
                    copies.push(old as u32);
                    uvs.push(uv);
                }
            }
        }
    }
    for &old in &copies {
        let old = old as usize;
        mesh.positions.push(mesh.positions[old]);
        mesh.normals.push(mesh.normals[old]);
    }
    for attribute in mesh.attributes.iter_mut().filter(|a| a.per == Per::Vertex) {
        for &old in &copies {
            let row = attribute.row(old as usize).to_vec();
            attribute.values.extend(row);
        }
    }
    mesh.uvs = uvs;
    Ok(())
}
