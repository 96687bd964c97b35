//! Do images agree, and does `etendue crosscheck` say so? [`judge`] renders two scenes with several seeds each
//! and holds them against each other. The command runs against a Mitsuba that is no more than a script, so
//! that every way in which one can fail is seen; against the real one where there is one.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use etendue::compare::seeds::{self, Side, Verdict};
use serde_json::Value;

use super::support::{at, image_of, mitsuba};

/// Renders `a` and `b` `count` times each, no two with the same seed, and judges.
fn judge(a: &str, b: &str, count: u64) -> Verdict {
    let side = |text: &str, first: u64| {
        let mut images = (first..first + count).map(|seed| image_of(text, seed));
        let image = images.next().expect("there are seeds");
        let mut side = Side::new(&image, image.rgb()).expect("it is small");
        side.push(&image).expect("it is the first");
        for image in images {
            side.push(&image).expect("it is of the same size");
        }
        side
    };
    seeds::judge(&side(a, 1), &side(b, 1 + count), 0.99).expect("the sides are alike")
}

/// A sphere over a floor under a small lamp: shadows, and a lamp of this strength.
fn lamp(radiance: f64) -> String {
    format!(
        r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="3"/></integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 2, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/></film>
        <sampler type="independent"><integer name="sample_count" value="64"/></sampler>
    </sensor>
    <shape type="rectangle">
        <transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/><translate y="-1"/></transform>
    </shape>
    <shape type="sphere"/>
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="90"/><translate y="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter>
    </shape>
</scene>"#
    )
}

#[test]
fn a_scene_agrees_with_itself_and_not_with_two_per_cent_more_light() {
    let same = judge(&lamp(5.0), &lamp(5.0), 8);
    assert!(same.agrees, "{}", same.sentence);
    assert!(same.means[0].half_width < 0.02, "{}", same.sentence);
    let brighter = judge(&lamp(5.0), &lamp(5.1), 8);
    assert!(!brighter.agrees, "{}", brighter.sentence);
    let found = &brighter.means[0];
    assert!(
        (found.difference - 0.02).abs() < found.half_width,
        "{found:?}"
    );
}

/// A folder with scenes, and Pythons that are shell scripts.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().expect("a temporary folder"));
        for (name, radiance) in [("dim", 5.0), ("bright", 5.1)] {
            fs::write(place.path(&format!("{name}.xml")), lamp(radiance)).expect("it is writable");
        }
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs the command with the words of `arguments`.
    fn run(&self, arguments: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(self.0.path())
            .arg("crosscheck")
            .args(arguments.split(' '))
            .output()
            .expect("the program starts")
    }

    /// Runs the command with a status to end with; what it printed.
    #[track_caller]
    fn says(&self, status: i32, arguments: &str) -> String {
        let output = self.run(arguments);
        let text = [output.stdout, output.stderr].map(|b| String::from_utf8_lossy(&b).into_owned());
        assert_eq!(
            output.status.code(),
            Some(status),
            "{arguments}: {}",
            text.concat()
        );
        text.concat()
    }
}

/// What goes wrong with the other side, and what is said then.
#[cfg(unix)]
mod impostors {
    use std::os::unix::fs::PermissionsExt;
    use std::time::{Duration, Instant};

    use super::*;

    const LOADED: &str =
        r#"echo '{"loaded":{"renderer":"x","time":{"seconds":0,"cpu":0},"notes":[]}}'"#;

    impl Place {
        /// A Python of the name `python` that does what `script` says, whatever it is given.
        fn python(&self, script: &str) {
            let path = self.path("python");
            fs::write(&path, format!("#!/bin/sh\n{script}\n")).expect("it is writable");
            let executable = fs::Permissions::from_mode(0o755);
            fs::set_permissions(&path, executable).expect("it is ours");
        }

        /// One that is Étendue itself.
        fn etendue_as_mitsuba(&self) {
            let etendue = env!("CARGO_BIN_EXE_etendue");
            self.python(&format!("exec '{etendue}' crosscheck-worker"));
        }
    }

