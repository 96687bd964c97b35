//! Is `phong` the textbook's equation? It is evaluated here once more, in double precision and from the
//! scene's numbers alone.

use etendue::image::Image;
use etendue::relight::{self, Weight};
use etendue::render::{Colors, Options, Overrides};
use glam::DVec3;

use crate::support::{Mean, film, image_of, meter, path, rendered, scene};

/// The camera's place.
const EYE: DVec3 = DVec3::new(0.0, 0.0, 5.0);
/// Of the sphere around the origin, of radius 1.
const AMBIENT: [f64; 3] = [0.1, 0.2, 0.3];
const DIFFUSE: [f64; 3] = [0.7, 0.4, 0.1];
const SPECULAR: [f64; 3] = [0.6, 0.5, 0.9];
const EXPONENT: f64 = 20.0;
const AMBIENCE: [f64; 3] = [0.5, 0.4, 0.6];
/// A point light, a spot light and a directional one. The small sphere keeps the first from a part of the
/// large one.
const POINT: (DVec3, [f64; 3]) = (DVec3::new(3.0, 2.0, 4.0), [3.0, 2.0, 1.0]);
const SPOT: (DVec3, [f64; 3]) = (DVec3::new(-2.0, 4.0, 3.0), [1.0, 5.0, 2.0]);
const CUTOFF: f64 = 14.0;
const BEAM: f64 = 5.0;
const PARALLEL: (DVec3, [f64; 3]) = (DVec3::new(1.0, -1.0, -0.5), [0.4, 0.3, 0.2]);
const BLOCKER: (DVec3, f64) = (DVec3::new(1.2, 0.8, 1.6), 0.25);

