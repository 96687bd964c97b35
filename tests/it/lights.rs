//! Lights and lenses against geometry: irradiance below lights of every shape in closed form, drawn toward the
//! light, toward the material and both; penumbrae; circles of confusion; the same image at every scale.

use std::f64::consts::PI;

use etendue::display;
use etendue::image::{Image, Metadata};
use glam::{DMat4, DVec3};

use super::support::{Mean, film, image_of, path, scene};

// ---- irradiance

/// Reflected radiance of the floor z = 0, reflectance 0.5, at `at` under `light`, by 256 × 256 strata.
fn reflected(light: &str, at: [f64; 2], integrator: &str) -> f64 {
    let text = scene(&format!(
        r#"{integrator}<sensor type="perspective">
            <float name="fov" value="0.02"/>
            <transform name="to_world">
                <lookat origin="{}, {}, 4" target="{}, {}, 0" up="0, 0, 1"/>
            </transform>
            <film type="hdrfilm">
                <integer name="width" value="1"/><integer name="height" value="1"/>
                <rfilter type="box"/>
            </film>
            <sampler type="sobol"><integer name="sample_count" value="65536"/></sampler>
        </sensor>{light}
        <shape type="rectangle">
            <transform name="to_world"><scale value="10"/></transform>
            <bsdf type="diffuse"><float name="reflectance" value="0.5"/></bsdf>
        </shape>"#,
        at[0] + 8.0,
        at[1] - 1.0,
        at[0],
        at[1]
    ));
    f64::from(image_of(&text, 3).get(0, 0, 1))
}

/// Fails unless the floor has these form factors under a light of radiance 5.
#[track_caller]
fn assert_form_factors(light: &str, factor: impl Fn([f64; 2]) -> f64) {
    for at in [[0.0, 0.0], [0.3, -0.2], [1.5, 0.8], [-4.0, 3.0]] {
        let expected = 0.5 * 5.0 * factor(at);
        let found = reflected(light, at, &path(2));
        assert!(
            (found / expected - 1.0).abs() < 1e-3,
            "at {at:?}: {found}, {expected}"
        );
    }
}

const GLOW: &str = r#"<emitter type="area"><rgb name="radiance" value="5"/></emitter>"#;

/// A point's form factor to a convex polygon above its horizon (Lambert, *Photometria*, 1760): the sum over the
/// edges of the angle times the cosine of the normal of the plane through the edge.
fn lambert(polygon: &[DVec3], at: [f64; 2]) -> f64 {
    let eye = DVec3::new(at[0], at[1], 0.0);
    let corner = |i: usize| (polygon[i % polygon.len()] - eye).normalize();
    let edges = (0..polygon.len()).map(|i| {
        let (a, b) = (corner(i), corner(i + 1));
        a.angle_between(b) * a.cross(b).normalize().z
    });
    edges.sum::<f64>().abs() / (2.0 * PI)
}

/// A shape of the plugin under a matrix.
fn placed(plugin: &str, matrix: DMat4, inside: &str) -> String {
    let rows = matrix.transpose().to_cols_array().map(|v| v.to_string());
    format!(
        r#"<shape type="{plugin}"><transform name="to_world"><matrix value="{}"/></transform>{inside}</shape>"#,
        rows.join(" ")
    )
}

#[test]
fn rectangles_near_far_and_tilted_give_what_lambert_says() {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    for (height, tilt, size) in [
        (1.5, 0.0, 0.5),
        (0.1, 0.0, 0.4),
        (2.0, 0.5, 0.7),
        (60.0, 0.2, 2.0),
    ] {
        // Turned over, for it faces +z.
        let matrix = DMat4::from_translation(DVec3::new(0.1, 0.2, height))
            * DMat4::from_rotation_y(PI + tilt)
            * DMat4::from_scale(DVec3::new(size, 0.5 * size, 1.0));
        let polygon = corners.map(|[x, y]| matrix.transform_point3(DVec3::new(x, y, 0.0)));
        assert_form_factors(&placed("rectangle", matrix, GLOW), |at| {
            lambert(&polygon, at)
        });
    }
}

