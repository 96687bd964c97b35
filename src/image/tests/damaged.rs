//! Damaged files: cut off, falsified, absurdly large, or changed at random. Each is an error or an image,
//! never a panic, and never takes more memory than the file is worth.

use ::image::{ExtendedColorType, ImageFormat};

use super::*;

/// One small valid file of every kind, with a name of its kind.
fn valid_files() -> Vec<(&'static str, Vec<u8>)> {
    let rgb = ExtendedColorType::Rgb8;
    vec![
        ("a.exr", exr_bytes(&sample(9, 35, &["R", "G", "B", "n.X"]))),
        ("a.hdr", radiance::encode(&sample(16, 6, &["Y"])).unwrap()),
        ("a.png", raster_bytes(16, 6, rgb, ImageFormat::Png)),
        (
            "b.png",
            raster_bytes(16, 6, ExtendedColorType::La16, ImageFormat::Png),
        ),
        ("a.jpg", jpeg_bytes(false)),
        ("b.jpg", jpeg_bytes(true)),
        ("a.pfm", pfm_bytes(&sample(9, 5, &["R", "G", "B"]))),
        ("a.tif", tiff_bytes(Layout::Rgba)),
        ("b.tif", tiff::encode(&sample(9, 5, &["Y", "A"])).unwrap()),
        ("c.tif", tiffs::Foreign::default().bytes()),
        ("a.ppm", raster_bytes(16, 6, rgb, ImageFormat::Pnm)),
        ("a.bmp", raster_bytes(16, 6, rgb, ImageFormat::Bmp)),
        ("a.tga", raster_bytes(16, 6, rgb, ImageFormat::Tga)),
    ]
}

/// The bytes of a TIFF file of 16 × 6 pixels of codes.
fn tiff_bytes(layout: Layout) -> Vec<u8> {
    let n = 16 * 6 * layout.channels();
    let codes: Vec<u8> = (0..n).map(|i| (i * 37 % 251) as u8).collect();
    tiff::encode_samples([16, 6], layout, &codes).unwrap()
}

fn try_decode(name: &str, bytes: &[u8]) -> Result<Picture> {
    decode(Path::new(name), bytes, &Budget::default().open())
}

/// `bytes` with the only occurrence of `old` replaced.
fn replaced(bytes: &[u8], old: &[u8], new: &[u8]) -> Vec<u8> {
    let at = bytes
        .windows(old.len())
        .position(|w| w == old)
        .expect("the file holds the bytes");
    [&bytes[..at], new, &bytes[at + old.len()..]].concat()
}

/// `bytes` with the value of an EXR attribute overwritten from byte `offset` of the value on.
fn with_attribute(bytes: &[u8], name_and_type: &[u8], offset: usize, value: &[u8]) -> Vec<u8> {
    let n = name_and_type.len();
    let at = bytes
        .windows(n)
        .position(|w| w == name_and_type)
        .expect("the attribute is there");
    let from = at + n + 4 + offset;
    [&bytes[..from], value, &bytes[from + value.len()..]].concat()
}

