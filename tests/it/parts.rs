//! Parts of images, rendered by processes of their own, and what `etendue merge` makes of them: the bits of one run, or an
//! error that names the part.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

/// With lights, a glossy floor and channels of its own, at 5 passes.
const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="aov"><string name="aovs" value="d:depth,n:sh_normal"/>
        <integrator type="path"><integer name="max_depth" value="4"/></integrator></integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="70"/><integer name="height" value="40"/></film>
        <sampler type="stratified"><integer name="sample_count" value="64"/></sampler>
    </sensor>
    <emitter type="constant"/>
    <shape type="sphere"/>
    <shape type="rectangle"><transform name="to_world">
        <scale value="9"/><rotate x="1" angle="-90"/><translate y="-1"/>
    </transform><bsdf type="roughconductor"/></shape>
</scene>"#;

/// Crops that cover the film, none of them along its tiles.
const CROPS: [&str; 3] = ["0,0,33,40", "33,0,37,21", "33,21,37,19"];

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("scene.xml"), SCENE).expect("writable");
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, words: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(self.0.path())
            .args(words.split_whitespace())
            .output()
            .expect("the program starts")
    }

    #[track_caller]
    fn succeed(&self, words: &str) -> Output {
        let output = self.run(words);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{words}: {said}");
        output
    }

    /// What standard error says when it ends with status 1.
    #[track_caller]
    fn refused(&self, words: &str) -> String {
        let output = self.run(words);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{words}: {said}");
        said
    }

    /// Renders these passes of all crops, and names the parts.
    fn parts(&self, options: &str, passes: &[&str]) -> Vec<String> {
        let mut names = Vec::new();
        for crop in CROPS {
            for passes in passes {
                let name = format!("{crop}-{}.part", passes.replace(':', "to"));
                self.succeed(&format!(
                    "render scene.xml -q -o {name} {options} --crop {crop} --passes {passes}"
                ));
                names.push(name);
            }
        }
        names
    }
}

#[test]
fn crops_and_passes_of_any_kind_of_render_come_to_the_bits_of_one_run() {
    for (options, passes) in [
        ("", &["0:1", "1:2", "2:4", "4:"][..]),
        ("--bands 16 --spp 20", &["0:2", "2:3"]),
        ("--bands 70 --spp 20", &["0:1", "1:3"]),
        (
            "--noise-threshold 0.02 --max-spp 200 --sampler independent",
            &["0:1", "1:2", "2:"],
        ),
        (
            "--noise-threshold 0.05 --bands 16 --max-spp 96",
            &["0:2", "2:"],
        ),
    ] {
        let place = Place::new();
        let whole = place.succeed(&format!("render scene.xml --json -o whole.exr {options}"));
        let mut parts = place.parts(options, passes);
        parts.reverse();
        let merged = place.succeed(&format!("merge merged.exr --json {}", parts.join(" ")));
        let [whole, merged] = [whole, merged]
            .map(|output| -> Value { serde_json::from_slice(&output.stdout).expect("an object") });
        assert_eq!(merged["parts"], parts.len());
        assert_eq!(merged["spp"], whole["spp"], "{options}");
        assert_eq!(merged["adaptive"], whole["adaptive"], "{options}");
        let [whole, merged] = ["whole.exr", "merged.exr"].map(|name| fs::read(place.path(name)));
        assert!(whole.unwrap() == merged.unwrap(), "{options}");
    }
}

#[test]
fn parts_of_one_crop_count_what_one_run_counts() {
    for options in ["--spp 20", "--noise-threshold 0.02 --max-spp 99"] {
        let place = Place::new();
        let whole = place.succeed(&format!(
            "render scene.xml --json -o whole.exr --crop 9,3,40,30 {options}"
        ));
        let parts: Vec<&str> = vec!["0:1", "1:2", "2:"];
        let mut names = String::new();
        for passes in parts {
            let name = format!("p{}.part", passes.replace(':', "to"));
            place.succeed(&format!(
                "render scene.xml -q -o {name} --crop 9,3,40,30 {options} --passes {passes}"
            ));
            names += &format!(" {name}");
        }
        let said = place.refused(&format!("merge merged.exr{names}"));
        assert!(said.contains("no part is of the crop 0,0,70,3"), "{said}");
        let merged = place.succeed(&format!("merge merged.exr --json --crop 9,3,40,30{names}"));
        let [whole, merged] = [whole, merged]
            .map(|output| -> Value { serde_json::from_slice(&output.stdout).expect("an object") });
        assert_eq!(whole["stats"], merged["stats"], "{options}");
        let [whole, merged] = ["whole.exr", "merged.exr"].map(|name| fs::read(place.path(name)));
        assert!(whole.unwrap() == merged.unwrap(), "{options}");
    }
}

