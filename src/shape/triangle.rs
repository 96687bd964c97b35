//! `triangle`, Étendue's own: the corners `p0`, `p1` and `p2`, counter-clockwise seen from the front; with normals `n0`,
//! `n1` and `n2` or the triangle's own, and texture coordinates `uv` (a string of three pairs) or (0, 0), (1, 0) and
//! (0, 1); under `to_world`, `face_normals` and `flip_normals`.

use glam::{DMat4, DVec3, Vec2, Vec3};

use super::{Shape, mesh::place, polygon};
use crate::description::Properties;
use crate::description::declared::{Plugin, string, vector};
use crate::error::Result;
use crate::mesh::Mesh;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "a triangle",
    properties: &[
        super::COMMON,
        super::MESH,
        &[
            vector("p0", [0.0; 3], "first corner").required(),
            vector(
                "p1",
                [0.0; 3],
                "second corner, counter-clockwise seen from the front",
            )
            .required(),
            vector("p2", [0.0; 3], "third corner").required(),
            vector("n0", [0.0; 3], "normal at the first corner").absent("the triangle's"),
            vector("n1", [0.0; 3], "normal at the second corner").absent("the triangle's"),
            vector("n2", [0.0; 3], "normal at the third corner").absent("the triangle's"),
            string("uv", "", "three pairs").absent("0,0 1,0 0,1"),
        ],
    ],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let corner = |name| properties.vector(name);
    let [a, b, c] = [corner("p0")?, corner("p1")?, corner("p2")?];
    if (b - a).cross(c - a) == DVec3::ZERO {
        return Err(properties.error("", "the corners of a triangle cannot lie on a line"));
    }
    let uvs = match polygon::uvs(properties, 3)? {
        Some(uvs) => uvs,
        None => vec![Vec2::ZERO, Vec2::X, Vec2::Y],
    };
    let mesh = Mesh {
        positions: [a, b, c].map(|p| p.as_vec3()).to_vec(),
        normals: normals(properties)?,
        uvs,
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    place(mesh, properties, to_world)
}

/// `n0`, `n1` and `n2`, or none.
fn normals(properties: &Properties<'_>) -> Result<Vec<Vec3>> {
    let mut normals = Vec::new();
    for name in ["n0", "n1", "n2"] {
        let Some(normal) = properties.given::<DVec3>(name)? else {
            continue;
        };
        let Some(normal) = normal.try_normalize() else {
            return Err(properties.error(name, "a normal cannot be zero"));
        };
        normals.push(normal.as_vec3());
    }
    match normals.len() {
        0 | 3 => Ok(normals),
        _ => Err(properties
            .error("", "a triangle has a normal at each corner or at none")
            .help("give n0, n1 and n2")),
    }
}
