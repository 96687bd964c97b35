//! Small glTF files, written here piece by piece, and what becomes of them.

use std::path::Path;

use glam::{Vec2, Vec3};
use serde_json::{Value, json};

use super::*;
use crate::budget::Budget;
use crate::mesh::read::testing::decode;
use crate::mesh::read::{self, Loaded};
use crate::mesh::surface::{Map, Maps};

/// A document to which accessors are added, all of them in one buffer.
struct Document {
    json: Value,
    bytes: Vec<u8>,
}

fn f32s(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn u16s(numbers: &[u16]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn i16s(numbers: &[i16]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// The corners of a rectangle 2 wide and 1 high, counter-clockwise seen from +z.
const CORNERS: [f32; 12] = [0., 0., 0., 2., 0., 0., 2., 1., 0., 0., 1., 0.];

impl Document {
    /// With a scene of one node, whose mesh has one primitive without attributes.
    fn new() -> Self {
        Self {
            json: json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
                "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {}}]}],
                "accessors": [], "bufferViews": []}),
            bytes: Vec::new(),
        }
    }

    /// With the rectangle of [`CORNERS`].
    fn rectangle() -> Self {
        let mut document = Self::new();
        let corners = json!({"componentType": 5126, "count": 4, "type": "VEC3"});
        document.attribute("POSITION", &f32s(&CORNERS), corners);
        let indices = json!({"componentType": 5121, "count": 6, "type": "SCALAR"});
        let indices = document.accessor(&[0, 1, 2, 0, 2, 3], indices);
        document.primitive()["indices"] = indices.into();
        document
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend(bytes);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        views.len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], mut about: Value) -> usize {
        about["bufferView"] = self.view(bytes).into();
        self.bare_accessor(about)
    }

    fn bare_accessor(&mut self, about: Value) -> usize {
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(about);
        accessors.len() - 1
    }

    fn attribute(&mut self, name: &str, bytes: &[u8], about: Value) {
        let accessor = self.accessor(bytes, about);
        self.primitive()["attributes"][name] = accessor.into();
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    fn node(&mut self) -> &mut Value {
        &mut self.json["nodes"][0]
    }

    fn text(&self) -> Vec<u8> {
        use base64::Engine;
        let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        let mut json = self.json.clone();
        let uri = format!("data:application/octet-stream;base64,{data}");
        json["buffers"] = json!([{"byteLength": self.bytes.len(), "uri": uri}]);
        json.to_string().into_bytes()
    }

    fn read(&self) -> crate::error::Result<Loaded> {
        decode("test.gltf", &self.text(), &ReadOptions::default())
    }

    fn mesh(&self) -> Mesh {
        self.read().unwrap().mesh
    }

    fn refusal(&self) -> String {
        self.read().unwrap_err().to_string()
    }

    fn warnings(&self) -> Vec<String> {
        let warnings = self.read().unwrap().warnings;
        warnings.iter().map(ToString::to_string).collect()
    }
}

/// Area, low and high corner.
fn measures(mesh: &Mesh) -> (f64, [f32; 3], [f32; 3]) {
    let (low, high) = mesh.bounds().unwrap();
    let rounded = |v: Vec3| v.to_array().map(|x| (x * 1e3).round() / 1e3);
    let area = (mesh.area() * 1e3).round() / 1e3;
    (area, rounded(low), rounded(high))
}

/// The normal of the first triangle.
fn normal(mesh: &Mesh) -> Vec3 {
    crate::mesh::normals::face_normal(mesh.corners(&mesh.triangles[0]))
}

#[test]
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn the_files_that_were_refused_are_read() {
    let folder =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/faults/gltf-valid-refused");
    if !folder.is_dir() {
        eprintln!("skipped: {} is not there", folder.display());
        return;
    }
    for name in ["plain", "quant_norm", "requiredunlit", "sparse"] {
        let path = folder.join(format!("a9_{name}.gltf"));
        let loaded = read::read(&path, &ReadOptions::default(), &Budget::default()).unwrap();
        let expected = (30.872, [0.0; 3], [2.0, 2.4, 3.0]);
        let (area, low, high) = measures(&loaded.mesh);
        // Sixteen bits a coordinate do not say it to the last digit.
        assert!((area - expected.0).abs() < 2e-3, "{name}: {area}");
        assert_eq!((low, high), (expected.1, expected.2), "{name}");
    }
    let draco = read::read(
        &folder.join("a9_draco.gltf"),
        &ReadOptions::default(),
        &Budget::default(),
    );
    let draco = draco.unwrap_err().to_string();
    assert!(
        draco.contains("Draco") && draco.contains("without compression"),
        "{draco}"
    );
}

#[test]
fn quantized_positions_are_numbers_or_parts_of_their_range() {
    let expected = (2.0, [0.0; 3], [2.0, 1.0, 0.0]);
    let corners = |of: fn(f32) -> Vec<u8>, stride: usize| -> Vec<u8> {
        let rows = CORNERS.chunks(3).map(|row| {
            let mut row: Vec<u8> = row.iter().flat_map(|&x| of(x)).collect();
            row.resize(stride, 0xaa);
            row
        });
        rows.flatten().collect()
    };
    let cases: [(u32, bool, f64, Vec<u8>, usize); 8] = [
        (5120, false, 0.1, corners(|x| vec![10 * x as u8], 4), 4),
        (5121, false, 0.01, corners(|x| vec![100 * x as u8], 4), 4),
        (
            5122,
            false,
            1e-3,
            corners(|x| i16s(&[1000 * x as i16]), 8),
            8,
        ),
        (
            5123,
            false,
            1e-4,
            corners(|x| u16s(&[10000 * x as u16]), 6),
            6,
        ),
        (5120, true, 2.0, corners(|x| vec![(63.5 * x) as u8], 4), 4),
        (5121, true, 2.0, corners(|x| vec![(127.5 * x) as u8], 4), 4),
        (
            5122,
            true,
            2.0,
            corners(|x| i16s(&[(16383.5 * x) as i16]), 12),
            12,
        ),
        (
            5123,
            true,
            2.0,
            corners(|x| u16s(&[(32767.5 * x) as u16]), 8),
            8,
        ),
    ];
    for (kind, normalized, scale, bytes, stride) in cases {
        let mut document = Document::rectangle();
        let about =
            json!({"componentType": kind, "normalized": normalized, "count": 4, "type": "VEC3"});
        document.attribute("POSITION", &bytes, about);
        let views = document.json["bufferViews"].as_array_mut().unwrap();
        views.last_mut().unwrap()["byteStride"] = stride.into();
        *document.node() = json!({"mesh": 0, "scale": [scale, scale, scale]});
        document.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let (area, low, high) = measures(&document.mesh());
        let near = |a: f32, b: f32| (a - b).abs() < 0.02;
        assert!(
            (area - expected.0).abs() < 0.02,
            "{kind} {normalized}: {area}"
        );
        assert_eq!(low, expected.1, "{kind} {normalized}");
        assert!(
            high.into_iter().zip(expected.2).all(|(a, b)| near(a, b)),
            "{kind}: {high:?}"
        );
    }
}

#[test]
fn sparse_accessors_replace_what_stands_there_or_zeros() {
    for (kind, bytes) in [
        (5121, vec![1_u8, 2]),
        (5123, vec![1, 0, 2, 0]),
        (5125, vec![1, 0, 0, 0, 2, 0, 0, 0]),
    ] {
        for stored in [true, false] {
            let mut document = Document::rectangle();
            let indices = document.view(&bytes);
            let values = document.view(&f32s(&[4., 0., 0., 4., 3., 0.]));
            let mut about = json!({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": {"count": 2,
                "indices": {"bufferView": indices, "componentType": kind}, "values": {"bufferView": values}}});
            if stored {
                about["bufferView"] = 0.into();
            }
            let accessor = document.bare_accessor(about);
            document.primitive()["attributes"]["POSITION"] = accessor.into();
            let area = if stored { 6.0 + 2.0 } else { 6.0 };
            assert_eq!(document.mesh().area(), area, "{kind} {stored}");
            document.json["accessors"][accessor]["count"] = 2.into();
            assert!(document.refusal().contains("replaces its element 2"));
            document.json["accessors"][accessor]["count"] = (1_u64 << 40).into();
            let refusal = document.refusal();
            assert!(
                refusal.contains("reaches beyond") || refusal.contains("more than"),
                "{refusal}"
            );
        }
    }
    let mut document = Document::rectangle();
    let zeros =
        document.bare_accessor(json!({"componentType": 5126, "count": 1 << 25, "type": "VEC3"}));
    document.primitive()["attributes"]["POSITION"] = zeros.into();
    assert!(document.refusal().contains("has no data"));
}

