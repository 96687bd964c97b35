//! Wavefront OBJ. All groups and objects of a file make one mesh, as in Mitsuba, so that normals are smooth
//! across them (`tobj` splits the file there, and reports neither lines nor missing indices: the tests use
//! it to compare). Corners `v/vt/vn` that are equal share a vertex; vertices stand in the order in which
//! faces first name them. Polygons are fans around their first corner; negative indices count back from
//! the last; lines that are neither `v`, `vt`, `vn` nor `f` are passed over, but for those that name
//! materials where they are asked for.

use std::collections::HashMap;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::mtl::{BARE_COLOR, Materials, keyword};
use super::read::{Decoded, Input, ReadOptions};
use super::{Attribute, Mesh, Per};
use crate::error::{Error, Location, Result};

/// What a line gives, or what is wrong with it, in words.
type OfLine<T> = std::result::Result<T, String>;

/// No vertex, or no index in a corner.
const NONE: u32 = u32::MAX;

pub(super) fn read(input: Input<'_>, options: &ReadOptions) -> Result<Decoded> {
    let path = input.path;
    let mut bytes = input.bytes()?;
    join_continued_lines(&mut bytes);
    let mut obj = Obj::default();
    let mut start = 0;
    for line in bytes.split(|&b| b == b'\n') {
        obj.line(line).map_err(|message| {
            let before = bytes[..start]
                .iter()
                .filter(|&&b| b == b'\n' || b == JOINED)
                .count();
            let line = u32::try_from(before + 1).unwrap_or(0);
            Error::input(message).at(&Location::of_line(path, line))
        })?;
        start += line.len() + 1;
    }
    check_text(&bytes, &obj, path)?;
    let colors = options.materials.then(|| obj.face_colors(path));
    let mut decoded = obj.finish(options);
    if let Some(FaceColors {
        attribute,
        warnings,
    }) = colors
    {
        decoded.mesh.attributes.extend(attribute);
        decoded.warnings.extend(warnings);
    }
    Ok(decoded)
}

/// Stands for the line end after a backslash: a blank that no file has otherwise.
const JOINED: u8 = b'\x0c';

/// A backslash at the end of a line continues it.
fn join_continued_lines(bytes: &mut [u8]) {
    for end in 1..bytes.len() {
        if bytes[end] == b'\n' {
            let last = if end > 1 && bytes[end - 1] == b'\r' {
                end - 2
            } else {
                end - 1
            };
            if bytes[last] == b'\\' {
                bytes[last] = b' ';
                bytes[end] = JOINED;
            }
        }
    }
}

/// A file of which nothing was understood is no OBJ.
fn check_text(bytes: &[u8], obj: &Obj, path: &Path) -> Result<()> {
    if obj.positions.is_empty() {
        let message = if bytes.is_empty() {
            "the file is empty"
        } else {
            "the file has no vertices"
        };
        return Err(Error::input(message)
            .at(&Location::of_file(path))
            .help("an OBJ file has lines such as \"v 0 0 1\" and \"f 1 2 3\""));
    }
    Ok(())
}

#[derive(Default)]
struct Obj {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// Of each vertex of the mesh: position, uv and normal, `NONE` where it has none.
    vertices: Vec<[u32; 3]>,
    /// The first vertex made for each position.
    first: Vec<u32>,
    /// The other vertices.
    others: HashMap<[u32; 3], u32>,
    triangles: Vec<[u32; 3]>,
    /// Faces of fewer than three corners.
    degenerate: usize,
    /// What the `mtllib` lines name.
    libraries: Vec<Vec<u8>>,
    /// What the `usemtl` lines name, in the order of the triangles.
    uses: Vec<Use>,
}

/// A material in use, until the next one.
struct Use {
    /// The first triangle that has it.
    from: usize,
    name: Vec<u8>,
}

/// What the materials of a file come to.
struct FaceColors {
    /// `None`: no face has a colour.
    attribute: Option<Attribute>,
    warnings: Vec<String>,
}

