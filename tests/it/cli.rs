//! The command line as its users meet it: what it prints, what it leaves and how it ends. The texts of
//! `--help` stand in `tests/golden/help`; `ETENDUE_BLESS=1` writes them anew.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

use crate::support::at;

const SCENE: &str = r#"<scene version="3.0.0">
    <default name="x" value="0"/>
    <default name="frame" value="0"/>
    <sensor type="perspective" id="front">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
        <sampler type="independent"><integer name="sample_count" value="2"/></sampler>
    </sensor>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="6, 1, 0" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
        <sampler type="independent"><integer name="sample_count" value="2"/></sampler>
    </sensor>
    <emitter type="constant"/>
    <shape type="cube"><transform name="to_world"><translate x="$x" y="$frame"/></transform></shape>
</scene>"#;

const MESH: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// A folder with a scene, a mesh and a broken scene in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let broken = SCENE
            .replace("\"cube\"", "\"cueb\"")
            .replace("constant", "konstant");
        for (name, text) in [
            ("scene.xml", SCENE),
            ("broken.xml", &broken),
            ("mesh.ply", MESH),
        ] {
            fs::write(folder.path().join(name), text).unwrap();
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs `etendue` with the words of `arguments`.
    fn run(&self, arguments: &str) -> Run {
        let output = Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(self.0.path())
            .args(arguments.split(' '))
            .output()
            .unwrap();
        Run(output)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }
}

struct Run(Output);

impl Run {
    fn status(&self) -> i32 {
        self.0.status.code().unwrap()
    }

    fn stdout(&self) -> String {
        String::from_utf8(self.0.stdout.clone()).unwrap()
    }

    fn stderr(&self) -> String {
        String::from_utf8(self.0.stderr.clone()).unwrap()
    }

    /// The objects on standard output, one a line.
    #[track_caller]
    fn objects(&self) -> Vec<Value> {
        let lines = self.stdout();
        lines
            .lines()
            .map(|l| serde_json::from_str(l).unwrap())
            .collect()
    }

    #[track_caller]
    fn ends_with(&self, status: i32) -> &Self {
        assert_eq!(self.status(), status, "{}", self.stderr());
        self
    }
}

#[test]
fn help_reads_as_it_was_blessed() {
    for (name, arguments) in [
        ("etendue", &["--help"][..]),
        ("render", &["render", "--help"]),
        ("batch", &["batch", "--help"]),
        ("check", &["check", "--help"]),
        ("compare", &["compare", "--help"]),
        ("info", &["info", "--help"]),
        ("convert", &["convert", "--help"]),
        ("merge", &["merge", "--help"]),
        ("relight", &["relight", "--help"]),
        ("color", &["color", "--help"]),
        ("spectrum", &["spectrum", "--help"]),
        ("crosscheck", &["crosscheck", "--help"]),
        ("mesh", &["mesh", "--help"]),
        ("mesh-convert", &["mesh", "convert", "--help"]),
        ("mesh-generate", &["mesh", "generate", "--help"]),
        (
            "mesh-generate-flake",
            &["mesh", "generate", "flake", "--help"],
        ),
        (
            "mesh-generate-shape",
            &["mesh", "generate", "shape", "--help"],
        ),
        (
            "mesh-generate-terrain",
            &["mesh", "generate", "terrain", "--help"],
        ),
        ("mesh-report", &["mesh", "report", "--help"]),
        ("plugins", &["plugins", "--help"]),
        ("profile", &["profile", "--help"]),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_etendue"))
            .args(arguments)
            .env("COLUMNS", "100")
            .output()
            .unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let golden = at(&format!("tests/golden/help/{name}.txt"));
        if std::env::var_os("ETENDUE_BLESS").is_some() {
            fs::create_dir_all(golden.parent().unwrap()).unwrap();
            fs::write(&golden, &text).unwrap();
        }
        let expected = fs::read_to_string(&golden).unwrap_or_default();
        assert_eq!(text, expected, "{name}: ETENDUE_BLESS=1 blesses it");
        let kind = name.starts_with("mesh-generate-");
        assert!(kind || text.contains("Exit status: 0 "), "{name}");
    }
}

#[test]
fn the_page_of_plugins_is_what_the_program_prints() {
    let place = Place::new();
    let text = place.run("plugins --markdown").ends_with(0).stdout();
    let page = at("docs/plugins.md");
    if std::env::var_os("ETENDUE_BLESS").is_some() {
        fs::write(&page, &text).unwrap();
    }
    let expected = fs::read_to_string(&page).unwrap_or_default();
    assert!(text == expected, "ETENDUE_BLESS=1 blesses docs/plugins.md");
}

