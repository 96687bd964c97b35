//! TIFF: what is written is read again, and what other programs write is read as they mean it.

use super::*;

/// A file as other programs write it: without compression, of three channels of 4 × 2 pixels, with what can be said
/// otherwise said otherwise.
#[derive(Clone)]
pub(super) struct Foreign {
    pub(super) big_endian: bool,
    pub(super) photometric: u16,
    pub(super) compression: u16,
    pub(super) samples: u16,
    pub(super) bits: u16,
    /// 1 for codes, 2 with a sign, 3 for floats.
    pub(super) format: u16,
    pub(super) planar: bool,
    pub(super) extra: Option<u16>,
    pub(super) orientation: Option<u16>,
    /// Whether a second image follows.
    pub(super) pages: bool,
    /// The samples in this order of bytes.
    pub(super) data: Vec<u8>,
}

impl Default for Foreign {
    fn default() -> Self {
        Self {
            big_endian: false,
            photometric: 2,
            compression: 1,
            samples: 3,
            bits: 8,
            format: 1,
            planar: false,
            extra: None,
            orientation: None,
            pages: false,
            data: (0..24).collect(),
        }
    }
}

impl Foreign {
    pub(super) fn bytes(&self) -> Vec<u8> {
        let short = |v: u16| match self.big_endian {
            true => v.to_be_bytes(),
            false => v.to_le_bytes(),
        };
        let long = |v: u32| match self.big_endian {
            true => v.to_be_bytes(),
            false => v.to_le_bytes(),
        };
        let data = 8;
        let planes = if self.planar {
            u32::from(self.samples)
        } else {
            1
        };
        let plane = self.data.len() as u32 / planes.max(1);
        let places = data + self.data.len() as u32;
        let mut file = match self.big_endian {
            true => b"MM\0*".to_vec(),
            false => b"II*\0".to_vec(),
        };
        // The directory stands last, behind the places and lengths of the planes.
        file.extend(long(places + 8 * planes));
        file.extend(&self.data);
        (0..planes).for_each(|i| file.extend(long(data + i * plane)));
        (0..planes).for_each(|_| file.extend(long(plane)));
        let mut entries: Vec<(u16, u32, [u8; 4])> = Vec::new();
        let one = |v: u16| {
            let [a, b] = short(v);
            [a, b, 0, 0]
        };
        entries.push((256, 1, one(4)));
        entries.push((257, 1, one(2)));
        entries.push((258, 1, one(self.bits)));
        entries.push((259, 1, one(self.compression)));
        entries.push((262, 1, one(self.photometric)));
        let at = |i: u32| {
            long(if planes == 1 {
                [data, plane][i as usize]
            } else {
                places + 4 * planes * i
            })
        };
        entries.push((273, planes, at(0)));
        entries.extend(self.orientation.map(|v| (274, 1, one(v))));
        entries.push((277, 1, one(self.samples)));
        entries.push((279, planes, at(1)));
        entries.push((284, 1, one(1 + u16::from(self.planar))));
        entries.extend(self.extra.map(|v| (338, 1, one(v))));
        entries.push((339, 1, one(self.format)));
        let directory = file.len() as u32;
        file.extend(short(entries.len() as u16));
        for (tag, count, value) in &entries {
            let kind = if matches!(tag, 273 | 279) { 4 } else { 3 };
            file.extend([short(*tag), short(kind)].concat());
            file.extend(long(*count));
            file.extend(value);
        }
        let next = file.len() as u32 + 4;
        file.extend(long(if self.pages { next } else { 0 }));
        if self.pages {
            let first = file[directory as usize..next as usize - 4].to_vec();
            file.extend(first);
            file.extend([0; 4]);
        }
        file
    }

    fn picture(&self) -> Picture {
        let bytes = self.bytes();
        decode(Path::new("a.tif"), &bytes, &Budget::default().open()).unwrap()
    }
}