#[test]
fn a_box_of_light_gives_the_sum_of_its_faces() {
    let matrix = DMat4::from_translation(DVec3::new(0.1, 0.2, 2.0))
        * DMat4::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.8)
        * DMat4::from_scale(DVec3::new(0.5, 0.3, 0.4));
    let faces: Vec<[DVec3; 4]> = [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .flat_map(|n| [n, -n])
        .map(|n| {
            let (u, v) = (n.any_orthonormal_pair().0, n.any_orthonormal_pair().1);
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, y]| matrix.transform_point3(n + x * u + y * v))
        })
        .collect();
    let center = matrix.transform_point3(DVec3::ZERO);
    assert_form_factors(&placed("cube", matrix, GLOW), |at| {
        let eye = DVec3::new(at[0], at[1], 0.0);
        let visible = faces.iter().filter(|face| {
            let normal = (face[1] - face[0]).cross(face[3] - face[0]);
            let outward = normal * (face[0] - center).dot(normal).signum();
            outward.dot(eye - face[0]) > 0.0
        });
        visible.map(|face| lambert(face, at)).sum()
    });
}

#[test]
fn a_disk_gives_what_its_configuration_factor_says() {
    let (height, radius) = (1.2, 0.6);
    let matrix = DMat4::from_translation(DVec3::new(0.0, 0.0, height))
        * DMat4::from_rotation_x(PI)
        * DMat4::from_scale(DVec3::new(radius, radius, 1.0));
    assert_form_factors(&placed("disk", matrix, GLOW), |[x, y]| {
        let (a2, h2, r2) = (x * x + y * y, height * height, radius * radius);
        let z = h2 + a2 + r2;
        0.5 * (1.0 - (h2 + a2 - r2) / (z * z - 4.0 * r2 * a2).sqrt())
    });
}

#[test]
fn spheres_small_large_and_far_give_the_cosine_times_sine_squared() {
    for (height, radius) in [(2.0, 0.4), (1.1, 0.8), (5e3, 40.0), (2.0, 1e-4)] {
        let light = format!(
            r#"<shape type="sphere">
                <point name="center" value="0.1, 0.2, {height}"/>
                <float name="radius" value="{radius}"/>{GLOW}
            </shape>"#
        );
        assert_form_factors(&light, |[x, y]| {
            let squared = (x - 0.1).powi(2) + (y - 0.2).powi(2) + height * height;
            radius * radius / squared * height / squared.sqrt()
        });
    }
}

#[test]
fn light_drawn_toward_the_lamp_toward_the_material_and_both_is_the_same() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let names = ["R", "G", "B"].map(String::from).to_vec();
    let mut spot = Image::new(16, 8, names);
    for (x, y, value) in [(3, 2, 300.0), (9, 5, 40.0), (10, 5, 20.0)] {
        for c in 0..3 {
            spot.set(x, y, c, value);
        }
    }
    let file = folder.path().join("spot.exr");
    display::save(&file, &spot, &Metadata::default(), &Default::default())
        .expect("the folder is there");
    let radiances = [
        r#"<rgb name="radiance" value="5"/>"#.to_owned(),
        format!(
            r#"<texture type="bitmap" name="radiance"><string name="filename" value="{}"/></texture>"#,
            file.display()
        ),
        r#"<texture type="checkerboard" name="radiance">
            <rgb name="color0" value="0"/><rgb name="color1" value="20"/>
            <transform name="to_uv"><scale value="3"/></transform>
        </texture>"#
            .to_owned(),
    ];
    let matrix = |scale| {
        DMat4::from_translation(DVec3::new(0.3, 0.1, 1.6))
            * DMat4::from_rotation_y(PI + 0.3)
            * DMat4::from_scale(scale)
    };
    let scales = [
        ("rectangle", DVec3::new(1.0, 0.6, 1.0)),
        ("disk", DVec3::new(1.0, 0.6, 1.0)),
        ("sphere", DVec3::splat(0.8)),
        ("cylinder", DVec3::new(0.5, 0.7, 0.9)),
        ("cube", DVec3::new(0.5, 0.4, 0.3)),
    ];
    let techniques = [(0, 1), (1, 0), (1, 1)];
    for (plugin, scale) in scales {
        for radiance in &radiances {
            let emitter = format!(r#"<emitter type="area">{radiance}</emitter>"#);
            let light = placed(plugin, matrix(scale), &emitter);
            let [by_material, by_light, by_both] = techniques.map(|(lights, materials)| {
                let text = scene(&format!(
                    r#"<integrator type="direct">
                        <integer name="emitter_samples" value="{lights}"/>
                        <integer name="bsdf_samples" value="{materials}"/>
                    </integrator>
                    {}{light}<shape type="rectangle">
                        <transform name="to_world"><scale value="10"/></transform>
                    </shape>"#,
                    super::support::meter([8.0, 0.0, 2.0], [0.2, 0.1, 0.0], 24, 256)
                ));
                Mean::of_channel(&image_of(&text, 11), 1)
            });
            let what = format!("{plugin} with {radiance}");
            by_light.assert_equals(&by_material, 0.08, &what);
            by_both.assert_equals(&by_light, 0.05, &what);
        }
    }
}

