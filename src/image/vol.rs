//! Mitsuba's grids of voxels (`.vol`): "VOL", the version 3 as a byte, then little-endian integers of 32 bits (1 for
//! values in single precision, sizes along x, y and z, channels), six floats for a box (its corner of least
//! coordinates first) and the values, channels fastest, then x, y and z.

use std::io::Read;
use std::path::Path;

use glam::Vec3;

use crate::budget::Budget;
use crate::error::{Error, Location, Result};
use crate::file;

/// The bytes before the values.
const HEAD: usize = 48;
const MARK: &[u8] = b"VOL";
const VERSION: u8 = 3;
/// The kind of value that there is.
const FLOAT32: u32 = 1;
/// More channels mean nothing to anybody.
const MOST_CHANNELS: u32 = 64;
/// Values that are read at a time.
const CHUNK: usize = 1 << 14;

/// Values on a regular grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Voxels along x, y and z; none is 0, and the product with `channels` is below 2³².
    pub size: [u32; 3],
    /// Values of a voxel, from 1.
    pub channels: u32,
    /// Where the grid's box begins and ends, in the grid's own space; finite. The file's word, which may be any two
    /// points.
    pub bbox: [Vec3; 2],
    /// Finite; channels fastest, then x, y and z.
    pub values: Vec<f32>,
}

/// Reads a file. Its values are taken of the budget, and stay taken.
///
/// # Errors
/// Where the file is missing, of another format, version or kind, damaged, cut off or larger than the budget allows, or
/// holds what is no finite number.
pub fn read(path: &Path, budget: &Budget) -> Result<Grid> {
    let refused = |e: std::io::Error| Error::system("read", path, &e);
    let file = file::open(path).map_err(refused)?;
    let length = file.metadata().map_err(refused)?.len();
    let grid = decode(file, length, budget, &refused);
    grid.map_err(|e| e.at(&Location::of_file(path)))
}

/// Decodes a file of `length` bytes; `refused` tells what goes wrong in reading.
fn decode(
    mut file: impl Read,
    length: u64,
    budget: &Budget,
    refused: &dyn Fn(std::io::Error) -> Error,
) -> Result<Grid> {
    let mut head = [0; HEAD];
    if length < HEAD as u64 {
        let begins = "a .vol file begins with 48 bytes that tell what it holds";
        return Err(Error::input("the file is too short for a grid").help(begins));
    }
    file.read_exact(&mut head).map_err(refused)?;
    let mut grid = header(&head)?;
    let [x, y, z] = grid.size.map(u64::from);
    let count = (x.saturating_mul(y))
        .saturating_mul(z)
        .saturating_mul(grid.channels.into());
    let needed = HEAD as u64 + 4 * count.min(1 << 60);
    if length < needed || count > u64::from(u32::MAX) {
        let [size, channels] = [format!("{x} × {y} × {z}"), grid.channels.to_string()];
        let message = format!(
            "a grid of {size} voxels with channels: {channels} takes {needed} bytes, and the file has {length}"
        );
        return Err(Error::input(message).help("the file is cut off or its head is damaged"));
    }
    let account = budget.open();
    account.take_for(4 * count, "the grid")?;
    grid.values.reserve_exact(count as usize);
    let mut bytes = vec![0; 4 * CHUNK];
    while grid.values.len() < count as usize {
        let left = 4 * (count as usize - grid.values.len());
        let bytes = &mut bytes[..left.min(4 * CHUNK)];
        file.read_exact(bytes).map_err(refused)?;
        let (values, _) = bytes.as_chunks();
        let values = values.iter().map(|value| f32::from_le_bytes(*value));
        grid.values.extend(values);
    }
    if let Some(at) = grid.values.iter().position(|value| !value.is_finite()) {
        let voxel = at as u64 / u64::from(grid.channels);
        let (x, y, z) = (voxel % x, voxel / x % y, voxel / x / y);
        let value = grid.values[at];
        let message = format!("voxel ({x}, {y}, {z}) holds {value}, which is no finite number");
        return Err(Error::input(message));
    }
    account.keep(4 * count);
    Ok(grid)
}

