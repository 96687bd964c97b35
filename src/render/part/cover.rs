//! Whether parts make a whole: their windows tile what is wanted, and the parts of a window have all its passes, each
//! once.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use crate::error::{Error, Problems, Result};
use crate::sensor::Window;

/// What a part is of.
#[derive(Clone, Debug)]
pub(in super::super) struct Piece<'a> {
    pub(in super::super) path: &'a Path,
    pub(in super::super) window: Window,
    pub(in super::super) passes: Range<u32>,
}

/// The parts of each window in the order of their passes, if they make a whole of so many passes over `target`.
pub(in super::super) fn cover<'p, 'a>(
    pieces: &'p [Piece<'a>],
    target: &Window,
    all_passes: u32,
) -> Result<BTreeMap<Window, Vec<&'p Piece<'a>>>> {
    let mut problems = Problems::default();
    let mut windows: BTreeMap<Window, Vec<&Piece<'_>>> = BTreeMap::new();
    for piece in pieces {
        windows.entry(piece.window).or_default().push(piece);
    }
    for (window, pieces) in &mut windows {
        pieces.sort_by_key(|piece| (piece.passes.start, piece.passes.end));
        problems.take(passes(window, pieces, all_passes));
        if !target.contains(window) {
            problems.push(Error::input(format!(
                "{} is of {}, beyond {}",
                pieces[0].path.display(),
                words(window),
                words(target)
            )));
        }
    }
    let firsts: Vec<&Piece<'_>> = windows.values().map(|pieces| pieces[0]).collect();
    for (i, a) in firsts.iter().enumerate() {
        for b in &firsts[..i] {
            if overlap(&a.window, &b.window) {
                problems.push(Error::input(format!(
                    "{} and {} overlap: they are of {} and {}",
                    b.path.display(),
                    a.path.display(),
                    words(&b.window),
                    words(&a.window)
                ))
                .help("crops must not share pixels, unless they are the same and differ in their passes"));
            }
        }
    }
    if problems.is_empty()
        && let Some(missing) = gap(windows.keys(), target)
    {
        problems.push(
            Error::input(format!("no part is of {}", words(&missing)))
                .help("render it, or say which crop of the image the parts make (--crop)"),
        );
    }
    problems.finish()?;
    Ok(windows)
}

/// Whether the parts of a window have each pass once.
fn passes(window: &Window, pieces: &[&Piece<'_>], all: u32) -> Result<()> {
    let mut problems = Problems::default();
    let mut next = 0;
    let mut before: Option<&Piece<'_>> = None;
    let missing = |from: u32, to: u32| {
        let message = format!("passes {from}:{to} of {} are in no part", words(window));
        Error::input(message).help(format!("render them with --passes {from}:{to}"))
    };
    for piece in pieces {
        let Range { start, end } = piece.passes;
        match before {
            Some(before) if start < next => problems.push(Error::input(format!(
                "{} and {} both hold passes {start}:{} of {}",
                before.path.display(),
                piece.path.display(),
                end.min(next),
                words(window)
            ))),
            _ if start > next => problems.push(missing(next, start)),
            _ => {}
        }
        if end > next {
            next = end;
            before = Some(piece);
        }
    }
    if next < all {
        problems.push(missing(next, all));
    }
    problems.finish()
}

fn overlap(a: &Window, b: &Window) -> bool {
    let along = |a: u32, a_size: u32, b: u32, b_size: u32| a < b + b_size && b < a + a_size;
    along(a.x, a.width, b.x, b.width) && along(a.y, a.height, b.y, b.height)
}

/// A part of `target` that none of the windows, which do not overlap, covers: in the first row that lacks something.
fn gap<'a>(windows: impl Iterator<Item = &'a Window> + Clone, target: &Window) -> Option<Window> {
    let mut rows: Vec<u32> = windows
        .clone()
        .flat_map(|w| [w.y, w.y + w.height])
        .collect();
    rows.extend([target.y, target.y + target.height]);
    rows.sort_unstable();
    rows.dedup();
    for rows in rows.windows(2) {
        let (y, height) = (rows[0], rows[1] - rows[0]);
        let in_row = windows.clone().filter(|w| w.y <= y && y < w.y + w.height);
        let mut spans: Vec<[u32; 2]> = in_row.map(|w| [w.x, w.x + w.width]).collect();
        let end = target.x + target.width;
        spans.push([end, end]);
        spans.sort_unstable();
        let mut x = target.x;
        for [from, to] in spans {
            if from > x {
                let width = from - x;
                return Some(Window {
                    x,
                    y,
                    width,
                    height,
                });
            }
            x = x.max(to);
        }
    }
    None
}

/// As `--crop` is written.
fn words(window: &Window) -> String {
    let Window {
        x,
        y,
        width,
        height,
    } = window;
    format!("the crop {x},{y},{width},{height}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window([x, y, width, height]: [u32; 4]) -> Window {
        Window {
            x,
            y,
            width,
            height,
        }
    }

    /// What is wrong with parts of windows and passes, over 8 × 4 pixels and 5 passes.
    fn verdict(parts: &[([u32; 4], Range<u32>)]) -> std::result::Result<(), String> {
        let names: Vec<String> = (0..parts.len()).map(|i| format!("{i}.part")).collect();
        let piece = |(name, (place, passes)): (&'static str, &([u32; 4], Range<u32>))| Piece {
            path: Path::new(name),
            window: window(*place),
            passes: passes.clone(),
        };
        let names = names.into_iter().map(|name| &*name.leak());
        let pieces: Vec<Piece<'_>> = names.zip(parts).map(piece).collect();
        let found = cover(&pieces, &window([0, 0, 8, 4]), 5).map(drop);
        found.map_err(|error| error.to_string())
    }

    #[test]
    fn parts_make_a_whole_or_what_is_wrong_is_named() {
        const LEFT: [u32; 4] = [0, 0, 5, 4];
        const RIGHT: [u32; 4] = [5, 0, 3, 4];
        assert_eq!(verdict(&[([0, 0, 8, 4], 0..5)]), Ok(()));
        assert_eq!(
            verdict(&[(RIGHT, 0..5), (LEFT, 2..5), (LEFT, 0..2)]),
            Ok(())
        );
        for (parts, expected) in [
            (&[(LEFT, 0..5)][..], &["no part is of the crop 5,0,3,4"][..]),
            (
                &[(LEFT, 0..5), ([5, 0, 3, 2], 0..5)],
                &["no part is of the crop 5,2,3,2"],
            ),
            (
                &[(LEFT, 0..2), (LEFT, 3..5), (RIGHT, 1..4)],
                &[
                    "passes 2:3 of the crop 0,0,5,4",
                    "passes 0:1 of the crop 5,0,3,4",
                    "passes 4:5 of the crop 5,0,3,4",
                ],
            ),
            (
                &[(LEFT, 0..3), (LEFT, 2..5), (RIGHT, 0..5)],
                &["0.part and 1.part both hold passes 2:3"],
            ),
            (
                &[(LEFT, 0..5), (LEFT, 1..2), (RIGHT, 0..5)],
                &["0.part and 1.part both hold passes 1:2"],
            ),
            (
                &[(LEFT, 0..5), ([4, 3, 4, 1], 0..5)],
                &["0.part and 1.part overlap"],
            ),
            (
                &[(LEFT, 0..5), ([5, 0, 4, 4], 0..5)],
                &["1.part is of the crop 5,0,4,4, beyond the crop 0,0,8,4"],
            ),
        ] {
            let told = verdict(parts).unwrap_err();
            for part in expected {
                assert!(told.contains(part), "{part}: {told}");
            }
        }
    }
}
