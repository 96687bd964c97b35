//! Renders as a whole: stopped and continued, one after another over one scene, and on bad days.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use glam::Vec3;

use etendue::budget::Budget;
use etendue::color::luminance;
use etendue::description::{self, Description};
use etendue::error::Problem;
use etendue::mesh::read;
use etendue::render::{
    Adaptive, BareMesh, Checkpoint, Completed, Options, Overrides, Phase, Progress, Rendered,
    Session, Silent, Staging, UpAxis, describe_mesh, render,
};
use etendue::sampler::Sampler;
use etendue::sensor::Window;

/// A small scene; `%` stands for what the test changes.
const SCENE: &str = "<scene version='3.0.0'>
    <integrator type='path'><integer name='max_depth' value='3'/></integrator>
    <sensor type='perspective' id='a'>
        <transform name='to_world'><lookat origin='0, 1, 5' target='0, 0, 0' up='0, 1, 0'/></transform>
        <film type='hdrfilm'><integer name='width' value='70'/><integer name='height' value='40'/></film>
        <sampler type='independent'><integer name='sample_count' value='40'/></sampler>
    </sensor>
    <sensor type='perspective' id='b'>
        <transform name='to_world'><lookat origin='5, 1, 0' target='0, 0, 0' up='0, 1, 0'/></transform>
        <film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/></film>
        <sampler type='independent'><integer name='sample_count' value='4'/></sampler>
    </sensor>
    <emitter type='constant'/>
    <shape type='sphere'/>
    <shape type='ply'><string name='filename' value='floor.ply'/></shape>
</scene>";

const FLOOR: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n-9 -1 -9\n9 -1 -9\n0 -1 9\n3 0 2 1\n";

/// A folder with the scene's mesh in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("floor.ply"), FLOOR).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn scene(&self, text: &str) -> Description {
        let options = description::Options::default();
        Description::parse(text, &self.path("scene.xml"), &options).unwrap()
    }

    /// With a checkpoint that is written as often as possible.
    fn keeping(&self) -> Options {
        let checkpoint = Checkpoint {
            path: self.path("image.exr.checkpoint"),
            every: Some(Duration::ZERO),
            resume: true,
        };
        Options {
            checkpoint: Some(checkpoint),
            ..Options::default()
        }
    }
}

/// Counts loadings, and asks to stop after so many batches.
#[derive(Default)]
struct Watch {
    loaded: AtomicUsize,
    batches: AtomicUsize,
    stop_after: Option<usize>,
    rendering: AtomicBool,
}

impl Watch {
    fn stopping_after(batches: usize) -> Self {
        Self {
            stop_after: Some(batches),
            ..Self::default()
        }
    }
}

