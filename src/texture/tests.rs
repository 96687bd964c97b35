//! Spectra hold against what Mitsuba 3.9.1 renders with them, and against each other.

use std::path::Path;

use glam::Vec2;

use super::*;
use crate::color::Bands;
use crate::description::{Description, Options};

fn described(spectrum: &str) -> Description {
    let text = format!("<scene version='3.9.1'>{spectrum}</scene>");
    Description::parse(&text, Path::new("test.xml"), &Options::default()).expect("a valid scene")
}

/// What a spectrum, under either tag, is for a role.
fn built<C: ColorModel>(spectrum: &str, palette: &Palette<C>, role: Role) -> Result<Texture<C>> {
    let scene = described(spectrum);
    let kinds = [Kind::Texture, Kind::Spectrum];
    let nodes = kinds.map(|kind| scene.root().children(kind)).concat();
    palette.nested(&nodes[0], role)
}

/// The RGB that paths in bands make of a spectrum as light, averaged over shifts of the comb.
fn seen(spectrum: &str, role: Role) -> [f32; 3] {
    const SHIFTS: u16 = 200;
    let bands = Bands::<8>::visible(8).expect("8 bands fit");
    let texture = built(spectrum, &Palette::new(bands.clone()), role).unwrap();
    let mut sum = [0.0; 3];
    for i in 0..SHIFTS {
        let wavelengths = bands.wavelengths(|| (f32::from(i) + 0.5) / f32::from(SHIFTS));
        let value = texture.eval(&Interaction::at_uv(Vec2::ZERO), &wavelengths);
        let mut out = [0.0; 11];
        bands.develop(0, &value, &wavelengths, &mut out);
        for (sum, v) in sum.iter_mut().zip(out) {
            *sum += v / f32::from(SHIFTS);
        }
    }
    sum
}

fn in_rgb(spectrum: &str, role: Role) -> [f32; 3] {
    let texture = built(spectrum, &Palette::new(Rgb), role).unwrap();
    texture.eval(&Interaction::at_uv(Vec2::ZERO), &()).0
}

fn assert_close(found: [f32; 3], expected: [f32; 3], what: &str) {
    let largest = expected.iter().fold(0.0, |a: f32, b| a.max(b.abs()));
    for (f, e) in found.iter().zip(expected) {
        assert!(
            (f - e).abs() < 0.005 * largest,
            "{what}: {found:?} is not {expected:?}"
        );
    }
}

/// Rendered as the radiance of a rectangle by `scalar_rgb`, if that can, and by `scalar_spectral`.
type Case = (&'static str, Option<[f32; 3]>, [f32; 3]);

const CASES: [Case; 10] = [
    ("<spectrum type='d65'/>", Some([1.0; 3]), [1.0; 3]),
    (
        "<texture type='d65'><rgb name='color' value='2 .5 .2'/><float name='scale' value='.5'/></texture>",
        Some([1.0, 0.25, 0.1]),
        [1.0, 0.25, 0.1],
    ),
    (
        "<spectrum type='d65'><texture type='uniform'><float name='value' value='.3'/></texture></spectrum>",
        Some([0.3; 3]),
        [0.3; 3],
    ),
    (
        "<texture type='srgb'><rgb name='color' value='1 .5 .2'/></texture>",
        Some([1.0, 0.5, 0.2]),
        [1.15893, 0.4782, 0.17584],
    ),
    (
        "<spectrum type='uniform'><float name='value' value='.7'/><float name='wavelength_min' value='500'/>
         <float name='wavelength_max' value='600'/></spectrum>",
        Some([0.7; 3]),
        [0.84445, 0.66443, 0.63698],
    ),
    (
        "<texture type='rawconstant'><float name='value' value='.5'/></texture>",
        Some([0.5; 3]),
        [0.60317, 0.47459, 0.45499],
    ),
    (
        "<spectrum type='regular'><float name='wavelength_min' value='400'/>
         <float name='wavelength_max' value='700'/><string name='values' value='0.1, 0.2, 0.7'/></spectrum>",
        None,
        [0.55929, 0.19478, 0.10707],
    ),
    (
        "<texture type='irregular'><string name='wavelengths' value='400, 500, 700'/>
         <string name='values' value='0.1 0.2 0.7'/></texture>",
        None,
        [0.65069, 0.28799, 0.11345],
    ),
    (
        "<spectrum type='blackbody'><float name='temperature' value='5000'/></spectrum>",
        None,
        [15282.139, 12094.647, 9600.695],
    ),
    (
        "<texture type='blackbody'><float name='temperature' value='5000'/>
         <float name='wavelength_min' value='500'/><float name='wavelength_max' value='600'/></texture>",
        None,
        [3571.0, 12467.0, -1091.0],
    ),
];

#[test]
fn spectra_have_the_colours_that_mitsuba_renders() {
    for (spectrum, rgb, bands) in CASES {
        assert_close(seen(spectrum, Role::Emission), bands, spectrum);
        // What Mitsuba does not render in RGB is what the bands show, clamped to the gamut.
        let expected = rgb.unwrap_or(bands.map(|v| v.max(0.0)));
        assert_close(in_rgb(spectrum, Role::Emission), expected, spectrum);
    }
}

/// Rendered as the reflectance of a rectangle under the white of RGB.
#[test]
fn a_plugin_is_the_same_spectrum_whatever_it_is_used_for() {
    let d65 = "<texture type='d65'><float name='scale' value='2'/></texture>";
    assert_eq!(in_rgb(d65, Role::Reflectance), [2.0; 3]);
    assert_eq!(in_rgb(d65, Role::Emission), [2.0; 3]);
    for (spectrum, _, bands) in &CASES[..8] {
        assert_close(seen(spectrum, Role::Reflectance), *bands, spectrum);
        assert_close(seen(spectrum, Role::Quantity), *bands, spectrum);
    }
}

#[test]
fn a_colour_out_of_gamut_is_clamped_with_a_word() {
    let scene = described(
        "<emitter type='area'><spectrum name='radiance' value='500:0, 530:1, 560:0'/></emitter>",
    );
    let light = scene.root().children(Kind::Emitter)[0];
    let palette = Palette::new(Rgb);
    let color = palette.color(&light, "radiance", Role::Emission);
    assert_close(color.unwrap(), [0.0, 0.38118, 0.0], "an LED");
    let warnings = palette.warnings.lock().unwrap().clone();
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].message.contains("out of gamut"),
        "{}",
        warnings[0]
    );
}

