//! Files of the cache of trees and normals: whatever is in them, the image is the same or there is an error. The first
//! byte says whether the input takes the place of a file or changes some of its bytes.
#![no_main]

use std::fs;
use std::path::Path;

use etendue::budget::Budget;
use etendue::description::{Description, Options as Read};
use etendue::mesh;
use etendue::render::{Options, Silent, render};
use libfuzzer_sys::fuzz_target;

const SCENE: &str = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
    <integer name="width" value="4"/><integer name="height" value="4"/></film>
    <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="1"/></sampler></sensor>
    <emitter type="constant"/>
    <shape type="ply"><string name="filename" value="ball.ply"/></shape></scene>"#;

fuzz_target!(|bytes: &[u8]| {
    let Some((how, bytes)) = bytes.split_first() else { return };
    let folder = tempfile::tempdir().expect("the temporary folder can be written");
    mesh::write_ply(&folder.path().join("ball.ply"), &mesh::ball(6)).expect("it can be written");
    let path = folder.path().join("fuzz.xml");
    let scene = Description::parse(SCENE, Path::new(&path), &Read::default()).expect("it is right");
    let scene = scene.within(&Budget::new(Some(1 << 30)));
    let cache = folder.path().join("cache");
    let options = Options { cache: Some(cache.clone()), ..Options::default() };
    render(&scene, &options, &Silent).expect("it is right");
    for entry in fs::read_dir(&cache).expect("it was made").flatten() {
        let mut kept = fs::read(entry.path()).expect("it was written");
        if how % 2 == 0 {
            kept = bytes.to_vec();
        } else {
            for change in bytes.as_chunks::<5>().0 {
                let [place @ .., value] = *change;
                let at = u32::from_le_bytes(place) as usize % kept.len();
                kept[at] = value;
            }
        }
        fs::write(entry.path(), kept).expect("the temporary folder can be written");
    }
    // Who changes the checksums as well can change the image, and no more.
    let _ = render(&scene, &options, &Silent);
});
