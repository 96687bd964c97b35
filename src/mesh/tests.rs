//! Tests over all formats: every file of the shared data against its known counts, malformed files, and
//! mutations of valid ones.

mod bare;
mod text;

use std::fmt::Write;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::read::testing::decode;
use super::*;
use crate::budget::Budget;

/// The shared data, or `None` (said on stderr) where it is absent.
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn data() -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let there = path.is_dir();
    if !there {
        eprintln!("skipped: {} is absent", path.display());
    }
    there.then(|| path.to_owned())
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(files_below(&path));
        } else {
            files.push(path);
        }
    }
    files.sort();
    files
}

fn load(path: &Path) -> Loaded {
    read(path, &ReadOptions::default(), &Budget::default()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn known_meshes_have_their_known_counts() {
    let Some(data) = data() else { return };
    for (name, vertices, triangles) in [
        ("meshes/dragon.ply", 437_645, 871_414),
        ("meshes/crown.ply", 1_868_139, 3_540_214),
        ("meshes/cortex.ply", 304_380, 608_752),
        ("meshes/motorbike.ply", 132_871, 331_653),
        ("meshes/elephant.ply", 44_460, 88_928),
        ("meshes/stanford-bunny.obj", 34_834, 69_451),
        ("meshes/nefertiti.obj", 49_971, 99_938),
        ("mitsuba-data/tests/ply/cbox_smallbox.ply", 24, 12),
        ("mitsuba-data/common/meshes/teapot.ply", 1177, 2256),
    ] {
        let loaded = load(&data.join(name));
        let mesh = loaded.mesh;
        assert_eq!(
            (mesh.positions.len(), mesh.triangles.len()),
            (vertices, triangles),
            "{name}"
        );
        assert_eq!(loaded.dropped_triangles, 0);
    }
}

#[test]
fn every_shared_mesh_loads_without_a_dropped_triangle() {
    let Some(data) = data() else { return };
    let mut count = 0;
    for path in files_below(&data) {
        let extension = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if !FORMATS
            .iter()
            .any(|f| f.extensions.contains(&extension.as_str()))
            // Nothing here decodes it.
            || path.to_string_lossy().contains("draco")
        {
            continue;
        }
        let loaded = load(&path);
        assert_eq!(loaded.dropped_triangles, 0, "{}", path.display());
        let mesh = loaded.mesh;
        let n = mesh.positions.len();
        assert!(
            !mesh.triangles.is_empty() && mesh.area() > 0.0,
            "{}",
            path.display()
        );
        assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < n));
        count += 1;
    }
    assert!(count > 150, "{count}");
}

/// A valid file of a format, made from `mesh` with normals and texture coordinates.
struct Sample {
    name: &'static str,
    bytes: Vec<u8>,
}

fn ply_header(format: &str, mesh: &Mesh) -> String {
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    format!(
        "ply\nformat {format} 1.0\ncomment a test\nelement vertex {vertices}\nproperty float x\n\
         property float y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float nz\n\
         property float u\nproperty float v\nproperty uchar w_0\nelement face {faces}\n\
         property list uchar int vertex_indices\nproperty float heat_0\nend_header\n"
    )
}

fn ply_text(mesh: &Mesh) -> Vec<u8> {
    let mut text = ply_header("ascii", mesh);
    for ((p, n), uv) in mesh.positions.iter().zip(&mesh.normals).zip(&mesh.uvs) {
        writeln!(
            text,
            "{} {} {} {} {} {} {} {} 7",
            p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y
        )
        .unwrap();
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "3 {a} {b} {c} 0.5").unwrap();
    }
    text.into_bytes()
}

fn ply_big_endian(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = ply_header("binary_big_endian", mesh).into_bytes();
    for ((p, n), uv) in mesh.positions.iter().zip(&mesh.normals).zip(&mesh.uvs) {
        bytes.extend([p.x, p.y].map(f32::to_be_bytes).as_flattened());
        bytes.extend(f64::from(p.z).to_be_bytes());
        bytes.extend(
            [n.x, n.y, n.z, uv.x, uv.y]
                .map(f32::to_be_bytes)
                .as_flattened(),
        );
        bytes.push(7);
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        bytes.extend(triangle.map(u32::to_be_bytes).as_flattened());
        bytes.extend(0.5_f32.to_be_bytes());
    }
    bytes
}

