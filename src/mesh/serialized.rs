//! Mitsuba's `serialized` meshes, versions 3 and 4: 0x041C, the version, then a zlib stream with flags, name
//! (version 4), counts and arrays; several such meshes may follow one another, and the file ends with the
//! offset of each and their number (Mitsuba 0.6 documentation, section 8.2.3). As Mitsuba 3 does, the
//! reader ignores the flag for face normals: the shape's `face_normals` says that.

use std::io::Read;

use flate2::read::ZlibDecoder;
use glam::{DVec3, Vec2, Vec3};

use super::read::{Decoded, Input, ReadOptions};
use super::{Attribute, Mesh, Per};
use crate::budget::Account;
use crate::error::{Error, Location, Result};

const MAGIC: u16 = 0x041c;
const HAS_NORMALS: u32 = 0x0001;
const HAS_UVS: u32 = 0x0002;
const HAS_COLORS: u32 = 0x0008;
const DOUBLE: u32 = 0x2000;

/// Bytes that a byte of a deflate stream can stand for, at most (zlib's technical details).
const MOST_INFLATED: u64 = 1032;

pub(super) fn read(input: Input<'_>, options: &ReadOptions) -> Result<Decoded> {
    let place = Location::of_file(input.path);
    let (origin, account) = (input.origin, input.account);
    let bytes = input.bytes()?;
    let mesh = read_shape(&bytes, options.shape_index, origin, account).map_err(|message| {
        let error = Error::input(message).at(&place);
        match bytes.first_chunk::<2>().map(|&b| u16::from_le_bytes(b)) {
            Some(MAGIC) => error,
            _ => error.help("a serialized file begins with the bytes 1C 04"),
        }
    });
    let mut mesh = mesh?;
    if options.flip_tex_coords.unwrap_or(false) {
        mesh.flip_uvs();
    }
    Ok(Decoded {
        mesh,
        ..Decoded::default()
    })
}

/// All meshes of the file, in its order.
pub(super) fn read_all(input: Input<'_>) -> Result<Vec<Mesh>> {
    let place = Location::of_file(input.path);
    let (origin, account) = (input.origin, input.account);
    let bytes = input.bytes()?;
    let located = |message| Error::input(message).at(&place);
    // Of a broken file the first says what is wrong; each takes four bytes of the table at least.
    let said = bytes.last_chunk().map_or(1, |&n| u32::from_le_bytes(n));
    let most = u32::try_from(bytes.len() / 4).unwrap_or(u32::MAX);
    (0..said.clamp(1, most.max(1)) as usize)
        .map(|index| read_shape(&bytes, index, origin, account).map_err(located))
        .collect()
}

/// What is read, or what is wrong, in words.
type OrWhy<T> = std::result::Result<T, String>;

fn read_shape(bytes: &[u8], index: usize, origin: DVec3, account: &Account) -> OrWhy<Mesh> {
    let version = version(bytes).ok_or("the file is no serialized mesh")?;
    let stream = shape(bytes, version, index)?;
    if self::version(stream) != Some(version) {
        return Err(format!(
            "mesh {index} does not begin where the end of the file says"
        ));
    }
    let stream = &stream[4..];
    let mut stream = Stream {
        most: (stream.len() as u64).saturating_mul(MOST_INFLATED),
        inflated: ZlibDecoder::new(stream),
        double: false,
    };
    stream.mesh(version, origin, account)
}

/// The version after the magic number, if it is one that is known.
fn version(bytes: &[u8]) -> Option<u16> {
    let [a, b, c, d] = *bytes.first_chunk()?;
    let version = u16::from_le_bytes([c, d]);
    (u16::from_le_bytes([a, b]) == MAGIC && matches!(version, 3 | 4)).then_some(version)
}

/// The bytes of shape `index`, as the table at the end of the file says.
fn shape(bytes: &[u8], version: u16, index: usize) -> OrWhy<&[u8]> {
    let broken =
        || "the table at the end of the file is broken; the file may be cut short".to_owned();
    let (bytes, count) = bytes.split_last_chunk().ok_or_else(broken)?;
    let count = u32::from_le_bytes(*count) as usize;
    let width = if version == 4 { 8 } else { 4 };
    let table = count
        .checked_mul(width)
        .and_then(|n| bytes.len().checked_sub(n))
        .ok_or_else(broken)?;
    let (bytes, table) = bytes.split_at(table);
    if index >= count {
        return Err(format!(
            "shape_index {index} is out of range; the file has {count} meshes, counted from 0"
        ));
    }
    let entry = |i: usize| {
        let entry = table.get(i * width..(i + 1) * width)?;
        let mut wide = [0; 8];
        wide[..width].copy_from_slice(entry);
        usize::try_from(u64::from_le_bytes(wide)).ok()
    };
    let start = entry(index).ok_or_else(broken)?;
    let end = entry(index + 1).unwrap_or(bytes.len());
    bytes.get(start..end).ok_or_else(broken)
}

/// The inflated data of one mesh.
struct Stream<'a> {
    inflated: ZlibDecoder<&'a [u8]>,
    /// Bytes that it can hold.
    most: u64,
    /// Whether numbers are f64.
    double: bool,
}