#[test]
fn a_plugin_is_explained_by_its_name_and_a_family_by_its_tag() {
    let place = Place::new();
    let told = place.run("plugins roughplastic").ends_with(0).stdout();
    for part in ["alpha", "0.1", "int_ior", "polypropylene", "beckmann | ggx"] {
        assert!(told.contains(part), "{part}: {told}");
    }
    let told = place.run("plugins sampler").ends_with(0).stdout();
    assert!(
        told.contains("sobol") && !told.contains("roughplastic"),
        "{told}"
    );
    place.run("plugins ruffplastic").ends_with(1);
    let told = place.run("plugins --json").ends_with(0).objects();
    assert_eq!(told[0]["format"], 1);
    assert!(told[0]["plugins"].as_array().unwrap().len() > 60);
}

#[test]
fn a_folder_is_rendered_into_a_folder_by_the_names_of_its_files() {
    let place = Place::new();
    fs::create_dir(place.path("meshes")).unwrap();
    for name in ["b.ply", "a.ply"] {
        fs::write(place.path("meshes").join(name), MESH).unwrap();
    }
    fs::write(place.path("meshes/read.me"), "not a mesh").unwrap();
    let run = place.run("render meshes scene.xml -o out/ --size 8x6 --spp 1 --threads 0 --json");
    let told = run.ends_with(0).objects();
    let outputs: Vec<_> = told.iter().map(|object| object["output"].clone()).collect();
    assert_eq!(outputs, ["out/a.png", "out/b.png", "out/scene.png"]);
    assert!(place.bytes("out/a.png") == place.bytes("out/b.png"));
    fs::create_dir(place.path("empty")).unwrap();
    let run = place.run("render empty -o out/");
    let told = run.ends_with(1).stderr();
    assert!(told.contains("no scene and no mesh"), "{told}");
}

#[test]
fn frames_define_their_number_and_name_their_files() {
    let place = Place::new();
    let run = place.run("render scene.xml -o f{frame:02}.exr --frames 0:3:2 -D x={frame} --json");
    let told = run.ends_with(0).objects();
    assert_eq!(told.len(), 2);
    assert_eq!(
        (&told[0]["frame"], &told[1]["frame"]),
        (&0.into(), &2.into())
    );
    place
        .run("render scene.xml -o alone.exr -D x=2 -D frame=2 -q")
        .ends_with(0);
    let pixels = |name: &str| {
        let path = place.path(name);
        etendue::image::read(&path, &Default::default())
            .unwrap()
            .image
    };
    assert_eq!(pixels("f02.exr"), pixels("alone.exr"));
    assert_ne!(pixels("f00.exr"), pixels("f02.exr"));
}

#[test]
fn a_turntable_loads_its_scene_once_and_comes_around() {
    let place = Place::new();
    let run =
        place.run("render mesh.ply -o t{frame}.exr --turntable 3 --size 30x20 --spp 1 --json");
    let told = run.ends_with(0).objects();
    assert_eq!(told.len(), 3);
    for frame in &told[1..] {
        assert_eq!(frame["seconds"]["load"], 0.0);
        assert_eq!(frame["seconds"]["build"], 0.0);
    }
    let pixels = |name: &str| {
        let path = place.path(name);
        etendue::image::read(&path, &Default::default())
            .unwrap()
            .image
    };
    assert_ne!(pixels("t0.exr"), pixels("t1.exr"));
    place
        .run("render mesh.ply -o u{frame}.exr --turntable 3 --frames 1:5:3 --size 30x20 --spp 1 -q")
        .ends_with(0);
    assert_eq!(pixels("u1.exr"), pixels("t1.exr"));
    assert_eq!(pixels("u4.exr"), pixels("t1.exr"));
}

