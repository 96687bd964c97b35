//! Renders in processes of their own that are stopped and killed: what is left, and how they go on.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant, SystemTime};

use etendue::image::{self, Image, Limits};
use serde_json::Value;

const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="128"/><integer name="height" value="96"/></film>
        <sampler type="stratified"><integer name="sample_count" value="400"/></sampler>
    </sensor>
    <emitter type="constant"/>
    <shape type="sphere"/>
    <shape type="rectangle"><transform name="to_world">
        <scale value="9"/><rotate x="1" angle="-90"/><translate y="-1"/>
    </transform></shape>
</scene>"#;

/// A folder with the scene in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.xml"), SCENE).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_etendue"));
        command
            .current_dir(self.0.path())
            .args(["render", "scene.xml"])
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    fn start(&self, arguments: &[&str]) -> Child {
        self.command(arguments).spawn().unwrap()
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }
}

fn read(path: &Path) -> Image {
    image::read(path, &Limits::default()).unwrap().image
}

fn object(output: &Output) -> Value {
    let stderr = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {stderr}"))
}

fn wait_for(path: &Path) {
    let begin = Instant::now();
    while !path.exists() {
        assert!(begin.elapsed() < Duration::from_secs(60), "{path:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_render_that_is_killed_at_ten_random_moments_ends_with_the_same_bits() {
    let place = Place::new();
    let whole = place.run(&["-o", "whole.exr", "--json"]);
    let keeping = [
        "-o",
        "killed.exr",
        "--json",
        "--checkpoint",
        "0.02",
        "--resume",
    ];
    let (mut kept, mut random) = (
        false,
        SystemTime::UNIX_EPOCH.elapsed().unwrap().subsec_nanos(),
    );
    for _ in 0..10 {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let mut child = place.start(&keeping);
        std::thread::sleep(Duration::from_millis(u64::from(10 + (random >> 16) % 150)));
        child.kill().unwrap();
        child.wait().unwrap();
        kept |= place.path("killed.exr.checkpoint").exists();
    }
    assert!(kept, "no checkpoint was written");
    let resumed = place.run(&keeping);
    assert!(resumed.status.success());
    let (whole, resumed) = (object(&whole), object(&resumed));
    assert_eq!(whole["stats"], resumed["stats"]);
    assert_eq!(whole["completed"], resumed["completed"]);
    assert_eq!(
        read(&place.path("whole.exr")),
        read(&place.path("killed.exr"))
    );
    let mut left: Vec<_> = fs::read_dir(place.0.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    left.sort();
    assert_eq!(left, ["killed.exr", "scene.xml", "whole.exr"]);
}

#[cfg(unix)]
#[test]
fn each_signal_leaves_a_valid_image_and_a_second_start_finishes_it() {
    let place = Place::new();
    let whole = place.run(&["-o", "whole.exr", "-q", "--spp", "200"]);
    assert!(whole.status.success());
    for signal in ["INT", "TERM", "HUP"] {
        let name = format!("{signal}.exr");
        let checkpoint = place.path(&format!("{signal}.exr.checkpoint"));
        let keeping = [
            "-o",
            &name,
            "--spp",
            "200",
            "--json",
            "--checkpoint",
            "0.02",
        ];
        let child = place.start(&keeping);
        wait_for(&checkpoint);
        let sent = Command::new("kill")
            .args([format!("-{signal}"), child.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{signal}");
        let told = object(&output);
        assert_eq!(told["status"], "interrupted");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("passes"), "{said}");
        let picture = image::read(&place.path(&name), &Limits::default()).unwrap();
        let samples = &told["completed"]["samples"];
        let entry = picture
            .metadata
            .iter()
            .find(|(name, _)| name == "samples_complete");
        assert_eq!(entry.unwrap().1, samples.to_string());
        let resumed = place.run(&["-o", &name, "-q", "--spp", "200", "--resume"]);
        assert!(resumed.status.success() && resumed.stdout.is_empty());
        assert_eq!(read(&place.path(&name)), read(&place.path("whole.exr")));
        assert!(!checkpoint.exists());
    }
}

#[test]
fn a_time_limit_is_no_failure_and_can_be_continued() {
    let place = Place::new();
    let limited = [
        "-o",
        "a.exr",
        "--json",
        "--time-limit",
        "0.3",
        "--checkpoint",
        "100",
        "--spp",
        "100000",
    ];
    let output = place.run(&limited);
    assert!(output.status.success());
    let first = object(&output);
    assert_eq!(first["status"], "time limit");
    assert!(place.path("a.exr").exists() && place.path("a.exr.checkpoint").exists());
    let output = place.run(&[&limited[..], &["--resume"]].concat());
    let second = object(&output);
    let done = |told: &Value| told["completed"]["units"][0].as_u64().unwrap();
    assert!(done(&second) > done(&first));
    let other = place.run(&[&limited[..], &["--resume", "--seed", "1"]].concat());
    assert_eq!(other.status.code(), Some(1));
    assert_eq!(object(&other)["status"], "failed");
    let said = String::from_utf8_lossy(&other.stderr);
    assert!(
        said.contains("a setting (the seed, the bands or adaptive sampling) has changed"),
        "{said}"
    );
}
