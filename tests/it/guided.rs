//! `guided` against `path`: the same image with lights and materials of every kind, less noise in caustics, and the same
//! bits however the work is cut.

use std::num::NonZeroUsize;
use std::process::Command;

use etendue::budget::Budget;
use etendue::image::Image;
use etendue::lanes::Kernel;
use etendue::render::{Options, Overrides, Silent, render};
use etendue::sensor::Window;

use super::support::{Mean, at, describe, image_of, rendered, scene};

fn integrator(name: &str, depth: i32) -> String {
    let photons = match name {
        "guided" => r#"<integer name="photons" value="4096"/>"#,
        _ => "",
    };
    format!(
        r#"<integrator type="{name}"><integer name="max_depth" value="{depth}"/>{photons}</integrator>"#
    )
}

/// A camera above a floor.
fn camera(width: u32, height: u32, spp: u32) -> String {
    format!(
        r#"<sensor type="perspective"><float name="shutter_close" value="1"/>
            <transform name="to_world"><lookat origin="0, -4, 4" target="0, 0, 0.3" up="0, 0, 1"/></transform>
            <film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{height}"/></film>
            <sampler type="independent"><integer name="sample_count" value="{spp}"/></sampler>
        </sensor>"#
    )
}

const FLOOR: &str = r#"<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.5, 0.3"/></bsdf></shape>"#;
const LAMP: &str = r#"<shape type="sphere"><point name="center" value="-0.6, 0.5, 3"/>
    <float name="radius" value="0.4"/><emitter type="area"><rgb name="radiance" value="6, 7, 8"/></emitter></shape>"#;
const GLASS: &str = r#"<shape type="sphere"><point name="center" value="0.3, 0.1, 0.8"/>
    <float name="radius" value="0.7"/><bsdf type="dielectric"/></shape>"#;
const RING: &str = r#"<shape type="cylinder"><point name="p0" value="0, 0, 0"/><point name="p1" value="0, 0, 0.6"/>
    <float name="radius" value="1"/><bsdf type="twosided"><bsdf type="conductor"/></bsdf></shape>"#;

/// The mean of each of the first channels over images of some seeds.
fn means(image_of: impl Fn(u64) -> Image) -> [Mean; 3] {
    const SEEDS: u64 = 12;
    let images: Vec<Image> = (0..SEEDS).map(image_of).collect();
    [0, 1, 2].map(|channel| {
        Mean::of(images.iter().map(|image| {
            let pixels = image.data().chunks(image.channels().len());
            let count = pixels.len() as f64;
            pixels.map(|p| f64::from(p[channel])).sum::<f64>() / count
        }))
    })
}

