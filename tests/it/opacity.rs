//! What the camera sees through: opacity behind holes, and emitters that are hidden. Values are those of Mitsuba 3.9.1
//! but where light leaves through a hole into nothing, which it drops.

use crate::support::{Mean, image_of, scene};

/// A lamp of radiance 5 in front of the wall.
fn lamp(z: f64, turn: f64) -> String {
    format!(
        r#"<shape type="rectangle">
            <transform name="to_world">
                <scale value="0.2"/><rotate y="1" angle="{turn}"/><translate z="{z}"/>
            </transform>
            <emitter type="area"><rgb name="radiance" value="5"/></emitter>
        </shape>"#
    )
}

/// A large sheet of that material, before the lamps.
fn sheet(material: &str) -> String {
    format!(
        r#"<shape type="rectangle">
            <transform name="to_world"><scale value="3"/><translate z="4"/></transform>{material}
        </shape>"#
    )
}

const WALL: &str = r#"<shape type="rectangle">
    <transform name="to_world"><scale value="3"/></transform>
    <bsdf type="diffuse"/>
</shape>"#;
const BULB: &str = r#"<emitter type="point">
    <point name="position" value="0, 0, 2"/><rgb name="intensity" value="10"/>
</emitter>"#;
const SKY: &str = r#"<emitter type="constant"><rgb name="radiance" value="0.7"/></emitter>"#;
const NULL: &str = r#"<bsdf type="null"/>"#;
const MASK: &str =
    r#"<bsdf type="mask"><float name="opacity" value="0.25"/><bsdf type="diffuse"/></bsdf>"#;

/// Green and alpha in the middle of `body`, seen from (0, 0, 5) along −z.
fn seen(integrator: &str, properties: &str, body: &str) -> [f64; 2] {
    let text = scene(&format!(
        r#"<integrator type="{integrator}">{properties}</integrator>
        <sensor type="perspective">
            <float name="fov" value="0.1"/>
            <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm">
                <integer name="width" value="8"/><integer name="height" value="8"/>
                <rfilter type="box"/><string name="pixel_format" value="rgba"/>
            </film>
            <sampler type="multijitter"><integer name="sample_count" value="64"/></sampler>
        </sensor>{body}"#
    ));
    let image = image_of(&text, 1);
    [1, 3].map(|channel| Mean::of_channel(&image, channel).value)
}

#[track_caller]
fn assert_seen(integrator: &str, properties: &str, body: &str, expected: [f64; 2]) {
    let seen = seen(integrator, properties, body);
    for (seen, expected) in seen.iter().zip(expected) {
        assert!(
            (seen - expected).abs() < 0.02 * expected + 0.005,
            "{integrator} {properties} {body}: {seen}, not {expected}"
        );
    }
}

const HIDE: &str = r#"<boolean name="hide_emitters" value="true"/>"#;

/// The wall under the bulb alone.
const LIT: f64 = 0.5 / std::f64::consts::PI * 10.0 / 4.0;