impl Progress for Watch {
    fn begin(&self, phase: Phase, _total: u64) {
        self.rendering
            .store(phase == Phase::Render, Ordering::Relaxed);
        if phase == Phase::Load {
            self.loaded.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn advance(&self, _steps: u64, rays: u64) {
        if self.rendering.load(Ordering::Relaxed) && rays > 0 {
            self.batches.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn stop(&self) -> bool {
        self.stop_after
            .is_some_and(|n| self.batches.load(Ordering::Relaxed) >= n)
    }
}

const ADAPTIVE: Adaptive = Adaptive {
    noise_threshold: 0.01,
    min_spp: 16,
    max_spp: 80,
};

#[test]
fn a_render_that_is_stopped_again_and_again_ends_with_the_same_bits() {
    let gaze = Some([9.0, 31.5]);
    for (adaptive, gaze) in [(None, None), (Some(ADAPTIVE), None), (None, gaze)] {
        let place = Place::new();
        let scene = place.scene(SCENE);
        let at_once = Options {
            adaptive,
            gaze,
            ..Options::default()
        };
        let whole = render(&scene, &at_once, &Silent).unwrap();
        assert!(whole.report.completed.is_whole());
        let mut runs = 0;
        let resumed = loop {
            // Another number of threads each time, and a process of its own as far as the session goes.
            let options = Options {
                threads: std::num::NonZeroUsize::new(1 + runs % 3),
                adaptive,
                gaze,
                ..place.keeping()
            };
            let rendered = render(&scene, &options, &Watch::stopping_after(1)).unwrap();
            runs += 1;
            let completed = rendered.report.completed;
            if completed.is_whole() {
                options.checkpoint.unwrap().remove();
                break rendered;
            }
            assert!(completed.units[0] > 0 && completed.samples < 40);
            assert!(runs < 100, "every run goes on");
        };
        assert!(runs > 3, "{runs}");
        assert_eq!(resumed.image, whole.image);
        assert_eq!(resumed.report.stats, whole.report.stats);
        assert_eq!(fs::read_dir(place.0.path()).unwrap().count(), 1);
    }
}

/// Of an adaptive render the first samples of all pixels are shown until the pilots take their places.
#[test]
fn adaptive_sampling_soon_has_a_whole_picture() {
    let place = Place::new();
    let scene = place.scene(SCENE);
    let mut seen = [false; 2];
    for batches in (0..180).step_by(3) {
        let options = Options {
            threads: std::num::NonZeroUsize::new(1),
            adaptive: Some(ADAPTIVE),
            ..Options::default()
        };
        let rendered = render(&scene, &options, &Watch::stopping_after(batches)).unwrap();
        let completed = rendered.report.completed;
        if completed.samples == 0 {
            continue;
        }
        let state = [1, 16].iter().position(|n| *n == completed.samples);
        seen[state.expect("the draft's samples or the pilots'")] = true;
        let image = &rendered.image;
        let green = image.channel("G").unwrap();
        let pixels = image.data().chunks_exact(image.channels().len());
        for pixel in pixels {
            assert!(pixel[green] > 0.0, "{batches}: {pixel:?}");
            assert!(pixel.iter().all(|value| value.is_finite()));
        }
    }
    assert_eq!(seen, [true; 2]);
}

#[test]
fn a_stopped_render_says_how_much_of_it_is_there() {
    let place = Place::new();
    let scene = place.scene(SCENE);
    let tiles = 3 * 2;
    for batches in [0, 7, 13] {
        let options = Options {
            threads: std::num::NonZeroUsize::new(1),
            ..Options::default()
        };
        let watch = Watch::stopping_after(batches);
        let rendered = render(&scene, &options, &watch).unwrap();
        let Completed {
            samples,
            passes,
            units,
        } = rendered.report.completed;
        assert!(units[0] <= batches && units[1] == 4 * tiles);
        assert_eq!(passes, [(units[0] / tiles) as u32, 4]);
        assert_eq!(samples, [0, 1, 16][passes[0] as usize]);
        if passes[0] > 0 {
            let dark = |pixel: &[f32]| pixel.iter().all(|v| *v == 0.0);
            let pixels = rendered.image.data().chunks_exact(3);
            assert!(
                pixels.filter(|pixel| dark(pixel)).count() == 0,
                "a whole picture"
            );
        }
        let entry = rendered
            .metadata
            .entries
            .iter()
            .find(|(name, _)| name == "samples_complete");
        assert_eq!(entry.unwrap().1, samples.into());
        if batches == 0 {
            assert!(rendered.image.data().iter().all(|v| *v == 0.0));
        }
    }
}

/// A checkpoint of a render that was stopped.
fn stopped(place: &Place) -> (Description, Options) {
    let (scene, options) = (place.scene(SCENE), place.keeping());
    let watch = Watch::stopping_after(4);
    let rendered = render(&scene, &options, &watch).unwrap();
    assert!(!rendered.report.completed.is_whole());
    (scene, options)
}

#[test]
fn a_checkpoint_of_another_render_is_refused_and_says_what_is_another() {
    let place = Place::new();
    let (scene, options) = stopped(&place);
    let refusal = |scene: &Description, options: &Options| {
        render(scene, options, &Silent).unwrap_err().to_string()
    };
    let seed = Options {
        seed: 1,
        ..options.clone()
    };
    assert!(refusal(&scene, &seed).contains("a setting"));
    let other = place.scene(&SCENE.replace(
        "type='constant'/",
        "type='constant'><float name='radiance' value='2'/></emitter",
    ));
    assert!(refusal(&other, &options).contains("the scene ("));
    let nearer = place.scene(&SCENE.replace("0, 1, 5", "0, 1, 4"));
    assert!(refusal(&nearer, &options).contains("the view ("));
    let mut more = place.scene(SCENE);
    let overrides = Overrides {
        spp: Some(41),
        ..Overrides::default()
    };
    overrides.apply(&mut more);
    assert!(refusal(&more, &options).contains("the view ("));
    fs::write(
        place.path("floor.ply"),
        FLOOR.replace("-9 -1 -9", "-8 -1 -9"),
    )
    .unwrap();
    assert!(refusal(&scene, &options).contains("floor.ply"));
    fs::write(place.path("floor.ply"), FLOOR).unwrap();
    let again = place.scene(&format!("<!-- the same -->\n{SCENE}"));
    assert!(render(&again, &options, &Silent).is_ok());
}

#[test]
fn no_damage_to_a_checkpoint_is_believed() {
    let place = Place::new();
    let (scene, options) = stopped(&place);
    let path = place.path("image.exr.checkpoint");
    let good = fs::read(&path).unwrap();
    let mut session = Session::default();
    let mut refused = |bytes: &[u8], what: &str| {
        fs::write(&path, bytes).unwrap();
        let error = session.render(&scene, &options, &Watch::stopping_after(0));
        let message = error.expect_err(what).to_string();
        assert!(message.contains("checkpoint"), "{what}: {message}");
    };
    let header = good.iter().rposition(|b| *b == b'}').unwrap();
    let cuts = (0..40)
        .chain((40..header).step_by(97))
        .chain([header, good.len() - 1]);
    for length in cuts {
        refused(&good[..length], &format!("cut to {length}"));
    }
    for at in (0..600.min(good.len())).chain((600..good.len()).step_by(1999)) {
        let mut bytes = good.clone();
        bytes[at] ^= 0x40;
        refused(&bytes, &format!("byte {at} changed"));
    }
    let mut long = good.clone();
    long.extend([0; 64]);
    refused(&long, "more at the end");
    let mut huge = good.clone();
    huge[16..20].fill(0xff);
    refused(&huge, "a header of 4 GB");
    refused(b"", "nothing");
}

#[test]
fn without_an_interval_a_checkpoint_is_written_when_the_render_is_stopped() {
    let place = Place::new();
    let mut options = place.keeping();
    options.checkpoint.as_mut().unwrap().every = None;
    let (scene, path) = (place.scene(SCENE), place.path("image.exr.checkpoint"));
    render(&scene, &options, &Silent).unwrap();
    assert!(!path.exists());
    render(&scene, &options, &Watch::stopping_after(3)).unwrap();
    assert!(path.exists());
}

#[test]
fn the_time_to_load_is_told_by_the_render_that_first_made_use_of_it() {
    let place = Place::new();
    let (mut session, options) = (Session::default(), Options::default());
    let scene = place.scene(SCENE);
    session.bounds(&scene, &options, &Silent).unwrap();
    let mut load = || {
        let rendered = session.render(&scene, &options, &Silent).unwrap();
        rendered.report.seconds.load
    };
    assert!(load() > 0.0);
    assert_eq!(load(), 0.0);
}

#[test]
fn a_checkpoint_that_cannot_be_written_is_a_warning() {
    let place = Place::new();
    let mut options = place.keeping();
    let file = place.path("file");
    std::fs::write(&file, "").unwrap();
    options.checkpoint.as_mut().unwrap().path = file.join("in it");
    let rendered = render(&place.scene(SCENE), &options, &Silent).unwrap();
    assert!(rendered.report.completed.is_whole());
    let said = rendered.warnings[0].to_string();
    assert!(said.contains("cannot write the checkpoint"), "{said}");
}

#[test]
fn views_and_frames_of_one_scene_share_it_and_another_scene_takes_its_place() {
    let place = Place::new();
    let (mut session, watch) = (Session::default(), Watch::default());
    let mut loadings = |scene: &Description, sensor: usize| {
        let options = Options {
            sensor,
            ..Options::default()
        };
        let shared = session.render(scene, &options, &watch).unwrap();
        let alone = render(scene, &options, &Silent).unwrap();
        assert_eq!(shared.image, alone.image);
        watch.loaded.load(Ordering::Relaxed)
    };
    assert_eq!(loadings(&place.scene(SCENE), 0), 1);
    assert_eq!(loadings(&place.scene(SCENE), 1), 1);
    let nearer = SCENE.replace("0, 1, 5", "0, 1, 4");
    assert_eq!(loadings(&place.scene(&nearer), 0), 1);
    let larger = SCENE.replace(
        "'sphere'/",
        "'sphere'><float name='radius' value='1.5'/></shape",
    );
    assert_eq!(loadings(&place.scene(&larger), 0), 2);
    fs::write(
        place.path("floor.ply"),
        FLOOR.replace("-9 -1 -9", "-10.5 -1 -9"),
    )
    .unwrap();
    assert_eq!(loadings(&place.scene(&larger), 0), 3);
}

#[test]
fn a_shared_scene_hides_no_mistake_of_a_view() {
    let place = Place::new();
    let mut session = Session::default();
    let options = Options::default();
    session
        .render(&place.scene(SCENE), &options, &Silent)
        .unwrap();
    let odd = SCENE.replace(
        "<integer name='max_depth' value='3'/>",
        "<integer name='max_dept' value='3'/>",
    );
    for _ in 0..2 {
        let error = session
            .render(&place.scene(&odd), &options, &Silent)
            .unwrap_err();
        assert!(error.to_string().contains("max_dept"), "{error}");
    }
}

#[test]
fn what_does_not_fit_into_memory_is_refused_before_anything_is_loaded() {
    let place = Place::new();
    let watch = Watch::default();
    for (size, limit, part) in [((4000, 4000), 600_000_000, "--crop"), ((8, 8), 4_700, "")] {
        let mut scene = place.scene(SCENE).within(&Budget::new(Some(limit)));
        let overrides = Overrides {
            size: Some(size),
            ..Overrides::default()
        };
        overrides.apply(&mut scene);
        let error = render(&scene, &Options::default(), &watch)
            .unwrap_err()
            .to_string();
        assert!(error.contains("more than the limit"), "{error}");
        assert!(error.contains(part), "{error}");
        assert_eq!(watch.loaded.load(Ordering::Relaxed), 0);
    }
}

#[test]
fn samples_that_are_not_finite_are_dropped_counted_and_told() {
    let place = Place::new();
    // Nearer than a unit of length, what the light sends exceeds what a float holds.
    let bright = "type='point'><point name='position' value='0, 0, 1.2'/><rgb name='intensity' value='3e38'/></emitter";
    let scene = place.scene(&SCENE.replace("type='constant'/", bright));
    let rendered = render(&scene, &Options::default(), &Silent).unwrap();
    assert!(rendered.report.dropped_samples > 0);
    assert!(rendered.report.dropped_pixel.is_some());
    let said = rendered.warnings[0].to_string();
    assert!(said.contains("were not finite and were dropped"), "{said}");
    let weights = rendered.image.data().iter().filter(|v| v.is_nan());
    assert_eq!(weights.count(), 0);
}

#[test]
fn a_film_has_the_channels_of_its_format() {
    let place = Place::new();
    let image = |format: &str| {
        let film = format!("type='hdrfilm'><string name='pixel_format' value='{format}'/>");
        // An environment would be met wherever nothing else is.
        let text = SCENE.replace("type='constant'", "type='point'");
        let scene = place.scene(&text.replace("type='hdrfilm'>", &film));
        render(&scene, &Options::default(), &Silent).unwrap().image
    };
    let (rgb, rgba, grey) = (image("rgb"), image("rgba"), image("luminance"));
    assert_eq!(rgb.channels(), ["R", "G", "B"]);
    assert_eq!(rgba.channels(), ["R", "G", "B", "A"]);
    assert_eq!(grey.channels(), ["Y"]);
    let (mut covered, mut open) = (false, false);
    for (x, y) in (0..40).flat_map(|y| (0..70).map(move |x| (x, y))) {
        let color = [0, 1, 2].map(|c| rgb.get(x, y, c));
        assert_eq!(&rgba.pixel(x, y)[..3], color);
        assert_eq!(grey.get(x, y, 0), luminance(color));
        let alpha = rgba.get(x, y, 3);
        assert!((0.0..=1.000_001).contains(&alpha));
        covered |= alpha > 0.999;
        open |= alpha < 0.001;
    }
    assert!(covered && open);
}

#[test]
fn a_bare_mesh_is_in_the_middle_of_its_turntable() {
    let place = Place::new();
    let path = place.path("floor.ply");
    let options = description::Options::default();
    let bare = describe_mesh(&path, &Staging::default(), &options, &Budget::default()).unwrap();
    let bounds = Session::default()
        .bounds(&bare.description, &Options::default(), &Silent)
        .unwrap();
    let mesh = read(Path::new(&path), &Default::default(), &Budget::default())
        .unwrap()
        .mesh;
    let (low, high) = mesh.bounds().unwrap();
    let off = 0.5 * (bounds.min + bounds.max) - 0.5 * (low + high);
    assert!(off.x.abs() < 1e-3 && off.z.abs() < 1e-3, "{off}");
}

/// A red square that spans `first` and `second` from `corner`.
fn red_square(corner: Vec3, first: Vec3, second: Vec3) -> String {
    let head = FLOOR
        .replace("vertex 3", "vertex 4")
        .replace("face 1", "face 2");
    let head = head.replace(
        "float z\n",
        "float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n",
    );
    let (head, _) = head.split_once("-9").unwrap();
    let corners = [
        corner,
        corner + first,
        corner + first + second,
        corner + second,
    ];
    let corners = corners.map(|p| format!("{} {} {} 230 20 20\n", p.x, p.y, p.z));
    format!("{head}{}3 0 1 2\n3 0 2 3\n", corners.concat())
}

#[test]
fn a_flat_bare_mesh_is_seen_whichever_way_it_lies() {
    let place = Place::new();
    let path = place.path("flat.ply");
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    for (up, size, axis) in [
        (UpAxis::Y, 1.0, 0),
        (UpAxis::Y, 1.0, 1),
        (UpAxis::Y, 1e-3, 1),
        (UpAxis::Y, 1e5, 1),
        (UpAxis::Y, 1.0, 2),
        (UpAxis::Z, 1.0, 0),
        (UpAxis::Z, 1.0, 1),
        (UpAxis::Z, 1.0, 2),
    ] {
        let (first, second) = (size * axes[(axis + 1) % 3], size * axes[(axis + 2) % 3]);
        let near = size * Vec3::new(3.0, -40.0, 7.0);
        for (corner, first, second) in [(near, first, second), (Vec3::splat(9e5), second, first)] {
            if corner != near && size < 1.0 {
                continue; // the test's own numbers would not keep it
            }
            fs::write(&path, red_square(corner, first, second)).unwrap();
            let bare = describe_mesh(
                &path,
                &Staging {
                    up,
                    ..Staging::default()
                },
                &description::Options::default(),
                &Budget::default(),
            )
            .unwrap();
            let mut description = bare.description;
            let overrides = Overrides {
                size: Some((40, 30)),
                spp: Some(4),
                ..Overrides::default()
            };
            overrides.apply(&mut description);
            let image = render(&description, &Options::default(), &Silent)
                .unwrap()
                .image;
            let pixels = (0..30).flat_map(|y| (0..40).map(move |x| (x, y)));
            let is_red = |&(x, y): &(u32, u32)| image.get(x, y, 0) > 3.0 * image.get(x, y, 1);
            let red = pixels.filter(is_red).count();
            assert!(red > 30, "{red} pixels of {up:?} {size} {axis} at {corner}");
        }
    }
}

#[test]
fn a_bare_mesh_without_an_area_is_refused_in_words() {
    let place = Place::new();
    let path = place.path("line.ply");
    for second in [Vec3::ZERO, 2.0 * Vec3::X] {
        for first in [Vec3::ZERO, Vec3::X] {
            let second = if first == Vec3::ZERO { first } else { second };
            fs::write(&path, red_square(Vec3::ONE, first, second)).unwrap();
            let refused = describe_mesh(
                &path,
                &Staging::default(),
                &description::Options::default(),
                &Budget::default(),
            );
            let message = refused.unwrap_err().to_string();
            assert!(
                message.contains("none of the triangles has an area"),
                "{message}"
            );
        }
    }
}

#[test]
fn a_mesh_that_is_given_is_not_read_again() {
    let place = Place::new();
    let path = place.path("floor.ply");
    let bare = describe_mesh(
        &path,
        &Staging::default(),
        &description::Options::default(),
        &Budget::default(),
    )
    .unwrap();
    let BareMesh {
        description, mesh, ..
    } = bare;
    fs::write(&path, "nothing of use").unwrap();
    let mut session = Session::default();
    let mut bounds = |mesh: Option<_>| {
        mesh.into_iter().for_each(|mesh| session.give(mesh));
        session.bounds(&description, &Options::default(), &Silent)
    };
    bounds(None).unwrap_err();
    bounds(Some(mesh)).unwrap();
}

#[test]
fn an_adaptive_crop_has_the_pixels_of_the_whole_and_more_samples_where_it_is_noisy() {
    let place = Place::new();
    let options = Options {
        adaptive: Some(ADAPTIVE),
        ..Options::default()
    };
    for sampler in Sampler::NAMES {
        let rendered = |crop| {
            let mut scene = place.scene(SCENE);
            let overrides = Overrides {
                sampler: Some((*sampler).to_owned()),
                crop,
                ..Overrides::default()
            };
            overrides.apply(&mut scene);
            render(&scene, &options, &Silent)
        };
        if *sampler == "grid" {
            let error = rendered(None).unwrap_err().to_string();
            assert!(error.contains("the same in every set"), "{error}");
            continue;
        }
        let whole = rendered(None).unwrap();
        let report = whole.report.adaptive.clone().unwrap();
        let image = &whole.image;
        let [samples, error] = ["samples", "error"].map(|name| image.channel(name).unwrap());
        // The sky has no noise; the sphere's lower half has.
        let [sky, sphere] = [(4, 2), (35, 24)].map(|(x, y)| {
            assert!(image.get(x, y, error) < 0.1);
            image.get(x, y, samples) as u32
        });
        assert_eq!(sky, report.limits[0], "{sampler}");
        assert!(sphere > sky, "{sampler}: {sphere}");
        let mean = image.data().chunks_exact(image.channels().len());
        let mean: f64 = mean.map(|p| f64::from(p[samples])).sum::<f64>() / (70.0 * 40.0);
        assert!((mean - report.mean_spp).abs() < 1e-9, "{sampler}");
        let (x, y, width, height) = (29, 17, 11, 15);
        let crop = rendered(Some(Window {
            x,
            y,
            width,
            height,
        }))
        .unwrap();
        for (px, py) in (0..height).flat_map(|py| (0..width).map(move |px| (px, py))) {
            assert_eq!(
                crop.image.pixel(px, py),
                image.pixel(x + px, y + py),
                "{sampler}: {px}, {py}"
            );
        }
    }
}

/// A lamp so small that few paths in a thousand meet it: many pilots see nothing of it. Were the number of samples
/// decided by the samples themselves, bright ones would count for less: the mean would be lower by a fifteenth.
#[test]
fn adaptive_sampling_of_rare_light_does_not_bias_the_mean() {
    const SEEDS: u64 = 160;
    let scene = "<scene version='3.0.0'>
        <integrator type='direct'>
            <integer name='emitter_samples' value='0'/><integer name='bsdf_samples' value='1'/>
        </integrator>
        <sensor type='orthographic'>
            <transform name='to_world'><scale value='0.3'/><lookat origin='0, 0, 2' target='0, 0, 0' up='0, 1, 0'/></transform>
            <film type='hdrfilm'>
                <integer name='width' value='24'/><integer name='height' value='24'/><rfilter type='box'/>
            </film>
            <sampler type='independent'/>
        </sensor>
        <shape type='rectangle'/>
        <shape type='sphere'>
            <point name='center' x='0.8' y='0' z='0.9'/><float name='radius' value='0.1'/>
            <emitter type='area'><rgb name='radiance' value='100'/></emitter>
        </shape>
    </scene>";
    // Half of the lamp's radiance times (r/d)²·cos θ, over what the film shows.
    let at = |i: i32| 0.3 * (f64::from(i) + 0.5) / 24.0;
    let shown = (-24..24).flat_map(|y| (-24..24).map(move |x| (at(x), at(y))));
    let radiance = shown.map(|(x, y)| {
        let squared = (x - 0.8).powi(2) + y * y + 0.81;
        50.0 * 0.01 / squared * 0.9 / squared.sqrt()
    });
    let expected = radiance.sum::<f64>() / (48.0 * 48.0);

    let place = Place::new();
    let description = place.scene(scene);
    let mut session = Session::default();
    let means = (0..SEEDS).map(|seed| {
        let options = Options {
            seed,
            adaptive: Some(Adaptive {
                noise_threshold: 1.0,
                min_spp: 16,
                max_spp: 256,
            }),
            ..Options::default()
        };
        let image = session
            .render(&description, &options, &Silent)
            .unwrap()
            .image;
        let pixels = image.data().chunks_exact(image.channels().len());
        pixels.map(|p| f64::from(p[1])).sum::<f64>() / (24.0 * 24.0)
    });
    let means: Vec<f64> = means.collect();
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let error = (variance / n).sqrt();
    assert!(error < 0.011 * expected, "{mean} ± {error} is too noisy");
    assert!(
        (mean - expected).abs() < 3.5 * error,
        "{mean} ± {error} is not {expected}"
    );
}

/// So wide that pixels are finer than what the eye sees away from the gaze.
fn wide(place: &Place, film: &str, sampler: &str, spp: u32) -> Description {
    let text = SCENE
        .replacen("value='70'/>", &format!("value='248'/>{film}"), 1)
        .replacen("value='40'/></film>", "value='16'/></film>", 1);
    let mut scene = place.scene(&text);
    let overrides = Overrides {
        sampler: Some(sampler.to_owned()),
        spp: Some(spp),
        ..Overrides::default()
    };
    overrides.apply(&mut scene);
    scene
}

/// At the left edge.
fn gazing() -> Options {
    Options {
        gaze: Some([4.0, 8.0]),
        ..Options::default()
    }
}

#[test]
fn samples_fall_with_the_distance_from_a_gaze_where_they_are_those_of_a_render_without() {
    let place = Place::new();
    for sampler in Sampler::NAMES {
        let scene = wide(&place, "<rfilter type='box'/>", sampler, 32);
        let rendered = |options: &Options| render(&scene, options, &Silent).unwrap();
        let uniform = rendered(&Options::default()).image;
        let Rendered { image, report, .. } = rendered(&gazing());
        let foveated = report.foveated.unwrap();
        let samples = image.channel("samples").unwrap();
        let counts: Vec<f32> = (0..248).map(|x| image.get(x, 8, samples)).collect();
        assert!(counts.is_sorted_by(|a, b| a >= b), "{sampler}: {counts:?}");
        let [least, most] = foveated.limits.map(|n| n as f32);
        assert_eq!([counts[247], counts[0]], [least, most], "{sampler}");
        assert!(most >= 32.0 && 2.0 * least <= most, "{sampler}: {counts:?}");
        let mean = image.data().chunks_exact(4).map(|p| f64::from(p[3]));
        let mean = mean.sum::<f64>() / (248.0 * 16.0);
        assert!((mean - foveated.mean_spp).abs() < 1e-9, "{sampler}");
        for (x, y) in (0..16).flat_map(|y| (0..248).map(move |x| (x, y))) {
            if image.get(x, y, samples) == most {
                for channel in 0..3 {
                    let [a, b] = [&image, &uniform].map(|image| image.get(x, y, channel));
                    assert!((a - b).abs() <= 1e-6 * b, "{sampler}: {x}, {y}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn a_crop_around_a_gaze_has_the_pixels_of_the_whole_whatever_the_threads() {
    let place = Place::new();
    let mut scene = wide(&place, "", "stratified", 16);
    let whole = render(&scene, &gazing(), &Silent).unwrap().image;
    let (x, y, width, height) = (99, 3, 61, 11);
    let overrides = Overrides {
        crop: Some(Window {
            x,
            y,
            width,
            height,
        }),
        ..Overrides::default()
    };
    overrides.apply(&mut scene);
    for threads in 1..4 {
        let options = Options {
            threads: std::num::NonZeroUsize::new(threads),
            ..gazing()
        };
        let crop = render(&scene, &options, &Silent).unwrap().image;
        for (px, py) in (0..height).flat_map(|py| (0..width).map(move |px| (px, py))) {
            assert_eq!(crop.pixel(px, py), whole.pixel(x + px, y + py));
        }
    }
}

/// The mean of all pixels and of those that have the fewest samples, whose filter reaches over blocks of other counts.
#[test]
fn samples_by_a_gaze_do_not_bias_the_mean() {
    const SEEDS: u64 = 24;
    let place = Place::new();
    for sampler in ["independent", "stratified"] {
        let scene = wide(&place, "", sampler, 8);
        let mut session = Session::default();
        let mut means = |gaze, first_seed| {
            let means = (0..SEEDS).map(|seed| {
                let options = Options {
                    seed: first_seed + seed,
                    gaze,
                    ..Options::default()
                };
                let rendered = session.render(&scene, &options, &Silent).unwrap();
                let image = &rendered.image;
                let mean = |first: u32| {
                    let all = (0..16).flat_map(|y| (first..248).map(move |x| (x, y)));
                    let sum: f64 = all.map(|(x, y)| f64::from(image.get(x, y, 1))).sum();
                    sum / (16.0 * f64::from(248 - first))
                };
                [mean(0), mean(180)]
            });
            means.collect::<Vec<_>>()
        };
        let (foveated, uniform) = (means(gazing().gaze, 0), means(None, SEEDS));
        for part in 0..2 {
            let [(a, va), (b, vb)] = [&foveated, &uniform].map(|means| {
                let n = means.len() as f64;
                let mean = means.iter().map(|m| m[part]).sum::<f64>() / n;
                let squares = means.iter().map(|m| (m[part] - mean).powi(2));
                (mean, squares.sum::<f64>() / (n - 1.0) / n)
            });
            let error = (va + vb).sqrt();
            assert!(error < 2e-3 * b, "{sampler}: {b} ± {error} is too noisy");
            assert!((a - b).abs() < 3.5 * error, "{sampler}: {a} {b} ± {error}");
        }
    }
}

#[test]
fn the_heat_map_of_a_gaze_shows_the_work_of_all_samples_of_each_pixel() {
    let place = Place::new();
    let scene = wide(&place, "<rfilter type='box'/>", "independent", 16);
    let mut session = Session::default();
    let rendered = session.render(&scene, &gazing(), &Silent).unwrap();
    let heat = session.heat(&scene, &gazing(), &Silent).unwrap();
    assert!(heat.of_pixels);
    assert_eq!(heat.stats, rendered.report.stats);
    let sum: f64 = heat.node_steps.iter().map(|steps| f64::from(*steps)).sum();
    let counted = heat.stats.tracing.node_steps as f64;
    assert!((sum / counted - 1.0).abs() < 1e-5, "{sum} {counted}");
}

#[test]
fn a_gaze_must_be_on_the_film_and_the_only_one_that_says_where_samples_go() {
    let place = Place::new();
    let scene = place.scene(SCENE);
    let said = |options: Options| render(&scene, &options, &Silent).unwrap_err().to_string();
    for gaze in [[70.5, 2.0], [3.0, -1.0], [f64::NAN, 1.0]] {
        let said = said(Options {
            gaze: Some(gaze),
            ..Options::default()
        });
        assert!(
            said.contains("is not on the film, which is 70x40"),
            "{said}"
        );
    }
    let said = said(Options {
        adaptive: Some(ADAPTIVE),
        ..gazing()
    });
    assert!(said.contains("not both"), "{said}");
}

#[test]
fn the_pixels_of_a_heat_map_add_up_to_what_the_render_counts() {
    let place = Place::new();
    // Without a filter that reaches beyond the crop, whose samples the render would take as well.
    let film = "<rfilter type='box'/><integer name='crop_width' value='41'/>\
        <integer name='crop_offset_y' value='3'/><integer name='crop_height' value='30'/></film>";
    let scene =
        SCENE
            .replacen("</film>", film, 1)
            .replacen("'40'/></sampler>", "'7'/></sampler>", 1);
    let scene = place.scene(&scene);
    let mut session = Session::default();
    let options = Options::default();
    let rendered = session.render(&scene, &options, &Silent).unwrap();
    let heat = session.heat(&scene, &options, &Silent).unwrap();
    assert_eq!((heat.width, heat.node_steps.len()), (41, 41 * 30));
    assert_eq!((heat.samples, heat.stats), (7, rendered.report.stats));
    let sum: f64 = heat.node_steps.iter().map(|steps| f64::from(*steps)).sum();
    let counted = heat.stats.tracing.node_steps as f64;
    assert!((7.0 * sum / counted - 1.0).abs() < 1e-5, "{sum} {counted}");
}

#[test]
fn the_times_of_a_render_are_those_of_its_threads() {
    let place = Place::new();
    let options = Options {
        threads: std::num::NonZeroUsize::new(1),
        pinned: true,
        ..Options::default()
    };
    let seconds = render(&place.scene(SCENE), &options, &Silent)
        .unwrap()
        .report
        .seconds;
    let parts = [
        seconds.closest,
        seconds.occluded,
        seconds.shade,
        seconds.film,
    ];
    assert!(parts.iter().all(|part| *part > 0.0), "{parts:?}");
    assert!(parts.iter().sum::<f64>() <= seconds.render);
}

/// A square facing +z that shines, a camera at z = 3 that looks at `target`, and what `more` adds.
fn warnings(target: &str, lamp: &str, integrator: &str) -> Vec<String> {
    let text = format!(
        "<scene version='3.0.0'><integrator type='{integrator}'/><sensor type='perspective'>
            <transform name='to_world'><lookat origin='0, 0, 3' target='{target}' up='0, 1, 0'/></transform>
            <film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='8'/></film>
        </sensor><shape type='rectangle'>{lamp}</shape></scene>"
    );
    let scene =
        Description::parse(&text, Path::new("a.xml"), &description::Options::default()).unwrap();
    let rendered = render(&scene, &Options::default(), &Silent).unwrap();
    let said = |problems: &[Problem]| -> Vec<String> {
        problems.iter().map(|p| p.message.clone()).collect()
    };
    // What is known before rendering is what a check says.
    let checked = Session::default().check(&scene, &Options::default(), &Silent);
    let (checked, rendered) = (said(&checked.unwrap()), said(&rendered.warnings));
    assert!(rendered.starts_with(&checked), "{checked:?} {rendered:?}");
    rendered
}

const LAMP: &str = "<emitter type='area'/>";
const TURNED: &str = "<emitter type='area'/><boolean name='flip_normals' value='true'/>";

#[test]
fn a_black_image_says_why() {
    assert_eq!(warnings("0, 0, 0", LAMP, "path"), [""; 0]);
    for (target, lamp, cause) in [
        ("0, 0, 0", "", "no light"),
        ("0, 0, 0", TURNED, "no light comes from them"),
        ("0, 0, 9", LAMP, "sees nothing"),
    ] {
        let told = warnings(target, lamp, "path");
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].contains(cause), "{told:?}");
    }
    assert_eq!(warnings("0, 0, 0", "", "depth"), [""; 0]);
}
