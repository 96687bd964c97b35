//! Malformed input, run through the real program: each case ends soon, with its documented status, a message
//! that points and helps, and without a panic.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// A scene that is wrong. `<!--!-->` marks the line that the message must name.
struct Case<'a> {
    name: &'static str,
    /// Arguments after `render scene.xml -o image.exr`, separated by spaces.
    arguments: &'static str,
    /// What stands between `<scene version="3.0.0">`, the sensor and the end.
    body: &'a str,
    status: i32,
    /// What standard error must contain.
    says: &'static [&'static str],
}

/// A scene's error, for which the input is to blame.
const fn wrong<'a>(name: &'static str, body: &'a str, says: &'static [&'static str]) -> Case<'a> {
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
) -> Case<'static> {
    Case {
        name,
        arguments,
        body: "",
        status,
        says,
    }
}

const CASES: &[Case<'static>] = &[
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
        r#"<shape type="sphere"><bsdf type="measured_polarized"/><!--!--></shape>"#,
        &["bsdf \"measured_polarized\" exists in Mitsuba but not in"],
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
        r#"<shape type="cone"><float name="radius" value="-1"/><!--!--></shape>"#,
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
        &["width must be from 1 to 65536"],
    ),
    wrong(
        "a film too wide",
        r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="2000000000"/><!--!--></film></sensor>"#,
        &["width must be from 1 to 65536"],
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
    // ---- shapes of Étendue's own
    wrong(
        "a light without area",
        r#"<shape type="plane"><emitter type="area"/></shape><!--!-->"#,
        &[],
    ),
    wrong(
        "a cone without width",
        r#"<shape type="cone"><float name="radius" value="0"/><!--!--></shape>"#,
        &["radius must be above 0"],
    ),
    wrong(
        "a cone without height",
        r#"<shape type="cone"><point name="p1" value="0, 0, 0"/><!--!--></shape>"#,
        &["the ends of a cone cannot be the same"],
    ),
    wrong(
        "a triangle of two corners",
        r#"<shape type="triangle"><point name="p0" value="0, 0, 0"/><point name="p1" value="1, 0, 0"/></shape><!--!-->"#,
        &["needs \"p2\""],
    ),
    wrong(
        "a triangle on a line",
        r#"<shape type="triangle"><point name="p0" value="0, 0, 0"/><point name="p1" value="1, 0, 0"/><point name="p2" value="2, 0, 0"/></shape><!--!-->"#,
        &["cannot lie on a line"],
    ),
    wrong(
        "a triangle with one normal",
        r#"<shape type="triangle"><point name="p0" value="0, 0, 0"/><point name="p1" value="1, 0, 0"/><point name="p2" value="0, 1, 0"/><vector name="n1" value="0, 0, 1"/></shape><!--!-->"#,
        &["give n0, n1 and n2"],
    ),
    wrong(
        "a polygon of two corners",
        r#"<shape type="polygon"><point name="p0" value="0, 0, 0"/><point name="p1" value="1, 0, 0"/></shape><!--!-->"#,
        &["three corners at least"],
    ),
    wrong(
        "a polygon that lacks a corner",
        r#"<shape type="polygon"><point name="p0" value="0, 0, 0"/><point name="p1" value="1, 0, 0"/><point name="p9999999999" value="0, 1, 0"/></shape><!--!-->"#,
        &["has no corner p2"],
    ),
    wrong(
        "a polygon that crosses itself",
        r#"<shape type="polygon"><point name="p0" value="0, 0, 0"/><point name="p1" value="2, 1, 0"/><point name="p2" value="2, 0, 0"/><point name="p3" value="0, 2, 0"/></shape><!--!-->"#,
        &["crosses itself", "from p0 to p1"],
    ),
    wrong(
        "a polygon that is not flat",
        r#"<shape type="polygon"><point name="p0" value="0, 0, 0"/><point name="p1" value="1, 0, 0"/><point name="p2" value="1, 1, 1"/><point name="p3" value="0, 1, 0"/></shape><!--!-->"#,
        &["not flat"],
    ),
    wrong(
        "a polygon larger than numbers",
        r#"<shape type="polygon"><point name="p0" value="0, 0, 0"/><point name="p1" value="1e150, 0, 0"/><point name="p2" value="0, 1e150, 0"/></shape><!--!-->"#,
        &["none that is finite"],
    ),
    wrong(
        "a polygon with too few texture coordinates",
        r#"<shape type="polygon"><point name="p0" value="0, 0, 0"/><point name="p1" value="1, 0, 0"/><point name="p2" value="0, 1, 0"/><string name="uv" value="0 0 1 0 nan 1"/><!--!--></shape>"#,
        &["uv is 3 pairs of numbers here"],
    ),
    wrong(
        "a group in itself",
        r#"<shape type="group" id="a"><ref id="a"/></shape>"#,
        &["itself"],
    ),
    // ---- lenses, samplers, textures
    wrong(
        "a lens without a radius",
        r#"<sensor type="thinlens"/><!--!-->"#,
        &["needs \"aperture_radius\""],
    ),
    wrong(
        "a lens wider than numbers",
        r#"<sensor type="thinlens"><float name="aperture_radius" value="1e300"/><!--!--></sensor>"#,
        &["aperture_radius must be from 0 to 3.4028234663852886e38, and 1e300 is not"],
    ),
    wrong(
        "a lens in focus at nothing",
        r#"<sensor type="thinlens"><float name="aperture_radius" value="1"/><float name="focus_distance" value="1e-300"/><!--!--></sensor>"#,
        &["focus_distance is too small"],
    ),
    wrong(
        "a lens of two blades",
        r#"<sensor type="thinlens"><float name="aperture_radius" value="1"/><integer name="aperture_blades" value="2"/><!--!--></sensor>"#,
        &["2 blades make no polygon"],
    ),
    wrong(
        "discs without a number",
        r#"<sensor type="perspective"><sampler type="poisson"><integer name="sample_count" value="-4"/><!--!--></sampler></sensor>"#,
        &["sample_count"],
    ),
    wrong(
        "arrays of another strength",
        r#"<sensor type="perspective"><sampler type="orthogonal"><integer name="strength" value="3"/></sampler></sensor><!--!-->"#,
        &["strength 3", "they have strength 2"],
    ),
    wrong(
        "rings without number",
        r#"<shape type="sphere"><bsdf type="diffuse"><texture type="zoneplate" name="reflectance"><float name="rings" value="1e30"/><!--!--></texture></bsdf></shape>"#,
        &["rings must be from 0 to 1000000, and 1e30 is not"],
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
    usage(
        "noise of nothing",
        "--noise-threshold 0",
        2,
        &["0 is not positive"],
    ),
    usage(
        "noise that is no number",
        "--noise-threshold nan",
        2,
        &["nan is not positive"],
    ),
    usage(
        "two numbers of samples",
        "--noise-threshold 0.1 --spp 4",
        2,
        &["--spp"],
    ),
    usage(
        "the most samples of nothing",
        "--max-spp 4",
        2,
        &["--noise-threshold"],
    ),
    usage(
        "more samples at least than at most",
        "--noise-threshold 0.1 --min-spp 9 --max-spp 8",
        1,
        &["--min-spp 9 is more than --max-spp 8"],
    ),
    usage(
        "noise that points do not show",
        "--noise-threshold 0.1 --sampler grid",
        1,
        &["the same in every set"],
    ),
    usage("a gaze of one number", "--foveate 4", 2, &["X,Y in pixels"]),
    usage(
        "a gaze before the film",
        "--foveate=-1,4",
        2,
        &["X,Y in pixels"],
    ),
    usage(
        "a gaze beyond the film",
        "--foveate 4,9999",
        1,
        &["4,9999 is not on the film"],
    ),
    usage(
        "samples by a gaze and by the noise",
        "--foveate 1,1 --noise-threshold 0.1",
        2,
        &["--foveate", "--noise-threshold"],
    ),
    usage("1025 bands", "--bands 1025", 2, &["1025"]),
    usage("a definition without a value", "-D spp", 2, &["name=value"]),
    usage("threads below none", "--threads=-1", 2, &["--threads"]),
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
        &["command line", "width must be from 1 to 65536"],
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
        "-o image.webp",
        1,
        &[".exr, .hdr, .pfm, .tif, .png or .jpg"],
    ),
    usage(
        "no extension",
        "-o image",
        1,
        &[".exr, .hdr, .pfm, .tif, .png or .jpg"],
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

fn scene_of(case: &Case<'_>) -> String {
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
fn complaints(folder: &TempDir, case: &Case<'_>) -> Vec<String> {
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
        assert_eq!(said["size"], serde_json::json!({ "width": 4, "height": 4 }));
        assert!(folder.path().join(name).exists());
    }
}

/// Bodies with one thing each that only Étendue reads.
const OWN: &[&str] = &[
    r#"<sensor type="perspective"><sampler type="grid"/><!--!--></sensor>"#,
    r#"<sensor type="perspective"><sampler type="poisson"/><!--!--></sensor>"#,
    r#"<sensor type="perspective"><sampler type="sobol"/><!--!--></sensor>"#,
    r#"<sensor type="thinlens"><float name="aperture_radius" value="1"/><integer name="aperture_blades" value="5"/><!--!--></sensor>"#,
    r#"<sensor type="thinlens"><float name="aperture_radius" value="1"/><float name="aperture_rotation" value="5"/><!--!--></sensor>"#,
    r#"<integrator type="phong"/><!--!-->"#,
    r#"<integrator type="moment"><integrator type="phong" name="a"/></integrator><!--!-->"#,
    r#"<emitter type="ambient"/><!--!-->"#,
    r#"<shape type="sphere"><bsdf type="phong"/></shape><!--!-->"#,
    r#"<shape type="sphere"><bsdf type="diffuse"><texture type="zoneplate" name="reflectance"/></bsdf></shape><!--!-->"#,
    r#"<shape type="plane"/><!--!-->"#,
    r#"<shape type="cone"/><!--!-->"#,
    r#"<shape type="triangle"><point name="p0" value="0, 0, 0"/><point name="p1" value="1, 0, 0"/><point name="p2" value="0, 1, 0"/></shape><!--!-->"#,
    r#"<shape type="polygon"><point name="p0" value="0, 0, 0"/><point name="p1" value="1, 0, 0"/><point name="p2" value="0, 1, 0"/></shape><!--!-->"#,
    r#"<shape type="group"><shape type="sphere"/></shape><!--!-->"#,
    r#"<shape type="cylinder"><boolean name="caps" value="true"/></shape><!--!-->"#,
];

#[test]
fn what_only_etendue_reads_is_refused_strictly_and_nothing_else_is() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut failures = Vec::new();
    for body in OWN {
        let strictly = Case {
            arguments: "--strict --spp 1",
            says: &["is Étendue's own", "--strict"],
            ..wrong("", body, &[])
        };
        // The mark is for what is wrong.
        let body = &body.replace("<!--!-->", "");
        let freely = usage("", "--spp 1 -o free.png", 0, &[]);
        let freely = Case { body, ..freely };
        for case in [strictly, freely] {
            let complaints = complaints(&folder, &case);
            if !complaints.is_empty() {
                failures.push(format!("{body}: {}", complaints.join("; ")));
            }
        }
    }
    let theirs = Case {
        arguments: "--strict --spp 1 -o free.png",
        ..usage("", "", 0, &[])
    };
    let body = r#"<sensor type="thinlens"><float name="aperture_radius" value="1"/><sampler type="multijitter"/></sensor>
        <integrator type="direct"/><emitter type="constant"/><shape type="cylinder"><bsdf type="diffuse">
        <texture type="uniform" name="reflectance"/></bsdf></shape>"#;
    failures.extend(complaints(&folder, &Case { body, ..theirs }));
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Command lines that are wrong, beside `a.exr` (4 × 4), `dot.exr` (1 × 1) and `empty.exr` (0 bytes).
const COMMANDS: &[(&str, i32, &str)] = &[
    ("compare dot.exr dot.exr", 0, "equal"),
    ("compare a.exr", 2, "nothing to hold it against"),
    ("compare a.exr nowhere.exr", 2, "nowhere.exr"),
    ("compare a.exr empty.exr", 2, "empty"),
    ("compare a.exr scene.xml", 2, "scene.xml"),
    ("compare a.exr dot.exr", 2, "the sizes differ"),
    (
        "compare a.exr a.exr --crop 0,0,0,0",
        2,
        "is empty or reaches beyond",
    ),
    (
        "compare a.exr a.exr --crop 4294967295,0,4294967295,1",
        2,
        "reaches beyond",
    ),
    ("compare a.exr a.exr --layer velvet", 2, "velvet"),
    ("compare a.exr a.exr --peak nan", 2, "not positive"),
    ("compare a.exr a.exr --ppd 1e300", 2, "out of all bounds"),
    (
        "compare a.exr a.exr --fail-above psnr=3",
        2,
        "more psnr is better",
    ),
    (
        "compare a.exr a.exr --fail-above rmsq=3",
        2,
        "there is no metric",
    ),
    ("compare a.exr a.exr --fail-above rmse=nan", 2, "NaN"),
    ("compare --a a.exr --b a.exr", 2, "two"),
    (
        "compare a.exr --reference a.exr --variance a.exr --spp 0",
        2,
        "--spp",
    ),
    ("relight a.exr", 1, "has no layers"),
    (
        "relight a.exr -o b.exr -w diffuse=nan",
        2,
        "finite and not negative",
    ),
    ("relight a.exr -o b.exr -w diffuse=1", 1, "has no layers"),
    ("relight a.exr -w diffuse=1", 2, "--output"),
    ("relight empty.exr", 1, "empty"),
    ("crosscheck scene.xml --seeds 1", 2, "--seeds"),
    ("crosscheck scene.xml --seed 2147483648", 2, "--seed"),
    ("crosscheck scene.xml --precision 0", 2, "0 is not positive"),
    ("crosscheck scene.xml --timeout inf", 2, "not between"),
    (
        "crosscheck nan.ply --against raster",
        2,
        "no triangle is left",
    ),
    // A number below 0 is a value, and told its range.
    ("render a.ply -o b.png --distance -1", 2, "0.01 to 1000"),
    ("render a.ply -o b.png --spp -1", 2, "'-1' for '--spp <N>'"),
    (
        "render a.ply -o b.png --noise-threshold -1",
        2,
        "not positive",
    ),
    (
        "render a.ply -o b.png --snapshot 0",
        2,
        "0.01 seconds or more",
    ),
    ("render a.ply -o b.png --tev localhost", 2, "HOST:PORT"),
    ("render a.ply -o b.png --tev :70000", 2, "HOST:PORT"),
    ("render a.ply -o b.png --material wood", 2, "clay, metal,"),
    (
        "render a.ply -o b.png --material nan.ply",
        2,
        "a scene (.xml) or an image",
    ),
    ("render a.ply -o b.png --light moon", 2, "studio, sun, sky"),
    (
        "render scene.xml -o b.png --material metal",
        0,
        "--material is for bare meshes",
    ),
    (
        "render scene.xml -o b.png --fps 30",
        0,
        "--fps says nothing without --frames or --shutter",
    ),
    (
        "render nan.ply -o b.png",
        1,
        "of each of its 1 a corner is not finite",
    ),
    (
        "render points.obj -o b.png",
        1,
        "points and lines alone are not drawn",
    ),
    (
        "batch twice.toml",
        1,
        "scene.xml --spp=1 and scene.xml --spp=2 would both be written to b.png",
    ),
    ("batch scene.xml", 1, "this is XML, and a manifest is TOML"),
    (
        "color difference 255,0,0 250,0,0",
        0,
        "--space says what the numbers are",
    ),
    ("batch none.toml", 1, "list of scenes is empty"),
    ("batch typo.toml", 1, "'--size'"),
    ("batch word.toml", 1, "whole number in digits"),
];

#[test]
fn every_wrong_command_line_is_named_and_survived() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = scene_of(&usage("", "", 0, &[]));
    fs::write(folder.path().join("scene.xml"), scene).expect("the folder is there");
    fs::write(folder.path().join("empty.exr"), "").expect("the folder is there");
    const NAN: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\nnan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for (name, text) in [
        ("nan.ply", NAN),
        ("points.obj", "v 0 0 0\nv 1 0 0\n"),
        (
            "twice.toml",
            "[[images]]\nscenes = 'scene.xml'\noutput = 'b.png'\nspp = [1, 2]",
        ),
        ("none.toml", "[[images]]\nscenes = []\noutput = 'b.png'"),
        (
            "typo.toml",
            "[[images]]\nscenes = 'scene.xml'\noutput = 'b.png'\nsise = '4x4'",
        ),
        (
            "word.toml",
            "[[images]]\nscenes = 'scene.xml'\noutput = 'b.png'\nspp = 'four'",
        ),
    ] {
        fs::write(folder.path().join(name), text).expect("the folder is there");
    }
    for (name, size) in [("a.exr", "4x4"), ("dot.exr", "1x1")] {
        let arguments = [
            "render",
            "scene.xml",
            "--spp",
            "1",
            "--size",
            size,
            "-o",
            name,
        ];
        let output = run(folder.path(), &arguments).expect("it ends");
        assert_eq!(output.status.code(), Some(0), "{output:?}");
    }
    let mut failures = Vec::new();
    for (line, status, says) in COMMANDS {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let Some(output) = run(folder.path(), &arguments) else {
            failures.push(format!("{line}: does not end"));
            continue;
        };
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        if output.status.code() != Some(*status)
            || !said.contains(says)
            || said.contains("panicked")
        {
            failures.push(format!(
                "{line}: {:?}, it said:\n{said}",
                output.status.code()
            ));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