#[test]
fn falsified_files_are_refused() {
    let exr = exr_bytes(&sample(9, 35, &["B", "G", "R"]));
    let window = b"dataWindow\0box2i\0";
    let channels = b"channels\0chlist\0";
    let int = |v: i32| v.to_le_bytes();
    let rgb = ExtendedColorType::Rgb8;
    let png = raster_bytes(16, 6, rgb, ImageFormat::Png);
    let jpg = jpeg_bytes(false);
    let pfm = pfm_bytes(&sample(9, 5, &["R", "G", "B"]));
    let tif = tiff_bytes(Layout::Rgb);
    let wide = |width: u32| {
        let entry = |width: u32| [&b"\0\x01\x04\0\x01\0\0\0"[..], &width.to_le_bytes()].concat();
        replaced(&tif, &entry(16), &entry(width))
    };
    let of = |change: fn(&mut tiffs::Foreign)| {
        let mut file = tiffs::Foreign::default();
        change(&mut file);
        file.bytes()
    };
    let bmp = raster_bytes(16, 6, rgb, ImageFormat::Bmp);
    let tga = raster_bytes(16, 6, rgb, ImageFormat::Tga);
    let hdr = radiance::encode(&sample(16, 6, &["Y"])).unwrap();
    let tiled = b"tiles\0tiledesc\0\x09\0\0\0\0\0\0\0\0\0\0\0\0dataWindow";
    // The offset table of 3 entries begins after the header's closing zero, before the first block.
    let first_block = exr.windows(4).rposition(|w| w == int(32)).unwrap();
    let table = exr
        .windows(8)
        .position(|w| {
            let offset = u64::from_le_bytes(w.try_into().unwrap());
            offset > 100 && offset < first_block as u64 && exr[offset as usize..][..4] == int(0)
        })
        .unwrap();
    let mut doubled = exr.clone();
    doubled.copy_within(table..table + 8, table + 8);

    let version = |flags: &[u8; 4]| replaced(&exr, &exr[4..8], flags);
    let deep = replaced(
        &version(b"\x02\x08\0\0"),
        b"\x0d\0\0\0scanlineimage",
        b"\x0c\0\0\0deepscanline",
    );
    let uncounted = replaced(&exr, b"chunkCount", b"chunkCounu");
    let packed = b"compression\0compression\0\x01\0\0\0";
    let compressed_by = |code| {
        replaced(
            &exr,
            &[&packed[..], &[3]].concat(),
            &[&packed[..], &[code]].concat(),
        )
    };
    let box_of = |size: i32| {
        let boxed = |size: i32| [&b"dataWindow\0box2i\0"[..], &int(size)].concat();
        replaced(&exr, &boxed(16), &boxed(size))
    };
    let billion = int(999_999_999);
    let large = [&png_header(60_000, 60_000), &png[33..]].concat();
    let huge = [&png_header(1 << 30, 1 << 30), &png[33..]].concat();
    let mut flipped = png.clone();
    flipped[50] ^= 1;
    let resized = |size: &str| replaced(&hdr, b"-Y 6 +X 16", size.as_bytes());
    let bmp_huge = [&bmp[..18], &int(1 << 30), &int(1 << 30), &bmp[26..]].concat();
    let tga_huge = [&tga[..12], &[0xff; 4], &tga[16..]].concat();

    let falsified: Vec<(&str, Vec<u8>, &str)> = vec![
        ("a.exr", vec![], "the file is empty"),
        ("a.tga", vec![], "ends too early"),
        (
            "a.png",
            b"hello, I am a text".to_vec(),
            "no image of a known",
        ),
        ("a.exr", exr[..4].to_vec(), "missing bytes"),
        ("a.exr", version(b"\x09\0\0\0"), "versions other than 2"),
        ("a.exr", version(b"\x02\0\x80\0"), "too new"),
        ("a.exr", deep, "deep data not supported"),
        (
            "a.exr",
            with_attribute(&exr, window, 8, &billion),
            "cannot hold 1000000000 × 35",
        ),
        (
            "a.exr",
            with_attribute(&exr, window, 12, &billion),
            "chunk count",
        ),
        (
            "a.exr",
            with_attribute(&uncounted, window, 12, &billion),
            "cannot hold 9 × 1000000000",
        ),
        (
            "a.exr",
            with_attribute(&uncounted, window, 8, &[billion, billion].concat()),
            "cannot hold 1000000000 × 1000000000",
        ),
        (
            "a.exr",
            with_attribute(&exr, window, 0, &int(i32::MIN)),
            "window size",
        ),
        (
            "a.exr",
            with_attribute(&exr, window, 8, &int(99_999)),
            "cannot hold 100000 × 35",
        ),
        (
            "a.exr",
            with_attribute(&exr, window, 12, &int(60)),
            "chunk count",
        ),
        (
            "a.exr",
            replaced(&exr, b"dataWindow", b"dataWindoh"),
            "data window attribute",
        ),
        (
            "a.exr",
            with_attribute(&exr, channels, 0, &[0]),
            "at least one channel",
        ),
        (
            "a.exr",
            with_attribute(&exr, channels, 2, &int(7)),
            "pixel type",
        ),
        (
            "a.exr",
            with_attribute(&exr, channels, 10, &int(0)),
            "zero sampling",
        ),
        (
            "a.exr",
            with_attribute(&exr, channels, 10, &int(4)),
            "do not divide the data window",
        ),
        (
            "a.exr",
            with_attribute(&exr, channels, 0, b"Z"),
            "not sorted",
        ),
        ("a.exr", compressed_by(0x4d), "unknown compression"),
        ("a.exr", box_of(i32::MAX), "missing bytes"),
        ("a.exr", box_of(-1), "attribute size"),
        (
            "a.exr",
            replaced(&version(b"\x02\x02\0\0"), b"dataWindow", tiled),
            "tile size",
        ),
        (
            "a.exr",
            [&exr[..table], &vec![0; exr.len() - table]].concat(),
            "invalid",
        ),
        ("a.exr", doubled, "offset table"),
        ("a.png", png[..8].to_vec(), "ends too early"),
        ("a.png", flipped, "CRC"),
        ("a.png", huge, "a file of"),
        ("a.png", large, "cannot hold 60000 × 60000"),
        ("a.png", png_header(0, 5), "dimensions"),
        ("a.png", png_header(100, 100), "ends too early"),
        ("a.jpg", jpg[..4].to_vec(), "ends too early"),
        ("a.jpg", jpg[..jpg.len() - 9].to_vec(), "ends too early"),
        ("a.jpg", jpeg_of_components(4), "4 components"),
        ("a.jpg", jpeg_of_components(2), "2 components"),
        ("a.jpg", b"\xff\xd8\xff\xd9".to_vec(), "SOF"),
        ("a.bmp", b"BM".to_vec(), "ends too early"),
        ("a.bmp", bmp_huge, "too large"),
        ("a.bmp", bmp[..bmp.len() / 2].to_vec(), "ends too early"),
        ("a.tga", tga[..tga.len() / 2].to_vec(), "ends too early"),
        ("a.tga", tga_huge, "cannot hold 65535 × 65535"),
        ("a.hdr", hdr[..hdr.len() / 2].to_vec(), "ends too early"),
        (
            "a.hdr",
            resized("-Y 4000000000 +X 4000000000"),
            "cannot hold",
        ),
        (
            "a.hdr",
            resized("-Y 60000 +X 16000"),
            "cannot hold 16000 × 60000",
        ),
        (
            "a.hdr",
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n".to_vec(),
            "ends too early",
        ),
        (
            "a.pfm",
            b"PF 9 5\n".to_vec(),
            "a width, a height and a scale",
        ),
        (
            "a.pfm",
            b"PF 9 5 NaN\n".to_vec(),
            "a width, a height and a scale",
        ),
        (
            "a.pfm",
            b"PF 9 -5 1\n".to_vec(),
            "a width, a height and a scale",
        ),
        ("a.pfm", b"PF 0 5 1\n".to_vec(), "no pixels"),
        (
            "a.pfm",
            b"PF 4000000000 4000000000 1\n".to_vec(),
            "cannot hold",
        ),
        ("a.pfm", pfm[..pfm.len() - 1].to_vec(), "ends too early"),
        ("a.tif", tif[..8].to_vec(), "ends too early"),
        ("a.tif", tif[..3].to_vec(), "no image of a known"),
        ("a.tif", wide(0), "invalid"),
        ("a.tif", wide(1 << 30), "cannot hold 1073741824 × 6"),
        ("a.tif", wide(17), ""),
        ("a.tif", of(|f| f.photometric = 3), "Photometric"),
        ("a.tif", of(|f| f.photometric = 5), "CMYK"),
        (
            "a.tif",
            of(|f| {
                f.bits = 32;
                f.data.resize(96, 0);
            }),
            "32 bits of this kind",
        ),
        ("a.tif", of(|f| f.format = 2), "8 bits of this kind"),
        ("a.tif", of(|f| f.compression = 7), "compression"),
        ("a.tif", of(|f| f.samples = 0), "zero"),
        ("a.tif", of(|f| f.data.truncate(20)), "too early"),
        ("a.ppm", b"P6\n60000 60000\n255\n".to_vec(), "cannot hold"),
        ("a.ppm", b"P6\n4 4\n70000\n".to_vec(), "MAXVAL"),
        ("a.ppm", b"P6\n4 4\n0\n".to_vec(), "MAXVAL"),
        ("a.ppm", b"P6\n4 4\n255\nabc".to_vec(), "ends too early"),
        ("a.ppm", b"P3\n1 1\n255\n1 2 x".to_vec(), "ASCII"),
    ];
    for (i, (name, bytes, message)) in falsified.iter().enumerate() {
        let error = try_decode(name, bytes).expect_err(message).to_string();
        assert!(error.contains(message), "file {i}, {name}: {error}");
    }
}