#[test]
fn what_is_wrong_with_a_spectrum_is_told() {
    for (wrong, part) in [
        (
            "<spectrum type='d65'><float name='scale' value='-1'/></spectrum>",
            "negative",
        ),
        (
            "<spectrum type='d65'><float name='color' value='1'/></spectrum>",
            "expected an rgb",
        ),
        ("<spectrum type='srgb'/>", "needs \"color\""),
        (
            "<spectrum type='srgb'><rgb name='color' value='2 0 0'/></spectrum>",
            "[0, 1]",
        ),
        ("<spectrum type='rawconstant'/>", "needs \"value\""),
        ("<spectrum type='blackbody'/>", "needs \"temperature\""),
        (
            "<spectrum type='blackbody'><float name='temperature' value='-5'/></spectrum>",
            "at least 0",
        ),
        (
            "<spectrum type='blackbody'><float name='temperature' value='5'/>
             <float name='wavelength_min' value='900'/></spectrum>",
            "visible",
        ),
        (
            "<spectrum type='regular'><string name='values' value='1 2'/></spectrum>",
            "wavelength_min",
        ),
        (
            "<spectrum type='irregular'><string name='values' value='1 2'/>
             <string name='wavelengths' value='500 400'/></spectrum>",
            "400 follows 500",
        ),
        (
            "<spectrum type='irregular'><string name='values' value='1 2 3'/>
             <string name='wavelengths' value='400 500'/></spectrum>",
            "3 values for 2 wavelengths",
        ),
        (
            "<spectrum type='irregular'><string name='values' value='1 x'/>
             <string name='wavelengths' value='400 500'/></spectrum>",
            "not a number",
        ),
        ("<spectrum type='regulr'/>", "did you mean \"regular\"?"),
    ] {
        let message = built(wrong, &Palette::new(Rgb), Role::Emission)
            .unwrap_err()
            .to_string();
        assert!(message.contains(part), "{message}");
    }
}

