use std::path::Path;
use std::sync::Arc;

use super::*;
use crate::accel::{Method, Tracer};
use crate::color::Rgb;
use crate::description::{Description, Kind, Options};
use crate::math::Bounds;
use crate::mesh::Mesh;
use crate::scene::{Assets, Scene, build};
use crate::sensor::{Film, Sensor, Window};
use crate::shape::{Geometry, TriangleMesh};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// A scene with its first sensor.
pub(super) fn scene(body: &str) -> (Scene<Rgb>, Sensor, Film) {
    let text = format!("<scene version='3.0.0'>{body}</scene>");
    let scene = Description::parse(&text, Path::new("test.xml"), &Options::default());
    let scene = scene.unwrap_or_else(|e| panic!("{e}"));
    let sensor = &scene.root().children(Kind::Sensor)[0];
    let film = match sensor.child(Kind::Film).unwrap() {
        Some(film) => Film::build(&film).unwrap(),
        None => Film::default(),
    };
    let sensor = Sensor::build(sensor, &film).unwrap();
    let assets = Assets::load(&scene, None, None, &|| ()).unwrap_or_else(|e| panic!("{e}"));
    let scene = build(&scene, &assets, Rgb, Method::Tree).unwrap_or_else(|e| panic!("{e}"));
    (scene, sensor, film)
}

/// A sensor that looks at the origin from (1, 3, 4), with a small film.
pub(super) fn sensor(plugin: &str, inside: &str) -> String {
    let required = match plugin {
        "thinlens" => "<float name='aperture_radius' value='0.1'/>",
        _ => "",
    };
    format!(
        "<sensor type='{plugin}'>{required}{inside}<transform name='to_world'>
        <lookat origin='1,3,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>
        <integer name='width' value='80'/><integer name='height' value='60'/></film></sensor>"
    )
}

fn draw(
    scene: &Scene<Rgb>,
    projection: &Projection,
    size: [u32; 2],
    pattern: Pattern,
    cull: Cull,
) -> Visibility {
    let drawn = Drawn::new(scene.tracer(), projection, 0.0, |_| true).unwrap();
    let canvas = Canvas {
        pattern,
        cull,
        ..Canvas::whole(size)
    };
    Visibility::draw(&drawn, projection, &canvas).unwrap()
}

#[test]
fn every_sensor_s_projection_puts_points_where_its_rays_go() {
    for (plugin, inside) in [
        ("perspective", "<float name='fov' value='100'/>"),
        (
            "perspective",
            "<float name='principal_point_offset_x' value='0.2'/><float name='principal_point_offset_y' value='-0.3'/>",
        ),
        ("thinlens", "<float name='focus_distance' value='3'/>"),
        ("orthographic", "<float name='near_clip' value='0.5'/>"),
    ] {
        let (_, sensor, film) = scene(&sensor(plugin, inside));
        let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
        let (x, y) = (13.5, 47.25);
        let place = DVec2::new(x / 80.0, y / 60.0).as_vec2();
        let ray = sensor.ray(place, Vec2::splat(0.5), 0.0);
        for t in [0.0, 1.0, 7.0, 123.0, ray.t_max] {
            let found = projection.place(ray.at(t).as_dvec3());
            let off = (found.x / found.w - x).hypot(found.y / found.w - y);
            // Where a ray begins and where it ends single precision is coarse.
            let coarse = t == 0.0 || t == ray.t_max;
            assert!(off < if coarse { 0.1 } else { 1e-3 }, "{plugin} {t}: {off}");
            let [near, far] = projection.range();
            let part = (found.a - near) / (far - near);
            assert!(
                (part - f64::from(t / ray.t_max)).abs() < 1e-6,
                "{plugin} {t}"
            );
        }
        let line = projection.line(DVec2::new(x, y));
        let way = line.way.normalize().as_vec3();
        assert!(way.distance(ray.direction) < 1e-6, "{plugin}");
    }
}

