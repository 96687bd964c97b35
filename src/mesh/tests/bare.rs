//! What is read of a file that is all there is, and what of one that is a scene's shape.

use super::*;
use crate::budget::Budget;

fn bare(name: &str, bytes: &[u8]) -> Loaded {
    decode(name, bytes, &ReadOptions::BARE).unwrap_or_else(|e| panic!("{e}"))
}

fn in_scene(name: &str, bytes: &[u8]) -> Loaded {
    decode(name, bytes, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn said(loaded: &Loaded) -> Vec<String> {
    loaded.warnings.iter().map(ToString::to_string).collect()
}

/// A triangle with colours of such a type and name, as text or in binary.
fn colored_ply(kind: &str, names: [&str; 4], encoding: &str) -> Vec<u8> {
    let mut ply = format!(
        "ply\nformat {encoding} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    );
    for name in names.iter().filter(|name| !name.is_empty()) {
        ply.push_str(&format!("property {kind} {name}\n"));
    }
    ply.push_str("element face 1\nproperty list uchar int vertex_indices\nend_header\n");
    let colors = match kind {
        "uchar" | "int" => [0.0, 51.0, 255.0, 255.0],
        "ushort" => [0.0, 13107.0, 65535.0, 65535.0],
        _ => [0.0, 0.2, 1.0, 1.0],
    };
    let count = names.iter().filter(|name| !name.is_empty()).count();
    if encoding == "ascii" {
        for place in ["0 0 0", "1 0 0", "0 1 0"] {
            let colors: Vec<String> = colors[..count].iter().map(f64::to_string).collect();
            ply.push_str(&format!("{place} {}\n", colors.join(" ")));
        }
        ply.push_str("3 0 1 2\n");
        return ply.into_bytes();
    }
    let mut bytes = ply.into_bytes();
    for place in [Vec3::ZERO, Vec3::X, Vec3::Y] {
        bytes.extend(place.to_array().map(f32::to_be_bytes).as_flattened());
        for color in &colors[..count] {
            match kind {
                "uchar" => bytes.push(*color as u8),
                "ushort" => bytes.extend((*color as u16).to_be_bytes()),
                "int" => bytes.extend((*color as i32).to_be_bytes()),
                "double" => bytes.extend(color.to_be_bytes()),
                _ => bytes.extend((*color as f32).to_be_bytes()),
            }
        }
    }
    bytes.push(3);
    bytes.extend([0_i32, 1, 2].map(i32::to_be_bytes).as_flattened());
    bytes
}

#[test]
fn colours_of_a_bare_mesh_are_between_0_and_1_whatever_their_type() {
    for encoding in ["ascii", "binary_big_endian"] {
        for kind in ["uchar", "ushort", "float", "double", "int"] {
            for names in [
                ["red", "green", "blue", ""],
                ["r", "g", "b", "a"],
                ["Red", "Green", "Blue", "Alpha"],
                ["diffuse_red", "diffuse_green", "diffuse_blue", ""],
            ] {
                let loaded = bare("a.ply", &colored_ply(kind, names, encoding));
                let color = &loaded.mesh.attributes[0];
                assert_eq!(color.name, "vertex_color");
                assert_eq!(color.row(2)[..3], [0.0, 0.2, 1.0], "{kind} {names:?}");
                assert!(color.row(1)[3..].iter().all(|a| *a == 1.0));
                // In 32 bits they are bytes by the look of them.
                assert_eq!(loaded.warnings.len(), usize::from(kind == "int"), "{kind}");
            }
        }
    }
    let scene = in_scene(
        "a.ply",
        &colored_ply("uchar", ["red", "green", "blue", ""], "ascii"),
    );
    assert_eq!(scene.mesh.attributes[0].row(0), [0.0, 51.0, 255.0]);
    assert!(said(&scene)[0].contains("taken as they stand"));
}

#[test]
fn colours_behind_the_vertices_of_an_obj_file_are_those_of_a_bare_mesh() {
    let obj = "v 1 1 1\nv 0 0 0 1 0.5 0.25\nv 1 0 0 0 1 0 # green\nv 0 1 0 0 0 1 0.5\nv 0 0 1\nf 4 3 2\nf 2 3 5\n";
    let loaded = bare("a.obj", obj.as_bytes());
    let color = &loaded.mesh.attributes[0];
    assert_eq!(
        (color.name.as_str(), color.channels, color.per),
        ("vertex_color", 3, Per::Vertex)
    );
    let wanted = [
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.5, 0.25],
        BARE_COLOR,
    ];
    assert_eq!(color.values, wanted.concat());
    assert!(loaded.warnings.is_empty());
    // As bytes, in many pieces.
    let lines = (0..20_000).map(|i| format!("v {i} 0 1 {} 51 255\n", i % 2 * 255));
    let many: String = lines.chain(["f 1 2 20000\n".to_owned()]).collect();
    let loaded = bare("a.obj", many.as_bytes());
    let wanted = [[0.0, 0.2, 1.0], [1.0, 0.2, 1.0], [1.0, 0.2, 1.0]];
    assert_eq!(loaded.mesh.attributes[0].values, wanted.concat());
    assert!(said(&loaded)[0].contains("divided by 255"));

    let scene = in_scene("a.obj", obj.as_bytes());
    assert!(scene.mesh.attributes.is_empty());
    let said = said(&scene);
    assert!(
        said.len() == 1 && said[0].contains("colours of vertices"),
        "{said:?}"
    );
    // A weight is no colour, nor are two numbers.
    for text in [
        "v 0 0 0 1\nv 1 0 0 0.5\nv 0 1 0 1\nf 1 2 3\n",
        "v 0 0 0 1 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    ] {
        let loaded = bare("a.obj", text.as_bytes());
        assert!(loaded.mesh.attributes.is_empty() && loaded.warnings.is_empty());
    }
}

#[test]
fn what_is_left_out_is_said_once() {
    let ply = "ply\nformat ascii 1.0\ncomment TextureFile skin.png\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
        element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n0 0 0\n1 0 0\n0 1 0\n\
        3 0 1 2 6 0 0 1 0 1 1\n0 1\n";
    let said_of = |loaded: Loaded| said(&loaded).join("; ");
    let scene = said_of(in_scene("a.ply", ply.as_bytes()));
    assert_eq!(scene.matches("a.ply").count(), 2, "{scene}");
    assert!(
        scene.contains("\"texcoord\"") && scene.contains("\"edge\""),
        "{scene}"
    );
    let bare_one = said_of(bare("a.ply", ply.as_bytes()));
    assert!(
        !bare_one.contains("texcoord") && bare_one.contains("\"edge\""),
        "{bare_one}"
    );
    let without = ply
        .replace("property list uchar float texcoord\n", "")
        .replace(" 6 0 0 1 0 1 1", "");
    let bare_one = said_of(bare("a.ply", without.as_bytes()));
    assert!(bare_one.contains("\"skin.png\" is not shown"), "{bare_one}");
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\np 1\nl 2 3\nsurf 0 1 0 1 1 2 3\n";
    let of_obj = said_of(bare("a.obj", obj.as_bytes()));
    assert!(
        of_obj.contains("3 lines and points") && of_obj.contains("1 curves"),
        "{of_obj}"
    );
}

#[test]
fn concave_polygons_are_covered_as_they_are_in_a_bare_mesh_and_fans_in_a_scene() {
    let e = [
        "3 0 0", "3 0 -1", "1 0 -1", "1 0 -2", "3 0 -2", "3 0 -3", "0 0 -3", "0 0 0",
    ];
    let mut wrong = 0;
    for first in 0..8 {
        let corners: Vec<&str> = e[first..].iter().chain(&e[..first]).copied().collect();
        let places = |before: &str| {
            corners
                .iter()
                .map(|c| format!("{before}{c}\n"))
                .collect::<String>()
        };
        let obj = format!("{}f 1 2 3 4 5 6 7 8\n", places("v "));
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list uchar int vertex_index\nend_header\n{}8 0 1 2 3 4 5 6 7\n",
            places("")
        );
        for (name, text) in [("e.obj", obj), ("e.ply", ply)] {
            let loaded = bare(name, text.as_bytes());
            assert!((loaded.mesh.area() - 7.0).abs() < 1e-6, "{name} {first}");
            assert_eq!((loaded.mesh.triangles.len(), loaded.warnings.len()), (6, 0));
            let scene = in_scene(name, text.as_bytes());
            // Mitsuba's.
            let fan: Vec<[u32; 3]> = (2..8).map(|i| [0, i - 1, i]).collect();
            assert_eq!(scene.mesh.triangles, fan);
            let is_wrong = (scene.mesh.area() - 7.0).abs() > 0.1;
            assert_eq!(
                said(&scene).iter().any(|w| w.contains("1 concave")),
                is_wrong
            );
            wrong += usize::from(is_wrong);
        }
    }
    assert!(wrong > 4, "{wrong}");
}

/// A hilly square of 300 triangles around a place of the earth, as numbers.
fn hills(at: DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let places = (0..13 * 13).map(|i| {
        let (x, y) = (f64::from(i % 13) * 0.1, f64::from(i / 13) * 0.1);
        at + DVec3::new(x, y, 0.3 * (3.0 * x).sin() * (2.0 * y).cos())
    });
    let cell = |i: u32| i / 12 * 13 + i % 12;
    let cells = (0..144).map(cell);
    let triangles = cells.flat_map(|i| [[i, i + 1, i + 14], [i, i + 14, i + 13]]);
    (places.collect(), triangles.collect())
}

#[test]
fn a_bare_mesh_far_from_the_origin_is_read_as_finely_as_one_near_it() {
    let text = |at: DVec3| -> [(&str, Vec<u8>); 5] {
        let (places, triangles) = hills(at);
        let all = |rows: &mut dyn Iterator<Item = String>| rows.collect::<String>();
        let row = |p: &DVec3| format!("{} {} {}\n", p.x, p.y, p.z);
        let obj = all(&mut places.iter().map(|p| format!("v {}", row(p))))
            + &all(&mut triangles
                .iter()
                .map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1)));
        let header = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
             element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            places.len(),
            triangles.len()
        );
        let ascii = header.clone()
            + &all(&mut places.iter().map(row))
            + &all(&mut triangles
                .iter()
                .map(|t| format!("3 {} {} {}\n", t[0], t[1], t[2])));
        let mut binary = header.replace("ascii", "binary_little_endian").into_bytes();
        binary.extend(
            places
                .iter()
                .flat_map(|p| p.to_array())
                .flat_map(f64::to_le_bytes),
        );
        for t in &triangles {
            binary.push(3);
            binary.extend(t.map(u32::to_le_bytes).as_flattened());
        }
        let facet = |t: &[u32; 3]| {
            let corners = t.map(|i| format!("vertex {}", row(&places[i as usize])));
            format!(
                "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n",
                corners.concat()
            )
        };
        let stl = format!("solid\n{}endsolid\n", all(&mut triangles.iter().map(facet)));
        [
            ("a.obj", obj.into_bytes()),
            ("a.ply", ascii.into_bytes()),
            ("b.ply", binary),
            ("a.stl", stl.into_bytes()),
            ("a.serialized", doubles(&places, &triangles)),
        ]
    };
    let near = bare("a.obj", &text(DVec3::ZERO)[0].1);
    let area = near.mesh.area();
    assert!(near.warnings.is_empty());
    for at in [
        DVec3::new(412_345.25, 5_543_211.0, 231.5),
        DVec3::new(-3_957_314.62, 3_310_254.13, 3_737_540.47),
        DVec3::new(0.0, 0.0, 6_378_137.0),
    ] {
        for (name, bytes) in text(at) {
            let loaded = bare(name, &bytes);
            assert!(
                (loaded.mesh.area() / area - 1.0).abs() < 1e-5,
                "{name} {at}: {}",
                loaded.mesh.area()
            );
            assert_eq!(loaded.mesh.triangles.len(), 288);
            let said = said(&loaded);
            assert!(
                said.len() == 1 && said[0].contains("is subtracted"),
                "{said:?}"
            );
            let (low, high) = loaded.mesh.bounds().unwrap();
            assert!(low.abs().max(high.abs()).max_element() < 300.0);

            let scene = in_scene(name, &bytes);
            let (low, _) = scene.mesh.bounds().unwrap();
            assert!(low.as_dvec3().distance(at) < 2.0);
            let said: Vec<String> = scene.warnings.iter().map(ToString::to_string).collect();
            assert!(
                said.len() == 1 && said[0].contains("far from the origin"),
                "{said:?}"
            );
        }
    }
}