    #[test]
    fn the_verdict_is_told_kept_and_in_the_status() {
        let place = Place::new();
        place.etendue_as_mitsuba();
        let told = place.says(0, "dim.xml --python ./python --seeds 4");
        assert!(
            told.contains("dim.xml: agree (4 seeds of 64 samples a side)"),
            "{told}"
        );
        let arguments = "bright.xml --reference dim.xml --python ./python --seeds 6 --keep kept";
        let told = place.says(1, arguments);
        assert!(told.contains("bright.xml: differ"), "{told}");
        for name in ["mitsuba.exr", "etendue.exr", "error.png", "signed.png"] {
            assert!(place.path("kept/bright").join(name).is_file(), "{name}");
        }
        let told = place.says(1, &format!("{arguments} --json"));
        let object: Value = serde_json::from_str(&told).expect("it is JSON");
        let bias = object["verdict"]["means"][0]["difference"].as_f64();
        assert!((bias.expect("a number") - 0.02).abs() < 0.01, "{object}");
        for side in ["etendue", "mitsuba"] {
            assert_eq!(object[side]["render"].as_array().map(Vec::len), Some(6));
            assert!(object[side]["render"][0]["cpu"].as_f64() > Some(0.0));
        }
        assert!(object["seconds_ratio"].as_f64() > Some(0.0));
    }

    #[test]
    fn programs_are_told_how_far_it_is() {
        let place = Place::new();
        place.etendue_as_mitsuba();
        let arguments = "dim.xml missing.xml --python ./python --seeds 3 --spp 1 --precision 9";
        let output = place.run(&format!("{arguments} --progress json"));
        let told = String::from_utf8_lossy(&output.stderr);
        let events: Vec<Value> = told
            .lines()
            .map(|line| serde_json::from_str(line).expect("an event"))
            .collect();
        let named = |name: &str| events.iter().filter(|e| e["event"] == name).collect();
        let [started, progress, done]: [Vec<&Value>; 3] =
            ["started", "progress", "done"].map(named);
        assert_eq!(started.len(), 2, "{told}");
        assert_eq!((done.len(), &done[0]["status"]), (1, &2.into()), "{told}");
        for event in &progress {
            assert_eq!(event["total"], 6);
            assert!(
                event["what"]
                    .as_str()
                    .is_some_and(|what| what.ends_with("at work"))
            );
        }
        assert!(!progress.is_empty(), "{told}");
    }

    #[test]
    fn what_is_too_noisy_is_not_called_agreement_and_times_need_no_verdict() {
        let place = Place::new();
        place.etendue_as_mitsuba();
        let arguments = "dim.xml --python ./python --seeds 2 --spp 4";
        let told = place.says(2, &format!("{arguments} --precision 0.0001"));
        assert!(told.contains("too noisy to say"), "{told}");
        let told = place.says(0, &format!("{arguments} --timing-only"));
        assert!(
            told.contains("dim.xml: timed") && !told.contains("bias"),
            "{told}"
        );
        let table = place.says(
            2,
            "dim.xml missing.xml --python ./python --seeds 2 --spp 4 --precision 9 -q",
        );
        assert!(
            table.contains("missing.xml: not comparable: Étendue refuses"),
            "{table}"
        );
        assert!(table.contains("\nscene        verdict"), "{table}");
    }

    #[test]
    fn another_side_that_fails_is_told_in_its_own_words_with_status_2() {
        let place = Place::new();
        let loaded = format!("read order; {LOADED}");
        for (script, said) in [
            (
                "echo \"No module named 'mitsuba'\" >&2; exit 1",
                "./python has no Mitsuba",
            ),
            ("echo nonsense; cat >/dev/null", "answered \"nonsense\""),
            (
                "echo '{\"refused\":\"Mitsuba has no bsdf \\\"x\\\"\"}'; cat",
                "not comparable: Mitsuba has no bsdf \"x\"",
            ),
            (
                &format!("{loaded}; read seed; echo so it ends >&2; kill -9 $$"),
                "ended by signal 9; its last words:\nso it ends",
            ),
            (&format!("{loaded}; exit 7"), "ended with status 7"),
            (
                &format!("{loaded}; exec sleep 60"),
                "Mitsuba took more than 1 s",
            ),
        ] {
            place.python(script);
            let told = place.says(2, "dim.xml --python ./python --seeds 2 --spp 1 --timeout 1");
            assert!(told.contains(said), "{script}: {told}");
        }
        let told = place.says(2, "dim.xml --python ./no-python");
        assert!(
            told.contains("no Python ./no-python") && told.contains("--install"),
            "{told}"
        );
    }

    /// A program that leaves a mark where it runs.
    fn trap(path: &Path, mark: &Path) {
        fs::create_dir_all(path.parent().expect("in a folder")).expect("writable");
        fs::write(
            path,
            format!("#!/bin/sh\ntouch '{}'\nexit 1\n", mark.display()),
        )
        .expect("writable");
        fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("it is ours");
    }

