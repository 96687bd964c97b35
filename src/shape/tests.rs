//! What every surface with an equation of its own must do, looped over them, and Mitsuba's numbers.

use std::f64::consts::PI;
use std::path::Path;

use super::*;
use crate::description::{Description, Options};
use crate::lanes::warp;
use crate::math::random;

const TILTED: &str = r#"<rotate x="1" angle="30"/><translate x="0.5" y="-2" z="1"/></transform>"#;

const CAPS: &str = r#"<boolean name="caps" value="true"/>"#;
const OPEN: &str = r#"<boolean name="base" value="false"/>"#;

/// Scene text of each, with its area.
fn surfaces() -> Vec<(String, f64)> {
    let placed = |plugin: &str, scale: &str, more: &str| {
        format!(
            r#"<shape type="{plugin}">{more}<transform name="to_world"><scale value="{scale}"/>{TILTED}</shape>"#
        )
    };
    let flipped = r#"<boolean name="flip_normals" value="true"/>"#;
    let ends = r#"<point name="p0" value="1, 0, 0"/><point name="p1" value="1, 2, 1"/>"#;
    // The circumference of an ellipse of half axes 1 and 2.
    let ellipse = 9.688_448_220_547_675;
    vec![
        (placed("sphere", "2", ""), 16.0 * PI),
        (placed("sphere", "-1, 1, 1", flipped), 4.0 * PI),
        (placed("disk", "1", ""), PI),
        (placed("disk", "-3, 0.5, 7", flipped), 1.5 * PI),
        (placed("cylinder", "1", flipped), 2.0 * PI),
        (placed("cylinder", "2", ends), 8.0 * PI * 5f64.sqrt()),
        (placed("cylinder", "1, 2, -3", ""), 3.0 * ellipse),
        (
            placed("cylinder", "1, 2, -3", CAPS),
            3.0 * ellipse + 4.0 * PI,
        ),
        (
            placed("cylinder", "-1", &[CAPS, flipped].concat()),
            4.0 * PI,
        ),
        (placed("cone", "1", ""), PI + PI * 2f64.sqrt()),
        (placed("cone", "3, 3, -4", flipped), 9.0 * PI + 15.0 * PI),
        (
            placed("cone", "1", &[ends, OPEN].concat()),
            PI * 6f64.sqrt(),
        ),
    ]
}

