//! Participating media whose images are known in closed form: transmittance, single scattering, a furnace; what lets
//! light pass; and the same bits however the work is cut.

use std::f64::consts::PI;
use std::num::NonZeroUsize;

use etendue::accel::Method;
use etendue::image::Image;
use etendue::render::{Options, Overrides};
use etendue::sensor::Window;

use super::support::{Mean, at, image_of, meter, rendered, scene};

fn volpath(depth: i32) -> String {
    format!(
        r#"<integrator type="volpath"><integer name="max_depth" value="{depth}"/></integrator>"#
    )
}

/// A slab 2 thick, whose sides are far away, around the origin and across z.
fn slab(medium: &str) -> String {
    format!(
        r#"<shape type="cube"><transform name="to_world"><scale x="1000" y="1000"/></transform>
        <bsdf type="null"/><medium name="interior" {medium}</medium></shape>"#
    )
}

/// The same extinction in all of a box that is told to vary.
const IN_THE_BOX: &str = r#"type="heterogeneous"><volume name="sigma_t" type="constvolume">
    <transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/><scale x="2000" y="2000" z="2"/></transform>
    <rgb name="value" value="0.25, 0.5, 1"/></volume>"#;
const EVERYWHERE: &str = r#"type="homogeneous"><rgb name="sigma_t" value="0.25, 0.5, 1"/>"#;
const SIGMA: [f64; 3] = [0.25, 0.5, 1.0];

fn channels(text: &str, seed: u64) -> [Mean; 3] {
    let image = image_of(text, seed);
    [0, 1, 2].map(|c| Mean::of_channel(&image, c))
}

