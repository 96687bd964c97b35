//! Every integrator with every sampler, in small scenes whose radiance is known in closed form. Roulette begins at once,
//! so that what it takes must be made up for.

use std::f64::consts::PI;

use etendue::color::Rgb;
use etendue::integrator::Integrator;
use etendue::sampler::Sampler;

use crate::support::{Mean, image_of, scene};

/// A scene, the point of it that is looked at from (0, 0, 5), and what each integrator sees there.
struct Known {
    name: &'static str,
    body: &'static str,
    target: [f64; 3],
    path: f64,
    direct: f64,
    phong: f64,
    /// One light at a time, without reflections and without holes; `None` where the middle of a light says nothing.
    raster: Option<f64>,
    depth: f64,
}

/// Rays, and depths, begin at the near plane.
const NEAR: f64 = 0.01;

fn scenes() -> Vec<Known> {
    vec![
        Known {
            name: "a grey body in even light",
            body: r#"<shape type="sphere"><bsdf type="diffuse"/></shape><emitter type="constant"/>"#,
            target: [0.0, 0.0, 1.0],
            path: 0.5,
            direct: 0.5,
            // The integral of L·dω, without a division by π.
            phong: 0.5 * PI,
            raster: Some(0.5 * PI),
            depth: 4.0 - NEAR,
        },
        Known {
            name: "a room that glows",
            body: r#"<shape type="sphere">
                <float name="radius" value="6"/><boolean name="flip_normals" value="true"/>
                <bsdf type="diffuse"/><emitter type="area"/>
            </shape>"#,
            target: [0.0, 0.0, -6.0],
            path: 2.0,
            direct: 1.5,
            phong: 1.0 + 0.5 * PI,
            raster: None,
            depth: 11.0 - NEAR,
        },
        Known {
            name: "a floor below a bulb",
            body: r#"<shape type="rectangle"><bsdf type="diffuse"/></shape>
                <emitter type="point">
                    <point name="position" value="0, 1.5, 2"/><rgb name="intensity" value="10"/>
                </emitter>"#,
            target: [0.0, 0.0, 0.0],
            path: 0.5 / PI * 10.0 * 0.8 / 6.25,
            direct: 0.5 / PI * 10.0 * 0.8 / 6.25,
            phong: 0.5 * 10.0 * 0.8 / 6.25,
            raster: Some(0.5 * 10.0 * 0.8 / 6.25),
            depth: 5.0 - NEAR,
        },
        Known {
            name: "a dim mirror under the sky",
            body: r#"<shape type="rectangle"><bsdf type="conductor">
                <rgb name="specular_reflectance" value="0.6"/>
            </bsdf></shape><emitter type="constant"/>"#,
            target: [0.0, 0.0, 0.0],
            path: 0.6,
            direct: 0.6,
            phong: 0.6,
            raster: Some(0.6),
            depth: 5.0 - NEAR,
        },
        Known {
            name: "a black base under a clear coat, and two bulbs",
            body: r#"<shape type="rectangle"><bsdf type="plastic">
                <float name="int_ior" value="9"/><float name="ext_ior" value="1"/>
                <rgb name="diffuse_reflectance" value="0"/>
            </bsdf></shape>
            <emitter type="point"><point name="position" value="0, 1, 2"/></emitter>
            <emitter type="constant"/>"#,
            target: [0.0, 0.0, 0.0],
            path: 0.64,
            direct: 0.64,
            phong: 0.64,
            raster: Some(0.64),
            depth: 5.0 - NEAR,
        },
        Known {
            name: "three black sheets, mostly holes",
            body: r#"<bsdf type="mask" id="sheet"><float name="opacity" value="0.2"/>
                <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
            </bsdf>
            <shape type="rectangle"><ref id="sheet"/></shape>
            <shape type="rectangle">
                <transform name="to_world"><translate z="-1"/></transform><ref id="sheet"/>
            </shape>
            <shape type="rectangle">
                <transform name="to_world"><translate z="-2"/></transform><ref id="sheet"/>
            </shape>
            <emitter type="constant"/>"#,
            target: [0.0, 0.0, 0.0],
            path: 0.512,
            direct: 0.0,
            phong: 0.512,
            raster: Some(0.0),
            depth: 5.0 - NEAR,
        },
    ]
}

/// An integrator of that name, and what it sees.
fn integrator(name: &str, known: &Known) -> (String, f64) {
    let roulette = r#"<integer name="rr_depth" value="1"/>"#;
    let path = format!(r#"<integrator type="path">{roulette}</integrator>"#);
    match name {
        "path" => (path, known.path),
        // Of what comes from the lights next to nothing falls on so small a film.
        "ptracer" => (path, f64::NAN),
        "bdpt" | "guided" | "volpath" | "volpathmis" => {
            let named = format!(r#"<integrator type="{name}">{roulette}</integrator>"#);
            (named, known.path)
        }
        "direct" => (r#"<integrator type="direct"/>"#.into(), known.direct),
        "phong" => (
            format!(
                r#"<integrator type="phong">
                    {roulette}<string name="falloff" value="inverse_square"/>
                </integrator>"#
            ),
            known.phong,
        ),
        "raster" => {
            let falloff = r#"<string name="falloff" value="inverse_square"/>"#;
            let raster = format!(r#"<integrator type="raster">{falloff}</integrator>"#);
            (raster, known.raster.unwrap_or(f64::NAN))
        }
        "aov" => (
            format!(
                r#"<integrator type="aov"><string name="aovs" value="d:depth"/>{path}</integrator>"#
            ),
            known.path,
        ),
        "moment" => (
            format!(r#"<integrator type="moment">{path}</integrator>"#),
            known.path,
        ),
        "depth" => (r#"<integrator type="depth"/>"#.into(), known.depth),
        other => panic!("what should {other} see?"),
    }
}

#[test]
fn every_integrator_sees_what_is_known_with_every_sampler() {
    let mut wrong = Vec::new();
    for known in scenes() {
        for name in Integrator::<Rgb>::NAMES {
            let (integrator, expected) = integrator(name, &known);
            if expected.is_nan() {
                continue;
            }
            for sampler in Sampler::NAMES {
                let [x, y, z] = known.target;
                let text = scene(&format!(
                    r#"{integrator}
                    <sensor type="perspective">
                        <float name="fov" value="0.02"/>
                        <transform name="to_world">
                            <lookat origin="0, 0, 5" target="{x}, {y}, {z}" up="0, 1, 0"/>
                        </transform>
                        <film type="hdrfilm">
                            <integer name="width" value="12"/><integer name="height" value="12"/>
                            <rfilter type="box"/>
                        </film>
                        <sampler type="{sampler}"><integer name="sample_count" value="64"/></sampler>
                    </sensor>{}"#,
                    known.body
                ));
                let mean = Mean::of_channel(&image_of(&text, 7), 1);
                let off = (mean.value - expected).abs();
                let tolerance = match *sampler {
                    // An environment shines from a few directions.
                    _ if *name == "raster" => 0.05 * expected,
                    // Its points are no random ones: what they miss is no noise.
                    "grid" => 0.05 * expected,
                    _ => 4.5 * mean.error + 1e-3 * expected,
                };
                if off > tolerance || mean.error > 0.02 * expected {
                    wrong.push(format!(
                        "{}, {name}, {sampler}: {} ± {} is not {expected}",
                        known.name, mean.value, mean.error
                    ));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
