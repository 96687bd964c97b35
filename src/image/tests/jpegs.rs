//! JPEG against libjpeg-turbo's own pixels, by Pillow 13.0 and OpenCV 5.0, which agree: 18 × 10 pixels of each way
//! of sampling chroma, the last column of which is where decoders differ.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use super::*;

/// What it is, the CRC-32 of its decoded bytes, and the file.
const PICTURES: [(&str, u32, &str); 5] = [
    (
        "4:2:0",
        0x16c449ac,
        "\
         /9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6j\
         q62rZ4C8ybqmx5moq6T/2wBDARweHigjKE4rK06kbl1upKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSk\
         pKSkpKSkpKT/wAARCAAKABIDASIAAhEBAxEB/8QAFwAAAwEAAAAAAAAAAAAAAAAAAAMEAv/EACAQAAEDBAIDAAAAAAAAAAAAAAEA\
         AgQDERIxBSEyM1H/xAAWAQEBAQAAAAAAAAAAAAAAAAAEAQL/xAAdEQACAgIDAQAAAAAAAAAAAAABAgADEzEEBRJC/9oADAMBAAIR\
         AxEAPwBNRzpMiw1dVSHiPQwG0njfMrE/3BWxBkTjjU2pyXsx0mhJ7PPf1CvaBiOhpCd6UfMGewtn/9k=",
    ),
    (
        "4:2:2 progressive",
        0x422adccd,
        "\
         /9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6j\
         q62rZ4C8ybqmx5moq6T/2wBDARweHigjKE4rK06kbl1upKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSk\
         pKSkpKSkpKT/wgARCAAKABIDASEAAhEBAxEB/8QAFwAAAwEAAAAAAAAAAAAAAAAAAAIDBP/EABcBAAMBAAAAAAAAAAAAAAAAAAEC\
         BAP/2gAMAwEAAhADEAAAAUqGzFRsuCUGi//EABkQAAIDAQAAAAAAAAAAAAAAAAACAQMiMf/aAAgBAQABBQKdM2YKx+n/xAAdEQAB\
         AgcAAAAAAAAAAAAAAAAAAQIDEBETITJR/9oACAEDAQE/AVzFpwvjNnS//8QAGhEAAgIDAAAAAAAAAAAAAAAAAQIAEBIiM//aAAgB\
         AgEBPwFhqqTAQ9hX/8QAFBABAAAAAAAAAAAAAAAAAAAAIP/aAAgBAQAGPwJf/8QAGBAAAwEBAAAAAAAAAAAAAAAAAAEhMRD/2gAI\
         AQEAAT8hZg0Sm+aw/9oADAMBAAIAAwAAABAPcv/EABkRAQACAwAAAAAAAAAAAAAAAAEAEBExQf/aAAgBAwEBPxABcCIzN2v/xAAZ\
         EQEAAgMAAAAAAAAAAAAAAAABABEQQaH/2gAIAQIBAT8QrBvDwRW5/8QAGRAAAwEBAQAAAAAAAAAAAAAAAAERMSFR/9oACAEBAAE/\
         EIJZRMekfvpqZCKOLD//2Q==",
    ),
    (
        "4:4:4",
        0xc2eb993a,
        "\
         /9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6j\
         q62rZ4C8ybqmx5moq6T/2wBDARweHigjKE4rK06kbl1upKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSk\
         pKSkpKSkpKT/wAARCAAKABIDAREAAhEBAxEB/8QAFwAAAwEAAAAAAAAAAAAAAAAAAgMEBf/EACAQAAEDBAIDAAAAAAAAAAAAAAEA\
         AgQDERIxBSEyM1H/xAAXAQADAQAAAAAAAAAAAAAAAAADBAUG/8QAHxEAAgICAgMBAAAAAAAAAAAAAAEDBAIhERIFEyJh/9oADAMB\
         AAIRAxEAPwBNRzpMiw1dGqRKCPvkHtyqCPpiVSHiPQwG0h9WpvwDQg4XtyM6zz39VtQ4JcBneSZXxvmUtd1CT7u5gJ/uCX8YtMq5\
         6r6HtAxHQ0mMm+WZpvZ//9k=",
    ),
    (
        "grey with restarts",
        0xf9e289df,
        "\
         /9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6j\
         q62rZ4C8ybqmx5moq6T/wAALCAAKABIBAREA/8QAGAAAAgMAAAAAAAAAAAAAAAAAAgMEBQb/xAAgEAAABgICAwAAAAAAAAAAAAAA\
         AQMEBSECESJBEiMx/90ABAAB/9oACAEBAAA/AGTzwkEcWqJ38of/0HQbTFo2NyqVmW7H/9EVJz2ZaOtmP//Sr3nKXLyvl2P/05st\
         xiy1VdD/1M4P/9k=",
    ),
    (
        "4:4:0",
        0xf174fa59,
        "\
         /9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQc1tdhbWGkJ6j\
         q62rZ4C8ybqmx5moq6T/2wBDARweHigjKE4rK06kbl1upKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSk\
         pKSkpKSkpKT/wAARCAAKABIDARIAAhEBAxEB/8QAGAAAAgMAAAAAAAAAAAAAAAAAAAQCAwX/xAAeEAABBAIDAQAAAAAAAAAAAAAB\
         AAIEIQMSBTEzQf/EABYBAQEBAAAAAAAAAAAAAAAAAAQFAv/EABwRAAEEAwEAAAAAAAAAAAAAAAEAAgMEERIhE//aAAwDAQACEQMR\
         AD8ApwMMmRsekzx/kVm5O7Pk3gSHhtSLLB1RnZtWjExLZLl3dpMUTa8W46UOpELD95DlAiuIBWo0DUV8U035cqkZQOar/9k=",
    ),
];