#[test]
fn required_extensions_are_read_passed_over_or_refused_by_name() {
    for name in [
        "KHR_materials_unlit",
        "KHR_texture_transform",
        "EXT_texture_webp",
        "KHR_lights_punctual",
    ] {
        let mut document = Document::rectangle();
        document.json["extensionsRequired"] = json!([name]);
        assert_eq!(document.mesh().area(), 2.0, "{name}");
    }
    for (name, said) in [
        ("KHR_draco_mesh_compression", "compressed by Draco"),
        ("EXT_meshopt_compression", "compressed by meshoptimizer"),
        ("KHR_meshopt_compression", "compressed by meshoptimizer"),
        ("ACME_voxels", "requires the extension \"ACME_voxels\""),
    ] {
        let mut document = Document::rectangle();
        document.json["extensionsRequired"] = json!([name]);
        let refusal = document.refusal();
        assert!(refusal.contains(said), "{refusal}");
    }
    // Not required, and yet nothing stands for the compressed data.
    let mut document = Document::rectangle();
    document.primitive()["extensions"] = json!({"KHR_draco_mesh_compression": {"bufferView": 0}});
    assert_eq!(document.mesh().area(), 2.0);
    document.json["accessors"][0]
        .as_object_mut()
        .unwrap()
        .remove("bufferView");
    assert!(document.refusal().contains("compressed by Draco"));
}

