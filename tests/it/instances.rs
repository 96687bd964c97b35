//! Instances in scene files: the image of a group that stands in the world as instances is that of its shapes moved
//! there.

use super::support::{film, image_of, scene};

/// Turned, sheared, mirrored and stretched unevenly.
const PLACES: [&str; 4] = [
    r#"<matrix value="0.5 0.2 0 -0.7  0 0.4 0.1 0.5  0.1 0 0.6 0  0 0 0 1"/>"#,
    r#"<scale x="-0.4" y="0.5" z="0.3"/><rotate x="1" y="2" angle="40"/><translate x="0.7" y="0.5"/>"#,
    r#"<rotate z="1" angle="30"/><scale x="0.2" y="0.6" z="-0.5"/><translate x="-0.6" y="-0.5"/>"#,
    r#"<matrix value="-0.5 0.1 0.2 0.6  0.1 -0.4 0 -0.5  0.3 0 -0.4 0.1  0 0 0 1"/>"#,
];

/// A shape, and one in a group of its own.
const SHAPES: &str = r#"<shape type="cube"><ref id="grey"/></shape>
    <shape type="group"><transform name="to_world"><scale value="1.4"/><rotate y="1" angle="50"/></transform>
        <shape type="rectangle"><ref id="grey"/></shape></shape>"#;

#[test]
fn a_group_s_instances_look_like_its_shapes_moved_there() {
    let seen = |shapes: String| {
        image_of(
            &scene(&format!(
                r#"<integrator type="aov"><string name="aovs" value="t:depth,p:position,n:sh_normal"/>
                    <integrator type="path"><integer name="max_depth" value="3"/></integrator></integrator>
                <sensor type="perspective">
                    <transform name="to_world"><lookat origin="0, 1, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
                    {}</sensor>
                <emitter type="constant"/>
                <emitter type="point"><point name="position" value="3, 4, 5"/></emitter>
                <bsdf type="twosided" id="grey"><bsdf type="diffuse"/></bsdf>{shapes}"#,
                film(96, 72, 4)
            )),
            1,
        )
    };
    let placed = |shapes: &str| -> String {
        let place = |place: &&str| {
            let transform = format!(r#"<transform name="to_world">{place}</transform>"#);
            format!(r#"<shape type="group">{transform}{shapes}</shape>"#)
        };
        PLACES.iter().map(place).collect()
    };
    let moved = seen(placed(SHAPES));
    let group = format!(r#"<shape type="shapegroup" id="two">{SHAPES}</shape>"#);
    let instances = placed(r#"<shape type="instance"><ref id="two"/></shape>"#);
    let instanced = seen(group + &instances);
    let channels = moved.channels().len();
    // A mirrored mesh is turned over, an instance is not: as in Mitsuba.
    let of_normal = |channel: usize| channel + 3 >= channels;
    let values = moved.data().iter().zip(instanced.data()).enumerate();
    let apart = values.filter(|(i, (a, b))| {
        let [a, b] = match of_normal(i % channels) {
            true => [a.abs(), b.abs()],
            false => [**a, **b],
        };
        (a - b).abs() > 1e-3 * (1.0 + a.abs())
    });
    let (apart, all) = (apart.count(), moved.data().len());
    // A path whose point is rounded otherwise may miss an edge.
    assert!(apart * 500 < all, "{apart} of {all}");
    let lit = moved
        .data()
        .chunks(channels)
        .filter(|p| p[channels - 1] != 0.0);
    assert!(lit.count() * 8 > all / channels, "little is seen");
}
