//! STL, binary and ASCII (3D Systems, 1989): triangles without shared vertices. Corners at exactly the same
//! place become one vertex, so that normals can be smooth; the file's face normals are not used, as the
//! winding says the same. A file is binary, whatever text it begins with, where its length is 84 + 50 n
//! with n from its header, or where there is a zero byte near its beginning.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::Mesh;
use super::read::{Decoded, Input, ReadOptions};
use crate::budget::Account;
use crate::error::{Error, Location, Result};
use crate::file::text;

/// A comment of 80 bytes and the count of triangles.
const HEADER: usize = 84;
/// A normal and three corners of f32, and two bytes of attributes.
const ROW: usize = 50;
const ATTRIBUTES: usize = 48;

pub(super) fn read(input: Input<'_>, _options: &ReadOptions) -> Result<Decoded> {
    let path = input.path;
    let (origin, account) = (input.origin, input.account);
    let bytes = input.bytes()?;
    let count = bytes.get(HEADER - 4..).and_then(|b| b.first_chunk());
    let count = count.map(|&b| u32::from_le_bytes(b) as u64);
    let promised = count.map(|n| HEADER as u64 + n * ROW as u64);
    let mut builder = Builder {
        mesh: Mesh::default(),
        origin,
        vertices: HashMap::new(),
        account,
        covered: 0,
    };
    let mut warnings = Vec::new();
    let first = text::without_mark(&bytes).trim_ascii_start();
    let is_text = (first.get(..5)).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        && !bytes[..bytes.len().min(1024)].contains(&0);
    if is_text && promised != Some(bytes.len() as u64) {
        builder.read_text(&bytes, path)?;
    } else {
        let (Some(count), Some(promised)) = (count, promised) else {
            return Err(
                Error::input("the file is no STL: it is too short for a binary one")
                    .at(&Location::of_file(path))
                    .help("an ASCII file begins with \"solid\""),
            );
        };
        if promised > bytes.len() as u64 {
            let message = format!(
                "the file is cut short, or no STL: {count} triangles are promised, {promised} bytes, and it has {}",
                bytes.len()
            );
            return Err(Error::input(message).at(&Location::of_file(path)));
        }
        let end = promised as usize;
        if end < bytes.len() {
            warnings.push(format!(
                "{} bytes after the last triangle are not read",
                bytes.len() - end
            ));
        }
        let rows = &bytes[HEADER..end];
        let colored = rows.chunks_exact(ROW);
        let colored = colored.filter(|row| row[ATTRIBUTES..] != [0; 2]).count();
        if colored > 0 {
            warnings.push(format!(
                "{colored} triangles have attribute bytes, which some programs take for colours: they are left out"
            ));
        }
        builder.read_binary(rows)?;
    }
    Ok(Decoded {
        mesh: builder.mesh,
        warnings,
        ..Decoded::default()
    })
}

struct Builder<'a> {
    mesh: Mesh,
    /// What is subtracted from positions.
    origin: DVec3,
    /// The vertex at a place.
    vertices: HashMap<[u32; 3], u32>,
    /// Who is asked for memory, and what was taken.
    account: &'a Account,
    covered: u64,
}

impl Builder<'_> {
    fn read_binary(&mut self, rows: &[u8]) -> Result<()> {
        self.account.take_rows((rows.len() / ROW) as u64, 12)?;
        self.mesh.triangles.reserve_exact(rows.len() / ROW);
        for row in rows.chunks_exact(ROW) {
            let number = |at: usize| {
                f32::from_le_bytes(*row[at..].first_chunk().expect("a row has 50 bytes"))
            };
            let corner = |at: usize| Vec3::new(number(at), number(at + 4), number(at + 8));
            let place = |at: usize| (corner(at).as_dvec3() - self.origin).as_vec3();
            self.push([12, 24, 36].map(place))?;
        }
        Ok(())
    }

    /// `vertex x y z`, three times a facet; the words between, in upper or lower case, say nothing more.
    fn read_text(&mut self, bytes: &[u8], path: &Path) -> Result<()> {
        let mut corners = Vec::new();
        for (line, number) in text::lines(bytes).zip(1..) {
            let wrong = |message: &str| Error::input(message).at(&Location::of_line(path, number));
            let mut words = line
                .split(u8::is_ascii_whitespace)
                .filter(|w| !w.is_empty());
            let first = words.next().map(<[u8]>::to_ascii_lowercase);
            match first.as_deref() {
                Some(b"vertex") => {
                    let numbers = words.map(|w| std::str::from_utf8(w).ok()?.parse().ok());
                    let numbers: Option<Vec<f64>> = numbers.take(4).collect();
                    match numbers.as_deref() {
                        Some(&[x, y, z]) => {
                            corners.push((DVec3::new(x, y, z) - self.origin).as_vec3())
                        }
                        _ => return Err(wrong("three numbers are wanted after \"vertex\"")),
                    }
                }
                // "end loop" and the like stand for "endloop".
                Some(b"endloop" | b"endfacet" | b"end" | b"outer" | b"facet") => {
                    match corners[..] {
                        [] => {}
                        [a, b, c] => self.push([a, b, c])?,
                        _ => return Err(wrong("a facet has three vertices, and this one has not")),
                    }
                    corners.clear();
                }
                None | Some(b"solid" | b"endsolid") => {}
                Some(word) => {
                    let word = String::from_utf8_lossy(&word[..word.len().min(32)]);
                    return Err(wrong(&format!("unknown word {word:?}")));
                }
            }
        }
        if corners.is_empty() {
            Ok(())
        } else {
            Err(Error::input("the file ends within a facet").at(&Location::of_file(path)))
        }
    }

    fn push(&mut self, corners: [Vec3; 3]) -> Result<()> {
        /// Triangles between two askings, and bytes of a vertex: in its list, in the table, and with a normal.
        const OFTEN: usize = 1 << 12;
        const VERTEX: usize = 84;
        let count = self.mesh.triangles.len();
        if count.is_multiple_of(OFTEN) {
            // Each triangle may have vertices of its own.
            let vertices = self.mesh.positions.len() + 3 * OFTEN;
            let bytes = self.mesh.triangles.capacity().max(count + OFTEN) * 12 + vertices * VERTEX;
            self.account.cover(&mut self.covered, bytes as u64)?;
        }
        let triangle = corners.map(|corner| {
            // −0 and 0 are one place.
            let key = (corner + 0.0).to_array().map(f32::to_bits);
            *self.vertices.entry(key).or_insert_with(|| {
                self.mesh.positions.push(corner);
                // A file of 2³² triangles has a count that wraps, and ASCII ones of this size (half a
                // terabyte) do not fit into memory.
                (self.mesh.positions.len() - 1) as u32
            })
        });
        self.mesh.triangles.push(triangle);
        Ok(())
    }
}