#[test]
fn lists_strips_fans_and_all_widths_of_indices_make_the_same_rectangle() {
    for (mode, corners) in [
        (4, vec![0_u32, 1, 2, 0, 2, 3]),
        (5, vec![0, 1, 3, 2]),
        (6, vec![0, 1, 2, 3]),
    ] {
        for (kind, width) in [(5121, 1), (5123, 2), (5125, 4)] {
            let mut document = Document::rectangle();
            let bytes = corners
                .iter()
                .flat_map(|i| i.to_le_bytes()[..width].to_vec());
            let bytes: Vec<u8> = bytes.collect();
            let about = json!({"componentType": kind, "count": corners.len(), "type": "SCALAR"});
            let indices = document.accessor(&bytes, about);
            document.primitive()["indices"] = indices.into();
            document.primitive()["mode"] = mode.into();
            let mesh = document.mesh();
            assert_eq!(
                (mesh.area(), normal(&mesh)),
                (2.0, Vec3::Z),
                "{mode} {kind}"
            );
            assert!(mesh.triangles.len() == 2 && mesh.normals.is_empty());
        }
    }
    let mut fan = Document::rectangle();
    fan.primitive()["mode"] = 6.into();
    fan.primitive().as_object_mut().unwrap().remove("indices");
    assert_eq!(fan.mesh().area(), 2.0);
    for mode in 0..4 {
        let mut document = Document::rectangle();
        let mut lines = document.primitive().clone();
        lines["mode"] = mode.into();
        let primitives = document.json["meshes"][0]["primitives"]
            .as_array_mut()
            .unwrap();
        primitives.extend([lines.clone(), lines]);
        assert_eq!(document.mesh().area(), 2.0);
        assert_eq!(
            document.warnings(),
            ["test.gltf: points and lines are left out (2 times)"]
        );
    }
    let mut document = Document::rectangle();
    document.primitive()["mode"] = 7.into();
    assert!(
        document
            .refusal()
            .contains("primitive 0: its mode 7 is unknown")
    );
}

#[test]
fn colours_of_vertices_are_linear_of_any_type_and_times_the_base_colour() {
    let white = [1.0, 1.0, 1.0];
    for (kind, of, bytes) in [
        (5121, "VEC4", [[255, 0, 51, 9]; 4].concat()),
        (5123, "VEC3", u16s(&[65535, 0, 13107].repeat(4))),
        (5126, "VEC3", f32s(&[1.0, 0.0, 0.2].repeat(4))),
        (5126, "VEC4", f32s(&[1.0, 0.0, 0.2, 0.5].repeat(4))),
    ] {
        let mut document = Document::rectangle();
        let about =
            json!({"componentType": kind, "normalized": kind != 5126, "count": 4, "type": of});
        document.attribute("COLOR_0", &bytes, about);
        document.primitive()["material"] = 0.into();
        document.json["materials"] =
            json!([{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 0.5, 1]}}]);
        let mut plain = document.primitive().clone();
        plain["attributes"]
            .as_object_mut()
            .unwrap()
            .remove("COLOR_0");
        plain.as_object_mut().unwrap().remove("material");
        let primitives = document.json["meshes"][0]["primitives"]
            .as_array_mut()
            .unwrap();
        primitives.push(plain);
        let mesh = document.mesh();
        let [color] = &mesh.attributes[..] else {
            panic!("{} attributes", mesh.attributes.len());
        };
        assert_eq!(
            (color.name.as_str(), color.per),
            ("vertex_color", Per::Vertex)
        );
        assert_eq!(color.row(4), white);
        for (ours, expected) in color.row(3).iter().zip([0.5, 0.0, 0.1]) {
            assert!(
                (ours - expected).abs() < 1e-6,
                "{kind} {of}: {:?}",
                color.row(3)
            );
        }
    }
    let mut document = Document::rectangle();
    document.primitive()["material"] = 0.into();
    document.json["materials"] = json!([{"extensions": {"KHR_materials_pbrSpecularGlossiness":
        {"diffuseFactor": [0.25, 0.5, 1, 1]}}}]);
    let mesh = document.mesh();
    assert_eq!(mesh.attributes[0].name, "face_color");
    assert_eq!(mesh.attributes[0].row(1), [0.25, 0.5, 1.0]);
}

#[test]
fn morph_targets_stand_at_the_weights_of_the_node_or_else_of_the_mesh() {
    let mut document = Document::rectangle();
    let about = json!({"componentType": 5126, "count": 4, "type": "VEC3"});
    let wider = document.accessor(
        &f32s(&[0., 0., 0., 2., 0., 0., 2., 0., 0., 0., 0., 0.]),
        about.clone(),
    );
    let deeper = document.accessor(&f32s(&[0., 0., 1.].repeat(4)), about);
    document.primitive()["targets"] = json!([{"POSITION": wider}, {"POSITION": deeper}, {}]);
    assert_eq!(document.mesh().area(), 2.0);
    document.json["meshes"][0]["weights"] = json!([0.5, 0, 1]);
    assert_eq!(measures(&document.mesh()), (3.0, [0.0; 3], [3.0, 1.0, 0.0]));
    document.node()["weights"] = json!([1, -2, 0]);
    assert_eq!(
        measures(&document.mesh()),
        (4.0, [0.0, 0.0, -2.0], [4.0, 1.0, -2.0])
    );
    assert_eq!(document.warnings().len(), 0);
    let short = document.bare_accessor(json!({"componentType": 5126, "count": 3, "type": "VEC3"}));
    document.primitive()["targets"][0]["POSITION"] = short.into();
    assert!(
        document
            .refusal()
            .contains("a morph target moves 3 vertices of 4")
    );
}

