//! Wavefront OBJ. All groups and objects of a file make one mesh, as in Mitsuba, so that normals are smooth
//! across them (`tobj` splits the file there, and reports neither lines nor missing indices: the tests use
//! it to compare). Corners `v/vt/vn` that are equal share a vertex; vertices stand in the order in which
//! faces first name them. Polygons are fans around their first corner; negative indices count back from
//! the last; lines that are neither `v`, `vt`, `vn` nor `f` are passed over, but for those that name
//! materials where they are asked for. Colours behind a vertex's place, `v x y z r g b`, are those of a bare mesh.

mod blocks;
mod piece;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};

use super::colors;
use super::mtl::{BARE_COLOR, Materials};
use super::polygon::Polygons;
use super::read::{Decoded, Input, ReadOptions};
use super::surface::{Maps, Surface, Surfaces};
use super::{Attribute, Mesh, Per};
use crate::error::{Error, Location, Result};
use blocks::{Block, Blocks, CUTS, Cuts};
use piece::{LeftOut, NO_COLOR, NONE, OfLine, Piece, new_index, shown};

pub(super) fn read(input: Input<'_>, options: &ReadOptions) -> Result<Decoded> {
    read_in(CUTS, input, options)
}

/// Reads the file in blocks. While one thread puts a block's pieces together, the others understand the
/// next.
fn read_in(cuts: Cuts, input: Input<'_>, options: &ReadOptions) -> Result<Decoded> {
    let Input {
        path,
        length,
        account,
        ..
    } = input;
    let mut blocks = Blocks::new(input, cuts);
    let mut obj = Obj {
        polygons: Polygons::new(options.bare),
        ..Obj::default()
    };
    let mut covered = 0;
    let mut next = blocks.next()?;
    while let Some(Block { pieces, wrong }) = next {
        // Lists that grow are up to twice as long as what is in them.
        let pieces_bytes: usize = pieces.iter().map(Piece::bytes).sum();
        account.cover(&mut covered, (2 * obj.bytes() + 3 * pieces_bytes) as u64)?;
        let (taken, read) = rayon::join(|| obj.take_all(pieces), || blocks.next());
        taken.map_err(|message| Error::input(message).at(&Location::of_file(path)))?;
        if let Some(wrong) = wrong {
            return Err(wrong);
        }
        next = read?;
    }
    check_text(length, &obj, path)?;
    let materials = options.materials || options.bare;
    if materials && !obj.uses.is_empty() {
        account.take_rows(obj.triangles.len() as u64, size_of::<[f32; 3]>())?;
    }
    let made = materials.then(|| obj.made_of(path, options));
    let mut decoded = obj.finish(options);
    if let Some(MadeOf {
        colors,
        surfaces,
        warnings,
        files,
    }) = made
    {
        decoded.mesh.attributes.extend(colors);
        if let Some((surfaces, runs)) = surfaces {
            decoded.surfaces = surfaces.of_faces(&mut decoded.mesh, &runs);
        }
        if decoded.surfaces.len() > 1 && decoded.mesh.normals.is_empty() {
            // Smooth across surfaces, which are seen one by one.
            decoded.mesh.compute_normals();
        }
        decoded.warnings.extend(warnings);
        decoded.files = files;
    }
    Ok(decoded)
}

