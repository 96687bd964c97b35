//! `etendue mesh` as its users meet it: files that are converted, generated and examined, and what is refused.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use etendue::budget::Budget;
use etendue::description;
use etendue::render::{
    Finish, Lighting, Options, Overrides, Session, Silent, Staging, describe_mesh,
};
use serde_json::Value;

/// Runs `etendue mesh` with the words of `arguments` in `folder`.
fn mesh(folder: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(folder)
        .arg("mesh")
        .args(arguments.split(' '))
        .output()
        .unwrap()
}

/// Standard output of a run that went well.
#[track_caller]
fn done(folder: &Path, arguments: &str) -> String {
    let output = mesh(folder, arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments}: {stderr}");
    String::from_utf8(output.stdout).unwrap()
}

#[track_caller]
fn report(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&done(folder, &format!("report {file} --json"))).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn every_kind_is_generated_the_same_from_one_seed_and_closed_where_it_should_be() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (kind, options, closed, parts) in [
        ("terrain", "--triangles 2k --seed 3", false, 1),
        ("hair", "--triangles 320 --seed 3", false, 10),
        ("flake", "--levels 1 --subdivisions 0", true, 10),
        ("menger", "--levels 2", true, 1),
        (
            "shape",
            "--of box --edge 0.3 --bumps 0.05 --seed 3",
            true,
            1,
        ),
        ("shape", "--subdivisions 3 --bumps 0.1 --seed 3", true, 1),
    ] {
        let told = done(folder, &format!("generate {kind} a.ply {options}"));
        done(
            folder,
            &format!("generate {kind} b.ply {options} --json -q"),
        );
        let bytes = |name: &str| fs::read(folder.join(name)).unwrap();
        assert_eq!(bytes("a.ply"), bytes("b.ply"), "{kind}");
        let report = report(folder, "a.ply");
        assert_eq!(report["closed"], closed, "{kind}");
        assert_eq!(report["components"], parts, "{kind}");
        assert_eq!(report["degenerate_triangles"], 0, "{kind}");
        assert!(
            told.contains(&format!("{} triangles", report["triangles"])),
            "{told}"
        );
        if options.contains("--seed 3") {
            let other = options.replace("--seed 3", "--seed 4");
            done(folder, &format!("generate {kind} b.ply {other}"));
            assert_ne!(bytes("a.ply"), bytes("b.ply"), "{kind}");
        }
    }
    assert_eq!(names(folder), ["a.ply", "b.ply"]);
}

#[test]
fn a_mesh_file_is_made_finer_and_bumpy() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    done(folder, "generate menger sponge.ply --levels 1");
    done(
        folder,
        "generate shape fine.ply --of sponge.ply --subdivisions 2 --bumps 0.01",
    );
    let (base, fine) = (report(folder, "sponge.ply"), report(folder, "fine.ply"));
    assert_eq!(fine["triangles"], base["triangles"].as_u64().unwrap() * 16);
    assert_eq!(fine["euler_characteristic"], base["euler_characteristic"]);
    assert_eq!(fine["closed"], true);
}

#[test]
fn a_flake_as_a_scene_renders_its_balls() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let told = done(folder, "generate flake flake.xml --levels 3 --json");
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["spheres"], 820);
    let check = Command::new(env!("CARGO_BIN_EXE_etendue"))
        .args(["check", "--strict", "flake.xml"])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(check.status.success(), "{check:?}");
}

const TWO: &str = "o left\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\no right side\nf 1 2 4\n";

#[test]
fn several_meshes_are_merged_with_a_word_or_split() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("two.obj"), TWO).unwrap();
    let output = mesh(folder, "convert two.obj two.ply");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        said.contains("2 meshes are merged into one") && said.contains("--split"),
        "{said}"
    );
    assert_eq!(report(folder, "two.ply")["triangles"], 2);
    let parts = &report(folder, "two.obj")["parts"];
    assert_eq!(
        (&parts[0]["name"], &parts[1]["triangles"]),
        (&"left".into(), &1.into())
    );
    let told = done(folder, "convert two.obj apart.ply --split --json");
    assert_eq!(told.lines().count(), 2);
    assert_eq!(
        names(folder),
        [
            "apart-0-left.ply",
            "apart-1-right-side.ply",
            "two.obj",
            "two.ply"
        ]
    );
}

