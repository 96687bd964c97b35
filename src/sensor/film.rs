//! `hdrfilm`: size, crop window, pixel format, reconstruction filter, and whether samples beyond the edges count
//! (`sample_border`); plain settings, for the sums themselves are kept by `render`. `specfilm` has a channel for each
//! nested spectrum, named as that is: the integral over wavelength of radiance times that response. It is rendered in
//! bands; R, G and B stand beside its channels unless one of these is called so.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::color::{Bands, Response, Role};
use crate::description::declared::{
    Plugin, Plugins, Row, boolean, choice, integer, nested, string,
};
use crate::description::{Kind, Properties};
use crate::error::{Error, Result};
use crate::family;
use crate::filter::{Filter, MAX_RADIUS};
use crate::texture::Palette;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Window {
    /// Left edge.
    pub x: u32,
    /// Upper edge.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl Window {
    /// Whether `other` lies inside.
    pub fn contains(&self, other: &Self) -> bool {
        let end = |start: u32, size: u32| u64::from(start) + u64::from(size);
        other.x >= self.x
            && other.y >= self.y
            && end(other.x, other.width) <= end(self.x, self.width)
            && end(other.y, other.height) <= end(self.y, self.height)
    }

    /// Grown by `border` pixels to each side, but not beyond `limit`.
    #[must_use]
    pub fn grown(&self, border: u32, limit: &Self) -> Self {
        let (x, y) = (
            self.x.saturating_sub(border).max(limit.x),
            self.y.saturating_sub(border).max(limit.y),
        );
        let right = (self.x + self.width + border).min(limit.x + limit.width);
        let bottom = (self.y + self.height + border).min(limit.y + limit.height);
        Self {
            x,
            y,
            width: right.saturating_sub(x),
            height: bottom.saturating_sub(y),
        }
    }
}

/// In which terms colours are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Coordinates {
    /// R, G, B: linear BT.709.
    Rgb,
    /// Y alone: luminance.
    Luminance,
    /// X, Y, Z: the CIE's of 1931.
    Xyz,
    /// Nothing beside other channels.
    None,
}

impl Coordinates {
    /// The names of the channels.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Rgb => &["R", "G", "B"],
            Self::Luminance => &["Y"],
            Self::Xyz => &["X", "Y", "Z"],
            Self::None => &[],
        }
    }
}

/// Which channels the image gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PixelFormat {
    /// Those of colours.
    pub colors: Coordinates,
    /// Whether opacity follows, as A.
    pub alpha: bool,
}

impl PixelFormat {
    /// R, G, B.
    pub const RGB: Self = Self::new(Coordinates::Rgb, false);

    /// All, as scene files name them.
    const NAMED: [(&str, Self); 6] = [
        ("luminance", Self::new(Coordinates::Luminance, false)),
        ("luminance_alpha", Self::new(Coordinates::Luminance, true)),
        ("rgb", Self::RGB),
        ("rgba", Self::new(Coordinates::Rgb, true)),
        ("xyz", Self::new(Coordinates::Xyz, false)),
        ("xyza", Self::new(Coordinates::Xyz, true)),
    ];

    /// The names of the channels.
    pub fn channels(self) -> impl Iterator<Item = &'static str> {
        let colors = self.colors.channels().iter().copied();
        colors.chain(self.alpha.then_some("A"))
    }

    const fn new(colors: Coordinates, alpha: bool) -> Self {
        Self { colors, alpha }
    }

    /// Red, green and blue, unless one of a film's own channels is called so.
    fn beside(responses: &[Response]) -> Self {
        let taken = |name: &str| matches!(name, "R" | "G" | "B" | "A");
        match responses.iter().any(|response| taken(&response.name)) {
            true => Self::new(Coordinates::None, false),
            false => Self::RGB,
        }
    }

    fn build(properties: &Properties<'_>) -> Result<Self> {
        let name = properties.choice("pixel_format")?;
        let format = Self::NAMED.iter().find(|(known, _)| *known == name);
        Ok(format.expect("every choice is a format").1)
    }
}