/// The common layout, without normals and texture coordinates.
fn ply_little_endian(mesh: &Mesh) -> Vec<u8> {
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    let header = format!(
        "ply\r\nformat binary_little_endian 1.0\r\nelement vertex {vertices}\r\nproperty float x\r\n\
         property float y\r\nproperty float z\r\nelement face {faces}\r\n\
         property list uchar uint vertex_index\r\nend_header\r\n"
    );
    let mut bytes = header.into_bytes();
    for p in &mesh.positions {
        bytes.extend(p.to_array().map(f32::to_le_bytes).as_flattened());
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        bytes.extend(triangle.map(u32::to_le_bytes).as_flattened());
    }
    bytes
}

fn obj_text(mesh: &Mesh) -> Vec<u8> {
    let mut text = "# a test\no cube\n".to_owned();
    for ((p, n), uv) in mesh.positions.iter().zip(&mesh.normals).zip(&mesh.uvs) {
        writeln!(
            text,
            "v {} {} {}\nvt {} {}\nvn {} {} {}",
            p.x,
            p.y,
            p.z,
            uv.x,
            1.0 - uv.y,
            n.x,
            n.y,
            n.z
        )
        .unwrap();
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| i + 1);
        writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}").unwrap();
    }
    text.into_bytes()
}

/// A file of two meshes: a triangle, and `mesh`.
fn serialized(mesh: &Mesh, version: u16) -> Vec<u8> {
    let mut file = Vec::new();
    let mut offsets = Vec::new();
    let triangle = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    for mesh in [&triangle, mesh] {
        let full = !mesh.normals.is_empty();
        let mut body = if full { 0x1003_u32 } else { 0x2000 }
            .to_le_bytes()
            .to_vec();
        if version == 4 {
            body.extend(b"name\0");
        }
        body.extend((mesh.positions.len() as u64).to_le_bytes());
        body.extend((mesh.triangles.len() as u64).to_le_bytes());
        for p in mesh.positions.iter().chain(&mesh.normals) {
            if full {
                body.extend(p.to_array().map(f32::to_le_bytes).as_flattened());
            } else {
                body.extend(
                    p.to_array()
                        .map(|x| f64::from(x).to_le_bytes())
                        .as_flattened(),
                );
            }
        }
        for uv in &mesh.uvs {
            body.extend(uv.to_array().map(f32::to_le_bytes).as_flattened());
        }
        for t in &mesh.triangles {
            body.extend(t.map(u32::to_le_bytes).as_flattened());
        }
        offsets.push(file.len());
        file.extend([0x1c, 0x04]);
        file.extend(version.to_le_bytes());
        let mut encoder = flate2::write::ZlibEncoder::new(file, flate2::Compression::default());
        encoder.write_all(&body).unwrap();
        file = encoder.finish().unwrap();
    }
    for offset in &offsets {
        match version {
            4 => file.extend((*offset as u64).to_le_bytes()),
            _ => file.extend((*offset as u32).to_le_bytes()),
        }
    }
    file.extend(2_u32.to_le_bytes());
    file
}

fn stl_binary(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = b"solid, says this binary file".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for t in &mesh.triangles {
        bytes.extend([0; 12]);
        for corner in mesh.corners(t) {
            bytes.extend(corner.to_array().map(f32::to_le_bytes).as_flattened());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn stl_text(mesh: &Mesh) -> Vec<u8> {
    let mut text = "solid cube\n".to_owned();
    for t in &mesh.triangles {
        text.push_str(" facet normal 0 0 0\n  outer loop\n");
        for c in mesh.corners(t) {
            writeln!(text, "   vertex {:e} {} {}", c.x, c.y, c.z).unwrap();
        }
        text.push_str("  endloop\n endfacet\n");
    }
    text.push_str("endsolid cube\n");
    text.into_bytes()
}

/// The buffer of [`gltf_json`].
fn gltf_buffer(mesh: &Mesh) -> Vec<u8> {
    let vectors = mesh
        .positions
        .iter()
        .chain(&mesh.normals)
        .flat_map(|p| p.to_array());
    let numbers = vectors.chain(mesh.uvs.iter().flat_map(|uv| uv.to_array()));
    let mut bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
    bytes.extend(
        mesh.triangles
            .iter()
            .flatten()
            .flat_map(|&i| (i as u16).to_le_bytes()),
    );
    bytes
}

fn gltf_json(mesh: &Mesh, uri: &str) -> String {
    let (v, t) = (mesh.positions.len(), mesh.triangles.len());
    let length = 32 * v + 6 * t;
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[1,0]}}],
        "nodes":[{{"mesh":0,"name":"box","translation":[1,2,3]}},
            {{"children":[2],"scale":[-2,2,2]}},{{"mesh":0}},
            {{"camera":0}}],
        "cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[0.5,0.25,1,1]}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":0}}]}}],
        "accessors":[
            {{"bufferView":0,"componentType":5126,"count":{v},"type":"VEC3","min":[-1,-1,-1],"max":[1,1,1]}},
            {{"bufferView":0,"byteOffset":{n},"componentType":5126,"count":{v},"type":"VEC3"}},
            {{"bufferView":0,"byteOffset":{u},"componentType":5126,"count":{v},"type":"VEC2"}},
            {{"bufferView":0,"byteOffset":{i},"componentType":5123,"count":{c},"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{length}}}],
        "buffers":[{{"byteLength":{length}{uri}}}]}}"#,
        n = 12 * v,
        u = 24 * v,
        i = 32 * v,
        c = 3 * t,
    )
}

