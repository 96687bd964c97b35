//! Images whose values are known without rendering them: furnaces, irradiance below simple lights, framing,
//! textures and filters.

use std::f64::consts::{FRAC_PI_2, PI};

use etendue::display;
use etendue::image::vol::{Grid, encode};
use etendue::image::{Image, Metadata};
use etendue::render::{Options, Overrides};

use glam::Vec3;

use super::support::{Mean, film, image_of, meter, path, rendered, scene};

/// One colour channel after the other.
fn channels(text: &str, seed: u64) -> [Mean; 3] {
    let image = image_of(text, seed);
    [0, 1, 2].map(|c| Mean::of_channel(&image, c))
}

// ---- furnaces

#[test]
fn a_closed_room_that_glows_is_a_geometric_series() {
    let (glow, reflectance) = ([0.2, 1.0, 3.0], [0.8, 0.5, 0.25]);
    let surface = r#"<boolean name="flip_normals" value="true"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.5, 0.25"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="0.2, 1, 3"/></emitter>"#;
    for shape in ["sphere", "cube"] {
        for depth in 1..=6 {
            let text = scene(&format!(
                r#"{}{}<shape type="{shape}">{surface}</shape>"#,
                path(depth),
                meter([0.1, 0.2, -0.3], [-0.4, 0.3, 0.9], 32, 64),
            ));
            for (c, mean) in channels(&text, 1).iter().enumerate() {
                let series = (0..depth as i32).map(|k| f64::powi(reflectance[c], k));
                let expected = glow[c] * series.sum::<f64>();
                let what = format!("{shape}, depth {depth}, channel {c}");
                mean.assert_is(expected, 0.005, &what);
            }
        }
    }
}

#[test]
fn roulette_does_not_change_the_mean_of_a_furnace() {
    let text = scene(&format!(
        r#"<integrator type="path"><integer name="rr_depth" value="2"/></integrator>{}
        <shape type="sphere">
            <boolean name="flip_normals" value="true"/>
            <bsdf type="diffuse"><float name="reflectance" value="0.75"/></bsdf>
            <emitter type="area"><rgb name="radiance" value="1"/></emitter>
        </shape>"#,
        meter([0.1, 0.2, -0.3], [-0.4, 0.3, 0.9], 64, 64),
    ));
    Mean::of_channel(&image_of(&text, 3), 1).assert_is(4.0, 0.01, "1 / (1 − 0.75)");
}

#[test]
fn a_convex_body_in_even_light_shows_its_reflectance() {
    let bodies = [
        r#"<shape type="sphere">"#.to_owned(),
        r#"<shape type="cube"><transform name="to_world">
            <rotate x="1" y="2" z="3" angle="50"/>
        </transform>"#
            .to_owned(),
    ];
    for body in bodies {
        let text = scene(&format!(
            r#"{}{}<emitter type="constant"><rgb name="radiance" value="2, 1, 0.5"/></emitter>
            {body}<bsdf type="diffuse"><rgb name="reflectance" value="0.9, 0.4, 0.1"/></bsdf></shape>"#,
            path(-1),
            meter([4.0, 3.0, 5.0], [0.1, 0.2, 0.0], 32, 64),
        ));
        for (mean, expected) in channels(&text, 2).iter().zip([1.8, 0.4, 0.05]) {
            mean.assert_is(expected, 0.01, &body);
        }
    }
}

// ---- irradiance

/// The floor z = 0, reflectance 0.6, seen at `at` from (3, −2, 4), under `light`.
fn floor(light: &str, at: [f64; 2], size: u32, spp: u32, integrator: &str) -> String {
    scene(&format!(
        r#"{integrator}{}{light}
        <shape type="rectangle">
            <transform name="to_world"><scale value="10"/></transform>
            <bsdf type="diffuse"><float name="reflectance" value="0.6"/></bsdf>
        </shape>"#,
        meter([3.0, -2.0, 4.0], [at[0], at[1], 0.0], size, spp),
    ))
}