#[test]
fn what_cannot_be_done_is_refused_with_a_reason_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("broken.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
    for (arguments, status, message) in [
        ("convert broken.obj out.ply", 1, "vertex 2 is out of range"),
        ("convert missing.obj out.ply", 3, "missing.obj"),
        ("convert broken.obj out.obj", 1, "written as .ply"),
        ("report broken.obj missing.stl", 3, "missing.stl"),
        (
            "generate terrain out.ply --triangles 40M --memory-limit 10M",
            1,
            "more than the limit of 10.0 MB",
        ),
        (
            "generate hair out.ply --triangles 4G --memory-limit 10G",
            1,
            "--memory-limit",
        ),
        (
            "generate terrain out.ply --triangles 5G",
            2,
            "5G is not between 1 and",
        ),
        (
            "generate flake out.ply --levels 10 --memory-limit none",
            1,
            "more than a mesh can have",
        ),
        (
            "generate flake out.ply --levels 11",
            2,
            "11 is not in 0..=10",
        ),
        (
            "generate menger out.ply --levels 6 --memory-limit 1G",
            1,
            "a mesh of 258097152 triangles",
        ),
        (
            "generate shape out.ply --subdivisions 40 --memory-limit none",
            1,
            "more than a mesh can have",
        ),
        (
            "generate shape out.ply --of box --edge 1e-9 --memory-limit 100M",
            1,
            "more than the limit",
        ),
        ("generate shape out.ply --of bix", 1, "extension"),
        ("generate shape out.ply --edge 0", 2, "not positive"),
        ("generate menger out.stl", 1, "written as .ply"),
    ] {
        let output = mesh(folder, arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{arguments}: {said}");
        assert!(said.contains(message), "{arguments}: {said}");
    }
    assert_eq!(names(folder), ["broken.obj"]);
}

/// A square of 20 × 20 in y = 0, of reflectance 0.5, that a camera 10 above its middle looks down at with a narrow view; and
/// one light at a height of 2 that points down.
fn lit_square(light: &str, turned: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0, 1, 2]}}],
        "extensions": {{"KHR_lights_punctual": {{"lights": [{light}]}}}},
        "nodes": [{{"mesh": 0}},
            {{"camera": 0, "translation": [0, 10, 0], "rotation": [-0.70710678, 0, 0, 0.70710678]}},
            {{"translation": [0, 2, 0], "rotation": {turned}, "scale": [3, 3, 3],
                "extensions": {{"KHR_lights_punctual": {{"light": 0}}}}}}],
        "cameras": [{{"type": "perspective", "perspective": {{"yfov": 0.002, "znear": 0.1}}}}],
        "materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [0.5, 0.5, 0.5, 1]}}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "material": 0, "mode": 5}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
            "min": [-10, 0, -10], "max": [10, 0, 10]}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}],
        "buffers": [{{"byteLength": 48, "uri": "square.bin"}}]}}"#
    )
}

