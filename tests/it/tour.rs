//! README's tour runs as it is written, from a fresh clone: every line, in its order, in a folder that holds nothing but
//! a copy of `scenes/`. Images are made small and meshes few, so that it takes seconds.

use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{at, mitsuba};

/// The lines of the tour.
fn lines(readme: &str) -> Vec<String> {
    let (_, tour) = readme
        .split_once("## A short tour")
        .expect("README has a tour");
    let (_, block) = tour
        .split_once("```sh\n")
        .expect("it has a block of commands");
    let (block, _) = block.split_once("```").expect("which ends");
    block.lines().map(str::to_owned).collect()
}

/// `option` and the word behind it, replaced.
fn replaced(line: &str, option: &str, by: &str) -> String {
    let mut words: Vec<&str> = line.split(' ').collect();
    if let Some(i) = words.iter().position(|word| *word == option) {
        words.splice(i..=i + 1, by.split(' '));
    }
    words.join(" ")
}

/// The line with less to do.
fn cheap(line: &str) -> String {
    let mut line = replaced(line, "--triangles", "--triangles 2k");
    line = replaced(&line, "--levels", "--levels 1");
    line = replaced(&line, "--turntable", "--turntable 2");
    line = replaced(&line, "--foveate", "--foveate 12,8");
    line = line.replace("--quick", "--quick --rounds 1 --sweep samples");
    let small = line.starts_with("for ") || line.contains("--crop");
    if line.contains("etendue render ") && !small {
        line = replaced(&line, "--size", "")
            .replace("etendue render ", "etendue render --size 24x16 ");
        if !line.contains("--noise-threshold") {
            line =
                replaced(&line, "--spp", "").replace("etendue render ", "etendue render --spp 2 ");
        }
    }
    line
}

#[test]
fn the_tour_runs_as_it_is_written() {
    let readme = fs::read_to_string(at("README.md")).expect("there is a README");
    let lines = lines(&readme);
    assert!(lines.len() > 20, "{lines:?}");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scenes = folder.path().join("scenes");
    fs::create_dir(&scenes).expect("writable");
    for entry in fs::read_dir(at("scenes")).expect("there are scenes") {
        let entry = entry.expect("readable");
        fs::copy(entry.path(), scenes.join(entry.file_name())).expect("writable");
    }
    let program = Path::new(env!("CARGO_BIN_EXE_etendue"));
    let mut path = OsString::from(program.parent().expect("in a folder"));
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    let python = mitsuba();
    for line in &lines {
        let is_crosscheck = line.contains("etendue crosscheck");
        // The installation is from the network.
        if line.contains("--install") || is_crosscheck && python.is_none() {
            continue;
        }
        let mut command = Command::new("sh");
        command
            .args(["-ec", &cheap(line)])
            .current_dir(folder.path())
            .env("PATH", &path);
        if let Some(python) = &python {
            command.env(etendue::crosscheck::VARIABLE, python);
        }
        let output = command.output().expect("there is a shell");
        let status = output.status.code();
        // Images so small and few may be too noisy to say, and those that differ make 1.
        let differs = line.contains("etendue compare") && status == Some(1);
        let fine = status == Some(0) || differs || is_crosscheck && status == Some(2);
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(fine, "{line}\n{}\n{told}", cheap(line));
    }
}
