//! Some lines of an OBJ file, understood without the others: what is defined in them, and the faces, whose indices
//! are known from 0 as soon as it is known how much stands before the lines. So pieces are read in parallel.

use glam::{DVec3, Vec2, Vec3};

use crate::mesh::mtl::keyword;

/// What a line gives, or what is wrong with it, in words.
pub(super) type OfLine<T> = std::result::Result<T, String>;

/// No vertex, or no index in a corner.
pub(super) const NONE: u32 = u32::MAX;

/// How many `v`, `vt` and `vn` lines there are.
pub(super) type Counts = [usize; 3];

/// Of a vertex without a colour.
pub(super) const NO_COLOR: Vec3 = Vec3::NAN;

/// See the module.
#[derive(Default)]
pub(super) struct Piece {
    /// What stands before it.
    before: Counts,
    /// What is subtracted from positions.
    origin: DVec3,
    pub(super) positions: Vec<Vec3>,
    /// Of the first positions, `NO_COLOR` where one has none. Empty: no position has one.
    pub(super) colors: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
    /// Position, uv and normal of the corners of all faces, `NONE` where a corner has none.
    pub(super) corners: Vec<[u32; 3]>,
    /// How many corners each face has.
    pub(super) faces: Vec<u32>,
    /// What the `mtllib` lines name.
    pub(super) libraries: Vec<Vec<u8>>,
    /// What the `usemtl` lines name, and how many faces stand before them.
    pub(super) uses: Vec<(usize, Vec<u8>)>,
    pub(super) left_out: LeftOut,
    /// Where a line that is wrong begins, and what is wrong. What follows it was not read.
    pub(super) wrong: Option<(usize, String)>,
}

/// How many elements there are that make no triangles.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LeftOut {
    /// `l` and `p`.
    pub(super) lines_and_points: usize,
    /// `curv`, `curv2` and `surf`.
    pub(super) free_forms: usize,
}

/// What the lines of a piece define.
pub(super) fn counts(lines: &[u8]) -> Counts {
    let mut counts = Counts::default();
    for line in lines.split(|&b| b == b'\n') {
        let kind = match line.trim_ascii_start() {
            [b'v' | b'V', b, ..] if b.is_ascii_whitespace() => 0,
            [b'v' | b'V', b't' | b'T', b, ..] if b.is_ascii_whitespace() => 1,
            [b'v' | b'V', b'n' | b'N', b, ..] if b.is_ascii_whitespace() => 2,
            // Also a bare "v", which is wrong.
            _ => continue,
        };
        counts[kind] += 1;
    }
    counts
}

impl Piece {
    /// Bytes of what was read.
    pub(super) fn bytes(&self) -> usize {
        let vectors = self.positions.len() + self.colors.len() + self.normals.len();
        vectors * size_of::<Vec3>()
            + self.uvs.len() * size_of::<Vec2>()
            + self.corners.len() * size_of::<[u32; 3]>()
            + self.faces.len() * size_of::<[u32; 4]>()
            + (self.uses.len() + self.libraries.len()) * 2 * size_of::<(usize, Vec<u8>)>()
    }

    /// Reads the `lines` that stand behind so many others. `origin` is subtracted from positions.
    pub(super) fn read(lines: &[u8], before: Counts, origin: DVec3) -> Self {
        let mut piece = Self {
            before,
            origin,
            ..Self::default()
        };
        let mut start = 0;
        for line in lines.split(|&b| b == b'\n') {
            if let Err(message) = piece.line(line) {
                piece.wrong = Some((start, message));
                break;
            }
            start += line.len() + 1;
        }
        piece
    }

    /// How much is defined up to here.
    fn defined(&self) -> Counts {
        let here = [self.positions.len(), self.uvs.len(), self.normals.len()];
        [0, 1, 2].map(|i| self.before[i] + here[i])
    }