/// The grid that a file's first bytes promise, without its values.
fn header(head: &[u8; HEAD]) -> Result<Grid> {
    let word = |at: usize| [0, 1, 2, 3].map(|byte| head[4 * at + byte]);
    let number = |at: usize| u32::from_le_bytes(word(at));
    let coordinate = |at: usize| f32::from_le_bytes(word(at));
    if head[..3] != *MARK {
        return Err(Error::input("the file is no grid of voxels").help(
            "a .vol file begins with the letters VOL; Mitsuba's VolumeGrid(array).write(path) makes one",
        ));
    }
    if head[3] != VERSION {
        let message = format!("the grid is of version {}", head[3]);
        return Err(Error::unsupported(message).help("version 3 is read"));
    }
    if number(1) != FLOAT32 {
        let message = format!("the grid's values are of kind {}", number(1));
        return Err(Error::unsupported(message).help("kind 1 is read, single precision"));
    }
    let corner = |at| Vec3::new(coordinate(at), coordinate(at + 1), coordinate(at + 2));
    let grid = Grid {
        size: [number(2), number(3), number(4)],
        channels: number(5),
        bbox: [corner(6), corner(9)],
        values: Vec::new(),
    };
    let is_size = |size: u32| (1..=i32::MAX as u32).contains(&size);
    if !grid.size.into_iter().all(is_size) {
        let [x, y, z] = grid.size.map(u32::cast_signed);
        let message = format!("the grid has {x} × {y} × {z} voxels");
        return Err(Error::input(message).help("each number must be 1 or more"));
    }
    if !(1..=MOST_CHANNELS).contains(&grid.channels) {
        let message = format!("the grid has channels: {}", grid.channels.cast_signed());
        return Err(Error::input(message).help("their number must be from 1 to 64"));
    }
    if !grid.bbox.iter().all(|corner| corner.is_finite()) {
        return Err(Error::input("the grid's box is not finite"));
    }
    Ok(grid)
}

/// The bytes of a file.
pub fn encode(grid: &Grid) -> Vec<u8> {
    let mut bytes = [MARK, &[VERSION]].concat();
    let [x, y, z] = grid.size;
    for number in [FLOAT32, x, y, z, grid.channels] {
        bytes.extend(number.to_le_bytes());
    }
    let corners = grid.bbox.iter().flat_map(|corner| corner.to_array());
    for value in corners.chain(grid.values.iter().copied()) {
        bytes.extend(value.to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Grid {
        Grid {
            size: [4, 3, 2],
            channels: 3,
            bbox: [Vec3::new(-1.0, -2.0, 0.5), Vec3::new(3.0, 2.0, 1.0)],
            values: (0..72).map(|i| i as f32 * 0.25 - 3.0).collect(),
        }
    }

    fn try_decode(bytes: &[u8], budget: &Budget) -> Result<Grid> {
        decode(bytes, bytes.len() as u64, budget, &|e| {
            Error::input(e.to_string())
        })
    }

    #[test]
    fn what_is_written_is_read_and_what_follows_is_left() {
        let mut bytes = encode(&sample());
        assert_eq!(bytes.len(), HEAD + 4 * 72);
        bytes.extend(b"more");
        let budget = Budget::new(Some(1000));
        assert_eq!(try_decode(&bytes, &budget).unwrap(), sample());
        assert_eq!(budget.left(), Some(1000 - 4 * 72));
    }

    #[test]
    fn damaged_files_are_refused_with_what_is_wrong() {
        let good = encode(&sample());
        let with = |at: usize, word: [u8; 4]| {
            let mut bytes = good.clone();
            bytes[4 * at..][..4].copy_from_slice(&word);
            bytes
        };
        let int = |value: i32| value.to_le_bytes();
        let float = |value: f32| value.to_le_bytes();
        let rows = [
            (good[..20].to_vec(), "too short"),
            (
                good[..300].to_vec(),
                "takes 336 bytes, and the file has 300",
            ),
            (with(0, *b"LOV\x03"), "no grid of voxels"),
            (with(0, *b"VOL\x02"), "version 2"),
            (with(1, int(3)), "kind 3"),
            (with(2, int(0)), "has 0 × 3 × 2 voxels"),
            (with(3, int(-7)), "has 4 × -7 × 2 voxels"),
            (with(2, int(i32::MAX)), "cut off or its head is damaged"),
            (with(5, int(0)), "channels: 0"),
            (with(5, int(1 << 20)), "channels: 1048576"),
            (with(7, float(f32::NAN)), "box is not finite"),
            (
                with(12 + 13, float(f32::INFINITY)),
                "voxel (0, 1, 0) holds inf",
            ),
        ];
        for (bytes, expected) in rows {
            let said = try_decode(&bytes, &Budget::default()).unwrap_err();
            let said = said.to_string();
            assert!(said.contains(expected), "{said:?} lacks {expected:?}");
        }
        let little = Budget::new(Some(100));
        let said = try_decode(&good, &little).unwrap_err().to_string();
        assert!(said.contains("the grid takes 288 B"), "{said}");
        assert_eq!(little.left(), Some(100));
        let mut huge = good.clone();
        for at in 2..5 {
            huge[4 * at..][..4].copy_from_slice(&int(i32::MAX));
        }
        assert!(try_decode(&huge, &Budget::default()).is_err());
    }

    #[test]
    fn a_missing_file_and_a_folder_are_named() {
        for path in ["/nowhere/a.vol", "/"] {
            let said = read(Path::new(path), &Budget::default()).unwrap_err();
            assert!(said.to_string().contains(path), "{said}");
        }
    }
}