#[test]
fn lights_of_a_gltf_file_give_what_candela_and_lux_say() {
    use std::f64::consts::PI;
    const DOWN: &str = "[-0.70710678, 0, 0, 0.70710678]";
    const UP: &str = "[0.70710678, 0, 0, 0.70710678]";
    // 30° from straight down.
    const ASLANT: &str = "[-0.5, 0, 0, 0.8660254]";
    let folder = tempfile::tempdir().unwrap();
    let corners = [
        [-10.0, 0.0, -10.0],
        [-10.0, 0.0, 10.0],
        [10.0, 0.0, -10.0],
        [10.0, 0.0, 10.0f32],
    ];
    let bytes: Vec<u8> = corners
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    fs::write(folder.path().join("square.bin"), bytes).unwrap();
    let path = folder.path().join("square.gltf");
    let describe = |text: &str, staging: &Staging| {
        fs::write(&path, text).unwrap();
        let options = description::Options::default();
        describe_mesh(&path, staging, &options, &Budget::default())
    };
    let seen_of = |text: &str, staging: Staging| {
        let mut bare = describe(text, &staging).unwrap();
        let overrides = Overrides {
            size: Some((4, 4)),
            spp: Some(16),
            ..Overrides::default()
        };
        overrides.apply(&mut bare.description);
        let mut session = Session::default();
        session.give(bare.mesh);
        let rendered = session.render(&bare.description, &Options::default(), &Silent);
        let rendered = rendered.unwrap();
        let told = rendered
            .warnings
            .iter()
            .map(|w| w.message.clone())
            .collect::<Vec<_>>();
        // To the first order, what changes over the view cancels in its mean.
        let image = rendered.image;
        let mean = |c: usize| {
            let pixels = image.data().chunks(image.channels().len());
            pixels.map(|pixel| f64::from(pixel[c])).sum::<f64>() / 16.0
        };
        ([0, 1, 2].map(mean), told)
    };
    let seen = |light: &str, turned: &str, lighting: Lighting| {
        let staging = Staging {
            lighting,
            finish: Finish::Clay,
            ..Staging::default()
        };
        seen_of(&lit_square(light, turned), staging)
    };
    // Radiance is illuminance · reflectance / π.
    let point = r#"{"type": "point", "intensity": 80, "color": [1, 0.5, 0]}"#;
    let sun = r#"{"type": "directional", "intensity": 6}"#;
    let spot = r#"{"type": "spot", "intensity": 80, "spot": {"innerConeAngle": 0.4, "outerConeAngle": 0.7}}"#;
    // Linear in the angle: 30° are 0.5236 rad.
    let faded = (0.7 - PI / 6.0) / (0.7 - 0.4);
    let on_axis = 80.0 / 4.0 * 0.5 / PI;
    for (light, turned, expected) in [
        (point, UP, [on_axis, 0.5 * on_axis, 0.0]),
        (sun, DOWN, [6.0 * 0.5 / PI; 3]),
        (sun, ASLANT, [6.0 * 0.75f64.sqrt() * 0.5 / PI; 3]),
        (sun, UP, [0.0; 3]),
        (spot, DOWN, [on_axis; 3]),
        (spot, ASLANT, [faded * on_axis; 3]),
        (spot, UP, [0.0; 3]),
    ] {
        let (found, _) = seen(light, turned, Lighting::Auto);
        for (found, expected) in found.iter().zip(expected) {
            let error = (found - expected).abs();
            assert!(
                error <= 1e-3 * expected,
                "{light} {turned}: {found}, {expected}"
            );
        }
    }
    let says = |told: &[String], what: &str| told.iter().any(|message| message.contains(what));
    let (_, told) = seen(spot, DOWN, Lighting::Auto);
    assert!(!says(&told, "light"), "{told:?}");
    let far = r#"{"type": "point", "intensity": 1e6, "range": 3}"#;
    let (_, told) = seen(far, DOWN, Lighting::Auto);
    assert!(
        says(&told, "--exposure auto") && says(&told, "beyond their range"),
        "{told:?}"
    );
    let (staged, told) = seen(point, DOWN, Lighting::Sky);
    assert!(says(&told, "own lights (1) are left out"), "{told:?}");
    assert_eq!(staged, seen(sun, DOWN, Lighting::Sky).0);
    // The file's own materials: metal or not, shining, see-through.
    let own = |light: &str, material: &str| {
        let staging = Staging {
            ground: false,
            ..Staging::default()
        };
        let text = lit_square(light, DOWN).replace("0.5, 0.5, 0.5, 1]}", material);
        seen_of(&text, staging).0
    };
    let lambert = 6.0 * 0.5 / PI;
    let [matte, ..] = own(sun, r#"0.5, 0.5, 0.5, 1], "metallicFactor": 0}"#);
    assert!((matte / lambert - 1.0).abs() < 1e-3, "{matte}, {lambert}");
    // A rough metal sends back D / 4 = 1 / 4π of its colour along the normal.
    let [metal, ..] = own(sun, "0.5, 0.5, 0.5, 1]}");
    assert!((metal / (0.25 * lambert) - 1.0).abs() < 0.01, "{metal}");
    let [blended, ..] = own(
        sun,
        r#"0.5, 0.5, 0.5, 0.25], "metallicFactor": 0}, "alphaMode": "BLEND""#,
    );
    assert!((blended / matte - 0.25).abs() < 0.01, "{blended}, {matte}");
    let dim = r#"{"type": "point", "intensity": 1e-9}"#;
    let shining = own(dim, r#"0, 0, 0, 1]}, "emissiveFactor": [0.5, 0.25, 1]"#);
    for (found, expected) in shining.into_iter().zip([0.5, 0.25, 1.0]) {
        assert!((found - expected).abs() < 1e-3, "{shining:?}");
    }
    for (wrong, message) in [
        (
            r#"{"type": "point", "intensity": -1}"#,
            "light 0: its intensity or its colour is negative",
        ),
        (
            r#"{"type": "spot", "spot": {"innerConeAngle": 2}}"#,
            "light 0: innerConeAngle 2",
        ),
        ("", "light 0 is out of range"),
        ("7", "KHR_lights_punctual is malformed"),
    ] {
        let error = describe(&lit_square(wrong, DOWN), &Staging::default()).unwrap_err();
        assert!(error.to_string().contains(message), "{error}");
    }
}

/// An image of four quarters: red and green above, blue and white below; what is red is half transparent.
fn quarters() -> Vec<u8> {
    let at = |x: u32, y: u32| match (x < 8, y < 8) {
        (true, true) => image::Rgba([255, 0, 0, 100]),
        (false, true) => image::Rgba([0, 255, 0, 255]),
        (true, false) => image::Rgba([0, 0, 255, 255]),
        (false, false) => image::Rgba([255; 4]),
    };
    let mut png = std::io::Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_fn(16, 16, at);
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

/// A GLB file of a square in the plane of x and y, with this image and material.
fn square_glb(png: &[u8], material: &str) -> Vec<u8> {
    let corners = [
        [-1.0, -1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0f32],
    ];
    let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0f32]];
    let mut binary: Vec<u8> = Vec::new();
    let numbers = corners.concat().into_iter().chain(uvs.concat());
    binary.extend(numbers.flat_map(f32::to_le_bytes));
    binary.extend([0, 1, 2, 0, 2, 3, 0, 0]);
    binary.extend(png);
    let length = png.len();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":0}}]}}],
        "materials":[{material}],"textures":[{{"source":0}}],"images":[{{"bufferView":3,"mimeType":"image/png"}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-1,-1,0],"max":[1,1,0]}},
            {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
            {{"bufferView":2,"componentType":5121,"count":6,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}},
            {{"buffer":0,"byteOffset":80,"byteLength":6}},{{"buffer":0,"byteOffset":88,"byteLength":{length}}}],
        "buffers":[{{"byteLength":{}}}]}}"#,
        binary.len()
    );
    let chunk = |kind: &[u8; 4], data: &[u8], filler: u8| {
        let mut data = data.to_vec();
        data.resize(data.len().next_multiple_of(4), filler);
        [&(data.len() as u32).to_le_bytes()[..], kind, &data].concat()
    };
    let chunks = [
        chunk(b"JSON", json.as_bytes(), b' '),
        chunk(b"BIN\0", &binary, 0),
    ]
    .concat();
    let length = (12 + chunks.len() as u32).to_le_bytes();
    [b"glTF\x02\0\0\0", &length[..], &chunks].concat()
}

