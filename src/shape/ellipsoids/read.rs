//! The PLY file of ellipsoids: its first element has x, y, z, nx, ny, nz first and scale_0 to scale_2 (logarithms) and
//! rot_0 to rot_3 (a quaternion, its real part first) last, all floats. Of what is between them an opacity alone is read.

use std::io::Read as _;
use std::path::Path;

use glam::{DQuat, DVec3};

use super::Ellipsoid;
use crate::budget::Budget;
use crate::error::{Error, Location, Result};

/// Before the first ellipsoid: names of columns, in order.
const FIRST: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];
/// And after what may be between.
const LAST: [&str; 7] = [
    "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
];
/// The least half axis, as in Mitsuba.
const SMALLEST: f64 = 1e-6;
/// A head is not longer.
const LONGEST_HEAD: usize = 1 << 16;

/// How numbers are written.
#[derive(Clone, Copy)]
enum Format {
    Ascii,
    Little,
    Big,
}

/// What the head says.
struct Head {
    format: Format,
    count: usize,
    columns: Vec<String>,
    /// Where the numbers begin.
    end: usize,
}

/// A file's ellipsoids, with their opacity where there is one.
pub(super) fn read(path: &Path, budget: &Budget) -> Result<Vec<(Ellipsoid, Option<f64>)>> {
    let refused = |e: std::io::Error| Error::system("read", path, &e);
    let file = crate::file::open(path).map_err(refused)?;
    let length = file.metadata().map_err(refused)?.len();
    let account = budget.open();
    let located = |error: Error| error.at(&Location::of_file(path));
    // The bytes, and what becomes of them.
    (account.take(length.saturating_mul(4))).map_err(located)?;
    let mut bytes = Vec::new();
    (file.take(length).read_to_end(&mut bytes)).map_err(refused)?;
    let ellipsoids = parse(&bytes).map_err(located)?;
    account.keep((ellipsoids.len() * size_of::<Ellipsoid>()) as u64);
    Ok(ellipsoids)
}

fn parse(bytes: &[u8]) -> Result<Vec<(Ellipsoid, Option<f64>)>> {
    let head = head(bytes)?;
    let width = head.columns.len();
    let body = &bytes[head.end..];
    let numbers: Vec<f32> = match head.format {
        Format::Ascii => {
            let text = str::from_utf8(body).map_err(|_| Error::input("the file is damaged"))?;
            let words = text
                .split_ascii_whitespace()
                .take(head.count.saturating_mul(width));
            let numbers = words.map(|word| word.parse().map_err(|_| word));
            let numbers: std::result::Result<_, _> = numbers.collect();
            numbers.map_err(|word| Error::input(format!("{word:?} is no number")))?
        }
        Format::Little | Format::Big => {
            let (words, _) = body.as_chunks();
            let number = match head.format {
                Format::Big => f32::from_be_bytes,
                _ => f32::from_le_bytes,
            };
            words.iter().map(|word| number(*word)).collect()
        }
    };
    if numbers.len() / width < head.count {
        let (there, count) = (numbers.len() / width, head.count);
        let message = format!("the file promises {count} ellipsoids and has {there}");
        return Err(Error::input(message));
    }
    let gaussian = head.columns.get(6).is_some_and(|name| name == "f_dc_0");
    let opacity = (head.columns.iter()).position(|name| match gaussian {
        true => name == "opacity",
        false => name == "opacities" || name == "opacities_0",
    });
    let rows = numbers.chunks_exact(width).take(head.count);
    let ellipsoids = rows.enumerate().map(|(i, row)| {
        let wide = |i: usize| f64::from(row[i]);
        let last = width - LAST.len();
        let scale = DVec3::new(wide(last), wide(last + 1), wide(last + 2));
        let rotation = DQuat::from_xyzw(
            wide(last + 4),
            wide(last + 5),
            wide(last + 6),
            wide(last + 3),
        );
        let ellipsoid = Ellipsoid {
            center: DVec3::new(wide(0), wide(1), wide(2)),
            axes: scale.map(f64::exp).max(DVec3::splat(SMALLEST)),
            rotation: rotation.normalize(),
        };
        let opacity = opacity.map(|column| match gaussian {
            // Such files hold what a logistic function makes an opacity of.
            true => 1.0 / (1.0 + (-wide(column)).exp()),
            false => wide(column),
        });
        match ellipsoid.is_finite() {
            true => Ok((ellipsoid, opacity)),
            false => Err(Error::input(format!("ellipsoid {i} is not finite"))),
        }
    });
    ellipsoids.collect()
}

fn head(bytes: &[u8]) -> Result<Head> {
    let wrong = |message: String| {
        let columns = "x, y, z, nx, ny, nz, …, scale_0 to scale_2, rot_0 to rot_3";
        Error::input(message).help(format!(
            "a PLY file of ellipsoids has the properties {columns}"
        ))
    };
    let mut format = None;
    let mut count = None;
    let mut columns = Vec::new();
    let mut at = 0;
    let mut elements = 0;
    let mut ended = false;
    while at < bytes.len().min(LONGEST_HEAD) && !ended {
        let length = bytes[at..].iter().position(|byte| *byte == b'\n');
        let Some(length) = length else { break };
        let line = String::from_utf8_lossy(&bytes[at..at + length]).into_owned();
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            ["ply"] if at == 0 => {}
            _ if at == 0 => return Err(wrong("the file is no PLY file".into())),
            ["format", kind, _] => {
                format = match kind {
                    "ascii" => Some(Format::Ascii),
                    "binary_little_endian" => Some(Format::Little),
                    "binary_big_endian" => Some(Format::Big),
                    _ => None,
                };
            }
            ["element", _, number] => {
                elements += 1;
                if elements == 1 {
                    count = number.parse().ok();
                }
            }
            ["property", "float" | "float32", name] if elements == 1 => {
                columns.push(name.to_owned());
            }
            ["property", ..] if elements == 1 => {
                return Err(wrong(format!("{:?} is no float", words.join(" "))));
            }
            ["end_header"] => ended = true,
            _ => {}
        }
        at += length + 1;
    }
    let (Some(format), Some(count), true) = (format, count, ended) else {
        return Err(wrong("the head of the PLY file is damaged".into()));
    };
    let last = columns.len().saturating_sub(LAST.len());
    let fits = columns.len() >= FIRST.len() + LAST.len()
        && columns.iter().zip(FIRST).all(|(a, b)| a == b)
        && columns[last..].iter().zip(LAST).all(|(a, b)| a == b);
    if !fits {
        return Err(wrong("the PLY file holds no ellipsoids".into()));
    }
    Ok(Head {
        format,
        count,
        columns,
        end: at,
    })
}