/// A `serialized` file in double precision.
fn doubles(places: &[DVec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut body = 0x2000_u32.to_le_bytes().to_vec();
    body.extend((places.len() as u64).to_le_bytes());
    body.extend((triangles.len() as u64).to_le_bytes());
    body.extend(
        places
            .iter()
            .flat_map(|p| p.to_array())
            .flat_map(f64::to_le_bytes),
    );
    body.extend(triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
    let mut encoder =
        flate2::write::ZlibEncoder::new(vec![0x1c, 0x04, 3, 0], flate2::Compression::fast());
    encoder.write_all(&body).unwrap();
    let mut file = encoder.finish().unwrap();
    file.extend([0, 0, 0, 0, 1, 0, 0, 0]);
    file
}

#[test]
fn the_parts_of_a_mesh_far_from_the_origin_stay_together() {
    let (places, triangles) = hills(DVec3::new(412_345.25, 5_543_211.0, 231.5));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.obj");
    let mut text: String = places
        .iter()
        .map(|p| format!("v {} {} {}\n", p.x, p.y, p.z))
        .collect();
    for (i, t) in triangles.iter().enumerate() {
        if i % 200 == 0 {
            text.push_str(&format!("o part{i}\n"));
        }
        text.push_str(&format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    }
    std::fs::write(&path, text).unwrap();
    let parts = read_parts(&path, &Budget::default()).unwrap();
    assert_eq!((parts.parts.len(), parts.warnings.len()), (2, 1));
    let (low, high) = parts.merged().bounds().unwrap();
    assert!(
        (high - low).distance(Vec3::new(1.2, 1.2, 0.6)) < 0.1,
        "{low} {high}"
    );
}

#[test]
fn the_shared_faults_are_mended() {
    let Some(data) = data() else { return };
    let faults = data.join("faults");
    let area = |name: &str| {
        read_parts(&faults.join(name), &Budget::default())
            .unwrap()
            .merged()
            .area()
    };
    for (name, wanted) in [
        ("byte-order-mark/a14_bom.obj", 30.872175),
        ("byte-order-mark/g2_loose_bom.obj", 12.944272),
        ("byte-order-mark/g2_nm.obj", 12.944272),
        ("carriage-returns/a14_cr.obj", 30.872175),
        ("carriage-returns/a3_cr_ascii.ply", 30.872175),
        ("stl-keywords/a7_upper.stl", 30.872175),
        ("stl-keywords/a7_lower.stl", 30.872175),
        ("stl-keywords/a7_endsolid_two.stl", 30.872175),
        ("concave-polygons/a6_concave.ply", 7.0),
        ("concave-polygons/a6_concave_0.obj", 7.0),
        ("concave-polygons/a6_concave_2.obj", 7.0),
        ("large-coordinates/g3_local.ply.gz", 252.498_8),
        ("large-coordinates/g3_utm.ply.gz", 252.498_8),
    ] {
        let found = area(name);
        assert!((found / wanted - 1.0).abs() < 1e-4, "{name}: {found}");
    }
    for name in [
        "bare-integer-colours/a1_open3d.ply",
        "bare-integer-colours/a1_uchar_rgba.ply",
        "bare-colours-dropped/a11_vcolor.obj",
    ] {
        let mesh = read_parts(&faults.join(name), &Budget::default())
            .unwrap()
            .merged();
        let [r, g, b] = mesh.attributes[0].row(0)[..3] else {
            panic!()
        };
        for (found, wanted) in [(r, 200.0), (g, 40.0), (b, 40.0)] {
            assert!((found - wanted / 255.0_f32).abs() < 1e-5, "{name}");
        }
    }
    for name in ["carriage-returns/k6_mtl.obj", "byte-order-mark/g2_nm.obj"] {
        let parts = read_parts(&faults.join(name), &Budget::default()).unwrap();
        assert!(parts.warnings.is_empty());
        assert_eq!(
            parts.merged().attributes[0].row(0),
            [0.8, 0.1, 0.1],
            "{name}"
        );
    }
    for name in [
        "silently-left-out/meshlab-wedge.ply",
        "bare-colours-dropped/a4_wedge.ply",
    ] {
        let of =
            |options: ReadOptions| read(&faults.join(name), &options, &Budget::default()).unwrap();
        let as_shape = of(ReadOptions::default());
        let told = as_shape.warnings.iter().map(ToString::to_string);
        assert!(
            told.into_iter().any(|w: String| w.contains("texcoord")),
            "{name}"
        );
        let bare = of(ReadOptions::BARE);
        assert!(bare.warnings.is_empty(), "{name}: {:?}", bare.warnings);
        assert_eq!(bare.mesh.uvs.len(), bare.mesh.positions.len(), "{name}");
    }
}

/// As MeshLab writes it: texture coordinates of corners, and two images.
#[test]
fn corners_of_ply_faces_have_texture_coordinates_of_their_own() {
    let ply = "ply\nformat ascii 1.0\ncomment TextureFile one.png\ncomment TextureFile two.png\nelement vertex 4\n\
        property float x\nproperty float y\nproperty float z\nproperty float quality_0\nelement face 3\n\
        property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\nend_header\n\
        0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 0 4\n\
        3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0 0 0.5 0.5 0 1 1\n3 0 2 3 6 0 0 0.5 0.5 0 1 -1\n";
    let loaded = decode("there/a.ply", ply.as_bytes(), &ReadOptions::BARE).unwrap();
    let mesh = &loaded.mesh;
    // Corner 2 differs between the first two faces, and is shared by the last two.
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 4, 3], [0, 4, 3]]);
    let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]];
    assert_eq!(mesh.uvs, uvs.map(Vec2::from_array));
    assert_eq!(mesh.positions[4], mesh.positions[2]);
    assert_eq!(mesh.normals, [Vec3::Z; 5]);
    let quality = mesh.attributes.iter().find(|a| a.name == "vertex_quality");
    assert_eq!(quality.unwrap().values, [1.0, 2.0, 3.0, 4.0, 3.0]);
    let images = loaded.surfaces.iter().map(|s| s.maps.color.as_ref());
    let names: Vec<_> = images
        .map(|image| Some(image?.path.file_name()?.to_owned()))
        .collect();
    assert_eq!(
        names,
        [Some("one.png".into()), Some("two.png".into()), None]
    );
    assert_eq!(loaded.of_surface(1).unwrap().uvs[1], Vec2::new(0.5, 0.5));
    assert!(loaded.warnings.is_empty());
    let short = ply.replace("6 0 0 1 0 1 1 0", "4 0 0 1 0 0");
    let loaded = decode("a.ply", short.as_bytes(), &ReadOptions::BARE).unwrap();
    assert!(
        loaded.warnings[0]
            .to_string()
            .contains("1 faces have not two texture coordinates a corner")
    );
}
