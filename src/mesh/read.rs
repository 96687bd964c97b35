//! Reading a mesh file: the table of formats, found by the file's extension, and what is common to all of
//! them. A format is one file with a function from [`Input`] to [`Mesh`], and one row in [`FORMATS`]. A file
//! of any format may be compressed by gzip (`mesh.ply.gz`).

use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;
use glam::DVec3;

use super::far::Far;
use super::polygon::Polygons;
use super::select::{NOWHERE, select};
use super::surface::{self, Surface};
use super::{Mesh, Repairs, gltf, obj, ply, serialized, stl};
use crate::budget::{Account, Budget};
use crate::error::{Error, Location, Problem, Result};
use crate::file;

/// How to read a mesh file; the default is what Mitsuba does without properties.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ReadOptions {
    /// Whether `v` of a texture coordinate becomes `1 − v`; `None` stands for the format's habit: true
    /// for OBJ, false for all others.
    pub flip_tex_coords: Option<bool>,
    /// Which of the meshes of a `serialized` file, from 0.
    pub shape_index: usize,
    /// Whether an OBJ file's materials (`mtllib`, `usemtl`) give the mesh an attribute `face_color`: linear
    /// RGB, [`BARE_COLOR`](super::BARE_COLOR) where a face has none. Without any colour there is no attribute.
    pub materials: bool,
    /// Whether the file is all there is, and is read for what is in it, not as a scene's shape is in Mitsuba: with
    /// the materials of an OBJ or glTF file and the colours of its vertices, colours in whole numbers divided by their range,
    /// polygons covered as they are, concave or not, and coordinates that are far from the origin counted from a
    /// nearer one.
    pub bare: bool,
    /// When the first animation of a glTF file is looked at; `None`: nodes and weights stand at rest.
    pub time: Option<Time>,
}

/// A time in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Time(u32);

impl Time {
    /// So many seconds.
    pub fn of(seconds: f32) -> Self {
        Self(seconds.to_bits())
    }

    /// How many.
    pub fn seconds(self) -> f32 {
        f32::from_bits(self.0)
    }
}

impl ReadOptions {
    /// For a file that is all there is.
    pub const BARE: Self = Self {
        flip_tex_coords: None,
        shape_index: 0,
        materials: false,
        bare: true,
        time: None,
    };
}

/// A mesh as read.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The mesh, with finite triangles.
    pub mesh: Mesh,
    /// Triangles left out because a corner was not finite.
    pub dropped_triangles: usize,
    /// What was odd in the file and did not prevent reading it.
    pub warnings: Vec<Problem>,
    /// The files that this one names and that were read for it, or tried: buffers of glTF, material libraries of OBJ.
    pub files: Vec<PathBuf>,
    /// What its faces are made of, of a [bare](ReadOptions::bare) file that says so.
    pub surfaces: Vec<Surface>,
}

impl Loaded {
    /// The linear red, green and blue that all faces of this surface have, if they have one.
    pub fn color_of(&self, number: usize) -> Option<[f32; 3]> {
        match surface::faces(&self.mesh, number) {
            Some(faces) => surface::color_of(&self.mesh, faces.into_iter()),
            None => surface::color_of(&self.mesh, 0..self.mesh.triangles.len() as u32),
        }
    }

    /// Bytes on the heap of a mesh of the faces that have this surface, about: its share of the whole.
    pub fn room_of(&self, number: usize) -> u64 {
        let all = self.mesh.triangles.len().max(1) as u64;
        let faces = surface::faces(&self.mesh, number).map_or(all, |faces| faces.len() as u64);
        // Vertices at the edges are there once more.
        (self.mesh.room() / all + 64) * faces
    }

    /// The faces that have the surface of this number, as a mesh of their own; `None` where there is no such surface.
    pub fn of_surface(&self, number: usize) -> Option<Mesh> {
        if number >= self.surfaces.len() {
            return None;
        }
        let Some(faces) = surface::faces(&self.mesh, number) else {
            return Some(self.mesh.clone());
        };
        let mut places = vec![NOWHERE; self.mesh.positions.len()];
        Some(select(&self.mesh, &faces, &mut places))
    }
}

/// A file, and how it is read: those who agree in both can share a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct MeshFile {
    /// Where it is.
    pub path: PathBuf,
    /// How it is read.
    pub options: ReadOptions,
}

/// A mesh with the file that it comes from.
#[derive(Clone, Debug)]
pub struct ReadMesh {
    /// The file.
    pub file: MeshFile,
    /// What is in it.
    pub loaded: Loaded,
}

/// A mesh file format.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    /// File extensions, in lower case; the first is the name of the scene file's shape, where it has one.
    pub extensions: &'static [&'static str],
    /// Whether [`Input::origin`] is heeded.
    has_origin: bool,
    read: fn(Input<'_>, &ReadOptions) -> Result<Decoded>,
}

