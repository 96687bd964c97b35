//! Files that ask for more memory than there may be, run through the real program: each is refused with a message
//! before the memory is taken. The address space is bounded too, so that a reader that takes it first ends otherwise.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

use crate::support::at;

/// What files are read within, and the address space of the program, in bytes.
const LIMIT: usize = 30_000_000;
const SPACE: usize = 700_000_000;

/// Runs the program within [`SPACE`].
fn run(folder: &Path, arguments: &str) -> Output {
    let program = env!("CARGO_BIN_EXE_etendue");
    let kibibytes = SPACE / 1024;
    let line = format!("ulimit -v {kibibytes}; exec {program} {arguments}");
    Command::new("sh")
        .current_dir(folder)
        .args(["-c", &line])
        .output()
        .unwrap()
}

fn gzip(parts: &[(&[u8], usize)]) -> Vec<u8> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
    for (part, times) in parts {
        let block = part.repeat(1000);
        for _ in 0..times / 1000 {
            gzip.write_all(&block).unwrap();
        }
        gzip.write_all(&part.repeat(times % 1000)).unwrap();
    }
    gzip.finish().unwrap()
}

/// A PNG of so many grey pixels whose data is not there.
fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8; 4], data: &[u8]| {
        bytes.extend((data.len() as u32).to_be_bytes());
        let body = [&kind[..], data].concat();
        bytes.extend(&body);
        bytes.extend(crc32fast::hash(&body).to_be_bytes());
    };
    let size = [width.to_be_bytes(), height.to_be_bytes()].concat();
    chunk(b"IHDR", &[&size[..], &[8, 0, 0, 0, 0]].concat());
    chunk(b"IDAT", &[0; 10_000]);
    chunk(b"IEND", &[]);
    bytes
}

/// A JPEG that says to be larger than it is.
fn jpeg() -> Vec<u8> {
    let mut bytes = fs::read(at("scenes/pictures.jpg")).unwrap();
    let frame = bytes
        .windows(2)
        .position(|pair| matches!(pair, [0xff, 0xc0 | 0xc2]));
    let size = frame.unwrap() + 5;
    let sides = [8000_u16.to_be_bytes(), 8000_u16.to_be_bytes()].concat();
    bytes[size..size + 4].copy_from_slice(&sides);
    bytes
}

/// Files whose content takes far more than [`LIMIT`].
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let floats = "property float x\nproperty float y\nproperty float z\n";
    let ply = |vertices: usize, faces: usize, rest: &str| {
        format!(
            "ply\nformat {rest} 1.0\nelement vertex {vertices}\n{floats}element face {faces}\n\
             property list uint uint vertex_indices\nend_header\n"
        )
    };
    let fan = [
        ply(3, 1, "ascii"),
        "0 0 0\n1 0 0\n0 1 0\n6000000".to_owned(),
    ]
    .concat();
    let serialized = {
        let mut bytes = vec![0x1c, 0x04, 4, 0];
        let mut zlib = ZlibEncoder::new(Vec::new(), Compression::fast());
        zlib.write_all(&0_u32.to_le_bytes()).unwrap();
        zlib.write_all(b"\0").unwrap();
        zlib.write_all(&20_000_000_u64.to_le_bytes()).unwrap();
        zlib.write_all(&1_u64.to_le_bytes()).unwrap();
        for _ in 0..240 {
            zlib.write_all(&[0; 1_000_000]).unwrap();
        }
        bytes.extend(zlib.finish().unwrap());
        bytes.extend(0_u64.to_le_bytes());
        bytes.extend(1_u32.to_le_bytes());
        bytes
    };
    let zeros = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"componentType":5126,"count":16000000,"type":"VEC3"}]}"#;
    let nodes = [
        r#"{"asset":{"version":"2.0"},"nodes":["#,
        &"{},".repeat(1_000_000),
        "{}]}",
    ]
    .concat();
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3000 +X 4000\n";
    vec![
        ("grey.png", png(20_000, 10_000)),
        ("colour.jpg", jpeg()),
        ("light.hdr", [&hdr[..], &[0; 100_000]].concat()),
        (
            "light.pfm",
            [&b"PF\n3000 1500\n-1\n"[..], &[0; 54_000_000]].concat(),
        ),
        ("codes.tif", [&tiff(9000)[..], &[0; 100_000]].concat()),
        (
            "codes.ppm",
            [&b"P6\n9000 9000 255\n"[..], &[0; 100_000]].concat(),
        ),
        ("lines.obj.gz", gzip(&[(b"v 0 0 0\n", 12_000_000)])),
        (
            "face.obj.gz",
            gzip(&[(b"v 0 0 0\nf", 1), (b" 1", 40_000_000)]),
        ),
        (
            "triangles.stl.gz",
            gzip(&[
                (&[0; 80], 1),
                (&[0x40, 0x42, 0x0f, 0], 1),
                (&[0; 50], 1_000_000),
            ]),
        ),
        (
            "points.ply.gz",
            gzip(&[
                (ply(20_000_000, 1, "binary_little_endian").as_bytes(), 1),
                (&[0; 12], 20_000_001),
            ]),
        ),
        (
            "fan.ply.gz",
            gzip(&[(fan.as_bytes(), 1), (b" 1", 6_000_000)]),
        ),
        ("spaces.ply.gz", gzip(&[(b" ", 600_000_000)])),
        ("mesh.serialized", serialized),
        ("zeros.gltf", zeros.as_bytes().to_vec()),
        ("nodes.gltf", nodes.into_bytes()),
    ]
}

