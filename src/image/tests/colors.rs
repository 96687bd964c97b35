//! Files of other colours than BT.709's red, green and blue: by name, by primaries, as luminance and chroma, as XYZ.

use ::exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use ::exr::block::writer::ChunksWriter;
use ::exr::meta::attribute::Chromaticities;
use ::exr::meta::header::Header;
use ::exr::prelude::{
    ChannelDescription, Compression, IntegerBounds, LineOrder, SampleType, SmallVec, Text, Vec2,
    f16,
};

use super::*;

fn try_exr(bytes: &[u8]) -> Result<Picture> {
    openexr::decode(bytes, &Budget::default().open())
}

/// Another program's file of one pixel.
fn one_pixel(channels: &[(&str, f32)], chromaticities: Option<[f32; 8]>) -> Vec<u8> {
    use ::exr::prelude::*;
    let channels = channels
        .iter()
        .map(|(name, value)| AnyChannel::new(*name, FlatSamples::F32(vec![*value])));
    let layer = Layer::new(
        (1, 1),
        LayerAttributes::default(),
        Encoding::UNCOMPRESSED,
        AnyChannels::sort(channels.collect()),
    );
    let mut image = ::exr::image::Image::from_layer(layer);
    image.attributes.chromaticities =
        chromaticities.map(|[rx, ry, gx, gy, bx, by, wx, wy]| Chromaticities {
            red: Vec2(rx, ry),
            green: Vec2(gx, gy),
            blue: Vec2(bx, by),
            white: Vec2(wx, wy),
        });
    let mut file = std::io::Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut file).unwrap();
    file.into_inner()
}

const BT2020: [f32; 8] = [0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329];
const XYZ: [f32; 8] = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0];
const BT709: [f32; 8] = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];

/// The numbers are Mitsuba 3.9.1's.
#[test]
fn exr_colours_are_taken_into_bt709() {
    let rgb = |r, g, b| vec![("R", r), ("G", g), ("B", b)];
    let grey_and_chroma = |y, ry, by| vec![("Y", y), ("RY", ry), ("BY", by)];
    let lower = vec![("r", 0.1), ("g", 0.2), ("b", 0.3), ("a", 0.4)];
    for (channels, chromaticities, expected) in [
        (
            rgb(0.228, 0.825, 0.870),
            Some(BT2020),
            [-0.1696, 0.8990, 0.8862],
        ),
        (rgb(0.228, 0.825, 0.870), Some(BT709), [0.228, 0.825, 0.870]),
        (rgb(0.228, 0.825, 0.870), None, [0.228, 0.825, 0.870]),
        (
            rgb(0.3, 0.4, 0.5),
            Some(XYZ),
            [0.108016, 0.480398, 0.463733],
        ),
        // What XYZ are is known without the attribute.
        (
            vec![("X", 0.3), ("Y", 0.4), ("Z", 0.5)],
            None,
            [0.108016, 0.480398, 0.463733],
        ),
        (
            vec![("X", 0.3), ("Y", 0.4), ("Z", 0.5)],
            Some(BT2020),
            [0.108016, 0.480398, 0.463733],
        ),
        (grey_and_chroma(0.5, 0.2, -0.5), None, [0.6, 0.495519, 0.25]),
        (
            grey_and_chroma(0.5, 0.2, -0.5),
            Some(BT2020),
            [0.694181, 0.470509, 0.220200],
        ),
        (lower, None, [0.1, 0.2, 0.3]),
    ] {
        let picture = try_exr(&one_pixel(&channels, chromaticities)).unwrap();
        let image = picture.image.into_rgb();
        let values = image.rgb().unwrap().map(|c| image.get(0, 0, c));
        for c in 0..3 {
            let error = (values[c] - expected[c]).abs();
            assert!(
                error < 2e-4,
                "{channels:?} {chromaticities:?}: {values:?} {expected:?}"
            );
        }
    }
}

#[test]
fn exr_channels_are_named_in_capitals_where_those_are_free() {
    for (names, expected) in [
        (&["r", "g", "b", "a"][..], &["R", "G", "B", "A"][..]),
        (&["y"], &["Y"]),
        (&["R", "r", "g.b", "g.beta"], &["R", "g.B", "g.beta", "r"]),
    ] {
        let channels: Vec<(&str, f32)> = names.iter().map(|name| (*name, 1.0)).collect();
        let picture = try_exr(&one_pixel(&channels, None)).unwrap();
        assert_eq!(picture.image.channels(), expected);
    }
}