#[test]
fn gpu_instances_stand_in_their_places_relative_to_the_node() {
    let mut document = Document::rectangle();
    let vec3 = json!({"componentType": 5126, "count": 2, "type": "VEC3"});
    let translations = document.accessor(&f32s(&[0., 0., 0., 5., 0., 0.]), vec3.clone());
    let scales = document.accessor(&f32s(&[1., 1., 1., -1., 2., 1.]), vec3);
    // Half a turn around x in the second place, as normalized bytes.
    let quaternion = json!({"componentType": 5120, "normalized": true, "count": 2, "type": "VEC4"});
    let rotations = document.accessor(&[0, 0, 0, 127, 127, 0, 0, 0], quaternion);
    let instancing = json!({"TRANSLATION": translations, "SCALE": scales, "ROTATION": rotations});
    *document.node() = json!({"mesh": 0, "translation": [0, 0, 1],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": instancing}}});
    document.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let mesh = document.mesh();
    assert_eq!(
        measures(&mesh),
        (2.0 + 4.0, [0.0, -2.0, 1.0], [5.0, 1.0, 1.0])
    );
    let facing = |i: usize| crate::mesh::normals::face_normal(mesh.corners(&mesh.triangles[i]));
    assert_eq!((facing(0), facing(2)), (Vec3::Z, Vec3::NEG_Z));
    document.json["accessors"][scales]["count"] = 1.into();
    assert!(document.refusal().contains("of different counts"));
    document.json["accessors"][scales]["count"] = 2.into();
    document.json["accessors"][translations]["count"] = (1 << 30).into();
    assert!(document.refusal().contains("reaches beyond"));
}

#[test]
fn skinned_vertices_follow_their_joints_and_not_their_node() {
    let mut document = Document::rectangle();
    // The right side hangs half on each joint, the weights not quite of sum one.
    let joints = json!({"componentType": 5121, "count": 4, "type": "VEC4"});
    document.attribute(
        "JOINTS_0",
        &[[0, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]].concat(),
        joints,
    );
    let weights = json!({"componentType": 5121, "normalized": true, "count": 4, "type": "VEC4"});
    document.attribute(
        "WEIGHTS_0",
        &[[255, 0, 0, 0], [127, 127, 0, 0], [127, 127, 0, 0], [0; 4]].concat(),
        weights,
    );
    let mut inverse = DMat4::IDENTITY.to_cols_array().map(|x| x as f32);
    inverse[12] = -1.0;
    let matrices = [DMat4::IDENTITY.to_cols_array().map(|x| x as f32), inverse].concat();
    let about = json!({"componentType": 5126, "count": 2, "type": "MAT4"});
    let matrices = document.accessor(&f32s(&matrices), about);
    document.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": matrices}]);
    document.json["nodes"] = json!([{"mesh": 0, "skin": 0, "translation": [100, 100, 100]},
        {"children": [2], "translation": [0, 0, 1]}, {"translation": [5, 0, 0]}]);
    document.json["scenes"][0]["nodes"] = json!([0, 1]);
    // The second joint moves by 5 − 1, and half of that is 2.
    assert_eq!(
        measures(&document.mesh()),
        (4.0, [0.0, 0.0, 1.0], [4.0, 1.0, 1.0])
    );
    document.json["scenes"][0]["nodes"] = json!([0]);
    assert!(
        document
            .refusal()
            .contains("its joint, node 1, is not in the scene")
    );
    document.json["skins"] = json!([{"joints": [0]}]);
    assert!(document.refusal().contains("joint 1 is out of range"));
}

#[test]
fn the_default_scene_is_shown_or_the_first_or_where_there_is_none_all_nodes() {
    let mut document = Document::rectangle();
    document.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "translation": [0, 0, 3]},
        {"children": [1], "scale": [1, 1, -1]}]);
    document.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [2]}]);
    document.json["scene"] = 1.into();
    let mesh = document.mesh();
    assert_eq!(measures(&mesh), (2.0, [0.0, 0.0, -3.0], [2.0, 1.0, -3.0]));
    assert_eq!(normal(&mesh), Vec3::NEG_Z);
    document.json.as_object_mut().unwrap().remove("scene");
    assert_eq!(measures(&document.mesh()).1, [0.0; 3]);
    document.json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(
        measures(&document.mesh()),
        (4.0, [0.0, 0.0, -3.0], [2.0, 1.0, 0.0])
    );
    assert!(document.warnings()[0].contains("has no scene"));
    document.json["scene"] = 7.into();
    assert!(document.refusal().contains("scene 7 is out of range"));
}

#[test]
fn a_matrix_and_its_parts_place_a_node_alike() {
    let mut document = Document::rectangle();
    *document.node() =
        json!({"mesh": 0, "translation": [1, 2, 3], "rotation": [0, 0, 2, 2], "scale": [2, 1, 1]});
    let parts = document.mesh();
    *document.node() =
        json!({"mesh": 0, "matrix": [0, 2, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]});
    assert_eq!(measures(&parts), measures(&document.mesh()));
    assert_eq!(measures(&parts), (4.0, [0.0, 2.0, 3.0], [1.0, 6.0, 3.0]));
}

