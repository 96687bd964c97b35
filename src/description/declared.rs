//! What plugins declare of their properties: a table beside each `build`, with a row a property. Defaults, ranges and
//! choices stand there and nowhere else: reading a property, "did you mean", `--strict` and the manual of
//! plugins all look into the table.

use std::fmt;

use super::Kind;

/// What a plugin declares of itself; its name and kind are its family's.
#[derive(Debug)]
pub struct Plugin {
    /// What it is, in one line.
    pub about: &'static str,
    /// Its properties, in groups that plugins share.
    pub properties: &'static [&'static [Row]],
}

/// The plugins of a family: names, as scene files write them, and what each declares.
pub type Plugins = &'static [(&'static str, &'static Plugin)];

/// One property that a plugin reads.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// As scene files write it; with `#` at the end, that and a number; empty for nested plugins of any name.
    pub name: &'static str,
    /// What values it can have.
    pub takes: Takes,
    /// What it is where a scene does not say.
    pub preset: Preset,
    /// The numbers that are possible.
    pub range: Range,
    /// What it is for, in one line.
    pub about: &'static str,
    /// Who reads it.
    pub standing: Standing,
}

/// What values a property can have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Takes {
    /// `<boolean>`
    Boolean,
    /// `<integer>`
    Integer,
    /// `<float>`, or an integer.
    Float,
    /// `<string>`
    String,
    /// `<string>`, one of these.
    Choice(&'static [&'static str]),
    /// `<string>`, the name of a file that is there.
    File,
    /// `<point>` or `<vector>`
    Vector,
    /// `<transform>`
    Transform,
    /// `<transform>` or `<animation>`
    Motion,
    /// A number, `<rgb>` or `<spectrum>`.
    Color,
    /// A colour, or a nested texture of colours.
    Texture,
    /// A number, or a nested texture of numbers.
    Number,
    /// A number, or the name of a substance.
    Substance,
    /// The same, or a spectrum.
    Index,
    /// A colour, or a nested volume.
    Volume,
    /// A nested medium.
    Medium,
    /// A nested texture.
    Map,
    /// A nested plugin of that kind, or several.
    Nested(Kind),
}

/// What a property is where a scene does not say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Preset {
    /// The scene has to say.
    Required,
    /// Nothing; these words tell what happens then.
    Absent(&'static str),
    /// A boolean.
    Boolean(bool),
    /// An integer.
    Integer(i64),
    /// A number; of a colour, grey or white light.
    Float(f64),
    /// A string.
    Text(&'static str),
    /// A point or a vector.
    Vector([f64; 3]),
    /// The transform that changes nothing.
    Identity,
}

/// The numbers from `least` to `most`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The smallest.
    pub least: f64,
    /// The greatest.
    pub most: f64,
    /// Whether `least` itself is too small.
    pub above: bool,
}

/// Who reads a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Mitsuba and Étendue.
    Common,
    /// Mitsuba; here it is accepted and changes nothing.
    WithoutEffect,
    /// Étendue alone.
    Own,
}

impl Plugin {
    /// All rows, in order.
    pub fn rows(&self) -> impl Iterator<Item = &'static Row> + use<> {
        self.properties.iter().copied().flatten()
    }

    /// The row of the property called `name`.
    pub fn row(&self, name: &str) -> Option<&'static Row> {
        self.rows().find(|row| row.is_called(name))
    }

    /// The row of nested plugins of that kind, whatever they are called.
    pub fn nested(&self, kind: Kind) -> Option<&'static Row> {
        self.rows()
            .find(|row| row.takes == Takes::Nested(kind) && row.name.is_empty())
    }
}

impl Range {
    /// Every number.
    pub const ANY: Self = Self {
        least: f64::NEG_INFINITY,
        most: f64::INFINITY,
        above: false,
    };

    /// Whether the number is one of them.
    pub fn contains(&self, x: f64) -> bool {
        let low = if self.above {
            x > self.least
        } else {
            x >= self.least
        };
        low && x <= self.most
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { least, most, above } = self;
        match (least.is_finite(), most.is_finite()) {
            (false, false) => f.write_str("any number"),
            (true, false) if *above => write!(f, "above {}", Short(*least)),
            (true, false) => write!(f, "at least {}", Short(*least)),
            (false, true) => write!(f, "at most {}", Short(*most)),
            (true, true) if *above => {
                write!(f, "above {} and at most {}", Short(*least), Short(*most))
            }
            (true, true) => write!(f, "from {} to {}", Short(*least), Short(*most)),
        }
    }
}

