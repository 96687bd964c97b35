//! `etendue profile`, `render --stats` and `render --heatmap` as their users meet them. Times are not asserted.

use std::fs;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="3"/></integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
        <sampler type="independent"><integer name="sample_count" value="2"/></sampler>
    </sensor>
    <emitter type="point"><point name="position" value="3, 5, 4"/></emitter>
    <shape type="cube"/>
</scene>"#;

fn place() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.xml"), SCENE).unwrap();
    folder
}

fn run(place: &TempDir, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(place.path())
        .args(arguments.split(' '))
        .output()
        .unwrap()
}

#[track_caller]
fn told(output: &Output) -> String {
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn a_profile_is_printed_written_and_compared() {
    let place = place();
    let first = "profile scene.xml --quick --sweep samples,threads --rounds 1 --threads 1 -o out";
    let text = told(&run(&place, first));
    for part in ["samples · tree", "render, s", "noise: ", "sample loop"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let written = |name: &str| fs::read_to_string(place.path().join("out").join(name)).unwrap();
    assert!(written("profile.html").starts_with("<!doctype html>"));
    assert!(written("samples-render.svg").contains("Rendering by samples"));
    assert!(written("profile.csv").starts_with("axis,way,x,"));
    let json: Value = serde_json::from_str(&written("profile.json")).unwrap();
    assert_eq!(json["series"][0]["axis"], "samples");
    assert_eq!(json["rounds"], 1);
    let again =
        "profile scene.xml --quick --sweep samples --rounds 1 --compare out/profile.json --json";
    let json: Value = serde_json::from_str(&told(&run(&place, again))).unwrap();
    assert_eq!(json["since"]["common"], 5);
    let changes = json["since"]["changes"].as_array().unwrap().clone();
    let counts = [
        "rays",
        "shadow_rays",
        "first_tests",
        "shadow_tests",
        "node_steps",
    ];
    let counted = |change: &&Value| counts.contains(&change["quantity"].as_str().unwrap());
    assert_eq!(changes.iter().find(counted), None);
}

#[test]
fn what_cannot_be_profiled_is_said() {
    let place = place();
    for (arguments, status, message) in [
        ("profile --sweep Q", 2, "there are P, O, L, N"),
        ("profile --quick --full", 2, "--full"),
        ("profile picture.png", 1, "neither a scene nor a mesh"),
        ("profile absent.ply", 3, "absent.ply"),
        ("profile scene.xml --sweep O", 1, "none can be swept"),
        ("profile --compare scene.xml", 1, "no profile"),
    ] {
        let output = run(&place, arguments);
        assert_eq!(output.status.code(), Some(status), "{arguments}");
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains(message), "{arguments}: {said}");
    }
}

#[test]
fn a_render_tells_its_counts_and_draws_where_they_lie() {
    let place = place();
    let text = told(&run(
        &place,
        "render scene.xml -o a.exr --stats --heatmap {name}-steps.png",
    ));
    for part in ["camera rays", "768", "node steps a ray", "shade", "film"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let picture = image::open(place.path().join("scene-steps.png")).unwrap();
    // Enlarged, over its legend.
    assert_eq!((picture.width(), picture.height()), (432, 288 + 40));
    let same = run(&place, "render scene.xml -o a.png --heatmap a.png");
    assert_eq!(same.status.code(), Some(1));
}