/// The beginning of a TIFF file of so many pixels a side, red, green and blue.
fn tiff(side: u16) -> Vec<u8> {
    let entries: [(u16, u16); 7] = [
        (256, side),
        (257, side),
        (258, 8),
        (262, 2),
        (273, 8),
        (277, 3),
        (279, 60_000),
    ];
    let mut file = b"II*\0\x08\0\0\0".to_vec();
    file.extend((entries.len() as u16).to_le_bytes());
    for (tag, value) in entries {
        file.extend(tag.to_le_bytes());
        file.extend(*b"\x03\0\x01\0\0\0");
        file.extend(u32::from(value).to_le_bytes());
    }
    file.extend([0; 4]);
    file
}

#[test]
fn every_reader_refuses_what_is_more_than_the_limit_before_it_takes_it() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files() {
        let path = folder.path().join(name);
        fs::write(&path, &bytes).unwrap();
        drop(bytes);
        let is_mesh = !["png", "jpg", "hdr", "pfm", "tif", "ppm"]
            .iter()
            .any(|extension| name.ends_with(extension));
        let mut commands = vec![format!("info {name}")];
        if is_mesh {
            commands.push(format!("mesh report {name}"));
            commands.push(format!("mesh convert {name} out.ply"));
            commands.push(format!("render {name} -o out.png --threads 1"));
        }
        for command in commands {
            let output = run(folder.path(), &format!("{command} --memory-limit {LIMIT}"));
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{command}: {said}");
            assert!(said.contains("the limit of 30.0 MB"), "{command}: {said}");
            assert!(
                said.contains(name) || said.contains("would take"),
                "{command}: {said}"
            );
        }
        fs::remove_file(path).unwrap();
    }
}

#[test]
fn what_several_files_of_a_scene_take_is_added_up() {
    let folder = tempfile::tempdir().unwrap();
    let sphere = |texture: &str| {
        format!(
            r#"<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
               <string name="filename" value="{texture}"/></texture></bsdf></shape>"#
        )
    };
    for (name, code) in [("a.png", 10), ("b.png", 20)] {
        let pixels = ::image::RgbImage::from_pixel(1000, 1000, ::image::Rgb([code; 3]));
        pixels.save(folder.path().join(name)).unwrap();
    }
    let sensor = r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4"/>
        <integer name="height" value="4"/></film></sensor><emitter type="constant"/>"#;
    for (names, status) in [
        (&["a.png"][..], 0),
        (&["a.png", "a.png"], 0),
        (&["a.png", "b.png"], 1),
    ] {
        let spheres: String = names.iter().map(|name| sphere(name)).collect();
        let scene = format!(r#"<scene version="3.0.0">{sensor}{spheres}</scene>"#);
        fs::write(folder.path().join("scene.xml"), scene).unwrap();
        let output = run(
            folder.path(),
            "check scene.xml --memory-limit 34M --threads 1",
        );
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{names:?}: {said}");
        assert_eq!(
            said.contains("of the limit of 34.0 MB"),
            status == 1,
            "{said}"
        );
    }
}

#[test]
fn the_default_limit_is_what_the_address_space_has_left() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("grey.png"), png(20_000, 10_000)).unwrap();
    let output = run(folder.path(), "info grey.png");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("are left of the limit of"), "{said}");
}