/// Scenes with caustics, in words and in shapes and lights.
fn scenes() -> Vec<(&'static str, String)> {
    let floor = |bsdf: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform>{bsdf}</shape>"#
        )
    };
    let ball = |bsdf: &str| {
        format!(
            r#"<shape type="sphere"><point name="center" value="0.3, 0.1, 0.8"/>
            <float name="radius" value="0.7"/>{bsdf}</shape>"#
        )
    };
    let sky = r#"<emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter>"#;
    let moving = r#"<shape type="sphere"><float name="radius" value="0.5"/><bsdf type="dielectric"/>
        <animation name="to_world"><transform time="0"><translate x="-0.5" z="0.8"/></transform>
        <transform time="1"><translate x="0.5" z="0.8"/></transform></animation></shape>"#;
    vec![
        ("a glass ball", format!("{FLOOR}{LAMP}{GLASS}")),
        ("a ring under the sky", format!("{FLOOR}{LAMP}{RING}{sky}")),
        (
            "a lamp in glass",
            format!(
                r#"{FLOOR}{LAMP}<shape type="sphere"><point name="center" value="-0.6, 0.5, 3"/>
                <float name="radius" value="0.6"/><bsdf type="dielectric"/></shape>"#
            ),
        ),
        ("no mirrors", format!("{FLOOR}{LAMP}{}", ball(""))),
        (
            "a ball that is nearly a mirror",
            format!(
                "{FLOOR}{LAMP}{}",
                ball(r#"<bsdf type="roughconductor"><float name="alpha" value="0.05"/></bsdf>"#)
            ),
        ),
        (
            "a floor of plastic",
            format!("{}{LAMP}{GLASS}", floor(r#"<bsdf type="plastic"/>"#)),
        ),
        (
            "a floor of rough plastic",
            format!("{}{LAMP}{GLASS}", floor(r#"<bsdf type="roughplastic"/>"#)),
        ),
        (
            "a bumpy floor",
            format!(
                "{}{LAMP}{GLASS}",
                floor(
                    r#"<bsdf type="bumpmap"><texture type="checkerboard" name="arbitrary"><transform name="to_uv">
                    <scale value="4"/></transform></texture><float name="scale" value="0.05"/><bsdf type="diffuse"/></bsdf>"#
                )
            ),
        ),
        (
            "a floor of ground glass",
            format!(
                "{}{LAMP}{GLASS}{sky}",
                floor(r#"<bsdf type="roughdielectric"><float name="alpha" value="0.3"/></bsdf>"#)
            ),
        ),
        (
            "a floor with holes",
            format!(
                "{}{LAMP}{RING}",
                floor(
                    r#"<bsdf type="mask"><float name="opacity" value="0.6"/><bsdf type="diffuse"/></bsdf>"#
                )
            ),
        ),
        ("a ball that moves", format!("{FLOOR}{LAMP}{moving}")),
    ]
}

#[test]
fn the_mean_is_that_of_paths_without_a_guide() {
    let mut wrong = Vec::new();
    for (name, shapes) in scenes() {
        let [found, expected] = ["guided", "path"].map(|name| {
            let spp = if name == "path" { 256 } else { 128 };
            let head = format!("{}{}", integrator(name, 6), camera(12, 10, spp));
            let text = scene(&format!("{head}{shapes}"));
            means(|seed| image_of(&text, seed))
        });
        for (found, expected) in found.iter().zip(&expected) {
            let error = found.error.hypot(expected.error);
            let off = found.value - expected.value;
            if off.abs() > 4.5 * error + 1e-3 * expected.value || error > 0.03 * expected.value {
                wrong.push(format!(
                    "{name}: {:.4} ± {:.4} is not {:.4} ± {:.4}",
                    found.value, found.error, expected.value, expected.error
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Glass that parts wavelengths, whose paths go on with one.
#[cfg(feature = "bands")]
#[test]
fn in_bands_the_mean_is_that_of_paths_without_a_guide_too() {
    let prism = r#"<shape type="sphere"><point name="center" value="0.3, 0.1, 0.8"/><float name="radius" value="0.7"/>
        <bsdf type="dielectric"><spectrum name="int_ior" value="300:1.6, 900:1.4"/></bsdf></shape>"#;
    let [found, expected] = ["guided", "path"].map(|name| {
        let head = format!("{}{}", integrator(name, 6), camera(12, 10, 512));
        let text = scene(&format!("{head}{FLOOR}{LAMP}{prism}"));
        means(|seed| {
            let options = Options {
                seed,
                colors: etendue::render::Colors::bands(5),
                ..Options::default()
            };
            rendered(&text, &Overrides::default(), &options).image
        })
    });
    for (found, expected) in found.iter().zip(&expected) {
        found.assert_equals(expected, 0.03, "bands");
    }
}

/// The mean variance of pixels, relative to the square of their mean.
fn noise(text: &str, overrides: &Overrides) -> f64 {
    const SEEDS: u64 = 4;
    let image = |seed| {
        let options = Options {
            seed,
            ..Options::default()
        };
        rendered(text, overrides, &options).image
    };
    let images: Vec<Image> = (0..SEEDS).map(image).collect();
    let stride = images[0].channels().len();
    let count = images[0].data().len() / stride;
    let pixels = (0..count).map(|pixel| {
        let values = images.iter().map(|i| f64::from(i.data()[pixel * stride]));
        let mean = Mean::of(values);
        mean.error.powi(2) * SEEDS as f64 / (mean.value.powi(2) + 1e-2)
    });
    pixels.sum::<f64>() / count as f64
}

#[test]
fn caustics_of_a_ring_have_a_quarter_of_the_noise() {
    let text = std::fs::read_to_string(at("scenes/ring.xml")).expect("the scene is there");
    let [guided, path] = ["guided", "path"].map(|name| {
        let overrides = Overrides {
            size: Some((64, 48)),
            spp: Some(64),
            integrator: Some(name.to_owned()),
            ..Overrides::default()
        };
        noise(&text, &overrides)
    });
    assert!(guided < 0.25 * path, "{guided} {path}");
}

#[test]
fn without_caustics_the_bits_are_those_of_path() {
    let body = format!("{}{FLOOR}{LAMP}", camera(12, 10, 16));
    let [guided, path] = ["guided", "path"]
        .map(|name| image_of(&scene(&format!("{}{body}", integrator(name, 6))), 3));
    assert!(guided.data() == path.data());
    // Two edges have no surface between them that could lead light.
    let body = format!("{body}{GLASS}");
    let [guided, path] = ["guided", "path"]
        .map(|name| image_of(&scene(&format!("{}{body}", integrator(name, 2))), 3));
    assert!(guided.data() == path.data());
    let [guided, path] = ["guided", "path"]
        .map(|name| image_of(&scene(&format!("{}{body}", integrator(name, 6))), 3));
    assert!(guided.data() != path.data());
}

#[test]
fn threads_crops_and_kernels_do_not_change_a_bit() {
    let text = scene(&format!(
        "{}{}{FLOOR}{LAMP}{GLASS}{RING}",
        integrator("guided", 6),
        camera(70, 45, 20)
    ));
    let image = |crop: Option<Window>, threads: usize, kernel: Kernel| {
        let options = Options {
            threads: NonZeroUsize::new(threads),
            kernel,
            ..Options::default()
        };
        let overrides = Overrides {
            crop,
            ..Overrides::default()
        };
        rendered(&text, &overrides, &options).image
    };
    let all = image(None, 1, Kernel::best());
    for kernel in Kernel::all() {
        let found = image(None, 3, kernel);
        assert!(all.data() == found.data(), "{}", kernel.name());
    }
    let crop = Window {
        x: 13,
        y: 5,
        width: 31,
        height: 33,
    };
    let cut = image(Some(crop), 2, Kernel::best());
    let stride = all.channels().len();
    for y in 0..33 {
        let row = |image: &Image, x: u32, y: u32, width: u32| {
            let start = (y * width + x) as usize * stride;
            image.data()[start..start + 31 * stride].to_vec()
        };
        assert!(row(&all, 13, y + 5, 70) == row(&cut, 0, y, 31), "row {y}");
    }
}

#[test]
fn parts_make_the_image_of_one_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = scene(&format!(
        "{}{}{FLOOR}{LAMP}{GLASS}",
        integrator("guided", 6),
        camera(40, 30, 64)
    ));
    std::fs::write(folder.path().join("scene.xml"), text).expect("writable");
    let run = |words: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(folder.path())
            .args(words.split_whitespace())
            .output()
            .expect("the program starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{words}: {said}");
    };
    run("render scene.xml -q -o whole.exr");
    for (name, crop) in [("left", "0,0,17,30"), ("right", "17,0,23,30")] {
        for passes in ["0:2", "2:5"] {
            let part = format!("{name}{}.part", &passes[..1]);
            run(&format!(
                "render scene.xml -q -o {part} --crop {crop} --passes {passes}"
            ));
        }
    }
    run("merge merged.exr left0.part left2.part right0.part right2.part -q");
    let read = |name: &str| {
        let path = folder.path().join(name);
        let picture = etendue::image::read(&path, &Default::default());
        picture.unwrap_or_else(|e| panic!("{e}")).image
    };
    assert!(read("whole.exr").data() == read("merged.exr").data());
}

#[test]
fn photons_that_do_not_fit_the_memory_are_refused() {
    let body = format!("{}{FLOOR}{LAMP}{GLASS}", camera(12, 10, 4));
    let text = scene(&format!(
        r#"<integrator type="guided"><integer name="photons" value="4000000"/></integrator>{body}"#
    ));
    let description = describe(&text).within(&Budget::new(Some(50_000_000)));
    let refused = render(&description, &Options::default(), &Silent).unwrap_err();
    let said = refused.to_string();
    assert!(said.contains("take fewer photons"), "{said}");
    render(
        &describe(&scene(&format!("{}{body}", integrator("guided", 6)))),
        &Options::default(),
        &Silent,
    )
    .unwrap();
}
