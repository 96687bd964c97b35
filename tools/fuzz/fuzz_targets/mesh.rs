//! Mesh files: any bytes are a mesh whose indices are in range, or an error.
#![no_main]

use std::fs;

use etendue::budget::Budget;
use etendue::mesh::{ReadOptions, read};
use libfuzzer_sys::fuzz_target;

const EXTENSIONS: [&str; 6] = ["ply", "obj", "stl", "serialized", "gltf", "glb"];

fuzz_target!(|bytes: &[u8]| {
    let Some((format, content)) = bytes.split_first() else { return };
    let extension = EXTENSIONS[usize::from(*format) % EXTENSIONS.len()];
    let folder = tempfile::tempdir().expect("the temporary folder can be written");
    let path = folder.path().join("fuzz").with_extension(extension);
    fs::write(&path, content).expect("the temporary folder can be written");
    for options in [ReadOptions::default(), ReadOptions::BARE] {
        if let Ok(loaded) = read(&path, &options, &Budget::new(Some(1 << 30))) {
            let vertices = loaded.mesh.positions.len();
            assert!(loaded.mesh.triangles.iter().flatten().all(|&i| (i as usize) < vertices));
            loaded.mesh.bounds();
        }
    }
});