/// A number for people: without dozens of zeros.
pub(super) struct Short(pub(super) f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.abs() {
            1e-6..1e12 | 0.0 => write!(f, "{}", self.0),
            _ => write!(f, "{:e}", self.0),
        }
    }
}

impl fmt::Display for Takes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Boolean => f.write_str("boolean"),
            Self::Integer => f.write_str("integer"),
            Self::Float => f.write_str("float"),
            Self::String => f.write_str("string"),
            Self::Choice(choices) => f.write_str(&choices.join(" | ")),
            Self::File => f.write_str("file"),
            Self::Vector => f.write_str("point or vector"),
            Self::Transform => f.write_str("transform"),
            Self::Motion => f.write_str("transform or animation"),
            Self::Color => f.write_str("color"),
            Self::Texture => f.write_str("color or texture"),
            Self::Number => f.write_str("float or texture"),
            Self::Substance => f.write_str("float or substance"),
            Self::Index => f.write_str("float, substance or spectrum"),
            Self::Volume => f.write_str("color or volume"),
            Self::Medium => f.write_str("medium"),
            Self::Map => f.write_str("texture"),
            Self::Nested(kind) => write!(f, "nested {kind}"),
        }
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Required => f.write_str("required"),
            Self::Absent(words) => f.write_str(words),
            Self::Boolean(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            // 1/3 is not seventeen digits to a reader.
            Self::Float(value) => write!(f, "{}", *value as f32),
            Self::Text(value) => f.write_str(value),
            Self::Vector([x, y, z]) => write!(f, "{x}, {y}, {z}"),
            Self::Identity => f.write_str("identity"),
        }
    }
}

impl Row {
    const fn new(name: &'static str, takes: Takes, preset: Preset, about: &'static str) -> Self {
        Self {
            name,
            takes,
            preset,
            range: Range::ANY,
            about,
            standing: Standing::Common,
        }
    }

    /// Whether a property of that name is this one.
    pub fn is_called(&self, name: &str) -> bool {
        match self.name.strip_suffix('#') {
            Some(stem) => name.strip_prefix(stem).is_some_and(|number| {
                !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())
            }),
            None => !self.name.is_empty() && self.name == name,
        }
    }

    /// The same property, which a scene has to give.
    #[must_use]
    pub const fn required(mut self) -> Self {
        self.preset = Preset::Required;
        self
    }

    /// The same property, of which these words tell what happens where a scene does not give it.
    #[must_use]
    pub const fn absent(mut self, words: &'static str) -> Self {
        self.preset = Preset::Absent(words);
        self
    }

    /// The same property, between two numbers.
    #[must_use]
    pub const fn between(mut self, least: f64, most: f64) -> Self {
        self.range = Range {
            least,
            most,
            above: false,
        };
        self
    }

    /// The same property, not below a number.
    #[must_use]
    pub const fn at_least(self, least: f64) -> Self {
        self.between(least, f64::INFINITY)
    }

    /// The same property, above 0.
    #[must_use]
    pub const fn positive(self) -> Self {
        self.above_to(f64::INFINITY)
    }

    /// The same property, above 0 and not above a number.
    #[must_use]
    pub const fn above_to(mut self, most: f64) -> Self {
        self.range = Range {
            least: 0.0,
            most,
            above: true,
        };
        self
    }

    /// The same property, which only Étendue has.
    #[must_use]
    pub const fn own(mut self) -> Self {
        self.standing = Standing::Own;
        self
    }

    /// The same property, which changes nothing here.
    #[must_use]
    pub const fn without_effect(mut self) -> Self {
        self.standing = Standing::WithoutEffect;
        self
    }
}

/// A `<boolean>`.
pub const fn boolean(name: &'static str, preset: bool, about: &'static str) -> Row {
    Row::new(name, Takes::Boolean, Preset::Boolean(preset), about)
}

/// An `<integer>`.
pub const fn integer(name: &'static str, preset: i64, about: &'static str) -> Row {
    Row::new(name, Takes::Integer, Preset::Integer(preset), about)
}

