use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::*;
use crate::color::{Bands, Comb, Rgb, Role, Spectral as _};
use crate::description::{Description, Options, Value};
use crate::image::vol::{Grid, encode};
use crate::math::{Bounds, Frame};
use crate::texture::Texture;

/// A grid with these values, x fastest.
fn write(folder: &Path, size: [u32; 3], channels: u32, values: &[f32]) {
    let grid = Grid {
        size,
        channels,
        bbox: [Vec3::ZERO, Vec3::new(2.0, 4.0, 8.0)],
        values: values.to_vec(),
    };
    std::fs::write(folder.join("g.vol"), encode(&grid)).unwrap();
}

fn volume(folder: &Path, inside: &str) -> Volume<Rgb> {
    let text = format!(
        "<scene version='3.0.0'><volume type='gridvolume'>
        <string name='filename' value='g.vol'/>{inside}</volume></scene>"
    );
    let scene = Description::parse(&text, &folder.join("test.xml"), &Options::default()).unwrap();
    let Value::Object(node) = scene.root().all()[0].value else {
        panic!("the scene holds a volume");
    };
    Volume::build(
        &scene.node(node),
        &Palette::new(Rgb).with_role(Role::Quantity),
    )
    .unwrap_or_else(|e| panic!("{e}"))
}

fn at(volume: &Volume<Rgb>, place: Vec3) -> f32 {
    let value: crate::color::Samples<3> = volume.eval_lanes::<f32>(place.into(), &[()]).sample(0);
    value[0]
}

#[test]
fn values_between_cells_are_linear_and_beyond_them_as_the_wrap_mode_says() {
    let folder = tempfile::tempdir().unwrap();
    // x + 10·y + 100·z at the cells' centres.
    let values: Vec<f32> = (0..2 * 3 * 4)
        .map(|i| (i % 2 + 10 * (i / 2 % 3) + 100 * (i / 6)) as f32)
        .collect();
    write(folder.path(), [2, 3, 4], 1, &values);
    let place =
        |x: f32, y: f32, z: f32| Vec3::new((x + 0.5) / 2.0, (y + 0.5) / 3.0, (z + 0.5) / 4.0);
    let clamped = volume(folder.path(), "");
    let near =
        |found: f32, expected: f32| assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    near(at(&clamped, place(0.25, 1.5, 2.75)), 0.25 + 15.0 + 275.0);
    near(at(&clamped, place(-3.0, 1.0, 1.0)), 110.0);
    near(at(&clamped, place(0.0, 9.0, 9.0)), 320.0);
    let repeated = volume(folder.path(), "<string name='wrap_mode' value='repeat'/>");
    near(at(&repeated, place(0.0, 3.0, 1.0)), 100.0);
    near(at(&repeated, place(0.0, 2.5, 1.0)), 110.0);
    let mirrored = volume(folder.path(), "<string name='wrap_mode' value='mirror'/>");
    near(at(&mirrored, place(0.0, 3.0, 1.0)), 120.0);
    let nearest = volume(
        folder.path(),
        "<string name='filter_type' value='nearest'/>",
    );
    near(at(&nearest, place(0.4, 1.4, 2.6)), 310.0);
    let box_of_file = volume(
        folder.path(),
        "<boolean name='use_grid_bbox' value='true'/>",
    );
    near(
        at(
            &box_of_file,
            place(0.25, 1.5, 2.75) * Vec3::new(2.0, 4.0, 8.0),
        ),
        290.25,
    );
    assert!(
        box_of_file
            .bounds()
            .max
            .abs_diff_eq(Vec3::new(2.0, 4.0, 8.0), 1e-3)
    );
}

#[test]
fn no_value_within_a_box_is_above_its_bound() {
    let folder = tempfile::tempdir().unwrap();
    let number = |i: u64| crate::math::random::unit(crate::math::random::mix(i));
    let values: Vec<f32> = (0..5 * 4 * 6 * 3).map(|i| number(i).powi(4)).collect();
    write(folder.path(), [5, 4, 6], 3, &values);
    let turned = "<transform name='to_world'><rotate x='1' y='2' z='0.5' angle='40'/><scale value='3'/></transform>";
    for inside in [
        turned.to_owned(),
        format!("{turned}<string name='wrap_mode' value='mirror'/>"),
        format!("{turned}<string name='filter_type' value='nearest'/>"),
    ] {
        let volume = volume(folder.path(), &inside);
        let bounds = volume.bounds();
        let side = (bounds.max - bounds.min) / 4.0;
        for i in 0..64_u64 {
            let corner = Vec3::new((i % 4) as f32, (i / 4 % 4) as f32, (i / 16) as f32);
            let min = bounds.min + side * corner;
            let most = volume.most_within(&Bounds {
                min,
                max: min + side,
            });
            for j in 0..200 {
                let part = [0, 1, 2].map(|axis| number(1000 + (i * 200 + j) * 3 + axis));
                let place = min + side * Vec3::from(part);
                let value: crate::color::Samples<3> =
                    volume.eval_lanes::<f32>(place.into(), &[()]).sample(0);
                assert!(
                    value.max_value() <= most * (1.0 + 1e-6),
                    "{inside} {value:?} {most}"
                );
            }
        }
    }
}