/// Every texture of the family, one that is not the same everywhere where it can vary.
fn every_texture<C: ColorModel>(color: &C) -> Vec<(&'static str, Texture<C>)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("i.exr");
    let mut image = crate::image::Image::new(5, 4, ["R", "G", "B"].map(String::from).to_vec());
    for (x, y) in (0..4).flat_map(|y| (0..5).map(move |x| (x, y))) {
        for c in 0..3 {
            image.set(x, y, c, ((x * 7 + y * 3) % 5) as f32 / 5.0);
        }
    }
    crate::image::write(&path, &image, &Default::default()).unwrap();
    let example = |name: &str| {
        match name {
        "bitmap" => format!("<string name='filename' value='{}'/>", path.display()),
        "blackbody" => "<float name='temperature' value='4000'/>".to_owned(),
        "irregular" => "<string name='wavelengths' value='400, 500, 600'/><string name='values' value='0.1, 0.3, 0.2'/>".to_owned(),
        "mesh_attribute" => "<string name='name' value='vertex_color'/>".to_owned(),
        "product" => "<texture name='color0' type='zoneplate'><float name='rings' value='2'/></texture><float name='color1' value='0.5'/>".to_owned(),
        "rawconstant" => "<float name='value' value='0.3'/>".to_owned(),
        "regular" => "<float name='wavelength_min' value='400'/><float name='wavelength_max' value='700'/><string name='values' value='0.1, 0.3'/>".to_owned(),
        "sellmeier" => "<string name='b' value='1.04, 0.23'/><string name='c' value='0.006, 0.02'/>".to_owned(),
        "srgb" => "<rgb name='color' value='0.2, 0.4, 0.1'/>".to_owned(),
        "zoneplate" => "<float name='rings' value='2'/>".to_owned(),
        "cauchy" | "checkerboard" | "d65" | "glass" | "uniform" | "volume" => String::new(),
        other => panic!("give {other} an example"),
    }
    };
    let names = Texture::<C>::NAMES.iter();
    names
        .map(|name| {
            let text = format!("<texture type='{name}'>{}</texture>", example(name));
            let palette = Palette::new(color.clone());
            (
                *name,
                built(&text, &palette, Role::Quantity).unwrap_or_else(|e| panic!("{e}")),
            )
        })
        .collect()
}

#[test]
fn every_texture_is_finite_changes_as_its_gradient_says_and_is_constant_where_it_says() {
    let at = |u: f32, v: f32| Interaction::at_uv(Vec2::new(u, v));
    for (name, texture) in every_texture(&Rgb) {
        let value = |u, v| texture.eval(&at(u, v), &())[0];
        for (u, v) in [(0.13, 0.29), (0.31, 0.77), (0.83, 0.41), (-2.2, 7.6)] {
            let here = value(u, v);
            assert!(here.is_finite() && here >= 0.0, "{name}: {here}");
            if texture.constant().is_some() {
                assert_eq!(here, value(0.0, 0.0), "{name}");
            }
            let h = 2e-3;
            let slopes = texture.gradient(&at(u, v), &()).map(|slope| slope[0]);
            let expected = [
                (value(u + h, v) - value(u - h, v)) / (2.0 * h),
                (value(u, v + h) - value(u, v - h)) / (2.0 * h),
            ];
            for (slope, expected) in slopes.into_iter().zip(expected) {
                let tolerance = 0.05 * (1.0 + expected.abs());
                assert!(
                    (slope - expected).abs() < tolerance,
                    "{name}: {slope} {expected}"
                );
            }
        }
        assert!(texture.resolution() != [0, 0], "{name}");
    }
}

#[test]
fn every_texture_is_made_in_every_colour_model() {
    let bands = Bands::<8>::visible(8).unwrap();
    assert_eq!(every_texture(&bands).len(), Texture::<Rgb>::NAMES.len());
    assert_eq!(every_texture(&Mono).len(), Texture::<Rgb>::NAMES.len());
}

#[test]
fn a_bitmap_that_reflects_more_than_all_is_clamped_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.exr");
    let names = ["R", "G", "B"].map(String::from).to_vec();
    let data = vec![2.0, 0.5, 0.25, 0.1, 0.2, 0.3, 0.1, -0.5, 0.3];
    let image = crate::image::Image::from_data(3, 1, names, data).unwrap();
    crate::image::write(&path, &image, &Default::default()).unwrap();
    let bitmap = |raw: bool| {
        format!(
            "<texture type='bitmap'><string name='filename' value='{}'/>
             <boolean name='raw' value='{raw}'/></texture>",
            path.display()
        )
    };
    for (raw, role, expected) in [
        (false, Role::Reflectance, Some("2 of 3 texels")),
        (true, Role::Reflectance, None),
        (false, Role::Emission, None),
    ] {
        let palette = Palette::new(Rgb);
        let texture = built(&bitmap(raw), &palette, role).unwrap();
        let first = texture
            .eval(&Interaction::at_uv(Vec2::new(1.0 / 6.0, 0.5)), &())
            .0;
        let red = if expected.is_some() { 1.0 } else { 2.0 };
        assert_close(first, [red, 0.5, 0.25], "the first texel");
        let warnings = palette.warnings.lock().unwrap().clone();
        assert_eq!(warnings.len(), usize::from(expected.is_some()));
        if let Some(expected) = expected {
            assert!(warnings[0].message.contains(expected), "{warnings:?}");
        }
    }
}