/// The form factor from a point to a parallel rectangle at unit distance, a corner of which stands above the
/// point; odd in both extents.
fn corner(a: f64, b: f64) -> f64 {
    let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * PI)
}

#[test]
fn a_rectangle_light_gives_what_its_form_factor_says() {
    // [-0.6, 0.6] × [-0.3, 0.3] at height 1.5, facing down.
    let light = r#"<shape type="rectangle">
        <transform name="to_world">
            <scale x="0.6" y="0.3" z="1"/><rotate x="1" angle="180"/><translate z="1.5"/>
        </transform>
        <emitter type="area"><rgb name="radiance" value="5"/></emitter>
    </shape>"#;
    for at in [[0.0, 0.0], [0.4, -0.2], [1.5, 0.8]] {
        let extent = |half: f64, x: f64| ((half - x) / 1.5, (-half - x) / 1.5);
        let ((a1, a0), (b1, b0)) = (extent(0.6, at[0]), extent(0.3, at[1]));
        let factor = corner(a1, b1) - corner(a0, b1) - corner(a1, b0) + corner(a0, b0);
        let expected = 0.6 * 5.0 * factor;
        for integrator in [path(2), r#"<integrator type="direct"/>"#.to_owned()] {
            let image = image_of(&floor(light, at, 48, 64, &integrator), 5);
            let what = format!("below a rectangle at {at:?} with {integrator}");
            Mean::of_channel(&image, 1).assert_is(expected, 0.005, &what);
        }
    }
}

#[test]
fn a_sphere_light_gives_pi_l_sin_squared_times_cosine() {
    let light = r#"<shape type="sphere">
        <point name="center" value="0.5, 0.25, 2"/><float name="radius" value="0.4"/>
        <emitter type="area"><rgb name="radiance" value="5"/></emitter>
    </shape>"#;
    for at in [[0.5, 0.25], [0.0, 0.0], [-2.0, 1.0]] {
        let (x, y): (f64, f64) = (0.5 - at[0], 0.25 - at[1]);
        let squared = x * x + y * y + 4.0;
        let expected = 0.6 * 5.0 * (0.16 / squared) * (2.0 / squared.sqrt());
        let image = image_of(&floor(light, at, 48, 64, &path(2)), 6);
        let what = format!("below a sphere at {at:?}");
        Mean::of_channel(&image, 1).assert_is(expected, 0.005, &what);
    }
}

#[test]
fn a_point_light_falls_off_with_the_squared_distance_and_the_cosine() {
    let light = r#"<emitter type="point">
        <point name="position" value="1, -1, 2"/><rgb name="intensity" value="7"/>
    </emitter>"#;
    for at in [[1.0, -1.0], [0.0, 0.0], [4.0, 3.0]] {
        let (x, y): (f64, f64) = (1.0 - at[0], -1.0 - at[1]);
        let squared = x * x + y * y + 4.0;
        let expected = 0.6 / PI * 7.0 * (2.0 / squared.sqrt()) / squared;
        let mean = Mean::of_channel(&image_of(&floor(light, at, 16, 16, &path(2)), 7), 1);
        assert!(
            (mean.value / expected - 1.0).abs() < 1e-4,
            "{at:?}: {mean:?}, {expected}"
        );
    }
}

#[test]
fn parallel_light_brings_its_irradiance_times_the_cosine() {
    for [x, y, z] in [[0.0, 0.0, -1.0], [1.0, 2.0, -2.0], [3.0, 0.0, -0.5]] {
        let light = format!(
            r#"<emitter type="directional">
                <vector name="direction" value="{x}, {y}, {z}"/><rgb name="irradiance" value="4"/>
            </emitter>"#
        );
        let cosine = -z / f64::sqrt(x * x + y * y + z * z);
        let image = image_of(&floor(&light, [0.0, 0.0], 16, 4, &path(2)), 8);
        let mean = Mean::of_channel(&image, 1);
        let expected = 0.6 / PI * 4.0 * cosine;
        assert!(
            (mean.value / expected - 1.0).abs() < 1e-5,
            "{mean:?}, {expected}"
        );
    }
}

