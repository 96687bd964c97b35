//! What can go wrong, and where: every fallible function of the library returns [`Result`], whose
//! [`Error`] holds one or more [`Problem`]s, each with the place in the file that caused it and, where
//! one is known, the way to mend it. The library never prints and never ends the process.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// In place of a file's name.
const COMMAND_LINE: &str = "command line";

/// A place in a file that the user wrote.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Location {
    /// The file, as the user would name it.
    pub file: Arc<Path>,
    /// Line, from 1; 0 where the whole file is meant.
    pub line: u32,
    /// Column in characters, from 1; 0 where the whole line is meant.
    pub column: u32,
}

impl Location {
    /// The whole of `file`.
    pub fn of_file(file: &Path) -> Self {
        Self {
            file: file.into(),
            line: 0,
            column: 0,
        }
    }

    /// What stands in for a file where a value comes from the command line.
    pub fn command_line() -> Self {
        Self::of_file(Path::new(COMMAND_LINE))
    }

    /// Whether a value comes from the command line.
    pub fn is_command_line(&self) -> bool {
        *self.file == *Path::new(COMMAND_LINE)
    }

    /// Line `line` (from 1) of `file`.
    pub fn of_line(file: &Path, line: u32) -> Self {
        Self {
            file: file.into(),
            line,
            column: 0,
        }
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        for n in [self.line, self.column].into_iter().take_while(|&n| n > 0) {
            write!(f, ":{n}")?;
        }
        Ok(())
    }
}

/// Whose turn it is to mend a problem; the command line turns it into an exit status.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The scene, a mesh, an image or an option says something wrong.
    Input,
    /// A valid scene asks for something that Étendue does not have.
    Unsupported,
    /// The file system refused: missing file, no permission, disk full.
    System,
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Whose turn it is.
    pub kind: Kind,
    /// What is wrong, in lower case and without a full stop.
    pub message: String,
    /// Where, if it is somewhere in a file.
    pub location: Option<Location>,
    /// What would be right.
    pub help: Option<String>,
    /// A second place that has to do with it, and what stands there.
    pub related: Option<(Location, String)>,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(location) = &self.location {
            write!(f, "{location}: ")?;
        }
        f.write_str(&self.message)?;
        if let Some((location, what)) = &self.related {
            write!(f, " ({what} at {location})")?;
        }
        if let Some(help) = &self.help {
            write!(f, "; {help}")?;
        }
        Ok(())
    }
}

/// At least one [`Problem`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    problems: Vec<Problem>,
}

/// The library's result.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    fn new(kind: Kind, message: impl Into<String>) -> Self {
        let message = message.into();
        Self {
            problems: vec![Problem {
                kind,
                message,
                location: None,
                help: None,
                related: None,
            }],
        }
    }

    /// Something in the user's input is wrong.
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(Kind::Input, message)
    }

    /// The input is valid but asks for what Étendue lacks.
    pub fn unsupported(message: impl Into<String>) -> Self {
        Self::new(Kind::Unsupported, message)
    }

    /// The file system refused: `doing` ("read", "write") and `path` say what was tried.
    pub fn system(doing: &str, path: &Path, cause: &std::io::Error) -> Self {
        Self::new(
            Kind::System,
            format!("cannot {doing} {}: {cause}", path.display()),
        )
    }

    /// Puts the place to the problems that have none yet.
    #[must_use]
    pub fn at(mut self, location: &Location) -> Self {
        for problem in &mut self.problems {
            problem.location.get_or_insert_with(|| location.clone());
        }
        self
    }

    /// Says where the file is named whose problems these are.
    #[must_use]
    pub fn named_at(mut self, location: &Location) -> Self {
        for problem in &mut self.problems {
            if problem.location.is_none() {
                problem.location = Some(location.clone());
            } else {
                problem
                    .related
                    .get_or_insert_with(|| (location.clone(), "named".to_owned()));
            }
        }
        self
    }

    /// Says how to mend it, where that is not said yet.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        let help = help.into();
        for problem in &mut self.problems {
            problem.help.get_or_insert_with(|| help.clone());
        }
        self
    }

    /// Says `did you mean "…"?` where one of `candidates` is close to `name`.
    #[must_use]
    pub fn suggest<'a>(self, name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Self {
        match closest_name(name, candidates) {
            Some(best) => self.help(format!("did you mean {best:?}?")),
            None => self,
        }
    }

    /// Names a second place, and what stands there.
    #[must_use]
    pub fn related(mut self, location: &Location, what: impl Into<String>) -> Self {
        let what = what.into();
        for problem in &mut self.problems {
            problem.related = Some((location.clone(), what.clone()));
        }
        self
    }

    /// The problems, at least one.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.problems.iter().enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            write!(f, "{problem}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}

