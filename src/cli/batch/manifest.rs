//! A manifest: tables of options of `etendue render`, taken apart into the images that they mean.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use etendue::budget::Budget;
use etendue::error::{Error, Location, Result};

use serde::Deserialize;
use toml::{Spanned, Table, Value};

use crate::cli::images::{Images, Item};
use crate::cli::render::{self, Looked};
use crate::cli::stop::Stop;
use crate::cli::{Arguments, Command};

/// Keys that are no options, and those that say what is done with an image's file.
const SCENES: &str = "scenes";
const OUTPUT: &str = "output";
const DEFINE: &str = "define";
/// What batch says itself.
const OURS: &[&str] = &[
    "json",
    "passes",
    "progress",
    "quiet",
    "skip-existing",
    "skip-same",
];
/// The most images of a manifest.
const MOST: usize = 1_000_000;

/// The images of a manifest.
#[derive(Debug)]
pub(super) struct Manifest {
    /// From which files are named.
    pub(super) folder: PathBuf,
    pub(super) units: Vec<Unit>,
    /// What is wrong with single entries.
    pub(super) failed: Vec<Error>,
}

/// An image.
#[derive(Debug)]
pub(super) struct Unit {
    /// The call of the command, without the output.
    pub(super) arguments: Vec<String>,
    pub(super) item: Item,
    /// The entry's options, of all its images.
    parsed: Rc<render::Arguments>,
}

/// The file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(default)]
    defaults: Table,
    images: Vec<Spanned<Table>>,
}

impl Manifest {
    /// Reads a manifest; what is wrong with one entry is kept apart.
    pub(super) fn read(path: &Path, budget: &Budget) -> Result<Self> {
        let text = fs::read_to_string(path).map_err(|e| Error::system("read", path, &e))?;
        let line = |at: usize| 1 + text[..at.min(text.len())].matches('\n').count() as u32;
        let document: Document = toml::from_str(&text).map_err(|error| {
            if text.trim_start().starts_with('<') {
                let error = Error::input("this is XML, and a manifest is TOML");
                let help = "etendue render takes scenes; etendue batch --help shows a manifest";
                return error.at(&Location::of_file(path)).help(help);
            }
            let at = error.span().map_or(0, |span| span.start);
            Error::input(error.message()).at(&Location::of_line(path, line(at)))
        })?;
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let folder = folder
            .canonicalize()
            .map_err(|e| Error::system("read", folder, &e))?;
        let mut manifest = Self {
            folder,
            units: Vec::new(),
            failed: Vec::new(),
        };
        // Files are named from there, by this process and by those that it starts.
        std::env::set_current_dir(&manifest.folder)
            .map_err(|e| Error::system("enter", &manifest.folder, &e))?;
        for entry in &document.images {
            let location = Location::of_line(path, line(entry.span().start));
            let read = Entry::new(&document.defaults, entry.get_ref());
            match read.and_then(|entry| manifest.add(&entry, budget, &location)) {
                Ok(()) => {}
                Err(error) => manifest.failed.push(error.at(&location)),
            }
        }
        let outputs = (manifest.units.iter()).map(|unit| (unit.item.output.as_path(), unit.call()));
        let help = "let {name}, {frame}, {sensor} or a key of the entry, such as {spp}, tell outputs apart";
        crate::cli::output::check_distinct(outputs, help)?;
        Ok(manifest)
    }

    /// Adds the images of an entry.
    fn add(&mut self, entry: &Entry, budget: &Budget, location: &Location) -> Result<()> {
        for scene in &entry.scenes {
            for values in entry.combinations() {
                let output = entry.expand(&entry.output, &values);
                let options: Vec<String> = entry.options(&values).collect();
                let images = parse(scene, &output, &options).and_then(|parsed| {
                    let Images { items, failed } = parsed.images(budget)?;
                    match failed.into_iter().next() {
                        Some((_, error)) => Err(error),
                        None => Ok((Rc::new(parsed), items)),
                    }
                });
                let (parsed, items) = match images {
                    Ok(images) => images,
                    Err(error) => {
                        self.failed.push(error.at(location));
                        continue;
                    }
                };
                for item in items {
                    let mut arguments = vec!["render".to_owned(), scene.clone()];
                    let of_item = |option: &&String| {
                        let of_one = ["--frames=", "--sensor=", "--eye="];
                        !of_one.iter().any(|name| option.starts_with(name))
                    };
                    arguments.extend(options.iter().filter(of_item).cloned());
                    if let Some(frame) = item.frame {
                        arguments.push(format!("--frames={frame}:{}", frame + 1));
                    }
                    if item.sensor > 0 {
                        arguments.push(format!("--sensor={}", item.sensor));
                    }
                    if let Some(eye) = item.eye {
                        arguments.push(format!("--eye={}", eye.name()));
                    }
                    self.units.push(Unit {
                        arguments,
                        item,
                        parsed: Rc::clone(&parsed),
                    });
                    if self.units.len() > MOST {
                        return Err(Error::input(format!("there are more than {MOST} images")));
                    }
                }
            }
        }
        Ok(())
    }

