//! What every light must do, and Mitsuba's numbers for those that look at an image.

use std::sync::Arc;

use super::*;
use crate::color::{Rgb, Samples};
use crate::description::{Description, Kind, Options};
use crate::image::{self, Image, Metadata};
use crate::interaction::{Hit, Ray};
use crate::lanes::warp;
use crate::math::random;
use crate::shape::Geometry;

/// Images in a folder of their own.
struct Pictures(tempfile::TempDir);

impl Pictures {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder for temporary files"))
    }

    /// An image of `width` × 3 texels.
    fn add(&self, name: &str, width: u32, value: impl Fn(u32, u32) -> [f32; 3]) {
        self.add_sized(name, [width, 3], value);
    }

    fn add_sized(
        &self,
        name: &str,
        [width, height]: [u32; 2],
        value: impl Fn(u32, u32) -> [f32; 3],
    ) {
        let mut picture = Image::new(width, height, ["R", "G", "B"].map(String::from).to_vec());
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            for (c, v) in value(x, y).into_iter().enumerate() {
                picture.set(x, y, c, v);
            }
        }
        image::write(&self.0.path().join(name), &picture, &Metadata::default()).unwrap();
    }

    fn light(&self, text: &str) -> Light<Rgb> {
        self.try_light(text).unwrap()
    }

    fn try_light(&self, text: &str) -> Result<Light<Rgb>> {
        let text = format!(r#"<scene version="3.0.0">{text}</scene>"#);
        let scene =
            Description::parse(&text, &self.0.path().join("test.xml"), &Options::default())?;
        let palettes = Palettes::new(Rgb);
        let context = LightContext {
            palettes: &palettes,
            shape: None,
            motion: None,
        };
        let light = Light::build(&scene.root().children(Kind::Emitter)[0], &context)?;
        Ok(light)
    }
}

fn point(seed: u64, i: u32) -> Vec2 {
    let unit = |n| random::unit(random::bits(seed, n));
    Vec2::new(unit(2 * i), unit(2 * i + 1))
}

fn there(position: Vec3) -> Reference {
    Reference {
        position,
        time: 0.0,
    }
}

fn near(a: Samples<3>, b: [f32; 3]) -> bool {
    (0..3).all(|c| (a.0[c] - b[c]).abs() <= 2e-5 * b[c].abs())
}

/// What was probed with Mitsuba 3.9.1 `scalar_rgb`.
fn gradient(pictures: &Pictures) -> Light<Rgb> {
    pictures.add("env.exr", 4, |x, y| {
        let v = (1 + x + 10 * y) as f32;
        [v, 2.0 * v, 0.5 * v]
    });
    pictures.light(
        r#"<emitter type="envmap"><string name="filename" value="env.exr"/><float name="scale" value="2"/>
           <transform name="to_world"><rotate x="1" angle="30"/></transform></emitter>"#,
    )
}

#[test]
fn an_envmap_looks_as_mitsuba_s_does() {
    let light = gradient(&Pictures::new());
    for (direction, red) in [
        ([1.0, 0.0, 0.0], 23.0),
        ([0.0, 0.0, -1.0], 31.666_664),
        ([0.1, 0.2, -0.9], 28.426_64),
        ([-0.6, -0.7, 0.2], 33.298_428),
        ([0.0, 1.0, 0.0], 11.666_667),
        ([0.3, 0.9, 0.3], 6.928_572_7),
    ] {
        let direction = Vec3::from_array(direction).normalize();
        let radiance = light.environment_radiance(direction, 0.0, &());
        assert!(
            near(radiance, [red, 2.0 * red, 0.5 * red]),
            "{direction} {radiance:?}"
        );
    }
}

