//! A profile so small that it takes no time, by its counts; and what is made of profiles.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::budget::Budget;
use crate::description;
use crate::render::{Overrides, UpAxis};

struct Patient;

impl Watch for Patient {
    fn at(&self, _: &str, part: f64) {
        assert!((0.0..1.0).contains(&part));
    }
}

/// Stops when it has been asked so often.
struct Impatient(AtomicUsize);

impl Watch for Impatient {
    fn at(&self, _: &str, _: f64) {}
    fn stop(&self) -> bool {
        self.0.fetch_sub(1, Ordering::Relaxed) == 0
    }
}

fn settings(axes: &[Axis]) -> Settings {
    Settings {
        subject: Subject::Terrain,
        axes: axes.to_vec(),
        effort: Effort::Tiny,
        threads: NonZeroUsize::new(2).unwrap(),
        rounds: Some(2),
        overrides: Overrides::default(),
        sensor: None,
        budget: Budget::default(),
    }
}

fn profile(settings: &Settings) -> Profile {
    run(settings, &Patient).unwrap().unwrap()
}

/// Of one axis or another; noise is what a calm machine has, for times are not this test's.
fn calm(axes: &[Axis]) -> Profile {
    let mut profile = profile(&settings(axes));
    (profile.noise.spread, profile.noise.waiting) = (0.0, Some(0.0));
    profile
}

#[test]
fn brute_force_costs_what_the_textbook_says_to_the_last_test() {
    let profile = profile(&settings(&[Axis::Pixels, Axis::Objects, Axis::Lights]));
    let mut seen = 0;
    for series in profile.series.iter().filter(|s| s.way == Way::Brute) {
        for point in &series.points {
            let (stats, o, l) = (&point.stats, point.primitives, point.lights as u64);
            let first = stats.tracing.primitive_tests - stats.shadow_tracing.primitive_tests;
            assert_eq!(stats.camera_rays, point.pixels);
            assert_eq!(first, point.pixels * o, "P·O");
            assert!(stats.shaded > 0 && stats.shaded < point.pixels);
            assert_eq!(
                stats.shadow_tracing.primitive_tests,
                stats.shaded * l * o,
                "hits·L·O"
            );
            assert_eq!(stats.tracing.node_steps, 0);
            seen += 1;
        }
        for growth in series.fits.iter().filter(|g| g.quantity.is_count()) {
            assert!((growth.fit.b - 1.0).abs() < 0.05, "{growth:?}");
        }
    }
    assert!(seen > 10);
    let counted = profile
        .verdicts
        .iter()
        .filter(|v| v.subject.contains("counted"));
    for (verdict, what) in counted.zip(["primary tests = P·O", "shadow tests = hits·L·O"]) {
        let found = (verdict.outcome, &*verdict.predicted);
        assert_eq!(found, (Outcome::Confirmed, what));
    }
}

#[test]
fn all_lights_are_linear_and_one_light_is_flat() {
    let profile = profile(&settings(&[Axis::Lights]));
    let exponent = |way| {
        let series = profile.series(Axis::Lights, way).unwrap();
        series
            .growth(Quantity::ShadowRays, Model::Power)
            .unwrap()
            .fit
            .b
    };
    assert!((exponent(Way::Tree) - 1.0).abs() < 1e-9);
    assert!(exponent(Way::One).abs() < 0.02);
}

#[test]
fn samples_multiply_rays_threads_add_none_and_walls_make_depth_a_line() {
    let profile = profile(&settings(&[Axis::Samples, Axis::Depth, Axis::Threads]));
    let stats = |axis| {
        let series = profile.series(axis, Way::Tree).unwrap();
        let points = series.points.iter();
        points
            .map(|p| (p.x, p.stats.rays() as f64))
            .collect::<Vec<_>>()
    };
    let threads = stats(Axis::Threads);
    assert!(threads.len() > 1);
    assert!(
        threads.iter().all(|(_, rays)| *rays == threads[0].1),
        "{threads:?}"
    );
    let samples = stats(Axis::Samples);
    assert!(
        samples
            .iter()
            .all(|(x, rays)| (rays / x / samples[0].1 - 1.0).abs() < 0.1)
    );
    let depth = stats(Axis::Depth);
    // A camera ray, and for each edge more a bounce and a shadow ray, but for what misses the lights.
    let camera = profile.series(Axis::Depth, Way::Tree).unwrap().points[0]
        .stats
        .camera_rays as f64;
    for (x, rays) in depth {
        let most = camera * (1.0 + 2.0 * (x - 1.0));
        assert!(rays <= most && rays > 0.7 * most, "{x}: {rays} of {most}");
    }
}