#[test]
fn texture_coordinates_are_those_of_the_base_colour() {
    let mut document = Document::rectangle();
    let about = json!({"componentType": 5121, "normalized": true, "count": 4, "type": "VEC2"});
    document.attribute("TEXCOORD_0", &[0; 8], about);
    let about = json!({"componentType": 5123, "count": 4, "type": "VEC2"});
    document.attribute(
        "TEXCOORD_1",
        &u16s(&[0, 0, 100, 0, 100, 100, 0, 100]),
        about,
    );
    assert_eq!(document.mesh().uvs, [Vec2::ZERO; 4]);
    document.primitive()["material"] = 0.into();
    let quarter = std::f64::consts::FRAC_PI_2;
    let transform = json!({"scale": [0.01, 0.02], "rotation": quarter, "offset": [0.5, 0]});
    document.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1,
        "extensions": {"KHR_texture_transform": transform}}}}]);
    // Counter-clockwise where v points down: from u to −v.
    let expected = [[0.5, 0.0], [0.5, -1.0], [2.5, -1.0], [2.5, 0.0]].map(Vec2::from);
    for (ours, expected) in document.mesh().uvs.iter().zip(expected) {
        assert!(ours.distance(expected) < 1e-5, "{ours}");
    }
    let warnings = document.warnings();
    assert!(
        warnings
            .iter()
            .any(|w| w.contains("vertex data left out: TEXCOORD_0")),
        "{warnings:?}"
    );
}

