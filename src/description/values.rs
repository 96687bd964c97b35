//! What the value tags hold: booleans, numbers, vectors, colours and spectra, from attributes to a
//! [`Value`]. Numbers in a list are separated by commas or white space; none may be infinite.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::element::Element;
use super::{Spectrum, Value};
use crate::error::{Error, Location, Result};
use crate::file::text::lines;

/// The tags that hold one value.
pub(super) const TAGS: [&str; 8] = [
    "boolean", "integer", "float", "string", "point", "vector", "rgb", "spectrum",
];

/// The value of the tag `element`, one of [`TAGS`]; `read_file` finds and reads the file of a spectrum.
pub(super) fn value(
    element: &Element<'_>,
    strict: bool,
    read_file: impl FnOnce(&str) -> Result<(String, PathBuf)>,
) -> Result<Value> {
    let wrong = |e: Error| e.at(element.attribute_location("value"));
    match element.tag {
        "point" | "vector" => {
            element.only(&["name", "value", "x", "y", "z"])?;
            return Ok(Value::Vector(xyz(element, None)?));
        }
        "spectrum" => {
            element.only(&["name", "value", "filename"])?;
            return Ok(Value::Spectrum(spectrum(element, read_file)?));
        }
        _ => element.only(&["name", "value"])?,
    }
    let text = element.required("value")?;
    match element.tag {
        "boolean" => boolean(text).map(Value::Boolean),
        "integer" => integer(text).map(Value::Integer),
        "float" => number(text.trim()).map(Value::Float),
        "rgb" => rgb(text, strict).map(Value::Rgb),
        _ => Ok(Value::String(text.to_owned())),
    }
    .map_err(wrong)
}

fn boolean(text: &str) -> Result<bool> {
    match text.trim() {
        t if t.eq_ignore_ascii_case("true") => Ok(true),
        t if t.eq_ignore_ascii_case("false") => Ok(false),
        t => Err(Error::input(format!("{} is not a boolean", quoted(t)))
            .help("write \"true\" or \"false\"")),
    }
}

fn integer(text: &str) -> Result<i64> {
    let text = text.trim();
    text.parse()
        .map_err(|_| Error::input(format!("{} is not an integer", quoted(text))))
}

/// A finite number.
pub(super) fn number(text: &str) -> Result<f64> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        Ok(_) => Err(Error::input(format!("{} is not finite", quoted(text)))),
        Err(_) => {
            let error = Error::input(format!("{} is not a number", quoted(text)));
            Err(match meant(text) {
                Some(help) => error.help(help),
                None => error,
            })
        }
    }
}

/// What may help where a number is followed by something else.
fn meant(text: &str) -> Option<&'static str> {
    let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c)))?;
    let (number, rest) = text.split_at(end);
    number.parse::<f64>().ok()?;
    match rest.trim() {
        "%" => Some("write a part of 1: 0.5 for 50 %"),
        "°" | "deg" | "degree" | "degrees" | "rad" => {
            Some("angles are in degrees, and written without a unit")
        }
        "m" | "cm" | "mm" | "km" | "in" | "ft" | "px" | "nm" | "s" | "W" => {
            Some("numbers are written without a unit")
        }
        rest if rest.starts_with(',') => Some("one number is wanted; its decimal point is a point"),
        _ => None,
    }
}

/// The numbers in a list.
pub(super) fn numbers(text: &str) -> Result<Vec<f64>> {
    words(text).map(number).collect()
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_ascii_whitespace())
        .filter(|word| !word.is_empty())
}

/// `text` in quotes, cut where it is long.
fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    match text.char_indices().nth(LONGEST) {
        None => format!("{text:?}"),
        Some((end, _)) => format!("{:?}…", &text[..end]),
    }
}