#[test]
fn the_trees_steps_are_judged_by_the_largest_size() {
    let profile = profile(&settings(&[Axis::Objects]));
    let tree = profile.series(Axis::Objects, Way::Tree).unwrap();
    for model in [Model::Logarithm, Model::Power] {
        assert!(tree.growth(Quantity::StepsPerRay, model).unwrap().fit.b > 0.0);
    }
    assert!(
        profile
            .verdicts
            .iter()
            .any(|v| v.subject == "object loop, tree")
    );
    assert!(
        profile
            .bytes_per_triangle
            .unwrap()
            .iter()
            .all(|bytes| *bytes > 10.0)
    );
    assert!(profile.crossover.is_some());
}

#[test]
fn a_mesh_and_a_scene_are_profiled_as_well() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a & b.ply");
    let mut text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
        .to_owned();
    text += "0 0 0\n1 0 0\n0 1 0\n1 1 0.5\n3 0 1 2\n3 1 3 2\n";
    std::fs::write(&path, text).unwrap();
    let of = |path, axes: &[Axis]| {
        let options = description::Options::default();
        let subject = Subject::of(Some(path), UpAxis::Z, options);
        profile(&Settings {
            subject,
            ..settings(axes)
        })
    };
    let mesh = of(path, &[Axis::Objects]);
    let tree = mesh.series(Axis::Objects, Way::Tree).unwrap();
    let counted = mesh
        .verdicts
        .iter()
        .filter(|v| v.subject.contains("counted"));
    let outcomes: Vec<_> = counted.map(|v| v.outcome).collect();
    assert_eq!(outcomes, [Outcome::Confirmed; 2]);
    // Two triangles, cut in four again and again.
    assert!(tree.points.iter().any(|p| p.primitives == 2 << 10));
    assert!(tree.points.iter().all(|p| p.stats.shaded > 0));
    assert!(mesh.notes.is_empty());
    let path = folder.path().join("animated.gltf");
    let text = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "animations": [{"channels": [], "samplers": []}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri":
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    std::fs::write(&path, text).unwrap();
    let animated = of(path, &[Axis::Pixels]);
    assert!(
        (animated.notes.iter()).any(|note| note.contains("animations are left out")),
        "{:?}",
        animated.notes
    );
    let path = folder.path().join("scene.xml");
    std::fs::write(
        &path,
        r#"<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
        <shape type="sphere"><point name="center" value="0, 0, 5"/></shape></scene>"#
            .replace(
                "\"perspective\"/>",
                "\"perspective\"><sampler type=\"independent\"/></sensor>",
            ),
    )
    .unwrap();
    // The bands are for `tests/it`.
    let axes = Axis::ALL.into_iter().filter(|axis| *axis != Axis::Bands);
    let scene = of(path, &axes.collect::<Vec<_>>());
    assert!(scene.series(Axis::Objects, Way::Tree).is_none());
    assert!(
        scene
            .notes
            .iter()
            .any(|note| note.starts_with("O is left out"))
    );
    let lights = scene.series(Axis::Lights, Way::Tree).unwrap();
    // The scene's own, and those that were added.
    assert_eq!(lights.points[0].x, 2.0);
    assert!(lights.points.iter().all(|p| p.x == p.lights as f64));
}