/// A `<float>`.
pub const fn float(name: &'static str, preset: f64, about: &'static str) -> Row {
    Row::new(name, Takes::Float, Preset::Float(preset), about)
}

/// A `<string>`.
pub const fn string(name: &'static str, preset: &'static str, about: &'static str) -> Row {
    Row::new(name, Takes::String, Preset::Text(preset), about)
}

/// A `<string>` that is one of these, the first where a scene does not say.
pub const fn choice(
    name: &'static str,
    choices: &'static [&'static str],
    about: &'static str,
) -> Row {
    Row::new(
        name,
        Takes::Choice(choices),
        Preset::Text(choices[0]),
        about,
    )
}

/// A `<string>` that names a file, which a scene has to give.
pub const fn file(name: &'static str, about: &'static str) -> Row {
    Row::new(name, Takes::File, Preset::Required, about)
}

/// A `<point>` or a `<vector>`.
pub const fn vector(name: &'static str, preset: [f64; 3], about: &'static str) -> Row {
    Row::new(name, Takes::Vector, Preset::Vector(preset), about)
}

/// A `<transform>`.
pub const fn transform(name: &'static str, about: &'static str) -> Row {
    Row::new(name, Takes::Transform, Preset::Identity, about)
}

/// A `<transform>`, or an `<animation>` of several.
pub const fn motion(name: &'static str, about: &'static str) -> Row {
    Row::new(name, Takes::Motion, Preset::Identity, about)
}

/// A colour that is the same everywhere.
pub const fn color(name: &'static str, preset: f64, about: &'static str) -> Row {
    Row::new(name, Takes::Color, Preset::Float(preset), about)
}

/// A colour or a texture.
pub const fn texture(name: &'static str, preset: f64, about: &'static str) -> Row {
    Row::new(name, Takes::Texture, Preset::Float(preset), about)
}

/// A colour or a volume.
pub const fn volume(name: &'static str, preset: f64, about: &'static str) -> Row {
    Row::new(name, Takes::Volume, Preset::Float(preset), about)
}

/// A number or a texture of numbers.
pub const fn number(name: &'static str, preset: f64, about: &'static str) -> Row {
    Row::new(name, Takes::Number, Preset::Float(preset), about)
}

/// An index of refraction: a number or the name of a substance.
pub const fn substance(name: &'static str, preset: &'static str, about: &'static str) -> Row {
    Row::new(name, Takes::Substance, Preset::Text(preset), about)
}

/// The same, or a spectrum.
pub const fn index(name: &'static str, preset: &'static str, about: &'static str) -> Row {
    Row::new(name, Takes::Index, Preset::Text(preset), about)
}

/// A nested medium, or none.
pub const fn medium(name: &'static str, about: &'static str) -> Row {
    Row::new(name, Takes::Medium, Preset::Absent("none"), about)
}

/// A nested texture, which a scene has to give.
pub const fn map(name: &'static str, about: &'static str) -> Row {
    Row::new(name, Takes::Map, Preset::Required, about)
}

/// Nested plugins of that kind, whatever they are called, or none.
pub const fn nested(kind: Kind, about: &'static str) -> Row {
    Row::new("", Takes::Nested(kind), Preset::Absent("none"), about)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_called_by_its_name_or_by_its_stem_and_a_number() {
        let corner = vector("p#", [0.0; 3], "a corner");
        assert!(corner.is_called("p0") && corner.is_called("p12"));
        assert!(!corner.is_called("p") && !corner.is_called("px") && !corner.is_called("q1"));
        let bsdf = nested(Kind::Bsdf, "how it scatters");
        assert!(!bsdf.is_called(""));
        assert!(float("radius", 1.0, "").is_called("radius"));
    }

    #[test]
    fn a_range_says_what_it_contains() {
        let cases = [
            (float("x", 1.0, "").positive(), 0.0, 1e-9, "above 0"),
            (float("x", 1.0, "").at_least(1.0), 0.9, 1.0, "at least 1"),
            (
                float("x", 1.0, "").between(0.0, 1.0),
                1.1,
                1.0,
                "from 0 to 1",
            ),
        ];
        for (row, outside, inside, words) in cases {
            assert!(!row.range.contains(outside) && row.range.contains(inside));
            assert_eq!(row.range.to_string(), words);
        }
        assert!(!Range::ANY.contains(f64::NAN));
    }
}
