//! All commands that read scenes take the same ones: what `render` accepts and says, `check`, `info`, `profile` and
//! `crosscheck` accept and say, with the same options.

use std::fs;
use std::process::{Command, Output};

/// A scene that is in order, of which the table below changes one thing at a time.
const SCENE: &str = r#"<scene version="3.0.0">
    <default name="radius" value="1"/>
    <integrator type="path"/>
    <sensor type="perspective" id="front">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="12"/><integer name="height" value="8"/></film>
        <sampler type="independent"><integer name="sample_count" value="1"/></sampler>
    </sensor>
    <emitter type="constant"/>
    <shape type="sphere"><float name="radius" value="$radius"/><bsdf type="diffuse" id="grey"/></shape>
</scene>"#;

const SAMPLER: &str =
    r#"<sampler type="independent"><integer name="sample_count" value="1"/></sampler>"#;
const FILM: &str = r#"<film type="hdrfilm"><integer name="width" value="12"/><integer name="height" value="8"/></film>"#;
const INTEGRATOR: &str = r#"<integrator type="path"/>"#;
const SPHERE: &str = r#"<shape type="sphere">"#;

/// What is changed (from, to), the options, and whether it is accepted.
const CASES: &[(&str, &str, &str, bool)] = &[
    ("", "", "", true),
    ("", "", "--spp 2 --size 6x4 --crop 1,1,3,2", true),
    ("", "", "--bands 4 --sampler stratified --spp 4", true),
    (
        "",
        "",
        "--integrator direct -D radius=0.5 --sensor front",
        true,
    ),
    ("", "", "--max-depth 2 --sampler sobol --spp 3", true),
    (SAMPLER, "", "", true),
    (FILM, "", "--size 9x7", true),
    (INTEGRATOR, "", "", true),
    (
        INTEGRATOR,
        r#"<integrator type="aov"><string name="aovs" value="d:depth,n:sh_normal"/></integrator>"#,
        "",
        true,
    ),
    (INTEGRATOR, r#"<integrator type="depth"/>"#, "", true),
    // A sensor that nobody looks through may be one that is lacking; one that is wrong may not.
    (
        "<emitter",
        r#"<sensor type="distant"><shape type="plane" name="target"/></sensor><emitter"#,
        "",
        true,
    ),
    (
        "<emitter",
        r#"<sensor type="perspective"><float name="fov" value="30"/><film type="hdrfilm"><integer name="width" value="3"/>
            <integer name="height" value="3"/></film></sensor><emitter"#,
        "--crop 2,2,8,4",
        true,
    ),
    (
        "<emitter",
        r#"<sensor type="distant"><shape type="plane" name="target"/></sensor><emitter"#,
        "--sensor 1",
        false,
    ),
    (
        "<emitter",
        r#"<sensor type="perspective"><float name="fow" value="3"/></sensor><emitter"#,
        "",
        false,
    ),
    (
        INTEGRATOR,
        r#"<integrator type="aov"><string name="aovs" value="d:depth,d:depth"/></integrator>"#,
        "",
        false,
    ),
    (
        INTEGRATOR,
        r#"<integrator type="aov"><string name="aovs" value="d:debth"/></integrator>"#,
        "",
        false,
    ),
    (INTEGRATOR, r#"<integrator type="pahth"/>"#, "", false),
    (INTEGRATOR, r#"<integrator type="volpath"/>"#, "", true),
    (INTEGRATOR, r#"<integrator type="ptracer"/>"#, "", true),
    (INTEGRATOR, r#"<integrator type="prbvolpath"/>"#, "", false),
    (
        "\"grey\"/>",
        "\"grey\"><float name=\"alpha\" value=\"1\"/></bsdf>",
        "",
        false,
    ),
    (SPHERE, "<shape type=\"spere\">", "", false),
    (SPHERE, "<shape type=\"ply\">", "", false),
    (
        SPHERE,
        r#"<shape type="obj"><string name="filename" value="missing.obj"/></shape><shape type="sphere">"#,
        "",
        false,
    ),
    ("constant", "konstant", "", false),
    ("<sensor", "<senzor", "", false),
    ("$radius", "$radios", "", false),
    ("", "", "-D radius=x", false),
    ("", "", "-D raduis=1", false),
    ("", "", "--integrator pathe", false),
    ("", "", "--max-depth -7", false),
    ("", "", "--sampler sobel", false),
    ("", "", "--sensor back", false),
    ("", "", "--sensor 1", false),
    ("", "", "--crop 0,0,99,99", false),
    ("", "", "--size 0x8", false),
    ("", "", "--strict --sampler sobol", false),
    ("", "", "--memory-limit 1k", false),
];

struct Place(tempfile::TempDir);

impl Place {
    /// A folder with the scene of a case.
    fn of(&(from, to, _, _): &(&str, &str, &str, bool)) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        assert!(SCENE.contains(from), "{from}");
        let text = match from {
            "" => SCENE.to_owned(),
            from => SCENE.replacen(from, to, 1),
        };
        fs::write(folder.path().join("a.xml"), text).expect("it is writable");
        Self(folder)
    }

    fn run(&self, command: &str, more: &str) -> Output {
        let words = [command, more].into_iter().flat_map(str::split_whitespace);
        Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(self.0.path())
            .args(words)
            .output()
            .expect("the program starts")
    }
}

fn said(output: &Output) -> (Option<i32>, String) {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), text)
}

#[test]
fn check_and_info_say_what_render_says() {
    for case in CASES {
        let place = Place::of(case);
        let options = case.2;
        let rendered = said(&place.run("render a.xml -o a.exr", options));
        let accepted = rendered.0 == Some(0);
        assert_eq!(accepted, case.3, "{case:?}: {}", rendered.1);
        for command in ["check a.xml", "info a.xml"] {
            let told = said(&place.run(command, options));
            assert_eq!(told, rendered, "{command}: {case:?}");
        }
    }
}

#[test]
fn every_sensor_of_a_scene_can_be_checked() {
    let case = (
        "<emitter",
        r#"<sensor type="distant"><shape type="plane" name="target"/></sensor><emitter"#,
        "",
        false,
    );
    let place = Place::of(&case);
    let (status, told) = said(&place.run("check a.xml", "--sensor all"));
    assert_eq!(status, Some(1));
    assert!(told.contains("cannot measure a plane"), "{told}");
}

/// What the other commands do not have.
#[cfg(unix)]
const ONLY_HERE: &[&str] = &["--memory-limit"];

#[cfg(unix)]
#[test]
fn crosscheck_takes_what_render_takes() {
    use std::os::unix::fs::PermissionsExt;

    for case in CASES {
        let (_, _, options, accepted) = *case;
        if ONLY_HERE.iter().any(|option| options.contains(option)) {
            continue;
        }
        let place = Place::of(case);
        // The other side is Étendue itself, so that it has all that this one has.
        let python = place.0.path().join("python");
        let etendue = env!("CARGO_BIN_EXE_etendue");
        fs::write(
            &python,
            format!("#!/bin/sh\nexec '{etendue}' crosscheck-worker\n"),
        )
        .expect("writable");
        fs::set_permissions(&python, fs::Permissions::from_mode(0o755)).expect("it is ours");
        let bands = match options.contains("--bands") {
            true => "--variant scalar_spectral",
            false => "",
        };
        let command = "crosscheck a.xml --python ./python --seeds 2 --timing-only -q";
        let (status, told) = said(&place.run(command, &format!("{options} {bands}")));
        assert_eq!(status == Some(0), accepted, "{case:?}: {told}");
    }
}

#[test]
fn profile_takes_what_render_takes() {
    for case in CASES {
        let (_, _, options, accepted) = *case;
        let swept = ["--spp", "--size", "--crop", "--bands"];
        // What is accepted is measured, which takes a second: a few are enough.
        let few = ["", "--integrator direct -D radius=0.5 --sensor front"];
        let wanted = !accepted || few.contains(&options) && case.0 != FILM;
        if swept.iter().any(|option| options.contains(option)) || !wanted {
            continue;
        }
        let place = Place::of(case);
        let command = "profile a.xml --quick --rounds 1 --sweep depth,samples -q";
        let (status, told) = said(&place.run(command, options));
        assert_eq!(status == Some(0), accepted, "{case:?}: {told}");
    }
}
