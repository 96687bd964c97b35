//! Motion blur: images whose values are known, the same bits whoever renders them, and input that makes no motion.

use std::f64::consts::PI;
use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;
use std::process::Command;

use etendue::accel::Method;
use etendue::description::{Description, Options as ReadOptions};
use etendue::image::Image;
use etendue::lanes::Kernel;
use etendue::render::{Options, Overrides, Silent, render};
use etendue::sensor::Window;

use super::support::{Mean, at, film, image_of, path, rendered, scene};

const SHUTTER: &str =
    r#"<float name="shutter_open" value="0"/><float name="shutter_close" value="1"/>"#;

/// Looks along −z at the square [−1, 1]² with its shutter open from 0 to 1.
fn window(pixels: u32, spp: u32) -> String {
    format!(
        r#"<sensor type="orthographic">{SHUTTER}
            <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
            {}</sensor>"#,
        film(pixels, pixels, spp)
    )
}

/// An animation with these operations at each time.
fn animation(keyframes: &[(f64, &str)]) -> String {
    let frames = keyframes.iter();
    let frames = frames
        .map(|(time, operations)| format!(r#"<transform time="{time}">{operations}</transform>"#));
    format!(
        r#"<animation name="to_world">{}</animation>"#,
        frames.collect::<String>()
    )
}

fn channel(image: &Image, channel: usize) -> Vec<f64> {
    let stride = image.channels().len();
    image
        .data()
        .chunks(stride)
        .map(|p| f64::from(p[channel]))
        .collect()
}

// ---- closed forms

/// A disk of radius r that crosses a window of area 4 at constant speed, with room before and behind, covers it on the
/// average by its area times the window's width over its way: πr²/4·2/6.
#[test]
fn a_disk_that_crosses_the_picture_is_seen_for_the_time_it_takes() {
    let way = animation(&[
        (0.0, r#"<scale value="0.8"/><translate x="-3"/>"#),
        (1.0, r#"<scale value="0.8"/><translate x="3"/>"#),
    ]);
    let text = scene(&format!(
        r#"{}{}<shape type="disk">{way}<emitter type="area"/></shape>"#,
        path(1),
        window(32, 400)
    ));
    let image = image_of(&text, 1);
    let mean = Mean::of_channel(&image, 0);
    assert!((mean.value - PI * 0.64 / 12.0).abs() < 2e-3, "{mean:?}");
    // In each row of pixels the chord over the way, alike in all columns.
    let values = channel(&image, 0);
    for row in [10_usize, 16, 20] {
        let y = 1.0 - (row as f64 + 0.5) / 16.0;
        let chord = 2.0 * (0.64 - y * y).max(0.0).sqrt();
        let found = Mean::of(values[32 * row..32 * (row + 1)].iter().copied());
        found.assert_is(chord / 6.0, 0.02, &format!("row {row}"));
    }
}

/// A bar that turns about its end by a whole turn covers a point at distance ρ for asin(w/ρ)/π of the time, w being half
/// its width.
#[test]
fn a_bar_that_turns_about_its_end_is_seen_the_less_the_farther_out() {
    let turn = |angle: u32| {
        format!(
            r#"<scale x="0.475" y="0.05"/><translate x="0.475"/><rotate z="1" angle="{angle}"/>"#
        )
    };
    let turns = [0, 100, 200, 300, 360].map(turn);
    let keyframes: Vec<(f64, &str)> = [0.0, 100.0, 200.0, 300.0, 360.0]
        .iter()
        .zip(&turns)
        .map(|(angle, operations)| (angle / 360.0, operations.as_str()))
        .collect();
    // The end is where the bar is turned about, so that it is moved there as a whole.
    let bar = animation(&keyframes);
    let text = scene(&format!(
        r#"{}{}<shape type="group">{}<shape type="rectangle"><transform name="to_world"><scale x="0.475" y="0.05"/>
            <translate x="0.475"/></transform><emitter type="area"/></shape></shape>"#,
        path(1),
        window(48, 256),
        animation(&[
            (0.0, ""),
            (100.0 / 360.0, r#"<rotate z="1" angle="100"/>"#),
            (200.0 / 360.0, r#"<rotate z="1" angle="200"/>"#),
            (300.0 / 360.0, r#"<rotate z="1" angle="300"/>"#),
            (1.0, r#"<rotate z="1" angle="360"/>"#),
        ])
    ));
    let values = channel(&image_of(&text, 2), 0);
    for (near, far) in [(0.2, 0.4), (0.4, 0.6), (0.6, 0.85)] {
        let (mut ratios, mut count) = (Vec::new(), 0);
        for (i, value) in values.iter().enumerate() {
            let [x, y] = [i % 48, i / 48].map(|p| (p as f64 + 0.5) / 24.0 - 1.0);
            let distance = x.hypot(y);
            if (near..far).contains(&distance) {
                count += 1;
                ratios.push(value / ((0.05 / distance).asin() / PI));
            }
        }
        assert!(count > 50);
        // Over a pixel the mean is not that at its middle, by a little.
        let mean = Mean::of(ratios);
        assert!(
            (mean.value - 1.0).abs() < 4.0 * mean.error + 0.01,
            "{near}: {mean:?}"
        );
    }
    // Written without a group, each keyframe moves the bar's middle straight to the next: another motion.
    let straight = scene(&format!(
        r#"{}{}<shape type="rectangle">{bar}<emitter type="area"/></shape>"#,
        path(1),
        window(48, 64)
    ));
    let other = channel(&image_of(&straight, 2), 0);
    assert!(other[24 * 48 + 44] < 0.02 && values[24 * 48 + 44] > 0.01);
}

/// A light of intensity I that passes at height h from −a to a brings I/(h·√(a² + h²)) to the plane below it.
#[test]
fn a_light_that_passes_brings_the_mean_of_what_it_brings_on_its_way() {
    let (h, a): (f64, f64) = (1.5, 2.0);
    let expected = 1.0 / (h * a.hypot(h)) / PI;
    let way = |scale: &str| {
        animation(&[
            (0.0, &format!(r#"{scale}<translate x="{}" z="{h}"/>"#, -a)),
            (1.0, &format!(r#"{scale}<translate x="{a}" z="{h}"/>"#)),
        ])
    };
    let floor = r#"<shape type="rectangle"><transform name="to_world"><scale value="9"/></transform>
        <bsdf type="diffuse"><float name="reflectance" value="1"/></bsdf></shape>"#;
    let eye = format!(
        r#"<sensor type="perspective"><float name="fov" value="0.02"/>{SHUTTER}<transform name="to_world">
        <lookat origin="0, 6, 0.5" target="0, 0, 0" up="0, 0, 1"/></transform>{}</sensor>"#,
        film(32, 32, 256)
    );
    // A ball's irradiance is that of a point; its radiance is I/(πr²).
    let radius = 0.3;
    let radiance = 1.0 / (PI * radius * radius);
    let ball = format!(
        r#"<shape type="sphere">{}<emitter type="area"><float name="radiance" value="{radiance}"/></emitter></shape>"#,
        way(r#"<scale value="0.3"/>"#)
    );
    let stretched = format!(
        r#"<shape type="sphere">{}<emitter type="area"><float name="radiance" value="{radiance}"/></emitter></shape>"#,
        way(r#"<scale x="0.3" y="0.3" z="0.3"/><rotate z="1" angle="50"/>"#)
    );
    let spot = |cutoff: u32| {
        format!(
            r#"<emitter type="spot"><float name="cutoff_angle" value="{cutoff}"/><float name="beam_width" value="{cutoff}"/>
            {}</emitter>"#,
            animation(&[
                (
                    0.0,
                    r#"<rotate x="1" angle="180"/><translate x="-2" z="1.5"/>"#
                ),
                (
                    1.0,
                    r#"<rotate x="1" angle="180"/><translate x="2" z="1.5"/>"#
                ),
            ])
        )
    };
    let direct = r#"<integrator type="direct"><integer name="emitter_samples" value="0"/>
        <integer name="bsdf_samples" value="1"/></integrator>"#;
    let point = format!(r#"<emitter type="point">{}</emitter>"#, way(""));
    for (name, integrator, light) in [
        ("point", path(2), &point),
        ("spot", path(2), &spot(80)),
        ("ball", path(2), &ball),
        ("turned ball", path(2), &stretched),
        ("ball, met by chance", direct.to_owned(), &ball),
    ] {
        let text = scene(&format!("{integrator}{eye}{floor}{light}"));
        Mean::of_channel(&image_of(&text, 3), 1).assert_is(expected, 0.02, name);
    }
}

/// A camera that turns sees what stands move the other way.
#[test]
fn a_camera_that_moves_blurs_what_stands_as_if_it_moved() {
    let eye = |pose: &str| {
        format!(
            r#"<sensor type="orthographic">{SHUTTER}{pose}{}</sensor>"#,
            film(24, 24, 256)
        )
    };
    let look = r#"<lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/>"#;
    let moved = |x: f64| format!(r#"{look}<translate x="{x}"/>"#);
    let still = format!(r#"<transform name="to_world">{look}</transform>"#);
    let (from, to) = (moved(0.6), moved(-0.6));
    let moving = eye(&animation(&[(0.0, &from), (1.0, &to)]));
    let disk =
        |to_world: &str| format!(r#"<shape type="disk">{to_world}<emitter type="area"/></shape>"#);
    let size = r#"<scale value="0.4"/>"#;
    let stands = disk(&format!(r#"<transform name="to_world">{size}</transform>"#));
    let moves = disk(&animation(&[
        (0.0, &format!(r#"{size}<translate x="-0.6"/>"#)),
        (1.0, &format!(r#"{size}<translate x="0.6"/>"#)),
    ]));
    let image = |body: String| channel(&image_of(&scene(&format!("{}{body}", path(1))), 4), 0);
    let (a, b) = (
        image(format!("{moving}{stands}")),
        image(format!("{}{moves}", eye(&still))),
    );
    let differences = a.iter().zip(&b).map(|(a, b)| (a - b).abs());
    assert!(differences.fold(0.0, f64::max) < 0.13);
    let [a, b] = [a, b].map(Mean::of);
    assert!((a.value - b.value).abs() < 2e-3 && a.value > 0.1);
}

/// Where what moves is seen at the end, less where it is seen at the beginning, in pixels to the right and down.
#[test]
fn the_motion_of_a_pixel_is_how_far_what_it_shows_is_displaced() {
    let eye = |pose: String| {
        format!(
            r#"<sensor type="perspective"><float name="fov" value="90"/>{SHUTTER}{pose}{}</sensor>"#,
            film(40, 40, 16)
        )
    };
    let aov = r#"<integrator type="aov"><string name="aovs" value="m:motion"/></integrator>"#;
    let motion = |body: String| {
        let image = image_of(&scene(&format!("{aov}{body}")), 1);
        let of = |name: &str| {
            let place = image.channels().iter().position(|c| c == name);
            channel(&image, place.expect("there is the channel"))[20 * 40 + 20]
        };
        [of("m.X"), of("m.Y")]
    };
    let look = r#"<lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/>"#;
    let still = eye(format!(r#"<transform name="to_world">{look}</transform>"#));
    let shift = animation(&[(0.0, ""), (1.0, r#"<translate x="0.8" y="0.4"/>"#)]);
    let wall = |to_world: &str| format!(r#"<shape type="rectangle">{to_world}</shape>"#);
    // The picture is eight units wide at the wall.
    let close = |[x, y]: [f64; 2], expected: [f64; 2]| {
        assert!(
            (x - expected[0]).abs() < 1e-3 && (y - expected[1]).abs() < 1e-3,
            "{x} {y}"
        );
    };
    close(motion(format!("{still}{}", wall(&shift))), [4.0, -2.0]);
    close(motion(format!("{still}{}", wall(""))), [0.0, 0.0]);
    let carried =
        r#"<lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/><translate x="0.8" y="0.4"/>"#;
    let moving = eye(animation(&[(0.0, look), (1.0, carried)]));
    close(motion(format!("{moving}{}", wall(""))), [-4.0, 2.0]);
    // The sky stays where a camera is carried, and goes to the right by 20·tan 0.1 pixels where it turns to the left by 0.1.
    close(motion(moving), [0.0, 0.0]);
    let turn = |angle: f64| format!(r#"<rotate y="1" angle="{}"/>{look}"#, angle.to_degrees());
    let turns = eye(animation(&[(0.0, &turn(0.0)), (1.0, &turn(0.1))]));
    let [x, y] = motion(turns);
    let expected = 20.0 * 0.1_f64.tan();
    assert!((x - expected).abs() < 0.01 && y.abs() < 0.01, "{x} {y}");
}

// ---- the same bits

/// Three vertex sets of a sheet of two triangles with a bump, as OBJ files.
fn sheets(folder: &Path) {
    for (number, lift) in [0.0, 0.5, -0.3].into_iter().enumerate() {
        let text = format!(
            "v -1 -1 {lift}\nv 1 -1 0\nv 1 1 {lift}\nv -1 1 0\nv 0 0 {}\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n",
            0.3 + lift
        );
        fs::write(folder.join(format!("sheet-{number}.obj")), text).unwrap();
    }
}

/// A blade of two and a half turns, a lamp that moves, a sheet that deforms and turns, and a camera that goes by.
fn everything() -> String {
    let turn = |i: u32| {
        format!(
            r#"<rotate z="1" angle="{}"/><translate x="-1" y="0.5"/>"#,
            i * 150
        )
    };
    let turns: Vec<String> = (0..=6).map(turn).collect();
    let keyframes = turns.iter().enumerate();
    let blade: Vec<(f64, &str)> = keyframes
        .map(|(i, t)| (i as f64 / 6.0, t.as_str()))
        .collect();
    scene(&format!(
        r#"{}<sensor type="perspective"><float name="fov" value="50"/>{SHUTTER}{}{}</sensor>
        <shape type="group">{}<shape type="cube"><transform name="to_world"><scale x="0.9" y="0.1" z="0.1"/></transform></shape>
            <shape type="sphere"><float name="radius" value="0.2"/></shape></shape>
        <shape type="sphere">{}<emitter type="area"><float name="radiance" value="9"/></emitter></shape>
        <shape type="obj"><string name="filename" value="sheet-0.obj"/><string name="filename_1" value="sheet-1.obj"/>
            <string name="filename_2" value="sheet-2.obj"/><string name="times" value="0, 0.3, 1"/>{}
            <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="6"/><translate z="-1.5"/></transform></shape>
        <emitter type="constant"><float name="radiance" value="0.2"/></emitter>"#,
        path(4),
        animation(&[
            (
                0.0,
                r#"<lookat origin="-0.2, 0, 5" target="0, 0, 0" up="0, 1, 0"/>"#
            ),
            (
                1.0,
                r#"<lookat origin="0.2, 0.1, 5" target="0, 0, 0" up="0, 1, 0"/>"#
            )
        ]),
        film(56, 40, 8),
        animation(&blade),
        animation(&[
            (
                0.0,
                r#"<scale value="0.2"/><translate x="-1" y="1.5" z="1"/>"#
            ),
            (
                1.0,
                r#"<scale value="0.3"/><translate x="2" y="1.5" z="1"/>"#
            )
        ]),
        animation(&[
            (0.0, r#"<translate x="1" y="-0.5"/>"#),
            (
                1.0,
                r#"<rotate y="1" angle="60"/><translate x="1" y="-0.5"/>"#
            )
        ])
    ))
}

fn bits_of(folder: &Path, overrides: &Overrides, options: &Options) -> Image {
    let mut description = Description::parse(
        &everything(),
        &folder.join("scene.xml"),
        &ReadOptions::default(),
    )
    .unwrap_or_else(|e| panic!("{e}"));
    overrides.apply(&mut description);
    let rendered = render(&description, options, &Silent).unwrap_or_else(|e| panic!("{e}"));
    assert!(rendered.warnings.is_empty(), "{:?}", rendered.warnings);
    rendered.image
}

fn bits(image: &Image) -> Vec<u32> {
    image.data().iter().map(|v| v.to_bits()).collect()
}

#[test]
fn motion_has_the_same_bits_with_any_threads_by_brute_force_and_in_a_crop() {
    let folder = tempfile::tempdir().unwrap();
    sheets(folder.path());
    let expected = bits_of(folder.path(), &Overrides::default(), &Options::default());
    assert!(expected.data().iter().filter(|v| **v > 0.0).count() > 5000);
    for threads in [1, 3] {
        let options = Options {
            threads: NonZeroUsize::new(threads),
            ..Options::default()
        };
        let found = bits_of(folder.path(), &Overrides::default(), &options);
        assert!(bits(&found) == bits(&expected), "{threads} threads");
    }
    let brute = Options {
        method: Method::Brute,
        ..Options::default()
    };
    let found = bits_of(folder.path(), &Overrides::default(), &brute);
    assert!(bits(&found) == bits(&expected), "brute force");
    let crop = Window {
        x: 11,
        y: 7,
        width: 30,
        height: 20,
    };
    let overrides = Overrides {
        crop: Some(crop),
        ..Overrides::default()
    };
    let part = bits_of(folder.path(), &overrides, &Options::default());
    for (x, y) in (0..crop.height).flat_map(|y| (0..crop.width).map(move |x| (x, y))) {
        for c in 0..3 {
            let whole = expected.get(crop.x + x, crop.y + y, c);
            assert_eq!(part.get(x, y, c).to_bits(), whole.to_bits(), "{x} {y}");
        }
    }
    assert!(!Kernel::all().is_empty());
}

#[test]
fn a_render_of_what_moves_that_is_stopped_goes_on_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    sheets(folder.path());
    fs::write(folder.path().join("scene.xml"), everything()).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_etendue"));
        let command =
            command
                .current_dir(folder.path())
                .args(["render", "scene.xml", "-q", "--spp", "64"]);
        command.args(arguments).output().unwrap()
    };
    let whole = run(&["-o", "whole.exr"]);
    assert!(
        whole.status.success(),
        "{}",
        String::from_utf8_lossy(&whole.stderr)
    );
    for limit in ["0.05", "0.1", "600"] {
        run(&[
            "-o",
            "part.exr",
            "--checkpoint",
            "0",
            "--resume",
            "--time-limit",
            limit,
        ]);
    }
    let [whole, part] = ["whole.exr", "part.exr"].map(|name| {
        let path = folder.path().join(name);
        etendue::image::read(&path, &Default::default())
            .unwrap()
            .image
    });
    assert!(bits(&whole) == bits(&part));
}

#[test]
fn a_shutter_that_opens_for_no_time_shows_what_stands_there() {
    let body = |to_world: &str, shutter: &str| {
        scene(&format!(
            r#"{}<sensor type="orthographic">{shutter}<transform name="to_world">
            <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>{}</sensor>
            <shape type="disk">{to_world}<emitter type="area"/></shape>"#,
            path(1),
            film(16, 16, 16)
        ))
    };
    let way = animation(&[
        (0.0, r#"<scale value="0.3"/><translate x="-1"/>"#),
        (2.0, r#"<scale value="0.3"/><translate x="1"/>"#),
    ]);
    let instant =
        r#"<float name="shutter_open" value="1.5"/><float name="shutter_close" value="1.5"/>"#;
    let there =
        r#"<transform name="to_world"><scale value="0.3"/><translate x="0.5"/></transform>"#;
    let moving = channel(&image_of(&body(&way, instant), 5), 0);
    let still = channel(&image_of(&body(there, ""), 5), 0);
    let apart = moving.iter().zip(&still).filter(|(a, b)| a != b).count();
    assert!(apart <= 2 && still.iter().any(|v| *v > 0.9), "{apart}");
    // One keyframe stands still, and so do many that are alike.
    let one = animation(&[(3.0, r#"<scale value="0.3"/><translate x="0.5"/>"#)]);
    assert_eq!(
        channel(&image_of(&body(&one, SHUTTER), 5), 0).len(),
        still.len()
    );
    let overrides = Overrides {
        shutter: Some((1.5, 1.5)),
        ..Overrides::default()
    };
    let other = rendered(
        &body(&way, SHUTTER),
        &overrides,
        &Options {
            seed: 5,
            ..Options::default()
        },
    );
    assert_eq!(channel(&other.image, 0), moving);
}

// ---- what makes no motion

#[test]
fn what_makes_no_motion_is_told_where_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    sheets(folder.path());
    fs::write(
        folder.path().join("other.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .unwrap();
    fs::write(
        folder.path().join("nowhere-near.obj"),
        "v -1 -1 0\nv 1 -1 nan\nv 1 1 0\nv -1 1 0\nv 0 0 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n",
    )
    .unwrap();
    let sheet = |more: &str| {
        format!("<shape type='obj'>\n<string name='filename' value='sheet-0.obj'/>\n{more}</shape>")
    };
    let name =
        |number: u32, file: &str| format!("<string name='filename_{number}' value='{file}'/>\n");
    let frames = |a: &str, b: &str| {
        format!("<shape type='sphere'>\n<animation name='to_world'>\n{a}\n{b}</animation></shape>")
    };
    let first = "<transform time='0'/>";
    let cases = [
        (frames("<transform time='1'/>", first), 4, "follow each other in time"),
        (frames(first, first), 4, "follow each other in time"),
        (frames(first, "<transform time='1e99'/>"), 4, "not between"),
        (frames("", ""), 2, "at least one"),
        (frames(first, "<transform time='1'><matrix value='1 .5 0 0 1 0 0 0 1'/></transform>"), 4, "cannot shear"),
        (frames(first, "<transform time='1'><scale x='-1'/></transform>"), 4, "one mirrors and the other does not"),
        (frames(first, "<transform time='1'><scale x='0'/></transform>"), 4, "singular"),
        (sheet(&name(1, "other.obj")), 3, "it has 3 vertices, and the first mesh 5"),
        (sheet(&name(1, "nowhere-near.obj")), 3, "2 of its triangles have a corner whose place is not finite"),
        (frames(first, "<transform time='1'><translate x='1e300'/></transform>"), 4, "too large"),
        (sheet(&name(0, "sheet-1.obj")), 3, "the first file is \"filename\""),
        (sheet(&name(2, "sheet-1.obj")), 2, "there is no \"filename_1\""),
        (sheet("<string name='times' value='0, 1'/>"), 3, "there is one"),
        (sheet(&(name(1, "sheet-1.obj") + "<string name='times' value='0'/>")), 4, "there are 1 times, and 2 files"),
        (sheet(&(name(1, "sheet-1.obj") + "<string name='times' value='1, 1'/>")), 4, "each after the one before"),
        (sheet(&(name(1, "sheet-1.obj") + "<string name='times' value='a, b'/>")), 4, "are no numbers"),
        (sheet(&(name(1, "nowhere.obj"))), 3, "nowhere.obj"),
        (sheet(&(name(1, "sheet-1.obj") + "<emitter type='area'/>")), 4, "cannot be a light"),
        (sheet(&(name(1, "sheet-1.obj") + "<float name='displacement' value='1'/>")), 4, "a mesh that deforms cannot be displaced"),
        (
            "<shape type='merge'>\n<animation name='to_world'><transform time='0'/></animation><shape type='sphere'/></shape>"
                .to_owned(),
            2,
            "a merge has no place of its own",
        ),
        (
            format!("<shape type='shapegroup'>\n{}</shape>", frames(first, "<transform time='1'><scale x='2'/></transform>")),
            3,
            "cannot move by itself",
        ),
        (
            "<sensor type='perspective'>\n<float name='shutter_open' value='1'/><float name='shutter_close' value='0'/></sensor>".to_owned(),
            2,
            "lies before shutter_open",
        ),
        (
            "<integrator type='aov'>\n<string name='aovs' value='m:motion'/></integrator>\
             <sensor type='batch'><sensor type='perspective'/></sensor>".to_owned(),
            2,
            "is of sensors that project",
        ),
        ("<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'>\n<animation name='to_uv'><transform time='0'/></animation></texture></bsdf>".to_owned(), 2, "expected a transform"),
    ];
    for (body, line, says) in cases {
        let body = match body.starts_with("<bsdf") {
            true => format!("<shape type='sphere'>{body}</shape>"),
            false => body,
        };
        let sensor = if body.contains("<sensor") {
            ""
        } else {
            "<sensor type='perspective'/>"
        };
        let text = format!("<scene version='3.0.0'>{body}{sensor}</scene>");
        let path = folder.path().join("scene.xml");
        let read = Description::parse(&text, &path, &ReadOptions::default());
        let error = match read.and_then(|d| render(&d, &Options::default(), &Silent)) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("{body} was rendered"),
        };
        assert!(error.contains(says), "{body}\n{error}");
        assert!(
            error.contains(&format!("scene.xml:{line}")),
            "{body}\n{error}"
        );
    }
}

#[test]
fn half_a_turn_between_keyframes_is_warned_of() {
    let text = "<scene version='3.0.0'><shape type='sphere'><animation name='to_world'><transform time='0'/>
        <transform time='1'><rotate y='1' angle='180'/></transform></animation></shape></scene>";
    let path = Path::new("scene.xml");
    let description = Description::parse(text, path, &ReadOptions::default()).unwrap();
    let warnings = description.warnings();
    assert!(
        warnings
            .iter()
            .any(|w| w.to_string().contains("which way is not said")),
        "{warnings:?}"
    );
}

/// A square that an animation carries from x = −3 to x = 3 in a second, as glTF.
fn carried(folder: &Path) {
    let corners = [
        -0.5, -0.5, 0.0, 0.5, -0.5, 0.0, 0.5, 0.5, 0.0, -0.5, 0.5, 0.0,
    ];
    let numbers = corners
        .iter()
        .chain(&[0.0, 1.0])
        .chain(&[-3.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
    let mut bytes: Vec<u8> = numbers.flat_map(|x: &f32| x.to_le_bytes()).collect();
    bytes.extend([0, 1, 2, 0, 2, 3]);
    fs::write(folder.join("square.bin"), &bytes).unwrap();
    let view = |offset: u32, length: u32| {
        format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}}}"#)
    };
    let accessor = |view: u32, kind: u32, count: u32, shape: &str| {
        format!(
            r#"{{"bufferView":{view},"componentType":{kind},"count":{count},"type":"{shape}"}}"#
        )
    };
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":3}}]}}],
        "animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}}],
            "samplers":[{{"input":1,"output":2}}]}}],
        "accessors":[{},{},{},{}],"bufferViews":[{},{},{},{}],
        "buffers":[{{"byteLength":{},"uri":"square.bin"}}]}}"#,
        accessor(0, 5126, 4, "VEC3"),
        accessor(1, 5126, 2, "SCALAR"),
        accessor(2, 5126, 2, "VEC3"),
        accessor(3, 5121, 6, "SCALAR"),
        view(0, 48),
        view(48, 8),
        view(56, 24),
        view(80, 6),
        bytes.len()
    );
    fs::write(folder.join("square.gltf"), text).unwrap();
}

/// A square of area 1 that crosses a window of area 4 covers it for its area times the window's width over its way, and
/// in the rows that it passes for 1/6 of the time.
#[test]
fn an_animation_of_a_file_is_seen_for_the_time_it_takes() {
    let folder = tempfile::tempdir().unwrap();
    carried(folder.path());
    let text = scene(&format!(
        r#"<integrator type="aov"><string name="aovs" value="s:shape_index"/></integrator>{}
        <shape type="gltf"><string name="filename" value="square.gltf"/><string name="times" value="0, 0.3, 1"/></shape>"#,
        window(16, 1024)
    ));
    let path = folder.path().join("scene.xml");
    let description = Description::parse(&text, &path, &ReadOptions::default()).unwrap();
    let rendered =
        render(&description, &Options::default(), &Silent).unwrap_or_else(|e| panic!("{e}"));
    let image = rendered.image;
    let place = image
        .channels()
        .iter()
        .position(|c| c == "s.I")
        .expect("the channel");
    let values = channel(&image, place);
    let row = |row: usize| Mean::of(values[16 * row..16 * (row + 1)].iter().copied());
    row(8).assert_is(1.0 / 6.0, 0.03, "inside");
    assert_eq!(row(1).value, 0.0);
    // As a bare file, frame after frame.
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_etendue"));
        let command = command
            .current_dir(folder.path())
            .args(["render", "square.gltf", "-q"]);
        let output = command
            .args(["--size", "24x16", "--spp", "2"])
            .args(arguments)
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    };
    run(&["-o", "s-{frame}.png", "--frames", "0:3", "--fps", "2"]);
    run(&[
        "-o",
        "b-{frame}.png",
        "--frames",
        "0:2",
        "--fps",
        "2",
        "--shutter",
        "180",
    ]);
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let images = ["s-0.png", "s-1.png", "s-2.png", "b-0.png", "b-1.png"].map(read);
    for (i, image) in images.iter().enumerate() {
        assert!(images[..i].iter().all(|other| other != image), "{i}");
    }
}

/// What animated scenes come to where nothing of them moves: in a profile, in a folder of trees, as a mesh's report.
#[test]
fn other_commands_take_scenes_that_move() {
    let folder = tempfile::tempdir().unwrap();
    let scene = at("scenes/blades.xml");
    let scene = scene.to_str().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_etendue"));
        let output = command
            .current_dir(folder.path())
            .args(arguments)
            .output()
            .unwrap();
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), told)
    };
    for arguments in [
        &["check", scene][..],
        &["info", scene],
        &[
            "render", scene, "-o", "a.exr", "--size", "24x16", "--spp", "2", "--cache", "trees",
            "-q",
        ],
        &[
            "render", scene, "-o", "b.exr", "--size", "24x16", "--spp", "2", "--cache", "trees",
            "-q",
        ],
        &[
            "render",
            scene,
            "-o",
            "f-{frame}.png",
            "--size",
            "24x16",
            "--spp",
            "2",
            "--frames",
            "0:2",
            "--shutter",
            "180",
            "-q",
        ],
        &[
            "render",
            scene,
            "-o",
            "t-{frame}.png",
            "--size",
            "24x16",
            "--spp",
            "2",
            "--turntable",
            "2",
            "--shutter",
            "90",
            "-q",
        ],
    ] {
        let (status, told) = run(arguments);
        assert_eq!(status, Some(0), "{arguments:?}: {told}");
    }
    let [a, b] = ["a.exr", "b.exr"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(a == b);
    let [f, g] = ["f-0.png", "f-1.png"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(f != g, "frames are at other times");
}
