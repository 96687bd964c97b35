use super::*;
use crate::budget::Budget;
use crate::color::Primaries;
use crate::image::Encoding;

/// The 8-bit codes of an image of one row.
fn row(display: &DisplayTransform, pixels: &[[f32; 3]]) -> Vec<[u8; 3]> {
    let names = ["R", "G", "B"].map(String::from).to_vec();
    let data = pixels.concat();
    let image = Image::from_data(pixels.len() as u32, 1, names, data).unwrap();
    let codes: Codes<u8> = display.codes(&image).unwrap();
    let (codes, _) = codes.data().as_chunks::<3>();
    codes.to_vec()
}

#[test]
fn one_image_leaves_in_every_format_linear_or_encoded() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["R", "G", "B"].map(String::from).to_vec();
    let image = Image::from_data(2, 1, names, vec![0.5, 0.0, 1.0, 2.0, 0.25, 0.125]).unwrap();
    let display = DisplayTransform::default();
    for (name, encoding, red) in [
        ("a.exr", Encoding::Linear, 0.5),
        ("a.HDR", Encoding::Linear, 0.5),
        ("a.pfm", Encoding::Linear, 0.5),
        ("a.tif", Encoding::Srgb, 188.0 / 255.0),
        ("a.jpg", Encoding::Srgb, 188.0 / 255.0),
        ("a.png", Encoding::Srgb, 188.0 / 255.0),
    ] {
        let path = folder.path().join(name);
        save(&path, &image, &Metadata::default(), &display).unwrap();
        let back = image::read(&path, &Budget::default().open()).unwrap();
        assert_eq!(back.encoding, encoding, "{name}");
        let error = back.image.get(0, 0, 0) - red;
        let tolerance = if name == "a.jpg" { 0.02 } else { 0.0 };
        assert!(error.abs() <= tolerance, "{name}: {error}");
    }
}

#[test]
fn an_unknown_extension_names_the_known_ones() {
    let image = Image::new(1, 1, vec!["Y".into()]);
    let display = DisplayTransform::default();
    let error = save(Path::new("a.webp"), &image, &Metadata::default(), &display).unwrap_err();
    assert!(
        error
            .to_string()
            .contains(".exr, .hdr, .pfm, .tif, .png or .jpg"),
        "{error}"
    );
}

#[test]
fn channels_decide_the_layout_and_opacity_has_no_curve() {
    for (names, layout, codes) in [
        (&["Y"][..], Layout::Grey, &[188][..]),
        (&["Y", "A"], Layout::GreyAlpha, &[188, 128]),
        (&["B", "G", "R"], Layout::Rgb, &[188, 188, 188]),
        (&["A", "B", "G", "R"], Layout::Rgba, &[188, 188, 188, 128]),
    ] {
        let names: Vec<String> = names.iter().map(ToString::to_string).collect();
        let data = vec![0.5; names.len()];
        let image = Image::from_data(1, 1, names, data).unwrap();
        let encoded: Codes<u8> = DisplayTransform::default().codes(&image).unwrap();
        assert_eq!(encoded.layout(), layout);
        assert_eq!(encoded.data(), codes);
    }
    let depths = Image::new(1, 1, vec!["Z".into()]);
    assert!(DisplayTransform::default().codes::<u8>(&depths).is_err());
}

#[test]
fn a_lit_room_lifts_black_and_leaves_white() {
    let mut display = DisplayTransform {
        ambient: Some(Ambient {
            illuminance: 1000.0,
            reflectance: 0.05,
            white: 100.0,
            mode: AmbientMode::Simulate,
        }),
        ..DisplayTransform::default()
    };
    // Black is 15.915 of 115.915 nits, 0.13730 of white, whose code is 104.
    let seen = row(&display, &[[0.0; 3], [1.0; 3], [3.0; 3]]);
    assert_eq!(seen, [[104; 3], [255; 3], [255; 3]]);
    display.ambient = display.ambient.map(|ambient| Ambient {
        mode: AmbientMode::Compensate,
        ..ambient
    });
    let sent = row(&display, &[[0.1; 3], [0.5; 3], [1.0; 3]]);
    // 1.159155 · 0.5 − 0.159155 = 0.420423, whose code is 173.
    assert_eq!(sent, [[0; 3], [173; 3], [255; 3]]);
}

/// The short way of sRGB in 8 bits, and the way that all else takes; on a border either is right.
#[test]
fn codes_by_borders_are_those_of_the_curve() {
    let differs = |x: f32| srgb::encode_value(x) != u8::of(Transfer::Srgb.encode(x), 0.5);
    let count = (0..100_000).filter(|i| differs(*i as f32 * 1.1e-5)).count();
    assert!(count < 5, "{count}");
}