// ---- shadows

#[test]
fn a_penumbra_is_as_wide_as_the_lamp_seen_through_the_edge() {
    let (lamp, edge, half) = (3.0, 1.0, 0.6);
    let body = |occluder: &str| {
        scene(&format!(
            r#"{}<sensor type="orthographic">
                <float name="near_clip" value="4.5"/>
                <transform name="to_world">
                    <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/>
                </transform>
                {}
            </sensor>
            <shape type="rectangle"><transform name="to_world"><scale value="4"/></transform></shape>
            <shape type="rectangle">
                <transform name="to_world">
                    <rotate x="1" angle="180"/><scale x="{half}" y="0.2" z="1"/><translate z="{lamp}"/>
                </transform>{GLOW}
            </shape>{occluder}"#,
            path(2),
            film(200, 1, 1024)
        ))
    };
    // Covers x < 0 at the height of the edge.
    let occluder = format!(
        r#"<shape type="rectangle"><transform name="to_world">
            <scale value="8"/><translate x="-8" z="{edge}"/>
        </transform><bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf></shape>"#
    );
    let (open, shaded) = (image_of(&body(""), 2), image_of(&body(&occluder), 2));
    let reach = half * edge / (lamp - edge);
    for column in 0..200 {
        let ratio = shaded.get(column, 0, 1) / open.get(column, 0, 1);
        let x = (f64::from(column) + 0.5) / 100.0 - 1.0;
        // Half a pixel, and what the lamp's outermost part is too thin to show.
        let slack = 0.02;
        if x < -reach - 0.005 {
            assert_eq!(ratio, 0.0, "{x} lies in the umbra");
        } else if x > reach + 0.005 {
            assert_eq!(ratio, 1.0, "{x} lies in the light");
        } else if x.abs() < reach - slack {
            assert!(ratio > 0.0 && ratio < 1.0, "{x} lies in the penumbra");
            // The lamp's visible part; its cosines hardly change.
            let part = 0.5 * (x / reach + 1.0);
            assert!(
                (f64::from(ratio) - part).abs() < 0.06,
                "{x}: {ratio} {part}"
            );
        }
    }
}

// ---- scale

/// The ten decades.
fn scales() -> impl Iterator<Item = f64> {
    (-5..=5).map(|k| 10f64.powi(k))
}

/// A perspective sensor at `scale`, from `origin` to `target`, which are not yet scaled.
fn scaled_sensor(scale: f64, [origin, target]: [DVec3; 2], fov: f64, film: &str) -> String {
    let point = |p: DVec3| format!("{}, {}, {}", p.x * scale, p.y * scale, p.z * scale);
    format!(
        r#"<sensor type="perspective">
            <float name="fov" value="{fov}"/>
            <float name="near_clip" value="{}"/><float name="far_clip" value="{}"/>
            <transform name="to_world">
                <lookat origin="{}" target="{}" up="0.1, 0.2, 1"/>
            </transform>{film}
        </sensor>"#,
        1e-3 * scale,
        1e3 * scale,
        point(origin),
        point(target)
    )
}

