//! The text file of curves.

use std::io::Read as _;
use std::path::Path;

use glam::DMat4;

use super::{Basis, Curves};
use crate::description::Properties;
use crate::error::{Error, Location, Problem, Result};

/// What is read, and what is to be said of it.
pub(in crate::shape) struct Text {
    pub(in crate::shape) curves: Curves,
    pub(in crate::shape) warnings: Vec<Problem>,
}

/// The curves of the file `filename`, under `to_world`. Radii stay as they are.
pub(in crate::shape) fn read(
    properties: &Properties<'_>,
    to_world: &DMat4,
    basis: Basis,
) -> Result<Text> {
    let path = properties.file("filename")?;
    let refused = |e: std::io::Error| Error::system("read", &path, &e);
    let file = crate::file::open(&path).map_err(refused)?;
    let length = file.metadata().map_err(refused)?.len();
    let account = properties.budget().open();
    let located = |error: Error| error.at(&Location::of_file(&path));
    // The text, and lists that grow: a line is 8 bytes at least.
    (account.take(length.saturating_mul(4))).map_err(located)?;
    let mut text = Vec::new();
    (file.take(length).read_to_end(&mut text)).map_err(refused)?;
    let read = parse(&text, &path, to_world, basis)?;
    account.keep(read.curves.bytes() as u64);
    Ok(read)
}

/// A file's curves so far.
struct Reader<'a> {
    path: &'a Path,
    basis: Basis,
    curves: Curves,
    /// The first point of the curve that is being read, and its line.
    curve: Option<(usize, u32)>,
}

impl Reader<'_> {
    /// Ends the curve, if there is one.
    fn end(&mut self) -> Result<()> {
        let Some((first, line)) = self.curve.take() else {
            return Ok(());
        };
        let (points, needed) = (self.curves.points.len() - first, self.basis.points);
        if points < needed {
            let name = self.basis.name;
            let message =
                format!("{name} needs {needed} control points or more, and this has {points}");
            let error = Error::input(message).at(&Location::of_line(self.path, line));
            return Err(error.help("an empty line ends a curve"));
        }
        self.curves.begin((points - needed + 1) as u32);
        Ok(())
    }
}

fn parse(text: &[u8], path: &Path, to_world: &DMat4, basis: Basis) -> Result<Text> {
    let mut reader = Reader {
        path,
        basis,
        curves: Curves::new(basis),
        curve: None,
    };
    let (mut longer, mut first_longer) = (0_usize, 0);
    for (line, number) in text.split(|byte| *byte == b'\n').zip(1_u32..) {
        let Some(understood) = understand(line) else {
            let shown = String::from_utf8_lossy(line);
            let shown: String = shown.trim().chars().take(60).collect();
            let error = Error::input(format!("\"{shown}\" is no control point"));
            let error = error.at(&Location::of_line(path, number));
            return Err(error.help("a line is \"x y z radius\", four finite numbers, or empty"));
        };
        let Line::Point { values, more } = understood else {
            reader.end()?;
            continue;
        };
        if more {
            longer += 1;
            first_longer = if longer == 1 { number } else { first_longer };
        }
        let [x, y, z, radius] = values;
        let place = to_world
            .transform_point3(glam::DVec3::new(x, y, z))
            .as_vec3();
        if !place.is_finite() {
            let error = Error::input("the control point is too far away");
            return Err(error.at(&Location::of_line(path, number)));
        }
        let points = &mut reader.curves.points;
        (reader.curve).get_or_insert((points.len(), number));
        points.push(place.extend(radius as f32));
        if points.len() > MOST_POINTS {
            let error = Error::input("the file has more than 2³⁰ control points");
            return Err(error.at(&Location::of_file(path)));
        }
    }
    reader.end()?;
    let mut curves = reader.curves;
    if curves.points.is_empty() {
        let error = Error::input("the file has no control points");
        let error = error.at(&Location::of_file(path));
        return Err(error.help("a line of it is \"x y z radius\""));
    }
    curves.points.shrink_to_fit();
    curves.begun.shrink_to_fit();
    let mut warnings = Vec::new();
    if longer > 0 {
        let message = format!("what follows the fourth number is left out; lines: {longer}");
        let warning = Error::input(message).at(&Location::of_line(path, first_longer));
        warnings.extend_from_slice(warning.problems());
    }
    Ok(Text { curves, warnings })
}