#[test]
fn a_closed_mesh_covers_every_sample_once_from_each_side() {
    // Seen from within every sample meets one triangle: with backs and with fronts left out none is drawn twice and there are
    // no cracks, so that fronts and backs cover the picture once together.
    let body = "<shape type='sphere'><float name='radius' value='9'/></shape>";
    let (scene, sensor, film) = scene(&format!("{}{body}", sensor("perspective", "")));
    let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
    for count in COUNTS {
        let pattern = Pattern::of(count).unwrap();
        let covered = |cull| draw(&scene, &projection, [80, 60], pattern, cull).covered();
        let all = 80 * 60 * count as usize;
        assert_eq!(covered(Cull::None), all);
        // Normals point outward: all that is seen from within is backs.
        assert_eq!(covered(Cull::Front), all);
        assert_eq!(covered(Cull::Back), 0);
    }
}

#[test]
fn culling_takes_the_side_that_normals_tell() {
    for (flip, mirrored) in [(false, false), (true, false), (false, true), (true, true)] {
        let scale = if mirrored { "<scale x='-1'/>" } else { "" };
        let body = format!(
            "<shape type='shapegroup' id='g'><shape type='cube'><boolean name='flip_normals' value='{flip}'/></shape></shape>
            <shape type='instance'><ref id='g'/><transform name='to_world'>{scale}</transform></shape>"
        );
        let (scene, sensor, film) = scene(&format!("{}{body}", sensor("perspective", "")));
        let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
        let drawn = Drawn::new(scene.tracer(), &projection, 0.0, |_| true).unwrap();
        for cull in [Cull::Back, Cull::Front] {
            let seen = draw(&scene, &projection, [80, 60], Pattern::CENTRE, cull);
            assert!(seen.covered() > 100);
            for pixel in 0..80 * 60 {
                let Some(number) = seen.number(pixel, 0) else {
                    continue;
                };
                let place = DVec2::new((pixel % 80) as f64 + 0.5, (pixel / 80) as f64 + 0.5);
                let fragment = Fragment::new(&drawn, &projection, number, place);
                let attributes = fragment.attributes(&drawn, &projection, number, place);
                let is_front = attributes.normal.as_dvec3().dot(projection.line(place).way) < 0.0;
                assert_eq!(is_front, cull == Cull::Back, "{flip} {mirrored}");
            }
        }
    }
}

#[test]
fn a_floor_under_the_eye_ends_where_the_near_plane_cuts_it() {
    // The eye at height 1 looks along a floor with a field of view of 90° from top to bottom: at 45° down the floor is √2 off,
    // at depth 1. With the near plane at 2 the floor begins where it is seen at 1/2 of the picture's lower half.
    let sensor = |near: f64| {
        format!(
            "<sensor type='perspective'><float name='fov' value='90'/><float name='near_clip' value='{near}'/>
            <float name='far_clip' value='50'/>
            <transform name='to_world'><lookat origin='0,1,0' target='0,1,1' up='0,1,0'/></transform>
            <film type='hdrfilm'><integer name='width' value='100'/><integer name='height' value='100'/></film></sensor>"
        )
    };
    let floor = "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='1000'/></transform></shape>";
    for (near, first, last) in [(0.5, 51, 99), (2.0, 51, 74), (19.9, 51, 52)] {
        let (scene, sensor, film) = scene(&format!("{}{floor}", sensor(near)));
        let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
        let seen = draw(&scene, &projection, [100, 100], Pattern::CENTRE, Cull::None);
        for row in 0..100 {
            let covered = (0..100)
                .filter(|x| seen.number(row * 100 + x, 0).is_some())
                .count();
            // The floor is seen where its depth, 50/(row + 0.5 − 50), is between near and far.
            let expected = if (first..=last).contains(&row) {
                100
            } else {
                0
            };
            assert_eq!(covered, expected, "{near}: row {row}");
        }
        let drawn = Drawn::new(scene.tracer(), &projection, 0.0, |_| true).unwrap();
        let pixel = first * 100 + 30;
        let place = DVec2::new(30.5, first as f64 + 0.5);
        let number = seen.number(pixel, 0).unwrap();
        let fragment = Fragment::new(&drawn, &projection, number, place);
        let depth = 50.0 / (first as f64 + 0.5 - 50.0);
        let expected = DVec3::new((50.0 - 30.5) / 50.0 * depth, 0.0, depth);
        assert!(
            fragment.position.distance(expected) < 1e-4 * depth,
            "{:?}",
            fragment.position
        );
    }
}