#[test]
fn no_shape_shadows_itself_at_any_scale() {
    // What is seen of each at (0.1, 0.2, top), and the normal there.
    let tops = [
        ("rectangle", 0.0, DVec3::Z),
        ("disk", 0.0, DVec3::Z),
        ("cube", 1.0, DVec3::Z),
        (
            "sphere",
            0.95f64.sqrt(),
            DVec3::new(0.1, 0.2, 0.95f64.sqrt()),
        ),
    ];
    for scale in scales() {
        for (plugin, top, normal) in tops {
            let target = DVec3::new(0.1, 0.2, top);
            let direction = DVec3::new(-2.0, -1.0, -0.7).normalize();
            let text = scene(&format!(
                r#"{}{}<emitter type="directional">
                    <vector name="direction" value="-2, -1, -0.7"/><rgb name="irradiance" value="4"/>
                </emitter>
                <shape type="{plugin}"><transform name="to_world"><scale value="{scale}"/></transform></shape>"#,
                path(2),
                scaled_sensor(
                    scale,
                    [DVec3::new(2.0, -1.0, 4.0), target],
                    0.01,
                    &film(8, 8, 4)
                )
            ));
            let expected = 0.5 / PI * 4.0 * -direction.dot(normal);
            let image = image_of(&text, 1);
            for value in image.data() {
                assert!(
                    (f64::from(*value) / expected - 1.0).abs() < 1e-3,
                    "{plugin} at {scale}: {value}, {expected}"
                );
            }
        }
    }
}

#[test]
fn no_light_leaks_into_a_closed_box_at_any_scale() {
    for scale in scales() {
        let text = scene(&format!(
            r#"{}{}<emitter type="constant"/><shape type="sphere">
                <point name="center" value="0, 0, {}"/><float name="radius" value="{}"/>{GLOW}
            </shape>
            <shape type="cube">
                <transform name="to_world">
                    <scale value="{scale}"/><rotate x="1" y="2" z="3" angle="33"/>
                </transform>
                <bsdf type="twosided"><bsdf type="diffuse"/></bsdf>
            </shape>"#,
            path(6),
            scaled_sensor(
                scale,
                [DVec3::new(0.3, 0.2, -0.1), DVec3::new(-1.0, 0.7, 1.0)],
                110.0,
                &film(64, 64, 4)
            ),
            2.0 * scale,
            0.2 * scale
        ));
        let image = image_of(&text, 1);
        let brightest = image.data().iter().fold(0.0f32, |a, b| a.max(*b));
        assert_eq!(brightest, 0.0, "at {scale}");
    }
}

#[test]
fn a_scene_looks_the_same_at_every_scale() {
    let body = |scale: f64| {
        let matrix = |place: DVec3, size: f64| {
            DMat4::from_scale(DVec3::splat(scale))
                * DMat4::from_translation(place)
                * DMat4::from_scale(DVec3::splat(size))
        };
        let down = DMat4::from_rotation_x(PI);
        let shapes = [
            placed("rectangle", matrix(DVec3::ZERO, 5.0), ""),
            placed("cube", matrix(DVec3::new(-1.0, 0.0, 0.6), 0.6), ""),
            placed("sphere", matrix(DVec3::new(0.8, 0.3, 0.7), 0.7), ""),
            placed("cylinder", matrix(DVec3::new(0.0, -1.0, 0.0), 0.4), ""),
            placed(
                "rectangle",
                matrix(DVec3::new(0.0, 1.0, 4.0), 0.5) * down,
                GLOW,
            ),
            placed("sphere", matrix(DVec3::new(3.0, -2.0, 3.0), 0.3), GLOW),
            placed(
                "disk",
                matrix(DVec3::new(-3.0, -2.0, 3.0), 0.5) * down,
                GLOW,
            ),
        ];
        scene(&format!(
            r#"{}{}{}<emitter type="point">
                <point name="position" value="0, {}, {}"/><rgb name="intensity" value="{}"/>
            </emitter>"#,
            path(4),
            scaled_sensor(
                scale,
                [DVec3::new(0.0, -6.0, 4.0), DVec3::new(0.0, 0.0, 0.5)],
                50.0,
                &film(48, 32, 16)
            ),
            shapes.concat(),
            -3.0 * scale,
            2.0 * scale,
            2.0 * scale * scale
        ))
    };
    let images: Vec<Image> = scales().map(|scale| image_of(&body(scale), 5)).collect();
    let one = Mean::of_channel(&images[5], 1).value;
    for (scale, image) in scales().zip(&images) {
        let mean = Mean::of_channel(image, 1).value;
        // The paths are the same but for rounding: a few go elsewhere.
        assert!((mean / one - 1.0).abs() < 3e-3, "at {scale}: {mean}, {one}");
    }
}

