//! What a render will take, estimated before it is taken: a refusal with a reason is better than a machine
//! that swaps or a process that is killed. The film's share is exact; meshes are estimated by what their
//! files announce and then known; trees go by the number of primitives.

use std::io::Read;
use std::path::Path;

use crate::budget::human_bytes;
use crate::description::{Description, Part};
use crate::error::{Error, Result};
use crate::file::text;
use crate::film::Grid;
use crate::mesh;
use crate::sensor::Film;

/// Bytes of a tree for a primitive while it is built in chunks: 72 to 90 of them are kept. Measured were 87 over
/// 40 million triangles of two terrains, 93 to 127 over 10 million of one, and 110 over a scan of 3.5 million.
const TREE: u64 = 150;
/// Bytes of a vertex (position, normal, texture coordinates) and of a triangle.
const VERTEX: u64 = 32;
const TRIANGLE: u64 = 12;

/// Refuses a mesh file that announces more than can be read and rendered within the limit, before it is read.
///
/// # Errors
/// Says what it would take.
pub fn check_mesh(path: &Path, limit: Option<u64>) -> Result<()> {
    let (assets, primitives) = of_file(path).unwrap_or_default();
    let estimate = Estimate {
        assets,
        trees: trees(primitives),
        ..Estimate::default()
    };
    estimate.check(limit)
}

/// What a render takes, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Estimate {
    /// The film's sums and the image made from them.
    pub(super) film: u64,
    /// Geometry and the images of textures.
    pub(super) assets: u64,
    pub(super) trees: u64,
    /// What an integrator learns from photons.
    pub(super) photons: u64,
}

/// The film's share for `channels` values a pixel.
pub(super) fn film(film: &Film, channels: usize, adaptive: bool) -> u64 {
    if adaptive {
        // Beside the blocks, each half stands as a film before they are added.
        let blocks = Grid::new(film, channels).bytes();
        return blocks.saturating_add(3 * self::film(film, channels + 2, false));
    }
    let pixels = u64::from(film.crop.width) * u64::from(film.crop.height);
    let (sums, image) = (8 * (channels as u64 + 1), 4 * channels as u64);
    // The image stands once as samples and once as the bytes of its file.
    pixels.saturating_mul(sums + 2 * image)
}

/// The share of trees over so many primitives.
pub(super) fn trees(primitives: u64) -> u64 {
    primitives.saturating_mul(TREE)
}

/// How many triangles so many bytes have room for, with their vertices and trees.
pub(super) fn triangles(bytes: u64) -> u64 {
    // A mesh has half as many vertices as triangles.
    bytes / (TREE + TRIANGLE + VERTEX / 2)
}

impl Estimate {
    /// By what the scene's files announce; the film's share is left out.
    pub(super) fn of_files(description: &Description) -> Self {
        let mut files = description.files(Part::Scene);
        files.sort();
        files.dedup();
        let mut estimate = Self::default();
        let mut primitives = 0_u64;
        for path in files {
            let (assets, of_this) = of_file(&path).unwrap_or_default();
            estimate.assets = estimate.assets.saturating_add(assets);
            primitives = primitives.saturating_add(of_this);
        }
        estimate.trees = trees(primitives);
        estimate
    }

    pub(super) fn total(&self) -> u64 {
        self.film
            .saturating_add(self.assets)
            .saturating_add(self.trees)
            .saturating_add(self.photons)
    }

    /// Refuses what exceeds the limit.
    pub(super) fn check(&self, limit: Option<u64>) -> Result<()> {
        let (total, Some(limit)) = (self.total(), limit) else {
            return Ok(());
        };
        if total <= limit {
            return Ok(());
        }
        let Self {
            film,
            assets,
            trees,
            photons,
        } = *self;
        let largest = film.max(assets).max(trees).max(photons);
        let help = if largest == film {
            "render it in crops (--crop) or smaller (--size)"
        } else if largest == photons {
            "take fewer photons"
        } else {
            "simplify the meshes, or place copies as instances of a shapegroup"
        };
        let photons = match photons {
            0 => String::new(),
            _ => format!(", photons {}", human_bytes(photons)),
        };
        Err(Error::input(format!(
            "this render would take about {} (film {}, meshes and images {}, trees {}{photons}), more than the limit of {}",
            human_bytes(total),
            human_bytes(film),
            human_bytes(assets),
            human_bytes(trees),
            human_bytes(limit)
        ))
        .help(format!("{help}, or raise the limit (--memory-limit)")))
    }
}

