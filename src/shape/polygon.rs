//! `polygon`, Étendue's own: the flat area inside the corners `p0`, `p1`, `p2` and so on, counter-clockwise seen from
//! the front, which may be concave but must not cross itself; under `to_world` and `flip_normals`. Texture coordinates
//! are `uv` (a string of as many pairs), or else [0, 1]² is the rectangle around the polygon whose u runs along its first
//! edge. Its plane is Newell's (Sutherland, Sproull and Schumacker 1974); ears are clipped by `earcut`.

use glam::{DMat4, DVec2, DVec3, Vec2};

use super::{Shape, mesh::place};
use crate::description::declared::{Plugin, string, vector};
use crate::description::{Properties, Value};
use crate::error::{Error, Result};
use crate::mesh::{Mesh, triangulate};

/// The most corners, for every edge is held against every other.
const MAX_CORNERS: usize = 4096;
/// How far from the common plane a corner may lie, as a part of the polygon's size.
const FLATNESS: f64 = 1e-4;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "a flat polygon, which may be concave",
    properties: &[
        super::COMMON,
        super::MESH,
        &[
            vector(
                "p#",
                [0.0; 3],
                "the corners p0, p1, …, counter-clockwise seen from the front",
            )
            .required(),
            string("uv", "", "as many pairs as corners").absent("from its first edge"),
        ],
    ],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let corners = corners(properties)?;
    let located = |error: Error| error.at(properties.location());
    let normal = plane(&corners).map_err(located)?;
    let along = (corners[1] - corners[0]).reject_from(normal).normalize();
    let up = normal.cross(along);
    let flat: Vec<DVec2> = (corners.iter().map(|p| p - corners[0]))
        .map(|p| DVec2::new(p.dot(along), p.dot(up)))
        .collect();
    if let Some(message) = crossing(&flat) {
        return Err(properties.error("", message));
    }
    let Some(triangles) = triangulate(&flat) else {
        return Err(properties.error("", "the polygon is too thin to be cut into triangles"));
    };
    let uvs = match uvs(properties, corners.len())? {
        Some(uvs) => uvs,
        None => {
            let (low, high) = (flat.iter()).fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |b, p| {
                (b.0.min(*p), b.1.max(*p))
            });
            let uv = |p: &DVec2| ((p - low) / (high - low)).as_vec2();
            flat.iter().map(uv).collect()
        }
    };
    let mesh = Mesh {
        positions: corners.iter().map(|p| p.as_vec3()).collect(),
        normals: vec![normal.as_vec3(); corners.len()],
        uvs,
        triangles,
        ..Mesh::default()
    };
    place(mesh, properties, to_world)
}

