//! Do `etendue color` and `etendue spectrum` say what standards and images hold?

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use super::support::at;

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the program runs")
}

/// The numbers on standard output, of a command that succeeds.
fn numbers(folder: &Path, arguments: &[&str]) -> Vec<f64> {
    let output = run(folder, arguments);
    let (out, err) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(output.status.success(), "{arguments:?}: {out}{err}");
    out.split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect()
}

/// Of the ColorChecker (X-Rite 2005, under D50, where only the arithmetic of L\*a\*b\* is asked for) and of standards.
#[test]
fn colours_are_converted_to_published_values() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, color, expected) in [
        ("srgb", "xyz", "1,1,1", [0.9505, 1.0, 1.0891]),
        ("srgb", "lab", "1,0,0", [53.2408, 80.0925, 67.2032]),
        ("srgb", "lab", "0,0,1", [32.2970, 79.1875, -107.8602]),
        ("srgb", "luv", "0,1,0", [87.7347, -83.0776, 107.3985]),
        ("bt709", "bt2020", "1,0,0", [0.6274, 0.0691, 0.0164]),
        ("bt709", "bt2020", "0,1,0", [0.3293, 0.9195, 0.0880]),
        ("bt709", "p3-d65", "1,0,0", [0.8225, 0.0332, 0.0171]),
        ("xyy", "xyz", "0.3127,0.329,1", [0.9505, 1.0, 1.0891]),
        ("srgb", "hsv", "1,0.5,0", [30.0, 1.0, 1.0]),
        ("lab", "srgb", "53.2408,80.0925,67.2032", [1.0, 0.0, 0.0]),
    ] {
        let found = numbers(folder.path(), &["color", "convert", from, to, color]);
        for (a, b) in found.iter().zip(expected) {
            let tolerance = if from == "srgb" && f64::abs(b) > 10.0 {
                0.05
            } else {
                5e-4
            };
            assert!(
                (a - b).abs() < tolerance,
                "{from} {color} to {to}: {found:?}"
            );
        }
        assert_eq!(found.len(), 3);
    }
}

#[test]
fn a_pixel_s_spectrum_is_printed_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let scene = r#"<scene version="3.0.0"><integrator type="path"/><sensor type="perspective">
        <film type="hdrfilm"><integer name="width" value="3"/><integer name="height" value="2"/></film></sensor>
        <emitter type="constant"><spectrum name="radiance" value="300:0, 900:6"/></emitter></scene>"#;
    fs::write(folder.path().join("s.xml"), scene).unwrap();
    let range = ["--bands", "4", "--band-range", "400,800"];
    run(
        folder.path(),
        &[
            &["render", "s.xml", "-o", "s.exr", "--spp", "256"],
            &range[..],
        ]
        .concat(),
    );
    let found = numbers(
        folder.path(),
        &["spectrum", "s.exr", "1", "1", "-o", "s.svg"],
    );
    let expected = [450.0, 1.5, 550.0, 2.5, 650.0, 3.5, 750.0, 4.5];
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() < 0.1, "{found:?}");
    }
    let svg = fs::read_to_string(folder.path().join("s.svg")).unwrap();
    assert!(svg.contains("<polyline"));
    for (arguments, words) in [
        (["spectrum", "s.exr", "3", "0"], "outside of 3 × 2"),
        (["spectrum", "s.xml", "0", "0"], "no image"),
    ] {
        let output = run(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains(words), "{said}");
    }
}

#[test]
fn metamers_displays_and_diagrams_are_told_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let scene = fs::read_to_string(at("scenes/metamers.xml")).unwrap();
    // The two paints of the scene, and what they are lit by.
    let paints = scene.split("name=\"reflectance\" value=\"").skip(2);
    for (name, paint) in ["one.spd", "other.spd"].into_iter().zip(paints) {
        let list = paint.split('"').next().unwrap();
        let lines: Vec<String> = list
            .split(',')
            .map(|pair| pair.trim().replace(':', " "))
            .collect();
        fs::write(folder.path().join(name), lines.join("\n")).unwrap();
    }
    let lamp = "470 0\n480 3\n490 0\n570 0\n580 1\n590 0\n";
    fs::write(folder.path().join("lamp.spd"), lamp).unwrap();
    let daylight = run(
        folder.path(),
        &["color", "metamers", "one.spd", "other.spd"],
    );
    assert_eq!(daylight.status.code(), Some(0), "{daylight:?}");
    let lines = run(
        folder.path(),
        &[
            "color",
            "metamers",
            "one.spd",
            "other.spd",
            "--light",
            "lamp.spd",
        ],
    );
    assert_eq!(lines.status.code(), Some(1), "{lines:?}");

    for (name, nm) in [("r.spd", 620.0), ("g.spd", 530.0), ("b.spd", 455.0)] {
        let at = |l: u32| (-((f64::from(l) - nm) / 20.0_f64).powi(2)).exp();
        let text: String = (380..=780).map(|l| format!("{l} {:e}\n", at(l))).collect();
        fs::write(folder.path().join(name), text).unwrap();
    }
    let matrix = numbers(
        folder.path(),
        &["color", "display", "r.spd", "g.spd", "b.spd"],
    );
    assert_eq!(matrix.len(), 9);
    let same = run(
        folder.path(),
        &["color", "display", "r.spd", "r.spd", "b.spd"],
    );
    assert!(String::from_utf8_lossy(&same.stderr).contains("three different primaries"));

    let drawn = run(
        folder.path(),
        &[
            "color", "diagram", "-o", "d.svg", "--gamut", "bt2020", "--gamut", "bt709",
        ],
    );
    assert!(drawn.status.success(), "{drawn:?}");
    assert!(drawn.stdout.starts_with(b"d.svg: "), "{drawn:?}");
    assert!(
        fs::read_to_string(folder.path().join("d.svg"))
            .unwrap()
            .contains("bt2020")
    );
    let far = numbers(
        folder.path(),
        &["color", "difference", "50,2.5,0", "73,25,-18"],
    );
    assert!(far.contains(&27.1492), "{far:?}");
}
