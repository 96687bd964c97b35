//! Renders in processes of their own that are stopped and killed: what is left, and how they go on.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant, SystemTime};

use etendue::budget::Budget;
use etendue::description::declared::Takes;
use etendue::image::vol::Grid;
use etendue::image::{self, Image};
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
    image::read(path, &Budget::default().open()).unwrap().image
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
    // Milliseconds; a busy machine may need more than an idle one until there is something to keep.
    let mut longest = 150;
    for _ in 0..10 {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let mut child = place.start(&keeping);
        std::thread::sleep(Duration::from_millis(u64::from(
            10 + (random >> 16) % longest,
        )));
        child.kill().unwrap();
        child.wait().unwrap();
        kept |= place.path("killed.exr.checkpoint").exists();
        if !kept {
            longest += 100;
        }
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
    crate::support::let_children_hear_interrupts();
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
        let picture = image::read(&place.path(&name), &Budget::default().open()).unwrap();
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
    let done = |told: &Value| told["completed"]["units"]["done"].as_u64().unwrap();
    assert!(done(&second) > done(&first));
    let bands = cfg!(feature = "bands").then_some(["--resume", "--bands", "3"]);
    for other in [["--resume", "--seed", "1"]].into_iter().chain(bands) {
        let refused = place.run(&[&limited[..], &other].concat());
        assert_eq!(refused.status.code(), Some(1));
        assert_eq!(object(&refused)["status"], "failed");
        let said = String::from_utf8_lossy(&refused.stderr);
        assert!(
            said.contains(
                "a setting (the seed, the bands, adaptive sampling or the gaze) has changed"
            ),
            "{said}"
        );
    }
}