/// All formats that [`read`] knows.
pub const FORMATS: &[Format] = &[
    Format {
        extensions: &["ply"],
        has_origin: true,
        read: ply::read,
    },
    Format {
        extensions: &["obj"],
        has_origin: true,
        read: obj::read,
    },
    Format {
        extensions: &["serialized"],
        has_origin: true,
        read: serialized::read,
    },
    Format {
        extensions: &["stl"],
        has_origin: true,
        read: stl::read,
    },
    Format {
        extensions: &["gltf", "glb"],
        has_origin: false,
        read: gltf::read,
    },
];

/// Reads the mesh in the file `path`, whose extension says the format. The budget is asked for all that this takes, and
/// the mesh stays charged to it, with normals for all of its vertices.
///
/// # Errors
/// Where the file cannot be opened, has an unknown extension, is malformed or larger than the budget allows; the message
/// says where.
pub fn read(path: &Path, options: &ReadOptions, budget: &Budget) -> Result<Loaded> {
    let account = budget.open();
    let loaded = read_on(path, options, &account)?;
    account.keep(loaded.mesh.room());
    Ok(loaded)
}

/// The same, on an account of the caller's.
pub(super) fn read_on(path: &Path, options: &ReadOptions, account: &Account) -> Result<Loaded> {
    let format = format_of(path)?;
    let decode = |origin| {
        with_input(path, account, |input| {
            (format.read)(Input { origin, ..input }, options)
        })
    };
    if format.has_origin {
        read_near(path, options, account, decode)
    } else {
        Ok(decode(DVec3::ZERO)?.finish(path))
    }
}

/// What `decode` makes of the file `path` with an origin to subtract: none at first, and then one that is near a bare
/// mesh whose coordinates are far from it.
pub(super) fn read_near(
    path: &Path,
    options: &ReadOptions,
    account: &Account,
    decode: impl Fn(DVec3) -> Result<Decoded>,
) -> Result<Loaded> {
    let mut loaded = decode(DVec3::ZERO)?.finish(path);
    let Some(far) = Far::of(&loaded.mesh) else {
        return Ok(loaded);
    };
    if options.bare {
        drop(loaded);
        account.clear();
        let mut decoded = decode(far.origin)?;
        decoded.warnings.push(far.moved());
        return Ok(decoded.finish(path));
    }
    if far.is_coarse(&loaded.mesh) {
        loaded.warnings.extend(warnings(path, vec![far.coarse()]));
    }
    Ok(loaded)
}

/// Does `work` on what is in the file `path`, inflated where it is compressed.
pub(super) fn with_input<T>(
    path: &Path,
    account: &Account,
    work: impl FnOnce(Input<'_>) -> Result<T>,
) -> Result<T> {
    let Opened { file, length } = open(path)?;
    let place = Location::of_file(path);
    if !is_compressed(path) {
        let input = Input {
            path,
            length,
            origin: DVec3::ZERO,
            account,
            reader: &mut &file,
        };
        return work(input).map_err(|e| e.at(&place));
    }
    let damaged = |e: io::Error| {
        let message = format!("the compressed file is damaged: {e}");
        Error::input(message).at(&place)
    };
    // Read once for its length, against which all lengths in it are checked. No mesh takes less than this part of it.
    const LEAST: u64 = 16;
    let mut inflated = inflate(&file);
    let (mut buffer, mut length, mut covered) = (vec![0; 1 << 16], 0, 0);
    loop {
        match inflated.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => length += count as u64,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(damaged(e)),
        }
        (account.cover(&mut covered, length / LEAST)).map_err(|e| e.at(&place))?;
    }
    account.clear();
    let rewound = (&file).rewind();
    rewound.map_err(|e| Error::system("read", path, &e))?;
    let input = Input {
        path,
        length,
        origin: DVec3::ZERO,
        account,
        reader: &mut inflate(&file),
    };
    work(input).map_err(|e| e.at(&place))
}

/// What is in a mesh file, inflated where it is compressed.
pub(crate) fn contents(path: &Path) -> io::Result<Box<dyn Read>> {
    let file = file::open(path)?;
    if is_compressed(path) {
        Ok(Box::new(inflate(file)))
    } else {
        Ok(Box::new(file))
    }
}

fn inflate<R: Read>(file: R) -> MultiGzDecoder<BufReader<R>> {
    MultiGzDecoder::new(BufReader::with_capacity(1 << 16, file))
}

/// Whether the file is compressed, by its name.
pub(crate) fn is_compressed(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("gz"))
}

/// The extension that says a mesh file's format, in lower case: of a compressed file that before `.gz`.
pub fn extension(path: &Path) -> String {
    let plain = if is_compressed(path) {
        path.file_stem().map(Path::new)
    } else {
        Some(path)
    };
    let extension = plain.and_then(Path::extension).unwrap_or_default();
    extension.to_string_lossy().to_lowercase()
}