impl Stream<'_> {
    fn mesh(&mut self, version: u16, origin: DVec3, account: &Account) -> OrWhy<Mesh> {
        let flags = u32::from_le_bytes(self.array()?);
        self.double = flags & DOUBLE != 0;
        if version == 4 {
            // The name is not needed; it ends with a 0.
            while self.array::<1>()? != [0] {}
        }
        let vertices = u64::from_le_bytes(self.array()?);
        let triangles = u64::from_le_bytes(self.array()?);
        let has = |flag: u32| flags & flag != 0;
        let numbers = 3
            + 3 * u64::from(has(HAS_NORMALS))
            + 2 * u64::from(has(HAS_UVS))
            + 3 * u64::from(has(HAS_COLORS));
        let wanted = u128::from(vertices) * u128::from(numbers * if self.double { 8 } else { 4 })
            + u128::from(triangles) * 12;
        if wanted > u128::from(self.most) || vertices > u64::from(u32::MAX) {
            return Err(format!(
                "{vertices} vertices and {triangles} triangles are promised, more than the file can hold"
            ));
        }
        // Lists that grow are up to twice as long as what is in them.
        let numbers = (numbers + 3) * size_of::<f32>() as u64;
        let bytes = (vertices.saturating_mul(numbers)).saturating_add(triangles.saturating_mul(12));
        let taken = account.take(bytes.saturating_mul(2));
        taken.map_err(|e| e.to_string())?;
        let vertices = vertices as usize;
        let mut mesh = Mesh {
            positions: self
                .rows_from(origin.to_array(), vertices)?
                .into_iter()
                .map(Vec3::from_array)
                .collect(),
            ..Mesh::default()
        };
        if has(HAS_NORMALS) {
            mesh.normals = self
                .rows(vertices)?
                .into_iter()
                .map(Vec3::from_array)
                .collect();
        }
        if has(HAS_UVS) {
            mesh.uvs = self
                .rows(vertices)?
                .into_iter()
                .map(Vec2::from_array)
                .collect();
        }
        if has(HAS_COLORS) {
            mesh.attributes.push(Attribute {
                name: "vertex_color".to_owned(),
                channels: 3,
                per: Per::Vertex,
                values: self.rows::<3>(vertices)?.into_flattened(),
            });
        }
        mesh.triangles = self.triangles(triangles, vertices)?;
        Ok(mesh)
    }

    fn array<const N: usize>(&mut self) -> OrWhy<[u8; N]> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    fn fill(&mut self, bytes: &mut [u8]) -> OrWhy<()> {
        self.inflated
            .read_exact(bytes)
            .map_err(|e| format!("the compressed data is damaged or cut short: {e}"))
    }

    /// `count` rows of `N` numbers. Memory grows with what is read, not with what is promised.
    fn rows<const N: usize>(&mut self, count: usize) -> OrWhy<Vec<[f32; N]>> {
        self.rows_from([0.0; N], count)
    }

    /// The same, with `origin` subtracted.
    fn rows_from<const N: usize>(
        &mut self,
        origin: [f64; N],
        count: usize,
    ) -> OrWhy<Vec<[f32; N]>> {
        let size = if self.double { 8 } else { 4 };
        let mut rows = Vec::new();
        let double = self.double;
        self.chunks(count, N * size, |chunk| {
            rows.extend(chunk.chunks_exact(N * size).map(|row| {
                std::array::from_fn(|i| {
                    let number = &row[i * size..];
                    let number = if double {
                        f64::from_le_bytes(*number.first_chunk().expect("a row is long enough"))
                    } else {
                        f32::from_le_bytes(*number.first_chunk().expect("a row is long enough"))
                            .into()
                    };
                    (number - origin[i]) as f32
                })
            }));
        })?;
        Ok(rows)
    }

    fn triangles(&mut self, count: u64, vertices: usize) -> OrWhy<Vec<[u32; 3]>> {
        let count = usize::try_from(count).map_err(|e| e.to_string())?;
        let mut triangles = Vec::new();
        self.chunks(count, 12, |chunk| {
            triangles.extend(chunk.chunks_exact(12).map(|row| {
                [0, 4, 8].map(|at| {
                    u32::from_le_bytes(*row[at..].first_chunk().expect("a row is long enough"))
                })
            }));
        })?;
        match triangles
            .iter()
            .position(|t| t.iter().any(|&i| i as usize >= vertices))
        {
            None => Ok(triangles),
            Some(at) => Err(format!(
                "triangle {at}: vertices {:?} are out of range; there are {vertices}",
                triangles[at]
            )),
        }
    }

    /// Shows `count` rows of `stride` bytes, some at a time.
    fn chunks(&mut self, count: usize, stride: usize, mut each: impl FnMut(&[u8])) -> OrWhy<()> {
        const ROWS: usize = 1 << 12;
        let mut buffer = vec![0; ROWS.min(count) * stride];
        let mut left = count;
        while left > 0 {
            let some = left.min(ROWS);
            let chunk = &mut buffer[..some * stride];
            self.fill(chunk)?;
            each(chunk);
            left -= some;
        }
        Ok(())
    }
}
