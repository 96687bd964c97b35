//! Does `compare` measure what others measure, does it tell noise from error, and does the command say so?
//! `tests/golden/compare/metrics.json` holds the figures of NumPy, scikit-image, flip-evaluator 1.7 and
//! Mitsuba's z-test for ten pairs; `tools/metrics.py` writes it from images that are made here alike.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use etendue::compare::metric::Metric;
use etendue::compare::seeds::{self, Side, Verdict};
use etendue::compare::ztest::{self, Reference};
use etendue::compare::{Layer, pair};
use etendue::display;
use etendue::image::{self, Encoding, Image, Metadata};
use etendue::math::random::mix;
use serde_json::Value;

use super::support::at;

const TINT: [f64; 3] = [1.0, 0.7, 0.4];

fn rgb() -> Vec<String> {
    ["R", "G", "B"].map(String::from).to_vec()
}

/// A number in [0, 1) that depends on nothing but these.
fn noise(seed: u64, index: usize) -> f64 {
    (mix((seed << 40) + index as u64) >> 40) as f64 / f64::from(1 << 24)
}

/// The patterns and changes of `tools/metrics.py`, by the same arithmetic.
struct Pattern<'a> {
    name: &'a str,
    width: usize,
    height: usize,
}

impl Pattern<'_> {
    fn value(&self, x: usize, y: usize, c: usize) -> f64 {
        let u = (x as f64 + 0.5) / self.width as f64;
        let v = (y as f64 + 0.5) / self.height as f64;
        match self.name {
            "gradient" => 2.0 * u * TINT[c],
            "checker" => ((x / 8 + y / 8) % 2) as f64 * (0.8 * TINT[c]) + 0.1,
            "noise" => noise(1, (y * self.width + x) * 3 + c),
            "light" if (u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5) < 0.04 => 30.0 * TINT[c],
            "light" => (0.05 + 0.3 * v) * TINT[c],
            "hill" => 16.0 * u * (1.0 - u) * v * (1.0 - v) * TINT[c],
            other => panic!("no pattern {other}"),
        }
    }

    fn changed(&self, change: &str, x: usize, y: usize, c: usize) -> f64 {
        let value = self.value(x, y, c);
        match change {
            "none" => value,
            "brighter" => value * 1.1,
            "offset" => value + 0.02,
            "noisy" => value * (0.5 + noise(2, (y * self.width + x) * 3 + c)),
            "shifted" => self.value((x + 1).min(self.width - 1), y, c),
            "firefly" if (x, y) == (self.width / 2, self.height / 2) => 100.0,
            "firefly" => value,
            other => panic!("no change {other}"),
        }
    }

    fn layer(&self, change: &str) -> Layer {
        let places = (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y)));
        let pixel = |(x, y)| [0, 1, 2].map(|c| self.changed(change, x, y, c) as f32);
        layer(self.width, self.height, places.flat_map(pixel).collect())
    }
}

fn layer(width: usize, height: usize, data: Vec<f32>) -> Layer {
    Layer {
        image: Image::from_data(width as u32, height as u32, rgb(), data).unwrap(),
        encoding: Encoding::Linear,
        rgb: Some([0, 1, 2]),
        others: Vec::new(),
    }
}

/// The golden pairs with their figures.
fn pairs() -> Vec<(String, Layer, Layer, Value)> {
    let text = fs::read_to_string(at("tests/golden/compare/metrics.json")).unwrap();
    let table: Vec<Value> = serde_json::from_str(&text).unwrap();
    assert_eq!(table.len(), 10);
    let pair = |entry: Value| {
        let title = entry["name"].as_str().unwrap().to_owned();
        let words: Vec<&str> = title.split(' ').collect();
        let pattern = Pattern {
            name: words[0],
            width: words[2].parse().unwrap(),
            height: words[3].parse().unwrap(),
        };
        let (a, b) = (pattern.layer("none"), pattern.layer(words[1]));
        (title, a, b, entry)
    };
    table.into_iter().map(pair).collect()
}

