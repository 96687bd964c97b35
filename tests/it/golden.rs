//! The scenes in `scenes/`, small, against the images in `tests/golden/`.
//!
//! One binary gives the same bits on every x86-64 processor. Sines and exponentials come from the system's
//! mathematics library, though, which differs between systems in the last place: so an image may differ by
//! one code value, and a thousandth of its pixels by more (a path that went elsewhere).
//!
//! `ETENDUE_BLESS=1` writes the images anew. A failure leaves the image and the difference (eightfold)
//! beside each other in the target directory.

use std::fs;
use std::path::{Path, PathBuf};

use etendue::budget::Budget;
use etendue::description::{Description, Options as ReadOptions};
use etendue::display;
use etendue::image::{self, Image, Metadata};
use etendue::lanes::Kernel;
use etendue::render::{Colors, Options, Overrides, Silent, render};

use super::support::at;

fn scenes() -> Vec<PathBuf> {
    let entries = fs::read_dir(at("scenes")).expect("there are scenes");
    let mut scenes: Vec<PathBuf> = entries
        .map(|e| e.expect("the folder can be read").path())
        .filter(|p| p.extension().is_some_and(|e| e == "xml"))
        .collect();
    scenes.sort();
    scenes
}

fn described(scene: &Path) -> Description {
    Description::read(scene, &ReadOptions::default(), &Budget::default())
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Renders a scene small, as a PNG at `path`.
fn render_small(scene: &Path, path: &Path) {
    let mut description = described(scene);
    Overrides {
        spp: Some(16),
        size: Some((72, 54)),
        ..Overrides::default()
    }
    .apply(&mut description);
    let rendered =
        render(&description, &Options::default(), &Silent).unwrap_or_else(|e| panic!("{e}"));
    assert!(rendered.warnings.is_empty(), "{:?}", rendered.warnings);
    display::save(
        path,
        &rendered.image,
        &Metadata::default(),
        &Default::default(),
    )
    .unwrap_or_else(|e| panic!("{e}"));
}

fn read(path: &Path) -> Image {
    let picture = image::read(path, &Budget::default().open());
    picture
        .unwrap_or_else(|e| panic!("{e}\nETENDUE_BLESS=1 makes new images"))
        .image
}

/// What is wrong with `actual`, if anything, and the difference as an image.
fn judge(expected: &Image, actual: &Image) -> Option<(String, Image)> {
    let size = |i: &Image| (i.width(), i.height(), i.channels().to_vec());
    if size(expected) != size(actual) {
        let message = format!("{:?} became {:?}", size(expected), size(actual));
        return Some((message, actual.clone()));
    }
    let mut difference = actual.clone();
    for (d, e) in difference.data_mut().iter_mut().zip(expected.data()) {
        *d = (*d - e).abs();
    }
    let codes = |v: &f32| (v * 255.0).round() as u32;
    let stride = expected.channels().len();
    let pixels = difference.data().chunks(stride);
    let beyond = pixels
        .clone()
        .filter(|p| p.iter().any(|v| codes(v) > 1))
        .count();
    let worst = difference.data().iter().map(codes).max().unwrap_or(0);
    let allowed = pixels.len() / 1000;
    if beyond <= allowed {
        return None;
    }
    for d in difference.data_mut() {
        *d = (*d * 8.0).min(1.0);
    }
    let message = format!("{beyond} pixels differ ({allowed} may), by up to {worst} of 255");
    Some((message, difference))
}

#[test]
fn every_scene_looks_as_it_did() {
    let bless = std::env::var_os("ETENDUE_BLESS").is_some();
    let target = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut failures = Vec::new();
    for scene in scenes() {
        let name = scene
            .file_stem()
            .expect("a scene has a name")
            .to_string_lossy();
        let golden = at("tests/golden").join(format!("{name}.png"));
        let actual = target.join(format!("{name}.png"));
        render_small(&scene, &actual);
        if bless {
            fs::copy(&actual, &golden).expect("tests/golden can be written");
            continue;
        }
        if let Some((message, difference)) = judge(&read(&golden), &read(&actual)) {
            let path = target.join(format!("{name}-difference.png"));
            display::save(
                &path,
                &difference,
                &Metadata::default(),
                &Default::default(),
            )
            .expect("target is there");
            let (actual, path) = (actual.display(), path.display());
            failures.push(format!("{name}: {message}\n  {actual}\n  {path}"));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_golden_image_notices_a_change_and_forgives_a_rounding() {
    let names = ["R", "G", "B"].map(String::from).to_vec();
    let grey = |value| vec![value; 40 * 50 * 3];
    let image = |data| Image::from_data(40, 50, names.clone(), data).expect("the sizes agree");
    let mut other = grey(0.5 + 1.0 / 255.0);
    (other[0], other[3]) = (1.0, 0.0);
    assert!(judge(&image(grey(0.5)), &image(other.clone())).is_none());
    other[7] = 0.0;
    assert!(judge(&image(grey(0.5)), &image(other)).is_some());
    assert!(judge(&image(grey(0.5)), &image(grey(0.51))).is_some());
}

#[test]
fn every_golden_image_has_its_scene() {
    let names: Vec<String> = scenes()
        .iter()
        .map(|s| {
            format!(
                "{}.png",
                s.file_stem().expect("a scene has a name").display()
            )
        })
        .collect();
    for entry in fs::read_dir(at("tests/golden")).expect("there are golden images") {
        let path = entry.expect("the folder can be read").path();
        if path.is_dir() {
            continue; // texts, which tests of their own compare
        }
        let name = path
            .file_name()
            .expect("an entry has a name")
            .to_string_lossy();
        assert!(
            names.iter().any(|n| *n == name),
            "tests/golden/{name} has no scene"
        );
    }
}

#[test]
fn every_kernel_renders_every_scene_to_the_same_bits() {
    let in_bands = [5, 70].map(Colors::bands);
    let in_bands = in_bands.into_iter().filter(|_| cfg!(feature = "bands"));
    let models: Vec<Colors> = std::iter::once(Colors::Rgb).chain(in_bands).collect();
    for scene in scenes() {
        let mut description = described(&scene);
        Overrides {
            spp: Some(3),
            size: Some((32, 24)),
            ..Overrides::default()
        }
        .apply(&mut description);
        for colors in &models {
            let mut expected = None;
            for kernel in Kernel::all() {
                let options = Options {
                    colors: *colors,
                    kernel,
                    ..Options::default()
                };
                let rendered = render(&description, &options, &Silent);
                let image = rendered.unwrap_or_else(|e| panic!("{e}")).image;
                let bits: Vec<u32> = image.data().iter().map(|v| v.to_bits()).collect();
                let expected = expected.get_or_insert_with(|| bits.clone());
                let name = kernel.name();
                assert!(bits == *expected, "{scene:?}, {colors:?}, {name}");
            }
        }
    }
}
