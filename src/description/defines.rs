//! Parameters: `$name` inside an attribute stands for the value given by `-D name=value` or else by
//! `<default name="name" value="…"/>` further up in the file. Where several names fit the longest is
//! meant, and `\$` is a plain dollar sign.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;

use super::report::{CANDIDATES, Report};
use crate::error::{Error, Result};

/// Bytes that all substitutions of a scene together may write.
const MAX_SUBSTITUTED: usize = 64 << 20;

/// The parameters that hold an image's size, as all scenes around Mitsuba call them. Where the command line gives one, the
/// other follows, so that the picture keeps its shape.
const SIDES: [&str; 2] = ["resx", "resy"];

#[derive(Debug, Default)]
pub(super) struct Defines {
    values: BTreeMap<String, Define>,
    /// Names that the file gives a default or asks for.
    known: BTreeSet<String>,
    /// What the file says of [`SIDES`].
    sides: [Option<f64>; 2],
    /// Values that follow from the command line's.
    implied: Vec<(String, String)>,
    substituted: usize,
}

#[derive(Debug)]
struct Define {
    value: String,
    /// Whether it came from the command line.
    given: bool,
    used: bool,
}

impl Defines {
    /// What the command line gives, which somebody must use, and what it offers, which nobody need.
    pub(super) fn new(given: &[(String, String)], offers: &[(String, String)]) -> Self {
        let define = |given: bool| {
            move |(name, value): &(String, String)| {
                let value = value.clone();
                let define = Define {
                    value,
                    given,
                    used: false,
                };
                (name.clone(), define)
            }
        };
        let offers = offers.iter().map(define(false));
        Self {
            values: offers.chain(given.iter().map(define(true))).collect(),
            ..Self::default()
        }
    }

    /// What a `<default>` says; it never overrides.
    pub(super) fn set_default(&mut self, name: &str, value: &str) {
        self.known.insert(name.to_owned());
        self.values
            .entry(name.to_owned())
            .or_insert_with(|| Define {
                value: value.to_owned(),
                given: false,
                used: false,
            });
        if let Some(side) = SIDES.iter().position(|side| *side == name) {
            let length = value.trim().parse().ok().filter(|length| *length > 0.0);
            self.sides[side] = self.sides[side].or(length);
            self.keep_aspect();
        }
    }

    /// Where the file has both sides and the command line gives one of them, the other follows.
    fn keep_aspect(&mut self) {
        let [Some(width), Some(height)] = self.sides else {
            return;
        };
        let given = SIDES.map(|side| {
            let define = self.values.get(side).filter(|define| define.given)?;
            define.value.trim().parse::<f64>().ok()
        });
        let (side, length) = match given {
            [Some(width_given), None] => (1, width_given * height / width),
            [None, Some(height_given)] => (0, height_given * width / height),
            _ => return,
        };
        let length = length.round().max(1.0);
        let other = self
            .values
            .get_mut(SIDES[side])
            .filter(|other| !other.given);
        if let Some(other) = other.filter(|_| length < f64::from(u32::MAX)) {
            other.value = length.to_string();
            self.implied = vec![(SIDES[side].to_owned(), other.value.clone())];
        }
    }

    /// Values of parameters that follow from what the command line gives.
    pub(super) fn implied(&self) -> &[(String, String)] {
        &self.implied
    }

    /// `text` with every parameter replaced; what is put in is not looked at again.
    pub(super) fn substitute<'t>(&mut self, text: &'t str) -> Result<Cow<'t, str>> {
        if !text.contains('$') {
            return Ok(Cow::Borrowed(text));
        }
        let mut out = String::new();
        let mut rest = text;
        while let Some(dollar) = rest.find('$') {
            let (before, after) = (&rest[..dollar], &rest[dollar + 1..]);
            if let Some(before) = before.strip_suffix('\\') {
                out.push_str(before);
                out.push('$');
                rest = after;
                continue;
            }
            out.push_str(before);
            let Some(name) = self.longest_name(after) else {
                self.known.insert(leading_name(after).to_owned());
                return Err(self.undefined(after));
            };
            rest = &after[name.len()..];
            if let Some(define) = self.values.get_mut(&name) {
                define.used = true;
                out.push_str(&define.value);
                self.substituted += define.value.len();
            }
            if self.substituted > MAX_SUBSTITUTED {
                return Err(Error::input(format!(
                    "the parameters' values fill more than {} MiB",
                    MAX_SUBSTITUTED >> 20
                )));
            }
        }
        out.push_str(rest);
        Ok(Cow::Owned(out))
    }

    /// Notes the command line's parameters that nothing used.
    pub(super) fn report_unused(&self, report: &mut Report) {
        let unused = |define: &&Define| define.given && !define.used;
        for (name, _) in self.values.iter().filter(|(_, define)| unused(define)) {
            report.push(if self.known.contains(name) {
                Error::input(format!(
                    "the scene never uses its parameter ${name}, set by -D"
                ))
            } else {
                let known = self.known.iter().take(CANDIDATES).map(String::as_str);
                let error = Error::input(format!(
                    "the scene has no parameter ${name} to be set by -D"
                ));
                let error = error.suggest(name, known.clone());
                if self.known.is_empty() {
                    error.help(
                        "none of its values is a $parameter; options such as --spp and --size replace some, \
                         and the others stand in the file",
                    )
                } else {
                    let names: Vec<String> = known.take(10).map(|n| format!("${n}")).collect();
                    error.help(format!("its parameters are {}", names.join(", ")))
                }
            });
        }
    }

    /// The longest defined name that `text` starts with.
    fn longest_name(&self, text: &str) -> Option<String> {
        let mut prefix = text;
        loop {
            // In sorted order nothing stands between a name and the texts it begins but longer names.
            let (name, _) = self
                .values
                .range::<str, _>((Bound::Unbounded, Bound::Included(prefix)))
                .next_back()?;
            if !name.is_empty() && prefix.starts_with(name.as_str()) {
                return Some(name.clone());
            }
            prefix = common_prefix(prefix, name);
            if prefix.is_empty() {
                return None;
            }
        }
    }

    fn undefined(&self, after: &str) -> Error {
        let name = leading_name(after);
        if name.is_empty() {
            return Error::input("no name after $; write \\$ for a dollar sign");
        }
        Error::input(format!("undefined parameter ${name}"))
            .suggest(
                name,
                self.values.keys().take(CANDIDATES).map(String::as_str),
            )
            .help("give it by -D or by a <default> above this line")
    }
}