#[test]
fn a_profile_is_read_as_it_was_written_and_equals_itself() {
    let now = calm(&[Axis::Lights, Axis::Threads]);
    let then = Profile::from_json(&now.to_json()).unwrap();
    assert_eq!(then, now);
    let same = now.since(&then);
    assert!(same.common > 10 && same.changes.is_empty());
}

#[test]
fn a_comparison_tells_of_counts_that_changed_and_of_times_that_are_apart() {
    let then = calm(&[Axis::Lights]);
    let mut now = then.clone();
    now.series[0].points[1].stats.shadow_tracing.primitive_tests += 1;
    // One time that is longer is chance, all of a series are not.
    for seconds in &mut now.series[2].points[0].seconds {
        seconds.shade *= 1000.0;
    }
    let points = now.series[1].points.iter_mut();
    for seconds in points.flat_map(|p| &mut p.seconds) {
        seconds.render *= 1.1;
    }
    let changes = now.since(&then).changes;
    let found: Vec<_> = changes.iter().map(|c| (c.way, c.quantity)).collect();
    assert!(
        found.contains(&(Way::Brute, Quantity::ShadowTests)),
        "{found:?}"
    );
    assert!(found.contains(&(Way::Tree, Quantity::Render)), "{found:?}");
    // A machine that is slower in all is no change.
    let mut slower = then.clone();
    slower.noise.seconds *= 2.0;
    let points = slower.series.iter_mut().flat_map(|s| &mut s.points);
    for seconds in points.flat_map(|p| &mut p.seconds) {
        *seconds = seconds.divided(0.5);
    }
    assert!(slower.since(&then).changes.is_empty());
}

#[test]
fn what_is_no_profile_is_refused() {
    for (text, message) in [
        ("", "no profile"),
        ("{}", "no profile"),
        ("[1, 2]", "no profile"),
        (r#"{"format": 99}"#, "format 99"),
    ] {
        let error = Profile::from_json(text).unwrap_err().to_string();
        assert!(error.contains(message), "{text}: {error}");
    }
}

#[test]
fn tables_have_a_row_a_render_and_pages_ask_nobody_for_anything() {
    let mut profile = calm(&[Axis::Lights, Axis::Objects]);
    profile.subject = "<b>&".to_owned();
    let csv = profile.to_csv();
    let width = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().all(|line| line.split(',').count() == width));
    let renders: usize = profile.series.iter().map(|s| s.points.len()).sum();
    assert_eq!(csv.lines().count(), 1 + renders);
    let page = profile.to_html(Some(&profile.since(&profile.clone())));
    assert!(page.contains("&lt;b&gt;&amp;") && !page.contains("<b>"));
    for outside in ["src=", "href=\"http", "@import", "url(http", "<script"] {
        assert!(!page.contains(outside), "{outside}");
    }
    for plot in profile.plots() {
        roxmltree::Document::parse(&plot.svg).unwrap();
        assert!(page.contains(&format!("inside-{}", plot.name)));
    }
}

#[test]
fn times_are_not_judged_on_a_busy_machine_and_counts_are() {
    let profile = calm(&[Axis::Lights]);
    let busy = Noise {
        waiting: Some(0.3),
        ..profile.noise.clone()
    };
    let verdicts = verdict::all(&profile.series, &busy);
    let (times, counts): (Vec<_>, Vec<_>) = verdicts
        .iter()
        .partition(|v| v.predicted.starts_with("time"));
    assert!(times.len() >= 3 && times.iter().all(|v| v.outcome == Outcome::TooNoisy));
    assert!(
        counts.iter().all(|v| v.outcome == Outcome::Confirmed),
        "{counts:?}"
    );
}

#[test]
fn who_stops_early_gets_the_complete_rounds_or_nothing() {
    let settings = settings(&[Axis::Samples]);
    let stopped = |after| run(&settings, &Impatient(AtomicUsize::new(after))).unwrap();
    assert_eq!(stopped(2), None);
    let one = stopped(7).unwrap();
    assert_eq!(one.rounds, 1);
    assert!(one.series[0].points.iter().all(|p| p.seconds.len() == 1));
}