#[test]
fn memory_that_cannot_be_had_is_told_and_no_abort() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "mesh generate terrain out.ply --triangles 60M --memory-limit none";
    let output = run(folder.path(), arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("memory"), "{said}");
}

/// A file that takes half a minute to inflate.
#[cfg(unix)]
#[test]
fn a_signal_ends_reading() {
    crate::support::let_children_hear_interrupts();
    let folder = tempfile::tempdir().unwrap();
    let member = gzip(&[(&[b' '; 100], 1_000_000)]);
    let mut file = fs::File::create(folder.path().join("spaces.obj.gz")).unwrap();
    for _ in 0..150 {
        file.write_all(&member).unwrap();
    }
    drop(file);
    let mut child = Command::new(env!("CARGO_BIN_EXE_etendue"))
        .current_dir(folder.path())
        .args([
            "render",
            "spaces.obj.gz",
            "-o",
            "out.png",
            "--memory-limit",
            "none",
        ])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let kill = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(kill.unwrap().success());
    let status = child.wait().unwrap();
    let mut said = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
    assert_eq!(status.code(), Some(130), "{said}");
    assert!(said.contains("stopped while it was read"), "{said}");
    assert!(!folder.path().join("out.png").exists());
}

/// How many renders [`renders_leave_nothing_behind`] makes; ETENDUE_RENDERS says another number.
const RENDERS: usize = 10_000;
/// Set in the process that makes them.
const ALONE: &str = "ETENDUE_RENDERS_ALONE";

/// Bytes of this process in memory.
#[cfg(target_os = "linux")]
fn resident() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kibibytes = line.unwrap().trim().strip_suffix(" kB").unwrap();
    1024.0 * kibibytes.parse::<f64>().unwrap()
}

/// In a process of their own, for other tests take memory too; and without the allocator's own caches, one a thread, which
/// grow by a tenth of a megabyte until each has met all that there is to keep.
#[cfg(target_os = "linux")]
#[test]
fn renders_leave_nothing_behind() {
    const NAME: &str = "memory::renders_leave_nothing_behind";
    if std::env::var_os(ALONE).is_none() {
        let output = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", NAME, "--nocapture"])
            .env(ALONE, "1")
            .env(
                "GLIBC_TUNABLES",
                "glibc.malloc.tcache_count=0:glibc.malloc.arena_max=1",
            )
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        return;
    }
    let count = std::env::var("ETENDUE_RENDERS").map_or(RENDERS, |n| n.parse().unwrap());
    let shapes = r#"<shape type="sphere"/><shape type="cube"><transform name="to_world"><translate x="2"/></transform>
        <bsdf type="roughconductor"/></shape><emitter type="constant"/>"#;
    let body = format!(
        "{}{shapes}",
        crate::support::meter([0.0, 0.0, 9.0], [0.0; 3], 8, 1)
    );
    let text = crate::support::scene(&body);
    let options = etendue::render::Options {
        threads: std::num::NonZeroUsize::new(2),
        ..Default::default()
    };
    // In turns, so that each is loaded and built anew.
    let other = text.replace("<shape type=\"sphere\"/>", "<shape type=\"disk\"/>");
    let scenes = [text, other].map(|text| crate::support::describe(&text));
    let mut session = etendue::render::Session::default();
    let mut begin = 0.0;
    for done in 1..=count {
        let scene = &scenes[done % 2];
        let rendered = session.render(scene, &options, &etendue::render::Silent);
        rendered.unwrap_or_else(|e| panic!("{e}"));
        if done == 100 {
            begin = resident();
        }
    }
    let ratio = resident() / begin;
    let told = format!("after {count} renders {ratio:.4} times the {begin} bytes after 100");
    writeln!(std::io::stderr(), "{told}").unwrap();
    assert!(ratio < 1.02, "{told}");
}