#[test]
fn direct_equals_path_at_depth_two() {
    let body = |integrator: &str| {
        scene(&format!(
            r#"{integrator}
            <sensor type="perspective">
                <float name="fov" value="45"/>
                <transform name="to_world">
                    <lookat origin="3, -4, 4" target="0, 0, 0.5" up="0, 0, 1"/>
                </transform>
                {}
            </sensor>
            <emitter type="constant"><rgb name="radiance" value="0.2, 0.3, 0.4"/></emitter>
            <emitter type="point">
                <point name="position" value="-2, -2, 3"/><rgb name="intensity" value="3"/>
            </emitter>
            <shape type="sphere">
                <point name="center" value="1, 1, 1.5"/><float name="radius" value="0.3"/>
                <emitter type="area"><rgb name="radiance" value="4, 3, 2"/></emitter>
            </shape>
            <shape type="cube"><transform name="to_world">
                <scale value="0.5"/><translate z="0.5"/>
            </transform></shape>
            <shape type="rectangle"><transform name="to_world"><scale value="5"/></transform></shape>"#,
            film(32, 32, 64),
        ))
    };
    let means = |integrator: &str, seeds: std::ops::Range<u64>| {
        let images: Vec<Image> = seeds.map(|s| image_of(&body(integrator), s)).collect();
        [0, 1, 2].map(|c| Mean::of(images.iter().map(|i| Mean::of_channel(i, c).value)))
    };
    let path = means(&path(2), 0..8);
    for (what, direct) in [
        ("one sample of each", r#"<integrator type="direct"/>"#),
        (
            "three of the lights, one of the material",
            r#"<integrator type="direct"><integer name="emitter_samples" value="3"/></integrator>"#,
        ),
        (
            "four of the material alone",
            r#"<integrator type="direct">
                <integer name="emitter_samples" value="3"/><integer name="bsdf_samples" value="4"/>
            </integrator>"#,
        ),
    ] {
        for (direct, path) in means(direct, 8..16).iter().zip(&path) {
            direct.assert_equals(path, 0.005, what);
        }
    }
}

// ---- framing

/// A glowing square [x0, x1] × [y0, y1] at height z, facing +z.
fn square([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> String {
    format!(
        r#"<shape type="rectangle">
            <transform name="to_world">
                <scale x="{}" y="{}" z="1"/><translate x="{}" y="{}" z="{z}"/>
            </transform>
            <emitter type="area"><rgb name="radiance" value="1"/></emitter>
        </shape>"#,
        (x1 - x0) / 2.0,
        (y1 - y0) / 2.0,
        (x0 + x1) / 2.0,
        (y0 + y1) / 2.0,
    )
}

/// Fails unless the image is 1 in columns `x` and rows `y`, and 0 elsewhere.
#[track_caller]
fn assert_covers(image: &Image, x: std::ops::Range<u32>, y: std::ops::Range<u32>, what: &str) {
    for row in 0..image.height() {
        for column in 0..image.width() {
            let inside = x.contains(&column) && y.contains(&row);
            let expected = if inside { 1.0 } else { 0.0 };
            let found = image.get(column, row, 1);
            assert_eq!(found, expected, "{what}: pixel ({column}, {row})");
        }
    }
}

/// From +z down to the plane z = 0, the image's right to +x.
fn view(sensor: &str, distance: f64, width: u32, height: u32) -> String {
    format!(
        r#"{}<sensor {sensor}
            <transform name="to_world">
                <lookat origin="0, 0, {distance}" target="0, 0, 0" up="0, 1, 0"/>
            </transform>
            {}
        </sensor>"#,
        path(1),
        film(width, height, 16)
    )
}

#[test]
fn an_orthographic_film_covers_two_units_in_x() {
    // Pixels are 1/8 wide: columns 2..6 are x in [-3/4, -1/4], rows 1..3 are y in [1/4·…].
    let body = square([-0.75, -0.25], [0.125, 0.375], 0.0);
    let text = scene(&(view(r#"type="orthographic">"#, 3.0, 16, 8) + &body));
    assert_covers(&image_of(&text, 1), 2..6, 1..3, "16 × 8");
}

#[test]
fn every_field_of_view_frames_what_its_angle_says() {
    // At distance 2 a half angle of 45° along x shows x in [-2, 2]; pixels are 1/4 wide.
    let body = square([0.5, 1.75], [-0.75, -0.25], 0.0);
    let diagonal = f64::sqrt(1.25).atan().to_degrees() * 2.0;
    let y = 0.5_f64.atan().to_degrees() * 2.0;
    for (axis, angle) in [
        ("x", 90.0),
        ("larger", 90.0),
        ("y", y),
        ("smaller", y),
        ("diagonal", diagonal),
    ] {
        let sensor = format!(
            r#"type="perspective">
            <float name="fov" value="{angle}"/><string name="fov_axis" value="{axis}"/>"#
        );
        let text = scene(&(view(&sensor, 2.0, 16, 8) + &body));
        assert_covers(&image_of(&text, 1), 10..15, 5..7, axis);
    }
}

#[test]
fn fifty_millimetres_show_the_diagonal_of_35_mm_film() {
    // At distance 50 the film of 36 × 24 is its own size: a width of 36 for this aspect.
    let body = square([-18.0, 0.0], [0.0, 12.0], 0.0);
    let text = scene(&(view(r#"type="perspective">"#, 50.0, 18, 12) + &body));
    assert_covers(&image_of(&text, 1), 0..9, 0..6, "50mm");
}

#[test]
fn nothing_nearer_than_the_near_clip_is_seen() {
    let near = |clip: f64| {
        let sensor = format!(r#"type="orthographic"><float name="near_clip" value="{clip}"/>"#);
        let body = square([-2.0, 2.0], [-2.0, 2.0], 1.0);
        image_of(&scene(&(view(&sensor, 3.0, 4, 4) + &body)), 1).get(2, 2, 1)
    };
    assert_eq!((near(1.9), near(2.1)), (1.0, 0.0));
}

// ---- textures

const TEXELS: [[f32; 3]; 6] = [
    [0.1, 0.2, 0.3],
    [0.9, 0.8, 0.7],
    [0.0, 0.5, 1.0],
    [0.4, 0.0, 0.0],
    [0.25, 0.25, 0.25],
    [0.6, 0.7, 0.1],
];

/// The square [-1, 1]² as an orthographic film of 3 × 2 sees it, glowing with the texture.
fn glowing(texture: &str) -> Image {
    let sensor = r#"type="orthographic">"#;
    let text = format!(
        r#"{}<shape type="rectangle">
            <transform name="to_world"><scale x="1" y="{}" z="1"/></transform>
            <emitter type="area">{texture}</emitter>
        </shape>"#,
        view(sensor, 3.0, 12, 8),
        2.0 / 3.0
    );
    image_of(&scene(&text), 1)
}

#[test]
fn a_bitmap_stands_upright_with_its_first_texel_at_the_origin_of_uv() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let names = ["R", "G", "B"].map(String::from).to_vec();
    let image = Image::from_data(3, 2, names, TEXELS.concat()).expect("the sizes agree");
    for (name, tolerance) in [("t.exr", 1e-6), ("t.png", 4e-3)] {
        let path = folder.path().join(name);
        display::save(&path, &image, &Metadata::default(), &Default::default())
            .expect("the folder is there");
        let texture = format!(
            r#"<texture type="bitmap" name="radiance">
                <string name="filename" value="{}"/><string name="filter_type" value="nearest"/>
            </texture>"#,
            path.display()
        );
        let seen = glowing(&texture);
        for y in 0..8 {
            for x in 0..12 {
                // The rectangle's v grows upwards and a bitmap's downwards: the first row is at the bottom.
                let texel = TEXELS[((7 - y) / 4 * 3 + x / 4) as usize];
                for (c, expected) in texel.iter().enumerate() {
                    let found = seen.get(x, y, c);
                    assert!(
                        (found - expected).abs() < tolerance,
                        "{name} at ({x}, {y}): {found}, {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_checkerboard_has_its_first_colour_in_the_first_quarter_and_the_last() {
    let seen = glowing(
        r#"<texture type="checkerboard" name="radiance">
            <rgb name="color0" value="1, 2, 3"/><rgb name="color1" value="0.5"/>
        </texture>"#,
    );
    for y in 0..8 {
        for x in 0..12 {
            let first = (x < 6) == (y >= 4);
            let expected = if first { [1.0, 2.0, 3.0] } else { [0.5; 3] };
            for (c, value) in expected.into_iter().enumerate() {
                assert!((seen.get(x, y, c) - value).abs() < 1e-5, "({x}, {y})");
            }
        }
    }
}

#[test]
fn a_volume_shows_on_a_surface_where_both_are() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("g.vol");
    // 1 and 3 along x, times 1 and 2 along y: linear between the cells' centres.
    let grid = Grid {
        size: [2, 2, 1],
        channels: 1,
        bbox: [Vec3::ZERO, Vec3::ONE],
        values: vec![1.0, 3.0, 2.0, 6.0],
    };
    std::fs::write(&path, encode(&grid)).expect("the folder is there");
    let seen = glowing(&format!(
        r#"<texture type="volume" name="radiance"><volume type="gridvolume" name="volume">
            <string name="filename" value="{}"/>
            <transform name="to_world"><translate x="-0.5" y="-0.5"/><scale x="4" y="4"/></transform>
        </volume></texture>"#,
        path.display()
    ));
    for y in 0..8 {
        for x in 0..12 {
            // The film is 2 wide, and a pixel's samples are even over it.
            let place = [
                (x as f32 + 0.5) / 6.0 - 1.0,
                1.0 - (y as f32 + 0.5) / 6.0 - 1.0 / 3.0,
            ];
            let expected = (2.0 + place[0]) * (1.5 + 0.5 * place[1]);
            let found = seen.get(x, y, 0);
            // Over a pixel of a sixth the values vary by so much.
            assert!(
                (found - expected).abs() < 0.35,
                "({x}, {y}): {found} {expected}"
            );
        }
    }
}

#[test]
fn a_textured_floor_in_even_light_shows_its_texture() {
    let text = scene(&format!(
        r#"{}<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
        <shape type="rectangle">
            <bsdf type="diffuse"><texture type="checkerboard" name="reflectance">
                <float name="color0" value="0.8"/><float name="color1" value="0.3"/>
            </texture></bsdf>
        </shape>"#,
        view(r#"type="orthographic">"#, 3.0, 48, 48).replace(
            r#"<integer name="max_depth" value="1"/>"#,
            r#"<integer name="max_depth" value="2"/>"#
        ),
    ));
    let image = image_of(&text, 4);
    for (first, expected) in [(true, 0.8), (false, 0.3)] {
        let pixels = (0..48 * 48).map(|i| (i % 48, i / 48));
        let quarter = pixels.filter(|(x, y)| ((*x < 24) == (*y >= 24)) == first);
        let mean = Mean::of(quarter.map(|(x, y)| f64::from(image.get(x, y, 1))));
        mean.assert_is(expected, 0.01, "a quarter");
    }
}

// ---- filters

const FILTERS: [&str; 6] = [
    "box",
    "tent",
    "gaussian",
    "mitchell",
    "catmullrom",
    "lanczos",
];

#[test]
fn no_filter_changes_an_even_image() {
    for filter in FILTERS {
        let text = scene(&format!(
            r#"{}<emitter type="constant"><rgb name="radiance" value="0.7"/></emitter>"#,
            view(r#"type="perspective">"#, 3.0, 9, 7)
                .replace(r#"type="box""#, &format!(r#"type="{filter}""#)),
        ));
        for value in image_of(&text, 1).data() {
            assert!((value - 0.7).abs() < 1e-6, "{filter}: {value}");
        }
    }
}

#[test]
fn a_filter_spreads_light_and_loses_none() {
    for filter in FILTERS {
        // A glowing square of exactly 2 × 2 pixels in the middle of 16 × 16.
        let text = scene(
            &(view(r#"type="orthographic">"#, 3.0, 16, 16)
                .replace(r#"type="box""#, &format!(r#"type="{filter}""#))
                + &square([-0.125, 0.125], [-0.125, 0.125], 0.0)),
        );
        let overrides = Overrides {
            spp: Some(1024),
            sampler: Some("stratified".into()),
            ..Overrides::default()
        };
        let image = rendered(&text, &overrides, &Options::default()).image;
        let sum: f32 = image.data().chunks(3).map(|p| p[1]).sum();
        assert!((sum - 4.0).abs() < 0.03, "{filter}: {sum}");
    }
}

#[test]
fn half_the_horizon_is_half_the_light() {
    // A wall that fills half of what the floor sees, black: what remains of π is π/2.
    let light = r#"<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
        <shape type="rectangle">
            <transform name="to_world">
                <scale value="1000"/><rotate y="1" angle="-90"/><translate x="-0.001"/>
            </transform>
            <bsdf type="twosided"><bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf></bsdf>
        </shape>"#;
    let image = image_of(&floor(light, [0.5, 0.0], 48, 64, &path(2)), 9);
    let expected = 0.6 / PI * FRAC_PI_2;
    Mean::of_channel(&image, 1).assert_is(expected, 0.01, "half a sky");
}

// ---- sensors that measure

/// A film of that size, without a filter that mixes its pixels.
fn measuring(width: u32, height: u32, samples: u32) -> String {
    format!(
        r#"<film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{height}"/>
            <string name="pixel_format" value="rgb"/><rfilter type="box"/></film>
        <sampler type="independent"><integer name="sample_count" value="{samples}"/></sampler>"#
    )
}

#[test]
fn an_irradiance_meter_reads_what_a_disc_above_it_sends() {
    // A disc of radius 1 at height h over the middle sends π L / (1 + h²) there.
    let film = measuring(8, 8, 4096);
    let text = scene(&format!(
        r#"{}<shape type="rectangle"><transform name="to_world"><scale value="0.01"/></transform>
            <sensor type="irradiancemeter">{film}</sensor></shape>
        <shape type="disk"><transform name="to_world"><rotate x="1" angle="180"/><translate z="2"/></transform>
            <emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>"#,
        path(2),
    ));
    let expected = PI * 5.0 / 5.0;
    Mean::of_channel(&image_of(&text, 4), 0).assert_is(expected, 0.02, "a disc");
}

#[test]
fn every_shape_measures_the_irradiance_of_even_light_all_over() {
    let film = measuring(6, 5, 16);
    for shape in ["rectangle", "disk", "sphere", "cylinder", "cube"] {
        let text = scene(&format!(
            r#"{}<shape type="{shape}"><transform name="to_world"><scale value="30"/><translate x="-9" y="7"/></transform>
                <sensor type="irradiancemeter">{film}</sensor></shape>
            <emitter type="constant"><rgb name="radiance" value="2"/></emitter>"#,
            path(2),
        ));
        let image = image_of(&text, 5);
        for (x, y) in (0..5).flat_map(|y| (0..6).map(move |x| (x, y))) {
            let value = f64::from(image.get(x, y, 0));
            assert!((value / (2.0 * PI) - 1.0).abs() < 1e-5, "{shape}: {value}");
        }
    }
}

#[test]
fn meters_and_distant_sensors_see_what_their_rays_meet_alone_and_in_a_batch() {
    let wall = r#"<shape type="rectangle"><emitter type="area"><rgb name="radiance" value="3"/></emitter></shape>"#;
    let one = measuring(1, 1, 400);
    let meter = |at: &str, film: &str| {
        format!(
            r#"<sensor type="radiancemeter"><point name="origin" value="{at}"/>
            <vector name="direction" value="0, 0, -2"/>{film}</sensor>"#
        )
    };
    let distant = |target: &str| {
        format!(
            r#"<sensor type="distant"><vector name="direction" value="0, 0, -1"/>{target}{one}</sensor>"#
        )
    };
    let smaller = r#"<shape type="rectangle" name="target"><transform name="to_world"><scale value="0.5"/></transform></shape>"#;
    let larger = r#"<shape type="rectangle" name="target"><transform name="to_world"><scale x="2"/></transform></shape>"#;
    for (sensor, expected, error) in [
        (meter("0.5, -0.9, 4", &one), 3.0, 1e-5),
        (meter("0.5, -1.1, 4", &one), 0.0, 1e-5),
        (meter("0.5, 0.5, -4", &one), 0.0, 1e-5),
        (
            distant(r#"<point name="target" value="0.9, 0.9, 0"/>"#),
            3.0,
            1e-5,
        ),
        (distant(smaller), 3.0, 1e-5),
        (distant(larger), 1.5, 0.3),
        // The square fills 2/π of the circle around it.
        (distant(""), 6.0 / PI, 0.3),
    ] {
        let image = image_of(&scene(&format!("{}{sensor}{wall}", path(1))), 6);
        let value = f64::from(image.get(0, 0, 0));
        assert!((value - expected).abs() <= error, "{sensor}: {value}");
    }
    let sensors = meter("0, 0, 4", "") + &meter("5, 0, 4", "");
    let batch = format!(
        r#"<sensor type="batch">{sensors}<shape type="cube"><transform name="to_world"><translate z="9"/></transform>
            <sensor type="irradiancemeter"/></shape>{}</sensor>"#,
        measuring(6, 2, 4)
    );
    let around = r#"<emitter type="constant"/>"#;
    let image = image_of(&scene(&format!("{}{batch}{wall}{around}", path(1))), 7);
    let row: Vec<f32> = (0..4).map(|x| image.get(x, 1, 0)).collect();
    assert_eq!(row, [3.0, 3.0, 1.0, 1.0]);
    // The cube's faces see the wall nowhere or as a small part of even light.
    assert!((4..6).all(|x| (image.get(x, 0, 0) - std::f32::consts::PI).abs() < 1.0));
}

#[test]
fn sheets_that_polarize_pass_the_share_that_light_without_polarisation_keeps() {
    for (sheet, share) in [("polarizer", 0.5), ("circular", 0.5), ("retarder", 1.0)] {
        let text = scene(&format!(
            r#"{}{}<emitter type="constant"/><shape type="rectangle"><transform name="to_world"><scale value="9"/></transform>
                <bsdf type="{sheet}"><rgb name="transmittance" value="1, 0.5, 0.25"/></bsdf></shape>"#,
            path(-1),
            meter([0.0, 0.0, 3.0], [0.0, 0.0, -1.0], 4, 4),
        ));
        let image = image_of(&text, 8);
        for (c, transmittance) in [1.0, 0.5, 0.25].into_iter().enumerate() {
            assert_eq!(image.get(1, 1, c), share * transmittance, "{sheet}");
        }
    }
}