/// As PyPI `opencolorio` 2.6.0 shows linear BT.709 on an sRGB display by "ACES 1.0 - SDR Video" of its built-in
/// configuration `cg-config-v1.0.0_aces-v1.3_ocio-v2.1`.
#[test]
fn aces_is_that_of_opencolorio() {
    let aces = aces::Aces::new();
    for (rgb, expected) in [
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([0.18, 0.18, 0.18], [0.355954, 0.355954, 0.355954]),
        ([1.0, 1.0, 1.0], [0.811971, 0.811971, 0.811971]),
        ([0.5, 0.1, 0.02], [0.603653, 0.239854, 0.075292]),
        ([0.02, 0.03, 0.3], [-0.042343, 0.071143, 0.476693]),
        ([4.0, 0.2, 0.1], [1.040378, 0.612561, 0.374243]),
        ([0.01, 0.005, 0.001], [0.012974, 0.003863, -0.000349]),
        ([16.0, 16.0, 16.0], [0.999741, 0.999741, 0.999741]),
        ([0.3, 0.8, 0.1], [0.556429, 0.769175, 0.327045]),
        ([0.9, 0.05, 0.6], [0.827598, 0.130635, 0.690137]),
        ([100.0, 3.0, 50.0], [1.029614, 0.990335, 1.014701]),
        ([0.08, 0.01, 0.012], [0.166920, 0.010895, 0.022053]),
    ] {
        let found = aces.view(rgb).map(|v| Transfer::Srgb.encode(v));
        for c in 0..3 {
            let expected: f32 = expected[c];
            let error = found[c] - expected.clamp(0.0, 1.0);
            assert!(error.abs() < 1e-4, "{rgb:?}: {found:?}, not {expected}");
        }
    }
    let strange = aces.view([f32::NAN, f32::INFINITY, -1.0]);
    assert!(
        strange.iter().all(|v| (0.0..=1.0).contains(v)),
        "{strange:?}"
    );
}

#[test]
fn exposure_is_a_factor_of_light() {
    let brighter = DisplayTransform {
        exposure: Exposure::Stops(1.0),
        ..DisplayTransform::default()
    };
    let plain = DisplayTransform::default();
    assert_eq!(
        row(&brighter, &[[0.1, 0.2, 0.3]]),
        row(&plain, &[[0.2, 0.4, 0.6]])
    );
}

/// Red of BT.709 in wider displays' primaries; grey stays grey.
#[test]
fn colours_are_given_in_the_primaries_of_the_display() {
    let linear = Transfer::Gamma(1.0);
    for (gamut, red) in [
        (Gamut::Bt709, [1.0, 0.0, 0.0]),
        (Gamut::P3, [0.822_462, 0.033_194, 0.017_083]),
        (Gamut::Bt2020, [0.627_404, 0.069_097, 0.016_391]),
    ] {
        let display = DisplayTransform {
            gamut,
            transfer: linear,
            ..DisplayTransform::default()
        };
        let codes = row(&display, &[[1.0, 0.0, 0.0], [0.5; 3]]);
        let expected = red.map(|v: f32| (v * 255.0).round() as u8);
        assert_eq!(codes, [expected, [128; 3]], "{gamut:?}");
    }
}

/// A gradient over four codes across 4,096 pixels has bands a thousand pixels long, and with dither none longer than a few,
/// and the same mean.
#[test]
fn dithered_gradients_have_no_bands() {
    let gradient = |i: u32| [0.2 + 0.01 * i as f32 / 4096.0; 3];
    let pixels: Vec<[f32; 3]> = (0..4096).map(gradient).collect();
    let longest = |codes: &[[u8; 3]]| {
        let runs = codes.chunk_by(|a, b| a[0] == b[0]);
        runs.map(<[_]>::len).max().unwrap()
    };
    let plain = DisplayTransform::default();
    let dithered = DisplayTransform {
        dither: true,
        ..plain
    };
    let (without, with) = (row(&plain, &pixels), row(&dithered, &pixels));
    assert!(longest(&without) > 1000, "{}", longest(&without));
    // Where the gradient reaches a code there is nothing to be dithered.
    assert!(longest(&with) < 200, "{}", longest(&with));
    let mean = |codes: &[[u8; 3]]| codes.iter().map(|c| f64::from(c[0])).sum::<f64>() / 4096.0;
    let exact = pixels
        .iter()
        .map(|p| f64::from(Transfer::Srgb.encode(p[0])) * 255.0);
    let exact = exact.sum::<f64>() / 4096.0;
    assert!(
        (mean(&with) - exact).abs() < 0.05,
        "{} {exact}",
        mean(&with)
    );
}

#[test]
fn sixteen_bits_are_finer() {
    let names = vec!["Y".to_owned()];
    let image = Image::from_data(3, 1, names, vec![0.0, 0.5, 2.0]).unwrap();
    let display = DisplayTransform {
        depth: Depth::Sixteen,
        ..DisplayTransform::default()
    };
    let codes: Codes<u16> = display.codes(&image).unwrap();
    assert_eq!(
        codes.data(),
        [0, (0.735_357 * 65535.0_f64).round() as u16, 65535]
    );
}

#[test]
fn codes_say_what_they_mean() {
    let tag = |gamut, transfer| {
        let display = DisplayTransform {
            gamut,
            transfer,
            ..DisplayTransform::default()
        };
        display.tag()
    };
    let cicp = |primaries, transfer| Tag::Cicp {
        primaries,
        transfer,
    };
    assert_eq!(tag(Gamut::Bt709, Transfer::Srgb), Tag::Srgb);
    assert_eq!(
        tag(Gamut::Bt709, Transfer::Gamma(2.2)),
        Tag::Gamma(2.2, Primaries::BT709)
    );
    assert_eq!(tag(Gamut::P3, Transfer::Srgb), cicp(12, 13));
    assert_eq!(tag(Gamut::Bt2020, Transfer::Pq), cicp(9, 16));
    assert_eq!(tag(Gamut::Bt2020, Transfer::Hlg), cicp(9, 18));
}
