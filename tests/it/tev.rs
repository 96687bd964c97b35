//! Does a viewer that speaks tev's protocol see the image while it is rendered, and does the render need it?

use std::fs;
use std::io::{self, Read as _};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Output};
use std::thread;

use etendue::budget::Budget;
use etendue::image::{self, Image};

const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="aov"><string name="aovs" value="albedo:albedo"/><integrator type="path"/></integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm">
            <string name="pixel_format" value="rgba"/>
            <integer name="width" value="64"/><integer name="height" value="48"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
    </sensor>
    <emitter type="point"><point name="position" value="3, 3, 3"/></emitter>
    <shape type="sphere"/>
</scene>"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("a.xml"), SCENE).expect("writable");
    folder
}

fn run(folder: &Path, words: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(folder)
        .args(words.split_whitespace())
        .output()
        .expect("the program starts")
}

fn read(path: &Path) -> Image {
    let picture = image::read(path, &Budget::default().open());
    picture.unwrap_or_else(|e| panic!("{e}")).image
}

/// A packet's bytes behind its length, read field by field.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (taken, rest) = self.0.split_first_chunk().expect("the packet goes on");
        self.0 = rest;
        *taken
    }

    fn int(&mut self) -> usize {
        i32::from_le_bytes(self.take()).try_into().unwrap()
    }

    fn long(&mut self) -> usize {
        i64::from_le_bytes(self.take()).try_into().unwrap()
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|byte| *byte == 0).expect("an end");
        let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
        self.0 = &self.0[end + 1..];
        text
    }
}

/// An image in the viewer, and how often its first row was filled.
struct Seen {
    name: String,
    image: Image,
    updates: usize,
}

/// All images that one connection makes, as they are in the end.
fn watch(listener: &TcpListener) -> Vec<Seen> {
    let (mut stream, _) = listener.accept().expect("somebody connects");
    let mut seen: Vec<Seen> = Vec::new();
    loop {
        let mut length = [0; 4];
        match stream.read_exact(&mut length) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return seen,
            result => result.unwrap(),
        }
        let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut packet).expect("whole packets");
        let mut fields = Fields(&packet);
        let ([kind], [_select], name) = (fields.take(), fields.take(), fields.text());
        match kind {
            4 => {
                let [width, height, count] = [(); 3].map(|()| fields.int());
                let names = (0..count).map(|_| fields.text()).collect();
                seen.push(Seen {
                    name,
                    image: Image::new(width as u32, height as u32, names),
                    updates: 0,
                });
            }
            6 => {
                let count = fields.int();
                let names: Vec<String> = (0..count).map(|_| fields.text()).collect();
                let [x, y, width, height] = [(); 4].map(|()| fields.int());
                let offsets: Vec<usize> = (0..count).map(|_| fields.long()).collect();
                let strides: Vec<usize> = (0..count).map(|_| fields.long()).collect();
                let last = seen.last_mut().expect("it was made before");
                assert_eq!(last.name, name);
                last.updates += usize::from(y == 0);
                let samples: Vec<f32> = (fields.0.chunks_exact(4))
                    .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
                    .collect();
                for ((channel, offset), stride) in names.iter().zip(offsets).zip(strides) {
                    let channel = last.image.channel(channel).expect("a channel of it");
                    for pixel in 0..width * height {
                        let [column, row] = [x + pixel % width, y + pixel / width];
                        let sample = samples[offset + pixel * stride];
                        let (column, row) = (column as u32, row as u32);
                        last.image.set(column, row, channel, sample);
                    }
                }
            }
            other => panic!("nobody sends packets of kind {other}"),
        }
    }
}

#[test]
fn a_viewer_sees_each_image_grow_to_what_is_written() {
    let folder = folder();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = listener.local_addr().unwrap();
    let viewer = thread::spawn(move || watch(&listener));
    let words = "render a.xml -o {frame}.exr --frames 0:2 --spp 10000000 --time-limit 2";
    let output = run(folder.path(), &format!("{words} --tev {place}"));
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let seen = viewer.join().expect("the packets are right");
    let names: Vec<&str> = seen.iter().map(|seen| seen.name.as_str()).collect();
    assert_eq!(names, ["0.exr", "1.exr"]);
    for Seen {
        name,
        image,
        updates,
    } in &seen
    {
        assert!(*updates > 2, "{name} was shown {updates} times");
        let written = read(&folder.path().join(name));
        assert_eq!(image.channels().len(), written.channels().len());
        assert!(image.channels().len() > 4, "{:?}", image.channels());
        for (channel, name) in image.channels().iter().enumerate() {
            let same = written.channel(name).expect("a channel of the file");
            let of = |image: &Image, channel: usize| -> Vec<u32> {
                let pixels = image.data().chunks(image.channels().len());
                pixels.map(|pixel| pixel[channel].to_bits()).collect()
            };
            assert!(of(image, channel) == of(&written, same), "{name}");
        }
    }
}

#[test]
fn a_viewer_that_goes_away_is_warned_of_once_and_the_images_are_the_same() {
    let folder = folder();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = listener.local_addr().unwrap();
    let viewer = thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("somebody connects");
        stream.read_exact(&mut [0; 100]).expect("it is sent more");
    });
    let words = "render a.xml --spp 200 --frames 0:4 -o";
    let output = run(
        folder.path(),
        &format!("{words} seen-{{frame}}.exr --tev {place}"),
    );
    viewer.join().expect("it saw a beginning");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    let warning = format!("warning: tev at {place} shows no more images");
    assert_eq!(said.matches(&warning).count(), 1, "{said}");
    run(folder.path(), &format!("{words} alone-{{frame}}.exr"));
    for frame in 0..4 {
        let [seen, alone] =
            ["seen", "alone"].map(|name| read(&folder.path().join(format!("{name}-{frame}.exr"))));
        assert_eq!(seen, alone);
    }
}

#[test]
fn where_nobody_listens_nothing_is_rendered() {
    let folder = folder();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = listener.local_addr().unwrap();
    drop(listener);
    let output = run(
        folder.path(),
        &format!("render a.xml -o a.exr --tev {place}"),
    );
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        said.contains(&format!("cannot connect to tev at {place}")) && said.contains("start tev"),
        "{said}"
    );
    assert!(!folder.path().join("a.exr").exists());
}