#[test]
fn every_metric_has_the_value_that_its_authors_code_gives() {
    for (title, a, b, expected) in pairs() {
        let report = pair::measure(&a, &b, &pair::Options::default()).unwrap();
        for &metric in Metric::ALL {
            let value = report.value(metric).unwrap();
            let expected = expected["metrics"][metric.name()].as_f64().unwrap();
            let tolerance = match metric {
                Metric::FlipLdr | Metric::FlipHdr => 1e-4,
                Metric::Ssim => 1e-6,
                _ => 1e-10 * expected.abs(),
            };
            let error = (value - expected).abs();
            let name = metric.name();
            assert!(
                error <= tolerance,
                "{title}: {name} {value}, not {expected}"
            );
        }
    }
}

#[test]
fn the_z_test_has_the_figures_of_ztest_py() {
    for (title, a, b, expected) in pairs() {
        let reference = Reference {
            mean: &a,
            variance: &a,
            spp: 4000,
        };
        let outcome = ztest::ztest(&b, 64, &reference).unwrap();
        let expected = &expected["ztest"];
        assert_eq!(outcome.passed, expected["passed"], "{title}");
        assert_eq!(outcome.not_finite, expected["not_finite"], "{title}");
        for (value, name) in [
            (outcome.accepted, "accepted"),
            (outcome.gain, "gain"),
            (outcome.gain_error, "gain_se"),
            (outcome.z_rms, "z_rms"),
            (outcome.z_max, "z_max"),
            (outcome.z_bound, "z_threshold"),
        ] {
            let expected = expected[name].as_f64().unwrap();
            let error = (value - expected).abs();
            assert!(
                error <= 1e-9 * expected.abs().max(1e-3),
                "{title}: {name} {value}, not {expected}"
            );
        }
    }
}

#[test]
fn the_z_test_counts_what_is_not_finite_and_fails() {
    let pattern = Pattern {
        name: "hill",
        width: 16,
        height: 16,
    };
    let (mean, mut image) = (pattern.layer("none"), pattern.layer("none"));
    let reference = Reference {
        mean: &mean,
        variance: &mean,
        spp: 100,
    };
    assert!(ztest::ztest(&image, 4, &reference).unwrap().passed);
    image.image.set(3, 4, 1, f32::NAN);
    let outcome = ztest::ztest(&image, 4, &reference).unwrap();
    assert!(!outcome.passed && outcome.not_finite == 1 && outcome.z_max == 0.0);
}

/// A render of a flat grey: cells of half a pixel hold exponential noise around it, splatted by a tent, so
/// that neighbours vary together.
fn render(seed: u64, size: usize, brightness: f64) -> Image {
    let cells = 2 * size + 1;
    let sample = |x: usize, y: usize, c: usize| -(1.0 - noise(seed, (y * cells + x) * 3 + c)).ln();
    let mut data = Vec::new();
    for (y, x) in (0..size).flat_map(|y| (0..size).map(move |x| (y, x))) {
        for (c, tint) in TINT.iter().enumerate() {
            let mut sum = 0.0;
            for (dy, wy) in [0.25, 0.5, 0.25].into_iter().enumerate() {
                for (dx, wx) in [0.25, 0.5, 0.25].into_iter().enumerate() {
                    sum += wy * wx * sample(2 * x + dx, 2 * y + dy, c);
                }
            }
            data.push((sum * brightness * tint) as f32);
        }
    }
    Image::from_data(size as u32, size as u32, rgb(), data).unwrap()
}

fn side(seeds: std::ops::Range<u64>, brightness: f64) -> Side {
    let size = 24;
    let mut side = Side::new(&Image::new(size, size, rgb()), Some([0, 1, 2])).unwrap();
    for seed in seeds {
        side.push(&render(seed, size as usize, brightness)).unwrap();
    }
    side
}

fn judge(a: &Side, b: &Side) -> Verdict {
    seeds::judge(a, b, 0.99).unwrap()
}

#[test]
fn of_two_hundred_pairs_of_equal_sides_two_percent_at_most_are_found_to_differ() {
    let sides = |first: u64| {
        (
            side(first..first + 6, 1.0),
            side(first + 6..first + 12, 1.0),
        )
    };
    let differ = |pair: u64| {
        let (a, b) = sides(1 + 12 * pair);
        !judge(&a, &b).agrees
    };
    let flagged = (0..200).filter(|pair| differ(*pair)).count();
    assert!(flagged <= 4, "{flagged} of 200");
}