/// A file of which nothing was understood is no OBJ.
fn check_text(length: u64, obj: &Obj, path: &Path) -> Result<()> {
    if obj.positions.is_empty() {
        let message = if length == 0 {
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
    /// Of the first positions, as in a [`Piece`].
    colors: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// Of each vertex of the mesh: position, uv and normal, `NONE` where it has none.
    vertices: Vec<[u32; 3]>,
    /// The first vertex made for each position.
    first: Vec<u32>,
    /// The other vertices.
    others: HashMap<[u32; 3], u32>,
    triangles: Vec<[u32; 3]>,
    polygons: Polygons,
    left_out: LeftOut,
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
struct MadeOf {
    /// `None`: no face has a colour.
    colors: Option<Attribute>,
    /// With how many faces in turn have each; `None`: all are matte.
    surfaces: Option<(Surfaces, Vec<(usize, u32)>)>,
    warnings: Vec<String>,
    /// The libraries.
    files: Vec<PathBuf>,
}

impl Obj {
    /// Bytes of what was read and of the mesh that will be made of it.
    fn bytes(&self) -> usize {
        const VERTEX: usize = size_of::<[u32; 3]>() + size_of::<[f32; 11]>();
        const OTHER: usize = 2 * size_of::<[u32; 4]>();
        (self.positions.len() + self.colors.len() + self.normals.len()) * size_of::<Vec3>()
            + self.uvs.len() * size_of::<Vec2>()
            + self.first.len() * size_of::<u32>()
            + self.vertices.len() * VERTEX
            + self.others.len() * OTHER
            + self.triangles.len() * size_of::<[u32; 3]>()
            + self.uses.len() * size_of::<Use>()
    }

    fn take_all(&mut self, pieces: Vec<Piece>) -> OfLine<()> {
        pieces.into_iter().try_for_each(|piece| self.take(piece))
    }

    /// Appends what stands in a piece.
    fn take(&mut self, mut piece: Piece) -> OfLine<()> {
        if !piece.colors.is_empty() {
            self.colors.resize(self.positions.len(), NO_COLOR);
            self.colors.append(&mut piece.colors);
        }
        self.left_out.add(piece.left_out);
        self.positions.append(&mut piece.positions);
        self.uvs.append(&mut piece.uvs);
        self.normals.append(&mut piece.normals);
        self.libraries.append(&mut piece.libraries);
        self.first.resize(self.positions.len(), NONE);
        let mut uses = piece.uses.into_iter().peekable();
        let mut corners = piece.corners.iter();
        for (face, &count) in piece.faces.iter().enumerate() {
            while let Some((_, name)) = uses.next_if(|(before, _)| *before <= face) {
                self.use_material(name);
            }
            let count = count as usize;
            self.polygons.push(self.triangles.len(), count);
            self.face(corners.by_ref().take(count))?;
            self.degenerate += usize::from(count < 3);
        }
        uses.for_each(|(_, name)| self.use_material(name));
        Ok(())
    }

    fn use_material(&mut self, name: Vec<u8>) {
        let from = self.triangles.len();
        self.uses.pop_if(|last| last.from == from);
        self.uses.push(Use { from, name });
    }

    fn face<'a>(&mut self, corners: impl Iterator<Item = &'a [u32; 3]>) -> OfLine<()> {
        let (mut first, mut previous) = (NONE, NONE);
        for (i, corner) in corners.enumerate() {
            let vertex = self.vertex(*corner)?;
            if i == 0 {
                first = vertex;
            } else if i > 1 {
                self.triangles.push([first, previous, vertex]);
            }
            previous = vertex;
        }
        Ok(())
    }

    /// The vertex of the mesh for a corner.
    fn vertex(&mut self, corner: [u32; 3]) -> OfLine<u32> {
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

    /// What the faces are made of, by the libraries beside the file `path`.
    fn made_of(&self, path: &Path, options: &ReadOptions) -> MadeOf {
        let mut materials = Materials::read(path, &self.libraries, options.bare);
        let mut warnings = std::mem::take(&mut materials.warnings);
        let unknown = (self.uses.iter()).find(|u| !u.name.is_empty() && !materials.has(&u.name));
        if let (Some(Use { name, .. }), false) = (unknown, self.libraries.is_empty()) {
            let name = shown(name);
            warnings.push(format!("no library has the material {name}"));
        }
        let colors: Vec<_> = (self.uses.iter())
            .map(|u| materials.color(&u.name))
            .collect();
        let ends = self.uses.iter().skip(1).map(|u| u.from);
        let ends = ends.chain([self.triangles.len()]);
        let counts: Vec<usize> = (self.uses.iter().zip(ends))
            .map(|(u, end)| end - u.from)
            .collect();
        let before = self.uses.first().map_or(0, |u| u.from);
        let mut surfaces = Surfaces::default();
        let mut runs = Vec::new();
        if before > 0 {
            runs.push((before, surfaces.number(Surface::MATTE)));
        }
        // Faces without texture coordinates show no image.
        let plain = |face: usize| {
            let corners = self.triangles[face];
            corners
                .iter()
                .any(|&i| self.vertices[i as usize][1] == NONE)
        };
        let mut bare_maps = false;
        let mut known: HashMap<(&[u8], bool), u32> = HashMap::new();
        for (used, count) in self.uses.iter().zip(&counts) {
            let mut number = |is_plain: bool| {
                *known.entry((&used.name, is_plain)).or_insert_with(|| {
                    let mut surface = materials.surface(&used.name);
                    if is_plain && surface.maps != Maps::NONE {
                        surface.maps = Maps::NONE;
                        bare_maps = true;
                    }
                    surfaces.number(surface)
                })
            };
            let mut faces = used.from..used.from + count;
            while let Some(first) = faces.next() {
                let is_plain = plain(first);
                let alike = faces
                    .clone()
                    .take_while(|&face| plain(face) == is_plain)
                    .count();
                faces.start += alike;
                runs.push((1 + alike, number(is_plain)));
            }
        }
        if bare_maps {
            warnings.push(
                "images of materials are not shown on faces without texture coordinates".to_owned(),
            );
        }
        warnings.extend(surfaces.excess().map(str::to_owned));
        let colors = colors.iter().any(Option::is_some).then(|| {
            let mut values = BARE_COLOR.repeat(before);
            for (color, count) in colors.iter().zip(&counts) {
                values.extend(color.unwrap_or(BARE_COLOR).repeat(*count));
            }
            Attribute {
                name: "face_color".to_owned(),
                channels: 3,
                per: Per::Face,
                values,
            }
        });
        MadeOf {
            colors,
            surfaces: (!surfaces.is_all_matte()).then_some((surfaces, runs)),
            warnings,
            files: materials.libraries,
        }
    }

    /// The attribute `vertex_color`: the colours behind the vertices' places.
    fn vertex_color(&self) -> Attribute {
        let color = |v: &[u32; 3]| {
            let color = self.colors.get(v[0] as usize).filter(|c| c.is_finite());
            color.map_or(BARE_COLOR, |c| c.to_array())
        };
        Attribute {
            name: "vertex_color".to_owned(),
            channels: 3,
            per: Per::Vertex,
            values: self.vertices.iter().flat_map(color).collect(),
        }
    }

    fn finish(self, options: &ReadOptions) -> Decoded {
        let any = |part: usize| self.vertices.iter().any(|v| v[part] != NONE);
        let colored = (!self.colors.is_empty() && options.bare).then(|| self.vertex_color());
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
        match colored {
            Some(mut color) => {
                warnings.extend(colors::to_unit(&mut color.values, &[None; 3]));
                mesh.attributes.push(color);
            }
            None if self.colors.is_empty() => {}
            None => warnings.push(
                "the colours of vertices (v x y z r g b) are left out, as in Mitsuba".to_owned(),
            ),
        }
        let LeftOut {
            lines_and_points,
            free_forms,
        } = self.left_out;
        for (count, what) in [
            (lines_and_points, "lines and points (l, p)"),
            (free_forms, "curves and free-form surfaces (curv, surf)"),
        ] {
            if count > 0 {
                warnings.push(format!("{count} {what} left out: only faces are read"));
            }
        }
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
        Decoded {
            mesh,
            warnings,
            polygons: self.polygons,
            ..Decoded::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::budget::Budget;
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
        let plain = crate::mesh::read(&path, &ReadOptions::default(), &Budget::default()).unwrap();
        assert!(plain.mesh.attributes.is_empty() && plain.warnings.is_empty());
        let options = ReadOptions {
            materials: true,
            ..ReadOptions::default()
        };
        crate::mesh::read(&path, &options, &Budget::default()).unwrap()
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
        assert!(
            said[1].contains("not shown of the materials: map_Kd"),
            "{said:?}"
        );
        assert_eq!(said.len(), 2, "{said:?}");
    }

    #[test]
    fn without_a_colour_in_use_there_is_no_attribute() {
        let loaded = with_libraries("newmtl green\nKd 0 1 0\n", "newmtl red\nKd so red\n");
        assert!(loaded.mesh.attributes.is_empty());
        let said: Vec<_> = loaded.warnings.iter().map(|w| w.to_string()).collect();
        let place = "1 line of material libraries passed over, the first at ";
        assert!(said[1].contains(place), "{said:?}");
        assert!(said[2].contains("no library has the material"), "{said:?}");
        assert!(said[2].contains("dark blue"), "{said:?}");
    }

    #[test]
    fn a_file_is_understood_alike_however_it_is_cut() {
        let face = |i: i32| {
            let v = format!(
                "v {i} 0.5 -1e-3 # {i}\nvt 0.{i} 1\nvn 0 {i} 1\n  usemtl m{}\n",
                i % 7
            );
            v + &match i % 5 {
                0 => format!("f {0}/{0}/{0} \\\n -2/-2/-1 -1//-1\n", i + 1),
                1 => "f -1 -2 -3 \\\r\n-4\r\n".to_owned(),
                2 => "f -1 1\n".to_owned(),
                _ => format!("f 1/1/1 {0}/{0}/{0} 3/-1/-1", i + 1) + "\n\n",
            }
        };
        let good: String = "v 0 0 0\nv 1 0 0\nv 2 0 0\nvt 0 0\nvn 0 0 1\n".to_owned()
            + &(0..300).map(face).collect::<String>();
        for text in [
            good.clone(),
            good.trim_end().to_owned(),
            good.replace("0.299 1", "0.299 x"),
            good.replace("f -1 1\n", "f -999 1\n"),
        ] {
            let read = |cuts| {
                let account = Budget::default().open();
                let input = Input {
                    path: Path::new("cut.obj"),
                    length: text.len() as u64,
                    origin: DVec3::ZERO,
                    account: &account,
                    reader: &mut text.as_bytes(),
                };
                let decoded = read_in(cuts, input, &ReadOptions::default());
                decoded
                    .map(|decoded| (decoded.mesh, decoded.warnings))
                    .map_err(|e| e.to_string())
            };
            let whole = read(CUTS);
            assert_eq!(
                whole.is_ok(),
                text.len() >= good.trim_end().len()
                    && !text.contains('x')
                    && !text.contains("999 ")
            );
            for (block, piece) in [(1, 1), (40, 10), (1000, 100), (5000, 5000)] {
                assert!(read(Cuts { block, piece }) == whole, "{block} {piece}");
            }
        }
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
        let ours = crate::mesh::read(path, &ReadOptions::default(), &Budget::default())
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
