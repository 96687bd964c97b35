//! Image files: any bytes are an image of the size it says, or an error.
#![no_main]

use std::fs;

use etendue::budget::Budget;
use etendue::image::read;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("the temporary folder can be written");
    let path = folder.path().join("fuzz");
    fs::write(&path, bytes).expect("the temporary folder can be written");
    if let Ok(picture) = read(&path, &Budget::new(Some(256 << 20)).open()) {
        let image = picture.image;
        let size = image.width() as usize * image.height() as usize * image.channels().len();
        assert_eq!(image.data().len(), size);
    }
});