fn gltf_text(mesh: &Mesh) -> Vec<u8> {
    use base64::Engine;
    let data = base64::engine::general_purpose::STANDARD.encode(gltf_buffer(mesh));
    let uri = format!(r#","uri":"data:application/octet-stream;base64,{data}""#);
    gltf_json(mesh, &uri)
        .replace("\"nodes\":[1,0]", "\"nodes\":[1,0,3]")
        .into_bytes()
}

fn glb(mesh: &Mesh) -> Vec<u8> {
    let mut json = gltf_json(mesh, "").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = gltf_buffer(mesh);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn samples() -> Vec<Sample> {
    let cube = cube();
    let sample = |name, bytes| Sample { name, bytes };
    vec![
        sample("text.ply", ply_text(&cube)),
        sample("big.ply", ply_big_endian(&cube)),
        sample("little.ply", ply_little_endian(&cube)),
        sample("cube.obj", obj_text(&cube)),
        sample("three.serialized", serialized(&cube, 3)),
        sample("four.serialized", serialized(&cube, 4)),
        sample("binary.stl", stl_binary(&cube)),
        sample("text.stl", stl_text(&cube)),
        sample("cube.gltf", gltf_text(&cube)),
        sample("cube.glb", glb(&cube)),
    ]
}

#[test]
fn every_format_gives_back_the_cube_that_was_written() {
    let cube = cube();
    let options = ReadOptions {
        shape_index: 1,
        ..ReadOptions::default()
    };
    for Sample { name, bytes } in samples() {
        let loaded = decode(name, &bytes, &options).unwrap_or_else(|e| panic!("{e}"));
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        let mut mesh = loaded.mesh;
        if name.contains(".gl") {
            // The node at (1, 2, 3) comes after the mirrored one.
            assert_eq!(mesh.triangles.len(), 24, "{name}");
            assert_eq!(
                mesh.bounds(),
                Some((Vec3::splat(-2.0), Vec3::new(2.0, 3.0, 4.0))),
                "{name}"
            );
            for t in &mesh.triangles {
                let outside = normals::face_normal(mesh.corners(t));
                assert_eq!(outside, mesh.normals[t[0] as usize], "{name}");
            }
            mesh.positions = mesh.positions[24..]
                .iter()
                .map(|p| p - Vec3::new(1.0, 2.0, 3.0))
                .collect();
            mesh.normals.drain(..24);
            mesh.uvs.drain(..24);
            mesh.triangles = mesh.triangles[12..]
                .iter()
                .map(|t| t.map(|i| i - 24))
                .collect();
        }
        if name.contains(".stl") {
            assert_eq!(
                (mesh.positions.len(), mesh.triangles.len()),
                (8, 12),
                "{name}"
            );
            assert_eq!(
                (mesh.area(), mesh.bounds()),
                (24.0, cube.bounds()),
                "{name}"
            );
            continue;
        }
        assert_eq!(mesh.positions, cube.positions, "{name}");
        assert_eq!(mesh.triangles, cube.triangles, "{name}");
        if name != "little.ply" {
            assert_eq!(
                (&mesh.normals, &mesh.uvs),
                (&cube.normals, &cube.uvs),
                "{name}"
            );
        }
        if matches!(name, "text.ply" | "big.ply") {
            let attribute = |name: &str, per, values| Attribute {
                name: name.into(),
                channels: 1,
                per,
                values,
            };
            assert_eq!(
                mesh.attributes,
                [
                    attribute("vertex_w", Per::Vertex, vec![7.0; 24]),
                    attribute("face_heat", Per::Face, vec![0.5; 12]),
                ]
            );
        }
    }
}

#[test]
fn compressed_files_hold_what_the_others_do_and_damaged_ones_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for Sample { name, bytes } in samples() {
        let read_from = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            read(&path, &ReadOptions::default(), &Budget::default()).map(|loaded| loaded.mesh)
        };
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(&bytes).unwrap();
        let compressed = gzip.finish().unwrap();
        let plain = read_from(name, &bytes).unwrap();
        let name = format!("{name}.GZ");
        assert_eq!(read_from(&name, &compressed).unwrap(), plain, "{name}");
        for damaged in [&compressed[..compressed.len() - 9], &bytes] {
            let error = read_from(&name, damaged).unwrap_err().to_string();
            assert!(error.contains("the compressed file is damaged"), "{error}");
        }
    }
}