// ---- lenses

/// Second moment of a spot's image about its centre, in square pixels.
fn spread(image: &Image) -> f64 {
    let (mut sum, mut first, mut second) = (0.0, [0.0; 2], 0.0);
    for y in 0..image.height() {
        for x in 0..image.width() {
            let v = f64::from(image.get(x, y, 1));
            let p = [f64::from(x), f64::from(y)];
            sum += v;
            second += v * (p[0] * p[0] + p[1] * p[1]);
            first = [first[0] + v * p[0], first[1] + v * p[1]];
        }
    }
    second / sum - (first[0] / sum).powi(2) - (first[1] / sum).powi(2)
}

#[test]
fn a_point_out_of_focus_becomes_a_circle_of_confusion() {
    let (size, fov, focus): (u32, f64, f64) = (64, 8.0, 4.0);
    // Of the plane in focus.
    let pixel = 2.0 * focus * (fov.to_radians() / 2.0).tan() / f64::from(size);
    for (distance, aperture, blades) in [
        (2.0, 0.1, 0),
        (3.0, 0.3, 0),
        (4.0, 0.3, 0),
        (7.0, 0.3, 0),
        (40.0, 0.15, 0),
        (7.0, 0.3, 3),
        (3.0, 0.3, 4),
        (7.0, 0.3, 6),
    ] {
        let spot = 0.01 * distance;
        let text = scene(&format!(
            r#"{}<sensor type="thinlens">
                <float name="fov" value="{fov}"/><float name="focus_distance" value="{focus}"/>
                <float name="aperture_radius" value="{aperture}"/>
                <integer name="aperture_blades" value="{blades}"/>
                <float name="aperture_rotation" value="10"/>{}
            </sensor>
            <shape type="disk">
                <transform name="to_world">
                    <scale value="{spot}"/><rotate y="1" angle="180"/><translate z="{distance}"/>
                </transform>{GLOW}
            </shape>"#,
            path(1),
            film(size, size, 400)
        ));
        let blur = aperture * (focus - distance).abs() / distance / pixel;
        let corners = f64::from(blades);
        // Of a disc or a regular polygon of that radius, about its centre.
        let shape = if blades == 0 {
            0.5
        } else {
            (2.0 + (2.0 * PI / corners).cos()) / 6.0
        };
        let image = spot * focus / distance / pixel;
        // The disk's own image, and the pixels.
        let expected = shape * blur * blur + 0.5 * image * image + 1.0 / 6.0;
        let found = spread(&image_of(&text, 4));
        // A sharp image is a few pixels wide, where the position of the pixels counts.
        let what = format!("at {distance} through {aperture} with {blades} blades");
        assert!(
            (found / expected - 1.0).abs() < 0.025,
            "{what}: {found}, {expected}"
        );
    }
}

#[test]
fn what_is_in_focus_is_as_sharp_as_through_a_pinhole() {
    let body = |sensor: &str| {
        let inside = r#"<float name="fov" value="30"/>"#;
        scene(&format!(
            r#"{}<sensor {sensor}{inside}{}</sensor>
            <shape type="rectangle">
                <transform name="to_world">
                    <rotate y="1" angle="180"/><scale value="0.5"/><translate x="0.07" z="3"/>
                </transform>{GLOW}
            </shape>"#,
            path(1),
            film(32, 32, 16)
        ))
    };
    let lens = r#"type="thinlens"><float name="aperture_radius" value="0.5"/>
        <float name="focus_distance" value="3"/>"#;
    let sharp = image_of(&body(r#"type="perspective">"#), 1);
    let focused = image_of(&body(lens), 1);
    for (a, b) in sharp.data().iter().zip(focused.data()) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
}
