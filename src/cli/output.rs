//! Where results go: patterns for the names of output files, and lines on standard output.

use std::collections::{HashMap, HashSet};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use etendue::error::{Error, Result};
use etendue::image::Image;
use etendue::{file, image, render};
use serde_json::Value;

/// What the placeholders of a pattern stand for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Names<'a> {
    /// The input; `{name}` is its name without folder and extension.
    pub(super) input: &'a Path,
    /// `{frame}`, or `{frame:04}` with leading zeros; 0 where there are no frames.
    pub(super) frame: i64,
    /// `{sensor}`: the sensor's id, or its number.
    pub(super) sensor: &'a str,
    /// `{eye}`, where there are two.
    pub(super) eye: Option<&'a str>,
}

const PLACEHOLDERS: &str =
    "there are {name}, {frame}, {frame:04}, {sensor} and, with --stereo, {eye}";

impl Names<'_> {
    /// The output file that `pattern` means. Braces around anything but a word stay as they are.
    pub(super) fn expand(&self, pattern: &str) -> Result<PathBuf> {
        let mut out = String::new();
        let mut rest = pattern;
        while let Some(open) = rest.find('{') {
            let (before, after) = rest.split_at(open);
            out.push_str(before);
            let close = after.find('}').filter(|end| is_word(&after[1..*end]));
            let Some(close) = close else {
                out.push('{');
                rest = &after[1..];
                continue;
            };
            out.push_str(&self.value(&after[1..close]).ok_or_else(|| {
                Error::input(format!("unknown {} in {pattern:?}", &after[..=close]))
                    .help(PLACEHOLDERS)
            })?);
            rest = &after[close + 1..];
        }
        out.push_str(rest);
        Ok(PathBuf::from(out))
    }

    fn value(&self, placeholder: &str) -> Option<String> {
        let stem = self.input.file_stem().unwrap_or_default();
        match placeholder {
            "name" => Some(stem.to_string_lossy().into_owned()),
            // An id may hold anything, a file's name may not.
            "sensor" => Some(self.sensor.replace(['/', '\\'], "_")),
            "eye" => self.eye.map(str::to_owned),
            other => frame(other, self.frame),
        }
    }
}

/// What may be meant as a placeholder.
fn is_word(text: &str) -> bool {
    let name = text.split(':').next().unwrap_or_default();
    !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_')
}

/// The number for `frame` and `frame:04`.
fn frame(placeholder: &str, number: i64) -> Option<String> {
    const WIDEST: usize = 20;
    if placeholder == "frame" {
        return Some(number.to_string());
    }
    let width = placeholder.strip_prefix("frame:0")?.parse().ok();
    width
        .filter(|w| *w <= WIDEST)
        .map(|width: usize| format!("{number:0width$}"))
}

/// `{frame}` and `{frame:04}` in a text; other braces stay.
pub(super) fn with_frame(text: &str, number: i64) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(open) = rest.find('{') {
        let (before, after) = rest.split_at(open);
        out.push_str(before);
        let found = after
            .find('}')
            .and_then(|close| Some((close, frame(&after[1..close], number)?)));
        let (text, end) = match &found {
            Some((close, number)) => (number.as_str(), close + 1),
            None => ("{", 1),
        };
        out.push_str(text);
        rest = &after[end..];
    }
    out.push_str(rest);
    out
}

/// Refuses names that two images would share; `help` says how to tell them apart.
pub(super) fn check_distinct<'a>(
    outputs: impl IntoIterator<Item = (&'a Path, String)>,
    help: &str,
) -> Result<()> {
    let mut seen: HashMap<&Path, String> = HashMap::new();
    for (output, what) in outputs {
        if let Some(other) = seen.get(output) {
            let output = output.display();
            let message = format!("{other} and {what} would both be written to {output}");
            return Err(Error::input(message).help(help));
        }
        seen.insert(output, what);
    }
    Ok(())
}