const MOST_POINTS: usize = 1 << 30;

/// What a line holds.
enum Line {
    Nothing,
    Point {
        /// x, y, z and radius.
        values: [f64; 4],
        /// Whether something follows them.
        more: bool,
    },
}

/// `None` where it is neither.
fn understand(line: &[u8]) -> Option<Line> {
    let line = str::from_utf8(line).ok()?;
    let mut words = line.split_ascii_whitespace();
    let Some(first) = words.next() else {
        return Some(Line::Nothing);
    };
    let number = |word: &str| {
        let number: f64 = word.parse().ok()?;
        (number as f32).is_finite().then_some(number)
    };
    let mut values = [number(first)?, 0.0, 0.0, 0.0];
    for value in &mut values[1..] {
        *value = number(words.next()?)?;
    }
    Some(Line::Point {
        values,
        more: words.next().is_some(),
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    const LINES: Basis = Basis {
        points: 2,
        name: "a linear curve",
    };

    fn parsed(text: &str) -> Result<Text> {
        parse(text.as_bytes(), Path::new("a.txt"), &DMat4::IDENTITY, LINES)
    }

    #[test]
    fn empty_lines_part_curves_and_each_has_its_segments() {
        let text = "\n0 0 0 .1\r\n1\t0 0 1e-1 7\n2 0 0 0.1\n  \n\n3 0 0 .2\n4 0 0 .3 and more";
        let Text { curves, warnings } = parsed(text).unwrap();
        assert_eq!([0, 1, 2].map(|segment| curves.first(segment)), [0, 1, 3]);
        assert_eq!(curves.points[4], Vec4::new(4.0, 0.0, 0.0, 0.3));
        assert!([0, 2].into_iter().all(|segment| !curves.follows(segment)));
        assert!(curves.follows(1));
        let said = warnings[0].to_string();
        assert!(
            said.starts_with("a.txt:3: ") && said.ends_with("lines: 2"),
            "{said}"
        );
    }

    /// Curves of one segment and of many, over more than one group of them.
    #[test]
    fn segments_know_their_points() {
        for basis in [2, 4] {
            let mut curves = Curves::new(Basis {
                points: basis,
                name: "a curve",
            });
            let mut firsts = Vec::new();
            let mut points = 0;
            for segments in [1, 63, 64, 1, 200, 2, 1, 1, 130, 1] {
                curves.begin(segments as u32);
                firsts.extend((points..points + segments).map(|first| (first, first > points)));
                points += segments + basis - 1;
            }
            assert_eq!(curves.count() as usize, firsts.len());
            for (segment, (first, follows)) in firsts.into_iter().enumerate() {
                assert_eq!(curves.first(segment as u32), first, "{segment}");
                assert_eq!(curves.follows(segment as u32), follows, "{segment}");
            }
        }
    }

    #[test]
    fn what_is_no_curve_is_named_with_its_line() {
        for (text, expected) in [
            ("", "a.txt: the file has no control points"),
            ("\n \n", "no control points"),
            ("0 0 0 1\n# hi\n", "a.txt:2: \"# hi\" is no control point"),
            ("0 0 0\n", "a.txt:1: \"0 0 0\" is no"),
            ("0 0 0 nan\n", "a.txt:1: "),
            ("0 0 0 1e39\n", "a.txt:1: "),
            ("0,0,0,1\n", "a.txt:1: "),
            (
                "0 0 0 1\n0 0 1 1\n\n0 0 0 1\n",
                "a.txt:4: a linear curve needs 2 control points",
            ),
            ("\u{fffd}\n", "a.txt:1: "),
        ] {
            let said = parsed(text).map(drop).unwrap_err().to_string();
            assert!(said.contains(expected), "{said:?} lacks {expected:?}");
        }
    }
}
