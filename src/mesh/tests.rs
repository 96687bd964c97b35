//! Tests over all formats: every file of the shared data against its known counts, malformed files, and
//! mutations of valid ones.

use std::path::{Path, PathBuf};

use super::*;

/// The shared data, or `None` (said on stderr) where it is absent.
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn data() -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let there = path.is_dir();
    if !there {
        eprintln!("skipped: {} is absent", path.display());
    }
    there.then(|| path.to_owned())
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(files_below(&path));
        } else {
            files.push(path);
        }
    }
    files.sort();
    files
}

fn load(path: &Path) -> Loaded {
    read(path, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn known_meshes_have_their_known_counts() {
    let Some(data) = data() else { return };
    for (name, vertices, triangles) in [
        ("meshes/dragon.ply", 437_645, 871_414),
        ("meshes/crown.ply", 1_868_139, 3_540_214),
        ("meshes/cortex.ply", 304_380, 608_752),
        ("meshes/motorbike.ply", 132_871, 331_653),
        ("meshes/elephant.ply", 44_460, 88_928),
        ("meshes/stanford-bunny.obj", 34_834, 69_451),
        ("meshes/nefertiti.obj", 49_971, 99_938),
        ("mitsuba-data/tests/ply/cbox_smallbox.ply", 24, 12),
        ("mitsuba-data/common/meshes/teapot.ply", 1177, 2256),
    ] {
        let loaded = load(&data.join(name));
        let mesh = loaded.mesh;
        assert_eq!(
            (mesh.positions.len(), mesh.triangles.len()),
            (vertices, triangles),
            "{name}"
        );
        assert_eq!(loaded.dropped_triangles, 0);
    }
}

#[test]
fn every_shared_mesh_loads_without_a_dropped_triangle() {
    let Some(data) = data() else { return };
    let mut count = 0;
    for path in files_below(&data) {
        let extension = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if !FORMATS
            .iter()
            .any(|f| f.extensions.contains(&extension.as_str()))
        {
            continue;
        }
        let loaded = load(&path);
        assert_eq!(loaded.dropped_triangles, 0, "{}", path.display());
        let mesh = loaded.mesh;
        let n = mesh.positions.len();
        assert!(
            !mesh.triangles.is_empty() && mesh.area() > 0.0,
            "{}",
            path.display()
        );
        assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < n));
        count += 1;
    }
    assert!(count > 150, "{count}");
}