#[test]
fn floats_and_codes_of_every_layout_come_back() {
    let read = |bytes: &[u8]| decode(Path::new("a"), bytes, &Budget::default().open()).unwrap();
    for (names, layout) in [
        (&["Y"][..], Layout::Grey),
        (&["Y", "A"], Layout::GreyAlpha),
        (&["R", "G", "B"], Layout::Rgb),
        (&["R", "G", "B", "A"], Layout::Rgba),
    ] {
        // Of more than one strip, which have a megabyte.
        let mut image = sample(700, 400, names);
        image.set(3, 2, 0, -1.5e20);
        let picture = read(&tiff::encode(&image).unwrap());
        assert_eq!(picture.encoding, Encoding::Linear);
        assert_eq!(picture.image, image, "{layout:?}");
        assert!(picture.warnings.is_empty());

        let n = 700 * 400 * layout.channels();
        let codes: Vec<u16> = (0..n).map(|i| (i * 7919 % 65_536) as u16).collect();
        let picture = read(&tiff::encode_samples([700, 400], layout, &codes).unwrap());
        assert_eq!(
            (picture.encoding, picture.image.channels()),
            (Encoding::Srgb, image.channels())
        );
        let back = picture
            .image
            .data()
            .iter()
            .map(|v| (v * 65535.0).round() as u16);
        assert!(back.eq(codes.iter().copied()), "{layout:?}");

        let codes: Vec<u8> = codes.iter().map(|code| (code >> 3) as u8).collect();
        let picture = read(&tiff::encode_samples([700, 400], layout, &codes).unwrap());
        let back = picture
            .image
            .data()
            .iter()
            .map(|v| (v * 255.0).round() as u8);
        assert!(back.eq(codes.iter().copied()), "{layout:?}");
    }
    let layers = sample(3, 2, &["n.X", "B", "G", "R", "depth"]);
    let picture = read(&tiff::encode(&layers).unwrap());
    assert_eq!(picture.image.channels(), ["R", "G", "B"]);
    assert_eq!(picture.image.get(1, 1, 0), layers.get(1, 1, 3));
    assert!(tiff::encode(&sample(1, 1, &["depth"])).is_err());
}

#[test]
fn files_of_other_programs_are_read_as_they_mean_it() {
    let plain = Foreign::default().picture();
    let codes: Vec<f32> = (0..24).map(|v| v as f32 / 255.0).collect();
    assert_eq!(plain.image.data(), codes);
    assert_eq!((plain.image.width(), plain.image.height()), (4, 2));
    assert_eq!(plain.encoding, Encoding::Srgb);

    let planes = Foreign {
        planar: true,
        ..Foreign::default()
    };
    assert_eq!(
        planes.picture().image.pixel(1, 1),
        [5, 13, 21].map(|v| v as f32 / 255.0)
    );

    let wide = |value: u16| value.to_be_bytes();
    let words = Foreign {
        big_endian: true,
        bits: 16,
        data: (0..24).flat_map(|v| wide(v * 1000)).collect(),
        ..Foreign::default()
    };
    assert_eq!(words.picture().image.get(3, 1, 2), 23_000.0 / 65535.0);

    let floats = |format: u16, bits: u16, data: Vec<u8>| Foreign {
        photometric: 1,
        samples: 1,
        bits,
        format,
        data,
        ..Foreign::default()
    };
    let values = [0.5_f32, -1.0, 1e9, f32::INFINITY, 0.0, 1.0, 2.0, 3.0];
    let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let picture = floats(3, 32, bytes).picture();
    assert_eq!(picture.image.data(), values);
    assert_eq!(
        (picture.encoding, picture.image.channels()),
        (Encoding::Linear, &["Y".to_owned()][..])
    );
    // Half floats: 1, and -2.
    let bytes = [0x00, 0x3c, 0x00, 0xc0].repeat(4);
    assert_eq!(
        floats(3, 16, bytes).picture().image.data()[..2],
        [1.0, -2.0]
    );

    // Black is the greatest code.
    let inverted = Foreign {
        photometric: 0,
        samples: 1,
        data: vec![0, 55, 255, 255, 255, 255, 255, 255],
        ..Foreign::default()
    };
    assert_eq!(
        inverted.picture().image.data()[..3],
        [1.0, 200.0 / 255.0, 0.0]
    );
}

#[test]
fn opacity_is_straight_and_what_is_left_out_is_told() {
    let of = |extra: u16, format: u16| {
        let pixel = [0.25_f32, 0.5, 0.125, 0.5].map(f32::to_le_bytes).concat();
        let clear = [0.0_f32; 4].map(f32::to_le_bytes).concat();
        Foreign {
            samples: 4,
            bits: 32,
            format,
            extra: Some(extra),
            data: [pixel.repeat(7), clear].concat(),
            ..Foreign::default()
        }
    };
    let straight = of(2, 3).picture().image;
    assert_eq!(straight.channels(), ["R", "G", "B", "A"]);
    assert_eq!(straight.pixel(0, 0), [0.25, 0.5, 0.125, 0.5]);
    let multiplied = of(1, 3).picture().image;
    assert_eq!(multiplied.pixel(0, 0), [0.5, 1.0, 0.25, 0.5]);
    assert_eq!(multiplied.pixel(3, 1), [0.0; 4]);

    let told = |file: Foreign| file.picture().warnings.first().map(|w| w.message.clone());
    assert_eq!(told(Foreign::default()), None);
    let pages = Foreign {
        pages: true,
        ..Foreign::default()
    };
    assert!(told(pages).unwrap().contains("several images"));
    let turned = Foreign {
        orientation: Some(6),
        ..Foreign::default()
    };
    assert!(told(turned).unwrap().contains("turned"));
}
