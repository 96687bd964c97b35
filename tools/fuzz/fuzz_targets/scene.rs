//! Scene files: any text is a description or an error.
#![no_main]

use std::path::Path;

use etendue::description::{Description, Options};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(description) = Description::parse(text, Path::new("fuzz.xml"), &Options::default()) {
        description.root();
        description.warnings();
    }
});
