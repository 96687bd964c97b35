//! Channels beside light: what `depth` and `aov` show of a scene that is known.

use etendue::render::{Options, Silent, render};

use crate::support::{describe, film, image_of, scene};

/// A unit sphere seen along −z from (0, 0, 5) over a red-green floor behind it, in parallel light.
fn seen_by(integrator: &str) -> String {
    scene(&format!(
        r#"{integrator}
        <sensor type="orthographic">
            <transform name="to_world">
                <scale value="2"/><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/>
            </transform>
            {}
        </sensor>
        <emitter type="constant"/>
        <shape type="rectangle">
            <transform name="to_world"><scale value="1.5"/><translate z="-2"/></transform>
            <bsdf type="diffuse"><rgb name="reflectance" value="0.25, 0.5, 0.75"/></bsdf>
        </shape>
        <shape type="sphere"/>"#,
        film(40, 40, 4)
    ))
}

/// The channel's value at a pixel.
fn value(image: &etendue::image::Image, channel: &str, x: u32, y: u32) -> f32 {
    let channels = image.channels();
    let index = image
        .channel(channel)
        .unwrap_or_else(|| panic!("no {channel} in {channels:?}"));
    image.get(x, y, index)
}

/// Equal to half a pixel, which is a tenth wide: samples lie anywhere in theirs.
fn near(actual: f32, expected: f32) {
    assert!((actual - expected).abs() < 0.05, "{actual} {expected}");
}