#[test]
fn damaged_files_are_read_or_refused_but_never_panic() {
    let mut state = 1_u64;
    let mut random = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        ((state >> 33) as usize) % below
    };
    let mut refused = 0;
    for Sample { name, bytes } in samples() {
        let lengths = (0..bytes.len())
            .step_by(1 + bytes.len() / 300)
            .map(|n| bytes[..n].to_vec());
        let mut damaged: Vec<Vec<u8>> = lengths.collect();
        for i in 0..1000 {
            let mut copy = bytes.clone();
            for _ in 0..1 + i % 3 {
                // The headers are where damage does most.
                let region = if i % 2 == 0 {
                    copy.len()
                } else {
                    copy.len().min(600)
                };
                let at = random(region);
                match i % 5 {
                    0 => copy[at] ^= 1 << random(8),
                    1 => copy[at] = [0, 0xff, 0x7f, 0x80, b'9', b'-', b' ', b'\n'][random(8)],
                    2 => drop(copy.drain(at..(at + random(9)).min(copy.len()))),
                    3 => copy.insert(at, b"0123456789-.e/ \n{["[random(18)]),
                    _ => copy[at..].rotate_left(1),
                }
            }
            damaged.push(copy);
        }
        for shape_index in [0, 1] {
            let options = ReadOptions {
                shape_index,
                bare: shape_index == 1,
                ..ReadOptions::default()
            };
            for bytes in &damaged {
                match decode(name, bytes, &options) {
                    Err(_) => refused += 1,
                    Ok(loaded) => {
                        let mut mesh = loaded.mesh;
                        let n = mesh.positions.len();
                        let finite =
                            |i: &u32| (*i as usize) < n && mesh.positions[*i as usize].is_finite();
                        assert!(mesh.triangles.iter().flatten().all(finite), "{name}");
                        assert!(mesh.normals.iter().all(|n| n.is_normalized()), "{name}");
                        mesh.compute_normals();
                        assert!(mesh.normals.iter().all(|n| n.is_normalized()), "{name}");
                    }
                }
            }
        }
    }
    assert!(refused > 5000, "{refused}");
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