/// The film's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Film {
    /// Pixels across the full film.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The part that is rendered.
    pub crop: Window,
    /// Channels.
    pub pixel_format: PixelFormat,
    /// How samples reach pixels.
    pub filter: Filter,
    /// Whether samples that lie beyond the film's edges count as far as the filter reaches.
    pub sample_border: bool,
    /// The channels of a `specfilm`; none of another film. Sums that are kept are of them already.
    #[serde(skip)]
    pub responses: Arc<[Response]>,
}

impl Default for Film {
    /// Mitsuba's: 768 × 576.
    fn default() -> Self {
        let (width, height) = (768, 576);
        let crop = Window {
            x: 0,
            y: 0,
            width,
            height,
        };
        Self {
            width,
            height,
            crop,
            pixel_format: PixelFormat::RGB,
            filter: Filter::default(),
            sample_border: false,
            responses: Arc::default(),
        }
    }
}

/// The most pixels along one side.
const MAX_SIDE: f64 = 65536.0;

/// The film plugins.
pub const FILMS: Plugins = &[("hdrfilm", &HDRFILM), ("specfilm", &SPECFILM)];

const HDRFILM: Plugin = Plugin {
    about: "linear pixels of unlimited range; what is written follows from the output's name",
    properties: &[
        COMMON,
        &[
            choice(
                "pixel_format",
                &["rgb", "rgba", "luminance", "luminance_alpha", "xyz", "xyza"],
                "which channels the image has",
            ),
            string("file_format", "openexr", "how Mitsuba writes its file").without_effect(),
            string("component_format", "float16", "how Mitsuba writes its file").without_effect(),
            boolean("banner", true, "how Mitsuba writes its file").without_effect(),
        ],
    ],
};

const SPECFILM: Plugin = Plugin {
    about: "a channel for each response curve; rendered in bands",
    properties: &[
        COMMON,
        &[
            string("component_format", "float32", "how Mitsuba writes its file").without_effect(),
            nested(
                Kind::Spectrum,
                "a response, one or more; their names are the channels'",
            ),
            nested(
                Kind::Texture,
                "a response, one or more; their names are the channels'",
            ),
        ],
    ],
};

/// What all films read.
const COMMON: &[Row] = &[
    integer("width", 768, "pixels across the full film").between(1.0, MAX_SIDE),
    integer("height", 576, "pixels down the full film").between(1.0, MAX_SIDE),
    integer("crop_offset_x", 0, "left edge of what is rendered").between(0.0, MAX_SIDE),
    integer("crop_offset_y", 0, "upper edge of what is rendered").between(0.0, MAX_SIDE),
    integer("crop_width", 768, "pixels across what is rendered")
        .between(1.0, MAX_SIDE)
        .absent("width"),
    integer("crop_height", 576, "pixels down what is rendered")
        .between(1.0, MAX_SIDE)
        .absent("height"),
    boolean(
        "sample_border",
        false,
        "whether samples beyond the edge count there too",
    ),
    boolean("compensate", false, "how Mitsuba adds samples up").without_effect(),
    nested(Kind::Filter, "how samples reach the pixels around them"),
];

/// The most pixels of a crop.
const MAX_PIXELS: u64 = 1 << 28;

impl Film {
    /// Width over height, of the full film.
    pub fn aspect(&self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }

    /// Whether it is one that [`Film::build`] may have made: what was read from a file need not be.
    pub(crate) fn is_sound(&self) -> bool {
        let Window { width, height, .. } = self.crop;
        let side = |size: u32| (1..=MAX_SIDE as u32).contains(&size);
        let filter = f64::from(self.filter.radius());
        side(self.width)
            && side(self.height)
            && self.full().contains(&self.crop)
            && (1..=MAX_PIXELS).contains(&(u64::from(width) * u64::from(height)))
            && (0.0..=MAX_RADIUS).contains(&filter)
    }

    /// The whole film.
    pub fn full(&self) -> Window {
        Window {
            x: 0,
            y: 0,
            width: self.width,
            height: self.height,
        }
    }