#[test]
fn each_kind_of_thing_that_is_left_out_is_told_once() {
    let mut document = Document::rectangle();
    document.primitive()["material"] = 0.into();
    document.json["materials"] = json!([
        {"normalTexture": {"index": 0}, "emissiveFactor": [1, 0, 0], "alphaMode": "MASK",
            "extensions": {"KHR_materials_unlit": {}}},
        {"occlusionTexture": {"index": 0}, "extensions": {"KHR_materials_clearcoat": {}}}]);
    document.json["animations"] = json!([{"channels": [], "samplers": []}, {}]);
    document.json["cameras"] = json!([{"type": "orthographic",
        "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}}]);
    document.json["nodes"] = json!([{"mesh": 0, "children": [1, 2]},
        {"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}]);
    let expected = [
        "animations are left out: nodes and weights stand at rest (`etendue render` shows them by --frames and --shutter)",
        "cameras after the first are left out",
        "lights are left out (KHR_lights_punctual) (2 times)",
        "materials are shown by their base colour factor alone, without KHR_materials_unlit, emission, textures, \
         transparency",
    ];
    assert_eq!(
        document.warnings(),
        expected.map(|said| format!("test.gltf: {said}"))
    );
}

#[test]
fn what_materials_say_is_a_surface_where_the_file_is_all_there_is() {
    let mut document = Document::rectangle();
    let uvs = json!({"componentType": 5126, "count": 4, "type": "VEC2"});
    let uvs = document.accessor(&[0; 32], uvs);
    let mut primitives = Vec::new();
    for material in 0..6 {
        let mut primitive = document.primitive().clone();
        primitive["material"] = material.into();
        primitives.push(primitive);
    }
    primitives.push(document.primitive().clone());
    primitives[2]["attributes"]["TEXCOORD_0"] = uvs.into();
    document.json["meshes"][0]["primitives"] = primitives.into();
    document.json["images"] =
        json!([{"uri": "there/a%20b.png"}, {"uri": "data:image/png;base64,AP8gQQ=="}]);
    document.json["samplers"] = json!([{"wrapS": 33071, "magFilter": 9728}]);
    document.json["textures"] = json!([{"source": 0}, {"source": 1, "sampler": 0},
        {"extensions": {"EXT_texture_webp": {"source": 0}}}]);
    document.json["materials"] = json!([
        {"pbrMetallicRoughness": {"metallicFactor": 0.25, "roughnessFactor": 0.5}, "emissiveFactor": [1, 0.5, 0],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}},
        {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]}, "emissiveFactor": [1, 1, 1], "alphaMode": "BLEND"},
        {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5], "baseColorTexture": {"index": 0},
                "metallicRoughnessTexture": {"index": 1}},
            "normalTexture": {"index": 1, "scale": 0.5}, "occlusionTexture": {"index": 0},
            "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 2}, "alphaMode": "MASK", "alphaCutoff": 0.2},
        {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25], "metallicRoughnessTexture": {"index": 0}},
            "alphaMode": "MASK"},
        {"extensions": {"KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 0.75}}},
        {"pbrMetallicRoughness": {"metallicFactor": 0.25, "roughnessFactor": 0.5, "baseColorFactor": [1, 0, 0, 1]},
            "emissiveFactor": [1, 0.5, 0], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}}]);
    let loaded = decode("here/test.gltf", &document.text(), &ReadOptions::BARE).unwrap();
    let surface = |roughness, metallic| Surface {
        roughness,
        metallic,
        ..Surface::MATTE
    };
    let image = Map::of("here/there/a b.png".into());
    let inside = Map {
        image: Some(1),
        wrap: ["clamp", "repeat"],
        nearest: true,
        ..Map::of("here/test.gltf".into())
    };
    let expected = [
        Surface {
            emission: [4.0, 2.0, 0.0],
            ..surface(0.5, 0.25)
        },
        Surface {
            emission: [0.25; 3],
            opacity: 0.25,
            ..surface(1.0, 1.0)
        },
        Surface {
            cutoff: Some(0.4),
            maps: Maps {
                color: Some(image.clone()),
                roughness: Some(inside.by("g")),
                metallic: Some(inside.by("b")),
                opacity: Some(image.by("a")),
                normal: Some(inside),
                normal_scale: 0.5,
                ..Maps::NONE
            },
            ..surface(1.0, 1.0)
        },
        // No metal, for nobody knows where.
        Surface {
            opacity: 0.0,
            ..surface(1.0, 0.0)
        },
        surface(0.25, 0.0),
        surface(1.0, 1.0),
    ];
    assert_eq!(loaded.surfaces, expected);
    let named = |name: &str| loaded.mesh.attributes.iter().find(|a| a.name == name);
    let of_faces = &named("face_surface").unwrap().values;
    // Of two triangles a primitive; what differs in colour alone is one.
    let numbers: Vec<f32> = of_faces.chunks(2).map(|pair| pair[0]).collect();
    assert_eq!(numbers, [0.0, 1.0, 2.0, 3.0, 4.0, 0.0, 5.0]);
    let colors = &named("face_color").unwrap().values;
    assert_eq!(colors[30..36], [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    assert_eq!(loaded.of_surface(0).unwrap().triangles.len(), 4);
    assert_eq!(loaded.color_of(0), None);
    assert_eq!(loaded.color_of(1), Some([1.0; 3]));
    assert!(loaded.of_surface(6).is_none());
    let [told] = &loaded.warnings[..] else {
        panic!("{:?}", loaded.warnings);
    };
    let expected = "materials are shown without KHR_materials_pbrSpecularGlossiness, textures EXT_texture_webp, \
        textures where there are no texture coordinates";
    assert!(told.to_string().contains(expected), "{told}");
    let as_shape = document.mesh().attributes;
    assert!(as_shape.len() == 1 && as_shape[0].name == "face_color");
    // White is no colour of its own where an image has the say.
    let mut textured = Document::rectangle();
    let uvs = json!({"componentType": 5126, "count": 4, "type": "VEC2"});
    textured.attribute("TEXCOORD_0", &[0; 32], uvs);
    textured.primitive()["material"] = 0.into();
    textured.json["images"] = json!([{"uri": "a.png"}]);
    textured.json["textures"] = json!([{"source": 0}]);
    textured.json["materials"] =
        json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    let loaded = decode("test.gltf", &textured.text(), &ReadOptions::BARE).unwrap();
    assert!(loaded.mesh.attributes.is_empty() && loaded.warnings.is_empty());
    assert_eq!(loaded.color_of(0), None);
}

#[test]
fn a_file_that_many_buffers_name_is_read_once_and_one_that_nobody_needs_may_be_missing() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = Document::rectangle();
    // Longer than the file says.
    let bytes = [&document.bytes[..], &[7; 100]].concat();
    std::fs::write(folder.path().join("é a.bin"), &bytes).unwrap();
    let mut buffers =
        vec![json!({"byteLength": document.bytes.len(), "uri": "%C3%A9%20a.bin"}); 250];
    buffers.push(json!({"byteLength": 4, "uri": "./é a.bin"}));
    buffers.push(json!({"byteLength": 4, "uri": "none.bin"}));
    document.json["buffers"] = buffers.into();
    document.json["bufferViews"][0]["buffer"] = 249.into();
    let text = document.json.to_string();
    let path = folder.path().join("test.gltf");
    let root = Root::parse(text.as_bytes()).ok().unwrap();
    let loaded = Buffers::load(&root, None, &path, &Budget::default().open());
    assert_eq!(loaded.held(), bytes.len());
    assert_eq!(
        loaded.files,
        ["é a.bin", "none.bin"].map(|name| folder.path().join(name))
    );
    std::fs::write(&path, &text).unwrap();
    let loaded = read::read(&path, &ReadOptions::default(), &Budget::default()).unwrap();
    assert_eq!(loaded.mesh.area(), 2.0);
    document.json["bufferViews"][0]["buffer"] = 251.into();
    std::fs::write(&path, document.json.to_string()).unwrap();
    let refusal = read::read(&path, &ReadOptions::default(), &Budget::default())
        .unwrap_err()
        .to_string();
    assert!(refusal.contains("buffer 251: cannot read"), "{refusal}");
}

#[test]
fn marks_and_padding_around_the_json_are_passed_over_and_other_versions_refused() {
    let text = Document::rectangle().text();
    let marked = [b"\xef\xbb\xbf", &text[..], b"\0\0"].concat();
    let loaded = decode("test.gltf", &marked, &ReadOptions::default()).unwrap();
    assert_eq!(loaded.mesh.area(), 2.0);
    for (asset, said) in [
        (json!({"version": "1.0"}), "glTF version \"1.0\" is unknown"),
        (json!({"version": "3.0"}), "glTF version \"3.0\" is unknown"),
        (
            json!({"version": "2.1", "minVersion": "2.1"}),
            "a later version than 2.0",
        ),
    ] {
        let mut document = Document::rectangle();
        document.json["asset"] = asset;
        assert!(document.refusal().contains(said), "{}", document.refusal());
    }
    let first = r#"{"asset": {"version": "1.0"}, "meshes": {"a": {}}}"#;
    let refusal = decode("test.gltf", first.as_bytes(), &ReadOptions::default()).unwrap_err();
    assert!(
        refusal.to_string().contains("glTF version \"1.0\""),
        "{refusal}"
    );
}

/// Makes a document wrong.
type Edit = fn(&mut Document);

#[test]
fn every_index_is_held_against_what_it_indexes() {
    let edits: [(Edit, &str); 9] = [
        (|d| d.node()["mesh"] = 3.into(), "mesh 3 is out of range"),
        (
            |d| d.node()["children"] = json!([9]),
            "node 9 is out of range",
        ),
        (
            |d| d.node()["camera"] = 3.into(),
            "camera 3 is out of range",
        ),
        (|d| d.node()["skin"] = 3.into(), "skin 3 is out of range"),
        (
            |d| d.primitive()["material"] = 3.into(),
            "material 3 is out of range",
        ),
        (
            |d| d.primitive()["indices"] = 3.into(),
            "accessor 3 is out of range",
        ),
        (
            |d| d.json["accessors"][0]["bufferView"] = 9.into(),
            "buffer view 9 is out of range",
        ),
        (
            |d| d.json["bufferViews"][0]["buffer"] = 9.into(),
            "buffer 9 is out of range",
        ),
        (
            |d| d.json["accessors"][0]["componentType"] = 5130.into(),
            "unknown component type 5130",
        ),
    ];
    for (edit, said) in edits {
        let mut document = Document::rectangle();
        edit(&mut document);
        let refusal = document.refusal();
        assert!(
            refusal.starts_with("test.gltf") && refusal.contains(said),
            "{refusal}"
        );
    }
}

/// A rectangle whose node is moved, turned, stretched and bent by an animation, each in its own way between keyframes.
#[test]
fn an_animation_stands_where_it_is_at_a_time() {
    let mut document = Document::rectangle();
    let lifted = json!({"componentType": 5126, "count": 4, "type": "VEC3"});
    let lifted = document.accessor(&f32s(&[0., 0., 1.].repeat(4)), lifted);
    document.primitive()["targets"] = json!([{"POSITION": lifted}]);
    let mut keys = |numbers: &[f32], kind: &str, width: usize| {
        let about = json!({"componentType": 5126, "count": numbers.len() / width, "type": kind});
        document.accessor(&f32s(numbers), about)
    };
    let times = keys(&[1.0, 3.0], "SCALAR", 1);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let translation = keys(&[0., 0., 0., 4., 0., 0.], "VEC3", 3);
    let rotation = keys(&[0., 0., 0., 1., 0., 0., half, half], "VEC4", 4);
    let scale = keys(&[1., 1., 1., 3., 1., 1.], "VEC3", 3);
    // In-tangent, value and out-tangent of each of two keyframes.
    let weights = keys(&[0., 0., 1., 0., 1., 0.], "SCALAR", 1);
    let channel =
        |sampler: u32, path: &str| json!({"sampler": sampler, "target": {"node": 0, "path": path}});
    let sampler = |output: usize, between: &str| json!({"input": times, "output": output, "interpolation": between});
    document.json["animations"] = json!([{
        "channels": [channel(0, "translation"), channel(1, "rotation"), channel(2, "scale"), channel(3, "weights"),
            {"sampler": 0, "target": {"path": "pointer"}}],
        "samplers": [{"input": times, "output": translation}, sampler(rotation, "LINEAR"), sampler(scale, "STEP"),
            sampler(weights, "CUBICSPLINE")]}, {"channels": [], "samplers": []}]);
    let corner = |time: Option<f32>| {
        let options = ReadOptions {
            time: time.map(crate::mesh::Time::of),
            ..ReadOptions::default()
        };
        let read = decode("test.gltf", &document.text(), &options);
        read.unwrap().mesh.positions[1]
    };
    let near = |time: Option<f32>, expected: Vec3| {
        let found = corner(time);
        assert!(
            found.distance(expected) < 1e-5,
            "{time:?}: {found} {expected}"
        );
    };
    // Corner 1 is at (2, 0, 0).
    near(None, Vec3::new(2.0, 0.0, 0.0));
    near(Some(0.0), Vec3::new(2.0, 0.0, 0.0));
    let options = ReadOptions {
        time: Some(crate::mesh::Time::of(0.0)),
        ..ReadOptions::default()
    };
    let told = decode("test.gltf", &document.text(), &options)
        .unwrap()
        .warnings;
    let told: Vec<String> = told.iter().map(ToString::to_string).collect();
    let expected = [
        "animations after the first are left out",
        "channels of the animation that move no node, or move it in an unknown way, are left out",
    ];
    assert_eq!(told, expected.map(|said| format!("test.gltf: {said}")));
    // Half way: moved by 2, turned by 45°, not yet stretched; half of the weight and an eighth of twice a slope of 1.
    near(
        Some(2.0),
        Vec3::new(2.0 + 2.0 * half, 2.0 * half, 0.5 + 0.25),
    );
    near(Some(9.0), Vec3::new(4.0, 6.0, 1.0));
    // A quarter turn in six pieces, the spline in eight, and the step within no time.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.gltf");
    std::fs::write(&path, document.text()).unwrap();
    let looked = |shutter| {
        let animation = read_gltf_animation(&path, shutter, &Budget::default());
        let GltfAnimation {
            span,
            moments,
            passed_over,
            turned_over,
        } = animation.unwrap().unwrap();
        assert_eq!((span, passed_over), ([1.0, 3.0], 0));
        assert!(turned_over.is_empty());
        assert!(moments.windows(2).all(|pair| pair[0] < pair[1]));
        moments
    };
    let third = |n: f32| 1.0 + 2.0 * (n / 6.0);
    let before = 1.0_f32.next_down();
    let until = [
        0.0,
        before,
        1.0,
        1.25,
        third(1.0),
        1.5,
        third(2.0),
        1.75,
        2.0,
    ];
    assert_eq!(looked([0.0, 2.0]), until);
    let after = [third(5.0), 2.75, 3.0_f32.next_down(), 3.0, 9.0];
    assert!(looked([2.5, 9.0]).ends_with(&after));
    assert_eq!(looked([2.0, 2.0]), [2.0]);
}

/// A rectangle whose node's scale goes from 1 to `last` in a second.
fn scaled_to(last: [f32; 3]) -> Document {
    let mut document = Document::rectangle();
    document.node()["name"] = "sail".into();
    let about = |kind: &str| json!({"componentType": 5126, "count": 2, "type": kind});
    let times = document.accessor(&f32s(&[0.0, 1.0]), about("SCALAR"));
    let scales = [[1.0; 3], last].concat();
    let scales = document.accessor(&f32s(&scales), about("VEC3"));
    document.json["animations"] = json!([{
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "scale"}}],
        "samplers": [{"input": times, "output": scales}]}]);
    document
}