#[test]
fn an_error_above_the_half_width_is_found_and_said() {
    let (a, b) = (side(1..9, 1.0), side(9..17, 1.1));
    let verdict = judge(&a, &b);
    assert!(!verdict.agrees, "{verdict:?}");
    assert!(verdict.means[0].channel == "luminance" && !verdict.means[0].agrees);
    assert!((verdict.means[0].difference - 0.1).abs() < verdict.means[0].half_width);
    assert!(
        verdict
            .sentence
            .starts_with("A and B differ at 99 % confidence"),
        "{}",
        verdict.sentence
    );
    assert!(verdict.noise.ratio > 1.1, "{:?}", verdict.noise);
    let same = judge(&a, &side(9..17, 1.0));
    assert!((same.noise.ratio - 1.0).abs() < 0.1, "{:?}", same.noise);
}

#[test]
fn a_single_wrong_pixel_and_a_wrong_tile_are_found_where_they_are() {
    let a = side(1..9, 1.0);
    let mut pixel = Side::new(&Image::new(24, 24, rgb()), Some([0, 1, 2])).unwrap();
    let mut tile = pixel.clone();
    for seed in 9..17 {
        let mut image = render(seed, 24, 1.0);
        image.set(5, 7, 1, image.get(5, 7, 1) + 4.0);
        pixel.push(&image).unwrap();
        let mut image = render(seed, 24, 1.0);
        for (y, x) in (16..24).flat_map(|y| (16..24).map(move |x| (y, x))) {
            image.set(x, y, 2, image.get(x, y, 2) * 1.4);
        }
        tile.push(&image).unwrap();
    }
    let (pixels, tiles) = (judge(&a, &pixel).pixels, judge(&a, &tile).tiles);
    assert!(!pixels.agrees && !tiles.agrees);
    let place = |w: &seeds::WorstPlace| (w.x, w.y, w.channel.clone());
    assert_eq!(place(&pixels.worst), (5, 7, "G".to_owned()));
    assert_eq!(place(&tiles.worst), (16, 16, "B".to_owned()));
    let map = seeds::map(&a, &pixel).unwrap();
    let greatest = map.iter().copied().fold(0.0, f32::max);
    assert_eq!(map[7 * 24 + 5], greatest);
}

#[test]
fn rounding_alone_is_no_difference() {
    let constant = |value: f32| {
        let mut side = Side::new(&Image::new(24, 24, rgb()), Some([0, 1, 2])).unwrap();
        for _ in 0..4 {
            let data = vec![value; 24 * 24 * 3];
            side.push(&Image::from_data(24, 24, rgb(), data).unwrap())
                .unwrap();
        }
        side
    };
    assert!(judge(&constant(0.5), &constant(0.5 + 2e-6)).agrees);
    assert!(!judge(&constant(0.5), &constant(0.5005)).agrees);
}

// ---- the command

