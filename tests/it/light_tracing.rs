//! `ptracer` and `bdpt` against `path`: every light, materials of every kind and every camera that light finds; caustics;
//! and the same bits however the work is cut.

use std::num::NonZeroUsize;
use std::path::Path;

use etendue::color::Rgb;
use etendue::image::Image;
use etendue::light::Light;
use etendue::render::{Adaptive, Options, Overrides, Silent, render};
use etendue::sensor::Window;

use super::support::{Mean, describe, image_of, rendered, scene};

fn integrator(name: &str, depth: i32) -> String {
    format!(r#"<integrator type="{name}"><integer name="max_depth" value="{depth}"/></integrator>"#)
}

/// A camera above a floor.
fn camera(kind: &str, spp: u32, more: &str) -> String {
    format!(
        r#"<sensor type="{kind}">{more}
            <transform name="to_world"><lookat origin="0, -4, 4" target="0, 0, 0.3" up="0, 0, 1"/></transform>
            <film type="hdrfilm"><integer name="width" value="12"/><integer name="height" value="10"/></film>
            <sampler type="independent"><integer name="sample_count" value="{spp}"/></sampler>
        </sensor>"#
    )
}

const FLOOR: &str = r#"<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.5, 0.3"/></bsdf></shape>"#;
const BALL: &str = r#"<shape type="sphere"><point name="center" value="0.3, 0.1, 0.8"/>
    <float name="radius" value="0.7"/>"#;
const LAMP: &str = r#"<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/>
    <scale value="0.6"/><translate z="3" x="-0.5"/></transform><emitter type="area">
    <rgb name="radiance" value="6, 7, 8"/></emitter></shape>"#;

/// The mean of each channel over images of some seeds.
fn means(text: &str) -> [Mean; 3] {
    const SEEDS: u64 = 12;
    let images: Vec<Image> = (0..SEEDS).map(|seed| image_of(text, seed)).collect();
    [0, 1, 2].map(|channel| {
        Mean::of(images.iter().map(|image| {
            let stride = image.channels().len();
            let pixels = image.data().chunks(stride);
            let count = pixels.len() as f64;
            pixels.map(|p| f64::from(p[channel])).sum::<f64>() / count
        }))
    })
}

/// Holds integrators against `path`, and says what differs.
fn hold(what: &str, depth: i32, names: &[&str], rest: &str, wrong: &mut Vec<String>) {
    let expected = means(&scene(&format!("{}{rest}", integrator("path", depth))));
    for name in names {
        let found = means(&scene(&format!("{}{rest}", integrator(name, depth))));
        for (found, expected) in found.iter().zip(&expected) {
            let error = found.error.hypot(expected.error);
            let off = found.value - expected.value;
            if off.abs() > 4.5 * error + 1e-3 * expected.value || error > 0.03 * expected.value {
                wrong.push(format!(
                    "{what}, {name}: {:.4} ± {:.4} is not {:.4} ± {:.4}",
                    found.value, found.error, expected.value, expected.error
                ));
            }
        }
    }
}

/// An example of every light; `picture` is an image.
fn light(name: &str, picture: &Path) -> Option<String> {
    let aimed = |rest: &str| {
        format!(
            r#"<emitter type="{name}"><transform name="to_world">
            <lookat origin="0, 0, 3" target="0, 0, 0" up="0, 1, 0"/></transform>{rest}</emitter>"#
        )
    };
    Some(match name {
        // From nowhere; and from the shape's normals alone, where no path of the camera's finds it.
        "ambient" | "directionalarea" => return None,
        "area" => LAMP.into(),
        "constant" => r#"<emitter type="constant"/>"#.into(),
        "directional" => r#"<emitter type="directional"><vector name="direction" value="0.3, 0.2, -1"/></emitter>"#.into(),
        "envmap" => format!(
            r#"<emitter type="envmap"><string name="filename" value="{}"/></emitter>"#,
            picture.display()
        ),
        "point" => r#"<emitter type="point"><point name="position" value="-1, 0, 2.5"/></emitter>"#.into(),
        "projector" => aimed(r#"<float name="fov" value="50"/><rgb name="irradiance" value="4, 5, 6"/>"#),
        "spot" => aimed(r#"<float name="cutoff_angle" value="40"/><float name="beam_width" value="20"/>"#),
        "sunsky" => r#"<emitter type="sunsky"><vector name="sun_direction" value="0.2, -0.3, 0.8"/>
            <float name="sun_scale" value="0"/></emitter>"#.into(),
        "timed_sunsky" => r#"<emitter type="timed_sunsky"><float name="sun_scale" value="0"/></emitter>"#.into(),
        other => panic!("what does {other} light?"),
    })
}

#[test]
fn every_light_sends_paths_that_bring_what_paths_from_the_camera_find() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("sky.exr");
    let channels = ["R", "G", "B"].map(String::from).to_vec();
    let data = (0..8 * 5 * 3).map(|i| (i % 7) as f32).collect();
    let image = Image::from_data(8, 5, channels, data).unwrap();
    etendue::image::write(&picture, &image, &Default::default()).unwrap();
    let mut wrong = Vec::new();
    for name in Light::<Rgb>::NAMES {
        let Some(light) = light(name, &picture) else {
            continue;
        };
        let rest = format!(
            "{}{FLOOR}{BALL}<bsdf type=\"plastic\"/></shape>{light}",
            camera("perspective", 64, "")
        );
        hold(name, 4, &["bdpt"], &rest, &mut wrong);
        let rest = format!(
            "{}{FLOOR}{BALL}<bsdf type=\"diffuse\"/></shape>{light}",
            camera("perspective", 64, "")
        );
        hold(name, 4, &["ptracer"], &rest, &mut wrong);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Materials in ways that `ptracer` sees too, and those that it does not: with choices of single directions.
const ROUGH: &[&str] = &[
    r#"<bsdf type="twosided"><bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></bsdf>"#,
    r#"<bsdf type="roughdielectric"><float name="alpha" value="0.3"/></bsdf>"#,
    r#"<bsdf type="roughplastic"><float name="alpha" value="0.2"/></bsdf>"#,
    r#"<bsdf type="principled"><float name="spec_trans" value="0.5"/><float name="roughness" value="0.4"/></bsdf>"#,
    r#"<bsdf type="principledthin"><float name="roughness" value="0.4"/></bsdf>"#,
    r#"<bsdf type="phong"><float name="exponent" value="20"/></bsdf>"#,
    r#"<bsdf type="blendbsdf"><float name="weight" value="0.4"/><bsdf type="diffuse"/>
        <bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></bsdf>"#,
    r#"<bsdf type="bumpmap"><texture type="checkerboard" name="arbitrary"><transform name="to_uv">
        <scale value="4"/></transform></texture><float name="scale" value="0.05"/><bsdf type="diffuse"/></bsdf>"#,
];
const SINGLE: &[&str] = &[
    r#"<bsdf type="dielectric"/>"#,
    r#"<bsdf type="conductor"/>"#,
    r#"<bsdf type="plastic"/>"#,
    r#"<bsdf type="thindielectric"/>"#,
    r#"<bsdf type="mask"><float name="opacity" value="0.6"/><bsdf type="diffuse"/></bsdf>"#,
    r#"<bsdf type="null"/>"#,
];

#[test]
fn every_kind_of_material_scatters_paths_from_lights_as_it_does_those_from_the_camera() {
    let mut wrong = Vec::new();
    let rest = |material: &str| {
        let camera = camera("perspective", 64, "");
        format!("{camera}{FLOOR}{LAMP}{BALL}{material}</shape>")
    };
    for material in ROUGH {
        hold(
            material,
            5,
            &["bdpt", "ptracer"],
            &rest(material),
            &mut wrong,
        );
    }
    for material in SINGLE {
        hold(material, 5, &["bdpt"], &rest(material), &mut wrong);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_camera_that_light_finds_sees_what_its_rays_see() {
    let mut wrong = Vec::new();
    let lens =
        r#"<float name="aperture_radius" value="0.3"/><float name="focus_distance" value="5"/>"#;
    let border = "<film type=\"hdrfilm\"><integer name=\"width\" value=\"12\"/><integer name=\"height\" value=\"10\"/>
        <boolean name=\"sample_border\" value=\"true\"/><rfilter type=\"mitchell\"/></film>";
    for (kind, more) in [
        (
            "perspective",
            r#"<float name="principal_point_offset_x" value="0.1"/>"#,
        ),
        ("thinlens", lens),
        ("orthographic", ""),
    ] {
        let rest = format!("{}{FLOOR}{LAMP}{BALL}</shape>", camera(kind, 64, more));
        hold(kind, 4, &["bdpt", "ptracer"], &rest, &mut wrong);
    }
    let bordered = camera("perspective", 64, "");
    let start = bordered.find("<film").unwrap();
    let end = bordered.find("</film>").unwrap() + "</film>".len();
    let bordered = format!("{}{border}{}", &bordered[..start], &bordered[end..]);
    let rest = format!("{bordered}{FLOOR}{LAMP}{BALL}</shape>");
    hold("a border", 4, &["bdpt", "ptracer"], &rest, &mut wrong);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What a shape sends along its normals is found by paths from there alone: a beam on a white floor.
#[test]
fn a_beam_is_seen_where_it_falls() {
    let beam = r#"<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/><scale value="0.5"/>
        <translate z="3" y="1"/></transform><emitter type="directionalarea"><rgb name="radiance" value="2"/></emitter></shape>"#;
    for name in ["ptracer", "bdpt"] {
        let text = scene(&format!(
            r#"{}<sensor type="orthographic"><transform name="to_world"><scale x="0.4" y="0.4"/>
            <lookat origin="0, 1, 2" target="0, 1, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
            <rfilter type="box"/></film><sampler type="independent"><integer name="sample_count" value="256"/></sampler>
            </sensor>{FLOOR}{beam}"#,
            integrator(name, -1)
        ));
        let [red, ..] = means(&text);
        red.assert_is(0.7 * 2.0 / std::f64::consts::PI, 0.01, name);
    }
}

#[test]
fn lights_that_are_hidden_hide_nothing_from_the_light() {
    // The lamp stands between the camera and most of the floor.
    let rest = format!(
        r#"{}{FLOOR}<shape type="sphere"><point name="center" value="0, -1, 1.4"/><float name="radius" value="0.5"/>
        <emitter type="area"/></shape>"#,
        camera("perspective", 64, "")
    );
    let hidden = |name: &str| {
        let integrator = integrator(name, 3);
        let hidden = r#"<boolean name="hide_emitters" value="true"/></integrator>"#;
        means(&scene(&format!(
            "{}{rest}",
            integrator.replace("</integrator>", hidden)
        )))
    };
    let expected = hidden("path");
    for name in ["bdpt", "ptracer"] {
        for (found, expected) in hidden(name).iter().zip(&expected) {
            found.assert_equals(expected, 0.02, name);
        }
    }
}

#[test]
fn what_does_not_go_with_light_from_anywhere_is_refused() {
    let text = scene(&format!(
        "{}{}{FLOOR}{LAMP}",
        integrator("bdpt", 4),
        camera("perspective", 4, "")
    ));
    let adaptive = Some(Adaptive {
        noise_threshold: 0.1,
        min_spp: 4,
        max_spp: 16,
    });
    let options = Options {
        adaptive,
        ..Options::default()
    };
    let refused = render(&describe(&text), &options, &Silent).unwrap_err();
    assert!(
        refused.to_string().contains("not sampled adaptively"),
        "{refused}"
    );
    let options = Options {
        gaze: Some([2.0, 2.0]),
        ..Options::default()
    };
    let refused = render(&describe(&text), &options, &Silent).unwrap_err();
    assert!(
        refused.to_string().contains("not sampled by a gaze"),
        "{refused}"
    );
    let blind = text
        .replace("perspective", "radiancemeter")
        .replace("\"12\"", "\"1\"")
        .replace("\"10\"", "\"1\"");
    let refused = render(&describe(&blind), &Options::default(), &Silent).unwrap_err();
    assert!(
        refused.to_string().contains("a sensor that light finds"),
        "{refused}"
    );
}

#[test]
fn threads_crops_and_kernels_do_not_change_a_bit() {
    for name in ["ptracer", "bdpt"] {
        let text = scene(&format!(
            "{}{}{FLOOR}{LAMP}{BALL}<bsdf type=\"dielectric\"/></shape>",
            integrator(name, 6),
            camera("perspective", 20, "")
                .replace("\"12\"", "\"70\"")
                .replace("\"10\"", "\"45\"")
        ));
        let image = |overrides: &Overrides, threads: usize| {
            let options = Options {
                threads: NonZeroUsize::new(threads),
                ..Options::default()
            };
            rendered(&text, overrides, &options).image
        };
        let all = image(&Overrides::default(), 1);
        assert!(
            all.data() == image(&Overrides::default(), 3).data(),
            "{name}"
        );
        let crop = Window {
            x: 13,
            y: 5,
            width: 31,
            height: 33,
        };
        let cut = image(
            &Overrides {
                crop: Some(crop),
                ..Overrides::default()
            },
            2,
        );
        let stride = all.channels().len();
        for y in 0..33 {
            let row = |image: &Image, x: u32, y: u32, width: u32| {
                let start = (y * width + x) as usize * stride;
                image.data()[start..start + 31 * stride].to_vec()
            };
            assert!(
                row(&all, 13, y + 5, 70) == row(&cut, 0, y, 31),
                "{name}, row {y}"
            );
        }
    }
}
