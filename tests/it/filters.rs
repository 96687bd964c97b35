//! What filters make of textures that are smaller than a pixel: a floor of squares as far as can be seen.

use std::num::NonZeroUsize;

use etendue::image::Image;
use etendue::render::{Options, Overrides};
use etendue::sensor::Window;

use super::support::{at, rendered};

/// `scenes/checker-floor.xml` with a filter, by an integrator.
fn floor(integrator: &str, filter: &str, overrides: Overrides, threads: usize) -> Image {
    let text = std::fs::read_to_string(at("scenes/checker-floor.xml")).expect("it is there");
    let text = (text.replace("squares.png", "scenes/squares.png"))
        .replace(r#"type="path""#, &format!(r#"type="{integrator}""#))
        .replace("$filter", filter);
    // Others than paths have no depth, and the textbook no π.
    let depth = r#"<integer name="max_depth" value="$max_depth"/>"#;
    let text = match integrator {
        "direct" => text.replace(depth, ""),
        "raster" => (text.replace("3.14159265", "1"))
            .replace(depth, r#"<boolean name="shadows" value="false"/>"#),
        _ => text,
    };
    let overrides = Overrides {
        size: Some((96, 54)),
        ..overrides
    };
    let options = Options {
        threads: NonZeroUsize::new(threads),
        ..Options::default()
    };
    rendered(&text, &overrides, &options).image
}

fn with_samples(spp: u32) -> Overrides {
    Overrides {
        spp: Some(spp),
        ..Overrides::default()
    }
}

/// The mean square of differences, below the horizon.
fn error(image: &Image, truth: &Image) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for y in 13..truth.height() {
        for x in 0..truth.width() {
            let difference = f64::from(image.get(x, y, 1) - truth.get(x, y, 1));
            sum += difference * difference;
            count += 1;
        }
    }
    sum / f64::from(count)
}

#[test]
fn a_floor_of_squares_has_a_tenth_of_the_error_of_nearest() {
    let truth = floor("path", "nearest", with_samples(400), 0);
    for (integrator, spp) in [("path", 1), ("path", 4), ("raster", 1)] {
        let of = |filter| error(&floor(integrator, filter, with_samples(spp), 0), &truth);
        let [nearest, bilinear, trilinear, anisotropic] =
            ["nearest", "bilinear", "trilinear", "anisotropic"].map(of);
        let all = format!(
            "{integrator}, {spp}: {nearest:.5} {bilinear:.5} {trilinear:.5} {anisotropic:.5}"
        );
        assert!(bilinear > 0.5 * nearest, "{all}");
        assert!(trilinear < 0.3 * nearest, "{all}");
        assert!(anisotropic < 0.03 * nearest, "{all}");
    }
}

#[test]
fn footprints_are_the_same_with_any_threads_and_in_any_crop() {
    for integrator in ["path", "direct", "volpath", "raster"] {
        let whole = floor(integrator, "anisotropic", with_samples(4), 1);
        let again = floor(integrator, "anisotropic", with_samples(4), 3);
        assert!(whole.data() == again.data(), "{integrator}");
        let crop = Window {
            x: 13,
            y: 7,
            width: 31,
            height: 29,
        };
        let overrides = Overrides {
            crop: Some(crop),
            ..with_samples(4)
        };
        let part = floor(integrator, "anisotropic", overrides, 2);
        for y in 0..crop.height {
            for x in 0..crop.width {
                let expected = whole.pixel(crop.x + x, crop.y + y);
                assert_eq!(part.pixel(x, y), expected, "{integrator} at {x}, {y}");
            }
        }
    }
}