/// A folder with images in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        let pattern = Pattern {
            name: "hill",
            width: 24,
            height: 24,
        };
        let (a, b) = (pattern.layer("none").image, pattern.layer("brighter").image);
        place.save("a.exr", &a);
        place.save("a.png", &a);
        place.save("a.hdr", &a);
        place.save("b.exr", &b);
        let mut nan = b.clone();
        nan.set(2, 1, 1, f32::NAN);
        place.save("nan.exr", &nan);
        place.save("wide.exr", &Image::new(25, 24, rgb()));
        let names = ["R", "G", "B", "A", "n.X", "n.Y"]
            .map(String::from)
            .to_vec();
        let mut layers = Image::new(24, 24, names);
        layers.set(0, 0, 4, 1.0);
        place.save("layers.exr", &layers);
        layers.set(23, 23, 4, 0.5);
        place.save("layers2.exr", &layers);
        for seed in 1..=8 {
            place.save(&format!("s{seed}.exr"), &render(seed, 24, 1.0));
            place.save(&format!("t{seed}.exr"), &render(100 + seed, 24, 1.2));
        }
        fs::write(place.path("empty.exr"), "").unwrap();
        fs::write(
            place.path("cut.exr"),
            &fs::read(place.path("a.exr")).unwrap()[..500],
        )
        .unwrap();
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn save(&self, name: &str, image: &Image) {
        display::save(
            &self.path(name),
            image,
            &Metadata::default(),
            &Default::default(),
        )
        .unwrap();
    }

    fn run(&self, arguments: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_etendue"))
            .current_dir(self.0.path())
            .arg("compare")
            .args(arguments.split(' '))
            .output()
            .unwrap()
    }

    /// Runs the command, which must end with this status and say this.
    #[track_caller]
    fn says(&self, arguments: &str, status: i32, words: &str) -> String {
        let output = self.run(arguments);
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert_eq!(output.status.code(), Some(status), "{arguments}: {text}");
        assert!(text.contains(words), "{arguments}: {text}");
        text
    }

    #[track_caller]
    fn json(&self, arguments: &str) -> Value {
        let output = self.run(arguments);
        serde_json::from_slice(&output.stdout).unwrap()
    }
}

#[test]
fn two_images_agree_if_they_are_equal_or_within_the_limits() {
    let place = Place::new();
    for (arguments, status, words) in [
        ("a.exr a.exr", 0, "A and B are equal"),
        (
            "a.exr b.exr",
            1,
            "A and B differ in 576 of 576 pixels, most at",
        ),
        (
            "a.exr b.exr --fail-above mape=0.12",
            0,
            "A and B agree: mape",
        ),
        (
            "a.exr b.exr --fail-above mape=0.05 --fail-above max=1",
            1,
            "A and B differ: mape",
        ),
        (
            "a.exr b.exr --fail-below ssim=0.9",
            0,
            "A and B agree: ssim",
        ),
        (
            "a.exr b.exr --fail-above flip-hdr=0.0001",
            1,
            "above 0.0001",
        ),
        ("a.exr a.png --fail-above max=0.00197", 0, "sRGB codes"),
        ("a.exr a.hdr --fail-above max=0.01", 0, "linear"),
        ("a.png a.png", 0, "are equal"),
        ("layers.exr layers2.exr", 0, "not compared: A, n.X, n.Y"),
        (
            "layers.exr layers2.exr --layer n",
            1,
            "1 of 576 pixels, most at 23, 23 in X",
        ),
        (
            "layers.exr layers2.exr --layer n --crop 0,0,23,24",
            0,
            "are equal",
        ),
        ("layers.exr layers2.exr --layer A", 0, "are equal"),
    ] {
        place.says(arguments, status, words);
    }
}

#[test]
fn what_cannot_be_compared_is_said_with_status_2() {
    let place = Place::new();
    for (arguments, words) in [
        (
            "a.exr wide.exr",
            "the sizes differ: 24 × 24 and 25 × 24 pixels",
        ),
        (
            "a.exr layers.exr --layer n",
            "a.exr: there is no layer \"n\"",
        ),
        (
            "layers.exr layers2.exr --layer m",
            "there are R, G, B, A, n",
        ),
        (
            "a.exr nan.exr",
            "nan.exr: it has 1 NaN and 0 infinite values, the first at pixel 2, 1 in G",
        ),
        ("a.exr empty.exr", "the file is empty"),
        ("cut.exr a.exr", "cut.exr"),
        ("a.exr none.exr", "none.exr"),
        ("a.exr b.exr --crop 20,0,5,5", "reaches beyond 24 × 24"),
        (
            "a.exr b.exr --fail-above ssim=0.9",
            "use --fail-below ssim=0.9",
        ),
        ("a.exr b.exr --fail-above mes=1", "there are bias, max"),
        (
            "a.png a.png --fail-above flip_hdr=1",
            "no flip_hdr: it needs linear values",
        ),
        (
            "layers.exr layers2.exr --layer n --fail-above flip_ldr=1",
            "it needs a colour",
        ),
        (
            "--a s1.exr --b s2.exr s3.exr",
            "A has fewer than two images",
        ),
        (
            "--a s1.exr s2.exr --b s3.exr wide.exr",
            "25 × 24 pixels, where the others have 24 × 24",
        ),
        ("--a s1.exr s2.exr --b s3.exr nan.exr", "1 NaN"),
        (
            "--a s1.exr s2.exr --b s3.exr s4.exr --precision 0.0001",
            "could hide in the noise",
        ),
        ("a.exr", "nothing to hold it against"),
        ("a.exr --reference a.exr", "--variance"),
        (
            "a.exr --reference wide.exr --variance a.exr --spp 4",
            "the sizes differ",
        ),
        ("a.exr b.exr --map map.exr", "map.exr"),
    ] {
        place.says(arguments, 2, words);
    }
    let object = place.json("a.exr nan.exr --json");
    assert_eq!(object["verdict"], "cannot compare");
    assert!(
        object["problems"][0]["message"]
            .as_str()
            .unwrap()
            .contains("1 NaN")
    );
}