fn png_header(width: u32, height: u32) -> Vec<u8> {
    let mut chunk = b"IHDR".to_vec();
    chunk.extend(width.to_be_bytes());
    chunk.extend(height.to_be_bytes());
    chunk.extend([8, 2, 0, 0, 0]);
    // CRC-32 as PNG defines it, bit by bit.
    let mut crc = u32::MAX;
    for &byte in &chunk {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 * (crc & 1));
        }
    }
    [
        b"\x89PNG\r\n\x1a\n\0\0\0\x0d",
        &*chunk,
        &(!crc).to_be_bytes(),
    ]
    .concat()
}

fn jpeg_of_components(n: u8) -> Vec<u8> {
    let mut bytes = vec![0xff, 0xd8, 0xff, 0xc0, 0, 8 + 3 * n, 8, 0, 8, 0, 8, n];
    bytes.extend((0..n).flat_map(|i| [i, 0x11, 0]));
    bytes.extend([0xff, 0xda, 0, 6 + 2 * n, n]);
    bytes.extend((0..n).flat_map(|i| [i, 0]));
    bytes.extend([0, 63, 0, 0xff, 0xd9]);
    bytes
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    for (name, bytes) in valid_files() {
        assert!(try_decode(name, &bytes).is_ok(), "{name}");
        if name == "b.jpg" {
            // Behind each of its scans it is a whole picture.
            continue;
        }
        // The ends of PNG (its last chunk) and TGA (a footer) come after the picture.
        let needed = match name {
            "a.tga" => 18 + 16 * 6 * 3,
            n if n.ends_with(".png") => bytes.len() - 12,
            // The last marker may be missing.
            n if n.ends_with(".jpg") => bytes.len() - 2,
            _ => bytes.len(),
        };
        for length in 0..needed {
            assert!(
                try_decode(name, &bytes[..length]).is_err(),
                "{name} at {length}"
            );
        }
    }
}

