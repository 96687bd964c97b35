//! One seed gives one image: with any number of threads, in any crop, with the tree and with brute force.
//! And every colour model renders the same grey scene.

use std::num::NonZeroUsize;

use etendue::accel::Method;
use etendue::image::Image;
use etendue::render::{Colors, Options, Overrides};
use etendue::sensor::Window;

use super::support::{Mean, at, film, rendered, scene};

/// The Cornell box, small, with a gaussian filter.
fn cornell(overrides: Overrides, options: Options) -> Image {
    let text = std::fs::read_to_string(at("scenes/cornell-box.xml")).expect("the scene is there");
    let small = Overrides {
        spp: Some(4),
        size: Some((70, 50)),
        ..overrides
    };
    rendered(&text, &small, &options).image
}

fn bits(image: &Image) -> Vec<u32> {
    image.data().iter().map(|v| v.to_bits()).collect()
}

fn default_bits() -> Vec<u32> {
    bits(&cornell(Overrides::default(), Options::default()))
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let expected = default_bits();
    for threads in [1, 2, 5] {
        let options = Options {
            threads: NonZeroUsize::new(threads),
            ..Options::default()
        };
        let found = bits(&cornell(Overrides::default(), options));
        assert!(found == expected, "{threads} threads");
    }
}

#[test]
fn brute_force_finds_what_the_tree_finds() {
    let options = Options {
        method: Method::Brute,
        ..Options::default()
    };
    assert!(bits(&cornell(Overrides::default(), options)) == default_bits());
}

#[test]
fn two_seeds_give_two_images() {
    let seeded = |seed| {
        let options = Options {
            seed,
            ..Options::default()
        };
        cornell(Overrides::default(), options)
    };
    let (a, b) = (seeded(1), seeded(2));
    let lit = a.data().iter().zip(b.data()).filter(|(a, _)| **a > 0.0);
    let (equal, all) = (lit.clone().filter(|(a, b)| a == b).count(), lit.count());
    // The lamp, seen directly, is the same whatever the seed.
    assert!(equal < all / 10, "{equal} of {all} values are equal");
}

#[test]
fn a_crop_equals_the_same_pixels_of_the_full_image() {
    let full = cornell(Overrides::default(), Options::default());
    for crop in [
        Window {
            x: 0,
            y: 0,
            width: 70,
            height: 50,
        },
        Window {
            x: 13,
            y: 7,
            width: 31,
            height: 29,
        },
        Window {
            x: 69,
            y: 49,
            width: 1,
            height: 1,
        },
    ] {
        let overrides = Overrides {
            crop: Some(crop),
            ..Overrides::default()
        };
        let part = cornell(overrides, Options::default());
        assert_eq!((part.width(), part.height()), (crop.width, crop.height));
        for y in 0..crop.height {
            for x in 0..crop.width {
                let whole = full.pixel(crop.x + x, crop.y + y);
                assert_eq!(part.pixel(x, y), whole, "{crop:?} at ({x}, {y})");
            }
        }
    }
}

#[test]
fn every_number_of_bands_renders_the_box_finite_and_named() {
    for (count, last) in [
        (1, "S0.595,000000nm"),
        (8, "S0.800,625000nm"),
        (11, "S0.808,636364nm"),
        (16, "S0.815,312500nm"),
        (32, "S0.822,656250nm"),
        (64, "S0.826,328125nm"),
    ] {
        let options = Options {
            colors: Colors::bands(count),
            ..Options::default()
        };
        let image = cornell(Overrides::default(), options);
        assert_eq!(image.channels().len(), 3 + count);
        assert_eq!(image.channels()[2 + count], last);
        assert!(image.data().iter().all(|v| v.is_finite()), "{count} bands");
    }
}

/// Grey shapes in white light.
fn grey() -> String {
    scene(&format!(
        r#"<integrator type="path"><integer name="max_depth" value="4"/></integrator>
        <sensor type="perspective">
            <float name="fov" value="45"/>
            <transform name="to_world">
                <lookat origin="3, -4, 4" target="0, 0, 0.5" up="0, 0, 1"/>
            </transform>
            {}
        </sensor>
        <emitter type="constant"><float name="radiance" value="0.5"/></emitter>
        <shape type="sphere">
            <point name="center" value="1, 1, 2"/><float name="radius" value="0.4"/>
            <emitter type="area"><float name="radiance" value="4"/></emitter>
        </shape>
        <shape type="cube">
            <transform name="to_world"><scale value="0.5"/><translate z="0.5"/></transform>
            <bsdf type="diffuse"><float name="reflectance" value="0.8"/></bsdf>
        </shape>
        <shape type="rectangle">
            <transform name="to_world"><scale value="5"/></transform>
            <bsdf type="diffuse"><float name="reflectance" value="0.4"/></bsdf>
        </shape>"#,
        film(32, 32, 64)
    ))
}

#[test]
fn bands_agree_with_rgb_on_grey_scenes() {
    let means = |colors: Colors, seeds: std::ops::Range<u64>| {
        let images: Vec<Image> = seeds
            .map(|seed| {
                let options = Options {
                    colors,
                    seed,
                    ..Options::default()
                };
                rendered(&grey(), &Overrides::default(), &options).image
            })
            .collect();
        [0, 1, 2].map(|c| Mean::of(images.iter().map(|i| Mean::of_channel(i, c).value)))
    };
    // What D65 of a float comes to through the observer's curves, as Mitsuba's spectral mode has it.
    const WHITE: [f64; 3] = [0.999_989, 0.999_697, 1.003_183];
    let rgb = means(Colors::Rgb, 0..6);
    for count in [8, 11, 16, 32] {
        let bands = means(Colors::bands(count), 6..12);
        for c in 0..3 {
            let what = format!("{count} bands, channel {c}");
            let expected = Mean {
                value: rgb[c].value * WHITE[c],
                ..rgb[c]
            };
            // Eight bands integrate the observer's curves to a few parts in a thousand.
            let slack = Mean {
                value: bands[c].value,
                error: bands[c].error.max(1e-3 * expected.value),
            };
            slack.assert_equals(&expected, 0.005, &what);
        }
    }
}