    /// What an image may take, and whether it is there.
    pub(super) fn look(&self, unit: &Unit, budget: Budget, stop: &Stop) -> Result<Looked> {
        render::look(&unit.parsed, &unit.item, budget, stop)
    }
}

impl Unit {
    /// The input with its options.
    fn call(&self) -> String {
        self.arguments[1..].join(" ")
    }

    /// As a shell takes it, with the output.
    pub(super) fn shell(&self) -> String {
        let output = self.item.output.display().to_string();
        let words = ["etendue"]
            .into_iter()
            .chain(self.arguments.iter().map(String::as_str));
        let words = words.chain(["-o", &output, "--skip-same"]);
        words.map(quoted).collect::<Vec<_>>().join(" ")
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    match word.chars().all(plain) && !word.is_empty() {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

/// The arguments of a call, by the same checks as those of the command line.
fn parse(scene: &str, output: &str, options: &[String]) -> Result<render::Arguments> {
    let words = ["etendue", "render", scene, "-o", output].map(OsString::from);
    let options = options.iter().map(OsString::from);
    let words: Vec<OsString> = words.into_iter().chain(options).collect();
    let parsed = Arguments::of(&words).map_err(|error| {
        let text = error.to_string();
        let mut lines = text.lines();
        let what = lines.next().unwrap_or_default();
        let what = what.strip_prefix("error: ").unwrap_or(what);
        let tip = lines.find_map(|line| line.trim().strip_prefix("tip: "));
        let help = "keys are the long options of etendue render: see its --help";
        Error::input(what).help(tip.unwrap_or(help))
    })?;
    match parsed.command {
        Command::Render(arguments) => Ok(*arguments),
        _ => unreachable!("the first word names the command"),
    }
}

/// An entry with the defaults in it. A key has one value, or several for as many images.
#[derive(Debug)]
struct Entry {
    scenes: Vec<String>,
    output: String,
    keys: Vec<Key>,
}

#[derive(Debug)]
struct Key {
    name: String,
    /// Whether it is a parameter of the scene.
    is_define: bool,
    values: Vec<String>,
}

impl Entry {
    fn new(defaults: &Table, entry: &Table) -> Result<Self> {
        let mut table = defaults.clone();
        for (name, value) in entry {
            match (table.get_mut(name), value) {
                (Some(Value::Table(old)), Value::Table(new)) => old.extend(new.clone()),
                _ => {
                    table.insert(name.clone(), value.clone());
                }
            }
        }
        let mut keys = Vec::new();
        let mut take = |name: &str| {
            let value = table.remove(name);
            value.map(|value| texts(name, &value)).transpose()
        };
        let lacks = |name: &str| Error::input(format!("the entry has no {name:?}"));
        let scenes = take(SCENES)?.ok_or_else(|| lacks(SCENES))?;
        if scenes.is_empty() {
            return Err(Error::input("the entry's list of scenes is empty"));
        }
        let outputs = take(OUTPUT)?.ok_or_else(|| lacks(OUTPUT))?;
        let [output] = &outputs[..] else {
            return Err(Error::input("an entry has one output")
                .help("let {name}, {frame}, {sensor} and keys tell its images apart"));
        };
        if let Some(defines) = table.remove(DEFINE) {
            let Value::Table(defines) = defines else {
                return Err(Error::input("define is a table, such as { radius = 2 }"));
            };
            for (name, value) in &defines {
                keys.push(Key {
                    name: name.clone(),
                    is_define: true,
                    values: texts(name, value)?,
                });
            }
        }
        for (name, value) in &table {
            let option = name.replace('_', "-");
            if OURS.contains(&option.as_str()) {
                return Err(Error::input(format!(
                    "{name:?} is said on the command line"
                )));
            }
            keys.push(Key {
                name: option,
                is_define: false,
                values: texts(name, value)?,
            });
        }
        let images = keys.iter().map(|key| key.values.len());
        let images = images.fold(1, usize::saturating_mul);
        if images == 0 || images > MOST {
            let message = format!("the entry has {images} combinations of values");
            return Err(Error::input(message).help("1 to 1000000 are possible"));
        }
        Ok(Self {
            scenes,
            output: output.clone(),
            keys,
        })
    }

    /// A value for each key, all ways; the last key changes first.
    fn combinations(&self) -> impl Iterator<Item = Vec<&str>> {
        let count: usize = self.keys.iter().map(|key| key.values.len()).product();
        (0..count).map(|mut number| {
            let mut values: Vec<&str> = Vec::new();
            for key in self.keys.iter().rev() {
                values.push(&key.values[number % key.values.len()]);
                number /= key.values.len();
            }
            values.reverse();
            values
        })
    }

    /// The options of the call.
    fn options(&self, values: &[&str]) -> impl Iterator<Item = String> {
        let given = self.keys.iter().zip(values);
        given.filter_map(|(key, value)| match (key.is_define, *value) {
            (true, value) => Some(format!("-D{}={value}", key.name)),
            (false, "true") => Some(format!("--{}", key.name)),
            (false, "false") => None,
            (false, value) => Some(format!("--{}={value}", key.name)),
        })
    }

    /// The pattern with the values of keys in it.
    fn expand(&self, pattern: &str, values: &[&str]) -> String {
        let given = self.keys.iter().zip(values);
        given.fold(pattern.to_owned(), |text, (key, value)| {
            text.replace(
                &format!("{{{}}}", key.name),
                &value.replace(['/', '\\'], "_"),
            )
        })
    }
}

/// One value, or those of a list.
fn texts(name: &str, value: &Value) -> Result<Vec<String>> {
    let one = |value: &Value| match value {
        Value::String(text) => Ok(text.clone()),
        Value::Integer(number) => Ok(number.to_string()),
        Value::Float(number) => Ok(number.to_string()),
        Value::Boolean(yes) => Ok(yes.to_string()),
        _ => Err(Error::input(format!(
            "{name:?} is neither text, number, true, false nor a list of these"
        ))),
    };
    match value {
        Value::Array(values) => values.iter().map(one).collect(),
        value => Ok(vec![one(value)?]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(text: &str) -> Entry {
        let defaults: Table = toml::from_str("spp = 4\ndefine = { a = 1 }").unwrap();
        Entry::new(&defaults, &toml::from_str(text).unwrap()).unwrap()
    }

    #[test]
    fn lists_make_all_combinations_and_defaults_hold_where_nothing_else_is_said() {
        let entry = entry(
            "scenes = 's.xml'\noutput = '{a}-{seed}.exr'\nseed = [3, 4]\nstrict = true\nresume = false\n\
             define = { a = [1.5, 'x/y'] }",
        );
        let calls: Vec<String> = entry
            .combinations()
            .map(|values| {
                let options: Vec<String> = entry.options(&values).collect();
                format!(
                    "{} {}",
                    entry.expand(&entry.output, &values),
                    options.join(" ")
                )
            })
            .collect();
        assert_eq!(
            calls,
            [
                "1.5-3.exr -Da=1.5 --seed=3 --spp=4 --strict",
                "1.5-4.exr -Da=1.5 --seed=4 --spp=4 --strict",
                "x_y-3.exr -Da=x/y --seed=3 --spp=4 --strict",
                "x_y-4.exr -Da=x/y --seed=4 --spp=4 --strict",
            ]
        );
    }

    #[test]
    fn words_are_quoted_as_a_shell_wants_them() {
        for (word, expected) in [
            ("a-b.exr", "a-b.exr"),
            ("it's $x", r"'it'\''s $x'"),
            ("", "''"),
        ] {
            assert_eq!(quoted(word), expected);
        }
    }
}