#[test]
fn nodes_that_turn_inside_out_while_the_shutter_is_open_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.gltf");
    std::fs::write(&path, scaled_to([-1.0, 1.0, 1.0]).text()).unwrap();
    for (shutter, named) in [([0.0, 1.0], true), ([0.0, 0.4], false), ([0.6, 1.0], false)] {
        let animation = read_gltf_animation(&path, shutter, &Budget::default());
        let turned_over = animation.unwrap().unwrap().turned_over;
        let expected = named.then(|| r#"node 0 ("sail")"#.to_owned());
        assert_eq!(turned_over, Vec::from_iter(expected), "{shutter:?}");
    }
}

#[test]
fn an_animation_s_values_are_numbers_of_a_size_that_can_be_rendered() {
    for wrong in [f32::NAN, f32::INFINITY, 1e30] {
        let options = ReadOptions {
            time: Some(crate::mesh::Time::of(0.5)),
            ..ReadOptions::default()
        };
        let read = decode("test.gltf", &scaled_to([1.0, wrong, 1.0]).text(), &options);
        let error = read.unwrap_err().to_string();
        assert!(
            error.contains("test.gltf")
                && error.contains("animation 0, channel 0: the scale of node 0")
                && error.contains("keyframe 1"),
            "{error}"
        );
    }
}