/// Finds out before rendering what would stop the images from being written. New files are tried once a
/// folder and extension.
pub(super) fn check_writable<'a>(outputs: impl Iterator<Item = &'a Path>) -> Result<()> {
    let mut tried = HashSet::new();
    for output in outputs {
        if tried.insert((output.parent(), output.extension())) || output.exists() {
            match render::is_part(output) {
                true => render::check_part_writable(output)?,
                false => image::check_writable(output)?,
            }
        }
    }
    Ok(())
}

/// Why standard output could not be written, once it could not.
static FAILED: OnceLock<io::Error> = OnceLock::new();

/// A line on standard output. A reader that has gone away is no error of ours; what else goes wrong is told by
/// [`failure`].
pub(super) fn line(text: &str) {
    match writeln!(io::stdout(), "{text}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            // The first of them is the one that is told.
            let _ = FAILED.set(error);
        }
        _ => {}
    }
}

/// A line on an image that was written.
pub(super) fn written(output: &Path, image: &Image) {
    line(&format!(
        "{}: {}×{} pixels",
        output.display(),
        image.width(),
        image.height()
    ));
}

/// The version of what is printed for programs: it changes where a name that was there changes its meaning or goes.
const FORMAT: u32 = 1;

/// An object for programs, which says the version of its names, if it has none of its own.
pub(super) fn formatted(mut object: Value) -> Value {
    if object["format"].is_null() {
        object["format"] = FORMAT.into();
    }
    object
}

/// An object for programs as a line on standard output.
pub(super) fn object(object: Value) {
    line(&formatted(object).to_string());
}

/// A line on standard error, whose reader may have gone away.
pub(super) fn note(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// What went wrong with standard output, if anything did.
pub(super) fn failure() -> Option<Error> {
    let path = Path::new("standard output");
    FAILED.get().map(|e| Error::system("write", path, e))
}

/// Writes a drawing; its name ends in `.svg`.
pub(super) fn write_svg(path: &Path, svg: &str) -> Result<()> {
    if path
        .extension()
        .is_none_or(|e| !e.eq_ignore_ascii_case("svg"))
    {
        let error = Error::input(format!("a drawing cannot be stored as {}", path.display()));
        return Err(error.help("use .svg"));
    }
    file::write_atomically(path, svg.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Names<'static> {
        Names {
            input: Path::new("scenes/box.xml"),
            frame: 7,
            sensor: "front/left",
            eye: Some("left"),
        }
    }

    #[test]
    fn placeholders_become_what_they_stand_for_and_other_braces_stay() {
        for (pattern, expected) in [
            ("out/{name}.exr", "out/box.exr"),
            ("{name}-{frame:04}-{frame}.png", "box-0007-7.png"),
            ("{sensor}.png", "front_left.png"),
            ("{name}.{eye}.png", "box.left.png"),
            ("a{}b{ c}.png", "a{}b{ c}.png"),
            ("{{name}}.png", "{box}.png"),
            ("open{.png", "open{.png"),
        ] {
            assert_eq!(
                names().expand(pattern).unwrap(),
                Path::new(expected),
                "{pattern}"
            );
        }
    }

    #[test]
    fn an_unknown_placeholder_names_the_known_ones() {
        for pattern in ["{nmae}.exr", "{frame:x}.exr", "{frame:099}.exr"] {
            let error = names().expand(pattern).unwrap_err().to_string();
            assert!(error.contains("{frame:04}"), "{pattern}: {error}");
        }
        let one = Names {
            eye: None,
            ..names()
        };
        let error = one.expand("{eye}.png").unwrap_err().to_string();
        assert!(error.contains("with --stereo"), "{error}");
    }

    #[test]
    fn a_definition_takes_the_frame_and_nothing_else() {
        assert_eq!(
            with_frame("m/{frame:03}{name}{frame}{", -5),
            "m/-05{name}-5{"
        );
    }

    #[test]
    fn two_images_of_one_name_are_refused() {
        let (a, b) = (Path::new("a.png"), Path::new("b.png"));
        assert!(check_distinct([(a, "1".into()), (b, "2".into())], "").is_ok());
        let error = check_distinct([(a, "x.xml".into()), (a, "y.xml".into())], "").unwrap_err();
        assert!(error.to_string().starts_with("x.xml and y.xml would both"));
    }
}
