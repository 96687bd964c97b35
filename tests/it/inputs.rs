//! Malformed input, run through the real program: each case ends soon, with its documented status, a message
//! that points and helps, and without a panic.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// A scene that is wrong. `<!--!-->` marks the line that the message must name.
struct Case {
    name: &'static str,
    /// Arguments after `render scene.xml -o image.exr`, separated by spaces.
    arguments: &'static str,
    /// What stands between `<scene version="3.0.0">`, the sensor and the end.
    body: &'static str,
    status: i32,
    /// What standard error must contain.
    says: &'static [&'static str],
}

/// A scene's error, for which the input is to blame.
const fn wrong(name: &'static str, body: &'static str, says: &'static [&'static str]) -> Case {
    Case {
        name,
        arguments: "",
        body,
        status: 1,
        says,
    }
}

/// The command line's error, with a scene that is right.
const fn usage(
    name: &'static str,
    arguments: &'static str,
    status: i32,
    says: &'static [&'static str],
) -> Case {
    Case {
        name,
        arguments,
        body: "",
        status,
        says,
    }
}

const CASES: &[Case] = &[
    wrong(
        "a second integrator",
        r#"<integrator type="path"/>
        <!--!--><integrator type="direct"/>"#,
        &["scene \"scene\" has a second integrator", "the first is at"],
    ),
    wrong(
        "a material and a shape at once",
        r#"<shape type="teapot"/>
        <!--!--><shape type="sphere"><bsdf type="difuse"/></shape>"#,
        &["unknown shape \"teapot\"", "did you mean \"diffuse\"?"],
    ),
    // ---- plugins
    wrong(
        "misspelt bsdf",
        r#"<shape type="sphere"><bsdf type="difuse"/><!--!--></shape>"#,
        &["unknown bsdf \"difuse\"", "did you mean \"diffuse\"?"],
    ),
    wrong(
        "misspelt shape",
        r#"<shape type="rectangel"/><!--!-->"#,
        &["unknown shape \"rectangel\"", "did you mean \"rectangle\"?"],
    ),
    wrong(
        "nothing like it",
        r#"<shape type="teapot"/><!--!-->"#,
        &["unknown shape \"teapot\"", "there are", "sphere"],
    ),
    wrong(
        "an integrator of Mitsuba's",
        r#"<integrator type="prbvolpath"/><!--!-->"#,
        &["integrator \"prbvolpath\" exists in Mitsuba but not in"],
    ),
    wrong(
        "a bsdf of Mitsuba's",
        r#"<shape type="sphere"><bsdf type="hair"/><!--!--></shape>"#,
        &["bsdf \"hair\" exists in Mitsuba but not in"],
    ),
    wrong(
        "unknown film",
        r#"<sensor type="perspective"><film type="polaroid"/><!--!--></sensor>"#,
        &["unknown film \"polaroid\""],
    ),
    wrong(
        "unknown sampler",
        r#"<sensor type="perspective"><sampler type="stratifeid"/><!--!--></sensor>"#,
        &["did you mean \"stratified\"?"],
    ),
    wrong(
        "an emitter that cannot stand on a shape",
        r#"<shape type="sphere"><emitter type="constant"/><!--!--></shape>"#,
        &["\"constant\" cannot stand on a shape"],
    ),
    wrong(
        "an area emitter that stands on none",
        r#"<emitter type="area"/><!--!-->"#,
        &["area", "shape"],
    ),
    wrong(
        "two environments",
        "<emitter type=\"constant\"/>\n<emitter type=\"constant\"/><!--!-->",
        &["environment", "the first"],
    ),
    wrong(
        "two materials on a shape",
        "<shape type=\"sphere\"><bsdf type=\"diffuse\"/>\n<bsdf type=\"diffuse\"/><!--!--></shape>",
        &["second bsdf"],
    ),
    wrong(
        "twosided without a side",
        r#"<shape type="sphere"><bsdf type="twosided"/><!--!--></shape>"#,
        &["twosided needs 1 or 2 nested bsdf"],
    ),
    // ---- properties
    wrong(
        "a property that nobody reads",
        r#"<shape type="sphere"><float name="radios" value="1"/><!--!--></shape>"#,
        &["no property \"radios\"", "did you mean \"radius\"?"],
    ),
    wrong(
        "a nested plugin of no use",
        r#"<shape type="sphere"><sampler type="independent"/><!--!--></shape>"#,
        &["no use for the sampler"],
    ),
    wrong(
        "a string for a number",
        r#"<shape type="sphere"><string name="radius" value="1"/><!--!--></shape>"#,
        &["radius"],
    ),
    wrong(
        "no number at all",
        r#"<shape type="sphere"><float name="radius" value="wide"/><!--!--></shape>"#,
        &["wide"],
    ),
    wrong(
        "not a number",
        r#"<shape type="sphere"><float name="radius" value="nan"/><!--!--></shape>"#,
        &["nan"],
    ),
    wrong(
        "an infinite number",
        r#"<shape type="sphere"><float name="radius" value="1e999"/><!--!--></shape>"#,
        &["1e999"],
    ),
    wrong(
        "a fraction for an integer",
        r#"<integrator type="path"><integer name="max_depth" value="2.5"/><!--!--></integrator>"#,
        &["2.5"],
    ),
    wrong(
        "an integer beyond bounds",
        r#"<integrator type="path"><integer name="max_depth" value="99999999999999999999"/><!--!--></integrator>"#,
        &["99999999999999999999"],
    ),
    wrong(
        "a depth below -1",
        r#"<integrator type="path"><integer name="max_depth" value="-2"/><!--!--></integrator>"#,
        &["max_depth must be at least -1"],
    ),
    wrong(
        "a falloff that is none",
        r#"<integrator type="phong"><string name="falloff" value="inverse_sqare"/><!--!--></integrator>"#,
        &["did you mean \"inverse_square\"?"],
    ),
    wrong(
        "layers by something else",
        r#"<integrator type="phong"><string name="layers" value="terms, light"/><!--!--></integrator>"#,
        &["no layers by \"light\"", "did you mean \"lights\"?"],
    ),
    wrong(
        "a highlight with a negative exponent",
        r#"<shape type="sphere"><bsdf type="phong"><float name="exponent" value="-3"/><!--!--></bsdf></shape>"#,
        &["an exponent must be at least 0, and -3 is not"],
    ),
    wrong(
        "a boolean that is neither",
        r#"<shape type="sphere"><boolean name="flip_normals" value="maybe"/><!--!--></shape>"#,
        &["maybe"],
    ),
    wrong(
        "a point of two",
        r#"<shape type="sphere"><point name="center" value="1, 2"/><!--!--></shape>"#,
        &["1, 2"],
    ),
    wrong(
        "a colour of two",
        r#"<shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="1, 2"/><!--!--></bsdf></shape>"#,
        &["1, 2"],
    ),
    wrong(
        "a negative radius",
        r#"<shape type="sphere"><float name="radius" value="-1"/><!--!--></shape>"#,
        &["radius", "-1"],
    ),
    wrong(
        "reflectance above one",
        r#"<shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="0.5, 1.5, 0.5"/><!--!--></bsdf></shape>"#,
        &["reflectance", "1.5"],
    ),
    wrong(
        "a shape flattened to nothing",
        r#"<shape type="sphere"><transform name="to_world"><scale x="0"/><!--!--></transform></shape>"#,
        &[],
    ),
    wrong(
        "a matrix of ten",
        r#"<shape type="cube"><transform name="to_world"><matrix value="1 2 3 4 5 6 7 8 9 10"/><!--!--></transform></shape>"#,
        &["10"],
    ),
    wrong(
        "a look at oneself",
        r#"<sensor type="perspective"><transform name="to_world"><lookat origin="1,1,1" target="1,1,1" up="0,1,0"/><!--!--></transform></sensor>"#,
        &[],
    ),
    wrong(
        "a field of view of 180°",
        r#"<sensor type="perspective"><float name="fov" value="180"/><!--!--></sensor>"#,
        &["field of view"],
    ),
    wrong(
        "a near clip behind the far clip",
        r#"<sensor type="perspective"><float name="near_clip" value="1e5"/></sensor><!--!-->"#,
        &["far_clip"],
    ),
    // ---- film and sampler
    wrong(
        "a film without width",
        r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="0"/><!--!--></film></sensor>"#,
        &["0 pixels"],
    ),
    wrong(
        "a film too wide",
        r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="2000000000"/><!--!--></film></sensor>"#,
        &["2000000000 pixels"],
    ),
    wrong(
        "a film too large to hold",
        "<sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"65536\"/><!--!-->\n<integer name=\"height\" value=\"65536\"/></film></sensor>",
        &["too many"],
    ),
    wrong(
        "a crop that leaves the film",
        r#"<sensor type="perspective"><film type="hdrfilm"><integer name="crop_width" value="800"/><!--!--></film></sensor>"#,
        &["leaves the film"],
    ),
    wrong(
        "no samples",
        r#"<sensor type="perspective"><sampler type="independent"><integer name="sample_count" value="0"/><!--!--></sampler></sensor>"#,
        &["sample_count"],
    ),
    wrong(
        "samples beyond counting",
        r#"<sensor type="perspective"><sampler type="independent"><integer name="sample_count" value="9000000000000"/><!--!--></sampler></sensor>"#,
        &["sample_count"],
    ),
    // ---- files
    wrong(
        "a mesh that is not there",
        r#"<shape type="ply"><string name="filename" value="nowhere.ply"/><!--!--></shape>"#,
        &["nowhere.ply"],
    ),
    wrong(
        "a mesh without a name",
        r#"<shape type="obj"/><!--!-->"#,
        &["filename"],
    ),
    wrong(
        "a picture that is not there",
        r#"<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="nowhere.png"/><!--!--></texture></bsdf></shape>"#,
        &["nowhere.png"],
    ),
    wrong(
        "a mesh that is a scene",
        r#"<shape type="ply"><string name="filename" value="scene.xml"/></shape>"#,
        &["unknown mesh format \"xml\"", "known are ply, obj"],
    ),
    wrong(
        "a folder for a picture",
        r#"<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="/"/></texture></bsdf></shape>"#,
        &["/"],
    ),
    wrong(
        "an include that is not there",
        r#"<include filename="nowhere.xml"/><!--!-->"#,
        &["nowhere.xml"],
    ),
    wrong(
        "an include of itself",
        r#"<include filename="scene.xml"/><!--!-->"#,
        &["include"],
    ),
    // ---- structure
    wrong(
        "a reference to nothing",
        r#"<shape type="sphere"><ref id="gone"/><!--!--></shape>"#,
        &["gone"],
    ),
    wrong(
        "a reference to itself",
        r#"<bsdf type="twosided" id="a"><ref id="a"/><!--!--></bsdf><shape type="sphere"><ref id="a"/></shape>"#,
        &["a"],
    ),
    wrong(
        "references in a circle",
        r#"<bsdf type="twosided" id="a"><ref id="b"/></bsdf><bsdf type="twosided" id="b"><ref id="a"/></bsdf><shape type="sphere"><ref id="a"/></shape>"#,
        &["itself"],
    ),
    wrong(
        "one id twice",
        "<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"diffuse\" id=\"a\"/><!--!-->",
        &["\"a\""],
    ),
    wrong(
        "a parameter without a value",
        r#"<shape type="sphere"><float name="radius" value="$r"/><!--!--></shape>"#,
        &["$r"],
    ),
    wrong(
        "a tag that is none",
        r#"<shpe type="sphere"/><!--!-->"#,
        &["shpe"],
    ),
    wrong(
        "a tag that is not closed",
        r#"<shape type="sphere">"#,
        &["scene.xml:"],
    ),
    wrong("a plugin without a type", r#"<shape/><!--!-->"#, &["type"]),
    wrong("an entity of one's own", r#"&bomb;<!--!-->"#, &["bomb"]),
    // ---- the command line
    usage("no such option", "--sppp 3", 2, &["--sppp", "--spp"]),
    usage("no samples at all", "--spp 0", 2, &["--spp"]),
    usage("a size of one", "--size 64", 2, &["640x480"]),
    usage("a crop of three", "--crop 1,2,3", 2, &["X,Y,WIDTH,HEIGHT"]),
    usage("33 bands", "--bands 33", 2, &["33"]),
    usage("a definition without a value", "-D spp", 2, &["name=value"]),
    usage("threads without number", "--threads 0", 2, &["--threads"]),
    usage(
        "a parameter that the scene lacks",
        "-D nope=1",
        1,
        &["nope"],
    ),
    usage(
        "a size of nothing",
        "--size 0x0",
        1,
        &["command line", "0 pixels"],
    ),
    usage(
        "a size beyond memory",
        "--size 60000x60000",
        1,
        &["too many"],
    ),
    usage(
        "a crop beside the film",
        "--crop 9999,0,4,4",
        1,
        &["leaves the film"],
    ),
    usage(
        "an integrator that is none",
        "--integrator paht",
        1,
        &["did you mean \"path\"?"],
    ),
    usage(
        "an unknown extension",
        "-o image.tiff",
        1,
        &[".exr, .hdr or .png"],
    ),
    usage("no extension", "-o image", 1, &[".exr, .hdr or .png"]),
    usage(
        "a folder that is not there",
        "-o nowhere/image.png",
        1,
        &["nowhere"],
    ),
    usage(
        "an input that is not there",
        "nowhere.xml -o {name}.png",
        3,
        &["nowhere.xml"],
    ),
    usage(
        "an input that is neither",
        "Cargo.toml -o {name}.png",
        1,
        &["neither a scene nor a mesh"],
    ),
    usage("two inputs, one output", "other.xml", 1, &["{name}"]),
];

/// A sensor for the bodies that have none.
const SENSOR: &str = r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>"#;

fn scene_of(case: &Case) -> String {
    let sensor = if case.body.contains("<sensor") {
        ""
    } else {
        SENSOR
    };
    format!(
        "<scene version=\"3.0.0\">\n{sensor}\n{}\n</scene>\n",
        case.body
    )
}

/// Runs the program in `folder`; `None` where it does not end in time.
fn run(folder: &Path, arguments: &[&str]) -> Option<Output> {
    let mut child = Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(folder)
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let start = Instant::now();
    while child
        .try_wait()
        .expect("the program can be watched")
        .is_none()
    {
        if start.elapsed() > Duration::from_secs(10) {
            child.kill().expect("the program can be ended");
            child.wait().expect("the program ends");
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    Some(child.wait_with_output().expect("the program ended"))
}

/// What is wrong with how the program takes a case.
fn complaints(folder: &TempDir, case: &Case) -> Vec<String> {
    let text = scene_of(case);
    fs::write(folder.path().join("scene.xml"), &text).expect("the folder is there");
    let mut arguments = vec!["render", "scene.xml", "--quiet"];
    if !case.arguments.contains("-o ") {
        arguments.extend(["-o", "image.exr"]);
    }
    arguments.extend(case.arguments.split_whitespace());
    let Some(output) = run(folder.path(), &arguments) else {
        return vec!["does not end".to_owned()];
    };
    let said = String::from_utf8_lossy(&output.stderr);
    let mut complaints = Vec::new();
    if output.status.code() != Some(case.status) {
        complaints.push(format!("{:?}, not {}", output.status.code(), case.status));
    }
    let mut wanted: Vec<String> = case.says.iter().map(|s| (*s).to_owned()).collect();
    if let Some(line) = text.lines().position(|l| l.contains("<!--!-->")) {
        wanted.push(format!("scene.xml:{}:", line + 1));
    }
    complaints.extend(
        wanted
            .iter()
            .filter(|w| !said.contains(*w))
            .map(|w| format!("does not say {w:?}")),
    );
    if said.contains("panicked") || said.contains("RUST_BACKTRACE") {
        complaints.push("panics".to_owned());
    }
    if folder.path().join("image.exr").exists() {
        complaints.push("writes an image".to_owned());
    }
    if !complaints.is_empty() {
        complaints.push(format!("it said:\n{said}"));
    }
    complaints
}

#[test]
fn every_wrong_input_is_named_pointed_at_and_survived() {
    let mut failures = Vec::new();
    for case in CASES {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in [
            ("Cargo.toml", ""),
            ("other.xml", "<scene version=\"3.0.0\"/>"),
        ] {
            fs::write(folder.path().join(name), text).expect("the folder is there");
        }
        let complaints = complaints(&folder, case);
        if !complaints.is_empty() {
            failures.push(format!("{}: {}", case.name, complaints.join("; ")));
        }
    }
    assert!(
        failures.is_empty(),
        "{} of {} cases:\n\n{}",
        failures.len(),
        CASES.len(),
        failures.join("\n\n")
    );
}

#[test]
fn all_that_is_wrong_with_a_scene_is_said_at_once() {
    let case = wrong(
        "many",
        "<shape type=\"sphere\"><bsdf type=\"difuse\"/></shape>\n<emitter type=\"pont\"/>\n<integrator type=\"paht\"/>",
        &[],
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("scene.xml"), scene_of(&case)).expect("the folder is there");
    let output = run(folder.path(), &["render", "scene.xml", "-o", "image.exr"]).expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr);
    for name in ["difuse", "pont", "paht"] {
        assert!(said.contains(name), "{name} is missing in:\n{said}");
    }
}

#[test]
fn what_is_right_is_rendered_with_status_zero() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let case = usage("right", "", 0, &[]);
    fs::write(folder.path().join("scene.xml"), scene_of(&case)).expect("the folder is there");
    for name in ["a.exr", "a.hdr", "a.png"] {
        let output = run(
            folder.path(),
            &["render", "scene.xml", "--json", "-o", name],
        )
        .expect("it ends");
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let said: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(said["output"], name);
        assert_eq!(said["size"], serde_json::json!([4, 4]));
        assert!(folder.path().join(name).exists());
    }
}