/// The colours in the middle of the quarters of a bare file's picture from the front, row by row from the top.
fn seen_quarters(path: &Path) -> ([[f32; 4]; 4], Vec<String>) {
    let staging = Staging {
        azimuth: Some(0.0),
        elevation: Some(0.0),
        lighting: Lighting::Sky,
        background: etendue::render::Background::Transparent,
        size: [32, 32],
        ..Staging::default()
    };
    let options = description::Options::default();
    let mut bare = describe_mesh(path, &staging, &options, &Budget::default()).unwrap();
    let overrides = Overrides {
        size: Some((32, 32)),
        spp: Some(64),
        ..Overrides::default()
    };
    overrides.apply(&mut bare.description);
    let mut session = Session::default();
    session.give(bare.mesh);
    let rendered = (session.render(&bare.description, &Options::default(), &Silent)).unwrap();
    let told = rendered.warnings.iter().map(|w| w.message.clone());
    let of = |x, y| {
        let pixel = rendered.image.pixel(x, y);
        [0, 1, 2, 3].map(|c| pixel[c])
    };
    (
        [of(10, 10), of(21, 10), of(10, 21), of(21, 21)],
        told.collect(),
    )
}

#[test]
fn images_of_gltf_obj_and_ply_files_stand_upright_and_are_as_bright_as_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let png = quarters();
    fs::write(path("the image.png"), &png).unwrap();
    let matte = r#""metallicFactor":0,"baseColorTexture":{"index":0}"#;
    let made = |more: &str, after: &str| {
        square_glb(
            &png,
            &format!(r#"{{"pbrMetallicRoughness":{{{matte}{more}}}{after}}}"#),
        )
    };
    fs::write(path("plain.glb"), made("", "")).unwrap();
    let half = r#","baseColorFactor":[0.5,0.5,0.5,1]"#;
    fs::write(path("factor.glb"), made(half, "")).unwrap();
    fs::write(path("cut.glb"), made("", r#","alphaMode":"MASK""#)).unwrap();
    fs::write(path("blend.glb"), made("", r#","alphaMode":"BLEND""#)).unwrap();
    let obj = "mtllib m.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
        usemtl a\nf 1/1 2/2 3/3 4/4\n";
    fs::write(path("plain.obj"), obj).unwrap();
    fs::write(
        path("m.mtl"),
        "newmtl a\nKd 1 1 1\nmap_Kd -s 1 1 1 the image.png\n",
    )
    .unwrap();
    let ply = "ply\nformat ascii 1.0\ncomment TextureFile the image.png\nelement vertex 4\n\
        property float x\nproperty float y\nproperty float z\nproperty float s\nproperty float t\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n\
        -1 -1 0 0 0\n1 -1 0 1 0\n1 1 0 1 1\n-1 1 0 0 1\n4 0 1 2 3\n";
    fs::write(path("plain.ply"), ply).unwrap();
    // Under a sky of this radiance what is white and convex has it too.
    let sky = [0.9, 0.95, 1.0];
    for (name, factor, red) in [
        ("plain.glb", 1.0, 1.0),
        ("factor.glb", 0.5, 1.0),
        ("plain.obj", 1.0, 1.0),
        ("plain.ply", 1.0, 1.0),
        ("cut.glb", 1.0, 0.0),
        ("blend.glb", 1.0, 100.0 / 255.0),
    ] {
        let (found, told) = seen_quarters(&path(name));
        assert!(told.is_empty(), "{name}: {told:?}");
        let colors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]];
        for (quarter, (found, color)) in found.iter().zip(colors).enumerate() {
            let alpha = if quarter == 0 { red } else { 1.0 };
            let part = |c: usize| alpha * factor * sky[c] * color[c];
            let expected = [part(0), part(1), part(2), alpha];
            // What is let through by chance is not seen evenly.
            let tolerance = if 0.0 < alpha && alpha < 1.0 {
                0.2
            } else {
                0.02
            };
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < tolerance,
                    "{name} {quarter}: {found} {expected}"
                );
            }
        }
    }
    // An image that is lost is told of.
    fs::remove_file(path("the image.png")).unwrap();
    let (found, told) = seen_quarters(&path("plain.obj"));
    assert!(
        told.len() == 1 && told[0].contains("the image.png is not shown"),
        "{told:?}"
    );
    assert!(found[0][1] > 0.5, "white without its image: {found:?}");
}
