//! Ellipsoids and their hulls: Mitsuba's numbers, and files that hold none.

use std::path::Path;

use super::*;
use crate::description::{Description, Options};

const COLUMNS: [&str; 13] = [
    "x", "y", "z", "nx", "ny", "nz", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2",
    "rot_3",
];

/// Two ellipsoids, the second a ball.
fn rows() -> [[f32; 13]; 2] {
    let [a, b, c] = [0.3_f32, 0.1, 0.2].map(f32::ln);
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, a, b, c, 0.9, 0.1, 0.2, 0.3],
        [2.0, 0.0, 0.0, 0.0, 0.0, 0.0, c, c, c, 1.0, 0.0, 0.0, 0.0],
    ]
}

/// A PLY file in a format, with opacities of a kind before the scales.
fn ply(format: &str, opacity: Option<(&str, [f32; 2])>) -> Vec<u8> {
    let mut columns: Vec<&str> = COLUMNS.to_vec();
    let mut rows = rows().map(|row| row.to_vec());
    if let Some((name, values)) = opacity {
        columns.insert(6, name);
        for (row, value) in rows.iter_mut().zip(values) {
            row.insert(6, value);
        }
    }
    let properties: String = columns
        .iter()
        .map(|c| format!("property float {c}\n"))
        .collect();
    let mut bytes =
        format!("ply\nformat {format} 1.0\ncomment hi\nelement vertex 2\n{properties}end_header\n")
            .into_bytes();
    for row in &rows {
        for value in row {
            match format {
                "ascii" => bytes.extend(format!("{value} ").bytes()),
                "binary_big_endian" => bytes.extend(value.to_be_bytes()),
                _ => bytes.extend(value.to_le_bytes()),
            }
        }
    }
    bytes
}

fn try_build(plugin: &str, bytes: &[u8], more: &str) -> Result<Shape> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud.ply");
    std::fs::write(&path, bytes).unwrap();
    let text = format!(
        r#"<scene version="3.0.0"><shape type="{plugin}"><string name="filename" value="{}"/>{more}</shape></scene>"#,
        path.display()
    );
    let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
    build(&scene.root().children(Kind::Shape)[0])
}

fn meet<'g>(
    geometry: &'g Geometry,
    origin: [f32; 3],
    direction: [f32; 3],
) -> Option<Interaction<'g>> {
    let ray = Ray {
        origin: origin.into(),
        direction: Vec3::from(direction).normalize(),
        t_max: f32::INFINITY,
        time: 0.0,
    };
    let hits = (0..geometry.primitive_count()).filter_map(|primitive| {
        let (t, u, v) = geometry.intersect(primitive, &ray)?;
        let (bounds, place) = (geometry.bounds(primitive), ray.at(t));
        assert!(place.cmpge(bounds.min - 1e-5).all() && place.cmple(bounds.max + 1e-5).all());
        Some(Hit {
            t,
            u,
            v,
            instance: Hit::NONE,
            shape: 0,
            primitive,
        })
    });
    let hit = hits.min_by(|a, b| a.t.total_cmp(&b.t))?;
    Some(geometry.interaction(&ray, &hit))
}

const DOWN: [f32; 3] = [0.0, 0.0, -1.0];
const BACK: [f32; 3] = [-1.0, 0.0, 0.0];

#[test]
fn ellipsoids_are_met_where_mitsuba_meets_them() {
    let rows = [
        (
            "ellipsoids",
            "",
            [0.1, 0.1, 5.0],
            DOWN,
            4.508_628,
            [-0.204_71, 0.618_1, 0.758_97],
            0,
        ),
        (
            "ellipsoids",
            "",
            [5.0, 0.05, 0.02],
            BACK,
            2.402_422,
            [0.995_96, 0.083_33, 0.033_33],
            1,
        ),
        // From inside of the first.
        (
            "ellipsoids",
            "",
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            1.4,
            [-1.0, 0.0, 0.0],
            1,
        ),
        (
            "ellipsoids",
            r#"<float name="extent" value="1"/>"#,
            [0.1, 0.1, 5.0],
            DOWN,
            4.884_073,
            [-0.131_93, 0.740_06, 0.659_47],
            0,
        ),
        (
            "ellipsoids",
            r#"<float name="scale_factor" value="0.5"/>"#,
            [0.1, 0.1, 5.0],
            DOWN,
            4.785_716,
            [-0.169_96, 0.679_97, 0.713_27],
            0,
        ),
        (
            "ellipsoidsmesh",
            "",
            [0.1, 0.1, 5.0],
            DOWN,
            4.477_274,
            [-0.396_37, 0.673_47, 0.623_97],
            0,
        ),
        (
            "ellipsoidsmesh",
            "",
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            1.389_151,
            [-0.982_25, 0.187_6, 0.0],
            1,
        ),
        (
            "ellipsoidsmesh",
            r#"<string name="shell" value="box"/>"#,
            [0.1, 0.1, 5.0],
            DOWN,
            4.435_783,
            [0.442_11, -0.063_16, 0.894_74],
            0,
        ),
        (
            "ellipsoidsmesh",
            r#"<string name="shell" value="uv_sphere"/>"#,
            [0.1, 0.1, 5.0],
            DOWN,
            4.504_015,
            [-0.163_4, 0.599_62, 0.783_43],
            0,
        ),
    ];
    for (plugin, more, origin, direction, t, normal, primitive) in rows {
        let shape = try_build(plugin, &ply("binary_little_endian", None), more).unwrap();
        let at = meet(&shape.geometry, origin, direction).unwrap();
        // Mitsuba's own are in single precision.
        assert!((at.t - t).abs() < 3e-4, "{plugin} {more}: {}", at.t);
        assert!(
            at.normal.distance(normal.into()) < 2e-3,
            "{plugin} {more}: {}",
            at.normal
        );
        assert_eq!(at.primitive, primitive, "{plugin} {more}");
    }
    // A hull's texture coordinates are those of its triangles.
    for (more, origin, uv, dp_du) in [
        (
            "",
            [0.1, 0.1, 5.0],
            [0.617_705, 0.108_059],
            [0.931_06, 0.675_97, -0.138_14],
        ),
        (
            r#"<string name="shell" value="box"/>"#,
            [0.1, 0.1, 5.0],
            [0.349_461, 0.527_325],
            [-0.285_64, 0.428_46, 0.171_39],
        ),
    ] {
        let shape = try_build("ellipsoidsmesh", &ply("ascii", None), more).unwrap();
        let at = meet(&shape.geometry, origin, DOWN).unwrap();
        assert!(
            at.uv.distance(uv.into()) < 1e-4 && at.dp_du.distance(dp_du.into()) < 1e-4,
            "{} {}",
            at.uv,
            at.dp_du
        );
    }
}