fn leading_name(text: &str) -> &str {
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_'));
    &text[..end.unwrap_or(text.len())]
}

fn common_prefix<'t>(a: &'t str, b: &str) -> &'t str {
    let end = a
        .char_indices()
        .zip(b.chars())
        .find(|&((_, x), y)| x != y)
        .map_or(a.len().min(b.len()), |((i, _), _)| i);
    &a[..end]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn defines(names: &[&str]) -> Defines {
        let given: Vec<_> = names
            .iter()
            .map(|n| ((*n).to_owned(), format!("<{n}>")))
            .collect();
        Defines::new(&given, &[])
    }

    #[test]
    fn the_longest_name_that_fits_is_meant() {
        let mut d = defines(&["res", "resx", "resolution", "r", "été"]);
        for (text, expected) in [
            ("$resx", "<resx>"),
            ("$resy", "<res>y"),
            ("$resolute", "<res>olute"),
            ("$rest$r", "<res>t<r>"),
            ("a$été.png", "a<été>.png"),
            ("\\$res and $res", "$res and <res>"),
            ("no parameter", "no parameter"),
        ] {
            assert_eq!(d.substitute(text).unwrap(), expected);
        }
        assert!(d.substitute("$q").is_err());
        assert!(d.substitute("5 $ and more").is_err());
    }

    #[test]
    fn a_default_does_not_override_and_an_unused_parameter_is_named() {
        let mut d = defines(&["spp", "ssp"]);
        d.set_default("spp", "1");
        assert_eq!(d.substitute("$spp").unwrap(), "<spp>");
        let mut report = Report::default();
        d.report_unused(&mut report);
        let message = report.finish().unwrap_err().to_string();
        assert!(message.contains("no parameter $ssp"), "{message}");
        assert!(message.contains("did you mean \"spp\"?"), "{message}");
    }

    #[test]
    fn of_an_image_s_sides_one_follows_from_the_other() {
        let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        let after = |given: &[(&str, &str)], names: [&str; 2]| {
            let given: Vec<_> = given
                .iter()
                .map(|(name, value)| pair(name, value))
                .collect();
            let mut d = Defines::new(&given, &[]);
            for name in names {
                d.set_default(name, if name == "resx" { "400" } else { "300" });
            }
            d.substitute("$resx,$resy")
                .map(Cow::into_owned)
                .unwrap_or_default()
        };
        for names in [["resx", "resy"], ["resy", "resx"]] {
            assert_eq!(after(&[], names), "400,300");
            assert_eq!(after(&[("resx", "200")], names), "200,150");
            assert_eq!(after(&[("resy", "1")], names), "1,1");
            assert_eq!(after(&[("resx", "200"), ("resy", "7")], names), "200,7");
            assert_eq!(after(&[("resx", "wide")], names), "wide,300");
        }
        assert_eq!(after(&[("resx", "200")], ["resx", "spp"]), "");
        let mut d = Defines::new(&[pair("resx", "8")], &[]);
        d.set_default("resx", "4");
        d.set_default("resy", "none");
        assert!(d.implied().is_empty());
        assert_eq!(d.substitute("$resy").unwrap(), "none");
    }

    #[test]
    fn an_offer_comes_before_a_default_and_after_what_is_given_and_need_not_be_used() {
        let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        let offers = [pair("frame", "7"), pair("spp", "1"), pair("unused", "")];
        let mut d = Defines::new(&[pair("spp", "64")], &offers);
        d.set_default("frame", "0");
        assert_eq!(d.substitute("$frame $spp").unwrap(), "7 64");
        let mut report = Report::default();
        d.report_unused(&mut report);
        assert!(report.is_empty());
    }

    #[test]
    fn doubling_a_value_again_and_again_ends_in_an_error() {
        let mut d = Defines::default();
        d.set_default("a0", "0123456789");
        let grown = (0..60).try_for_each(|i| {
            let value = d.substitute(&format!("$a{i}$a{i}"))?.into_owned();
            d.set_default(&format!("a{}", i + 1), &value);
            Ok::<_, Error>(())
        });
        assert!(grown.unwrap_err().to_string().contains("MiB"));
    }
}
