//! Mitsuba's own test scenes, where they are at hand: each loads and renders, or names what Étendue lacks.
//! Whether the images are right is for `tools/test` to say.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::support::at;

/// The `.xml` scenes one folder below `folder`.
fn scenes(folder: &Path) -> Vec<PathBuf> {
    let children = |folder: &Path| -> Vec<PathBuf> {
        let entries = fs::read_dir(folder).expect("the folder can be read");
        entries
            .map(|e| e.expect("the folder can be read").path())
            .collect()
    };
    let mut scenes: Vec<PathBuf> = children(folder)
        .iter()
        .filter(|path| path.is_dir())
        .flat_map(|path| children(path))
        .filter(|path| path.extension().is_some_and(|e| e == "xml"))
        .collect();
    scenes.sort();
    scenes
}

/// Renders a scene small; what standard error says, unless it succeeds.
fn refusal(scene: &Path, output: &Path) -> Result<(), String> {
    let run = Command::new(env!("CARGO_BIN_EXE_etendue"))
        .args(["render", "-q", "--spp", "1", "--size", "24x16", "-o"])
        .args([output, scene])
        .output()
        .expect("the program starts");
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    match run.status.code() {
        Some(0) => Ok(()),
        Some(1) => Err(said),
        status => panic!("{}: status {status:?}\n{said}", scene.display()),
    }
}

/// Scenes that use nothing but what Étendue has: they must render.
const MUST_RENDER: &[&str] = &[
    "floating_sphere/test_directional_direct.xml",
    "orthographic_sensor/test_orthographic_path.xml",
];

#[test]
fn every_scene_of_mitsubas_renders_or_asks_for_what_is_not_there() {
    let data = at("../shared/data");
    let suite = data.join("mitsuba-data/tests/scenes");
    if !suite.is_dir() {
        // Past the capture of the test's output, so that it is seen.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: {} is not here",
            suite.display()
        );
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = folder.path().join("image.exr");
    let (mut rendered, mut wrong) = (Vec::new(), Vec::new());
    for scene in scenes(&suite) {
        let name = scene
            .strip_prefix(&suite)
            .expect("it is inside")
            .display()
            .to_string();
        match refusal(&scene, &output) {
            Ok(()) => rendered.push(name),
            // A message for each thing that is wrong; all must be for lack of a plugin.
            Err(said) => {
                let others: Vec<&str> = said
                    .lines()
                    .filter(|l| {
                        l.starts_with("error") && !l.contains("exists in Mitsuba but not in")
                    })
                    .collect();
                if !others.is_empty() || said.contains("panicked") {
                    wrong.push(format!("{name}: {}", others.join(" | ")));
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "refused for other reasons:\n{}",
        wrong.join("\n")
    );
    for name in MUST_RENDER {
        assert!(
            rendered.iter().any(|r| r == name),
            "{name} is not among {rendered:?}"
        );
    }
    let picture = data.join("scenes/cornell-picture/scene_picture.xml");
    refusal(&picture, &output).expect("the Cornell box with a picture renders");
}