/// A vector, from `value` (one or three numbers) or from `x`, `y` and `z`, of which those absent are `default` where
/// there is one.
pub(super) fn xyz(element: &Element<'_>, default: Option<f64>) -> Result<DVec3> {
    const AXES: [&str; 3] = ["x", "y", "z"];
    if let Some(text) = element.optional("value") {
        if let Some(axis) = AXES.into_iter().find(|a| element.optional(a).is_some()) {
            return Err(element.attribute_error(
                axis,
                format!(
                    "<{}> takes either \"value\" or \"x\", \"y\", \"z\"",
                    element.tag
                ),
            ));
        }
        return vector(text, true).map_err(|e| e.at(element.attribute_location("value")));
    }
    let mut v = [0.0; 3];
    for (x, axis) in v.iter_mut().zip(AXES) {
        *x = match (element.optional(axis), default) {
            (Some(text), _) => {
                number(text.trim()).map_err(|e| e.at(element.attribute_location(axis)))?
            }
            (None, Some(default)) => default,
            (None, None) => {
                element.required(axis)?;
                0.0
            }
        };
    }
    Ok(v.into())
}

/// A vector of three numbers, or of one that stands for all three where `splat` says so.
pub(super) fn vector(text: &str, splat: bool) -> Result<DVec3> {
    match numbers(text)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        [x] if splat => Ok(DVec3::splat(x)),
        ref other => Err(Error::input(format!(
            "expected {}3 numbers, found {}",
            if splat { "1 or " } else { "" },
            other.len()
        ))),
    }
}

/// Linear sRGB, from one or three numbers; `#rrggbb` (refused where `strict`) is read as 255ths.
fn rgb(text: &str, strict: bool) -> Result<DVec3> {
    let Some(hex) = text.trim().strip_prefix('#') else {
        return vector(text, true);
    };
    if strict {
        return Err(Error::input("Mitsuba 3 has no hexadecimal colours").help("write 3 numbers"));
    }
    match u32::from_str_radix(hex, 16) {
        Ok(n) if hex.len() == 6 && !hex.starts_with('+') => {
            let [_, r, g, b] = n.to_be_bytes();
            Ok(DVec3::new(r.into(), g.into(), b.into()) / 255.0)
        }
        _ => Err(Error::input(format!("{} is not a colour", quoted(text)))
            .help("write #rrggbb or 3 numbers")),
    }
}

fn spectrum(
    element: &Element<'_>,
    read_file: impl FnOnce(&str) -> Result<(String, PathBuf)>,
) -> Result<Spectrum> {
    match (element.optional("value"), element.optional("filename")) {
        (Some(text), None) => {
            listed_spectrum(text).map_err(|e| e.at(element.attribute_location("value")))
        }
        (None, Some(_)) => {
            let (text, path) = read_file(element.filled("filename")?)
                .map_err(|e| e.at(element.attribute_location("filename")))?;
            spectrum_file(&text, &path)
        }
        _ => {
            Err(element.error("<spectrum> takes either \"value\" or \"filename\" (or a \"type\")"))
        }
    }
}

/// One number, or `wavelength:value` pairs.
fn listed_spectrum(text: &str) -> Result<Spectrum> {
    if !text.contains(':') {
        return match numbers(text)?[..] {
            [x] => Ok(Spectrum::Uniform(x)),
            ref other => Err(Error::input(format!(
                "a spectrum is 1 number or wavelength:value pairs, found {} numbers",
                other.len()
            ))
            .help("write <rgb> for a colour")),
        };
    }
    let mut curve = Vec::new();
    for word in words(text) {
        let (wavelength, value) = word.split_once(':').ok_or_else(|| {
            Error::input(format!("{} is not a wavelength:value pair", quoted(word)))
        })?;
        extend(&mut curve, number(wavelength)?, number(value)?)?;
    }
    finished(curve)
}