#[test]
fn exr_layers_of_colour_are_converted_and_other_channels_are_not() {
    let channels = [
        ("l.R", 0.3),
        ("l.G", 0.4),
        ("l.B", 0.5),
        ("n.X", 1.0),
        ("z", 2.0),
    ];
    let image = try_exr(&one_pixel(&channels, Some(XYZ))).unwrap().image;
    let get = |name| image.get(0, 0, image.channel(name).unwrap());
    assert!((get("l.R") - 0.108).abs() < 1e-3 && (get("l.B") - 0.4637).abs() < 1e-3);
    assert_eq!((get("n.X"), get("Z")), (1.0, 2.0));
}

#[test]
fn chromaticities_that_make_no_colours_are_refused_where_there_are_colours() {
    let flat = [0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3];
    let rgb = [("R", 1.0), ("G", 1.0), ("B", 1.0)];
    let error = try_exr(&one_pixel(&rgb, Some(flat))).unwrap_err();
    assert!(error.to_string().contains("chromaticities"), "{error}");
    assert!(try_exr(&one_pixel(&[("Y", 1.0)], Some(flat))).is_ok());
}

#[test]
fn exr_files_say_what_their_colours_are() {
    for (names, expected) in [
        (
            &["R", "G", "B", "A"][..],
            Some("0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329"),
        ),
        (
            &["Y", "A"],
            Some("0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329"),
        ),
        (
            &["X", "Y", "Z", "A"],
            Some("1 0 0 1 0 0 0.33333334 0.33333334"),
        ),
        (&["depth"], None),
    ] {
        let image = sample(5, 3, names);
        let picture = try_exr(&exr_bytes(&image)).unwrap();
        let said = picture
            .metadata
            .iter()
            .find(|(name, _)| name == "chromaticities");
        assert_eq!(said.map(|(_, text)| &**text), expected, "{names:?}");
        assert_eq!(picture.image, image, "{names:?}");
    }
}

const WIDTH: usize = 12;
const HEIGHT: usize = 36;

/// A file with a luminance and, of a lower resolution, chroma: all that it can be compressed by.
fn subsampled(compression: Compression, step: [usize; 2]) -> Vec<u8> {
    let channel = |name| ChannelDescription::new(Text::from(name), SampleType::F16, false);
    let channels: SmallVec<[_; 5]> = ["BY", "RY", "Y"].into_iter().map(channel).collect();
    let header = Header::new(Text::default(), (WIDTH, HEIGHT), channels).with_encoding(
        compression,
        ::exr::meta::BlockDescription::ScanLines,
        LineOrder::Increasing,
    );
    let mut coarse = header.clone();
    for channel in &mut coarse.channels.list[..2] {
        channel.sampling = Vec2(step[0], step[1]);
    }
    let mut file = std::io::Cursor::new(Vec::new());
    ::exr::block::write(
        &mut file,
        [header].into_iter().collect(),
        true,
        |meta, writer| {
            let lines = compression.scan_lines_per_block();
            for number in 0..meta.headers[0].chunk_count {
                let first = number * lines;
                let area =
                    IntegerBounds::new((0, first as i32), (WIDTH, lines.min(HEIGHT - first)));
                let mut bytes = Vec::new();
                for y in first..first + area.size.1 {
                    for channel in &coarse.channels.list {
                        let Vec2(across, down) = channel.sampling;
                        if y % down == 0 {
                            for x in 0..WIDTH / across {
                                let value = value(channel.name.to_string().as_str(), x, y / down);
                                bytes.extend(f16::from_f32(value).to_ne_bytes());
                            }
                        }
                    }
                }
                let block = CompressedScanLineBlock {
                    y_coordinate: first as i32,
                    compressed_pixels_le: compression
                        .compress_image_section_to_le(&coarse, bytes, area)?,
                };
                let compressed_block = CompressedBlock::ScanLine(block);
                writer.write_chunk(
                    number,
                    Chunk {
                        layer_index: 0,
                        compressed_block,
                    },
                )?;
            }
            Ok(())
        },
    )
    .unwrap();
    let mut bytes = file.into_inner();
    for name in [&b"BY\0"[..], b"RY\0"] {
        let at = bytes.windows(3).position(|w| w == name).unwrap() + 3 + 8;
        bytes[at] = step[0] as u8;
        bytes[at + 4] = step[1] as u8;
    }
    bytes
}

/// Chroma is the same everywhere but in its upper rows.
fn value(channel: &str, x: usize, y: usize) -> f32 {
    match channel {
        "Y" => 0.25 + (x + y) as f32 / 64.0,
        "RY" if y == 0 => 0.5,
        _ => -0.25,
    }
}