/// A scene of everything that is read from files, made in a folder, and for each of the files another content.
fn scene_of_files(place: &Place) -> Vec<(&'static str, Vec<u8>)> {
    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    const STL: &str = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
        endfacet\nendsolid\n";
    // The second buffer, which nothing needs, names the file that names it.
    const GLTF: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"a%20buffer.bin"},{"byteLength":4,"uri":"loop.gltf"}]}"#;
    const LOOP: &str =
        r#"{"buffers":[{"byteLength":4,"uri":"mesh.gltf"},{"byteLength":4,"uri":"loop.gltf"}]}"#;
    const SHAPES: &str = r#"<shape type="ply"><string name="filename" value="mesh.ply"/><ref id="textured"/></shape>
        <shape type="stl"><string name="filename" value="mesh.stl"/></shape>
        <shape type="obj"><string name="filename" value="mesh.obj"/><boolean name="materials" value="true"/></shape>
        <shape type="gltf"><string name="filename" value="mesh.gltf"/></shape>
        <shape type="ply"><string name="filename" value="mesh.ply.gz"/></shape>
        <shape type="serialized"><string name="filename" value="mesh.serialized"/></shape>
        <shape type="rectangle"><texture type="bitmap" name="displacement"><string name="filename" value="heights.png"/>
            </texture><float name="displacement_edge" value="0.5"/></shape>
        <shape type="sphere"><bsdf type="diffuse"><spectrum name="reflectance" filename="curve.spd"/></bsdf></shape>
        <shape type="bsplinecurve"><string name="filename" value="strands.txt"/></shape>
        <shape type="linearcurve"><string name="filename" value="lines.txt"/></shape>
        <shape type="ellipsoids"><string name="filename" value="cloud.ply"/></shape>
        <shape type="ellipsoidsmesh"><string name="filename" value="cloud.ply"/></shape>
        <shape type="sdfgrid"><string name="filename" value="distance.vol"/></shape>
        <shape type="cube"><medium name="interior" type="heterogeneous"><volume name="sigma_t" type="gridvolume">
            <string name="filename" value="smoke.vol"/></volume></medium></shape>
        <shape type="sphere"><bsdf type="measured"><string name="filename" value="paint.bsdf"/></bsdf></shape>
        <emitter type="envmap"><string name="filename" value="sky.png"/></emitter>"#;
    const MATERIALS: &str = r#"<bsdf type="diffuse" id="textured"><texture type="bitmap" name="reflectance">
        <string name="filename" value="picture.png"/></texture></bsdf>"#;
    let document = |text: &str| format!(r#"<scene version="3.0.0">{text}</scene>"#).into_bytes();
    let floats = |last: f32| -> Vec<u8> {
        let numbers = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, last, 0.0_f32];
        numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
    };
    let picture = |code: u8| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let pixels = ::image::RgbImage::from_pixel(4, 4, ::image::Rgb([code; 3]));
        pixels
            .write_to(&mut bytes, ::image::ImageFormat::Png)
            .unwrap();
        bytes.into_inner()
    };
    let text = |text: &str| text.as_bytes().to_vec();
    let gzip = |text: &str| {
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(text.as_bytes()).unwrap();
        gzip.finish().unwrap()
    };
    // Flags, a name, three vertices, one triangle; and where it begins.
    let serialized = |last: f32| -> Vec<u8> {
        let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        let counts = [3_u64, 1].map(u64::to_le_bytes).concat();
        let corners = [0_u32, 1, 2].map(u32::to_le_bytes).concat();
        for part in [&[0; 5][..], &counts, &floats(last), &corners] {
            zlib.write_all(part).unwrap();
        }
        let stream = zlib.finish().unwrap();
        [&[0x1c, 4, 4, 0][..], &stream, &[0; 8], &1_u32.to_le_bytes()].concat()
    };
    // Eight values on a grid.
    let grid = |last: f32| {
        etendue::image::vol::encode(&Grid {
            size: [2; 3],
            channels: 1,
            bbox: [glam::Vec3::ZERO, glam::Vec3::ONE],
            values: vec![1.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, last],
        })
    };
    // A tensor file: what each field is and where, then their numbers.
    let measured = |last: f32| -> Vec<u8> {
        let fields: [(&str, &[u64]); 8] = [
            ("phi_i", &[1]),
            ("theta_i", &[2]),
            ("ndf", &[2, 2]),
            ("sigma", &[2, 2]),
            ("vndf", &[1, 2, 2, 2]),
            ("luminance", &[1, 2, 2, 2]),
            ("rgb", &[1, 2, 3, 2, 2]),
            ("jacobian", &[1]),
        ];
        const BYTE: u8 = 1;
        const SINGLE: u8 = 10;
        let head = |name: &str, shape: &[u64], kind: u8, offset: usize| {
            let mut head = (name.len() as u16).to_le_bytes().to_vec();
            head.extend(name.as_bytes());
            head.extend((shape.len() as u16).to_le_bytes());
            head.push(kind);
            head.extend((offset as u64).to_le_bytes());
            head.extend(shape.iter().flat_map(|size| size.to_le_bytes()));
            head
        };
        let mut file = [&b"tensor_file\0\x01\0"[..], &9_u32.to_le_bytes()].concat();
        let heads = fields.map(|(name, shape)| head(name, shape, SINGLE, 0).len());
        let mut offset = file.len() + heads.iter().sum::<usize>();
        offset += head("description", &[1], BYTE, 0).len();
        file.extend(head("description", &[1], BYTE, offset));
        let mut numbers = vec![b'a'];
        for (name, shape) in fields {
            file.extend(head(name, shape, SINGLE, offset + numbers.len()));
            let count = shape.iter().product::<u64>() as u16;
            let number = |i: u16| match name {
                "phi_i" | "jacobian" => 0.0,
                "theta_i" => 0.1 + f32::from(i),
                _ if name == "rgb" && i + 1 == count => last,
                _ => 0.5,
            };
            numbers.extend((0..count).flat_map(|i| number(i).to_le_bytes()));
        }
        [file, numbers].concat()
    };
    const CLOUD: &str = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z