#[test]
fn depth_is_the_distance_from_the_camera_and_zero_where_nothing_is() {
    let image = image_of(&seen_by(r#"<integrator type="depth"/>"#), 1);
    for channel in ["R", "G", "B"] {
        near(value(&image, channel, 20, 20), 4.0);
        near(value(&image, channel, 7, 7), 7.0);
        assert_eq!(value(&image, channel, 1, 1), 0.0);
    }
}

#[test]
fn aov_names_its_channels_as_mitsuba_does_and_shows_what_is_there() {
    let aov = r#"<integrator type="aov">
        <string name="aovs" value="dd:depth, pp:position, uv:uv, gn:geo_normal, nn:sh_normal, pi:prim_index, si:shape_index, al:albedo"/>
        <integrator type="direct" name="img"/>
    </integrator>"#;
    let image = image_of(&seen_by(aov), 1);
    let names = image.channels().join(" ");
    assert_eq!(
        names,
        "R G B img.R img.G img.B img.A dd.T pp.X pp.Y pp.Z uv.U uv.V gn.X gn.Y gn.Z nn.X nn.Y nn.Z pi.I si.I al.R al.G al.B"
    );
    for c in ["R", "G", "B"] {
        assert_eq!(
            value(&image, c, 20, 20),
            value(&image, &format!("img.{c}"), 20, 20)
        );
    }
    assert_eq!(value(&image, "img.A", 20, 20), 1.0);
    // The floor at the image's upper left, which is (−1.3, 1.3, −2).
    for (channel, expected) in [
        ("dd.T", 7.0),
        ("pp.X", -1.25),
        ("pp.Y", 1.25),
        ("pp.Z", -2.0),
        ("uv.U", 0.083),
        ("uv.V", 0.917),
        ("gn.Z", 1.0),
        ("nn.Z", 1.0),
        ("nn.X", 0.0),
        ("si.I", 1.0),
        ("al.R", 0.25),
        ("al.G", 0.5),
        ("al.B", 0.75),
    ] {
        near(value(&image, channel, 7, 7), expected);
    }
    near(value(&image, "si.I", 20, 20), 2.0);
    assert_eq!(value(&image, "si.I", 1, 1), 0.0);
    near(value(&image, "nn.Z", 20, 20), 1.0);
    assert_eq!(value(&image, "dd.T", 1, 1), 0.0);
}

#[test]
fn hidden_emitters_leave_what_they_light() {
    let lamp = |hide: &str| {
        format!(
            r#"<integrator type="path"><boolean name="hide_emitters" value="{hide}"/></integrator>"#
        )
    };
    let [shown, hidden] = ["false", "true"].map(|hide| image_of(&seen_by(&lamp(hide)), 1));
    near(value(&shown, "G", 1, 1), 1.0);
    assert_eq!(value(&hidden, "G", 1, 1), 0.0);
    assert_eq!(value(&shown, "G", 7, 7), value(&hidden, "G", 7, 7));
}

#[test]
fn texture_coordinates_change_from_pixel_to_pixel_as_the_film_shows_them() {
    // A tilted square in each camera's middle: (u, v) of one pixel and the next differ by what is shown, which is for
    // the root of a pixel's samples.
    let square = r#"<shape type="rectangle">
        <transform name="to_world"><rotate x="1" y="0.4" angle="-30"/><scale value="3"/></transform>
    </shape>"#;
    for sensor in [
        r#"<sensor type="perspective"><float name="fov" value="2"/>"#,
        r#"<sensor type="orthographic">"#,
        r#"<sensor type="thinlens">
            <float name="fov" value="2"/><float name="aperture_radius" value="0.01"/>
            <float name="focus_distance" value="5"/>"#,
    ] {
        let text = scene(&format!(
            r#"<integrator type="aov"><string name="aovs" value="uv:uv, x:duv_dx, y:duv_dy"/></integrator>
            {sensor}<transform name="to_world"><lookat origin="0, 1, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
            {}</sensor>{square}"#,
            film(12, 8, 64).replace("independent", "multijitter")
        ));
        let image = image_of(&text, 1);
        let uv = |x: u32, y: u32| ["uv.U", "uv.V"].map(|c| value(&image, c, x, y));
        for (name, [a, b], pixels) in [
            ("x", [uv(2, 4), uv(10, 4)], 8.0),
            ("y", [uv(6, 1), uv(6, 7)], 6.0),
        ] {
            let shown = ["U", "V"].map(|c| value(&image, &format!("{name}.{c}"), 6, 4) * 8.0);
            let size = (shown[0].powi(2) + shown[1].powi(2)).sqrt();
            for c in 0..2 {
                let change = (b[c] - a[c]) / pixels;
                let off = (shown[c] - change).abs() / size;
                assert!(off < 0.02, "{sensor} {name} {c}: {} {change}", shown[c]);
            }
        }
    }
}

#[test]
fn two_channels_of_one_name_are_refused() {
    for aov in [
        r#"<string name="aovs" value="a:depth, a:depth"/>"#,
        r#"<string name="aovs" value="a:position, a:sh_normal"/>"#,
        r#"<string name="aovs" value="img:albedo"/><integrator type="path" name="img"/>"#,
    ] {
        let text = seen_by(&format!(r#"<integrator type="aov">{aov}</integrator>"#));
        let error = render(&describe(&text), &Options::default(), &Silent).unwrap_err();
        assert!(
            error.to_string().contains("two channels would be named"),
            "{error}"
        );
    }
}

/// The floor in even light, on a film with these properties.
fn filmed(properties: &str) -> etendue::image::Image {
    let text = seen_by(r#"<integrator type="path"/>"#);
    image_of(
        &text.replace("<rfilter", &format!("{properties}<rfilter")),
        3,
    )
}

#[test]
fn every_pixel_format_has_its_channels() {
    let format = |name: &str| filmed(&format!(r#"<string name="pixel_format" value="{name}"/>"#));
    let rgba = format("rgba");
    let [r, g, b] = [0, 1, 2].map(|c| rgba.get(7, 7, c));
    let (x, y, z) = (
        0.412_453 * r + 0.357_58 * g + 0.180_423 * b,
        0.212_671 * r + 0.715_16 * g + 0.072_169 * b,
        0.019_334 * r + 0.119_193 * g + 0.950_227 * b,
    );
    for (name, channels, values) in [
        ("rgb", "R G B", vec![r, g, b]),
        ("RGBA", "R G B A", vec![r, g, b, 1.0]),
        ("luminance", "Y", vec![y]),
        ("luminance_alpha", "Y A", vec![y, 1.0]),
        ("xyz", "X Y Z", vec![x, y, z]),
        ("xyza", "X Y Z A", vec![x, y, z, 1.0]),
    ] {
        let image = format(name);
        assert_eq!(image.channels().join(" "), channels);
        for (seen, expected) in image.pixel(7, 7).iter().zip(&values) {
            assert!((seen - expected).abs() < 1e-5, "{name}: {seen} {expected}");
        }
    }
    // As a picture it is the same.
    let folder = tempfile::tempdir().unwrap();
    let picture = |name: &str| {
        let path = folder.path().join(format!("{name}.png"));
        etendue::display::save(
            &path,
            &format(name),
            &Default::default(),
            &Default::default(),
        )
        .unwrap();
        etendue::image::read(&path, &Default::default())
            .unwrap()
            .image
    };
    let (rgb, xyz) = (picture("rgb"), picture("xyz"));
    for (a, b) in rgb.data().iter().zip(xyz.data()) {
        assert!((a - b).abs() < 0.006, "{a} {b}");
    }
}

#[test]
fn samples_beyond_the_edge_count_where_they_are_asked_for() {
    // A light whose right edge is at −0.05 and whose left one lies just off the film, a pixel being a third wide.
    let text = |border: &str, crop: &str| {
        scene(&format!(
            r#"<integrator type="path"/>
            <sensor type="orthographic">
                <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
                <film type="hdrfilm">
                    <integer name="width" value="6"/><integer name="height" value="4"/>{crop}
                    <boolean name="sample_border" value="{border}"/>
                    <rfilter type="gaussian"><float name="stddev" value="1"/></rfilter>
                </film>
                <sampler type="multijitter"><integer name="sample_count" value="1024"/></sampler>
            </sensor>
            <shape type="rectangle">
                <transform name="to_world"><scale x="0.5" y="5"/><translate x="-0.55"/></transform>
                <emitter type="area"/>
            </shape>"#
        ))
    };
    // The share of a Gaussian between the edges, seen from the first pixel's middle.
    let (with, without) = (0.7328, 0.987);
    for (border, expected) in [("true", with), ("false", without)] {
        let image = image_of(&text(border, ""), 1);
        let seen = image.get(0, 0, 0);
        assert!(
            (seen - expected).abs() < 0.01,
            "{border}: {seen} {expected}"
        );
        // A crop is that part of the whole.
        let crop =
            r#"<integer name="crop_offset_x" value="1"/><integer name="crop_width" value="3"/>"#;
        let part = image_of(&text(border, crop), 1);
        for x in 0..3 {
            assert_eq!(part.get(x, 2, 0), image.get(x + 1, 2, 0));
        }
    }
    // Adaptive sampling takes them too.
    let options = Options {
        adaptive: Some(etendue::render::Adaptive {
            noise_threshold: 0.01,
            min_spp: 64,
            max_spp: 512,
        }),
        ..Options::default()
    };
    let image = render(&describe(&text("true", "")), &options, &Silent)
        .unwrap()
        .image;
    assert!(
        (image.get(0, 0, 0) - with).abs() < 0.03,
        "{}",
        image.get(0, 0, 0)
    );
}
