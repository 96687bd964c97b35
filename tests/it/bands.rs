//! Is light right that is rendered in bands: films of responses, ranges, boundaries that part wavelengths, and paints that
//! are the same in one light?

use std::num::NonZeroUsize;

use etendue::budget::Budget;
use etendue::color::{Comb, VISIBLE};
use etendue::description::{Description, Options as ReadOptions};
use etendue::image::Image;
use etendue::profile::{self, Axis, Effort, Settings, Subject, Way};
use etendue::render::{Colors, Options, Overrides, Silent, render};

use super::support::{Mean, at, describe, film, path, rendered, scene};

fn in_bands(text: &str, count: usize, range: Option<[f32; 2]>, seed: u64) -> Image {
    let options = Options {
        colors: Colors::Bands { count, range },
        seed,
        ..Options::default()
    };
    rendered(text, &Overrides::default(), &options).image
}

/// The means of all channels but R, G and B, with their names.
fn means(image: &Image) -> Vec<(String, Mean)> {
    let others = image.channels().iter().enumerate().skip(3);
    others
        .map(|(c, name)| (name.clone(), Mean::of_channel(image, c)))
        .collect()
}

/// A camera before nothing but an even sky.
fn sky(film: &str) -> String {
    scene(&format!(
        r#"{}<sensor type="perspective">{film}</sensor>
        <emitter type="constant"><spectrum name="radiance" value="2"/></emitter>"#,
        path(2)
    ))
}

#[test]
fn a_film_of_responses_integrates_them_and_is_rendered_in_bands_unasked() {
    let film = r#"<film type="specfilm">
            <integer name="width" value="40"/><integer name="height" value="40"/><rfilter type="box"/>
            <spectrum name="triangle" value="500:0, 550:1, 600:0"/>
            <spectrum name="box" type="regular"><float name="wavelength_min" value="410"/>
                <float name="wavelength_max" value="440"/><string name="values" value="1, 1"/></spectrum>
            <spectrum name="uv" value="300:1, 400:1"/>
            <spectrum type="irregular" id="red"><string name="wavelengths" value="700, 710, 900"/>
                <string name="values" value="0, 1, 0.2"/></spectrum>
        </film><sampler type="stratified"><integer name="sample_count" value="64"/></sampler>"#;
    // Twice the integrals of the responses.
    let expected = [
        ("triangle", 100.0),
        ("box", 60.0),
        ("uv", 200.0),
        ("red", 238.0),
    ];
    for (colors, seed) in [
        (Colors::Rgb, 0),
        (Colors::bands(5), 1),
        (Colors::bands(64), 2),
    ] {
        let options = Options {
            colors,
            seed,
            ..Options::default()
        };
        let image = rendered(&sky(film), &Overrides::default(), &options).image;
        let found = means(&image);
        assert_eq!(found.len(), expected.len());
        for ((name, mean), (called, value)) in found.iter().zip(expected) {
            assert_eq!(name, called);
            mean.assert_is(value, 0.02, &format!("{name} {colors:?}"));
        }
    }
}

#[test]
fn a_response_that_is_called_like_red_has_no_red_beside_it() {
    let film = r#"<film type="specfilm"><integer name="width" value="2"/><integer name="height" value="2"/>
        <spectrum name="R" value="600:1, 700:1"/><spectrum name="B" value="400:1, 500:1"/></film>"#;
    let image = in_bands(&sky(film), 4, None, 0);
    assert_eq!(image.channels(), ["R", "B"]);
}

#[test]
fn the_parts_of_a_range_add_up_to_its_colour() {
    let text = sky(&film(16, 16, 16));
    let [first, last] = VISIBLE;
    let whole = in_bands(&text, 16, None, 1);
    let parts = [[first, 550.0], [550.0, last]].map(|range| in_bands(&text, 9, Some(range), 1));
    for c in 0..3 {
        let mean = |image: &Image| Mean::of_channel(image, c).value;
        let sum = mean(&parts[0]) + mean(&parts[1]);
        assert!((sum / mean(&whole) - 1.0).abs() < 2e-3, "{c}: {sum}");
    }
    let names = parts[0].channels();
    assert_eq!(names[3], "S0.370,555556nm");
}

/// More bands than a path carries: light adds up, and what is no light does not.
#[test]
fn several_passes_come_to_what_one_comes_to() {
    let aov = r#"<integrator type="aov"><string name="aovs" value="albedo:albedo,d:depth"/>
        <integer name="max_depth" value="3"/><integrator type="path" name="nested"/></integrator>"#;
    let text = scene(&format!(
        r#"{aov}<sensor type="perspective"><float name="fov" value="40"/>
            <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>{}</sensor>
        <emitter type="point"><point name="position" value="3, 2, 4"/>
            <rgb name="intensity" value="100"/></emitter>
        <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.4, 0.2"/></bsdf></shape>"#,
        film(16, 16, 64)
    ));
    let [one, several] = [16, 65].map(|count| in_bands(&text, count, None, 5));
    let mean = |image: &Image, name: &str| {
        let channel = image.channels().iter().position(|other| other == name);
        Mean::of_channel(image, channel.expect(name)).value
    };
    for name in [
        "R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "d.T", "nested.R", "nested.A",
    ] {
        let (expected, found) = (mean(&one, name), mean(&several, name));
        assert!(
            expected > 0.01 && (found / expected - 1.0).abs() < 0.02,
            "{name}: {found} {expected}"
        );
    }
}