    fn line(&mut self, line: &[u8]) -> OfLine<()> {
        let mut words = Words(line);
        match words.next() {
            Some([b'v' | b'V']) => {
                let position = if self.origin == DVec3::ZERO {
                    Vec3::from_array(numbers(&mut words, 3)?)
                } else {
                    let position = numbers_by(&mut words, 3, |_| None)?;
                    (DVec3::from_array(position) - self.origin).as_vec3()
                };
                new_index(self.defined()[0])?;
                if let Some(color) = color(words) {
                    self.colors.resize(self.positions.len(), NO_COLOR);
                    self.colors.push(color);
                }
                self.positions.push(position);
            }
            Some([b'v' | b'V', b't' | b'T']) => {
                let [u, v, _] = numbers(&mut words, 1)?;
                self.uvs.push(Vec2::new(u, v));
            }
            Some([b'v' | b'V', b'n' | b'N']) => {
                let normal = numbers(&mut words, 3)?;
                self.normals.push(Vec3::from_array(normal));
            }
            Some([b'f' | b'F']) => return self.face(words),
            Some(word) if word.eq_ignore_ascii_case(b"mtllib") => {
                self.libraries.push(keyword(line).1.to_vec())
            }
            Some(word) if word.eq_ignore_ascii_case(b"usemtl") => {
                let name = keyword(line).1.to_vec();
                self.uses.push((self.faces.len(), name));
            }
            Some(word) => self.left_out.note(word),
            None => {}
        }
        Ok(())
    }

    fn face(&mut self, words: Words<'_>) -> OfLine<()> {
        let defined = self.defined();
        let mut corners = 0;
        for word in words.take_while(|w| w[0] != b'#') {
            self.corners.push(corner(word, &defined)?);
            corners += 1;
        }
        self.faces.push(corners);
        Ok(())
    }
}

impl LeftOut {
    /// Notes a line that begins with `word`, if it is an element.
    fn note(&mut self, word: &[u8]) {
        let is = |names: &[&str]| {
            let mut names = names.iter();
            names.any(|name| word.eq_ignore_ascii_case(name.as_bytes()))
        };
        self.lines_and_points += usize::from(is(&["l", "p"]));
        self.free_forms += usize::from(is(&["curv", "curv2", "surf"]));
    }

    pub(super) fn add(&mut self, other: Self) {
        self.lines_and_points += other.lines_and_points;
        self.free_forms += other.free_forms;
    }
}

/// The words of a line, none of them empty.
#[derive(Clone)]
struct Words<'a>(&'a [u8]);

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.0.trim_ascii_start();
        let end = rest.iter().position(u8::is_ascii_whitespace);
        let (word, rest) = rest.split_at(end.unwrap_or(rest.len()));
        self.0 = rest;
        (!word.is_empty()).then_some(word)
    }
}

/// The index of one more thing where there are `count`.
pub(super) fn new_index(count: usize) -> OfLine<u32> {
    let index = u32::try_from(count).ok().filter(|&i| i != NONE);
    index.ok_or_else(|| "there are more vertices than 32-bit indices reach".to_owned())
}

/// The colour that three or four numbers after a position say; a single one is a weight.
fn color(words: Words<'_>) -> Option<Vec3> {
    if words.0.is_empty() {
        return None;
    }
    let numbers = words.take_while(|w| w[0] != b'#').map(parse::<f32>);
    let numbers: Vec<Option<f32>> = numbers.take(5).collect();
    match numbers[..] {
        [Some(r), Some(g), Some(b)] | [Some(r), Some(g), Some(b), Some(_)] => {
            Some(Vec3::new(r, g, b)).filter(|color| color.is_finite())
        }
        _ => None,
    }
}

/// The first three of `words` as numbers, of which `least` must be there.
fn numbers(words: &mut Words<'_>, least: usize) -> OfLine<[f32; 3]> {
    numbers_by(words, least, decimal)
}

/// The same, where `quick` knows the more common ones.
fn numbers_by<T: Copy + Default + std::str::FromStr>(
    words: &mut Words<'_>,
    least: usize,
    quick: impl Fn(&[u8]) -> Option<T>,
) -> OfLine<[T; 3]> {
    let mut numbers = [T::default(); 3];
    for (i, number) in numbers.iter_mut().enumerate() {
        match words.next().filter(|w| w[0] != b'#') {
            Some(word) => {
                *number = quick(word)
                    .or_else(|| parse(word))
                    .ok_or_else(|| format!("a number is wanted, not {}", shown(word)))?
            }
            None if i < least => {
                return Err(format!("{least} numbers are wanted, and there are {i}"));
            }
            None => break,
        }
    }
    Ok(numbers)
}