/// The curve of a text file of lines `wavelength value`, wavelengths increasing; `#` begins a comment. `path` is where errors
/// point.
///
/// # Errors
/// Where a line holds anything else, wavelengths do not increase, or there are less than two.
pub fn spectrum_file(text: &str, path: &Path) -> Result<Spectrum> {
    let mut curve = Vec::new();
    for (line, number) in lines(text.as_bytes()).zip(1..) {
        let line = String::from_utf8_lossy(line);
        let line = line.split('#').next().unwrap_or_default();
        let at_line = |e: Error| e.at(&Location::of_line(path, number));
        match numbers(line).map_err(at_line)?[..] {
            [] => {}
            [wavelength, value] => extend(&mut curve, wavelength, value).map_err(at_line)?,
            _ => return Err(at_line(Error::input("expected a wavelength and a value"))),
        }
    }
    finished(curve).map_err(|e| e.at(&Location::of_file(path)))
}

fn extend(curve: &mut Vec<(f64, f64)>, wavelength: f64, value: f64) -> Result<()> {
    if wavelength <= 0.0 {
        return Err(Error::input(format!(
            "the wavelength {wavelength} is not positive"
        )));
    }
    if let Some(&(last, _)) = curve.last()
        && wavelength <= last
    {
        return Err(Error::input(format!(
            "wavelengths must increase: {wavelength} follows {last}"
        )));
    }
    curve.push((wavelength, value));
    Ok(())
}

fn finished(curve: Vec<(f64, f64)>) -> Result<Spectrum> {
    if curve.len() < 2 {
        return Err(Error::input("a spectrum needs at least 2 wavelengths"));
    }
    Ok(Spectrum::Curve(curve))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spectrum_is_a_number_or_an_increasing_curve() {
        assert_eq!(listed_spectrum(" .5 ").unwrap(), Spectrum::Uniform(0.5));
        assert_eq!(
            listed_spectrum("400:1, 500:2 600.5:-3").unwrap(),
            Spectrum::Curve(vec![(400.0, 1.0), (500.0, 2.0), (600.5, -3.0)])
        );
        for wrong in [
            "",
            "400:1",
            "500:1,400:2",
            "400:1,400:2",
            ".1 .2 .3",
            "400:1 x",
            "0:1 2:1",
            "a:1 2:1",
            "1:nan 2:1",
        ] {
            assert!(listed_spectrum(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_spectrum_file_has_two_columns_and_comments() {
        let path = Path::new("a.spd");
        let text = "# header\n400 1\n\n500, 2 # comment\n";
        assert_eq!(
            spectrum_file(text, path).unwrap(),
            Spectrum::Curve(vec![(400.0, 1.0), (500.0, 2.0)])
        );
        for end in ["\n", "\r\n", "\r"] {
            let text = ["\u{feff}400 1", "500 2", "600 3", ""].join(end);
            let curve = vec![(400.0, 1.0), (500.0, 2.0), (600.0, 3.0)];
            assert_eq!(spectrum_file(&text, path).unwrap(), Spectrum::Curve(curve));
        }
        let error = spectrum_file("400 1\n500 2 3\n", path).unwrap_err();
        assert!(error.to_string().starts_with("a.spd:2: "), "{error}");
    }

    #[test]
    fn a_colour_is_one_number_three_numbers_or_hexadecimal() {
        assert_eq!(rgb("0.25", true).unwrap(), DVec3::splat(0.25));
        assert_eq!(rgb("1 2,3", true).unwrap(), DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(rgb("#ff0033", false).unwrap(), DVec3::new(1.0, 0.0, 0.2));
        assert!(rgb("#ff0033", true).is_err());
        for wrong in [
            "", "1 2", "1 2 3 4", "#ff00", "#+f0033", "#gg0000", "inf", "1e999",
        ] {
            assert!(rgb(wrong, false).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_long_wrong_value_is_cut_in_the_message() {
        let message = number(&"é".repeat(100_000)).unwrap_err().to_string();
        assert!(message.len() < 200, "{}", message.len());
    }
}