/// A ball of a substance before an even sky, which it lets through whole.
fn ball(bsdf: &str, spp: u32) -> String {
    scene(&format!(
        r#"{}<sensor type="perspective"><float name="fov" value="30"/>
            <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>{}</sensor>
        <emitter type="constant"><spectrum name="radiance" value="1"/></emitter>
        <shape type="sphere">{bsdf}</shape>"#,
        path(-1),
        film(24, 24, spp)
    ))
}

#[test]
fn what_parts_wavelengths_loses_none() {
    let flint =
        r#"<spectrum name="int_ior" type="glass"><string name="name" value="SF10"/></spectrum>"#;
    for bsdf in [
        format!(r#"<bsdf type="dielectric">{flint}</bsdf>"#),
        format!(r#"<bsdf type="thindielectric">{flint}</bsdf>"#),
    ] {
        for (count, spp) in [(3, 256), (16, 256), (65, 1536)] {
            for (name, mean) in means(&in_bands(&ball(&bsdf, spp), count, None, 3)) {
                mean.assert_is(1.0, 0.02, &format!("{bsdf} {name} of {count}"));
            }
        }
    }
}

/// In a single narrow band glass is as it is with that one index, polished or rough.
#[test]
fn a_narrow_band_refracts_by_its_own_index() {
    let sellmeier = |nm: f64| {
        let square = (nm * 1e-3).powi(2);
        let terms = [
            (1.62153902, 0.0122241457),
            (0.256287842, 0.0595736775),
            (1.64447552, 147.468793),
        ];
        (1.0 + terms
            .map(|(b, c)| b * square / (square - c))
            .iter()
            .sum::<f64>())
        .sqrt()
    };
    let lit = |bsdf: &str| {
        ball(bsdf, 256).replace(
            r#"<emitter type="constant">"#,
            r#"<emitter type="point"><point name="position" value="1, 2, 3"/></emitter><emitter type="constant">"#,
        )
    };
    for (plugin, nm) in [
        ("dielectric", 420.0),
        ("thindielectric", 650.0),
        ("roughdielectric", 500.0),
    ] {
        let flint = r#"<spectrum name="int_ior" type="sellmeier">
            <string name="b" value="1.62153902, 0.256287842, 1.64447552"/>
            <string name="c" value="0.0122241457, 0.0595736775, 147.468793"/></spectrum>"#;
        let same = format!(r#"<float name="int_ior" value="{}"/>"#, sellmeier(nm));
        let range = Some([nm as f32 - 0.01, nm as f32 + 0.01]);
        let [dispersed, plain] = [flint, &same].map(|inside| {
            let bsdf = format!(r#"<bsdf type="{plugin}">{inside}</bsdf>"#);
            in_bands(&lit(&bsdf), 1, range, 5)
        });
        let stride = plain.channels().len();
        let band = |image: &Image| {
            image
                .data()
                .iter()
                .skip(3)
                .step_by(stride)
                .copied()
                .collect()
        };
        let (dispersed, plain): (Vec<f32>, Vec<f32>) = (band(&dispersed), band(&plain));
        let total = |values: &[f32]| values.iter().map(|v| f64::from(*v)).sum::<f64>();
        let ratio = total(&dispersed) / total(&plain);
        assert!((ratio - 1.0).abs() < 2e-3, "{plugin} at {nm} nm: {ratio}");
        let far = dispersed.iter().zip(&plain);
        let far = far
            .filter(|(a, b)| (*a - *b).abs() > 0.02 * b.abs())
            .count();
        assert!(far <= plain.len() / 50, "{plugin}: {far} pixels differ");
    }
}

/// Rough glass that parts wavelengths agrees, band by band, with rough glass of each band's index.
#[test]
fn rough_glass_in_bands_is_each_band_s_own() {
    let bsdf = |inside: &str| {
        ball(&format!(
            r#"<bsdf type="roughdielectric"><float name="alpha" value="0.3"/>{inside}</bsdf>"#
        ), 256)
        .replace(r#"value="1"/>"#, r#"value="0.2"/>"#)
        .replace(
            "</scene>",
            r#"<shape type="sphere"><point name="center" value="4, 1, -3"/><float name="radius" value="2.5"/>
            <emitter type="area"><spectrum name="radiance" value="2"/></emitter></shape></scene>"#,
        )
    };
    let steep = r#"<spectrum name="int_ior" type="cauchy"><float name="a" value="1.3"/><float name="b" value="0.08"/></spectrum>"#;
    let bands = in_bands(&bsdf(steep), 4, Some([400.0, 800.0]), 7);
    let comb = Comb::new(4, [400.0, 800.0]).unwrap();
    let stride = bands.channels().len();
    for i in 0..4 {
        // Over a band the index is nearly even in wavelength, and two points stand for it (Gauss).
        let parts = [-1.0, 1.0].map(|side: f64| {
            let nm = comb.centre(i) + side * 50.0 / f64::sqrt(3.0);
            let index = 1.3 + 0.08 / (nm * 1e-3).powi(2);
            let same = format!(r#"<float name="int_ior" value="{index}"/>"#);
            let range = Some([nm as f32 - 1.0, nm as f32 + 1.0]);
            in_bands(&bsdf(&same), 1, range, 8)
        });
        let single = parts[0].channels().len();
        let value = |image: &Image, pixel: usize| f64::from(image.data()[pixel * single + 3]);
        let pixels = bands.data().chunks(stride).enumerate();
        let pairs = pixels.map(|(pixel, of_bands)| {
            let expected = 0.5 * (value(&parts[0], pixel) + value(&parts[1], pixel));
            (f64::from(of_bands[3 + i]), expected)
        });
        let level = Mean::of(pairs.clone().map(|pair| pair.1)).value;
        let apart = Mean::of(pairs.map(|(found, expected)| found / level - expected / level));
        assert!(apart.error < 1e-2, "band {i} is too noisy: {apart:?}");
        assert!(
            apart.value.abs() < 4.5 * apart.error + 2e-3,
            "band {i}: {apart:?}"
        );
    }
}

#[test]
fn indices_that_cannot_be_are_refused() {
    for (inside, words) in [
        (
            r#"<spectrum name="int_ior" value="400:1.5, 500:1.4"/>"#,
            "above 0 at all wavelengths",
        ),
        (
            r#"<spectrum name="int_ior" type="glass"><string name="name" value="BK8"/></spectrum>"#,
            "BK7",
        ),
        (
            r#"<spectrum name="int_ior" type="sellmeier"><string name="b" value="1, 1"/><string name="c" value="0.01, 0.25"/></spectrum>"#,
            "resonance",
        ),
        (
            r#"<texture name="int_ior" type="checkerboard"/>"#,
            "the same everywhere",
        ),
    ] {
        let bsdf = format!(r#"<bsdf type="dielectric">{inside}</bsdf>"#);
        let description = describe(&ball(&bsdf, 256));
        let options = Options {
            colors: Colors::bands(8),
            ..Options::default()
        };
        let error = render(&description, &options, &Silent)
            .unwrap_err()
            .to_string();
        assert!(error.contains(words), "{inside}: {error}");
    }
}

#[test]
fn a_metameric_pair_is_one_paint_in_daylight_and_two_under_lines() {
    let file = at("scenes/metamers.xml");
    let mut description = Description::read(&file, &ReadOptions::default(), &Default::default())
        .unwrap_or_else(|e| panic!("{e}"));
    let overrides = Overrides {
        size: Some((40, 40)),
        spp: Some(256),
        ..Overrides::default()
    };
    overrides.apply(&mut description);
    let image = render(&description, &Options::default(), &Silent)
        .unwrap()
        .image;
    let patch = |x: u32, y: u32| {
        let pixels = (y..y + 12).flat_map(|y| (x..x + 12).map(move |x| (x, y)));
        [0, 1, 2].map(|c| Mean::of(pixels.clone().map(|(x, y)| image.get(x, y, c).into())).value)
    };
    let (one, other) = (patch(5, 5), patch(23, 5));
    for c in 0..3 {
        assert!(
            (one[c] / other[c] - 1.0).abs() < 0.02,
            "daylight: {one:?} {other:?}"
        );
    }
    let (one, other) = (patch(5, 23), patch(23, 23));
    assert!(one[2] > 2.0 * other[2], "lines: {one:?} {other:?}");
}

#[test]
fn bands_add_no_rays_to_a_profile() {
    struct Patient;
    impl profile::Watch for Patient {
        fn at(&self, _: &str, _: f64) {}
    }
    let settings = Settings {
        subject: Subject::Terrain,
        axes: vec![Axis::Bands],
        effort: Effort::Tiny,
        threads: NonZeroUsize::new(2).unwrap(),
        rounds: Some(1),
        overrides: Overrides::default(),
        sensor: None,
        budget: Budget::default(),
    };
    let profile = profile::run(&settings, &Patient).unwrap().unwrap();
    let points = &profile.series(Axis::Bands, Way::Tree).unwrap().points;
    let rays: Vec<f64> = points.iter().map(|p| p.stats.rays() as f64).collect();
    assert!(rays.len() > 1);
    // Spectral paths draw other numbers.
    assert!(
        rays.iter().all(|r| (r / rays[0] - 1.0).abs() < 0.1),
        "{rays:?}"
    );
}