property float nx\nproperty float ny\nproperty float nz\nproperty float scale_0\nproperty float scale_1
property float scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3
end_header\n0 0 0 0 0 0 -1 -1 -1 1 0 0 0\n";
    let strands = "0 0 0 0.1\n1 0 0 0.1\n2 0 0 0.1\n3 0 0 0.1\n";
    let obj = "mtllib mesh.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    let files = [
        ("mesh.ply", text(PLY), text(&PLY.replace("0 1 0", "0 2 0"))),
        ("mesh.stl", text(STL), text(&STL.replace("0 1 0", "0 2 0"))),
        ("mesh.obj", text(obj), text(&obj.replace("0 1 0", "0 2 0"))),
        (
            "mesh.mtl",
            text("newmtl a\nKd 1 0 0\n"),
            text("newmtl a\nKd 0 1 0\n"),
        ),
        ("mesh.gltf", text(GLTF), text(&GLTF.replace("[0]", "[ 0 ]"))),
        ("loop.gltf", text(LOOP), text(&LOOP.replace(":4", ": 4"))),
        ("a buffer.bin", floats(1.0), floats(2.0)),
        (
            "curve.spd",
            text("400 0.5\n700 0.5\n"),
            text("400 0.5\n700 0.4\n"),
        ),
        ("picture.png", picture(100), picture(101)),
        ("sky.png", picture(100), picture(101)),
        ("heights.png", picture(100), picture(101)),
        (
            "strands.txt",
            text(strands),
            text(&strands.replace('3', "4")),
        ),
        ("lines.txt", text(strands), text(&strands.replace('3', "5"))),
        (
            "cloud.ply",
            text(CLOUD),
            text(&CLOUD.replace("-1 1 0", "-2 1 0")),
        ),
        ("distance.vol", grid(-0.5), grid(-0.4)),
        ("smoke.vol", grid(0.5), grid(0.6)),
        ("paint.bsdf", measured(0.5), measured(0.4)),
        (
            "mesh.ply.gz",
            gzip(PLY),
            gzip(&PLY.replace("0 1 0", "0 2 0")),
        ),
        ("mesh.serialized", serialized(1.0), serialized(2.0)),
        (
            "materials.xml",
            document(MATERIALS),
            document(&MATERIALS.replace("<bsdf", "<bsdf   ")),
        ),
        (
            "shapes.xml",
            document(r#"<include filename="deep.xml"/>"#),
            document(""),
        ),
        (
            "deep.xml",
            document(SHAPES),
            document(&SHAPES.replace("sphere", "disk")),
        ),
    ];
    let includes = r#"<include filename="materials.xml"/><include filename="shapes.xml"/></scene>"#;
    let scene = SCENE
        .replace(r#"<emitter type="constant"/>"#, "")
        .replace("</scene>", includes);
    fs::write(place.path("scene.xml"), scene).unwrap();
    let mut others = Vec::new();
    for (name, content, other) in files {
        fs::write(place.path(name), content).unwrap();
        others.push((name, other));
    }
    others
}

#[test]
fn a_change_of_any_file_that_the_scene_reads_is_named_and_nothing_is_resumed() {
    let place = Place::new();
    let others = scene_of_files(&place);
    let texts = ["materials.xml", "deep.xml"].map(|name| fs::read_to_string(place.path(name)));
    let texts = texts.map(Result::unwrap).concat();
    for listed in etendue::render::plugins() {
        let names_files = listed.plugin.rows().any(|row| row.takes == Takes::File);
        let name = listed.name;
        assert!(
            !names_files || texts.contains(&format!("type=\"{name}\"")),
            "{name} is not in the scene"
        );
    }
    let arguments = [
        "-o",
        "a.exr",
        "--json",
        "--time-limit",
        "0.2",
        "--spp",
        "100000",
        "--checkpoint",
        "100",
    ];
    let first = place.run(&arguments);
    assert_eq!(object(&first)["status"], "time limit");
    let resumed = [&arguments[..], &["--resume"]].concat();
    for (name, other) in others {
        let whole = fs::read(place.path(name)).unwrap();
        fs::write(place.path(name), other).unwrap();
        let output = place.run(&resumed);
        let said = String::from_utf8_lossy(&output.stderr);
        if name == "materials.xml" {
            // Blanks in a scene file change nothing.
            assert!(output.status.success(), "{said}");
        } else {
            assert_eq!(output.status.code(), Some(1), "{name}: {said}");
            assert!(
                said.contains("cannot be continued") && said.contains(name),
                "{name}: {said}"
            );
        }
        fs::write(place.path(name), whole).unwrap();
    }
    fs::remove_file(place.path("mesh.mtl")).unwrap();
    let said = String::from_utf8_lossy(&place.run(&resumed).stderr).into_owned();
    assert!(
        said.contains("cannot be continued") && said.contains("mesh.mtl"),
        "{said}"
    );
}

/// A disk that takes a kilobyte of a file and no more.
#[cfg(unix)]
#[test]
fn on_a_full_disk_nothing_is_left_but_what_was_there() {
    let place = Place::new();
    fs::write(place.path("a.exr"), "old").unwrap();
    let there = || -> Vec<_> {
        let names = fs::read_dir(place.0.path()).unwrap();
        let mut names: Vec<_> = names.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    };
    let before = there();
    for arguments in [
        "render scene.xml -o a.exr --spp 16 --checkpoint 0.001",
        "render scene.xml -o a.exr --checkpoint 0.001 --noise-threshold 0.1 --max-spp 16",
        "mesh generate terrain hills.ply --triangles 1k",
        "profile scene.xml --quick --sweep samples --rounds 1 -o .",
    ] {
        let program = env!("CARGO_BIN_EXE_etendue");
        let output = Command::new("sh")
            .current_dir(place.0.path())
            .args([
                "-c",
                &format!("trap '' XFSZ; ulimit -f 1; exec {program} {arguments}"),
            ])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{arguments}: {said}");
        assert_eq!(there(), before, "{arguments}: {said}");
        assert_eq!(fs::read(place.path("a.exr")).unwrap(), b"old");
    }
}
