//! The packets of tev's protocol that make an image and fill it: a length in bytes that counts itself, a kind, and the
//! fields, all little endian; texts end with a zero byte. From `include/tev/Ipc.h` and `src/Ipc.cpp` of tev, version 1.19
//! and later (`UpdateImageV3`).

use std::io;
use std::ops::Range;

use etendue::image::Image;

/// Makes an image of zeros, or puts one in place of the image that has its name.
const CREATE_IMAGE: u8 = 4;
/// Fills a rectangle, from samples that may lie interleaved.
const UPDATE_IMAGE_V3: u8 = 6;
/// About as much as one packet holds: a viewer keeps a whole packet before it shows anything.
const PACKET_BYTES: usize = 4 << 20;

struct Packet(Vec<u8>);

impl Packet {
    fn new(kind: u8) -> Self {
        Self(vec![0, 0, 0, 0, kind])
    }

    /// Whether to select the image.
    fn selecting(self, select: bool) -> Self {
        self.bytes(&[u8::from(select)])
    }

    fn text(self, text: &str) -> Self {
        self.bytes(text.as_bytes()).bytes(&[0])
    }

    fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    fn int(self, number: impl TryInto<i32>) -> io::Result<Self> {
        let number = number.try_into().map_err(|_| too_large())?;
        Ok(self.bytes(&number.to_le_bytes()))
    }

    fn names(self, image: &Image) -> Self {
        (image.channels().iter()).fold(self, |packet, name| packet.text(name))
    }

    fn finish(mut self) -> io::Result<Vec<u8>> {
        let length = u32::try_from(self.0.len()).map_err(|_| too_large())?;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        Ok(self.0)
    }
}

fn too_large() -> io::Error {
    io::Error::new(
        io::ErrorKind::InvalidInput,
        "the image is too large for tev",
    )
}

/// Makes the image and selects it.
pub(super) fn create(name: &str, image: &Image) -> io::Result<Vec<u8>> {
    Packet::new(CREATE_IMAGE)
        .selecting(true)
        .text(name)
        .int(image.width())?
        .int(image.height())?
        .int(image.channels().len())?
        .names(image)
        .finish()
}

/// The rows of an image, as many at a time as go into a packet.
pub(super) fn bands(image: &Image) -> impl Iterator<Item = Range<u32>> + use<> {
    let row = image.width() as usize * image.channels().len() * size_of::<f32>();
    let rows = u32::try_from(PACKET_BYTES / row.max(1)).unwrap_or(u32::MAX);
    let (rows, height) = (rows.max(1), image.height());
    (0..height)
        .step_by(rows as usize)
        .map(move |first| first..height.min(first.saturating_add(rows)))
}

/// Fills some rows of the image.
pub(super) fn update(name: &str, image: &Image, rows: Range<u32>) -> io::Result<Vec<u8>> {
    let channels = image.channels().len();
    let mut packet = Packet::new(UPDATE_IMAGE_V3)
        .selecting(false)
        .text(name)
        .int(channels)?
        .names(image)
        .int(0)?
        .int(rows.start)?
        .int(image.width())?
        .int(rows.len())?;
    for offset in 0..channels as i64 {
        packet = packet.bytes(&offset.to_le_bytes());
    }
    for _ in 0..channels {
        packet = packet.bytes(&(channels as i64).to_le_bytes());
    }
    let row = image.width() as usize * channels;
    for sample in &image.data()[rows.start as usize * row..rows.end as usize * row] {
        packet.0.extend_from_slice(&sample.to_le_bytes());
    }
    packet.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_are_what_tev_reads() {
        let names = vec!["R".to_owned(), "a.X".to_owned()];
        let image = Image::from_data(1, 2, names, vec![1.0, 2.0, 3.0, 4.0]).unwrap();
        let created = create("a.exr", &image).unwrap();
        let expected = b"\x1e\0\0\0\x04\x01a.exr\0\x01\0\0\0\x02\0\0\0\x02\0\0\0R\0a.X\0";
        assert_eq!(created, expected);
        let updated = update("b", &image, 1..2).unwrap();
        let mut expected = b"\x4a\0\0\0\x06\0b\0\x02\0\0\0R\0a.X\0".to_vec();
        for number in [0, 1, 1, 1_i32] {
            expected.extend(number.to_le_bytes());
        }
        for number in [0, 1, 2, 2_i64] {
            expected.extend(number.to_le_bytes());
        }
        for sample in [3.0, 4.0_f32] {
            expected.extend(sample.to_le_bytes());
        }
        assert_eq!(updated, expected);
    }

    #[test]
    fn bands_are_all_rows_and_a_packet_is_never_without_one() {
        let wide = Image::new(1_000_000, 3, vec!["Y".into(); 2]);
        assert_eq!(bands(&wide).collect::<Vec<_>>(), [0..1, 1..2, 2..3]);
        let small = Image::new(1024, 1500, vec!["Y".into()]);
        assert_eq!(bands(&small).collect::<Vec<_>>(), [0..1024, 1024..1500]);
    }
}