#[test]
fn exr_chroma_of_a_lower_resolution_is_spread_over_the_pixels() {
    for step in [[2, 2], [2, 1], [1, 2], [3, 4]] {
        for compression in [
            Compression::Uncompressed,
            Compression::RLE,
            Compression::ZIP1,
            Compression::ZIP16,
            Compression::PIZ,
        ] {
            let file = subsampled(compression, step);
            let image = match try_exr(&file) {
                Ok(picture) => picture.image,
                // The bytes of a block are no multiple of its pixels.
                Err(e) if step == [3, 4] => {
                    assert!(e.to_string().contains("sampling"), "{e}");
                    continue;
                }
                Err(e) => panic!("{compression} {step:?}: {e}"),
            };
            assert_eq!(image.channels(), ["R", "G", "B"]);
            for (x, y) in [(0, 20), (11, 30), (5, 35)] {
                let luminance = 0.25 + (x + y) as f32 / 64.0;
                let [red, green, blue] = image.pixel(x, y) else {
                    panic!()
                };
                for (value, expected) in [(red, 0.75), (blue, 0.75), (green, 1.0990)] {
                    let error = (value - expected * luminance).abs();
                    assert!(
                        error < 2e-3,
                        "{compression} {step:?}: {:?}",
                        image.pixel(x, y)
                    );
                }
            }
            // On the way from the first row of chroma to the second.
            let ratio = |y| image.get(4, y, 0) / value("Y", 4, y as usize) - 1.0;
            if step[1] == 2 {
                // Lanczos of two lobes at 0.25, 0.75, 1.25 … samples; the first row stands for those above.
                for (y, weight) in [(0, 1.0 + 0.007), (1, 0.8926 - 0.0275), (2, 0.2451 - 0.1205)] {
                    let expected = -0.25 + 0.75 * weight;
                    assert!(
                        (ratio(y) - expected).abs() < 0.15,
                        "{y}: {} {expected}",
                        ratio(y)
                    );
                }
            }
        }
    }
}

#[test]
fn subsampling_that_does_not_fit_is_refused() {
    let valid = subsampled(Compression::ZIP1, [2, 2]);
    let at = valid.windows(3).position(|w| w == b"RY\0").unwrap() + 3 + 8;
    for (step, message) in [
        (0, "zero sampling"),
        (5, "do not divide"),
        (255, "do not divide"),
    ] {
        let mut bytes = valid.clone();
        bytes[at] = step;
        let error = try_exr(&bytes).unwrap_err().to_string();
        assert!(error.contains(message), "{step}: {error}");
    }
}

#[test]
fn the_first_part_of_an_exr_is_the_picture() {
    use ::exr::prelude::*;
    let part = |name: &str, size: (usize, usize), channels: &[&str]| {
        let samples = || FlatSamples::F32(vec![1.0; size.0 * size.1]);
        let channels = channels
            .iter()
            .map(|name| AnyChannel::new(*name, samples()));
        Layer::new(
            size,
            LayerAttributes::named(name),
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(channels.collect()),
        )
    };
    let file = |parts: [Layer<AnyChannels<FlatSamples>>; 2]| {
        let mut file = std::io::Cursor::new(Vec::new());
        let layers: Layers<AnyChannels<FlatSamples>> = parts.into_iter().collect();
        let image = ::exr::image::Image::from_layers(ImageAttributes::with_size((4, 3)), layers);
        image.write().to_buffered(&mut file).unwrap();
        file.into_inner()
    };
    let rgb: &[&str] = &["R", "G", "B"];
    for (parts, channels, left_out) in [
        (
            [part("a", (4, 3), rgb), part("m", (2, 2), &["Y"])],
            &["a.R", "a.G", "a.B"][..],
            Some("m"),
        ),
        (
            [part("m", (4, 3), &["Y"]), part("a", (4, 3), rgb)],
            &["m.Y"; 3],
            None,
        ),
        (
            [part("m", (2, 2), &["Y"]), part("a", (4, 3), rgb)],
            &["m.Y"; 3],
            Some("a"),
        ),
    ] {
        let picture = try_exr(&file(parts)).unwrap();
        let names = picture
            .image
            .rgb()
            .unwrap()
            .map(|c| &*picture.image.channels()[c]);
        assert_eq!(names, channels);
        let said: Vec<String> = picture.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(said.len(), usize::from(left_out.is_some()));
        if let Some(name) = left_out {
            assert!(said[0].ends_with(&format!("left out: {name}")), "{said:?}");
        }
    }
}