/// Gathers problems, so that a user hears of all of them at once.
#[derive(Debug, Default)]
pub struct Problems(Vec<Problem>);

impl Problems {
    /// Adds the problems of `error`; one that is there already (a shared plugin built twice) is not added again.
    pub fn push(&mut self, error: Error) {
        for problem in error.problems {
            if !self.0.contains(&problem) {
                self.0.push(problem);
            }
        }
    }

    /// Adds problems that were found elsewhere.
    pub fn extend(&mut self, problems: Vec<Problem>) {
        if !problems.is_empty() {
            self.push(Error { problems });
        }
    }

    /// The value, or `None` after noting what was wrong.
    pub fn take<T>(&mut self, result: Result<T>) -> Option<T> {
        result.map_err(|e| self.push(e)).ok()
    }

    /// Whether nothing was noted.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// An error where anything was noted.
    pub fn finish(self) -> Result<()> {
        if self.0.is_empty() {
            Ok(())
        } else {
            Err(Error { problems: self.0 })
        }
    }
}

/// The candidate closest to `name` by edit distance (insertions, deletions, substitutions and swaps of
/// neighbours), if at most a third of the name's letters differ; one with which the name begins counts as close.
fn closest_name<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // A name longer than any plugin's or property's is no misspelling, and the table below is quadratic.
    const LONGEST: usize = 64;
    if name.len() > LONGEST {
        return None;
    }
    let allowed = (name.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .filter(|c| c.len() <= LONGEST)
        .map(|c| match c.len() >= 4 && name.starts_with(c) {
            true => (edit_distance(name, c).min(2), c),
            false => (edit_distance(name, c), c),
        })
        .filter(|&(distance, _)| distance <= allowed)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, c)| c)
}

fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (
        a.to_lowercase().chars().collect(),
        b.to_lowercase().chars().collect(),
    );
    let mut d = vec![vec![0; b.len() + 1]; a.len() + 1];
    for (i, row) in d.iter_mut().enumerate() {
        row[0] = i;
    }
    d[0] = (0..=b.len()).collect();
    for i in 1..=a.len() {
        for j in 1..=b.len() {
            let changed = usize::from(a[i - 1] != b[j - 1]);
            let mut best = (d[i - 1][j] + 1)
                .min(d[i][j - 1] + 1)
                .min(d[i - 1][j - 1] + changed);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(d[i - 2][j - 2] + 1);
            }
            d[i][j] = best;
        }
    }
    d[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_name_finds_its_neighbour_and_a_strange_one_none() {
        let names = ["diffuse", "dielectric", "conductor"];
        assert_eq!(closest_name("difuse", names), Some("diffuse"));
        assert_eq!(closest_name("dieletcric", names), Some("dielectric"));
        assert_eq!(closest_name("velvet", names), None);
        assert_eq!(
            closest_name("pathtracer", ["ptracer", "path"]),
            Some("path")
        );
        assert_eq!(closest_name(&"x".repeat(100_000), names), None);
    }

    #[test]
    fn an_error_says_place_message_relation_and_help_on_one_line() {
        let place = Location {
            file: Path::new("scenes/box.xml").into(),
            line: 12,
            column: 9,
        };
        let error = Error::input("unknown bsdf \"difuse\"")
            .at(&place)
            .suggest("difuse", ["diffuse"]);
        assert_eq!(
            error.to_string(),
            "scenes/box.xml:12:9: unknown bsdf \"difuse\"; did you mean \"diffuse\"?"
        );
    }

    #[test]
    fn problems_are_gathered_and_not_repeated() {
        let mut all = Problems::default();
        all.push(Error::input("one"));
        all.push(Error::input("one"));
        all.push(Error::unsupported("two"));
        assert_eq!(all.finish().unwrap_err().problems().len(), 2);
    }
}