#[test]
fn an_animation_that_is_none_is_told() {
    let mut document = Document::rectangle();
    let about = json!({"componentType": 5126, "count": 2, "type": "SCALAR"});
    let times = document.accessor(&f32s(&[0.0, 1.0]), about.clone());
    let channel = json!({"sampler": 0, "target": {"node": 0, "path": "weights"}});
    let with = |document: &mut Document, channel: Value, sampler: Value| {
        document.json["animations"] = json!([{"channels": [channel], "samplers": [sampler]}]);
        let options = ReadOptions {
            time: Some(crate::mesh::Time::of(0.5)),
            ..ReadOptions::default()
        };
        let read = decode("test.gltf", &document.text(), &options);
        read.unwrap_err().to_string()
    };
    let sampler = json!({"input": times, "output": times});
    for (channel, sampler, says) in [
        (
            json!({"sampler": 7, "target": {"node": 0, "path": "scale"}}),
            sampler.clone(),
            "sampler 7",
        ),
        (
            json!({"sampler": 0, "target": {"node": 9, "path": "scale"}}),
            sampler.clone(),
            "node 9",
        ),
        (
            json!({"sampler": 0, "target": {"node": 0, "path": "scale"}}),
            sampler.clone(),
            "3 components",
        ),
        (
            channel.clone(),
            json!({"input": times, "output": times, "interpolation": "CUBICSPLINE"}),
            "are no animation",
        ),
        (
            channel,
            json!({"input": times, "output": times, "interpolation": "WAVE"}),
            "\"WAVE\" is unknown",
        ),
    ] {
        let error = with(&mut document, channel, sampler);
        assert!(error.contains(says), "{error}");
    }
}
