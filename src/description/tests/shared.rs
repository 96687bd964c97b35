//! Real scenes: Mitsuba's own and those of other renderers' users.

use std::path::{Path, PathBuf};

use crate::budget::Budget;
use crate::description::{Description, Kind, Options};

/// The scenes below `folder` of the shared data: every file that is a scene of its own.
fn shared_scenes(folder: &str) -> Vec<PathBuf> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")).join(folder);
    let mut scenes = Vec::new();
    let mut folders = vec![root];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            continue;
        };
        for path in entries.filter_map(|entry| entry.ok().map(|e| e.path())) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "xml")
                && !folder.ends_with("fragments")
                && !folder.ends_with("include")
            {
                scenes.push(path);
            }
        }
    }
    scenes.sort();
    scenes
}

#[test]
fn every_shared_scene_is_read() {
    // The published veach-ajar names these two meshes, which the data hold as PLY instead.
    const AS_PLY: [&str; 2] = ["models/Mesh000.obj", "models/Mesh009.obj"];
    for (folder, least) in [("mitsuba-data/tests/scenes", 41), ("scenes", 15)] {
        let scenes = shared_scenes(folder);
        if scenes.is_empty() {
            use std::io::Write as _;
            let _ = writeln!(std::io::stderr(), "skipped: no ../shared/data/{folder}");
            continue;
        }
        assert!(scenes.len() >= least, "{} scenes in {folder}", scenes.len());
        for path in scenes {
            let scene = Description::read(&path, &Options::default(), &Budget::default())
                .unwrap_or_else(|e| panic!("{}:\n{e}", path.display()));
            let root = scene.root();
            assert_eq!(root.children(Kind::Sensor).len(), 1, "{}", path.display());
            assert!(!root.children(Kind::Shape).is_empty(), "{}", path.display());
            for shape in root.children(Kind::Shape) {
                let file: Option<&str> = shape.given("filename").unwrap_or_else(|e| panic!("{e}"));
                if file.is_some_and(|file| !AS_PLY.contains(&file)) {
                    shape.file("filename").unwrap_or_else(|e| panic!("{e}"));
                }
                shape
                    .animation("to_world")
                    .unwrap_or_else(|e| panic!("{e}"));
            }
        }
    }
}

#[test]
fn the_shared_scenes_take_their_samples_from_the_command_line() {
    let defines = vec![("spp".to_owned(), "7".to_owned())];
    let options = Options {
        defines,
        ..Options::default()
    };
    for path in shared_scenes("mitsuba-data/tests/scenes") {
        let text = std::fs::read_to_string(&path).expect("it was listed");
        let scene = match Description::read(&path, &options, &Budget::default()) {
            Ok(scene) => scene,
            Err(error) => {
                assert!(!text.contains("$spp"), "{error}");
                continue;
            }
        };
        let sensor = scene.root().children(Kind::Sensor)[0];
        let sampler = sensor.children(Kind::Sampler)[0];
        assert_eq!(sampler.integer("sample_count").unwrap(), 7);
    }
}

#[test]
fn what_mitsuba_reads_is_read_strictly() {
    let options = Options {
        strict: true,
        ..Options::default()
    };
    let ours = shared_scenes("scenes");
    let edited = ours.iter().filter(|path| path.ends_with("scene_m3.xml"));
    let theirs = shared_scenes("mitsuba-data/tests/scenes");
    for path in edited.chain(&theirs) {
        Description::read(path, &options, &Budget::default())
            .unwrap_or_else(|e| panic!("{}:\n{e}", path.display()));
    }
}
