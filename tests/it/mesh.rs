//! `etendue mesh` as its users meet it: files that are converted, generated and examined, and what is refused.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Runs `etendue mesh` with the words of `arguments` in `folder`.
fn mesh(folder: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(folder)
        .arg("mesh")
        .args(arguments.split(' '))
        .output()
        .unwrap()
}

/// Standard output of a run that went well.
#[track_caller]
fn done(folder: &Path, arguments: &str) -> String {
    let output = mesh(folder, arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments}: {stderr}");
    String::from_utf8(output.stdout).unwrap()
}

#[track_caller]
fn report(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&done(folder, &format!("report {file} --json"))).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn every_kind_is_generated_the_same_from_one_seed_and_closed_where_it_should_be() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (kind, options, closed, parts) in [
        ("terrain", "--triangles 2k --seed 3", false, 1),
        ("hair", "--triangles 320 --seed 3", false, 10),
        ("flake", "--levels 1 --subdivisions 0", true, 10),
        ("menger", "--levels 2", true, 1),
        (
            "shape",
            "--of box --edge 0.3 --bumps 0.05 --seed 3",
            true,
            1,
        ),
        ("shape", "--subdivisions 3 --bumps 0.1 --seed 3", true, 1),
    ] {
        let told = done(folder, &format!("generate {kind} a.ply {options}"));
        done(
            folder,
            &format!("generate {kind} b.ply {options} --json -q"),
        );
        let bytes = |name: &str| fs::read(folder.join(name)).unwrap();
        assert_eq!(bytes("a.ply"), bytes("b.ply"), "{kind}");
        let report = report(folder, "a.ply");
        assert_eq!(report["closed"], closed, "{kind}");
        assert_eq!(report["components"], parts, "{kind}");
        assert_eq!(report["degenerate_triangles"], 0, "{kind}");
        assert!(
            told.contains(&format!("{} triangles", report["triangles"])),
            "{told}"
        );
        if options.contains("--seed 3") {
            let other = options.replace("--seed 3", "--seed 4");
            done(folder, &format!("generate {kind} b.ply {other}"));
            assert_ne!(bytes("a.ply"), bytes("b.ply"), "{kind}");
        }
    }
    assert_eq!(names(folder), ["a.ply", "b.ply"]);
}

#[test]
fn a_mesh_file_is_made_finer_and_bumpy() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    done(folder, "generate menger sponge.ply --levels 1");
    done(
        folder,
        "generate shape fine.ply --of sponge.ply --subdivisions 2 --bumps 0.01",
    );
    let (base, fine) = (report(folder, "sponge.ply"), report(folder, "fine.ply"));
    assert_eq!(fine["triangles"], base["triangles"].as_u64().unwrap() * 16);
    assert_eq!(fine["euler_characteristic"], base["euler_characteristic"]);
    assert_eq!(fine["closed"], true);
}

#[test]
fn a_flake_as_a_scene_renders_its_balls() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let told = done(folder, "generate flake flake.xml --levels 3 --json");
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["spheres"], 820);
    let check = Command::new(env!("CARGO_BIN_EXE_etendue"))
        .args(["check", "--strict", "flake.xml"])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(check.status.success(), "{check:?}");
}

const TWO: &str = "o left\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\no right side\nf 1 2 4\n";

#[test]
fn several_meshes_are_merged_with_a_word_or_split() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("two.obj"), TWO).unwrap();
    let output = mesh(folder, "convert two.obj two.ply");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        said.contains("2 meshes are merged into one") && said.contains("--split"),
        "{said}"
    );
    assert_eq!(report(folder, "two.ply")["triangles"], 2);
    let parts = &report(folder, "two.obj")["parts"];
    assert_eq!(
        (&parts[0]["name"], &parts[1]["triangles"]),
        (&"left".into(), &1.into())
    );
    let told = done(folder, "convert two.obj apart.ply --split --json");
    assert_eq!(told.lines().count(), 2);
    assert_eq!(
        names(folder),
        [
            "apart-0-left.ply",
            "apart-1-right-side.ply",
            "two.obj",
            "two.ply"
        ]
    );
}

#[test]
fn what_cannot_be_done_is_refused_with_a_reason_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("broken.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
    for (arguments, status, message) in [
        ("convert broken.obj out.ply", 1, "vertex 2 is out of range"),
        ("convert missing.obj out.ply", 3, "missing.obj"),
        ("convert broken.obj out.obj", 1, "written as .ply"),
        ("report broken.obj missing.stl", 3, "missing.stl"),
        (
            "generate terrain out.ply --triangles 40M --memory-limit 10M",
            1,
            "more than the limit of 10.0 MB",
        ),
        (
            "generate hair out.ply --triangles 4G --memory-limit 10G",
            1,
            "--memory-limit",
        ),
        (
            "generate terrain out.ply --triangles 5G",
            2,
            "5G is not between 1 and",
        ),
        (
            "generate flake out.ply --levels 10 --memory-limit none",
            1,
            "more than a mesh can have",
        ),
        (
            "generate flake out.ply --levels 11",
            2,
            "11 is not in 0..=10",
        ),
        (
            "generate menger out.ply --levels 6 --memory-limit 1G",
            1,
            "a mesh of 258097152 triangles",
        ),
        (
            "generate shape out.ply --subdivisions 40 --memory-limit none",
            1,
            "more than a mesh can have",
        ),
        (
            "generate shape out.ply --of box --edge 1e-9 --memory-limit 100M",
            1,
            "more than the limit",
        ),
        ("generate shape out.ply --of bix", 1, "extension"),
        ("generate shape out.ply --edge 0", 2, "not positive"),
        ("generate menger out.stl", 1, "written as .ply"),
    ] {
        let output = mesh(folder, arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{arguments}: {said}");
        assert!(said.contains(message), "{arguments}: {said}");
    }
    assert_eq!(names(folder), ["broken.obj"]);
}