fn file(text: &str) -> Vec<u8> {
    BASE64_STANDARD.decode(text).unwrap()
}

fn try_decode(bytes: &[u8]) -> Result<Picture> {
    jpeg::decode(bytes, &Budget::default().open())
}

/// The bytes that the decoder made.
fn bytes_of(picture: &Picture) -> Vec<u8> {
    let byte = |v: &f32| (v * 255.0).round() as u8;
    picture.image.data().iter().map(byte).collect()
}

#[test]
fn jpegs_have_libjpegs_pixels_to_the_bit() {
    for (what, crc, text) in PICTURES {
        let picture = try_decode(&file(text)).unwrap();
        assert_eq!(
            (picture.image.width(), picture.image.height()),
            (18, 10),
            "{what}"
        );
        assert_eq!(crc32fast::hash(&bytes_of(&picture)), crc, "{what}");
    }
}

#[test]
fn a_jpeg_without_its_last_marker_is_whole() {
    for (what, crc, text) in PICTURES {
        let bytes = file(text);
        let (whole, end) = bytes.split_at(bytes.len() - 2);
        assert_eq!(end, [0xff, 0xd9], "{what}");
        for bytes in [
            whole.to_vec(),
            [whole, &[0; 100]].concat(),
            [&bytes[..], b"more"].concat(),
        ] {
            let picture = try_decode(&bytes).unwrap_or_else(|e| panic!("{what}: {e}"));
            assert_eq!(crc32fast::hash(&bytes_of(&picture)), crc, "{what}");
        }
        let error = try_decode(&whole[..whole.len() - 8])
            .unwrap_err()
            .to_string();
        assert!(error.contains("ends too early"), "{what}: {error}");
    }
}

/// Pillow's pixels of larger pictures lie beside the pictures.
#[test]
fn the_shared_jpegs_have_their_pixels() {
    let folder = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../shared/data/faults/jpeg-420-tint"
    ));
    if !folder.is_dir() {
        use std::io::Write;
        let _ = writeln!(
            std::io::stderr(),
            "skipped: {} is not there",
            folder.display()
        );
        return;
    }
    for name in ["jm_420.jpg", "jm_422.jpg"] {
        let ours = read(&folder.join(name), &Budget::default().open()).unwrap();
        let right = read(
            &folder.join(format!("{name}.png")),
            &Budget::default().open(),
        )
        .unwrap();
        assert_eq!(ours.image, right.image, "{name}");
    }
}