#[test]
fn every_environment_is_drawn_with_the_density_that_it_says_and_missed_nowhere() {
    let pictures = Pictures::new();
    pictures.add("sun.exr", 16, |x, y| {
        if (x, y) == (3, 1) {
            [500.0, 400.0, 0.0]
        } else {
            [0.0; 3]
        }
    });
    let sun = pictures
        .light(r#"<emitter type="envmap"><string name="filename" value="sun.exr"/></emitter>"#);
    let constant = pictures.light(r#"<emitter type="constant"/>"#);
    let small = |width, height| {
        pictures.add_sized("small.exr", [width, height], |x, y| {
            [(1 + 3 * x + 5 * y) as f32; 3]
        });
        pictures.light(
            r#"<emitter type="envmap"><string name="filename" value="small.exr"/></emitter>"#,
        )
    };
    let small = [[1, 1], [2, 1], [1, 2], [2, 2], [1, 3]].map(|[w, h]| small(w, h));
    // A sun that is met by chance, and stands high.
    let aperture = r#"<float name="sun_aperture" value="30"/>"#;
    let noon = format!(r#"{TURNED}<float name="window_start_time" value="12"/>"#);
    let skies =
        [("sunsky", ""), ("sunsky", TURNED), ("timed_sunsky", &noon)].map(|(name, inside)| {
            pictures.light(&format!(
                r#"<emitter type="{name}">{aperture}{inside}</emitter>"#
            ))
        });
    let lights = [gradient(&pictures), sun, constant].into_iter();
    for (number, light) in lights.chain(small).chain(skies).enumerate() {
        assert!(light.is_environment());
        let n = 200_000;
        let (mut drawn, mut uniform, mut strays) = (0.0, 0.0, 0);
        for i in 0..n {
            // Where nothing comes from nothing is drawn.
            let Some(sample) = light.sample(there(Vec3::ONE), point(1, i), &()) else {
                continue;
            };
            assert!((sample.direction.length() - 1.0).abs() < 1e-5);
            let back = light.environment_radiance(sample.direction, 0.0, &());
            assert!((back.0[0] - sample.radiance.0[0]).abs() < 1e-2 * (1.0 + back.0[0]));
            let pdf = light.environment_pdf(sample.direction, 0.0);
            // Rounding may carry a direction at the border of a cell into the next.
            strays += u32::from((pdf / sample.pdf - 1.0).abs() > 1e-3);
            drawn += f64::from(sample.radiance.0[0] / sample.pdf);
            let direction = Vec3::from(warp::uniform_sphere(point(2, i).into()));
            let radiance = light.environment_radiance(direction, 0.0, &());
            assert!(radiance.is_black() || light.environment_pdf(direction, 0.0) > 0.0);
            uniform += f64::from(radiance.0[0]) * 4.0 * std::f64::consts::PI;
        }
        assert!(strays < n / 1000, "{strays}");
        let ratio = drawn / uniform;
        assert!((ratio - 1.0).abs() < 0.06, "light {number}: {ratio}");
    }
}

const TURNED: &str = r#"<transform name="to_world"><rotate x="1" y="2" angle="50"/></transform>"#;

/// Directions and radiance of Mitsuba 3.9.1 `scalar_rgb` with the sun toward (0.4, 0.3, 0.6).
#[test]
fn sky_and_sun_shine_as_mitsuba_s_do() {
    let pictures = Pictures::new();
    let sun = [0.4, 0.3, 0.6];
    for (inside, direction, expected) in [
        (SKY, sun, [0.172_126, 0.199_153, 0.227_928]),
        (
            SKY,
            [0.0, 0.0, 1.0],
            [0.026_895_6, 0.045_563_8, 0.091_347_6],
        ),
        (SKY, [1.0, 0.0, 0.01], [0.177_358, 0.216_609, 0.231_024]),
        (SKY, [-0.5, 0.2, 0.3], [0.037_847_1, 0.070_832_3, 0.135_649]),
        (SKY, [0.2, 0.1, -0.3], [0.0; 3]),
        (SUN, sun, [21_587.6, 17_882.1, 13_427.6]),
        (SUN, [0.41, 0.3, 0.6], [0.0; 3]),
        (RIM, sun, [26_025.3, 22_370.1, 17_771.9]),
        (HAZE, [0.41, 0.3, 0.6], [358.598, 294.747, 222.39]),
        (HAZE, [0.0, 0.0, 1.0], [0.045_789_8, 0.073_903_7, 0.135_895]),
        (HAZE, [0.0, -1.0, 0.1], [0.098_746_2, 0.217_979, 0.346_854]),
    ] {
        let light = pictures.light(&format!(
            r#"<emitter type="sunsky"><vector name="sun_direction" value="0.4, 0.3, 0.6"/>{inside}</emitter>"#
        ));
        let direction_is_sun = direction == sun;
        let direction = Vec3::from_array(direction).normalize();
        let radiance = light.environment_radiance(direction, 0.0, &());
        for c in 0..3 {
            let error = (radiance.0[c] - expected[c]).abs();
            // Single precision knows the angle from the sun's middle to a tenth of its radius, on either side.
            assert!(
                error <= if direction_is_sun { 5e-3 } else { 1e-3 } * expected[c],
                "{inside} {direction}: {radiance:?} {expected:?}"
            );
        }
    }
}

const SKY: &str = r#"<float name="sun_scale" value="0"/>"#;
const SUN: &str = r#"<float name="sky_scale" value="0"/>"#;
const RIM: &str =
    r#"<float name="sky_scale" value="0"/><boolean name="complex_sun" value="true"/>"#;
const HAZE: &str = r#"<float name="turbidity" value="5.3"/><rgb name="albedo" value="0.1, 0.6, 0.9"/><float name="sun_aperture" value="4"/>"#;

/// The sun's irradiance is the same whatever its size and whether it has a rim.
#[test]
fn a_sun_of_any_size_brings_the_same_light() {
    let pictures = Pictures::new();
    let irradiance = |inside: &str| {
        let light = pictures.light(&format!(
            r#"<emitter type="sunsky"><vector name="sun_direction" value="0, 0.3, 0.6"/>{SUN}{inside}</emitter>"#
        ));
        let drawn = (0..4000).filter_map(|i| light.sample(there(Vec3::ZERO), point(8, i), &()));
        drawn
            .map(|s| f64::from(s.radiance.0[1] / s.pdf))
            .sum::<f64>()
            / 4000.0
    };
    let plain = irradiance("");
    assert!(plain > 0.0);
    for (inside, within) in [
        (r#"<float name="sun_aperture" value="3"/>"#, 2e-3),
        (r#"<boolean name="complex_sun" value="true"/>"#, 2e-2),
    ] {
        let ratio = irradiance(inside) / plain;
        assert!((ratio - 1.0).abs() < within, "{inside}: {ratio}");
    }
}

#[test]
fn an_envmap_of_any_size_is_taken() {
    let pictures = Pictures::new();
    let light = |width, height| {
        let value = |x: u32, y: u32| [1.0 + x as f32, 10.0 * y as f32, 0.5];
        pictures.add_sized("any.exr", [width, height], value);
        pictures
            .light(r#"<emitter type="envmap"><string name="filename" value="any.exr"/></emitter>"#)
    };
    // By columns, rows, direction: Mitsuba 3.9.1 repeats the last row until there are three.
    for (width, height, direction, expected) in [
        (1, 1, [0.3, -0.5, 0.2], [1.0, 0.0, 0.5]),
        (1, 1, [0.0, 1.0, 0.0], [1.0, 0.0, 0.5]),
        (2, 1, [1.0, 0.0, 0.0], [1.0, 0.0, 0.5]),
        (2, 1, [-1.0, 0.0, 0.0], [2.0, 0.0, 0.5]),
        (2, 1, [0.0, 0.0, 1.0], [1.5, 0.0, 0.5]),
        (1, 2, [0.0, 1.0, 0.0], [1.0, 0.0, 0.5]),
        (1, 2, [1.0, 0.0, 0.0], [1.0, 10.0, 0.5]),
        (1, 2, [0.0, -1.0, 0.0], [1.0, 10.0, 0.5]),
        (1, 2, [1.0, 1.0, 0.0], [1.0, 5.0, 0.5]),
        (1, 3, [0.0, -1.0, 0.0], [1.0, 20.0, 0.5]),
        (1, 5, [1.0, 0.0, 0.0], [1.0, 20.0, 0.5]),
    ] {
        let light = light(width, height);
        let direction = Vec3::from_array(direction).normalize();
        let radiance = light.environment_radiance(direction, 0.0, &());
        for c in 0..3 {
            let error = (radiance.0[c] - expected[c]).abs();
            assert!(
                error < 1e-5,
                "{width} × {height} {direction}: {radiance:?} {expected:?}"
            );
        }
    }
}

#[test]
fn a_black_envmap_is_never_drawn() {
    let pictures = Pictures::new();
    pictures.add("black.exr", 4, |_, _| [0.0; 3]);
    let text = |name| {
        format!(r#"<emitter type="envmap"><string name="filename" value="{name}"/></emitter>"#)
    };
    let black = pictures.light(&text("black.exr"));
    assert!(
        black
            .sample(there(Vec3::ZERO), Vec2::splat(0.5), &())
            .is_none()
    );
    assert!(black.environment_radiance(Vec3::X, 0.0, &()).is_black());
}

const AIM: &str = r#"<transform name="to_world"><lookat origin="1, 2, 3" target="0, 0.5, -1" up="0, 1, 0"/></transform>"#;

#[test]
fn spots_and_projectors_throw_what_mitsuba_s_do() {
    let pictures = Pictures::new();
    pictures.add("slide.exr", 4, |x, y| [(x + 4 * y) as f32 / 11.0; 3]);
    let points = [
        [0.0, 0.5, -1.0],
        [0.3, 0.5, -1.0],
        [0.5, 0.0, 0.0],
        [-1.0, 1.5, -3.0],
        [0.0, 3.0, 4.0],
    ];
    let slide = r#"<string name="filename" value="slide.exr"/></texture>"#;
    for (text, expected) in [
        (
            format!(
                r#"<emitter type="spot">{AIM}<float name="cutoff_angle" value="30"/>
                   <rgb name="intensity" value="3, 2, 1"/></emitter>"#
            ),
            [0.155_844_17, 0.160_085_37, 0.226_415_07, 0.074_534_16, 0.0],
        ),
        (
            format!(
                r#"<emitter type="spot">{AIM}<float name="cutoff_angle" value="30"/>
                   <float name="beam_width" value="30"/><texture name="texture" type="bitmap">{slide}</emitter>"#
            ),
            [
                0.025_974_028,
                0.025_258_165,
                0.019_089_729,
                0.019_535_746,
                0.0,
            ],
        ),
        (
            format!(
                r#"<emitter type="projector">{AIM}<float name="fov" value="40"/><float name="scale" value="2"/>
                   <texture name="irradiance" type="bitmap">{slide}</emitter>"#
            ),
            [0.163_199_6, 0.184_041_22, 0.348_368_94, 0.0, 0.0],
        ),
        (
            format!(
                r#"<emitter type="projector">{AIM}<float name="fov" value="40"/><float name="scale" value="2"/>
                   <rgb name="irradiance" value="1"/></emitter>"#
            ),
            [0.326_399_2, 0.337_585_03, 0.518_727, 0.175_888_57, 0.0],
        ),
    ] {
        let light = pictures.light(&text);
        for (p, red) in points.into_iter().zip(expected) {
            let sample = light.sample(there(Vec3::from_array(p)), Vec2::ZERO, &());
            let ours = sample.map_or(0.0, |s| s.radiance.0[0]);
            assert!(
                (ours - red).abs() <= 1e-4 * red,
                "{text} {p:?}: {ours} {red}"
            );
        }
    }
}

/// Turns, grows and moves.
const MOTION: &str = "<animation name='to_world'><transform time='0'><rotate y='1' angle='10'/></transform>
    <transform time='2'><scale value='1.5'/><rotate x='1' z='2' angle='100'/><translate x='0.3' y='1'/></transform></animation>";
/// Stretches unevenly besides, which what is far away cannot.
const STRETCH: &str = "<animation name='to_world'><transform time='0'><rotate y='1' angle='10'/></transform>
    <transform time='2'><scale x='2' y='0.5'/><rotate x='1' z='2' angle='50'/><translate x='0.3' y='1'/></transform></animation>";

/// Every light of the family, with its motion and its shape.
fn every_light(
    pictures: &Pictures,
    motion: &str,
) -> Vec<(&'static str, Light<Rgb>, Moving, Arc<Geometry>)> {
    pictures.add("any.exr", 4, |x, y| [(1 + x + y) as f32; 3]);
    let text = format!(
        "<scene version='3.0.0'><shape type='sphere'><point name='center' value='0, 0, 3'/></shape>
        <shape type='group'>{}</shape></scene>",
        motion.replace(MOTION, STRETCH)
    );
    let scene = Description::parse(&text, "test.xml".as_ref(), &Options::default()).unwrap();
    let [shape, node] = &scene.root().children(Kind::Shape)[..] else {
        panic!("two shapes")
    };
    let node = crate::shape::declared(node).unwrap();
    let moving = node.motion("to_world").unwrap();
    let shape = crate::shape::build(shape).unwrap();
    let shape = Arc::new(shape.geometry);
    let example = |name: &str| match name {
        "envmap" => "<string name='filename' value='any.exr'/>",
        "projector" => {
            "<texture name='irradiance' type='bitmap'><string name='filename' value='any.exr'/></texture>"
        }
        "spot" => "<float name='cutoff_angle' value='60'/>",
        _ => "",
    };
    let palettes = Palettes::new(Rgb);
    let light = |name: &&'static str| {
        let on_shape = name.ends_with("area");
        let own = match *name {
            "area" | "directionalarea" | "ambient" => "",
            _ => motion,
        };
        let text = format!(
            "<scene version='3.0.0'><emitter type='{name}'>{}{own}</emitter></scene>",
            example(name)
        );
        let path = pictures.0.path().join("test.xml");
        let scene = Description::parse(&text, &path, &Options::default()).unwrap();
        let context = LightContext {
            palettes: &palettes,
            shape: on_shape.then_some(&shape),
            motion: (on_shape && !moving.is_still()).then_some(&moving),
        };
        let light = Light::build(&scene.root().children(Kind::Emitter)[0], &context);
        let light = light.unwrap_or_else(|e| panic!("{e}"));
        (*name, light, moving.clone(), shape.clone())
    };
    Light::<Rgb>::NAMES.iter().map(light).collect()
}

#[test]
fn every_light_is_drawn_with_the_density_and_the_radiance_that_it_has_there() {
    let pictures = Pictures::new();
    let still = every_light(&pictures, "").into_iter().map(|l| (0.0, l));
    let moving = every_light(&pictures, MOTION).into_iter();
    let moving = [0.1, 0.4, 0.7]
        .into_iter()
        .flat_map(|time| moving.clone().map(move |l| (time, l)));
    for (time, (name, light, motion, shape)) in still.chain(moving) {
        let position = Vec3::new(0.2, -0.1, 1.0);
        let from = Reference { position, time };
        // Nobody meets light that goes along a normal.
        let undrawn = light.is_ambient() || name == "directionalarea";
        assert_eq!(undrawn, light.power(&Rgb, 10.0) == 0.0, "{name}");
        let mut drawn = 0;
        for i in 0..500 {
            let Some(sample) = light.sample(from, point(3, i), &()) else {
                continue;
            };
            drawn += 1;
            assert!((sample.direction.length() - 1.0).abs() < 1e-5, "{name}");
            assert!(
                sample.pdf > 0.0 && sample.pdf.is_finite(),
                "{name}: {}",
                sample.pdf
            );
            assert!(
                sample.radiance[0] >= 0.0 && sample.radiance[0].is_finite(),
                "{name}"
            );
            if let Some(target) = sample.target {
                let way = (target - position).normalize();
                assert!(way.distance(sample.direction) < 1e-4, "{name}");
            }
            let (density, radiance) = if light.is_environment() {
                let radiance = light.environment_radiance(sample.direction, time, &());
                (light.environment_pdf(sample.direction, time), radiance)
            } else if sample.delta {
                (1.0, sample.radiance)
            } else {
                let to_world = motion.at(time);
                let ray = Ray {
                    origin: to_world.inverse().point(position),
                    direction: to_world.inverse().vector(sample.direction),
                    t_max: f32::INFINITY,
                    time,
                };
                let Some((t, u, v)) = shape.intersect(0, &ray) else {
                    continue; // at the rim
                };
                let hit = Hit {
                    t,
                    u,
                    v,
                    ..Hit::miss(t)
                };
                let at = shape
                    .interaction(&ray, &hit)
                    .transformed(&to_world, sample.direction);
                (
                    light.surface_pdf(position, &at),
                    light.surface_radiance(&at, &()),
                )
            };
            assert!(
                (density / sample.pdf - 1.0).abs() < 5e-3,
                "{name} at {time}: {density} {}",
                sample.pdf
            );
            assert!(
                (radiance[0] / sample.radiance[0] - 1.0).abs() < 2e-2,
                "{name}"
            );
        }
        assert_eq!(drawn == 0, undrawn, "{name} at {time}");
    }
}

/// The density of a light integrates to 1 over all directions, whatever stretches the shape that it stands on.
#[test]
fn the_density_of_a_stretched_light_is_one_per_solid_angle() {
    let lights = every_light(&Pictures::new(), MOTION);
    let (_, light, motion, shape) = lights.iter().find(|(name, ..)| *name == "area").unwrap();
    let (time, position) = (1.4, Vec3::new(0.2, -0.1, 1.0));
    let to_world = motion.at(time);
    let (mut sum, n) = (0.0, 400_000);
    for i in 0..n {
        let direction = crate::lanes::warp::uniform_sphere::<f32>(point(9, i).into()).into();
        let ray = Ray {
            origin: to_world.inverse().point(position),
            direction: to_world.inverse().vector(direction),
            t_max: f32::INFINITY,
            time,
        };
        if let Some((t, u, v)) = shape.intersect(0, &ray) {
            let hit = Hit {
                t,
                u,
                v,
                ..Hit::miss(t)
            };
            let at = shape
                .interaction(&ray, &hit)
                .transformed(&to_world, direction);
            sum += f64::from(light.surface_pdf(position, &at));
        }
    }
    let integral = sum * 4.0 * std::f64::consts::PI / f64::from(n);
    assert!((integral - 1.0).abs() < 0.02, "{integral}");
}