#[test]
fn files_of_all_orders_of_bytes_are_the_same_and_those_less_opaque_reach_less_far() {
    let bounds = |bytes: &[u8], more: &str| {
        let shape = try_build("ellipsoids", bytes, more).unwrap();
        let all = (0..shape.geometry.primitive_count()).map(|i| shape.geometry.bounds(i));
        (all.fold(Bounds::EMPTY, Bounds::union), shape.warnings.len())
    };
    let (little, warnings) = bounds(&ply("binary_little_endian", None), "");
    assert!(little.min.distance(Vec3::new(-0.722_91, -0.6, -0.614_776)) < 1e-5 && warnings == 0);
    for format in ["binary_big_endian", "ascii"] {
        assert!(bounds(&ply(format, None), "").0.max.distance(little.max) < 1e-6);
    }
    let adaptive = r#"<boolean name="extent_adaptive_clamping" value="true"/>"#;
    assert_eq!(bounds(&ply("ascii", None), adaptive), (little, 1));
    // The second is too faint to be there, the first reaches √(2 ln 50)/3 as far.
    let faint = ply("ascii", Some(("opacities", [0.5, 0.005])));
    let reach = (2.0 * 50_f32.ln()).sqrt() / 3.0;
    let ratio = bounds(&faint, adaptive).0.min.x / little.min.x;
    assert!((ratio - reach).abs() < 1e-5);
    assert!(bounds(&faint, adaptive).0.max.x < 1.0);
    let turned =
        r#"<transform name="to_world"><scale value="2"/><rotate z="1" angle="90"/></transform>"#;
    let (turned, warnings) = bounds(&ply("ascii", None), turned);
    assert!((turned.min.y / little.min.x - 2.0).abs() < 1e-5 && warnings == 0);
    let stretched = r#"<transform name="to_world"><scale value="1, 2, 3"/></transform>"#;
    let (stretched, warnings) = bounds(&ply("ascii", None), stretched);
    // As in Mitsuba.
    assert!(stretched.max.distance(Vec3::new(3.2, 1.2, 1.229_55)) < 1e-4 && warnings == 1);
}

#[test]
fn files_that_hold_no_ellipsoids_are_refused_with_the_reason() {
    let good = ply("ascii", None);
    let text = String::from_utf8(good.clone()).unwrap();
    for (bytes, message) in [
        (b"solid".to_vec(), "head of the PLY file is damaged"),
        (text.replace("ply", "plx").into_bytes(), "no PLY file"),
        (
            text.replace("float rot_0", "uchar rot_0").into_bytes(),
            "is no float",
        ),
        (
            text.replace(" nx", " mx").into_bytes(),
            "holds no ellipsoids",
        ),
        (
            text.replace("vertex 2", "vertex 9999999999").into_bytes(),
            "promises 9999999999 ellipsoids and has 2",
        ),
        (text.replace("0.9 ", "x ").into_bytes(), "is no number"),
        (
            text.replace("0.9 ", "nan ").into_bytes(),
            "ellipsoid 0 is not finite",
        ),
        (good[..good.len() - 40].to_vec(), "promises 2"),
    ] {
        let said = try_build("ellipsoids", &bytes, "").unwrap_err().to_string();
        assert!(said.contains(message), "{said:?} lacks {message:?}");
    }
}