#[test]
fn opacity_is_that_of_what_scatters() {
    let coat = r#"<bsdf type="diffuse"/>"#;
    let half_null = r#"<bsdf type="blendbsdf"><float name="weight" value="0.25"/>
        <bsdf type="null"/><bsdf type="diffuse"/></bsdf>"#;
    for integrator in ["path", "phong"] {
        for (material, opacity) in [
            (NULL, 0.0),
            (MASK, 0.25),
            (coat, 1.0),
            (half_null, 0.25),
            (r#"<bsdf type="conductor"/>"#, 1.0),
            (r#"<bsdf type="dielectric"/>"#, 1.0),
            // What passes a clear pane passes as through a hole.
            (r#"<bsdf type="thindielectric"/>"#, 0.0769),
        ] {
            assert_seen(integrator, "", &sheet(material), [0.0, opacity]);
            // In surroundings that are seen nothing is clear.
            let [_, alpha] = seen(integrator, "", &format!("{SKY}{}", sheet(material)));
            assert_eq!(alpha, 1.0, "{integrator} {material}");
        }
        let depth = |n: u32| format!(r#"<integer name="max_depth" value="{n}"/>"#);
        // Nothing is scattered, so nothing is opaque but what gives light.
        assert_seen(integrator, &depth(1), WALL, [0.0, 0.0]);
        assert_seen(integrator, &depth(1), &lamp(3.0, 0.0), [5.0, 1.0]);
        assert_seen(integrator, &depth(1), &lamp(3.0, 180.0), [0.0, 1.0]);
        let behind = format!("{}{WALL}", sheet(MASK));
        assert_seen(integrator, &depth(2), &behind, [0.0, 0.25]);
        assert_seen(integrator, &depth(3), &behind, [0.0, 1.0]);
    }
    assert_seen("direct", "", SKY, [0.7, 0.0]);
    assert_seen("direct", "", &sheet(NULL), [0.0, 1.0]);
    assert_seen("direct", "", &sheet(MASK), [0.0, 1.0]);
}

#[test]
fn the_colour_of_a_cut_out_is_kept_where_light_leaves_into_nothing() {
    let body = format!("{}{BULB}", sheet(MASK));
    // The bulb is behind the sheet.
    assert_seen("path", "", &body, [0.0, 0.25]);
    let before = BULB.replace("0, 0, 2", "0, 0, 6");
    let body = format!("{}{before}", sheet(MASK));
    assert_seen("path", "", &body, [0.25 * LIT, 0.25]);
}

#[test]
fn hidden_emitters_are_looked_through() {
    let (front, back) = (lamp(3.0, 0.0), lamp(3.0, 180.0));
    for integrator in ["path", "direct"] {
        // The wall behind a lamp that shines away from it, and behind one that lights it.
        let wall = format!("{WALL}{BULB}");
        assert_seen(integrator, HIDE, &format!("{front}{wall}"), [LIT, 1.0]);
        let [lit, _] = seen(integrator, HIDE, &format!("{back}{wall}"));
        assert!(lit > LIT + 0.005, "{lit}");
        let two = format!("{}{back}{wall}", lamp(4.5, 0.0));
        assert_seen(integrator, HIDE, &two, [lit, 1.0]);
        assert_seen(integrator, HIDE, &front, [0.0, 0.0]);
        assert_seen(integrator, HIDE, SKY, [0.0, 0.0]);
        assert_seen(integrator, HIDE, &format!("{SKY}{front}"), [0.0, 0.0]);
        // Only the camera looks through them.
        assert_seen(
            integrator,
            HIDE,
            &format!("{}{front}", sheet(NULL)),
            [5.0, 1.0],
        );
        // Whatever it is made of.
        let cut_out = front.replace("<emitter", &format!("{MASK}<emitter"));
        assert_seen(integrator, HIDE, &format!("{cut_out}{wall}"), [LIT, 1.0]);
    }
    let depth = r#"<integer name="max_depth" value="2"/>"#;
    let body = format!("{front}{WALL}{BULB}");
    assert_seen("path", &format!("{HIDE}{depth}"), &body, [LIT, 1.0]);
    // Surroundings are not seen through holes either.
    assert_seen("path", HIDE, &format!("{SKY}{}", sheet(NULL)), [0.0, 0.0]);
    assert_seen(
        "path",
        HIDE,
        &format!("{SKY}{}", sheet(MASK)),
        [0.0875, 0.25],
    );
    let mirror = sheet(r#"<bsdf type="conductor"/>"#);
    assert_seen(
        "path",
        HIDE,
        &format!("{}{mirror}", lamp(6.0, 180.0)),
        [5.0, 1.0],
    );
}

#[test]
fn other_channels_show_hidden_emitters() {
    let body = format!("{}{WALL}", lamp(3.0, 0.0));
    assert_seen("depth", HIDE, &body, [1.99, 1.0]);
    let aov = format!(
        r#"{HIDE}<string name="aovs" value="d:depth"/><integrator type="path">{HIDE}</integrator>"#
    );
    let text = scene(&format!(
        r#"<integrator type="aov">{aov}</integrator>
        <sensor type="perspective">
            <float name="fov" value="0.1"/>
            <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="2"/><integer name="height" value="2"/></film>
            <sampler type="independent"/>
        </sensor>{body}"#
    ));
    let image = image_of(&text, 1);
    let depth = image.channel("d.T").expect("a channel of depth");
    assert!((image.get(0, 0, depth) - 1.99).abs() < 1e-3);
    assert!(image.get(0, 0, 1) < 1.0, "the wall");
}