/// A regular file.
pub(super) struct Opened {
    pub(super) file: File,
    /// Its bytes.
    pub(super) length: u64,
}

/// Opens `path`, which must be a regular file: others may never end.
pub(super) fn open(path: &Path) -> Result<Opened> {
    let refused = |e| Error::system("open", path, &e);
    let about = fs::metadata(path).map_err(refused)?;
    if !about.is_file() {
        let what = if about.is_dir() {
            "a folder"
        } else {
            "no regular file"
        };
        let message = format!("a mesh file is wanted here, and this is {what}");
        return Err(Error::input(message).at(&Location::of_file(path)));
    }
    Ok(Opened {
        file: file::open(path).map_err(refused)?,
        length: about.len(),
    })
}

fn format_of(path: &Path) -> Result<&'static Format> {
    let extension = extension(path);
    let known = || FORMATS.iter().flat_map(|f| f.extensions.iter().copied());
    FORMATS
        .iter()
        .find(|f| f.extensions.contains(&extension.as_str()))
        .ok_or_else(|| {
            let message = if extension.is_empty() {
                "a mesh file needs an extension that says its format".to_owned()
            } else {
                format!("unknown mesh format {extension:?}")
            };
            let known: Vec<_> = known().collect();
            Error::unsupported(message)
                .at(&Location::of_file(path))
                .suggest(&extension, known.iter().copied())
                .help(format!("known are {}", known.join(", ")))
        })
}

/// A file to decode, or bytes in its place.
pub(super) struct Input<'a> {
    /// For messages, and the folder of files that it names.
    pub(super) path: &'a Path,
    /// Bytes that `reader` will give.
    pub(super) length: u64,
    /// What is subtracted from every position, before it is rounded.
    pub(super) origin: DVec3,
    /// Who is asked for memory.
    pub(super) account: &'a Account,
    pub(super) reader: &'a mut (dyn Read + Send),
}

impl Input<'_> {
    /// The whole file.
    pub(super) fn bytes(self) -> Result<Vec<u8>> {
        self.account.take(self.length)?;
        let mut bytes = Vec::with_capacity(usize::try_from(self.length).unwrap_or(0));
        // A file that grows meanwhile is read as long as it was.
        let read = self.reader.take(self.length).read_to_end(&mut bytes);
        read.map_err(|e| Error::system("read", self.path, &e))?;
        Ok(bytes)
    }
}

/// What a format's reader returns: a mesh that is not checked yet.
#[derive(Debug, Default)]
pub(super) struct Decoded {
    pub(super) mesh: Mesh,
    /// What was odd, in words; the file's name is added to them.
    pub(super) warnings: Vec<String>,
    /// Which of the triangles are fans.
    pub(super) polygons: Polygons,
    /// As [`Loaded::files`].
    pub(super) files: Vec<PathBuf>,
    /// As [`Loaded::surfaces`].
    pub(super) surfaces: Vec<Surface>,
}

impl Decoded {
    /// Checks the mesh, and says in the warnings what that mended.
    pub(super) fn finish(mut self, path: &Path) -> Loaded {
        self.warnings.extend(self.polygons.settle(&mut self.mesh));
        let Repairs {
            dropped_triangles,
            mended_normals,
            mended_uvs,
        } = self.mesh.check();
        for (count, what) in [
            (
                dropped_triangles,
                "triangles dropped: a corner is not finite",
            ),
            (
                mended_normals,
                "vertex normals computed: the file has none of a direction",
            ),
            (
                mended_uvs,
                "texture coordinates set to 0: they are not finite",
            ),
        ] {
            if count > 0 {
                self.warnings.push(format!("{count} {what}"));
            }
        }
        self.mesh.shrink();
        if self.mesh.triangles.is_empty() {
            self.warnings.push("the mesh has no triangles".to_owned());
        }
        Loaded {
            mesh: self.mesh,
            dropped_triangles,
            warnings: warnings(path, self.warnings),
            files: self.files,
            surfaces: self.surfaces,
        }
    }
}

/// `messages` as problems of the file `path`.
pub(super) fn warnings(path: &Path, messages: Vec<String>) -> Vec<Problem> {
    let place = Location::of_file(path);
    let problems = messages.into_iter().map(|m| Error::input(m).at(&place));
    problems.flat_map(|e| e.problems().to_vec()).collect()
}

#[cfg(test)]
pub(super) mod testing {
    //! Decoding from memory, as the tests of the formats do it.

    use super::*;

    /// Reads `bytes` as if they stood in a file called `name`.
    pub(in crate::mesh) fn decode(
        name: &str,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Result<Loaded> {
        let path = Path::new(name);
        let format = format_of(path)?;
        let account = Budget::default().open();
        read_near(path, options, &account, |origin| {
            let mut reader = bytes;
            let input = Input {
                path,
                length: bytes.len() as u64,
                origin,
                account: &account,
                reader: &mut reader,
            };
            (format.read)(input, options)
        })
    }
}