/// Two squares of light at depths of 4 and 8, the nearer one above, seen by a camera whose focal length is 64 pixels.
const DEPTHS: &str = r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="1"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="90"/>
        <transform name="to_world"><lookat origin="1, 2, 3" target="1, 2, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="128"/><integer name="height" value="64"/>
            <rfilter type="box"/></film>
        <sampler type="independent"><integer name="sample_count" value="64"/></sampler>
    </sensor>
    <shape type="rectangle">
        <transform name="to_world"><scale value="0.3"/><translate x="1.2" y="2.8" z="-1"/></transform>
        <emitter type="area"><rgb name="radiance" value="1"/></emitter>
    </shape>
    <shape type="rectangle">
        <transform name="to_world"><scale value="0.3"/><translate x="1.2" y="0.4" z="-5"/></transform>
        <emitter type="area"><rgb name="radiance" value="1"/></emitter>
    </shape>
</scene>"#;

#[test]
fn two_eyes_see_what_is_near_further_apart_as_a_pinhole_has_it() {
    let place = Place::new();
    fs::write(place.path("depths.xml"), DEPTHS).unwrap();
    let run = place.run("render depths.xml -o d-{eye}.exr --stereo 0.5 --json");
    let told = run.ends_with(0).objects();
    assert_eq!(told[0]["output"], "d-left.exr");
    assert_eq!(told[1]["output"], "d-right.exr");
    assert_eq!(told[1]["seconds"]["load"], 0.0, "one scene for both");
    let read = |name: &str| {
        let path = place.path(name);
        etendue::image::read(&path, &Default::default())
            .unwrap()
            .image
    };
    // The column and row of the light's centre within these rows.
    let center = |name: &str, rows: std::ops::Range<u32>| {
        let image = read(name);
        let mut sums = [0.0; 3];
        for (y, x) in rows.flat_map(|y| (0..128).map(move |x| (y, x))) {
            let light = f64::from(image.get(x, y, 0));
            let place = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            sums[0] += light * place[0];
            sums[1] += light * place[1];
            sums[2] += light;
        }
        [sums[0] / sums[2], sums[1] / sums[2]]
    };
    for (rows, depth) in [(0..32, 4.0), (32..64, 8.0)] {
        let [left, right] = ["d-left.exr", "d-right.exr"].map(|eye| center(eye, rows.clone()));
        let disparity = left[0] - right[0];
        let formula = 64.0 * 0.5 / depth;
        assert!(
            (disparity - formula).abs() < 0.05,
            "{depth}: {disparity}, not {formula}"
        );
        // Half of it to each side of where one eye sees it.
        let one = 64.0 + 64.0 * 0.2 / depth;
        assert!(
            (left[0] + right[0] - 2.0 * one).abs() < 0.1,
            "{left:?} {right:?}"
        );
        assert!((left[1] - right[1]).abs() < 0.05, "{left:?} {right:?}");
    }
    let bytes = |name: &str| place.bytes(name);
    place
        .run("render depths.xml -o one.exr --stereo 0.5 --eye right -q")
        .ends_with(0);
    assert!(read("one.exr") == read("d-right.exr"));
    place
        .run("render depths.xml -o both/ --stereo 0.5 --spp 1 -q")
        .ends_with(0);
    assert_ne!(
        bytes("both/depths-left.png"),
        bytes("both/depths-right.png")
    );
    place
        .run("render mesh.ply -o t{frame}-{eye}.png --stereo 0.1 --turntable 2 --size 24x16 --spp 1 -q")
        .ends_with(0);
    assert_ne!(bytes("t1-left.png"), bytes("t1-right.png"));
    for (arguments, message) in [
        (
            "depths.xml -o a.exr --stereo 0.5",
            "depths.xml, left eye and depths.xml, right eye would both",
        ),
        ("depths.xml -o {eye}.exr", "with --stereo, {eye}"),
    ] {
        let run = place.run(&format!("render {arguments}"));
        run.ends_with(1);
        assert!(
            run.stderr().contains(message),
            "{arguments}: {}",
            run.stderr()
        );
    }
}

#[test]
fn sensors_are_chosen_by_number_by_id_and_all_together() {
    let place = Place::new();
    place
        .run("render scene.xml -o s-{sensor}.png --sensor all -q")
        .ends_with(0);
    let (front, side) = (place.bytes("s-front.png"), place.bytes("s-1.png"));
    assert_ne!(front, side);
    for (sensor, expected) in [("0", &front), ("front", &front), ("1", &side)] {
        place
            .run(&format!("render scene.xml -o one.png --sensor {sensor} -q"))
            .ends_with(0);
        assert_eq!(&place.bytes("one.png"), expected, "{sensor}");
    }
    let run = place.run("render scene.xml -o one.png --sensor frunt");
    let said = run.ends_with(1).stderr();
    assert!(said.contains("there are front, 1") && said.contains("did you mean \"front\"?"));
    let run = place.run("render scene.xml -o one.png --sensor 2");
    assert!(run.ends_with(1).stderr().contains("no sensor \"2\""));
    let run = place.run("render scene.xml -o one.png --sensor all");
    let said = run.ends_with(1).stderr();
    assert!(said.contains("scene.xml and scene.xml, sensor 1 would both be written to one.png"));
}

