//! Manifests of images: what is rendered, what is left out because it is there, and what is said of what fails.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

const SCENE: &str = r#"<scene version="3.0.0">
    <default name="radius" value="1"/>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
    </sensor>
    <emitter type="constant"/>
    <shape type="sphere"><float name="radius" value="$radius"/></shape>
    <shape type="ply"><string name="filename" value="floor.ply"/></shape>
</scene>"#;

const FLOOR: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n-9 -1 -9\n9 -1 -9\n0 -1 9\n3 0 1 2\n";

const JOB: &str = r#"
[defaults]
spp = 2

[[images]]
scenes = ["a.xml", "b.xml"]
output = "out/{name}-{frame}-{radius}.exr"
frames = "0:2"
define = { radius = [0.5, 2] }

[[images]]
scenes = "a.xml"
output = "out/large.exr"
size = "40x30"
noise_threshold = 0.5
spp = false
max_spp = 64
"#;

/// A folder with a manifest and what it needs.
struct Place(tempfile::TempDir);

impl Place {
    fn new(job: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in [
            ("a.xml", SCENE),
            ("b.xml", SCENE),
            ("floor.ply", FLOOR),
            ("job.toml", job),
        ] {
            fs::write(folder.path().join(name), text).expect("writable");
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, words: &str) -> Output {
        // From elsewhere: files are named from the manifest's folder.
        Command::new(env!("CARGO_BIN_EXE_etendue"))
            .arg("batch")
            .arg(self.path("job.toml"))
            .args(words.split_whitespace())
            .output()
            .expect("the program starts")
    }

    /// The report of a run that ends with this status.
    #[track_caller]
    fn report(&self, words: &str, status: i32) -> Value {
        let output = self.run(&format!("--json {words}"));
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{said}");
        serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {said}"))
    }
}

#[test]
fn all_images_of_a_manifest_are_rendered_once_and_again_where_something_changed() {
    let place = Place::new(JOB);
    let first = place.report("", 0);
    assert_eq!(
        (&first["rendered"], &first["format"]),
        (&9.into(), &1.into())
    );
    for name in ["a-0-0.5", "a-1-2", "b-1-0.5", "large"] {
        assert!(place.path(&format!("out/{name}.exr")).exists(), "{name}");
    }
    let second = place.report("", 0);
    assert_eq!(
        (&second["rendered"], &second["skipped"]),
        (&0.into(), &9.into())
    );

    // Blanks change nothing, a value does.
    fs::write(place.path("b.xml"), SCENE.replace("<shape", "<shape ")).unwrap();
    assert_eq!(place.report("", 0)["skipped"], 9);
    fs::write(place.path("b.xml"), SCENE.replace("constant", "point")).unwrap();
    assert_eq!(place.report("", 0)["rendered"], 4);
    // A damaged image, and one whose file is gone.
    fs::write(place.path("out/large.exr"), "x").unwrap();
    fs::remove_file(place.path("out/a-0-2.exr")).unwrap();
    assert_eq!(place.report("", 0)["rendered"], 2);
    fs::write(place.path("floor.ply"), FLOOR.replace("0 -1 9", "0 -1 8")).unwrap();
    assert_eq!(place.report("", 0)["rendered"], 9);
    fs::write(place.path("job.toml"), JOB.replace("spp = 2", "spp = 3")).unwrap();
    assert_eq!(place.report("", 0)["rendered"], 8);
}

#[test]
fn what_fails_is_told_and_keeps_nothing_else_from_being_rendered() {
    let place = Place::new(&JOB.replace("[0.5, 2]", r#"[0.5, "large"]"#));
    let report = place.report("--retries 3", 1);
    assert_eq!(
        (&report["rendered"], &report["failed"]),
        (&5.into(), &4.into())
    );
    for image in report["images"].as_array().unwrap() {
        if image["status"] == "failed" {
            // What is wrong with the input is no better the second time.
            assert_eq!(image["attempts"], 1);
            let problem = image["problems"][0]["message"].as_str().unwrap();
            assert!(
                problem.contains("radius") || problem.contains("large"),
                "{problem}"
            );
        }
    }
    let text = String::from_utf8(place.run("").stdout).unwrap();
    assert!(text.contains("5 skipped, 4 failed"), "{text}");
    fs::remove_file(place.path("out/large.exr")).unwrap();
    let report = place.report("--memory-limit 1k", 1);
    let message = report["images"][8]["problems"][0]["message"]
        .as_str()
        .unwrap();
    assert!(message.contains("limit of 1.0 kB"), "{message}");
}

#[test]
fn a_dry_run_lists_images_with_time_and_memory_and_what_is_there() {
    let place = Place::new(JOB);
    let list = |words: &str| -> Vec<Value> {
        let output = place.run(words);
        assert!(output.status.success());
        let text = String::from_utf8(output.stdout).unwrap();
        text.lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    };
    let images = list("--dry-run --json");
    assert_eq!(images.len(), 9);
    assert!(!place.path("out").exists());
    for image in &images {
        assert!(image["seconds"].as_f64().unwrap() > 0.0 && image["bytes"].as_u64().unwrap() > 0);
        assert_eq!(image["current"], false);
    }
    assert_eq!(images[0]["crop"]["width"], 24);
    assert_eq!(
        (&images[0]["passes"], &images[0]["spp"]),
        (&2.into(), &2.into())
    );
    assert_eq!(images[8]["adaptive"], true);
    place.report("", 0);
    assert!(
        list("--dry-run --json")
            .iter()
            .all(|image| image["current"] == true)
    );
    let output = place.run("--dry-run");
    assert!(String::from_utf8_lossy(&output.stdout).contains("9 of them there already"));
}

#[test]
fn commands_do_what_the_batch_does() {
    let place = Place::new(JOB);
    let commands = String::from_utf8(place.run("--commands").stdout).unwrap();
    assert_eq!(commands.lines().count(), 9);
    let program = env!("CARGO_BIN_EXE_etendue");
    for command in commands.lines() {
        let command = command.replacen("etendue", program, 1);
        let status = Command::new("sh")
            .args(["-ec", &command])
            .current_dir(place.0.path())
            .stdout(std::process::Stdio::null())
            .status();
        assert!(status.unwrap().success(), "{command}");
    }
    assert_eq!(place.report("", 0)["skipped"], 9);
}

#[test]
fn what_is_wrong_with_a_manifest_is_said_with_its_line() {
    for (text, expected) in [
        ("[[images]]\nscenes = \"a.xml\"", "job.toml:1"),
        ("[[images]]\nscenes = \"a.xml\"", "no \"output\""),
        ("[[images]]\noutput = \"a.exr\"", "no \"scenes\""),
        (
            "spp = 3\n[[images]]\nscenes = \"a.xml\"\noutput = \"a.exr\"",
            "spp",
        ),
        (
            "[[images]]\nscenes = \"a.xml\"\noutput = \"a.exr\"\nsssp = 3",
            "--sssp",
        ),
        (
            "[[images]]\nscenes = \"a.xml\"\noutput = \"a.exr\"\nspp = 0",
            "--spp",
        ),
        (
            "[[images]]\nscenes = \"a.xml\"\noutput = \"a.exr\"\nspp = []",
            "0 combinations",
        ),
        (
            "[[images]]\nscenes = \"a.xml\"\noutput = \"a.exr\"\nquiet = true",
            "on the command line",
        ),
        (
            "[[images]]\nscenes = \"a.xml\"\noutput = \"a.exr\"\nseed = [1, 2]",
            "would both be written",
        ),
        (
            "[[images]]\nscenes = \"a.xml\"\noutput = \"a.exr\"\ndefine = 3",
            "define is a table",
        ),
        ("[[images]]\nscenes = [\"a.xml\"\n", "job.toml:"),
        (
            "[[images]]\nscenes = { a = 1 }\noutput = \"a.exr\"",
            "nor a list",
        ),
        ("", "images"),
    ] {
        let place = Place::new(text);
        let output = place.run("--dry-run");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{text}: {said}");
        assert!(said.contains(expected), "{text}: {said}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_image_whose_process_is_killed_is_tried_again_and_a_signal_ends_the_batch() {
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    let place = Place::new(
        "[[images]]\nscenes = \"a.xml\"\nspp = [4000, 4001]\nsize = \"64x48\"\noutput = \"{spp}.exr\"",
    );
    let start = || {
        Command::new(env!("CARGO_BIN_EXE_etendue"))
            .arg("batch")
            .arg(place.path("job.toml"))
            .args(["--json", "--retries", "1"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let child_of = |id: u32| -> u32 {
        let begin = Instant::now();
        loop {
            let path = format!("/proc/{id}/task/{id}/children");
            let text = fs::read_to_string(path).unwrap_or_default();
            if let Some(child) = text.split_whitespace().next() {
                return child.parse().unwrap();
            }
            assert!(begin.elapsed() < Duration::from_secs(30));
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    let signal = |name: &str, id: u32| {
        let sent = Command::new("kill").args([name, &id.to_string()]).status();
        assert!(sent.unwrap().success());
    };
    let batch = start();
    signal("-KILL", child_of(batch.id()));
    let output = batch.wait_with_output().unwrap();
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["rendered"], 2, "{report}");
    assert_eq!(report["images"][0]["attempts"], 2);
    assert_eq!(report["images"][1]["attempts"], 1);

    for spp in [4000, 4001] {
        fs::remove_file(place.path(&format!("{spp}.exr"))).unwrap();
    }
    let batch = start();
    child_of(batch.id());
    signal("-TERM", batch.id());
    let output = batch.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["rendered"], 0);
    assert_eq!(report["images"][1]["status"], "not begun");
}
