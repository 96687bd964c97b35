//! Text is understood alike whatever its line ends, its byte-order mark and the case of its keywords.

use super::*;
use crate::budget::Budget;

/// The same text as other programs write it.
fn variants(text: &[u8]) -> Vec<Vec<u8>> {
    let text = str::from_utf8(text).unwrap();
    let mixed = |text: &str| {
        let ends = ["\r\n", "\n", "\r"].into_iter().cycle();
        let lines = text.split_terminator('\n').zip(ends);
        lines.map(|(line, end)| format!("{line}{end}")).collect()
    };
    let texts: [String; 7] = [
        text.replace('\n', "\r\n"),
        text.replace('\n', "\r"),
        mixed(text),
        text.replace(' ', "\t"),
        text.replace('\n', " \n"),
        text.to_uppercase(),
        text.trim_end().to_owned(),
    ];
    let texts = texts.into_iter().chain([text.to_owned()]);
    texts
        .flat_map(|text| [format!("\u{feff}{text}").into_bytes(), text.into_bytes()])
        .collect()
}

#[test]
fn line_ends_marks_and_case_do_not_change_a_mesh() {
    let mut cube = cube();
    for uv in &mut cube.uvs {
        *uv *= 0.5;
    }
    // What Mitsuba tells apart by case has a name of its own in this one.
    let ply = String::from_utf8(ply_text(&cube)).unwrap();
    let ply = ply.replace("w_0", "W_0").replace("heat_0", "HEAT_0");
    for (name, text) in [
        ("cube.ply", ply.into_bytes()),
        ("cube.obj", obj_text(&cube)),
        ("cube.stl", stl_text(&cube)),
    ] {
        let options = ReadOptions::default();
        let wanted = decode(name, &text, &options).unwrap();
        assert!(wanted.mesh.triangles.len() == 12 && wanted.warnings.is_empty());
        for variant in variants(&text) {
            let read = decode(name, &variant, &options);
            let shown = String::from_utf8_lossy(&variant[..60]);
            let read = read.unwrap_or_else(|e| panic!("{name} {shown:?}: {e}"));
            assert_eq!(read.mesh, wanted.mesh, "{name} {shown:?}");
            assert!(read.warnings.is_empty(), "{name}: {:?}", read.warnings);
        }
    }
}

#[test]
fn lines_are_counted_whatever_ends_them() {
    for (name, text, place) in [
        ("a.obj", "v 0 0 0\nv 1 0\n", ":2: "),
        ("a.stl", "solid a\n facet\nvertex 0 0\n", ":3: "),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex x\n", ":3: "),
        (
            "b.ply",
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
             element face 0\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 one 1\n",
            ":11: ",
        ),
    ] {
        for end in ["\n", "\r\n", "\r"] {
            let text = text.replace('\n', end);
            let error = decode(name, text.as_bytes(), &ReadOptions::default()).unwrap_err();
            assert!(error.to_string().contains(place), "{error} {end:?}");
        }
    }
}

#[test]
fn binary_data_begins_right_behind_a_header_of_any_line_ends() {
    // Its first byte is that of a line feed.
    let x = f32::from_le_bytes([b'\n', b'\r', b'\n', 0x3f]);
    let mut mesh = cube();
    (mesh.normals, mesh.uvs) = (Vec::new(), Vec::new());
    mesh.positions[0].x = x;
    let bytes = ply_little_endian(&mesh);
    let end = b"end_header\r\n";
    let at = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let (header, data) = bytes.split_at(at);
    let header = str::from_utf8(header).unwrap();
    for end in ["\n", "\r\n", "\r"] {
        for mark in ["", "\u{feff}"] {
            let mut bytes = format!("{mark}{}", header.replace("\r\n", end)).into_bytes();
            bytes.extend(data);
            let read = decode("cube.ply", &bytes, &ReadOptions::default()).unwrap();
            assert_eq!(read.mesh, mesh, "{end:?}");
        }
    }
}

#[test]
fn materials_and_objects_are_found_whatever_ends_their_lines() {
    let obj =
        "mtllib a.mtl\no one\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no two\nf 3 2 1\n";
    let mtl = "newmtl red\nKd 0.8 0.1 0.1\n";
    for end in ["\n", "\r\n", "\r"] {
        for mark in ["", "\u{feff}"] {
            for upper in [false, true] {
                let text = |text: &str| {
                    let text = if upper {
                        text.to_uppercase()
                    } else {
                        text.to_owned()
                    };
                    format!("{mark}{}", text.replace('\n', end))
                };
                let folder = tempfile::tempdir().unwrap();
                let path = folder.path().join("a.obj");
                std::fs::write(&path, text(obj)).unwrap();
                let library = if upper { "A.MTL" } else { "a.mtl" };
                std::fs::write(folder.path().join(library), text(mtl)).unwrap();
                let read = read_parts(&path, &Budget::default()).unwrap();
                assert!(read.warnings.is_empty(), "{:?}", read.warnings);
                assert_eq!(read.parts.len(), 2);
                for part in read.parts {
                    assert_eq!(part.mesh.attributes[0].values, [0.8, 0.1, 0.1]);
                }
            }
        }
    }
}

#[test]
fn what_parts_lose_of_a_material_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(
        &path,
        "mtllib a.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n",
    )
    .unwrap();
    for (material, told) in [
        ("Kd 1 0 0", 0),
        ("Kd 1 0 0\nmap_Kd a.png", 1),
        ("Ke 1 0 0", 1),
    ] {
        std::fs::write(
            folder.path().join("a.mtl"),
            format!("newmtl red\n{material}\n"),
        )
        .unwrap();
        let read = read_parts(&path, &Budget::default()).unwrap();
        let alone = |problem: &&crate::error::Problem| {
            problem.to_string().contains("by their colours alone")
        };
        assert_eq!(
            read.warnings.iter().filter(alone).count(),
            told,
            "{material}: {:?}",
            read.warnings
        );
    }
}

#[test]
fn an_stl_file_may_hold_several_solids_and_its_colours_are_said_to_be_left_out() {
    let one = String::from_utf8(stl_text(&cube())).unwrap();
    let other = one.replace("endsolid", "end solid");
    let other = other
        .replace("endloop", "end loop")
        .replace("endfacet", "end facet");
    let read = |bytes: &[u8]| decode("a.stl", bytes, &ReadOptions::default()).unwrap();
    let both = read(format!("{one}{other}").as_bytes());
    assert_eq!((both.mesh.triangles.len(), both.warnings.len()), (24, 0));

    let mut bytes = stl_binary(&cube());
    assert_eq!(read(&bytes).warnings.len(), 0);
    let at = bytes.len() - 1;
    bytes[at] = 0x80;
    let said = read(&bytes).warnings[0].to_string();
    assert!(said.contains("1 triangles have attribute bytes"), "{said}");
}