/// A number of few digits without an exponent: where digits and power of ten are both exact, their quotient
/// is rounded once, and rightly (Clinger, *How to read floating point numbers accurately*, 1990).
fn decimal(word: &[u8]) -> Option<f32> {
    /// Powers of ten that are exact in single precision.
    const POWERS: [f32; 11] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10];
    /// What can take another digit and stay below 2²⁴.
    const MOST: u32 = 1_677_720;
    let (sign, digits) = match word {
        [b'-', digits @ ..] => (-1.0, digits),
        digits => (1.0, digits),
    };
    let (mut value, mut point) = (0_u32, None);
    for (i, &b) in digits.iter().enumerate() {
        match b {
            b'0'..=b'9' if value <= MOST => value = 10 * value + u32::from(b - b'0'),
            b'.' if point.is_none() => point = Some(i),
            _ => return None,
        }
    }
    let decimals = point.map_or(0, |at| digits.len() - at - 1);
    let count = digits.len() - usize::from(point.is_some());
    let power = POWERS.get(decimals).filter(|_| count > 0)?;
    Some(sign * (value as f32 / power))
}

/// The indices that `v`, `v/vt`, `v//vn` or `v/vt/vn` name, from 0, where so much is defined.
fn corner(word: &[u8], defined: &Counts) -> OfLine<[u32; 3]> {
    const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];
    let mut corner = [NONE; 3];
    let mut parts = word.split(|&b| b == b'/');
    for (i, (kind, count)) in KINDS.into_iter().zip(defined).enumerate() {
        match parts.next() {
            None => break,
            Some([]) if i > 0 => {}
            Some(part) => corner[i] = index(part, *count, kind, word)?,
        }
    }
    match parts.next() {
        None => Ok(corner),
        Some(_) => Err(malformed(word)),
    }
}

/// The index from 0 that `part` of `word` says, of `count` things called `kind`.
fn index(part: &[u8], count: usize, kind: &str, word: &[u8]) -> OfLine<u32> {
    let said: i64 = whole(part)
        .or_else(|| parse(part))
        .ok_or_else(|| malformed(word))?;
    let length = i64::try_from(count).unwrap_or(i64::MAX);
    let index = if said > 0 {
        said - 1
    } else {
        said.saturating_add(length)
    };
    if said == 0 || !(0..length).contains(&index) {
        return Err(format!(
            "{kind} {said} is out of range; {count} stand before this line"
        ));
    }
    u32::try_from(index)
        .ok()
        .filter(|&i| i != NONE)
        .ok_or_else(|| format!("{kind} {said} is beyond 32 bits"))
}

/// A number of a few digits and nothing else.
fn whole(part: &[u8]) -> Option<i64> {
    if !(1..=18).contains(&part.len()) {
        return None;
    }
    let mut value = 0;
    for b in part {
        match b {
            b'0'..=b'9' => value = 10 * value + i64::from(b - b'0'),
            _ => return None,
        }
    }
    Some(value)
}

fn malformed(word: &[u8]) -> String {
    format!(
        "a corner is wanted, such as 1 or 1/2/3, not {}",
        shown(word)
    )
}

fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

pub(super) fn shown(word: &[u8]) -> String {
    format!("{:?}", String::from_utf8_lossy(&word[..word.len().min(32)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_decimals_are_what_the_standard_library_makes_of_them() {
        let mut bits = 1_u64;
        let mut short = 0;
        for i in 0..200_000 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(i);
            let value = (bits >> 40) as i64 - (1 << 23);
            let text = format!("{value:09}");
            let at = (bits % 12) as usize;
            let text = if at < text.len() {
                format!("{}.{}", &text[..at], &text[at..])
            } else {
                text
            };
            let ours = decimal(text.as_bytes());
            short += usize::from(ours.is_some());
            if let Some(ours) = ours {
                let theirs: f32 = text.parse().unwrap();
                assert_eq!(ours.to_bits(), theirs.to_bits(), "{text}");
            }
        }
        assert!(short > 100_000, "{short}");
        for text in [
            "", "-", ".", "-.", "1e5", "+1", "1.2.3", "99999999", "0x1", "--1",
        ] {
            assert_eq!(decimal(text.as_bytes()), None, "{text}");
        }
        assert_eq!(decimal(b"-0").map(f32::to_bits), Some((-0.0_f32).to_bits()));
    }
}
