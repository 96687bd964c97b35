//! glTF and GLB files with buffers beside them: any bytes are a scene, or an error.
#![no_main]

use std::fs;

use etendue::budget::Budget;
use etendue::mesh::{ReadOptions, read_gltf, read_gltf_setting};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|parts: (&[u8], &[u8])| {
    let (document, buffer) = parts;
    let folder = tempfile::tempdir().expect("the temporary folder can be written");
    let path = folder.path().join("fuzz.gltf");
    fs::write(&path, document).expect("the temporary folder can be written");
    fs::write(folder.path().join("buffer.bin"), buffer).expect("the temporary folder can be written");
    let budget = Budget::new(Some(1 << 30));
    if let Ok(scene) = read_gltf(&path, &ReadOptions::default(), &budget.open()) {
        for part in scene.parts {
            let vertices = part.mesh.positions.len();
            assert!(part.mesh.triangles.iter().flatten().all(|&i| (i as usize) < vertices));
        }
    }
    let _ = read_gltf_setting(&path, &budget);
});