/// Bytes and primitives of a mesh or image file, as far as its head and its length tell.
fn of_file(path: &Path) -> Option<(u64, u64)> {
    let length = path.metadata().ok()?.len();
    // What deflate can make of a byte at most, and what it makes of meshes.
    let (most, likely) = if mesh::is_compressed(path) {
        (1032, 3)
    } else {
        (1, 1)
    };
    let (most, length) = (length.saturating_mul(most), length.saturating_mul(likely));
    Some(match mesh::extension(path).as_str() {
        "ply" => {
            let (vertices, faces) = ply_counts(path);
            // No vertex and no face takes less than two bytes of the file, whatever its head says.
            let (vertices, faces) = (vertices.min(most / 2), faces.min(most / 2));
            let bytes = vertices.saturating_mul(VERTEX);
            (bytes.saturating_add(faces.saturating_mul(TRIANGLE)), faces)
        }
        // A line of an OBJ file has about 30 bytes; triangles are about half of them.
        "obj" => (length, length / 60),
        // Compressed to about a third. It is in memory beside what is read from it, as is that of the next ones.
        "serialized" => (length.saturating_mul(4), length / 20),
        // With a table of the vertices.
        "stl" => (length.saturating_mul(2), length / 50),
        // With each of its arrays, and a mesh for each of its parts.
        "gltf" | "glb" => (length.saturating_mul(7) / 2, length / 30),
        // Compressed to about a fifth, and held as numbers.
        "png" | "jpg" | "jpeg" => (length.saturating_mul(20), 0),
        _ => (length, 0),
    })
}

/// Vertices and faces as the head of a PLY file announces them.
fn ply_counts(path: &Path) -> (u64, u64) {
    const HEAD: u64 = 1 << 16;
    let mut counts = (0, 0);
    let Ok(contents) = mesh::contents(path) else {
        return counts;
    };
    let mut head = Vec::new();
    // Of a damaged file what can be read.
    contents.take(HEAD).read_to_end(&mut head).ok();
    for line in text::lines(&head) {
        let line = String::from_utf8_lossy(line).to_ascii_lowercase();
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["element", "vertex", n] => counts.0 = n.parse().unwrap_or(0),
            ["element", "face", n] => counts.1 = n.parse().unwrap_or(0),
            ["end_header"] => break,
            _ => {}
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn the_film_takes_what_its_sums_and_its_image_take() {
        let film_of = Film::default();
        assert_eq!(film(&film_of, 4, false), 768 * 576 * (5 * 8 + 2 * 4 * 4));
    }

    #[test]
    fn what_exceeds_the_limit_is_refused_with_its_parts_and_a_remedy() {
        let estimate = Estimate {
            film: 3_000_000_000,
            assets: 200_000,
            trees: 1_500,
            photons: 0,
        };
        assert!(estimate.check(None).is_ok());
        assert!(estimate.check(Some(3_000_201_500)).is_ok());
        let error = estimate.check(Some(3_000_201_499)).unwrap_err().to_string();
        assert!(
            error.contains("3.0 GB (film 3.0 GB, meshes and images 200 kB, trees 1.5 kB)"),
            "{error}"
        );
        assert!(error.contains("--crop"), "{error}");
        let photons = Estimate {
            photons: 4_000_000_000,
            ..estimate
        };
        let error = photons.check(Some(7_000_000_000)).unwrap_err().to_string();
        assert!(error.contains("trees 1.5 kB, photons 4.0 GB)"), "{error}");
        assert!(error.contains("take fewer photons"), "{error}");
    }

    #[test]
    fn a_head_that_promises_too_much_is_not_believed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        let head =
            "ply\nformat ascii 1.0\nelement vertex 3\nelement face 99999999999999\nend_header\n";
        std::fs::write(&path, head).unwrap();
        let (bytes, primitives) = of_file(&path).unwrap();
        assert_eq!(primitives, head.len() as u64 / 2);
        assert!(bytes < 1000);
    }

    #[test]
    fn a_mesh_that_announces_too_much_is_refused_unread_compressed_or_not() {
        let folder = tempfile::tempdir().unwrap();
        let mut ply = b"ply\nelement vertex 100000\nelement face 200000\nend_header\n".to_vec();
        ply.resize(1 << 20, b' ');
        let plain = folder.path().join("a.ply");
        std::fs::write(&plain, &ply).unwrap();
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(&ply).unwrap();
        let compressed = folder.path().join("a.ply.gz");
        std::fs::write(&compressed, gzip.finish().unwrap()).unwrap();
        for path in [plain, compressed] {
            check_mesh(&path, None).unwrap();
            check_mesh(&path, Some(200_000_000)).unwrap();
            let error = check_mesh(&path, Some(10_000_000)).unwrap_err().to_string();
            assert!(error.contains("more than the limit of 10.0 MB"), "{error}");
        }
    }
}
