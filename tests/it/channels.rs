//! Channels beside light: what `depth` and `aov` show of a scene that is known.

use crate::support::{film, image_of, scene};

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
        ("si.I", 0.0),
        ("al.R", 0.25),
        ("al.G", 0.5),
        ("al.B", 0.75),
    ] {
        near(value(&image, channel, 7, 7), expected);
    }
    near(value(&image, "si.I", 20, 20), 1.0);
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