    /// How many pixels beyond each edge are sampled. Where samples are, pixels are counted from the first one of those.
    pub fn margin(&self) -> u32 {
        if self.sample_border {
            self.filter.reach()
        } else {
            0
        }
    }

    /// All that can be sampled: the film with its margin.
    pub fn sampled(&self) -> Window {
        Window {
            x: 0,
            y: 0,
            width: self.width + 2 * self.margin(),
            height: self.height + 2 * self.margin(),
        }
    }

    /// The crop's place in what can be sampled.
    pub fn shown(&self) -> Window {
        Window {
            x: self.crop.x + self.margin(),
            y: self.crop.y + self.margin(),
            ..self.crop
        }
    }

    /// From the film inside a sensor.
    pub fn build(properties: &Properties<'_>) -> Result<Self> {
        let properties = &family::declared(properties, FILMS.iter().copied())?;
        let side = |name| Ok::<_, Error>(properties.integer(name)? as u32);
        let part = |name, whole: u32| -> Result<u32> {
            let given = properties.given::<i64>(name)?;
            Ok(given.map_or(whole, |n| n as u32))
        };
        let (width, height) = (side("width")?, side("height")?);
        let crop = Window {
            x: side("crop_offset_x")?,
            y: side("crop_offset_y")?,
            width: part("crop_width", width)?,
            height: part("crop_height", height)?,
        };
        let full = Window {
            x: 0,
            y: 0,
            width,
            height,
        };
        if !full.contains(&crop) {
            let message = format!(
                "the crop of {} × {} at ({}, {}) leaves the film of {width} × {height}",
                crop.width, crop.height, crop.x, crop.y
            );
            let name = if properties.has("crop_width") {
                "crop_width"
            } else {
                "crop_offset_x"
            };
            return Err(properties.error(name, message));
        }
        if u64::from(crop.width) * u64::from(crop.height) > MAX_PIXELS {
            let message = format!(
                "{} × {} pixels are too many to hold",
                crop.width, crop.height
            );
            return Err(properties
                .error("width", message)
                .help("render it in crops"));
        }
        let responses = match properties.plugin() {
            "specfilm" => responses(properties)?,
            _ => Vec::new(),
        };
        let pixel_format = match properties.plugin() {
            "specfilm" => PixelFormat::beside(&responses),
            _ => PixelFormat::build(properties)?,
        };
        let filter = match properties.child(Kind::Filter)? {
            Some(child) => Filter::build(&child, &())?,
            None => Filter::default(),
        };
        Ok(Self {
            width,
            height,
            crop,
            pixel_format,
            filter,
            sample_border: properties.boolean("sample_border")?,
            responses: responses.into(),
        })
    }
}

/// The response curves of a `specfilm`, in file order.
fn responses(properties: &Properties<'_>) -> Result<Vec<Response>> {
    let visible = Bands::<1>::visible(1).expect("one band is possible");
    let palette = Palette::new(visible);
    let mut responses: Vec<Response> = Vec::new();
    for property in properties.all() {
        let Some(spectrum) = palette.spectrum(properties, property, Role::Quantity)? else {
            continue;
        };
        let located = |message| Error::input(message).at(&property.location);
        if spectrum.least() < 0.0 {
            return Err(located(format!(
                "a response cannot be negative, and {:?} is",
                property.name
            )));
        }
        let id = properties.held(property).and_then(|child| child.id());
        let name = match (property.name.as_str(), id) {
            ("", Some(id)) => id.to_owned(),
            ("", None) => format!("response_{}", responses.len()),
            (name, _) => name.to_owned(),
        };
        if responses.iter().any(|other| other.name == name) {
            return Err(located(format!("two responses are called {name:?}")));
        }
        responses.push(Response { name, spectrum });
    }
    if responses.is_empty() {
        let error = properties.error("", "specfilm needs a response curve for each channel");
        return Err(error.help(r#"such as <spectrum name="red" value="550:0, 600:1, 650:0"/>"#));
    }
    Ok(responses)
}