    #[test]
    fn nothing_of_the_current_folder_is_run_unasked() {
        let place = Place::new();
        let mark = place.path("mark");
        for program in [
            "target/venv/bin/python",
            "venv/bin/python",
            "python3",
            "python",
        ] {
            trap(&place.path(program), &mark);
        }
        fs::create_dir_all(place.path("tools/mitsuba")).expect("writable");
        let plugin = format!("open({mark:?}, 'w')\n");
        for file in [
            "tools/mitsuba/plugin.py",
            "mitsuba.py",
            "json.py",
            "numpy.py",
        ] {
            fs::write(place.path(file), &plugin).expect("writable");
        }
        let run = |python: &[&str]| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_etendue"));
            let system = std::env::var("PATH").expect("there is a path");
            command
                .current_dir(place.0.path())
                .env_remove(etendue::crosscheck::VARIABLE)
                .env("HOME", place.path("home"))
                .env("XDG_CACHE_HOME", "cache")
                .env("PATH", format!(":.:{system}"))
                .args([
                    "crosscheck",
                    "dim.xml",
                    "--seeds",
                    "2",
                    "--spp",
                    "1",
                    "--size",
                    "8x8",
                ])
                .args(["--precision", "99"])
                .args(python);
            let output = command.output().expect("the program starts");
            let text =
                [output.stdout, output.stderr].map(|b| String::from_utf8_lossy(&b).into_owned());
            (output.status.code(), text.concat())
        };
        let (status, told) = run(&[]);
        assert_eq!(status, Some(2), "{told}");
        assert!(
            told.contains("there is no Python to run Mitsuba with"),
            "{told}"
        );
        assert!(!mark.exists());
        // One that is installed is found, and named.
        trap(
            &place.path("home/.cache/etendue/python/bin/python"),
            &place.path("ran"),
        );
        let (_, told) = run(&[]);
        assert!(place.path("ran").exists() && !mark.exists(), "{told}");
        if let Some(python) = mitsuba() {
            let (status, told) = run(&["--python", &python.display().to_string()]);
            assert_eq!(status, Some(0), "{told}");
            assert!(told.contains("(--python)"), "{told}");
            assert!(!mark.exists(), "{told}");
        }
    }

    #[test]
    fn the_environment_is_made_where_caches_are() {
        let place = Place::new();
        let script = r#"#!/bin/sh
echo "$@" >>"$HOME/log"
case "$*" in
*venv*) for last; do :; done; mkdir -p "$last/bin"; cp "$0" "$last/bin/python";;
esac
"#;
        place.python(script);
        let run = || {
            let mut command = Command::new(env!("CARGO_BIN_EXE_etendue"));
            command
                .current_dir(place.0.path())
                .env("HOME", place.0.path())
                .env_remove("XDG_CACHE_HOME")
                .args(["crosscheck", "--install", "--python", "./python"]);
            command.output().expect("the program starts")
        };
        let output = run();
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(0), "{told}");
        assert!(told.contains(".cache/etendue/python/bin/python"), "{told}");
        let log = fs::read_to_string(place.path("log")).expect("it was run");
        assert!(
            log.contains("-m venv") && log.contains("pip install"),
            "{log}"
        );
        assert!(log.contains("mitsuba=="), "{log}");
    }

    #[test]
    fn a_signal_ends_both_sides() {
        let place = Place::new();
        place.python(&format!(
            "echo $$ >pid; read order; {LOADED}; exec sleep 60"
        ));
        crate::support::let_children_hear_interrupts();
        let mut child = Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(place.0.path())
            .args([
                "crosscheck",
                "dim.xml",
                "--python",
                "./python",
                "--spp",
                "1",
            ])
            .stdout(std::process::Stdio::null())
            .spawn()
            .expect("the program starts");
        let begin = Instant::now();
        let pid = loop {
            let text = fs::read_to_string(place.path("pid")).unwrap_or_default();
            if text.ends_with('\n') {
                break text.trim().to_owned();
            }
            assert!(
                begin.elapsed() < Duration::from_secs(60),
                "the other side never started"
            );
            std::thread::sleep(Duration::from_millis(10));
        };
        let signal = |pid: &str, signal: &str| {
            let kill = Command::new("kill").args([signal, pid]).output();
            kill.expect("kill is there").status.success()
        };
        assert!(signal(&child.id().to_string(), "-INT"));
        assert_eq!(child.wait().expect("it ends").code(), Some(130));
        assert!(!signal(&pid, "-0"), "{pid} is still there");
    }
}

