//! What is written is read again, in every format, and so is every image of the shared scenes.

use std::fs;
use std::path::PathBuf;

use ::image::{ExtendedColorType, ImageFormat};
use glam::Mat4;

use super::*;
use crate::color::Primaries;

fn in_file<T>(name: &str, test: impl FnOnce(&Path) -> T) -> T {
    let folder = tempfile::tempdir().unwrap();
    let result = test(&folder.path().join(name));
    assert!(fs::read_dir(folder.path()).unwrap().count() <= 1);
    result
}

fn text<'a>(picture: &'a Picture, name: &str) -> Option<&'a str> {
    let entry = picture.metadata.iter().find(|(n, _)| n == name);
    entry.map(|(_, text)| text.as_str())
}

#[test]
fn exr_keeps_every_bit_of_every_channel() {
    let names = [
        "R", "G", "B", "A", "albedo.B", "albedo.G", "albedo.R", "depth",
    ];
    for (width, height) in [(1, 1), (7, 5), (64, 33), (3, 200)] {
        let mut image = sample(width, height, &names);
        let odd = [f32::NAN, f32::INFINITY, -0.0, -1e30, 1e-40, f32::MAX];
        let n = image.data().len().min(odd.len());
        image.data_mut()[..n].copy_from_slice(&odd[..n]);
        let back = in_file("a.exr", |path| {
            write(path, &image, &Metadata::default()).unwrap();
            read(path, &Budget::default().open()).unwrap()
        });
        assert_eq!(back.encoding, Encoding::Linear);
        assert_eq!(back.image.channels(), image.channels());
        let bits = |i: &Image| i.data().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&back.image), bits(&image), "{width} × {height}");
    }
}

#[test]
fn exr_channels_may_come_in_any_order_and_go_out_colours_first() {
    let image = sample(4, 3, &["depth", "B", "A", "R", "G"]);
    let back = decode(
        Path::new("a.exr"),
        &exr_bytes(&image),
        &Budget::default().open(),
    )
    .unwrap();
    assert_eq!(back.image.channels(), ["R", "G", "B", "A", "depth"]);
    for (c, name) in back.image.channels().iter().enumerate() {
        let original = image.channel(name).unwrap();
        assert_eq!(back.image.get(3, 2, c), image.get(3, 2, original));
    }
}