#[test]
fn seeds_and_a_known_variance_have_their_verdicts() {
    let place = Place::new();
    let s = "--a s1.exr s2.exr s3.exr s4.exr --b";
    place.says(
        &format!("{s} s5.exr s6.exr s7.exr s8.exr"),
        0,
        "A and B agree: 4 and 4 seeds",
    );
    let different = format!("{s} t5.exr t6.exr t7.exr t8.exr");
    place.says(&different, 1, "A and B differ at 99 % confidence");
    let object = place.json(&format!("{different} --json --map seeds.png"));
    assert_eq!(object["verdict"], "differ");
    assert_eq!(object["means"][0]["channel"], "luminance");
    assert_eq!(object["tiles"]["tests"], 12);
    assert_eq!(object["a"].as_array().unwrap().len(), 4);
    assert!(place.path("seeds.png").exists());
    let reference = "--reference a.exr --variance a.exr --spp 64";
    place.says(
        &format!("a.exr {reference}"),
        0,
        "agrees with the reference: 100.000 %",
    );
    place.says(
        &format!("b.exr {reference} --map z.png"),
        1,
        "differs from the reference",
    );
    place.says(&format!("nan.exr {reference}"), 1, "1 pixels not finite");
}

#[test]
fn json_holds_every_metric_and_maps_have_their_legend() {
    let place = Place::new();
    let object = place.json("a.exr b.exr --json");
    for metric in Metric::ALL {
        assert!(
            object["metrics"][metric.name()].is_f64(),
            "{metric:?}: {object}"
        );
    }
    assert_eq!(object["channels"][2]["channel"], "B");
    let same = place.json("a.png a.png --json");
    assert_eq!(same["verdict"], "agree");
    assert!(same["metrics"]["psnr"].is_null() && same["metrics"]["flip_hdr"].is_null());
    for of in ["flip", "difference", "relative"] {
        place.says(
            &format!("a.exr b.exr --map {of}.png --map-of {of} -q"),
            1,
            "",
        );
        let map = image::read(
            &place.path(&format!("{of}.png")),
            &etendue::budget::Budget::default().open(),
        );
        let map = map.unwrap().image;
        assert_eq!((map.width(), map.height()), (432, 472), "{of}");
    }
}

#[test]
fn a_signed_map_is_red_where_the_second_is_brighter_and_blue_where_it_is_darker() {
    let place = Place::new();
    // The hill's top, in the picture enlarged by 18, beside no difference at all.
    let top = |arguments: &str, status: i32| {
        place.says(&format!("{arguments} --signed-map map.png -q"), status, "");
        let account = etendue::budget::Budget::default().open();
        let map = image::read(&place.path("map.png"), &account).unwrap().image;
        assert_eq!((map.width(), map.height()), (432, 472), "{arguments}");
        [0, 1, 2].map(|c| map.get(12 * 18, 12 * 18, c))
    };
    for (arguments, redder) in [
        ("a.exr b.exr", true),
        ("b.exr a.exr", false),
        ("--a s1.exr s2.exr --b t3.exr t4.exr --confidence 0.5", true),
        ("b.exr --reference a.exr --variance a.exr --spp 64", true),
        ("a.exr --reference b.exr --variance a.exr --spp 64", false),
    ] {
        let [r, _, b] = top(arguments, 1);
        assert_eq!(r > b + 0.1, redder, "{arguments}: {r} {b}");
        assert_eq!(b > r + 0.1, !redder, "{arguments}: {r} {b}");
    }
    let same = top("a.exr a.exr", 0);
    assert!(same.iter().all(|v| *v > 0.9), "{same:?}");
}