fn rgb(name: &str, [r, g, b]: [f64; 3]) -> String {
    format!(r#"<rgb name="{name}" value="{r}, {g}, {b}"/>"#)
}

fn vector(tag: &str, name: &str, v: DVec3) -> String {
    format!(
        r#"<{tag} name="{name}" x="{}" y="{}" z="{}"/>"#,
        v.x, v.y, v.z
    )
}

/// The scene, with the integrator's further properties.
fn spheres(properties: &str) -> String {
    scene(&format!(
        r#"<integrator type="phong">{properties}</integrator>
        <sensor type="perspective">
            <float name="fov" value="30"/>
            <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
            {}
        </sensor>
        <emitter type="ambient">{}</emitter>
        <emitter type="point" id="bulb">{}{}</emitter>
        <emitter type="spot" id="stage">
            {}<float name="cutoff_angle" value="{CUTOFF}"/><float name="beam_width" value="{BEAM}"/>
            <transform name="to_world"><lookat origin="{}, {}, {}" target="0, 0, 0" up="0, 0, 1"/></transform>
        </emitter>
        <emitter type="directional">{}{}</emitter>
        <shape type="sphere">
            <bsdf type="phong">{}{}{}<float name="exponent" value="{EXPONENT}"/></bsdf>
        </shape>
        <shape type="sphere">
            {}<float name="radius" value="{}"/>
            <bsdf type="diffuse">{}</bsdf>
        </shape>"#,
        film(24, 24, 4),
        rgb("radiance", AMBIENCE),
        vector("point", "position", POINT.0),
        rgb("intensity", POINT.1),
        rgb("intensity", SPOT.1),
        SPOT.0.x,
        SPOT.0.y,
        SPOT.0.z,
        vector("vector", "direction", PARALLEL.0),
        rgb("irradiance", PARALLEL.1),
        rgb("ambient_reflectance", AMBIENT),
        rgb("diffuse_reflectance", DIFFUSE),
        rgb("specular_reflectance", SPECULAR),
        vector("point", "center", BLOCKER.0),
        BLOCKER.1,
        rgb("reflectance", DIFFUSE),
    ))
}

/// Where a ray first meets a sphere.
fn meet(origin: DVec3, direction: DVec3, center: DVec3, radius: f64) -> Option<f64> {
    let way = origin - center;
    let (b, c) = (way.dot(direction), way.length_squared() - radius * radius);
    let root = (b * b - c).sqrt();
    [-b - root, -b + root].into_iter().find(|t| *t > 1e-9)
}

/// What a light brings to a point: toward where, how far it is, and I_i.
type Arriving = (DVec3, f64, [f64; 3]);

/// The three lights at a point.
fn lights(p: DVec3, inverse_square: bool) -> [Arriving; 3] {
    let finite = |(place, intensity): (DVec3, [f64; 3]), share: f64| {
        let way = place - p;
        let scale = if inverse_square {
            way.length_squared().recip()
        } else {
            1.0
        };
        (
            way.normalize(),
            way.length(),
            intensity.map(|i| i * share * scale),
        )
    };
    let angle = SPOT.0.angle_between(SPOT.0 - p).to_degrees();
    let beam = ((CUTOFF - angle) / (CUTOFF - BEAM)).clamp(0.0, 1.0);
    [
        finite(POINT, 1.0),
        finite(SPOT, beam),
        (-PARALLEL.0.normalize(), f64::INFINITY, PARALLEL.1),
    ]
}

/// The equation at the point `p` of the large sphere. `None` within a hair of a shadow's edge.
fn equation(p: DVec3, inverse_square: bool) -> Option<[f64; 3]> {
    let (n, v) = (p.normalize(), (EYE - p).normalize());
    let mut sum: [f64; 3] = std::array::from_fn(|c| AMBIENCE[c] * AMBIENT[c]);
    for (l, distance, intensity) in lights(p, inverse_square) {
        let shadowed = |radius| meet(p, l, BLOCKER.0, radius).is_some_and(|t| t < distance);
        if shadowed(BLOCKER.1 * 0.999) != shadowed(BLOCKER.1 * 1.001) || l.dot(n).abs() < 1e-3 {
            return None;
        }
        if l.dot(n) <= 0.0 || shadowed(BLOCKER.1) {
            continue;
        }
        let r = 2.0 * l.dot(n) * n - l;
        for c in 0..3 {
            let specular = SPECULAR[c] * r.dot(v).max(0.0).powf(EXPONENT);
            sum[c] += intensity[c] * (DIFFUSE[c] * l.dot(n) + specular);
        }
    }
    Some(sum)
}

/// Points of the large sphere, as far as they are well defined, with the radiance that the eye sees there.
fn seen(text: &str) -> Vec<(DVec3, [f32; 3])> {
    let aov = r#"<integrator type="aov"><string name="aovs" value="p:position"/><integrator type="phong">"#;
    let text = text.replace(r#"<integrator type="phong">"#, aov);
    let text = text.replace("</integrator>", "</integrator></integrator>");
    let overrides = Overrides {
        spp: Some(1),
        size: Some((40, 40)),
        ..Overrides::default()
    };
    let image = rendered(&text, &overrides, &Options::default()).image;
    let channels = |names: [&str; 3]| names.map(|name| image.channel(name).unwrap());
    let (rgb, xyz) = (channels(["R", "G", "B"]), channels(["p.X", "p.Y", "p.Z"]));
    let pixels = image.data().chunks(image.channels().len());
    let seen = pixels.map(|pixel| {
        let p = DVec3::from(xyz.map(|c| f64::from(pixel[c])));
        (p, rgb.map(|c| pixel[c]))
    });
    // Neither the surroundings nor the small sphere; and where a ray grazes the sphere, the point itself is ill-defined.
    let on_sphere = |p: DVec3| (p.length() - 1.0).abs() < 1e-5;
    let clear = |p: DVec3| p.normalize().dot((EYE - p).normalize()) > 0.2;
    seen.filter(|(p, _)| on_sphere(*p) && clear(*p)).collect()
}

#[test]
fn phong_is_the_equation_at_fifty_points_of_a_surface() {
    for (falloff, inverse_square) in [("none", false), ("inverse_square", true)] {
        let text = spheres(&format!(r#"<string name="falloff" value="{falloff}"/>"#));
        let (mut points, mut lit_by) = (0, [0; 3]);
        let mut worst: f64 = 0.0;
        for (p, seen) in seen(&text) {
            let Some(expected) = equation(p, inverse_square) else {
                continue;
            };
            points += 1;
            for (i, (l, ..)) in lights(p, inverse_square).iter().enumerate() {
                lit_by[i] += u32::from(l.dot(p) > 0.0);
            }
            for c in 0..3 {
                worst = worst.max((f64::from(seen[c]) / expected[c] - 1.0).abs());
            }
        }
        assert!(
            points >= 50 && lit_by.iter().all(|n| *n >= 20),
            "{points} {lit_by:?}"
        );
        assert!(
            worst < 1e-5,
            "falloff {falloff}: {worst} at one of {points} points"
        );
    }
}

/// The image's channels, added up over layers, and the image's own.
fn assert_layers_add_up(image: &Image) {
    let layers = relight::layers(image);
    let own = image.rgb().unwrap();
    for pixel in image.data().chunks(image.channels().len()) {
        for c in 0..3 {
            let sum: f64 = layers.iter().map(|l| f64::from(pixel[l.channels[c]])).sum();
            let whole = f64::from(pixel[own[c]]);
            assert!((sum - whole).abs() <= 2e-6 * whole.abs(), "{sum} {whole}");
        }
    }
}

#[test]
fn layers_add_up_to_the_image_in_rgb_and_in_bands() {
    let lamp = r#"<shape type="rectangle" id="lamp">
        <transform name="to_world"><rotate y="1" angle="180"/><translate x="0.9" y="-0.9" z="3"/><scale value="0.8"/></transform>
        <emitter type="area"/></shape>
        <shape type="sphere"><point name="center" value="-0.8, -0.8, 0.9"/><float name="radius" value="0.4"/>
        <bsdf type="dielectric"/></shape></scene>"#;
    for (asked, count, one) in [
        ("terms", 4, "emission.R"),
        ("lights", 5, "light.lamp.R"),
        ("terms, lights", 13, "light.bulb.specular.R"),
    ] {
        let text = spheres(&format!(r#"<string name="layers" value="{asked}"/>"#));
        let text = text.replace("</scene>", lamp);
        for colors in [Colors::Rgb, Colors::bands(5)] {
            let options = Options {
                colors,
                ..Options::default()
            };
            let image = rendered(&text, &Overrides::default(), &options).image;
            assert_eq!(relight::layers(&image).len(), count);
            let channel = image.channel(one).unwrap();
            assert!(
                Mean::of_channel(&image, channel).value > 0.0,
                "{asked}: {one} is black"
            );
            assert_layers_add_up(&image);
        }
    }
}

#[test]
fn a_relit_image_is_the_one_that_brighter_lights_would_have_made() {
    let text = spheres(r#"<string name="layers" value="terms, lights"/>"#);
    let image = image_of(&text, 3);
    let weights = [
        ("bulb", [2.0, 1.0, 0.5]),
        ("specular", [0.25; 3]),
        ("ambient", [3.0; 3]),
    ];
    let weights = weights.map(|(name, factors)| Weight {
        name: name.to_owned(),
        factors,
    });
    let relit = relight::relight(&image, &weights).unwrap();
    let brighter = text
        .replace(
            &rgb("intensity", POINT.1),
            &rgb("intensity", [6.0, 2.0, 0.5]),
        )
        .replace(
            &rgb("specular_reflectance", SPECULAR),
            &rgb("specular_reflectance", SPECULAR.map(|s| s / 4.0)),
        )
        .replace(
            &rgb("radiance", AMBIENCE),
            &rgb("radiance", AMBIENCE.map(|a| a * 3.0)),
        );
    let expected = image_of(&brighter, 3);
    for (a, b) in relit
        .data()
        .chunks(relit.channels().len())
        .zip(expected.data().chunks(expected.channels().len()))
    {
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() <= 3e-6 * b[c], "{a:?} {b:?}");
        }
    }
}

#[test]
fn in_shadow_only_ambient_light_remains_and_without_shadow_rays_there_is_no_shadow() {
    let floor = |properties: &str| {
        scene(&format!(
            r#"<integrator type="phong">{properties}</integrator>
            {}
            <emitter type="point"><point name="position" value="0, 0, 2"/></emitter>
            <emitter type="ambient"><float name="radiance" value="0.5"/></emitter>
            <shape type="rectangle"><bsdf type="twosided"><bsdf type="phong"><float name="ambient_reflectance" value="0.25"/>
            <float name="specular_reflectance" value="0"/></bsdf></bsdf></shape>
            <shape type="disk"><transform name="to_world"><scale value="0.1"/><translate z="1"/></transform></shape>"#,
            meter([1.0, 0.0, 1.0], [0.0, 0.0, 0.0], 2, 4)
        ))
    };
    let mean = |properties| Mean::of_channel(&image_of(&floor(properties), 1), 0).value;
    assert_eq!(mean(""), 0.125);
    let lit = mean(r#"<boolean name="shadows" value="false"/>"#);
    assert!((lit - 0.625).abs() < 1e-4, "{lit}");
}

/// A floor that a lamp overhead of 1 × 1 lights, and 9 away from it: nearly a point of intensity 1.
#[test]
fn area_lights_bring_their_intensity_and_mirrors_show_what_they_show() {
    let text = |falloff: &str, mirror: bool| {
        let (origin, mirror) = if mirror {
            // Seen by way of a mirror at x = −1, which turns the image at x = −2 to the origin.
            let shape = r#"<shape type="rectangle"><bsdf type="conductor"/><transform name="to_world">
                <rotate y="1" angle="90"/><translate x="-1"/></transform></shape>"#;
            ([1.0, 0.0, 0.5], shape)
        } else {
            ([1.0, 0.0, 1.0], "")
        };
        let target = if mirror.is_empty() {
            [0.0; 3]
        } else {
            [-2.0, 0.0, 0.0]
        };
        scene(&format!(
            r#"<integrator type="phong"><string name="falloff" value="{falloff}"/></integrator>
            {}
            <shape type="rectangle"><emitter type="area"/><transform name="to_world">
            <scale value="0.5"/><rotate x="1" angle="180"/><translate z="9"/></transform></shape>
            <shape type="rectangle"><bsdf type="diffuse"/></shape>{mirror}"#,
            meter(origin, target, 8, 16)
        ))
    };
    for mirror in [false, true] {
        for (falloff, expected) in [
            ("none", 0.5),
            ("inverse_square", 0.5 / 81.0),
            ("radiometric", 0.5 / 81.0 / std::f64::consts::PI),
        ] {
            let value = Mean::of_channel(&image_of(&text(falloff, mirror), 1), 0).value;
            assert!(
                (value / expected - 1.0).abs() < 0.01,
                "{falloff}, mirror {mirror}: {value}"
            );
        }
    }
}

#[test]
fn ambient_light_is_what_a_surface_emits_of_its_own_in_path_and_direct() {
    let lit = |integrator: &str| {
        let text = scene(&format!(
            r#"{integrator}{}
            <emitter type="ambient"><rgb name="radiance" value="0.5, 1, 2"/></emitter>
            <emitter type="constant"><float name="radiance" value="0.3"/></emitter>
            <shape type="rectangle"><bsdf type="diffuse"/></shape>
            <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/><translate z="1"/></transform>
            <bsdf type="phong"><rgb name="ambient_reflectance" value="0.5, 0.25, 0.5"/></bsdf></shape>"#,
            meter([0.9, 0.0, 0.5], [0.2, 0.0, 0.0], 16, 64)
        ));
        let image = image_of(&text, 2);
        [0, 1, 2].map(|c| Mean::of_channel(&image, c))
    };
    let path = lit(&path(2));
    let direct = lit(r#"<integrator type="direct"/>"#);
    for c in 0..3 {
        path[c].assert_equals(&direct[c], 0.02, "path and direct");
    }
    // The channels differ by what the surface above emits: I_a·k_a is 0.25, 0.25 and 1.
    let ratio = (path[2].value - path[0].value) / path[0].value;
    assert!(path[0].value > 0.05 && ratio > 0.5, "{path:?}");
    path[1].assert_equals(&path[0], 0.02, "equal products");
}