#[test]
fn a_material_from_a_file_is_an_input_like_the_others() {
    let place = Place::new();
    fs::create_dir(place.path("look")).unwrap();
    let material = r#"<scene version="3.0.0"><default name="rough" value="0.2"/>
        <texture type="bitmap" id="t"><string name="filename" value="t.png"/></texture>
        <bsdf type="twosided"><bsdf type="roughplastic"><float name="alpha" value="$rough"/>
            <ref id="t" name="diffuse_reflectance"/></bsdf></bsdf></scene>"#;
    let write = |text: &str| fs::write(place.path("look/m.xml"), text).unwrap();
    write(material);
    let paint = |seed: u32| {
        let small = format!("render mesh.ply -o look/t.png --size 4x4 --spp 1 -q --seed {seed}");
        place.run(&small).ends_with(0);
    };
    paint(1);
    let of = "--size 16x12 --spp 4 -q -o a.exr --skip-same --json --material look/m.xml";
    let render = || {
        let run = place.run(&format!(
            "render mesh.ply {of} --write-scene scene-of-mesh.xml"
        ));
        let objects = run.ends_with(0).objects();
        let status = objects[0]["status"].as_str().unwrap().to_owned();
        (status, place.bytes("a.exr"))
    };
    let (status, first) = render();
    assert_eq!(status, "rendered");
    assert_eq!(render(), ("skipped".to_owned(), first.clone()));

    // The scene that was written says the same.
    place
        .run("render scene-of-mesh.xml --size 16x12 --spp 4 -q -o b.exr")
        .ends_with(0);
    let pixels = |name: &str| {
        let picture = etendue::image::read(
            &place.path(name),
            &etendue::budget::Budget::default().open(),
        );
        picture.unwrap_or_else(|e| panic!("{e}")).image
    };
    assert_eq!(pixels("a.exr"), pixels("b.exr"));

    // Neither the file nor what it names may become another unseen.
    let mut last = first;
    let changes: [&dyn Fn(); 2] = [&|| paint(2), &|| {
        write(&material.replace(r#""0.2""#, r#""0.4""#))
    }];
    for change in changes {
        change();
        let (status, now) = render();
        assert_eq!(status, "rendered");
        assert_ne!(now, last);
        last = now;
    }

    // What is wrong in it is shown where it stands.
    write(&material.replace("\"alpha\"", "\"alhpa\""));
    let run = place.run(&format!("render mesh.ply {of}"));
    let said = run.ends_with(1).stderr();
    assert!(
        said.contains("look/m.xml:3") && said.contains("alhpa"),
        "{said}"
    );
}

#[test]
fn a_failing_image_does_not_keep_the_others_from_being_made() {
    let place = Place::new();
    let run = place
        .run("render scene.xml broken.xml missing.xml mesh.ply -o {name}.png --spp 1 --size 8x8");
    let table = run.ends_with(3).stdout();
    assert!(table.contains("4 images: 2 rendered, 2 failed"), "{table}");
    assert!(
        table.contains("failed      broken.png  broken.xml:"),
        "{table}"
    );
    assert!(place.path("scene.png").exists() && place.path("mesh.png").exists());
    let told = place
        .run("render scene.xml broken.xml -o {name}.png --spp 1 --size 8x8 --json")
        .ends_with(1)
        .objects();
    assert_eq!(told[0]["status"], "rendered");
    assert_eq!(told[1]["status"], "failed");
    assert!(told[1]["problems"][0]["location"]["line"].as_u64() > Some(1));
}

#[test]
fn what_is_there_is_skipped_if_that_is_asked_for() {
    let place = Place::new();
    fs::write(place.path("f1.png"), "kept").unwrap();
    let run = place.run("render scene.xml -o f{frame}.png --frames 0:2 --skip-existing");
    let table = run.ends_with(0).stdout();
    assert!(table.contains("2 images: 1 rendered, 1 skipped"), "{table}");
    assert_eq!(place.bytes("f1.png"), b"kept");
    fs::write(place.path("f1.png.checkpoint"), "").unwrap();
    place
        .run("render scene.xml -o f1.png --skip-existing -q")
        .ends_with(0);
    assert_ne!(place.bytes("f1.png"), b"kept");
}

#[test]
fn what_would_stop_an_image_from_being_written_is_said_before_rendering() {
    let place = Place::new();
    for (output, said) in [
        ("mesh.ply/{name}.png", "mesh.ply is not a folder"),
        ("{nmae}.png", "unknown {nmae}"),
        ("image.tiff", "unknown extension"),
    ] {
        let run = place.run(&format!(
            "render scene.xml mesh.ply -o {output} --spp 1000000"
        ));
        let stderr = run.ends_with(1).stderr();
        assert!(
            stderr.contains(said) || stderr.contains("would both"),
            "{stderr}"
        );
    }
    let run = place.run("render mesh.ply -o a.png --memory-limit 2M --size 2000x2000");
    assert!(
        run.ends_with(1)
            .stderr()
            .contains("more than the limit of 2.0 MB")
    );
    assert_eq!(fs::read_dir(place.0.path()).unwrap().count(), 3);
}

#[test]
fn check_finds_everything_and_renders_nothing() {
    let place = Place::new();
    let run = place.run("check scene.xml broken.xml");
    assert_eq!(run.ends_with(1).stdout(), "scene.xml: in order\n");
    let said = run.stderr();
    assert!(said.contains("did you mean \"cube\"?"), "{said}");
    let told = place
        .run("check scene.xml broken.xml mesh.ply --json")
        .ends_with(1)
        .objects();
    let ok: Vec<_> = told.iter().map(|o| o["ok"].as_bool()).collect();
    assert_eq!(ok, [Some(true), Some(false), Some(true)]);
    let quiet = place.run("check scene.xml mesh.ply -q");
    assert_eq!((quiet.status(), quiet.stdout().as_str()), (0, ""));
}

#[test]
fn info_counts_what_scenes_meshes_and_images_hold() {
    let place = Place::new();
    place
        .run("render scene.xml -o image.exr --seed 5 -q")
        .ends_with(0);
    let told = place
        .run("info scene.xml mesh.ply image.exr --json")
        .ends_with(0)
        .objects();
    let [scene, mesh, image] = &told[..] else {
        panic!("{told:?}");
    };
    assert_eq!(scene["primitives"], 12);
    assert_eq!(scene["plugins"]["shape"]["cube"], 1);
    assert_eq!(scene["sensors"][0]["id"], "front");
    assert_eq!(
        scene["sensors"][1]["size"],
        serde_json::json!({ "width": 24, "height": 16 })
    );
    assert_eq!(mesh["triangles"], 1);
    assert_eq!(mesh["vertices"], 3);
    assert_eq!(mesh["area"], 0.5);
    assert_eq!(
        image["size"],
        serde_json::json!({ "width": 24, "height": 16 })
    );
    assert_eq!(image["metadata"]["seed"], "5");
    assert_eq!(image["channels"].as_array().unwrap().len(), 3);
    let text = place.run("info scene.xml mesh.ply image.exr missing.png");
    let lines = text.ends_with(3).stdout();
    for line in [
        "mesh.ply\n",
        "  triangles                  1\n",
        "    front: moves no, plugin perspective, shutter 0, 0, size 24, 16, spp 2\n",
        "    R: greatest ",
    ] {
        assert!(lines.contains(line), "{line:?}: {lines}");
    }
}

#[test]
fn info_counts_what_moves() {
    let place = Place::new();
    let keyframes = r#"<animation name="to_world"><transform time="0"/><transform time="1"><translate x="1"/></transform></animation>"#;
    let mesh =
        r#"<string name="filename" value="mesh.ply"/><string name="filename_1" value="mesh.ply"/>"#;
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective">{keyframes}<float name="shutter_open" value="0.25"/>
        <float name="shutter_close" value="0.5"/></sensor><sensor type="perspective"/>
        <shape type="group">{keyframes}<shape type="cube"/><shape type="cube">{keyframes}</shape></shape>
        <shape type="ply">{mesh}</shape><emitter type="point">{keyframes}</emitter></scene>"#
    );
    fs::write(place.0.path().join("moves.xml"), text).unwrap();
    let told = place.run("info moves.xml --json").ends_with(0).objects();
    let motion = serde_json::json!({ "shapes": 2, "deforming_meshes": 1, "lights": 1 });
    assert_eq!(told[0]["motion"], motion);
    let sensors = told[0]["sensors"].as_array().unwrap();
    assert_eq!(sensors[0]["shutter"], serde_json::json!([0.25, 0.5]));
    assert_eq!(
        (&sensors[0]["moves"], &sensors[1]["moves"]),
        (&true.into(), &false.into())
    );
    let text = place.run("info moves.xml");
    assert!(
        text.ends_with(0)
            .stdout()
            .contains("deforming meshes         1\n")
    );
}

#[test]
fn convert_makes_the_pictures_that_render_makes_and_takes_layers_crops_and_sheets() {
    let place = Place::new();
    for view in [
        "",
        "--view agx --exposure 1.5 --dither",
        "--encode pq --gamut bt2020 --bits 16",
    ] {
        place
            .run(format!("render scene.xml -o direct.png {view}").trim())
            .ends_with(0);
        place.run("render scene.xml -o a.exr").ends_with(0);
        place
            .run(format!("convert a.exr -o converted.png {view}").trim())
            .ends_with(0);
        let bytes = |name: &str| fs::read(place.path(name)).unwrap();
        assert!(bytes("direct.png") == bytes("converted.png"), "{view}");
    }
    let read = |name: &str| {
        etendue::image::read(&place.path(name), &Default::default())
            .unwrap()
            .image
    };
    // Codes survive a way through linear values; floats survive every linear format.
    place.run("convert a.exr -o b.png").ends_with(0);
    place.run("convert b.png -o c.exr").ends_with(0);
    place.run("convert c.exr -o d.png").ends_with(0);
    assert_eq!(read("b.png"), read("d.png"));
    place.run("convert a.exr -o e.pfm").ends_with(0);
    assert_eq!(read("e.pfm").pixel(3, 2), &read("a.exr").pixel(3, 2)[..3]);
    place.run("convert a.exr -o e.tif --bits 32").ends_with(0);
    assert_eq!(read("e.tif").pixel(3, 2), &read("a.exr").pixel(3, 2)[..3]);
    for bits in ["", " --bits 16 --view agx"] {
        for name in ["f.tif", "f.png"] {
            let command = format!("convert a.exr -o {name}{bits}");
            place.run(&command).ends_with(0);
        }
        assert_eq!(read("f.tif"), read("f.png"), "{bits}");
        place
            .run(&format!("render scene.xml -o g.tiff{bits}"))
            .ends_with(0);
        assert_eq!(read("g.tiff"), read("f.tif"), "{bits}");
    }
    place.run("convert f.tif -o h.png --bits 16").ends_with(0);
    assert_eq!(read("h.png"), read("f.tif"));

    let (width, height) = (read("a.exr").width(), read("a.exr").height());
    let run = place.run("convert a.exr b.png -o pair.png --sheet 2 --json");
    let object = &run.ends_with(0).objects()[0];
    assert_eq!(object["width"], 2 * width + 4);
    assert_eq!(object["height"], height);
    place
        .run("convert a.exr -o crop.exr --crop 1,2,3,4")
        .ends_with(0);
    assert_eq!(read("crop.exr").pixel(0, 0), read("a.exr").pixel(1, 2));
    place
        .run("convert a.exr b.png -o out-{name}.jpg")
        .ends_with(0);
    assert_eq!(read("out-b.jpg").width(), width);

    for (arguments, status, message) in [
        (
            "convert a.exr -o x.png --layer albedo",
            1,
            "no layer \"albedo\"",
        ),
        (
            "convert a.exr -o x.png --bits 32",
            1,
            "PNG and JPEG have no floats",
        ),
        ("convert a.exr -o x.jpg --bits 16", 1, "JPEG has 8 bits"),
        (
            "convert a.exr -o x.tif --encode pq",
            1,
            "cannot say that their codes",
        ),
        (
            "render scene.xml -o x.png --bits 32",
            1,
            "PNG and JPEG have no floats",
        ),
        (
            "convert a.exr -o x.png --crop 0,0,9999,1",
            1,
            "does not lie within",
        ),
        ("convert a.exr b.png -o x.png", 1, "would both be written"),
        ("convert a.exr -o x.gif", 1, "unknown extension .gif"),
        ("convert none.exr -o x.png", 3, "none.exr"),
        ("convert a.exr -o x.jpg --bits 16", 1, "JPEG has 8 bits"),
        ("convert a.exr -o x.jpg --encode pq", 1, "no sRGB"),
        ("convert a.exr -o x.png --encode gama:2", 2, "gamma:2.2"),
        ("convert a.exr -o x.png --glare 2", 2, "from 0 to 1"),
        ("convert a.exr -o x.png --ambient -1", 2, "lux from 0"),
        (
            "convert a.exr -o x.png --ambient-white 80",
            2,
            "--ambient <LUX>",
        ),
    ] {
        let run = place.run(arguments);
        assert!(
            run.ends_with(status).stderr().contains(message),
            "{arguments}: {}",
            run.stderr()
        );
    }
}

#[test]
fn relight_lists_layers_weighs_them_and_suggests_names() {
    let place = Place::new();
    let integrator = r#"<integrator type="phong"><string name="layers" value="terms, lights"/></integrator>
        <emitter type="point" id="lamp"><point name="position" value="1, 3, 5"/></emitter>"#;
    let scene = SCENE.replace("<emitter type=\"constant\"/>", integrator);
    fs::write(place.path("phong.xml"), scene).unwrap();
    place.run("render phong.xml -o phong.exr").ends_with(0);

    let listed = place.run("relight phong.exr").ends_with(0).stdout();
    for name in [
        "ambient ",
        "light.lamp.diffuse ",
        "light.lamp.emission ",
        "light.lamp.specular ",
    ] {
        assert!(listed.contains(name), "{listed}");
    }
    let run = place.run("relight phong.exr -o dark.exr --weight diffuse=2,1,0 --json");
    let object = &run.ends_with(0).objects()[0];
    assert_eq!(object["weights"][0]["factors"][0], 2.0);
    assert_eq!(object["layers"].as_array().map(Vec::len), Some(4));
    let of = |name: &str| {
        let picture = etendue::image::read(&place.path(name), &Default::default()).unwrap();
        let image = picture.image;
        let rgb = image.rgb().unwrap();
        let sum = |c: usize| {
            image
                .data()
                .iter()
                .skip(rgb[c])
                .step_by(image.channels().len())
                .sum::<f32>()
        };
        [0, 1, 2].map(sum)
    };
    let (before, after) = (of("phong.exr"), of("dark.exr"));
    assert!(before[0] > 1.0 && after[2] == 0.0, "{before:?} {after:?}");
    assert!((after[0] / before[0] - 2.0).abs() < 1e-5 && (after[1] / before[1] - 1.0).abs() < 1e-5);

    let wrong = place.run("relight phong.exr -o x.png --weight difuse=2");
    assert!(
        wrong
            .ends_with(1)
            .stderr()
            .contains("did you mean \"diffuse\"?")
    );
    assert!(!place.path("x.png").exists());
    place
        .run("relight phong.exr -o x.png --weight diffuse=-2")
        .ends_with(2);
    place
        .run("relight phong.exr --weight diffuse=2")
        .ends_with(2);
    place.run("render scene.xml -o plain.exr").ends_with(0);
    assert!(
        place
            .run("relight plain.exr")
            .ends_with(1)
            .stderr()
            .contains("has no layers")
    );
    assert!(
        place
            .run("relight none.exr")
            .ends_with(3)
            .stderr()
            .contains("none.exr")
    );
}

#[test]
fn folders_of_outputs_are_made() {
    let place = Place::new();
    for arguments in [
        "render scene.xml -o new/a/{name}.exr --checkpoint 0.001 --heatmap heat/{name}.png -q",
        "mesh convert mesh.ply meshes/copy.ply -q",
        "mesh generate flake meshes/more/flake.ply --levels 1 -q",
        "compare new/a/scene.exr new/a/scene.exr --map maps/error.png",
    ] {
        place.run(arguments).ends_with(0);
    }
    for file in [
        "new/a/scene.exr",
        "heat/scene.png",
        "meshes/copy.ply",
        "meshes/more/flake.ply",
        "maps/error.png",
    ] {
        assert!(place.path(file).is_file(), "{file}");
    }
    // Nothing is made for a scene that cannot be rendered.
    place.run("render broken.xml -o none/a.exr").ends_with(1);
    assert!(!place.path("none").exists());
}

#[test]
fn a_turntable_goes_around_what_the_camera_looks_at_or_a_pivot() {
    let place = Place::new();
    let pixels = |name: &str| {
        let path = place.path(name);
        etendue::image::read(&path, &Default::default())
            .unwrap()
            .image
    };
    let run = |options: &str| {
        let arguments = format!("render scene.xml --turntable 2 --spp 1 --size 24x16 -q {options}");
        place.run(&arguments).ends_with(0);
    };
    run("-o a{frame}.exr");
    run("-o b{frame}.exr --pivot 0,0,0");
    run("-o c{frame}.exr --pivot 0,0,-4");
    // The target is the origin; where the cube is does not count.
    assert_eq!(pixels("a1.exr"), pixels("b1.exr"));
    assert_ne!(pixels("a1.exr"), pixels("c1.exr"));
    place
        .run("render scene.xml -o a.exr --pivot 0,0,0")
        .ends_with(2);
}

#[test]
fn numbers_of_the_command_line_have_bounds() {
    let place = Place::new();
    for (arguments, said) in [
        (
            "render scene.xml -o a.exr --threads 100000",
            "100000 is not between 0 and",
        ),
        ("check scene.xml --threads -1", "write a number such as 8"),
        (
            "render scene.xml -o a.exr --spp 4000000000",
            "4000000000 is not in 1..=",
        ),
        (
            "render scene.xml -o a.exr --turntable 2 --pivot 0,inf,0",
            "write it as X,Y,Z",
        ),
        ("profile --threads 100000", "100000 is not between 0 and"),
        (
            "crosscheck scene.xml --threads 100000",
            "100000 is not between 0 and",
        ),
    ] {
        let run = place.run(arguments);
        let told = run.ends_with(2).stderr();
        assert!(told.contains(said), "{arguments}: {told}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_by_the_status() {
    let place = Place::new();
    place.run("render scene.xml -o a.exr -q").ends_with(0);
    for arguments in [
        "render scene.xml -o b.exr --json",
        "render scene.xml -o b.exr --stats",
        "check scene.xml --json",
        "check scene.xml",
        "info scene.xml --json",
        "info a.exr mesh.ply",
        "compare a.exr a.exr --json",
        "mesh report mesh.ply --json",
        "mesh convert mesh.ply c.ply --json",
        "mesh generate flake f.ply --levels 1 --json",
        "plugins --json",
    ] {
        let full = fs::OpenOptions::new()
            .write(true)
            .open("/dev/full")
            .expect("Linux has it");
        let output = Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(place.0.path())
            .args(arguments.split(' '))
            .stdout(full)
            .output()
            .unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(3), "{arguments}: {told}");
        assert!(
            told.contains("cannot write standard output"),
            "{arguments}: {told}"
        );
    }
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_refused_and_not_waited_for() {
    let place = Place::new();
    for name in ["a.ply", "a.xml", "a.exr"] {
        let made = Command::new("mkfifo").arg(place.path(name)).status();
        assert!(made.is_ok_and(|status| status.success()), "mkfifo");
    }
    for arguments in [
        "render a.ply -o b.exr",
        "render a.xml -o b.exr",
        "check a.ply a.xml",
        "info a.ply a.exr a.xml",
        "mesh report a.ply",
        "mesh convert a.ply b.ply",
        "compare a.exr a.exr",
        "profile a.ply --quick",
    ] {
        let run = place.run(arguments);
        assert_ne!(run.status(), 0, "{arguments}");
        let told = run.stderr();
        assert!(
            told.contains("regular file") || told.contains("not a file"),
            "{arguments}: {told}"
        );
    }
}

#[cfg(unix)]
#[test]
fn a_signal_leaves_no_half_of_a_mesh() {
    let place = Place::new();
    let temporary = || {
        let names = fs::read_dir(place.0.path()).unwrap();
        let mut names = names.map(|e| e.unwrap().file_name().into_string().unwrap());
        names.any(|name| name.starts_with(".etendue-"))
    };
    for signal in ["-INT", "-TERM"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(place.0.path())
            .args([
                "mesh",
                "generate",
                "terrain",
                "big.ply",
                "--triangles",
                "2M",
                "-q",
            ])
            .spawn()
            .unwrap();
        while !temporary() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(std::time::Duration::from_micros(200));
        }
        let id = child.id().to_string();
        let _ = Command::new("kill").args([signal, &id]).output();
        let status = child.wait().unwrap().code();
        // It may have been done before the signal came.
        assert!(matches!(status, Some(0 | 130)), "{signal}: {status:?}");
        assert!(!temporary(), "{signal}");
    }
}