#[test]
fn exr_keeps_its_metadata_in_types_of_their_own() {
    let camera = Mat4::from_translation(glam::Vec3::new(1.0, 2.0, 3.0));
    let metadata = Metadata::default()
        .with("software", "étendue")
        .with("integrator", "path")
        .with("samples", 64_u32)
        .with("seed", i64::MAX)
        .with("seconds", 0.1_f64)
        .with("exposure", 0.25_f32)
        .with("world_to_camera", camera)
        .with("world_to_ndc", Mat4::IDENTITY);
    let image = sample(2, 2, &["Y"]);
    let bytes = openexr::encode(&image, &whole(&image), &metadata).unwrap();
    let back = decode(Path::new("a.exr"), &bytes, &Budget::default().open()).unwrap();
    for (name, value) in [
        ("software", "étendue"),
        ("integrator", "path"),
        ("samples", "64"),
        ("seed", "9223372036854775807"),
        ("seconds", "0.1"),
        ("exposure", "0.25"),
        // OpenEXR multiplies row vectors: the translation stands in the last row.
        ("world_to_camera", "1 0 0 0 0 1 0 0 0 0 1 0 1 2 3 1"),
        ("world_to_ndc", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"),
    ] {
        assert_eq!(text(&back, name), Some(value), "{name}");
    }
}

#[test]
fn exr_files_of_equal_images_are_equal() {
    let image = sample(40, 40, &["R", "G", "B"]);
    let file = || {
        let entries = (0..20).map(|i| (format!("entry{i}"), MetaValue::Integer(i)));
        let metadata = Metadata {
            entries: entries.collect(),
        };
        openexr::encode(&image, &whole(&image), &metadata).unwrap()
    };
    let first = file();
    assert!((0..8).all(|_| file() == first));
}

#[test]
fn exr_blocks_of_noise_are_not_packed() {
    let (width, noisy) = (200, 16 * 200 * 3);
    let mut image = sample(width, 40, &["R", "G", "B"]);
    image.data_mut()[noisy..].fill(0.5);
    let mut state = 1_u32;
    for value in &mut image.data_mut()[..noisy] {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *value = 1.0 + (state >> 9) as f32 / (1 << 23) as f32;
    }
    let window = Window {
        x: 3,
        y: 20,
        full_width: 300,
        full_height: 70,
    };
    let bytes = openexr::encode(&image, &window, &Metadata::default()).unwrap();
    let size = 4 * noisy;
    assert!(
        (size..size + 2000).contains(&bytes.len()),
        "{}",
        bytes.len()
    );
    let back = decode(Path::new("a.exr"), &bytes, &Budget::default().open()).unwrap();
    assert_eq!(back.image, image);
}

#[test]
fn exr_says_where_a_crop_lies() {
    let image = sample(5, 4, &["R", "G", "B"]);
    let window = Window {
        x: 3,
        y: 20,
        full_width: 32,
        full_height: 24,
    };
    let back = in_file("crop.exr", |path| {
        write_window(path, &image, &window, &Metadata::default()).unwrap();
        read(path, &Budget::default().open()).unwrap()
    });
    assert_eq!(back.image, image);
    assert_eq!(text(&back, "dataWindow"), Some("3 20 5 4"));
    assert_eq!(text(&back, "displayWindow"), Some("0 0 32 24"));
    let beyond = Window { y: 21, ..window };
    assert!(openexr::encode(&image, &beyond, &Metadata::default()).is_err());
}

#[test]
fn exr_refuses_names_that_would_break_the_file() {
    let long = "x".repeat(256);
    for names in [&["R", "R"][..], &[""], &["a\0b"], &[&long]] {
        let image = sample(1, 1, names);
        let result = openexr::encode(&image, &whole(&image), &Metadata::default());
        assert!(result.is_err(), "{names:?}");
    }
    let image = sample(1, 1, &["Y"]);
    for name in ["channels", "dataWindow", "", "a\0b", &long] {
        let metadata = Metadata::default().with(name, 1_u32);
        let result = openexr::encode(&image, &whole(&image), &metadata);
        assert!(result.is_err(), "{name:?}");
    }
    let twice = Metadata::default().with("a", 1_u32).with("a", "b");
    assert!(openexr::encode(&image, &whole(&image), &twice).is_err());
    let image = sample(2, 2, &["a_layer_with_a_long_name.and_a_channel"]);
    let back = decode(
        Path::new("a.exr"),
        &exr_bytes(&image),
        &Budget::default().open(),
    )
    .unwrap();
    assert_eq!(back.image, image);
}

#[test]
fn exr_of_other_programs_is_read_whatever_its_types_and_compression() {
    for (compression, bytes) in foreign_exrs() {
        let image = try_exr(&bytes).unwrap_or_else(|e| panic!("{compression}: {e}"));
        assert_eq!(image.channels(), ["R", "G", "Z", "id"]);
        for (x, y) in [(0, 0), (39, 0), (17, 33), (39, 69)] {
            let i = y * 40 + x;
            let ramp = 1.0 + (x + y) as f32 / 128.0;
            let pixel = image.pixel(x, y);
            // The lossy ones (PXR24, B44, DWA) keep two digits.
            assert!((pixel[0] - ramp).abs() < 0.01, "{compression}: {pixel:?}");
            assert!((pixel[1] - 1.0).abs() < 1e-3, "{compression}: {pixel:?}");
            assert!((pixel[2] - ramp).abs() < 0.01, "{compression}: {pixel:?}");
            assert_eq!(pixel[3], i as f32, "{compression}");
        }
    }
}

#[test]
fn exr_parts_become_layers_of_one_image() {
    use ::exr::prelude::*;
    let part = |name: &str, size: (usize, usize), value: f32| {
        let samples = FlatSamples::F32(vec![value; size.0 * size.1]);
        let channels = AnyChannels::sort([AnyChannel::new("Y", samples)].into_iter().collect());
        Layer::new(
            size,
            LayerAttributes::named(name),
            Encoding::UNCOMPRESSED,
            channels,
        )
    };
    let file = |parts: [Layer<AnyChannels<FlatSamples>>; 2]| {
        let attributes = ImageAttributes::with_size((4, 3));
        let mut file = std::io::Cursor::new(Vec::new());
        let layers: Layers<AnyChannels<FlatSamples>> = parts.into_iter().collect();
        let image = ::exr::image::Image::from_layers(attributes, layers);
        image.write().to_buffered(&mut file).unwrap();
        file.into_inner()
    };
    let image = try_exr(&file([part("near", (4, 3), 1.0), part("far", (4, 3), 2.0)])).unwrap();
    assert_eq!(image.channels(), ["near.Y", "far.Y"]);
    assert_eq!(image.pixel(3, 2), [1.0, 2.0]);
}

fn try_exr(bytes: &[u8]) -> Result<Image> {
    openexr::decode(bytes, &Budget::default().open()).map(|picture| picture.image)
}

#[test]
fn hdr_keeps_colours_to_a_hundredth_of_the_brightest() {
    for width in [1, 7, 8, 200] {
        let mut image = sample(width, 3, &["R", "G", "B"]);
        image
            .pixel_mut(0, 0)
            .copy_from_slice(&[f32::NAN, -1.0, 0.0]);
        let back = in_file("a.hdr", |path| {
            write(path, &image, &Metadata::default()).unwrap();
            read(path, &Budget::default().open()).unwrap()
        });
        assert_eq!(back.encoding, Encoding::Linear);
        assert_eq!(back.image.pixel(0, 0), [0.0; 3]);
        let pixels = |i: &Image| {
            i.data()
                .chunks(3)
                .skip(1)
                .map(<[f32]>::to_vec)
                .collect::<Vec<_>>()
        };
        for (old, new) in pixels(&image).iter().zip(pixels(&back.image)) {
            let brightest = old.iter().fold(0.0_f32, |a, &b| a.max(b));
            assert!((0..3).all(|c| (old[c] - new[c]).abs() <= 0.01 * brightest));
        }
    }
}

#[test]
fn hdr_survives_the_ends_of_its_range() {
    let mut image = sample(8, 1, &["Y"]);
    let odd = [
        f32::INFINITY,
        f32::MAX,
        1e38,
        1e-38,
        1e-40,
        f32::NAN,
        -5.0,
        1.0,
    ];
    image.data_mut().copy_from_slice(&odd);
    let bytes = radiance::encode(&image).unwrap();
    let back = decode(Path::new("a.hdr"), &bytes, &Budget::default().open()).unwrap();
    let values: Vec<f32> = back.image.view().row(0, 0).collect();
    assert!(values[..3].iter().all(|&v| v > 0.9e38), "{values:?}");
    assert_eq!(values[4..], [0.0, 0.0, 0.0, 1.0]);
}

#[test]
fn png_codes_come_back_unchanged() {
    for layout in [Layout::Grey, Layout::GreyAlpha, Layout::Rgb, Layout::Rgba] {
        let n = 16 * 16 * layout.channels();
        let data: Vec<u8> = (0..n).map(|i| (i % 256) as u8).collect();
        let codes = Codes::new(16, 16, layout, data.clone()).unwrap();
        let back = in_file("a.png", |path| {
            write_codes(path, &codes, Tag::Srgb).unwrap();
            read(path, &Budget::default().open()).unwrap()
        });
        assert_eq!(back.encoding, Encoding::Srgb);
        let values: Vec<f32> = data.iter().map(|&v| f32::from(v) / 255.0).collect();
        assert_eq!(back.image.data(), values, "{layout:?}");

        let data: Vec<u16> = (0..n).map(|i| (i * 257 % 65_536) as u16).collect();
        let codes = Codes::new(16, 16, layout, data.clone()).unwrap();
        let back = in_file("a.png", |path| {
            write_codes(path, &codes, Tag::Gamma(2.2, Primaries::BT709)).unwrap();
            read(path, &Budget::default().open()).unwrap()
        });
        let values: Vec<f32> = data.iter().map(|&v| f32::from(v) / 65535.0).collect();
        assert_eq!(back.image.data(), values, "{layout:?}");
    }
}

/// By the format's text: a length, four letters, data and a CRC-32 of letters and data, before the pixels.
#[test]
fn png_files_say_what_their_codes_mean() {
    let codes = Codes::new(1, 1, Layout::Grey, vec![7_u8]).unwrap();
    let cicp = Tag::Cicp {
        primaries: 9,
        transfer: 16,
    };
    for (tag, expected) in [
        (Tag::Srgb, &b"\0\0\0\x01sRGB\0\xae\xce\x1c\xe9"[..]),
        (
            Tag::Gamma(2.2, Primaries::BT709),
            b"\0\0\0\x04gAMA\0\0\xb1\x8f",
        ),
        // Behind a check of four bytes; the first is white's x, .3127.
        (
            Tag::Gamma(2.2, Primaries::P3_D65),
            b"\0\0\0\x04gAMA\0\0\xb1\x8f\x0b\xfc\x61\x05\0\0\0\x20cHRM\0\0\x7a\x26",
        ),
        (cicp, b"\0\0\0\x04cICP\x09\x10\0\x01"),
    ] {
        let bytes = in_file("a.png", |path| {
            write_codes(path, &codes, tag).unwrap();
            std::fs::read(path).unwrap()
        });
        assert_eq!(&bytes[33..][..expected.len()], expected, "{tag:?}");
        let read = decode(Path::new("a.png"), &bytes, &Budget::default().open()).unwrap();
        let told = read.warnings.iter().map(|problem| problem.message.as_str());
        let expected = match tag {
            Tag::Cicp { .. } => Some("its primaries are BT.2020 and its curve is PQ (cICP)"),
            Tag::Gamma(_, primaries) if !primaries.same(&Primaries::BT709) => {
                Some("its primaries are (0.68, 0.32), (0.265, 0.69) and (0.15, 0.06) (cHRM)")
            }
            // 1/2.2 is what programs write for sRGB's curve.
            _ => None,
        };
        let expected =
            expected.map(|says| format!("the file says that {says}: it is read as sRGB"));
        assert_eq!(
            told.collect::<Vec<_>>(),
            Vec::from_iter(expected.as_deref())
        );
    }
    let bytes = in_file("a.png", |path| {
        write_codes(path, &codes, Tag::Gamma(1.0, Primaries::BT709)).unwrap();
        std::fs::read(path).unwrap()
    });
    let read = decode(Path::new("a.png"), &bytes, &Budget::default().open()).unwrap();
    let told = &read.warnings[0].message;
    assert!(told.contains("light to the power of 1 (gAMA)"), "{told}");
}

#[test]
fn integers_of_8_and_16_bits_become_code_values() {
    for (color, names, most) in [
        (ExtendedColorType::L8, &["Y"][..], 255.0),
        (ExtendedColorType::La8, &["Y", "A"], 255.0),
        (ExtendedColorType::Rgba8, &["R", "G", "B", "A"], 255.0),
        (ExtendedColorType::L16, &["Y"], 65535.0),
        (ExtendedColorType::La16, &["Y", "A"], 65535.0),
        (ExtendedColorType::Rgb16, &["R", "G", "B"], 65535.0),
        (ExtendedColorType::Rgba16, &["R", "G", "B", "A"], 65535.0),
    ] {
        let bytes = raster_bytes(9, 5, color, ImageFormat::Png);
        let picture = decode(Path::new("a.png"), &bytes, &Budget::default().open()).unwrap();
        assert_eq!(picture.image.channels(), names);
        let first = if most == 255.0 {
            37.0 / 255.0
        } else {
            f32::from(u16::from_ne_bytes([74, 111])) / 65535.0
        };
        assert_eq!(picture.image.data()[1], first, "{color:?}");
    }
}

#[test]
fn the_content_decides_and_not_the_name() {
    let of = |format| raster_bytes(16, 6, ExtendedColorType::Rgb8, format);
    for bytes in [
        of(ImageFormat::Png),
        jpeg_bytes(false),
        of(ImageFormat::Bmp),
        of(ImageFormat::Pnm),
    ] {
        let picture = decode(Path::new("a.exr"), &bytes, &Budget::default().open()).unwrap();
        assert_eq!((picture.image.width(), picture.image.height()), (16, 6));
    }
    let tga = raster_bytes(9, 5, ExtendedColorType::Rgb8, ImageFormat::Tga);
    assert!(decode(Path::new("a.TGA"), &tga, &Budget::default().open()).is_ok());
    assert!(decode(Path::new("a.dat"), &tga, &Budget::default().open()).is_err());
}

#[test]
fn what_cannot_be_written_is_known_before_the_render() {
    let folder = tempfile::tempdir().unwrap();
    for (name, message) in [
        ("a", "has no extension"),
        ("a.webp", "use .exr, .hdr, .pfm, .tif, .png or .jpg"),
    ] {
        let path = folder.path().join(name);
        let error = check_writable(&path).unwrap_err();
        assert!(error.to_string().contains(message), "{error}");
        let image = sample(1, 1, &["Y"]);
        assert!(write(&path, &image, &Metadata::default()).is_err());
    }
    check_writable(&folder.path().join("a.PNG")).unwrap();
    let colourless = sample(1, 1, &["depth"]);
    let path = folder.path().join("a.hdr");
    assert!(write(&path, &colourless, &Metadata::default()).is_err());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn every_image_of_the_shared_scenes_can_be_read() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let mut read_images = 0;
    for path in images_below(root) {
        let picture = read(&path, &Budget::default().open()).unwrap_or_else(|e| panic!("{e}"));
        assert!(picture.image.width() > 0 && !picture.image.channels().is_empty());
        let linear = path
            .extension()
            .is_some_and(|e| ["exr", "hdr", "pfm"].iter().any(|l| e == *l));
        assert_eq!(
            picture.encoding == Encoding::Linear,
            linear,
            "{}",
            path.display()
        );
        read_images += 1;
    }
    if read_images == 0 {
        use std::io::Write;
        let _ = writeln!(
            std::io::stderr(),
            "skipped: no images in {}",
            root.display()
        );
    }
}

fn images_below(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut images = Vec::new();
    for path in entries.map(|e| e.unwrap().path()) {
        let extension = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .to_lowercase();
        if path.is_dir() {
            images.extend(images_below(&path));
        } else if ["exr", "jpg", "png", "bmp", "tga", "hdr", "pfm", "ppm"].contains(&&*extension) {
            images.push(path);
        }
    }
    images
}