#[test]
fn malformed_files_are_refused_with_what_is_wrong_and_where() {
    let ply = |from: &str, to: &str| {
        assert!(PLY.contains(from), "{from}");
        PLY.replace(from, to).into_bytes()
    };
    let binary = |from: &str, to: &str, rest: &[u8]| {
        let header = PLY
            .split_inclusive("end_header\n")
            .next()
            .unwrap()
            .replace("ascii", "binary_little_endian");
        let mut bytes = header.replace(from, to).into_bytes();
        bytes.extend(rest);
        bytes
    };
    let text = |text: &str| text.as_bytes().to_vec();
    let cut = |mut bytes: Vec<u8>, length: usize| {
        bytes.truncate(length);
        bytes
    };
    let cube = cube();
    let gltf = |from: &str, to: &str| {
        let json = String::from_utf8(gltf_text(&cube)).unwrap();
        assert!(json.contains(from), "{from}");
        json.replacen(from, to, 1).into_bytes()
    };
    let mut index_out_of_range = ply_little_endian(&cube);
    let end = index_out_of_range.len();
    index_out_of_range[end - 13 - 4] = 24;
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("empty.ply", text(""), "a PLY file begins with"),
        (
            "text.ply",
            text("hello\nworld\n"),
            ":1: a PLY file begins with",
        ),
        ("noise.ply", vec![0xa7; 5000], "a PLY file begins with"),
        (
            "header.ply",
            ply("end_header", "end"),
            ":9: unknown header line \"end\"",
        ),
        (
            "format.ply",
            ply("ascii", "binary"),
            "the header names no format",
        ),
        ("version.ply", ply("1.0", "2.0"), ":2: unknown header line"),
        (
            "vertices.ply",
            ply("element vertex", "element vortex"),
            "no element \"vertex\"",
        ),
        (
            "faces.ply",
            ply("element face", "element farce"),
            "no element \"face\"",
        ),
        (
            "twice.ply",
            ply("element face", "element vertex"),
            ":7: element \"vertex\" stands twice",
        ),
        (
            "axes.ply",
            ply("float z", "float w"),
            "needs the properties x, y and z",
        ),
        (
            "type.ply",
            ply("float x", "quad x"),
            ":4: malformed property",
        ),
        (
            "count.ply",
            ply("vertex 3", "vertex three"),
            ":3: an element needs a count",
        ),
        (
            "negative.ply",
            ply("vertex 3", "vertex -3"),
            ":3: an element needs a count",
        ),
        (
            "giant.ply",
            ply("vertex 3", "vertex 4000000000"),
            "promises 4000000000 rows of element \"vertex\"",
        ),
        (
            "colossus.ply",
            ply("vertex 3", "vertex 18446744073709551615"),
            "promises 18446744073709551615 rows",
        ),
        (
            "many.ply",
            ply("face 1", "face 4000000000"),
            "promises 4000000000 rows of element \"face\"",
        ),
        (
            "early.ply",
            ply("1 0 0\n0 1 0\n3 0 1 2\n", "1 0 0.0000000000000000000\n0 1"),
            "the file ends where a number is wanted",
        ),
        (
            "word.ply",
            ply("1 0 0", "1 zero 0"),
            ":11: a number is wanted, not \"zero\"",
        ),
        (
            "index.ply",
            ply("3 0 1 2", "3 0 1 3"),
            "face 0: vertex index 3 is out of range; the file has vertices 0 to 2",
        ),
        (
            "minus.ply",
            ply("3 0 1 2", "3 0 1 -1"),
            "face 0: vertex index -1 is out of range",
        ),
        (
            "half.ply",
            ply("3 0 1 2", "3 0 1 0.5"),
            "vertex index 0.5 is out of range",
        ),
        (
            "list.ply",
            ply("3 0 1 2", "4000000000 0 1 2"),
            "cannot have 4000000000 items",
        ),
        (
            "minuslist.ply",
            ply("3 0 1 2", "-3 0 1 2"),
            "cannot have -3 items",
        ),
        (
            "floatlist.ply",
            ply("list uchar", "list float"),
            ":8: malformed property",
        ),
        (
            "floatindex.ply",
            ply("uchar int", "uchar float"),
            "must be whole numbers",
        ),
        ("nolist.ply", ply("list uchar int", "int"), "must be a list"),
        (
            "nocorners.ply",
            ply("vertex_indices", "corners"),
            "\"face\" has no corners",
        ),
        (
            "orphan.ply",
            ply("element vertex 3\n", ""),
            ":3: malformed property",
        ),
        (
            "nobytes.ply",
            binary("", "", &[0; 20]),
            "promises 3 rows of element \"vertex\", at least 35 bytes; 20 bytes",
        ),
        (
            "fewfaces.ply",
            binary("", "", &[0; 36]),
            "the file ends too early",
        ),
        (
            "hugelist.ply",
            binary("uchar int", "uint int", &[0xff; 48]),
            "cannot have 4294967295 items",
        ),
        ("range.ply", index_out_of_range, "face 10: vertex index"),
        ("empty.obj", text(""), "the file is empty"),
        (
            "prose.obj",
            text("once upon\na time\n"),
            "the file has no vertices",
        ),
        ("noise.obj", vec![0xa7; 5000], "the file has no vertices"),
        (
            "word.obj",
            text("v 0 0 0\nv 1 zero 0\n"),
            ":2: a number is wanted, not \"zero\"",
        ),
        (
            "two.obj",
            text("v 0 0\n"),
            ":1: 3 numbers are wanted, and there are 2",
        ),
        (
            "giant.obj",
            text("v 0 0 0\nf 1 1 4000000000\n"),
            ":2: vertex 4000000000 is out of range; 1 stand before",
        ),
        (
            "colossus.obj",
            text("v 0 0 0\nf 1 1 99999999999999999999\n"),
            ":2: a corner is wanted",
        ),
        (
            "zero.obj",
            text("v 0 0 0\nf 0 1 1\n"),
            ":2: vertex 0 is out of range",
        ),
        (
            "minus.obj",
            text("v 0 0 0\nf -1 -1 -2\n"),
            ":2: vertex -2 is out of range",
        ),
        (
            "least.obj",
            text("v 0 0 0\nf -9223372036854775808 1 1\n"),
            "is out of range",
        ),
        (
            "uv.obj",
            text("v 0 0 0\nf 1/1 1/1 1/1\n"),
            ":2: texture coordinate 1 is out of range; 0 stand",
        ),
        (
            "normal.obj",
            text("v 0 0 0\nf 1//1 1 1\n"),
            ":2: normal 1 is out of range",
        ),
        (
            "slashes.obj",
            text("v 0 0 0\nf 1/1/1/1 1 1\n"),
            ":2: texture coordinate 1 is out of range",
        ),
        (
            "continued.obj",
            text("v 0 0 \\\n0\nf 1 1 2\n"),
            ":3: vertex 2 is out of range",
        ),
        (
            "empty.serialized",
            text(""),
            "the file is no serialized mesh",
        ),
        (
            "noise.serialized",
            vec![0xa7; 5000],
            "begins with the bytes 1C 04",
        ),
        (
            "version.serialized",
            vec![0x1c, 4, 9, 0, 0, 0, 0, 0],
            "the file is no serialized mesh",
        ),
        (
            "table.serialized",
            vec![0x1c, 4, 4, 0, 0xff, 0xff, 0xff, 0xff],
            "the table at the end of the file is broken",
        ),
        (
            "cut.serialized",
            cut(serialized(&cube, 4), 100),
            "the table at the end of the file is broken",
        ),
        ("empty.stl", text(""), "too short"),
        (
            "noise.stl",
            vec![0xa7; 5000],
            "cut short, or no STL: 2812782503 triangles are promised",
        ),
        ("cut.stl", cut(stl_binary(&cube), 300), "cut short"),
        (
            "word.stl",
            text("solid\nfacet\nvertex 0 0 zero\n"),
            ":3: three numbers are wanted",
        ),
        (
            "two.stl",
            text("solid\nfacet\nvertex 0 0 0\nendloop\n"),
            ":4: a facet has three vertices",
        ),
        (
            "open.stl",
            text("solid\nfacet\nvertex 0 0 0\n"),
            "the file ends within a facet",
        ),
        (
            "strange.stl",
            text("solid\nbanana\n"),
            ":2: unknown word \"banana\"",
        ),
        ("empty.gltf", text(""), "the JSON is malformed"),
        ("noise.glb", vec![0xa7; 5000], "the JSON is malformed"),
        (
            "old.glb",
            text("glTF\x01\0\0\0"),
            "GLB version 1 is unknown",
        ),
        (
            "cut.glb",
            cut(glb(&cube), 400),
            "the GLB container is broken",
        ),
        (
            "nobuffer.glb",
            cut(glb(&cube), glb(&cube).len() - 10),
            "the GLB container is broken, or the file cut short",
        ),
        (
            "long.gltf",
            gltf("\"count\":24", "\"count\":4000"),
            "accessor 0 reaches beyond its buffer",
        ),
        (
            "short.gltf",
            gltf("\"count\":24", "\"count\":23"),
            "24 normals for 23 vertices",
        ),
        (
            "offset.gltf",
            gltf("\"byteOffset\":288", "\"byteOffset\":18446744073709551615"),
            "accessor 1 reaches beyond",
        ),
        (
            "cycle.gltf",
            gltf("\"children\":[2]", "\"children\":[1]"),
            "node 1 has two parents, or is its own ancestor",
        ),
        (
            "web.gltf",
            gltf("data:application", "https://example.org/"),
            "nothing is fetched",
        ),
        (
            "file.gltf",
            gltf("data:application/octet-stream;base64,", "no/such/"),
            "cannot read no/such/",
        ),
        (
            "base64.gltf",
            gltf("base64,", "base64,!"),
            "its data URI is damaged",
        ),
    ];
    assert!(cases.len() >= 60);
    let mut wrong = Vec::new();
    for (name, bytes, wanted) in cases {
        match decode(name, &bytes, &ReadOptions::default()) {
            Ok(loaded) => wrong.push(format!(
                "{name} was read: {} triangles",
                loaded.mesh.triangles.len()
            )),
            Err(e) => {
                let said = e.to_string();
                if !(said.starts_with(name) && said.contains(wanted)) {
                    wrong.push(format!("{said}\n    for {wanted}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn folders_missing_files_and_unknown_formats_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let message = |name: &str| {
        read(
            &folder.path().join(name),
            &ReadOptions::default(),
            &Budget::default(),
        )
        .unwrap_err()
        .to_string()
    };
    std::fs::create_dir(folder.path().join("folder.ply")).unwrap();
    assert!(message("folder.ply").ends_with("a mesh file is wanted here, and this is a folder"));
    assert!(message("absent.obj").starts_with("cannot open"));
    assert!(
        message("mesh.fbx").ends_with(
            "unknown mesh format \"fbx\"; known are ply, obj, serialized, stl, gltf, glb"
        )
    );
    assert!(message("mesh.serialised").ends_with("did you mean \"serialized\"?"));
    assert!(message("mesh").contains("needs an extension"));
    for Sample { name, bytes } in samples() {
        let path = folder.path().join(name.to_uppercase());
        std::fs::write(&path, &bytes).unwrap();
        let (mesh, decoded) = (
            load(&path).mesh,
            decode(name, &bytes, &ReadOptions::default()),
        );
        assert_eq!(mesh, decoded.unwrap().mesh, "{name}");
    }
}

#[test]
fn gltf_parts_keep_name_color_and_camera() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.gltf");
    std::fs::write(&path, gltf_text(&cube())).unwrap();
    let scene = read_gltf(&path, &ReadOptions::default(), &Budget::default().open()).unwrap();
    let names: Vec<_> = scene.parts.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["", "box"]);
    assert_eq!(scene.parts[0].base_color, [0.5, 0.25, 1.0, 1.0]);
    assert_eq!(
        scene.parts[0].mesh.bounds(),
        Some((Vec3::splat(-2.0), Vec3::splat(2.0)))
    );
    let camera = scene.camera.unwrap();
    assert_eq!(
        camera.projection,
        Projection::Perspective {
            fov_y: 0.5,
            aspect: None
        }
    );
    assert_eq!((camera.to_world, camera.far), (DMat4::IDENTITY, None));
    std::fs::write(folder.path().join("a b.bin"), gltf_buffer(&cube())).unwrap();
    std::fs::write(&path, gltf_json(&cube(), r#","uri":"a%20b.bin""#)).unwrap();
    assert_eq!(load(&path).mesh.triangles.len(), 24);
}

#[test]
fn triangles_that_are_not_finite_are_dropped_and_counted() {
    let bytes = PLY
        .replace("vertex 3", "vertex 4")
        .replace("face 1", "face 3");
    let bytes = bytes.replace("3 0 1 2\n", "nan 0 0\n3 0 1 3\n4 0 1 2 0\n3 3 3 3\n");
    let bytes = bytes.replace("vertex_indices\n", "vertex_indices\nproperty float q_0\n");
    let bytes = bytes.replace(
        "3 0 1 3\n4 0 1 2 0\n3 3 3 3",
        "3 0 1 3 5\n4 0 1 2 0 6\n3 3 3 3 7",
    );
    let loaded = decode("nan.ply", bytes.as_bytes(), &ReadOptions::default()).unwrap();
    assert_eq!(loaded.dropped_triangles, 2);
    assert_eq!(loaded.mesh.triangles, [[0, 1, 2], [0, 2, 0]]);
    assert_eq!(loaded.mesh.attributes[0].values, [6.0, 6.0]);
    assert_eq!(
        loaded.warnings[0].to_string(),
        "nan.ply: 2 triangles dropped: a corner is not finite"
    );
    let obj = b"v 0 0 0\nv 1 0 0\nv 0 1e999 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\nf 1 2\n";
    let loaded = decode("inf.obj", obj, &ReadOptions::default()).unwrap();
    assert_eq!(
        (
            loaded.dropped_triangles,
            loaded.mesh.triangles.len(),
            loaded.warnings.len()
        ),
        (1, 1, 2)
    );
}

/// With attributes of vertices and faces, of one channel, three and four.
fn colored(mut mesh: Mesh) -> Mesh {
    for (name, per, channels) in [
        ("vertex_color", Per::Vertex, 4),
        ("vertex_heat", Per::Vertex, 1),
        ("vertex_flow", Per::Vertex, 3),
        ("face_color", Per::Face, 3),
        ("face_wear_color", Per::Face, 1),
    ] {
        let rows = match per {
            Per::Vertex => mesh.positions.len(),
            Per::Face => mesh.triangles.len(),
        };
        mesh.attributes.push(Attribute {
            name: name.to_owned(),
            channels,
            per,
            values: (0..rows * channels).map(|i| i as f32 / 3.0).collect(),
        });
    }
    mesh
}

#[test]
fn every_mesh_that_is_written_reads_back_equal() {
    let folder = tempfile::tempdir().unwrap();
    let mut bare = cube();
    (bare.normals, bare.uvs) = (Vec::new(), Vec::new());
    let without_uvs = Mesh {
        uvs: Vec::new(),
        ..sphere(9, 5)
    };
    for mesh in [
        cube(),
        colored(rectangle()),
        colored(sphere(70, 80)),
        colored(bare),
        without_uvs,
        hair(64, 1),
        Mesh::default(),
    ] {
        let path = folder.path().join("mesh.ply");
        write_ply(&path, &mesh).unwrap();
        let Loaded {
            mesh: back,
            warnings,
            ..
        } = load(&path);
        assert_eq!(back.triangles, mesh.triangles);
        assert_eq!((&back.positions, &back.uvs), (&mesh.positions, &mesh.uvs));
        assert_eq!(back.attributes, mesh.attributes);
        for (a, b) in back.normals.iter().zip(&mesh.normals) {
            assert!(a.distance(*b) < 1e-6);
        }
        assert_eq!(back.normals.len(), mesh.normals.len());
        assert_eq!(warnings.is_empty(), !mesh.triangles.is_empty());
    }
    write_ply(&folder.path().join("new/mesh.ply"), &cube()).unwrap();
}

#[test]
fn every_format_converts_to_what_it_reads_as() {
    let folder = tempfile::tempdir().unwrap();
    for sample in samples() {
        let (source, target) = (
            folder.path().join(sample.name),
            folder.path().join("out.ply"),
        );
        std::fs::write(&source, &sample.bytes).unwrap();
        let read = read_parts(&source, &Budget::default()).unwrap();
        if sample.name.ends_with("serialized") {
            for (shape_index, part) in read.parts.iter().enumerate() {
                let options = ReadOptions {
                    shape_index,
                    ..ReadOptions::default()
                };
                assert_eq!(
                    part.mesh,
                    super::read(&source, &options, &Budget::default())
                        .unwrap()
                        .mesh
                );
            }
            assert_eq!(read.parts.len(), 2);
            continue;
        }
        let mesh = read.merged();
        write_ply(&target, &mesh).unwrap();
        let back = load(&target).mesh;
        let direct = load(&source).mesh;
        let corners =
            |m: &Mesh| -> Vec<Vec3> { m.triangles.iter().flat_map(|t| m.corners(t)).collect() };
        assert_eq!(corners(&back), corners(&direct), "{}", sample.name);
        assert_eq!(back.uvs, direct.uvs, "{}", sample.name);
        assert_eq!(back.attributes, direct.attributes, "{}", sample.name);
        assert!(direct.normals.is_empty() || back.normals.len() == direct.normals.len());
    }
}

#[test]
fn a_seed_gives_the_same_bits_everywhere() {
    let bumps = Bumps {
        height: 0.05,
        width: 0.2,
        octaves: 5,
        seed: 3,
    };
    let mut asteroid = ball(3);
    add_bumps(&mut asteroid, &bumps);
    let meshes = [
        ("terrain", terrain(2_000, 3)),
        ("hair", hair(2_000, 3)),
        ("flake", flake(2, 1)),
        ("menger", menger(2)),
        ("asteroid", asteroid),
    ];
    let hashes = meshes.map(|(name, mesh)| {
        let mut hash = blake3::Hasher::new();
        for x in mesh.positions.iter().flat_map(|p| p.to_array()) {
            hash.update(&x.to_le_bytes());
        }
        for i in mesh.triangles.iter().flatten() {
            hash.update(&i.to_le_bytes());
        }
        format!("{name} {}", &hash.finalize().to_hex()[..16])
    });
    let known = [
        "terrain c8c1a6b86fb7c5c0",
        "hair de615cc64f0e50dd",
        "flake 2277b0701a8406e5",
        "menger 7116ea48391aaee6",
        "asteroid 200085668f4a3f7e",
    ];
    assert_eq!(hashes.as_slice(), known);
}