fn geometry(text: &str) -> Geometry {
    let text = format!(r#"<scene version="3.0.0">{text}</scene>"#);
    let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
    let shape = build(&scene.root().children(Kind::Shape)[0]).unwrap();
    shape.geometry
}

fn point(seed: u64, i: u32) -> Vec2 {
    let unit = |n| random::unit(random::bits(seed, n));
    Vec2::new(unit(2 * i), unit(2 * i + 1))
}

fn ray(origin: Vec3, target: Vec3) -> Ray {
    Ray {
        origin,
        direction: (target - origin).normalize(),
        t_max: f32::INFINITY,
        time: 0.0,
    }
}

/// The first hit on a surface that is no mesh.
fn meet<'g>(geometry: &'g Geometry, ray: &Ray) -> Option<Interaction<'g>> {
    let hits = (0..geometry.primitive_count()).filter_map(|primitive| {
        let (t, u, v) = geometry.intersect(primitive, ray)?;
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
    Some(geometry.interaction(ray, &hit))
}

fn bounds(geometry: &Geometry) -> Bounds {
    let boxes = (0..geometry.primitive_count()).map(|primitive| geometry.bounds(primitive));
    boxes.fold(Bounds::EMPTY, Bounds::union)
}

/// Where the surface is looked at from.
fn viewpoints(geometry: &Geometry) -> Vec<Vec3> {
    let Bounds { min, max } = bounds(geometry);
    let (center, size) = (0.5 * (min + max), (max - min).length());
    let around =
        (0..6).map(|i| center + size * 0.9 * Vec3::from(warp::uniform_sphere(point(7, i).into())));
    around.chain([center + Vec3::splat(0.01)]).collect()
}

#[test]
fn every_surface_has_its_area_and_lies_in_its_box() {
    for (text, area) in surfaces() {
        let geometry = geometry(&text);
        assert!((geometry.area() / area - 1.0).abs() < 1e-6, "{text}");
        let bounds = bounds(&geometry);
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for i in 0..20_000 {
            let sample = geometry.sample(Vec3::splat(30.0), point(1, i));
            for p in sample.into_iter().map(|s| s.position) {
                assert!(
                    p.cmpge(bounds.min).all() && p.cmple(bounds.max).all(),
                    "{text}"
                );
                (low, high) = (low.min(p), high.max(p));
            }
        }
        // A sphere is only drawn where it is seen.
        if !text.contains("sphere") {
            let slack = (bounds.max - bounds.min) - (high - low);
            assert!(slack.max_element() < 0.05, "{text}: the box is too large");
        }
    }
}

#[test]
fn every_surface_is_met_where_it_is_drawn_with_the_same_normal_uv_and_density() {
    for (text, _) in surfaces() {
        let geometry = geometry(&text);
        for from in viewpoints(&geometry) {
            let mut seen = 0;
            for i in 0..2000 {
                let Some(sample) = geometry.sample(from, point(2, i)) else {
                    continue;
                };
                let ray = ray(from, sample.position);
                let Some(at) = meet(&geometry, &ray) else {
                    continue; // it grazes
                };
                let scale = from.distance(sample.position);
                if at.position.distance(sample.position) > 1e-4 * scale {
                    continue; // it stands in its own way
                }
                if at.primitive != sample.primitive {
                    continue; // it is at an edge
                }
                seen += 1;
                assert!(at.position.distance(ray.at(at.t)) < 1e-4 * scale, "{text}");
                assert!(at.normal.dot(sample.normal) > 0.999, "{text}");
                assert!(
                    (at.uv - geometry.uv(&sample)).abs().max_element() < 0.01 || at.uv.x < 0.01
                );
                assert!(at.uv.cmpge(Vec2::ZERO).all() && at.uv.cmple(Vec2::ONE).all());
                if at.wi.z.abs() > 0.05 {
                    let ratio = geometry.pdf(from, &at) / sample.pdf;
                    assert!((ratio - 1.0).abs() < 0.02, "{text}: {ratio}");
                }
            }
            assert!(seen > 250, "{text}: {seen}");
        }
    }
}

#[test]
fn the_reciprocal_density_of_light_samples_adds_up_to_the_area() {
    for (text, _) in surfaces()
        .into_iter()
        .filter(|(t, _)| !t.contains("sphere"))
    {
        let geometry = geometry(&text);
        for from in viewpoints(&geometry) {
            let n = 4000;
            let sum: f64 = (0..n)
                .filter_map(|i| geometry.sample(from, point(3, i)))
                .map(|s| {
                    let way = s.position - from;
                    let cosine = s.normal.dot(way.normalize()).abs();
                    f64::from(way.length_squared() / (cosine * s.pdf))
                })
                .sum();
            let ratio = sum / f64::from(n) / geometry.area();
            assert!((ratio - 1.0).abs() < 0.03, "{text}: {ratio}");
        }
    }
}

#[test]
fn positions_change_with_u_and_v_as_the_tangents_say() {
    for (text, _) in surfaces() {
        let geometry = geometry(&text);
        let (from, mut tried) = (viewpoints(&geometry)[0], 0);
        for i in 0..400 {
            let Some(at) = (geometry.sample(from, point(4, i)))
                .and_then(|s| meet(&geometry, &ray(from, s.position)))
            else {
                continue;
            };
            for (tangent, expected) in [(at.dp_du, Vec2::X), (at.dp_dv, Vec2::Y)] {
                let step = 1e-3 / tangent.length().max(1.0);
                let target = at.position + step * tangent;
                let near = meet(&geometry, &ray(target + 0.1 * at.normal, target));
                let Some(near) = near.filter(|n| n.position.distance(target) < 1e-4) else {
                    continue;
                };
                let change = (near.uv - at.uv) / step;
                let flat = at.uv.y > 0.1 && at.uv.y < 0.9 && at.uv.x > 0.1 && at.uv.x < 0.9;
                if flat {
                    tried += 1;
                    assert!(
                        change.distance(expected) < 0.03,
                        "{text} {}: {change}",
                        at.uv
                    );
                }
            }
        }
        assert!(tried > 50, "{text}: {tried}");
    }
}

/// A ray's origin and direction, and what Mitsuba 3.9.1 says of its hit.
type Probe = (
    [f32; 3],
    [f32; 3],
    f32,
    [f32; 3],
    [f32; 2],
    [f32; 3],
    [f32; 3],
);

#[test]
fn hits_are_those_of_mitsuba() {
    let ends = r#"<point name="p0" value="1, 0, 0"/><point name="p1" value="1, 2, 1"/><float name="radius" value="0.5"/>"#;
    let scaled = |plugin: &str, scale: &str| {
        format!(
            r#"<shape type="{plugin}"><transform name="to_world"><scale value="{scale}"/></transform></shape>"#
        )
    };
    let probes: [(String, Probe); 6] = [
        (
            scaled("disk", "1"),
            (
                [-0.3, -0.4, -2.0],
                [0.0, 0.0, 1.0],
                2.0,
                [0.0, 0.0, 1.0],
                [0.5, 0.647_584],
                [-0.6, -0.8, 0.0],
                [2.513_27, -1.884_96, 0.0],
            ),
        ),
        (
            scaled("disk", "-1, 1, 1"),
            (
                [0.3, 0.4, 2.0],
                [0.0, 0.0, -1.0],
                2.0,
                [0.0, 0.0, 1.0],
                [0.5, 0.352_416],
                [0.6, 0.8, 0.0],
                [2.513_27, -1.884_96, 0.0],
            ),
        ),
        (
            scaled("sphere", "-1, 1, 1"),
            (
                [0.3, 0.4, 2.0],
                [0.0, 0.0, -1.0],
                1.133_974_6,
                [-0.3, -0.4, -0.866_025],
                [0.352_416, 0.166_667],
                [2.513_27, -1.884_96, 0.0],
                [1.632_42, 2.176_56, -std::f32::consts::FRAC_PI_2],
            ),
        ),
        (
            scaled("cylinder", "1.5, 1.5, 2"),
            (
                [3.0, 0.2, 0.3],
                [-1.0, 0.0, 0.0],
                1.513_393,
                [0.991_071, 0.133_333, 0.0],
                [0.021_284, 0.15],
                [-1.256_64, 9.340_63, 0.0],
                [0.0, 0.0, 2.0],
            ),
        ),
        (
            scaled("cylinder", "1, 1, -1"),
            (
                [3.0, 0.2, -0.3],
                [-1.0, 0.0, 0.0],
                2.020_203_8,
                [0.979_796, 0.2, 0.0],
                [0.032_047_1, 0.3],
                [-1.256_64, 6.156_24, 0.0],
                [0.0, 0.0, -1.0],
            ),
        ),
        (
            format!(r#"<shape type="cylinder">{ends}</shape>"#),
            (
                [3.0, 0.5, 0.3],
                [-1.0, 0.0, 0.0],
                1.502_004,
                [0.995_992, -0.04, 0.08],
                [0.985_746, 0.26],
                [0.280_992, 1.399_33, -2.798_66],
                [0.0, 2.0, 1.0],
            ),
        ),
    ];
    for (text, (origin, direction, t, normal, uv, dp_du, dp_dv)) in probes {
        let geometry = geometry(&text);
        let origin = Vec3::from_array(origin);
        let at = meet(
            &geometry,
            &ray(origin, origin + Vec3::from_array(direction)),
        )
        .unwrap();
        let near = |ours: Vec3, mitsuba: [f32; 3]| {
            assert!(
                ours.distance(Vec3::from_array(mitsuba)) < 1e-4,
                "{text}: {ours} {mitsuba:?}"
            );
        };
        near(Vec3::splat(at.t), [t; 3]);
        near(at.normal, normal);
        near(at.uv.extend(0.0), [uv[0], uv[1], 0.0]);
        near(at.dp_du, dp_du);
        near(at.dp_dv, dp_dv);
    }
}

#[test]
fn a_plane_goes_on_where_the_rectangle_ends() {
    let placed = |plugin: &str| {
        geometry(&format!(
            r#"<shape type="{plugin}"><transform name="to_world"><scale value="2, 3, 1"/>{TILTED}</shape>"#
        ))
    };
    let (plane, rectangle) = (placed("plane"), placed("rectangle"));
    assert!(plane.bounds(0).is_unbounded() && plane.area().is_infinite());
    assert!(plane.sample(Vec3::ZERO, Vec2::ZERO).is_none());
    for i in 0..100 {
        let on = rectangle.sample(Vec3::Z, point(5, i)).unwrap();
        let at = meet(&plane, &ray(Vec3::Z, on.position)).unwrap();
        assert!(at.position.distance(on.position) < 1e-5);
        assert!(at.normal.distance(on.normal) < 1e-5);
        assert!(at.uv.distance(rectangle.uv(&on)) < 1e-5);
        assert!((at.dp_du.length() - 4.0).abs() < 1e-5 && (at.dp_dv.length() - 6.0).abs() < 1e-5);
    }
}

#[test]
fn triangles_and_polygons_have_their_corners_and_their_texture_coordinates() {
    let corners = r#"<point name="p0" value="0, 0, 1"/><point name="p1" value="4, 0, 1"/>
        <point name="p2" value="0, 2, 1"/>"#;
    let uv = r#"<string name="uv" value="0 0, 0.5 0, 0 0.25"/>"#;
    let normals = r#"<vector name="n0" value="0, 0, 2"/><vector name="n1" value="1, 0, 1"/>
        <vector name="n2" value="0, 0, 1"/>"#;
    for (text, uvs, bent) in [
        (
            format!(r#"<shape type="triangle">{corners}</shape>"#),
            [0.0, 1.0, 1.0],
            false,
        ),
        (
            format!(r#"<shape type="polygon">{corners}</shape>"#),
            [0.0, 1.0, 1.0],
            false,
        ),
        (
            format!(r#"<shape type="triangle">{corners}{uv}{normals}</shape>"#),
            [0.0, 0.5, 0.25],
            true,
        ),
        (
            format!(r#"<shape type="polygon">{corners}{uv}</shape>"#),
            [0.0, 0.5, 0.25],
            false,
        ),
    ] {
        let geometry = geometry(&text);
        let mesh = geometry.mesh().unwrap();
        assert_eq!(mesh.triangles.len(), 1, "{text}");
        assert_eq!(geometry.area(), 4.0);
        let expected = [
            Vec2::splat(uvs[0]),
            Vec2::new(uvs[1], 0.0),
            Vec2::new(0.0, uvs[2]),
        ];
        assert_eq!(mesh.uvs, expected, "{text}");
        assert_eq!(mesh.normals[0], Vec3::Z);
        assert_eq!(mesh.normals[1] == Vec3::Z, !bent);
    }
}

#[test]
fn shapes_that_enclose_nothing_or_are_not_flat_are_refused_with_the_reason() {
    let points = |points: &[&str]| -> String {
        let one = |(i, p): (usize, &&str)| format!(r#"<point name="p{i}" value="{p}"/>"#);
        points.iter().enumerate().map(one).collect()
    };
    let square = ["0,0,0", "1,0,0", "1,1,0", "0,1,0"];
    for (plugin, body, message) in [
        (
            "cone",
            r#"<float name="radius" value="0"/>"#.into(),
            "radius must be above 0",
        ),
        ("triangle", points(&square[..2]), "needs \"p2\""),
        (
            "triangle",
            points(&["0,0,0", "1,1,1", "2,2,2"]),
            "on a line",
        ),
        (
            "triangle",
            points(&square[..3]) + r#"<vector name="n0" value="0,0,1"/>"#,
            "at each corner or at none",
        ),
        (
            "triangle",
            points(&square[..3]) + r#"<string name="uv" value="0 0 1 x 0 1"/>"#,
            "3 pairs",
        ),
        ("polygon", points(&square[..2]), "three corners"),
        (
            "polygon",
            points(&square).replace("p2", "p4"),
            "no corner p2",
        ),
        (
            "polygon",
            points(&["0,0,0", "1,0,0", "1,1,0.1", "0,1,0"]),
            "not flat",
        ),
        (
            "polygon",
            points(&["0,0,0", "1,0,0", "1,0,0", "0,1,0"]),
            "p1 is the same as the next",
        ),
        (
            "polygon",
            points(&["0,0,0", "1,1,0", "2,2,0"]),
            "encloses no area",
        ),
        (
            "polygon",
            points(&["0,0,0", "2,2,0", "2,0,0", "0,1,0"]),
            "crosses itself",
        ),
        (
            "polygon",
            points(&["0,0,0", "4,0,0", "2,0,0", "2,2,0"]),
            "turns back",
        ),
    ] {
        let text =
            format!(r#"<scene version="3.0.0"><shape type="{plugin}">{body}</shape></scene>"#);
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
        let error = build(&scene.root().children(Kind::Shape)[0]).unwrap_err();
        assert!(error.to_string().contains(message), "{text}: {error}");
    }
}

#[test]
fn surfaces_of_no_extent_are_refused() {
    for text in [
        r#"<shape type="cylinder"><float name="radius" value="0"/></shape>"#,
        r#"<shape type="cylinder"><point name="p0" value="0, 0, 1"/></shape>"#,
        r#"<shape type="sphere"><float name="radius" value="0"/></shape>"#,
    ] {
        let text = format!(r#"<scene version="3.0.0">{text}</scene>"#);
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
        assert!(
            build(&scene.root().children(Kind::Shape)[0]).is_err(),
            "{text}"
        );
    }
}

/// As Mitsuba 3.9.1 renders both.
#[test]
fn a_sphere_of_negative_radius_is_one_that_is_scaled_by_a_negative_number() {
    let negative = geometry(
        r#"<shape type="sphere"><point name="center" value="1, 0, 0"/><float name="radius" value="-2"/></shape>"#,
    );
    let mirrored = geometry(
        r#"<shape type="sphere"><transform name="to_world"><scale value="-2"/><translate x="1"/></transform></shape>"#,
    );
    let told = |sphere: &Geometry| format!("{sphere:?}").replace("-0.0", "0.0");
    assert_eq!(told(&negative), told(&mirrored));
}

#[test]
fn flipped_meshes_without_texture_coordinates_have_the_u_and_v_of_unflipped_ones() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("quad.obj");
    std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
    for flip in [false, true] {
        let quad = geometry(&format!(
            r#"<shape type="obj"><string name="filename" value="{}"/><boolean name="flip_normals" value="{flip}"/></shape>"#,
            path.display()
        ));
        let Geometry::Mesh(mesh) = &quad else {
            panic!("an obj is a mesh")
        };
        // As Mitsuba 3.9.1 gives them: the place, uv, dp_du and dp_dv.
        for (primitive, place, uv, dp_du, dp_dv) in [
            (0, (0.7, 0.2), (0.5, 0.2), (1.0, 0.0), (1.0, 1.0)),
            (1, (0.2, 0.7), (0.2, 0.5), (1.0, 1.0), (0.0, 1.0)),
        ] {
            let place = Vec2::from(place);
            let [a, b, c] = mesh.corners(primitive).map(Vec3::truncate);
            let whole = (b - a).perp_dot(c - a);
            let hit = Hit {
                t: 5.0,
                u: (place - a).perp_dot(c - a) / whole,
                v: (b - a).perp_dot(place - a) / whole,
                shape: 0,
                primitive,
                instance: Hit::NONE,
            };
            let from = ray(place.extend(5.0), place.extend(0.0));
            let at = quad.interaction(&from, &hit);
            let is = |found: Vec2, wanted: (f32, f32)| {
                assert!(
                    found.distance(wanted.into()) < 1e-6,
                    "{flip}: {found} for {wanted:?}"
                );
            };
            is(at.uv, uv);
            is(at.dp_du.truncate(), dp_du);
            is(at.dp_dv.truncate(), dp_dv);
            assert_eq!(at.normal, if flip { Vec3::NEG_Z } else { Vec3::Z });
        }
    }
}

/// Mitsuba 3.9.1 renders spheres that are stretched along y or z, or sheared, as it does the unit sphere.
#[test]
fn a_stretched_sphere_is_one_of_the_radius_along_x_and_warns() {
    for (transform, radius) in [
        (r#"<scale x="2"/>"#, 2.0),
        (r#"<scale y="2"/><rotate z="1" angle="30"/>"#, 1.0),
        (r#"<scale y="0"/>"#, 1.0),
        (r#"<scale x="1.5" y="0" z="0"/>"#, 1.5),
        (r#"<matrix value="1 1 0 0 1 0 0 0 1"/>"#, 1.0),
    ] {
        let text = format!(
            r#"<scene version="3.0.0"><shape type="sphere"><transform name="to_world">{transform}</transform></shape></scene>"#
        );
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
        let shape = build(&scene.root().children(Kind::Shape)[0]).unwrap();
        assert_eq!(shape.warnings.len(), 1, "{transform}");
        let area = 4.0 * PI * radius * radius;
        assert!(
            (shape.geometry.area() / area - 1.0).abs() < 1e-6,
            "{transform}"
        );
        let eye = ray(Vec3::new(0.1, 0.2, 5.0), Vec3::ZERO);
        let at = meet(&shape.geometry, &eye).expect("a hit");
        assert!(
            (f64::from(at.position.length()) - radius).abs() < 1e-5,
            "{transform}"
        );
        assert!(
            (at.normal - at.position.normalize()).length() < 1e-5,
            "{transform}"
        );
        assert!(at.dp_du.is_finite() && at.uv.is_finite(), "{transform}");
    }
}
