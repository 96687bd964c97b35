//! Problems on standard error, with the line of the file that caused them.

use std::collections::HashMap;
use std::fs;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use etendue::error::{Error, Kind, Location, Problem};

/// The longest line and the largest file that are shown.
const MAX_LINE: usize = 400;
const MAX_FILE: u64 = 16 << 20;

/// Prints an error.
pub(super) fn error(error: &Error) {
    print(error.problems(), Level::ERROR);
}

/// Prints warnings.
pub(super) fn warnings(problems: &[Problem]) {
    print(problems, Level::WARNING);
}

/// Problems for programs: an array of objects.
pub(super) fn json(problems: &[Problem]) -> serde_json::Value {
    problems.iter().map(object).collect()
}

/// A problem for programs.
pub(super) fn object(problem: &Problem) -> serde_json::Value {
    let place = |location: &Location| {
        serde_json::json!({
            "file": location.file.display().to_string(),
            "line": location.line,
            "column": location.column,
        })
    };
    serde_json::json!({
            "kind": match problem.kind {
                Kind::Input => "input",
                Kind::Unsupported => "unsupported",
                Kind::System => "system",
            },
            "message": problem.message,
            "location": problem.location.as_ref().map(place),
            "help": problem.help,
            "related": problem.related.as_ref().map(|(location, what)| {
                serde_json::json!({ "what": what, "location": place(location) })
            }),
    })
}

fn print(problems: &[Problem], level: Level<'static>) {
    let mut stderr = std::io::stderr().lock();
    let renderer = if stderr.is_terminal() {
        Renderer::styled()
    } else {
        Renderer::plain()
    };
    let mut sources = Sources::default();
    for problem in problems {
        let text = sources.of(problem.location.as_ref());
        let rendered = renderer.render(&[group(problem, level.clone(), text.as_deref())]);
        let _ = writeln!(stderr, "{rendered}");
    }
}

fn group<'a>(problem: &'a Problem, level: Level<'a>, text: Option<&'a str>) -> Group<'a> {
    let title = match (&problem.location, text) {
        (Some(location), None) => format!("{location}: {}", problem.message),
        _ => problem.message.clone(),
    };
    let mut group = Group::with_title(level.primary_title(title));
    if let (Some(location), Some(text)) = (&problem.location, text) {
        let start = location.column.saturating_sub(1) as usize;
        let begin = text
            .char_indices()
            .nth(start)
            .map_or(text.len(), |(i, _)| i);
        let end = token_end(text, begin);
        group = group.element(
            Snippet::source(text)
                .path(location.file.display().to_string())
                .line_start(location.line as usize)
                .annotation(AnnotationKind::Primary.span(begin..end)),
        );
    }
    if let Some((location, what)) = &problem.related {
        group = group.element(Level::NOTE.message(format!("{what} is at {location}")));
    }
    if let Some(help) = &problem.help {
        group = group.element(Level::HELP.message(help.clone()));
    }
    group
}

/// The end of the tag, word or line that begins at `begin`.
fn token_end(text: &str, begin: usize) -> usize {
    let rest = &text[begin..];
    if rest.starts_with('<') {
        return rest.find('>').map_or(text.len(), |i| begin + i + 1);
    }
    text.len()
}

/// Lines of files, each file read once.
#[derive(Default)]
struct Sources(HashMap<PathBuf, Option<String>>);

impl Sources {
    /// The line at a place, if it can be shown.
    fn of(&mut self, location: Option<&Location>) -> Option<String> {
        let location = location.filter(|l| l.line > 0)?;
        let text = self
            .0
            .entry(location.file.to_path_buf())
            .or_insert_with_key(|path| read(path));
        let line = text.as_ref()?.lines().nth(location.line as usize - 1)?;
        (line.len() <= MAX_LINE).then(|| line.to_owned())
    }
}

fn read(path: &Path) -> Option<String> {
    let small = fs::metadata(path)
        .ok()
        .is_some_and(|m| m.is_file() && m.len() <= MAX_FILE);
    small.then(|| fs::read_to_string(path).ok())?
}