#[test]
fn huge_coordinates_and_what_is_no_number_do_no_harm() {
    const ODD: [f32; 9] = [
        0.0,
        -1e-38,
        1.0,
        -4.0,
        1e10,
        -3e38,
        f32::MAX,
        f32::NEG_INFINITY,
        f32::NAN,
    ];
    let mut positions = Vec::new();
    for x in ODD {
        for y in ODD {
            positions.extend(ODD.map(|z| Vec3::new(x, y, z)));
        }
    }
    let count = positions.len() as u32;
    let triangles = (0..count).map(|i| [i, (7 * i + 3) % count, (11 * i + 5) % count]);
    let mesh = Mesh {
        triangles: triangles.collect(),
        positions,
        ..Mesh::default()
    };
    let geometry = Geometry::Mesh(TriangleMesh::new(mesh));
    let tracer = Tracer::new(vec![Arc::new(geometry)], &[0], Vec::new(), Method::Brute);
    for plugin in ["perspective", "orthographic"] {
        let (_, sensor, film) = scene(&sensor(plugin, ""));
        let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
        let drawn = Drawn::new(&tracer, &projection, 0.0, |_| true).unwrap();
        let canvas = Canvas::whole([80, 60]);
        let seen = Visibility::draw(&drawn, &projection, &canvas).unwrap();
        assert!(seen.covered() > 0, "{plugin}");
        for pixel in 0..80 * 60 {
            let Some(number) = seen.number(pixel, 0) else {
                continue;
            };
            let place = DVec2::new((pixel % 80) as f64 + 0.5, (pixel / 80) as f64 + 0.5);
            let fragment = Fragment::new(&drawn, &projection, number, place);
            assert!(fragment.position.is_finite(), "{plugin}");
        }
    }
}

#[test]
fn a_depth_of_few_bits_cannot_tell_near_surfaces_apart() {
    let body = "<shape type='rectangle'/><shape type='rectangle'><transform name='to_world'><translate z='0.01'/></transform></shape>";
    let inside = "<float name='near_clip' value='0.1'/><float name='far_clip' value='1000'/>";
    let (scene, sensor, film) = scene(&format!("{}{body}", sensor("perspective", inside)));
    let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
    let drawn = Drawn::new(scene.tracer(), &projection, 0.0, |_| true).unwrap();
    let behind = |depth| {
        let canvas = Canvas {
            depth,
            ..Canvas::whole([80, 60])
        };
        let seen = Visibility::draw(&drawn, &projection, &canvas).unwrap();
        let first = |pixel: &usize| seen.number(*pixel, 0).is_some_and(|number| number < 2);
        (0..80 * 60).filter(first).count()
    };
    // Along its far edge the one behind is seen over the other.
    let right = behind(DepthFormat::Float);
    assert_eq!(behind(DepthFormat::Bits(31)), right);
    assert!(behind(DepthFormat::Bits(14)) > right + 100);
}

#[test]
fn of_a_box_that_is_missed_no_point_is_seen() {
    let window = Window {
        x: 20,
        y: 10,
        width: 30,
        height: 25,
    };
    for plugin in ["perspective", "orthographic"] {
        let (_, sensor, film) = scene(&sensor(plugin, ""));
        let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
        let [near, far] = projection.range();
        let is_seen = |point: Vec3| {
            let place = projection.place(point.as_dvec3());
            let (x, y) = (place.x / place.w, place.y / place.w);
            (near..=far).contains(&place.a)
                && (20.0..=50.0).contains(&x)
                && (10.0..=35.0).contains(&y)
        };
        let [mut missed, mut seen] = [0; 2];
        for i in 0..9 * 9 * 9 {
            let step = |i: i32| 1.5 * (i % 9 - 4) as f32;
            let centre = Vec3::new(step(i), step(i / 9), step(i / 81));
            let bounds = Bounds {
                min: centre - 0.4,
                max: centre + 0.4,
            };
            let corners = bounds.corners();
            let places = corners.map(|corner| projection.place(corner.as_dvec3()));
            let mut points = corners.into_iter().chain([centre]);
            let any = points.any(is_seen);
            if projection.misses(&places, &window) {
                missed += 1;
                assert!(!any, "{plugin} {centre}");
            }
            seen += i32::from(any);
        }
        assert!(missed > 500 && seen > 10, "{plugin}: {missed} {seen}");
    }
}