#[test]
fn limits_hold_before_anything_is_decoded() {
    for (name, bytes) in valid_files() {
        let picture = try_decode(name, &bytes).unwrap();
        let size = size_of_val(picture.image.data()) as u64;
        // With what decoders need on the way.
        let budget = Budget::new(Some(8 * size));
        let account = budget.open();
        assert!(decode(Path::new(name), &bytes, &account).is_ok(), "{name}");
        let taken = 8 * size - account.left().unwrap();
        assert!(taken >= size, "{name}: {taken} of {size}");
        let small = Budget::new(Some(size - 1)).open();
        let error = decode(Path::new(name), &bytes, &small).unwrap_err();
        assert!(
            error.to_string().contains("are left of the limit"),
            "{name}: {error}"
        );
    }
}

#[test]
fn no_count_in_a_file_is_believed() {
    // Were one of them, this would ask for 16 TB and the process would end.
    let absurd = (1_u64 << 44).to_le_bytes();
    for (compression, original) in foreign_exrs() {
        for at in 0..original.len().min(800) - 8 {
            let mut bytes = original.clone();
            bytes[at..at + 8].copy_from_slice(&absurd);
            if let Ok(picture) = openexr::decode(&bytes, &Budget::default().open()) {
                let samples = picture.image.data().len();
                assert!(samples <= 1 << 20, "{compression} at {at}: {samples}");
            }
        }
    }
}

#[test]
fn random_changes_never_panic() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    };
    let foreign = foreign_exrs()
        .into_iter()
        .map(|(_, bytes)| ("b.exr", bytes));
    for (name, original) in valid_files().into_iter().chain(foreign) {
        for _ in 0..300 {
            let mut bytes = original.clone();
            // Headers come first and break most, so half of the changes go there.
            let reach = if random(2) == 0 {
                bytes.len()
            } else {
                bytes.len().min(400)
            };
            for _ in 0..=random(4) {
                let at = random(reach);
                match random(4) {
                    0 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][random(5)],
                    1 => bytes[at] ^= 1 << random(8),
                    2 => bytes[at] = random(256) as u8,
                    _ => bytes.truncate(at.max(1)),
                }
                if bytes.len() < reach {
                    break;
                }
            }
            let Ok(decoder) = Decoder::of_input(Path::new(name), &bytes) else {
                continue;
            };
            // Past the guard against panics, so that the checks themselves are tested.
            let result = decode_by(decoder, &bytes, &Budget::new(Some(64 << 20)).open());
            if let Ok(picture) = result {
                let image = picture.image;
                let n = image.width() as usize * image.height() as usize * image.channels().len();
                assert_eq!(image.data().len(), n);
            }
        }
    }
}

/// What a program's panic hook asks, so that the error alone is told.
#[test]
fn a_decoder_that_panics_is_a_damaged_file_and_is_known_to_be_at_work() {
    assert!(!is_decoding());
    let refused = guarded(|| {
        assert!(!is_decoding(), "it is");
        Err(Error::input("it is not known"))
    });
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("the file is damaged"), "{refused}");
    assert!(!is_decoding());
}
