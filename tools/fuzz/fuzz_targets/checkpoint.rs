//! Checkpoints: any bytes are one of this render, or an error.
#![no_main]

use std::fs;
use std::path::Path;

use etendue::description::{Description, Options as Read};
use etendue::render::{Checkpoint, Options, Silent, render};
use libfuzzer_sys::fuzz_target;

const SCENE: &str = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
    <integer name="width" value="4"/><integer name="height" value="4"/></film>
    <sampler type="independent"><integer name="sample_count" value="1"/></sampler></sensor>
    <emitter type="constant"/><shape type="cube"/></scene>"#;

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("the temporary folder can be written");
    let path = folder.path().join("checkpoint");
    fs::write(&path, bytes).expect("the temporary folder can be written");
    let scene = Description::parse(SCENE, Path::new("fuzz.xml"), &Read::default()).expect("it is right");
    let checkpoint = Checkpoint { path, every: None, resume: true };
    let options = Options { checkpoint: Some(checkpoint), ..Options::default() };
    let _ = render(&scene, &options, &Silent);
});