#[test]
fn light_through_a_slab_falls_off_exponentially() {
    for medium in [EVERYWHERE, IN_THE_BOX] {
        let text = scene(&format!(
            r#"{}{}<emitter type="constant"><rgb name="radiance" value="3"/></emitter>{}"#,
            volpath(-1),
            meter([0.0, 0.0, 5.0], [0.0, 0.0, 0.0], 32, 256),
            slab(&format!(r#"{medium}<float name="albedo" value="0"/>"#)),
        ));
        for (mean, sigma) in channels(&text, 1).iter().zip(SIGMA) {
            mean.assert_is(3.0 * (-2.0 * sigma).exp(), 0.01, medium);
        }
    }
}

#[test]
fn a_slab_that_glows_is_as_bright_as_what_gives_its_light_where_it_is_thick() {
    for medium in [EVERYWHERE, IN_THE_BOX] {
        let glows = r#"<float name="albedo" value="0"/><rgb name="emission" value="4, 2, 1"/>"#;
        let text = scene(&format!(
            "{}{}{}",
            volpath(1),
            meter([0.0, 0.0, 5.0], [0.0, 0.0, 0.0], 32, 256),
            slab(&format!("{medium}{glows}")),
        ));
        for (c, mean) in channels(&text, 6).iter().enumerate() {
            let expected = [4.0, 2.0, 1.0][c] * (1.0 - (-2.0 * SIGMA[c]).exp());
            mean.assert_is(expected, 0.01, medium);
        }
    }
}

#[test]
fn light_is_scattered_once_as_the_integral_says() {
    // Light falls in where the camera looks in, and goes as far out as in.
    for medium in [EVERYWHERE, IN_THE_BOX] {
        let text = scene(&format!(
            r#"{}{}<emitter type="directional"><vector name="direction" value="0, 0, -1"/>
            <rgb name="irradiance" value="5"/></emitter>{}"#,
            volpath(2),
            meter([0.0, 0.0, 5.0], [0.0, 0.0, 0.0], 32, 256),
            slab(&format!(r#"{medium}<float name="albedo" value="0.8"/>"#)),
        ));
        for (mean, sigma) in channels(&text, 2).iter().zip(SIGMA) {
            let expected = 0.8 * 5.0 / (4.0 * PI) * (1.0 - (-4.0 * sigma).exp()) / 2.0;
            mean.assert_is(expected, 0.01, medium);
        }
    }
}

/// What scatters all and is in light from everywhere is not seen.
#[test]
fn a_medium_that_takes_nothing_is_not_seen_in_a_furnace() {
    let smoke = r#"type="heterogeneous"><float name="scale" value="6"/><volume name="sigma_t" type="gridvolume">
        <string name="filename" value="scenes/smoke.vol"/>
        <transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/><scale value="2"/></transform></volume>"#;
    for medium in [EVERYWHERE, smoke] {
        for phase in [
            r#"<phase type="isotropic"/>"#,
            r#"<phase type="hg"><float name="g" value="-0.6"/></phase>"#,
            r#"<phase type="rayleigh"/>"#,
        ] {
            let text = scene(&format!(
                r#"<integrator type="volpathmis"/>{}
                <emitter type="constant"><rgb name="radiance" value="1"/></emitter>
                <shape type="cube"><bsdf type="null"/><medium name="interior" {medium}
                <float name="albedo" value="1"/>{phase}</medium></shape>"#,
                meter([0.3, -0.2, 5.0], [0.0, 0.1, 0.0], 24, 128),
            ));
            for mean in channels(&text, 3) {
                mean.assert_is(1.0, 0.02, &format!("{medium} {phase}"));
            }
        }
    }
}

#[test]
fn the_camera_and_the_light_may_stand_in_a_medium() {
    // A lamp at a distance of 3 in an endless medium that scatters nothing.
    let sensor = meter([0.0, 0.0, 3.0], [0.0, 0.0, 0.0], 24, 256);
    let sensor = sensor.replace("</sensor>", r#"<ref id="haze"/></sensor>"#);
    let text = scene(&format!(
        r#"<medium type="homogeneous" id="haze"><rgb name="sigma_t" value="0.1, 0.3, 0.6"/>
        <float name="albedo" value="0"/></medium>{}{sensor}
        <shape type="rectangle"><emitter type="area"><rgb name="radiance" value="2"/></emitter>
        <ref name="exterior" id="haze"/></shape>"#,
        volpath(-1),
    ));
    for (mean, sigma) in channels(&text, 4).iter().zip([0.1, 0.3, 0.6]) {
        mean.assert_is(2.0 * f64::exp(-3.0 * sigma), 0.01, "an endless medium");
    }
}

#[test]
fn shadow_rays_go_through_what_lets_light_pass_and_nowhere_else() {
    let floor = |above: &str| {
        scene(&format!(
            r#"{}{}<emitter type="directional"><vector name="direction" value="0, 0, -1"/>
            <rgb name="irradiance" value="2"/></emitter>
            <shape type="rectangle"><transform name="to_world"><scale value="10"/></transform>
            <bsdf type="diffuse"><float name="reflectance" value="0.6"/></bsdf></shape>
            <shape type="rectangle"><transform name="to_world"><translate z="1"/></transform>{above}</shape>"#,
            volpath(2),
            meter([4.0, 0.0, 0.9], [0.0, 0.0, 0.0], 16, 64),
        ))
    };
    let open = 2.0 * 0.6 / PI;
    for (bsdf, share) in [
        (r#"<bsdf type="null"/>"#, 1.0),
        (
            r#"<bsdf type="mask"><float name="opacity" value="0.3"/><bsdf type="diffuse"/></bsdf>"#,
            0.7,
        ),
        (
            r#"<bsdf type="blendbsdf"><float name="weight" value="0.25"/><bsdf type="diffuse"/>
            <bsdf type="null"/></bsdf>"#,
            0.25,
        ),
        (r#"<bsdf type="diffuse"/>"#, 0.0),
        (r#"<bsdf type="dielectric"/>"#, 0.0),
    ] {
        let mean = Mean::of_channel(&image_of(&floor(bsdf), 5), 1);
        match share {
            0.0 => assert_eq!(mean.value, 0.0, "{bsdf}"),
            _ => mean.assert_is(open * share, 0.01, bsdf),
        }
    }
}

#[test]
fn other_integrators_say_that_they_render_no_media() {
    let text = scene(&format!(
        "{}{}",
        meter([0.0, 0.0, 5.0], [0.0, 0.0, 0.0], 4, 1),
        slab(EVERYWHERE)
    ));
    let told = |text: &str| {
        let rendered = rendered(text, &Overrides::default(), &Options::default());
        rendered.warnings.iter().any(|w| {
            w.to_string()
                .contains("does not render participating media")
        })
    };
    assert!(told(&text));
    assert!(!told(
        &text.replace("</scene>", &format!("{}</scene>", volpath(-1)))
    ));
}

fn bits(options: Options, overrides: Overrides) -> Image {
    let text = std::fs::read_to_string(at("scenes/smoke.xml")).expect("the scene is there");
    let text = text.replace("smoke.vol", "scenes/smoke.vol");
    let small = Overrides {
        spp: Some(4),
        size: Some((64, 48)),
        ..overrides
    };
    rendered(&text, &small, &options).image
}

#[test]
fn neither_threads_nor_crop_nor_tree_change_a_bit() {
    let whole = bits(Options::default(), Overrides::default());
    let one = NonZeroUsize::new(1);
    for options in [
        Options {
            threads: one,
            ..Options::default()
        },
        Options {
            method: Method::Brute,
            ..Options::default()
        },
    ] {
        let other = bits(options, Overrides::default());
        assert!(other.data() == whole.data());
    }
    let window = Window {
        x: 21,
        y: 13,
        width: 20,
        height: 17,
    };
    let crop = bits(
        Options::default(),
        Overrides {
            crop: Some(window),
            ..Overrides::default()
        },
    );
    for y in 0..window.height {
        for x in 0..window.width {
            assert_eq!(
                crop.pixel(x, y),
                whole.pixel(x + window.x, y + window.y),
                "{x} {y}"
            );
        }
    }
}