/// `p0`, `p1` and so on.
fn corners(properties: &Properties<'_>) -> Result<Vec<DVec3>> {
    let mut numbered = Vec::new();
    for property in properties.all() {
        let number = property.name.strip_prefix('p').map(str::parse::<usize>);
        let (Some(Ok(number)), Value::Vector(point)) = (number, &property.value) else {
            continue;
        };
        if property.name == format!("p{number}") {
            numbered.push((number, *point));
        }
    }
    numbered.sort_by_key(|(number, _)| *number);
    if let Some(missing) = (0..numbered.len()).find(|i| numbered[*i].0 != *i) {
        let message = format!("the polygon has no corner p{missing}, and has further ones");
        return Err(properties.error("", message));
    }
    match numbered.len() {
        3..=MAX_CORNERS => Ok(numbered.into_iter().map(|(_, point)| point).collect()),
        0..3 => Err(properties
            .error("", "a polygon needs three corners at least")
            .help(r#"add <point name="p0" value="…"/>, p1, p2 and so on"#)),
        n => Err(properties
            .error("", format!("a polygon of {n} corners is too large"))
            .help(format!("{MAX_CORNERS} are allowed; a mesh can have more"))),
    }
}

/// The property `uv`: as many pairs as there are corners.
pub(super) fn uvs(properties: &Properties<'_>, corners: usize) -> Result<Option<Vec<Vec2>>> {
    let Some(text) = properties.given::<&str>("uv")? else {
        return Ok(None);
    };
    let words = text.split(|c: char| c == ',' || c.is_whitespace());
    let numbers = words.filter(|w| !w.is_empty()).map(str::parse::<f32>);
    let numbers: Option<Vec<f32>> = (numbers.map(|n| n.ok().filter(|n| n.is_finite()))).collect();
    match numbers {
        Some(numbers) if numbers.len() == 2 * corners => Ok(Some(
            numbers.chunks(2).map(|p| Vec2::new(p[0], p[1])).collect(),
        )),
        _ => {
            let message = format!("uv is {corners} pairs of numbers here");
            Err(properties.error("uv", message))
        }
    }
}

/// The unit normal of the plane in which all corners lie, or what is wrong with them.
fn plane(corners: &[DVec3]) -> Result<DVec3> {
    let next = |i: usize| corners[(i + 1) % corners.len()];
    if let Some(i) = (0..corners.len()).find(|i| corners[*i] == next(*i)) {
        let message = format!("the polygon's corner p{i} is the same as the next");
        return Err(Error::input(message));
    }
    let from_first = |p: DVec3| p - corners[0];
    let doubled: DVec3 = (0..corners.len())
        .map(|i| from_first(corners[i]).cross(from_first(next(i))))
        .sum();
    let size = corners
        .iter()
        .map(|p| from_first(*p).length())
        .fold(0.0, f64::max);
    let area = doubled.length();
    if !(area > 1e-12 * size * size && area.is_finite()) {
        return Err(Error::input(
            "the polygon encloses no area, or none that is finite",
        ));
    }
    let normal = doubled.normalize();
    let off = |p: &DVec3| from_first(*p).dot(normal).abs();
    match corners.iter().position(|p| off(p) > FLATNESS * size) {
        Some(i) => Err(Error::input(format!(
            "the polygon is not flat: corner p{i} lies {:.3e} off its plane",
            off(&corners[i])
        ))),
        None => Ok(normal),
    }
}

/// Which two edges meet where they must not.
fn crossing(corners: &[DVec2]) -> Option<String> {
    let n = corners.len();
    let edge = |i: usize| [corners[i], corners[(i + 1) % n]];
    let name = |i: usize| format!("from p{i} to p{}", (i + 1) % n);
    for i in 0..n {
        let ([a, b], [_, c]) = (edge(i), edge((i + 1) % n));
        if (b - a).perp_dot(c - b) == 0.0 && (b - a).dot(c - b) < 0.0 {
            return Some(format!("the polygon turns back on its edge {}", name(i)));
        }
        for j in i + 2..n {
            let neighbours = (j + 1) % n == i;
            if !neighbours && meet(edge(i), edge(j)) {
                return Some(format!(
                    "the polygon crosses itself: its edges {} and {} meet",
                    name(i),
                    name(j)
                ));
            }
        }
    }
    None
}

/// Whether two segments have a point in common.
fn meet([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    let (s, t) = (
        [side(a, b, c), side(a, b, d)],
        [side(c, d, a), side(c, d, b)],
    );
    if s == [0.0; 2] {
        // On one line: their boxes tell.
        let overlap = a.min(b).cmple(c.max(d)) & c.min(d).cmple(a.max(b));
        return overlap.all();
    }
    s[0] * s[1] <= 0.0 && t[0] * t[1] <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_meet_where_they_cross_touch_and_overlap() {
        let segment = |x0, y0, x1, y1| [DVec2::new(x0, y0), DVec2::new(x1, y1)];
        let base = segment(0.0, 0.0, 2.0, 0.0);
        for (other, expected) in [
            (segment(1.0, -1.0, 1.0, 1.0), true),
            (segment(1.0, 0.0, 1.0, 1.0), true),
            (segment(1.0, 0.0, 3.0, 0.0), true),
            (segment(3.0, 0.0, 4.0, 0.0), false),
            (segment(1.0, 0.1, 1.0, 1.0), false),
            (segment(3.0, -1.0, 3.0, 1.0), false),
        ] {
            assert_eq!(meet(base, other), expected, "{other:?}");
            assert_eq!(meet(other, base), expected, "{other:?}");
        }
    }
}
