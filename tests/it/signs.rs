//! Signs of life: events, plain lines, pictures of renders that go on, and what programs are told.

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use etendue::budget::Budget;
use etendue::image;
use serde_json::Value;

const SCENE: &str = r#"<scene version="3.0.0">
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film>
        <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
    </sensor>
    <emitter type="constant"/>
    <shape type="sphere"/>
</scene>"#;

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("a.xml"), SCENE).expect("writable");
        fs::write(folder.path().join("broken.xml"), "<scene><shape/></scene>").expect("writable");
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, words: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_etendue"));
        command
            .current_dir(self.0.path())
            .args(words.split_whitespace())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    fn run(&self, words: &str) -> Output {
        self.command(words).output().expect("the program starts")
    }

    fn start(&self, words: &str) -> Child {
        self.command(words).spawn().expect("the program starts")
    }
}

/// The objects on lines of their own.
fn objects(text: &[u8]) -> Vec<Value> {
    let text = String::from_utf8_lossy(text);
    let object = |line: &str| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"));
    text.lines().map(object).collect()
}

#[test]
fn events_tell_a_render_from_its_start_to_its_end() {
    let place = Place::new();
    let output = place.run("render a.xml broken.xml -o {name}.exr --progress json");
    assert_eq!(output.status.code(), Some(1));
    let events = objects(&output.stderr);
    assert!(events.iter().all(|event| event["format"] == 1));
    let names: Vec<&str> = events
        .iter()
        .map(|e| e["event"].as_str().unwrap())
        .collect();
    assert_eq!(
        names,
        [
            "started", "loaded", "built", "image", "started", "problem", "image", "done"
        ]
    );
    assert_eq!(
        (&events[3]["status"], &events[3]["width"]),
        (&"rendered".into(), &Value::Null)
    );
    assert_eq!(events[3]["size"]["width"], 64);
    assert_eq!(events[5]["severity"], "error");
    assert_eq!(
        (&events[7]["images"], &events[7]["status"]),
        (&2.into(), &1.into())
    );
}

#[test]
fn a_long_render_tells_how_far_it_is_and_when_it_will_end() {
    let place = Place::new();
    let limited = "render a.xml -o a.exr --spp 1000000 --time-limit 2.5 --progress json";
    let events = objects(&place.run(limited).stderr);
    let progress: Vec<&Value> = events.iter().filter(|e| e["event"] == "progress").collect();
    assert!(progress.len() >= 2, "{events:?}");
    for event in progress {
        assert_eq!(event["phase"], "render");
        assert!(event["done"].as_u64() < event["total"].as_u64());
        assert!(event["seconds_left"].as_f64().unwrap() > 1.0);
        assert!(event["samples_per_second"].as_f64().unwrap() > 0.0);
    }
    // Neither a short render nor who wants nothing hears anything.
    for words in ["--progress plain", "", "--progress none", "-q"] {
        let output = place.run(&format!("render a.xml -o a.exr {words}"));
        assert!(output.stderr.is_empty(), "{words}");
    }
}

#[test]
fn a_profile_tells_programs_how_far_it_is() {
    let place = Place::new();
    let sweep = "profile a.xml --quick --rounds 1 --sweep samples --json --progress json";
    let output = place.run(sweep);
    assert_eq!(output.status.code(), Some(0));
    let events = objects(&output.stderr);
    assert!(events.iter().all(|event| event["format"] == 1));
    let is = |event: &Value, name: &str| event["event"] == name;
    assert!(is(&events[0], "started"), "{events:?}");
    let (done, progress) = events[1..].split_last().expect("there is an end");
    assert!(is(done, "done") && done["status"] == 0, "{events:?}");
    assert!(!progress.is_empty(), "{events:?}");
    for event in progress {
        assert!(is(event, "progress"), "{event}");
        assert!(event["done"].as_u64() <= event["total"].as_u64());
        assert!(event["what"].is_string() && event["seconds"].is_f64());
    }
    let output = place.run("profile broken.xml --progress json");
    let events = objects(&output.stderr);
    assert!(
        events.iter().any(|event| is(event, "problem")),
        "{events:?}"
    );
    assert_eq!(events[events.len() - 1]["status"], 1);
    for words in ["--progress none", "-q"] {
        let output = place.run(&format!(
            "profile a.xml --quick --rounds 1 --sweep samples {words}"
        ));
        assert!(output.stderr.is_empty(), "{words}");
    }
}

#[test]
fn without_a_terminal_a_line_comes_after_ten_seconds() {
    let place = Place::new();
    let output = place.run("render a.xml -o a.exr --spp 10000000 --time-limit 11.5");
    let said = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<&str> = said.lines().filter(|l| l.contains("M samples/s")).collect();
    assert!(
        lines.len() == 1 && lines[0].starts_with("a.xml: rendering"),
        "{said}"
    );
    assert!(lines[0].ends_with("left"), "{said}");
}

#[test]
fn an_image_is_written_as_it_stands_and_is_whole_from_the_first_pass_on() {
    let place = Place::new();
    for (words, asked) in [("--snapshot 0.05", false), ("", true)] {
        fs::remove_file(place.path("a.exr")).ok();
        let mut child = place.start(&format!("render a.xml -q -o a.exr --spp 1000000 {words}"));
        let begin = Instant::now();
        while !place.path("a.exr").exists() {
            assert!(begin.elapsed() < Duration::from_secs(60));
            // Before it listens to the signal it would end the process.
            if asked && begin.elapsed() > Duration::from_secs(2) {
                let id = child.id().to_string();
                Command::new("kill").args(["-USR1", &id]).status().unwrap();
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        assert!(child.try_wait().unwrap().is_none(), "it goes on");
        child.kill().unwrap();
        child.wait().unwrap();
        let picture = image::read(&place.path("a.exr"), &Budget::default().open()).unwrap();
        assert!(picture.image.data().iter().all(|value| *value > 0.0));
        let entry = |name: &str| {
            let found = picture.metadata.iter().find(|(known, _)| known == name);
            found.unwrap_or_else(|| panic!("{name}")).1.clone()
        };
        assert!(entry("samples_complete").parse::<u32>().unwrap() > 0);
        assert!(entry("machine").contains("processor"));
    }
}

#[test]
fn every_json_says_its_format_and_a_version_tells_what_it_was_made_of() {
    let place = Place::new();
    place.run("render a.xml -q -o b.exr --seed 2");
    place.run("render a.xml -q -o b.part");
    for words in [
        "render a.xml -o a.exr --json",
        "check a.xml --json",
        "check broken.xml --json",
        "info a.xml a.exr --json",
        "compare a.exr b.exr --json",
        "compare a.exr c.exr --json",
        "merge c.exr b.part --json",
        "mesh generate terrain m.ply --triangles 200 --json",
        "mesh convert m.ply n.ply --json",
        "mesh report m.ply --json",
        "plugins sphere --json",
        "profile a.xml --quick --rounds 1 --sweep depth -q --json",
    ] {
        let output = place.run(words);
        let said = String::from_utf8_lossy(&output.stderr);
        let objects = objects(&output.stdout);
        assert!(!objects.is_empty(), "{words}: {said}");
        for object in objects {
            assert!(object["format"].is_u64(), "{words}: {object}");
        }
    }
    let version = String::from_utf8(place.run("--version").stdout).unwrap();
    for part in [env!("CARGO_PKG_VERSION"), "commit", "target", "kernel"] {
        assert!(version.contains(part), "{version}");
    }
}