#[test]
fn a_page_shows_every_kind_of_comparison() {
    let place = Place::new();
    let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
    for (name, scale) in [("n1", 1.0), ("n2", 1.1)] {
        let data = (0..40 * 20 * 5)
            .map(|i| scale * (i % 7) as f32 - 2.0)
            .collect();
        let channels = names(&["Y", "n.X", "n.Y", "n.Z", "d"]);
        let image = Image::from_data(40, 20, channels, data).unwrap();
        image::write(
            &place.path(&format!("{name}.exr")),
            &image,
            &Metadata::default(),
        )
        .unwrap();
    }
    for (arguments, status, sides, label, says) in [
        (
            "a.exr b.exr",
            1,
            ["A", "B"],
            "HDR-FLIP",
            "B is 10.0 % brighter",
        ),
        (
            "a.exr a.exr",
            0,
            ["A", "B"],
            "HDR-FLIP",
            "A and B are equal",
        ),
        ("a.png b.exr", 1, ["A", "B"], "FLIP", "A and B differ"),
        (
            "a.exr b.exr --map-of relative",
            1,
            ["A", "B"],
            "relative |b - a|",
            "differ",
        ),
        (
            "n1.exr n2.exr --layer n",
            1,
            ["A", "B"],
            "|b - a|",
            "differ",
        ),
        (
            "n1.exr n2.exr --layer d",
            1,
            ["A", "B"],
            "|b - a|",
            "differ",
        ),
        ("n1.exr n2.exr", 1, ["A", "B"], "HDR-FLIP", "differ"),
        (
            "--a s1.exr s2.exr --b t3.exr t4.exr --confidence 0.5",
            1,
            ["A", "B"],
            "|t| between seeds",
            "A and B differ",
        ),
        (
            "b.exr --reference a.exr --variance a.exr --spp 64",
            1,
            ["reference", "image"],
            "|z|",
            "",
        ),
    ] {
        place.says(&format!("{arguments} --report new/page -q"), status, "");
        let page = fs::read_to_string(place.path("new/page/index.html")).unwrap();
        let (_, data) = page.split_once("id=\"data\">").unwrap();
        let (data, _) = data.split_once("</script>").unwrap();
        let data: Value = serde_json::from_str(data).unwrap();
        let scene = &data["scenes"][0];
        assert_eq!(data["sides"], serde_json::json!(sides), "{arguments}");
        assert_eq!(scene["status"], ["agree", "differ"][status as usize]);
        assert_eq!(scene["pictures"]["error_label"], label, "{arguments}");
        let lines: Vec<[String; 2]> = serde_json::from_value(scene["lines"].clone()).unwrap();
        assert_eq!(lines[0][0], "verdict");
        assert!(lines[0][1].contains(says), "{arguments}: {lines:?}");
        assert!(lines.len() > 3, "{arguments}: {lines:?}");
        // Nothing took any time, and nothing says so.
        assert!(!lines.iter().any(|[label, _]| label == "time"), "{lines:?}");
        let shown = scene["pictures"]["shown"].as_str().unwrap();
        let false_colour = arguments.contains("--layer");
        assert_eq!(shown.is_empty(), !false_colour, "{arguments}: {shown}");
        fs::remove_dir_all(place.path("new")).unwrap();
    }
    // What cannot be compared makes no page, and what cannot be written is told before images are read.
    place.says("a.exr n1.exr --report new/page", 2, "the sizes differ");
    assert!(!place.path("new").exists());
    place.says("a.exr b.exr --report a.exr", 2, "is not a folder");
    place.says(
        "a.exr b.exr --map-of flip",
        2,
        "--map-of says what a map shows",
    );
}