#[test]
fn mitsuba_agrees_and_what_it_lacks_is_named() {
    let Some(python) = mitsuba() else {
        return;
    };
    let place = Place::new();
    let python = format!("--python {}", python.display());
    let told = place.says(0, &format!("dim.xml {python} --spp 32 --size 24x16"));
    assert!(told.contains("dim.xml: agree"), "{told}");
    for (name, from, to) in [
        ("points", "independent", "blue-ish"),
        (
            "lacks",
            "<shape type=\"sphere\"/>",
            "<shape type=\"blob\"/><shape type=\"sphere\"><bsdf type=\"velvet\"/></shape>",
        ),
        ("wrong", "\"max_depth\"", "\"depth_max\""),
    ] {
        fs::write(
            place.path(&format!("{name}.xml")),
            lamp(5.0).replace(from, to),
        )
        .expect("writable");
    }
    let run = |reference: &str, status| {
        place.says(
            status,
            &format!(
                "dim.xml --reference {reference}.xml {python} --seeds 2 --spp 1 --precision 99"
            ),
        )
    };
    let told = run("points", 0);
    assert!(
        told.contains("Mitsuba has no sampler \"blue-ish\" and takes independent points"),
        "{told}"
    );
    let told = run("lacks", 2);
    assert!(
        told.contains("not comparable: Mitsuba has no shape \"blob\" and no bsdf \"velvet\""),
        "{told}"
    );
    let told = run("wrong", 2);
    assert!(
        told.contains("not comparable: Mitsuba refuses the scene") && told.contains("depth_max"),
        "{told}"
    );
}

/// Mitsuba 3.9.1 ends by signal 11 there if nothing is done about it.
#[test]
fn where_mitsuba_would_crash_both_sides_show_their_emitters() {
    let Some(python) = mitsuba() else {
        return;
    };
    let place = Place::new();
    let depth = r#"<integer name="max_depth" value="3"/>"#;
    let hidden = format!(r#"{depth}<boolean name="hide_emitters" value="true"/>"#);
    let group = r#"<shape type="shapegroup" id="g"><shape type="sphere"/></shape>
        <shape type="instance"><ref id="g"/></shape>"#;
    let scene = lamp(5.0)
        .replace(depth, &hidden)
        .replace(r#"<shape type="sphere"/>"#, group);
    fs::write(place.path("hidden.xml"), scene).expect("writable");
    let python = python.display();
    let told = place.says(
        0,
        &format!("hidden.xml --python {python} --spp 32 --size 24x16"),
    );
    assert!(told.contains("hidden.xml: agree"), "{told}");
    assert_eq!(told.matches("emitters are shown").count(), 1, "{told}");
}

#[test]
fn plugins_written_in_python_take_part_in_every_variant() {
    let Some(python) = mitsuba() else {
        return;
    };
    let place = Place::new();
    let added = r#"
import mitsuba as mi

class Torch(mi.SamplingIntegrator):
    def sample(self, scene, sampler, ray, medium=None, active=True):
        return mi.Color3f(1), True, []

mi.register_bsdf('torch', lambda props: mi.load_dict(dict(type='diffuse')))
mi.register_integrator('torch_integrator', Torch)
"#;
    fs::create_dir(place.path("plugins")).expect("writable");
    fs::write(place.path("plugins/torch.py"), added).expect("writable");
    for (name, from, to) in [
        (
            "bsdf",
            r#"<shape type="sphere"/>"#,
            r#"<shape type="sphere"><bsdf type="torch"/></shape>"#,
        ),
        (
            "integrator",
            r#"<integrator type="path"><integer name="max_depth" value="3"/></integrator>"#,
            r#"<integrator type="torch"/>"#,
        ),
    ] {
        let scene = lamp(5.0);
        assert!(scene.contains(from), "{scene}");
        let scene = scene.replace(from, to);
        fs::write(place.path(&format!("{name}.xml")), scene).expect("writable");
    }
    let run = |reference: &str, variant: &str, status| {
        let arguments = format!(
            "dim.xml --reference {reference}.xml --python {} --plugins plugins --variant {variant} \
             --seeds 2 --spp 1 --precision 99",
            python.display()
        );
        place.says(status, &arguments)
    };
    for variant in ["scalar_rgb", "scalar_spectral"] {
        let told = run("bsdf", variant, 0);
        assert!(told.contains(": agree"), "{variant}: {told}");
        let told = run("integrator", variant, 2);
        assert!(
            told.contains(
                "not comparable: Mitsuba cannot run Torch, an integrator written in Python"
            ),
            "{variant}: {told}"
        );
    }
}

#[test]
fn the_project_s_scenes_agree_with_mitsuba() {
    let Some(python) = mitsuba() else {
        return;
    };
    let place = Place::new();
    let scene = at("scenes/soft-shadow.xml");
    let arguments = format!(
        "{} --python {} --size 48x32 --spp 16",
        scene.display(),
        python.display()
    );
    let told = place.says(0, &arguments);
    assert!(told.contains(": agree"), "{told}");
}