/// The header, and a pixel of 2^-1 · 128/128.
fn hdr(header: &str, pixel: [u8; 4]) -> Result<Picture> {
    let bytes = [header.as_bytes(), &pixel].concat();
    decode(Path::new("a.hdr"), &bytes, &Budget::default().open())
}

#[test]
fn hdr_headers_are_read_as_they_are_written() {
    let half = [128, 64, 32, 128];
    for header in [
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n",
        "#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n",
        "#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 1\r\n",
        "#?RADIANCE\n# made by hand\nSOFTWARE=a b c\nEXPOSURE=4.0\nGAMMA=2.2\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n",
        "#?RADIANCE\n\n-Y 1 +X 1\n",
    ] {
        let image = hdr(header, half).unwrap().image;
        assert_eq!(image.pixel(0, 0), [0.5, 0.25, 0.125], "{header:?}");
    }
    let xyze = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n";
    let image = hdr(xyze, [128, 128, 128, 129]).unwrap().image;
    // Mitsuba 3.9.1's numbers for X = Y = Z = 1.
    let expected = [1.204_794, 0.948_291, 0.908_916];
    assert!((0..3).all(|c| (image.get(0, 0, c) - expected[c]).abs() < 1e-5));
    for (header, message) in [
        (
            "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n+Y 1 +X 1\n",
            "-Y rows +X columns",
        ),
        (
            "#?RADIANCE\nFORMAT=32-bit_rle_lab\n\n-Y 1 +X 1\n",
            "32-bit_rle_lab",
        ),
        (
            "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X one\n",
            "no size of an image",
        ),
        (
            "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 1\n",
            "no pixels",
        ),
    ] {
        let error = hdr(header, half).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn pfm_has_a_scale_two_byte_orders_and_the_bottom_row_first() {
    let values = [1.0_f32, -2.0, 0.25, 8.0, 0.0, 3.5];
    let bytes = |big: bool| -> Vec<u8> {
        let bytes = values.map(|v| {
            if big {
                v.to_be_bytes()
            } else {
                v.to_le_bytes()
            }
        });
        bytes.concat()
    };
    for (header, big, names, factor) in [
        ("PF\n1 2\n-1.0\n", false, &["R", "G", "B"][..], 1.0),
        ("PF\n1 2\n1\n", true, &["R", "G", "B"], 1.0),
        ("PF 1 2 -2.5 ", false, &["R", "G", "B"], 2.5),
        ("PF\r\n1 2\r\n0.5\r\n", true, &["R", "G", "B"], 0.5),
        ("Pf\n3 2\n-1.0\n", false, &["Y"], 1.0),
    ] {
        let file = [header.as_bytes(), &bytes(big)].concat();
        let picture = decode(Path::new("a.pfm"), &file, &Budget::default().open()).unwrap();
        assert_eq!(picture.encoding, Encoding::Linear);
        assert_eq!(picture.image.channels(), names);
        let expected = [8.0, 0.0, 3.5, 1.0, -2.0, 0.25].map(|v| v * factor);
        assert_eq!(picture.image.data(), expected, "{header:?}");
    }
}

#[test]
fn ppm_and_its_kin_are_read_in_text_and_in_bytes() {
    for (file, names, expected) in [
        (
            &b"P6 1 2 255\n\xff\0\x33\0\xff\x66"[..],
            &["R", "G", "B"][..],
            &[1.0, 0.0, 0.2, 0.0, 1.0, 0.4][..],
        ),
        (
            b"P6\n# remark\n1 1\n65535\n\xff\xff\x33\x33\0\0",
            &["R", "G", "B"],
            &[1.0, 0.2, 0.0],
        ),
        (b"P3\n1 1\n15\n15 3 0\n", &["R", "G", "B"], &[1.0, 0.2, 0.0]),
        (b"P5\n3 1\n255\n\xff\x33\0", &["Y"], &[1.0, 0.2, 0.0]),
        (b"P5\n2 1\n65535\n\xff\xff\x33\x33", &["Y"], &[1.0, 0.2]),
        (b"P2\n3 1\n65535\n65535 13107 0", &["Y"], &[1.0, 0.2, 0.0]),
    ] {
        let picture = decode(Path::new("a"), file, &Budget::default().open()).unwrap();
        assert_eq!(picture.encoding, Encoding::Srgb);
        assert_eq!(picture.image.channels(), names);
        assert_eq!(picture.image.data(), expected);
    }
}