impl Obj {
    fn line(&mut self, line: &[u8]) -> OfLine<()> {
        let mut words = line
            .split(u8::is_ascii_whitespace)
            .filter(|w| !w.is_empty());
        match words.next() {
            Some(b"v") => {
                let position = numbers(&mut words, 3)?;
                new_index(self.positions.len())?;
                self.positions.push(Vec3::from_array(position));
            }
            Some(b"vt") => {
                let [u, v, _] = numbers(&mut words, 1)?;
                self.uvs.push(Vec2::new(u, v));
            }
            Some(b"vn") => self.normals.push(Vec3::from_array(numbers(&mut words, 3)?)),
            Some(b"f") => return self.face(words),
            Some(b"mtllib") => self.libraries.push(keyword(line).1.to_vec()),
            Some(b"usemtl") => {
                let (from, name) = (self.triangles.len(), keyword(line).1.to_vec());
                self.uses.pop_if(|last| last.from == from);
                self.uses.push(Use { from, name });
            }
            _ => {}
        }
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> OfLine<()> {
        let mut corners = 0;
        let (mut first, mut previous) = (NONE, NONE);
        for word in words.take_while(|w| w[0] != b'#') {
            let corner = self.corner(word)?;
            let vertex = self.vertex(corner)?;
            if corners == 0 {
                first = vertex;
            } else if corners > 1 {
                self.triangles.push([first, previous, vertex]);
            }
            previous = vertex;
            corners += 1;
        }
        self.degenerate += usize::from(corners < 3);
        Ok(())
    }

    /// The indices that `v`, `v/vt`, `v//vn` or `v/vt/vn` name, from 0.
    fn corner(&self, word: &[u8]) -> OfLine<[u32; 3]> {
        let kinds = [
            ("vertex", self.positions.len()),
            ("texture coordinate", self.uvs.len()),
            ("normal", self.normals.len()),
        ];
        let mut corner = [NONE; 3];
        let mut parts = word.split(|&b| b == b'/');
        for (i, (kind, count)) in kinds.into_iter().enumerate() {
            match parts.next() {
                None => break,
                Some([]) if i > 0 => {}
                Some(part) => corner[i] = index(part, count, kind, word)?,
            }
        }
        match parts.next() {
            None => Ok(corner),
            Some(_) => Err(malformed(word)),
        }
    }

    /// The vertex of the mesh for a corner.
    fn vertex(&mut self, corner: [u32; 3]) -> OfLine<u32> {
        self.first.resize(self.positions.len(), NONE);
        let next = new_index(self.vertices.len())?;
        let first = &mut self.first[corner[0] as usize];
        let vertex = if *first == NONE {
            *first = next;
            next
        } else if self.vertices[*first as usize] == corner {
            return Ok(*first);
        } else {
            *self.others.entry(corner).or_insert(next)
        };
        if vertex == next {
            self.vertices.push(corner);
        }
        Ok(vertex)
    }

    /// The colour of each face's material, from the libraries beside the file `path`.
    fn face_colors(&self, path: &Path) -> FaceColors {
        let mut materials = Materials::read(path, &self.libraries);
        let mut warnings = std::mem::take(&mut materials.warnings);
        let unknown = (self.uses.iter()).find(|u| !u.name.is_empty() && !materials.has(&u.name));
        if let (Some(Use { name, .. }), false) = (unknown, self.libraries.is_empty()) {
            let name = shown(name);
            warnings.push(format!("no library has the material {name}"));
        }
        let colors: Vec<_> = (self.uses.iter())
            .map(|u| materials.color(&u.name))
            .collect();
        let attribute = colors.iter().any(Option::is_some).then(|| {
            let mut values = BARE_COLOR.repeat(self.uses[0].from);
            let ends = self.uses[1..].iter().map(|u| u.from);
            let ends = ends.chain([self.triangles.len()]);
            for ((u, color), end) in self.uses.iter().zip(colors).zip(ends) {
                values.extend(color.unwrap_or(BARE_COLOR).repeat(end - u.from));
            }
            Attribute {
                name: "face_color".to_owned(),
                channels: 3,
                per: Per::Face,
                values,
            }
        });
        FaceColors {
            attribute,
            warnings,
        }
    }

    fn finish(self, options: &ReadOptions) -> Decoded {
        let any = |part: usize| self.vertices.iter().any(|v| v[part] != NONE);
        let mut mesh = Mesh {
            positions: self
                .vertices
                .iter()
                .map(|v| self.positions[v[0] as usize])
                .collect(),
            triangles: self.triangles,
            ..Mesh::default()
        };
        let mut warnings = Vec::new();
        if any(1) {
            let uv = |v: &[u32; 3]| self.uvs.get(v[1] as usize).copied().unwrap_or_default();
            mesh.uvs = self.vertices.iter().map(uv).collect();
            if options.flip_tex_coords.unwrap_or(true) {
                mesh.flip_uvs();
            }
        }
        if any(2) {
            // Those that are missing stay 0, which the check of the mesh mends.
            let normal =
                |v: &[u32; 3]| self.normals.get(v[2] as usize).copied().unwrap_or_default();
            mesh.normals = self.vertices.iter().map(normal).collect();
        }
        if self.degenerate > 0 {
            let n = self.degenerate;
            warnings.push(format!(
                "{n} faces left out: they have fewer than three corners"
            ));
        }
        Decoded { mesh, warnings }
    }
}

/// The index of one more thing where there are `count`.
fn new_index(count: usize) -> OfLine<u32> {
    let index = u32::try_from(count).ok().filter(|&i| i != NONE);
    index.ok_or_else(|| "there are more vertices than 32-bit indices reach".to_owned())
}

/// The first three of `words` as numbers, of which `least` must be there.
fn numbers<'a>(words: &mut impl Iterator<Item = &'a [u8]>, least: usize) -> OfLine<[f32; 3]> {
    let mut numbers = [0.0; 3];
    for (i, number) in numbers.iter_mut().enumerate() {
        match words.next().filter(|w| w[0] != b'#') {
            Some(word) => {
                *number =
                    parse(word).ok_or_else(|| format!("a number is wanted, not {}", shown(word)))?
            }
            None if i < least => {
                return Err(format!("{least} numbers are wanted, and there are {i}"));
            }
            None => break,
        }
    }
    Ok(numbers)
}