/// The texture that shows a grid, as a reflectance.
fn texture<C: ColorModel>(folder: &Path, color: C) -> Result<Texture<C>> {
    let text =
        "<scene version='3.0.0'><texture type='volume'><volume name='volume' type='gridvolume'>
        <string name='filename' value='g.vol'/></volume></texture></scene>";
    let scene = Description::parse(text, &folder.join("test.xml"), &Options::default()).unwrap();
    let Value::Object(node) = scene.root().all()[0].value else {
        panic!("the scene holds a texture");
    };
    Texture::build(&scene.node(node), &Palette::new(color))
}

#[test]
fn a_surface_shows_the_volume_at_its_place_in_the_world_whatever_its_texture_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let values: Vec<f32> = (0..8).map(|i| 0.1 * (i + 1) as f32).collect();
    write(folder.path(), [2; 3], 1, &values);
    let shown = texture(folder.path(), Rgb).unwrap();
    for (place, expected) in [
        (Vec3::splat(0.25), 0.1),
        (Vec3::new(0.75, 0.25, 0.25), 0.2),
        (Vec3::new(0.25, 0.75, 0.25), 0.3),
        (Vec3::new(0.25, 0.25, 0.75), 0.5),
        (Vec3::splat(0.5), 0.45),
        (Vec3::splat(9.0), 0.8),
    ] {
        let at = Interaction {
            position: place,
            frame: Frame::around(Vec3::Z),
            ..Interaction::at_uv(glam::Vec2::new(0.9, 0.1))
        };
        let lanes: crate::color::Samples<3> = shown.eval_lanes(&Points::one(&at), &[()]).sample(0);
        for value in [shown.eval(&at, &())[0], lanes[0]] {
            assert!(
                (value - expected).abs() < 1e-6,
                "{place}: {value} {expected}"
            );
        }
    }
}

#[test]
fn matrices_are_numbers_by_their_mean_and_no_colours() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), [1; 3], 6, &[1.0, 2.0, 3.0, 0.0, 0.5, 1.0]);
    let number = texture(folder.path(), Mono).unwrap();
    let at = Interaction::at_uv(glam::Vec2::ZERO);
    assert_eq!(number.eval(&at, &())[0], 1.25);
    let error = texture(folder.path(), Rgb).unwrap_err().to_string();
    assert!(error.contains("1 or 3 channels"), "{error}");
}

/// Mitsuba 3.9.1 `scalar_spectral`: the albedo of a medium, and its extinction.
#[test]
fn a_triple_becomes_the_spectrum_of_a_reflectance() {
    // From 450 nm in steps of 50.
    let comb = Comb::new(8, [450.0, 850.0]).unwrap();
    let bands = Bands::<8>::new(comb, Arc::default());
    let wavelengths = bands.wavelengths(|| 0.0);
    for (rgb, expected) in [
        ("0.99, 0.5, 0.5", [0.50765, 0.5376, 0.80966, 0.94528]),
        ("1, 0.2, 1", [0.97784, 0.1697, 0.828, 0.99087]),
    ] {
        for inside in [
            format!("<rgb name='albedo' value='{rgb}'/>"),
            format!(
                "<volume name='albedo' type='constvolume'><rgb name='value' value='{rgb}'/></volume>"
            ),
        ] {
            let text = format!(
                "<scene version='3.0.0'><medium type='homogeneous'>{inside}</medium></scene>"
            );
            let scene =
                Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
            let Value::Object(node) = scene.root().all()[0].value else {
                panic!("the scene holds a medium");
            };
            let palette = Palette::new(bands.clone());
            let volume = Volume::named(&scene.node(node), "albedo", &palette, Role::Quantity);
            let volume = volume.unwrap_or_else(|e| panic!("{e}"));
            let found = Bands::<8>::evaluate(volume.constant().unwrap(), &wavelengths);
            for (i, expected) in [0, 2, 3, 4].into_iter().zip(expected) {
                assert!((found[i] - expected).abs() < 2e-3, "{inside}: {found:?}");
            }
        }
    }
}