#[test]
fn what_is_missing_doubled_damaged_or_of_another_image_is_named_and_nothing_is_written() {
    let place = Place::new();
    let parts = place.parts("--spp 20", &["0:2", "2:"]);
    let all = parts.join(" ");
    let but = |left_out: usize| {
        let kept = parts.iter().enumerate().filter(|(i, _)| *i != left_out);
        kept.map(|(_, name)| name.as_str())
            .collect::<Vec<_>>()
            .join(" ")
    };
    let merge = |parts: &str| {
        let said = place.refused(&format!("merge merged.exr {parts}"));
        assert!(!place.path("merged.exr").exists());
        said
    };
    let said = merge(&but(3));
    assert!(
        said.contains("passes 2:3 of the crop 33,0,37,21 are in no part"),
        "{said}"
    );
    let said = merge(&format!("{} {}", but(0), parts[1]));
    assert!(
        said.contains("passes 0:2 of the crop 0,0,33,40 are in no part"),
        "{said}"
    );
    assert!(said.contains("both hold passes 2:3"), "{said}");
    place.succeed("render scene.xml -q -o extra.part --spp 20 --crop 30,5,9,9");
    let said = place.refused(&format!("merge {all}"));
    assert!(said.contains("no place for the image"), "{said}");
    let said = merge(&format!("{all} extra.part"));
    assert!(said.contains("extra.part overlap"), "{said}");

    for (option, what) in [
        ("--seed 3", "a setting"),
        ("--spp 21", "the view"),
        ("--bands 3", "a setting"),
    ] {
        let spp = if option.contains("spp") {
            ""
        } else {
            "--spp 20"
        };
        place.succeed(&format!(
            "render scene.xml -q -o other.part {spp} {option} --crop {} --passes 2:3",
            CROPS[2]
        ));
        let said = merge(&format!("{} other.part", but(5)));
        assert!(
            said.contains("other.part is a part of another image") && said.contains(what),
            "{said}"
        );
    }

    let whole = fs::read(place.path(&parts[4])).unwrap();
    let half = whole.len() / 2;
    let mut changed = whole.clone();
    changed[half] ^= 1;
    let longer = [&whole[..], b"x"].concat();
    for (bytes, why) in [
        (&whole[..half], "it is shorter than it says"),
        (&whole[..9], "ends too early"),
        (
            b"\x76\x2f\x31\x01 this is no part at all",
            "does not begin like one",
        ),
        (&changed, "not what was written"),
        (&longer, "more behind its end"),
    ] {
        fs::write(place.path(&parts[4]), bytes).unwrap();
        let said = merge(&all);
        assert!(
            said.contains(&parts[4]) && said.contains(why),
            "{why}: {said}"
        );
    }
    fs::write(place.path(&parts[4]), whole).unwrap();
    place.succeed(&format!("merge merged.exr {all}"));
}

#[test]
fn a_part_that_is_there_is_rendered_again_if_it_is_damaged_or_another_and_only_then() {
    let place = Place::new();
    let status = |words: &str| -> String {
        let command = "render scene.xml -q --json -o a.part --skip-same --size 20x20";
        let output = place.succeed(&format!("{command} {words}"));
        let told: Value = serde_json::from_slice(&output.stdout).expect("an object");
        told["status"].as_str().expect("a word").to_owned()
    };
    for words in [
        "--spp 20 --passes 1:2",
        "--spp 20 --passes 1:3",
        "--spp 20 --crop 0,0,9,9",
        "--spp 20 --crop 0,0,9,8",
        "--spp 20 --seed 2",
        "--noise-threshold 0.1 --max-spp 99 --passes 0:1",
        "--spp 20",
    ] {
        assert_eq!(status(words), "rendered", "{words}");
        assert_eq!(status(words), "skipped", "{words}");
    }
    let whole = fs::read(place.path("a.part")).unwrap();
    fs::write(place.path("a.part"), &whole[..whole.len() - 3]).unwrap();
    assert_eq!(status("--spp 20"), "rendered");
    fs::write(place.path("scene.xml"), SCENE.replace("constant", "point")).unwrap();
    assert_eq!(status("--spp 20"), "rendered");
    assert_eq!(status("--spp 20"), "skipped");
}

#[test]
fn every_byte_of_a_parts_head_and_records_may_be_wrong() {
    let place = Place::new();
    place.succeed("render scene.xml -q -o a.part --spp 2 --size 9x5 --passes 0:1");
    place.succeed("render scene.xml -q -o b.part --spp 2 --size 9x5 --passes 1:2");
    let whole = fs::read(place.path("b.part")).unwrap();
    for i in (0..whole.len()).step_by(whole.len() / 120) {
        let mut bytes = whole.clone();
        bytes[i] = bytes[i].wrapping_add(97);
        fs::write(place.path("b.part"), &bytes).unwrap();
        let said = place.refused("merge merged.exr a.part b.part");
        assert!(said.contains("b.part"), "byte {i}: {said}");
    }
}

#[test]
fn a_part_is_asked_for_as_it_can_be_made() {
    let place = Place::new();
    for (words, expected) in [
        ("-o a.exr --passes 0:1", "is an image"),
        ("-o a.part --time-limit 3", "--time-limit is for images"),
        ("-o a.part --checkpoint 3", "--checkpoint is for images"),
        ("-o a.part --tev localhost:1", "--tev is for images"),
        ("-o a.part --foveate 1,1", "--foveate is for images"),
        ("-o a.part --passes 1:6", "this render has 5, 0:5"),
        ("-o a.part --passes 5:", "this render has 5, 0:5"),
        (
            "-o a.part --noise-threshold 0.1 --passes 99:",
            "this render has 36, 0:36",
        ),
    ] {
        let said = place.refused(&format!("render scene.xml {words}"));
        assert!(said.contains(expected), "{words}: {said}");
    }
    for passes in ["3:3", "4:2", "x:", "3", "-1:2"] {
        let output = place.run(&format!("render scene.xml -o a.part --passes {passes}"));
        assert_eq!(output.status.code(), Some(2), "{passes}");
    }
    assert!(!place.path("a.part").exists());
}