/// The index from 0 that `part` of `word` says, of `count` things called `kind`.
fn index(part: &[u8], count: usize, kind: &str, word: &[u8]) -> OfLine<u32> {
    let said: i64 = parse(part).ok_or_else(|| malformed(word))?;
    let length = i64::try_from(count).unwrap_or(i64::MAX);
    let index = if said > 0 {
        said - 1
    } else {
        said.saturating_add(length)
    };
    if said == 0 || !(0..length).contains(&index) {
        return Err(format!(
            "{kind} {said} is out of range; {count} stand before this line"
        ));
    }
    u32::try_from(index)
        .ok()
        .filter(|&i| i != NONE)
        .ok_or_else(|| format!("{kind} {said} is beyond 32 bits"))
}

fn malformed(word: &[u8]) -> String {
    format!(
        "a corner is wanted, such as 1 or 1/2/3, not {}",
        shown(word)
    )
}

fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn shown(word: &[u8]) -> String {
    format!("{:?}", String::from_utf8_lossy(&word[..word.len().min(32)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::read::testing::decode;

    fn mesh(text: &str) -> Mesh {
        decode("test.obj", text.as_bytes(), &ReadOptions::default())
            .unwrap()
            .mesh
    }

    #[test]
    fn vertices_come_in_the_order_of_the_faces_and_are_shared_where_all_indices_agree() {
        let mesh = mesh(
            "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 9 9 9\nv 0 0 3\nvn 0 0 2\nvn 0 1 1\nvt 0.25 0.75\nvt 1 1\n\
             f 1/1/1 3/2/1 2/1/2\nf 1/1/2 2/2/2 5/1/1\nf 3/2/1 2/1/2 5/1/1\n",
        );
        // As Mitsuba 3.9.1 gives it.
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5], [1, 2, 5]]);
        let (x, y, z) = (Vec3::X, 2.0 * Vec3::Y, 3.0 * Vec3::Z);
        assert_eq!(mesh.positions, [Vec3::ZERO, y, x, Vec3::ZERO, x, z]);
        let corner = Vec2::new(0.25, 0.25);
        assert_eq!(mesh.uvs, [corner, Vec2::X, corner, corner, Vec2::X, corner]);
        assert!(mesh.normals[2].distance(Vec3::new(0.0, 0.5, 0.5).normalize()) < 1e-6);
    }

    #[test]
    fn groups_polygons_negative_indices_comments_and_continued_lines_are_understood() {
        let mesh = mesh(
            "o a\r\nv 0 0 0 # a comment\r\nv 1 0 0 1 0.5 0.5\r\n  v 1 1 0\nv 0 1 0\ng one\nf 1 2 \\\r\n 3 4 # four\n\
             g two\nusemtl x\ns off\nv 0 0 1\nf -1 -2/ -5//\nl 1 2\n\nf 1 2\n",
        );
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 3, 0]]);
        assert!(mesh.normals.is_empty() && mesh.uvs.is_empty());
    }

    #[test]
    fn normals_and_texture_coordinates_that_some_corners_lack_are_filled() {
        let mesh = mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0.5\nvn 0 1 0\nf 1//1 2/1 3\n");
        assert_eq!(mesh.normals, [Vec3::Y, Vec3::Z, Vec3::Z]);
        assert_eq!(mesh.uvs[1], Vec2::splat(0.5));
    }

    const SQUARES: &str = "mtllib one.mtl\nmtllib absent.mtl two.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
        f 1 2 3\nusemtl red\nusemtl dark blue\nf 1 2 3 4\nusemtl red\nf 1 2 3\nf 2 3 4\nusemtl\nf 3 4 1\n";

    /// `SQUARES` with these libraries, as read with its materials.
    fn with_libraries(one: &str, two: &str) -> crate::mesh::Loaded {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("squares.obj");
        std::fs::write(&path, SQUARES).unwrap();
        std::fs::write(folder.path().join("one.mtl"), one).unwrap();
        std::fs::write(folder.path().join("two.mtl"), two).unwrap();
        let plain = crate::mesh::read(&path, &ReadOptions::default()).unwrap();
        assert!(plain.mesh.attributes.is_empty() && plain.warnings.is_empty());
        let options = ReadOptions {
            materials: true,
            ..ReadOptions::default()
        };
        crate::mesh::read(&path, &options).unwrap()
    }

    #[test]
    fn each_face_has_the_colour_of_its_material() {
        let blue =
            "newmtl dark blue\nKd 0 0 0.5\nmap_Kd sky.png\nnewmtl red\nKd 0 1 0\nmap_Kd a.png\n";
        let loaded = with_libraries("newmtl red\nKd 0.9 0.1 0.1\n", blue);
        let (red, blue) = ([0.9, 0.1, 0.1], [0.0, 0.0, 0.5]);
        let attribute = &loaded.mesh.attributes[0];
        assert_eq!((attribute.channels, attribute.per), (3, Per::Face));
        assert_eq!(attribute.name, "face_color");
        let wanted = [BARE_COLOR, blue, blue, red, red, BARE_COLOR];
        assert_eq!(attribute.values, wanted.concat());
        let said: Vec<_> = loaded.warnings.iter().map(|w| w.to_string()).collect();
        assert!(said[0].contains("absent.mtl cannot be read"), "{said:?}");
        assert!(said[1].contains("map_Kd is not shown"), "{said:?}");
        assert_eq!(said.len(), 2, "{said:?}");
    }

    #[test]
    fn without_a_colour_in_use_there_is_no_attribute() {
        let loaded = with_libraries("newmtl green\nKd 0 1 0\n", "newmtl red\nKd so red\n");
        assert!(loaded.mesh.attributes.is_empty());
        let said: Vec<_> = loaded.warnings.iter().map(|w| w.to_string()).collect();
        assert!(said[1].contains("1 lines Kd passed over"), "{said:?}");
        assert!(said[2].contains("no library has the material"), "{said:?}");
        assert!(said[2].contains("dark blue"), "{said:?}");
    }

    #[test]
    fn many_vertices_at_one_position_take_no_longer() {
        let mut text = "v 0 0 0\n".to_owned();
        for i in 1..=50_000 {
            text.push_str(&format!("vt {i} 0\nf 1/{i} 1/{i} 1/1\n"));
        }
        assert_eq!(mesh(&text).positions.len(), 50_000);
    }

    #[test]
    fn tobj_reads_the_same_triangles() {
        let path = Path::new(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../shared/data/meshes/ogre.obj"
        ));
        if !path.exists() {
            return;
        }
        let ours = crate::mesh::read(path, &ReadOptions::default())
            .unwrap()
            .mesh;
        let (models, _) = tobj::load_obj(path, &tobj::GPU_LOAD_OPTIONS).unwrap();
        let corners = models.iter().flat_map(|m| {
            let at = |i: usize, n: usize| -> &[f32] { &m.mesh.positions[n * i..n * i + n] };
            m.mesh
                .indices
                .iter()
                .map(move |&i| Vec3::from_slice(at(i as usize, 3)))
        });
        let theirs: Vec<Vec3> = corners.collect();
        let ours: Vec<Vec3> = ours
            .triangles
            .iter()
            .flat_map(|t| ours.corners(t))
            .collect();
        assert!(ours.len() > 300_000 && ours == theirs);
    }
}
