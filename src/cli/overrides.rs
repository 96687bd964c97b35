//! What is said in place of the scene: one set of options for all commands that read scenes, so that the same
//! words mean the same scene to each.

use clap::Args;
use etendue::color::MAX_BANDS;
use etendue::description::Description;
use etendue::error::{Error, Result};
use etendue::render::{self, Colors, Overrides};
use etendue::sensor::Window;

use super::parse;

pub(super) const IMAGE: &str = "The image";

/// Values in place of the scene's.
#[derive(Args, Clone, Debug)]
pub(super) struct ImageArguments {
    /// Samples a pixel, in place of the scene's sample_count; the sampler may round up
    #[arg(long, value_name = "N", value_parser = parse::spp(), help_heading = IMAGE)]
    pub(super) spp: Option<u32>,
    /// Size of the film in pixels
    #[arg(long, value_name = "WxH", value_parser = parse::size, help_heading = IMAGE)]
    size: Option<(u32, u32)>,
    /// Render only this part of the film; equals the same pixels of the full image
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse::crop, help_heading = IMAGE)]
    crop: Option<Window>,
    /// Render N spectral bands over 360-830 nm instead of RGB; the image's RGB is made from them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=MAX_BANDS as i64), help_heading = IMAGE)]
    pub(super) bands: Option<u16>,
    /// Bands from A to B nm; R, G and B are then those of the light in that range
    #[arg(long, value_name = "A,B", value_parser = parse::band_range, requires = "bands", help_heading = IMAGE)]
    pub(super) band_range: Option<[f32; 2]>,
    /// Motion blur: when the shutter is open, in place of the scene's shutter_open and shutter_close: two times, or degrees of a
    /// frame, which is 360. In --frames the times begin with the frame's, its number divided by --fps
    #[arg(long, value_name = "OPEN,CLOSE|DEGREES", value_parser = parse::shutter, allow_hyphen_values = true, help_heading = IMAGE)]
    shutter: Option<parse::Shutter>,
    /// Frames in a unit of the scene's time; of a glTF file's animation that is a second
    ///
    /// [default: 24]
    #[arg(long, value_name = "N", value_parser = parse::positive, help_heading = IMAGE)]
    fps: Option<f64>,
    #[command(flatten)]
    method: MethodArguments,
}

/// Those of them that mean something where size, samples and bands are what is measured.
#[derive(Args, Clone, Debug)]
pub(super) struct MethodArguments {
    /// Integrator, in place of the scene's
    #[arg(long, value_name = "NAME", help_heading = IMAGE)]
    integrator: Option<String>,
    /// The integrator's max_depth: 1 is emission only, 2 direct light, -1 no limit
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = IMAGE)]
    max_depth: Option<i64>,
    /// Sampler, in place of the scene's
    #[arg(long, value_name = "NAME", help_heading = IMAGE)]
    sampler: Option<String>,
    /// Look through this sensor: its number from 0, or its id; "all" is one image each, where images are made or
    /// checked one by one
    #[arg(long, value_name = "N|ID|all", value_parser = |text: &str| Ok::<_, String>(Sensors::from(text)), help_heading = IMAGE)]
    sensor: Option<Sensors>,
}

impl ImageArguments {
    /// What is written into a description.
    pub(super) fn overrides(&self) -> Overrides {
        Overrides {
            spp: self.spp,
            size: self.size,
            crop: self.crop,
            shutter: self.shutter(0),
            ..self.method.overrides()
        }
    }

    /// When the shutter of a frame is open, if that is said.
    pub(super) fn shutter(&self, frame: i64) -> Option<(f64, f64)> {
        Some(self.shutter?.times(frame, self.fps()))
    }

    /// Frames in a unit of time.
    pub(super) fn fps(&self) -> f64 {
        self.fps.unwrap_or(24.0)
    }

    /// Whether that is said.
    pub(super) fn has_fps(&self) -> bool {
        self.fps.is_some()
    }

    /// RGB or bands.
    pub(super) fn colors(&self) -> Colors {
        self.bands.map_or(Colors::Rgb, |n| Colors::Bands {
            count: n.into(),
            range: self.band_range,
        })
    }

    /// Which sensors are meant, if that is said.
    pub(super) fn sensors(&self) -> Option<&Sensors> {
        self.method.sensor.as_ref()
    }

    /// The one sensor that is meant, if that is said: its number or id.
    pub(super) fn sensor(&self) -> Result<Option<String>> {
        self.method.sensor()
    }
}

impl MethodArguments {
    /// What is written into a description.
    pub(super) fn overrides(&self) -> Overrides {
        Overrides {
            sampler: self.sampler.clone(),
            integrator: self.integrator.clone(),
            max_depth: self.max_depth,
            ..Overrides::default()
        }
    }

    /// The one sensor that is meant, if that is said: its number or id.
    pub(super) fn sensor(&self) -> Result<Option<String>> {
        match &self.sensor {
            None => Ok(None),
            Some(Sensors::One(one)) => Ok(Some(one.clone())),
            Some(Sensors::All) => Err(Error::input("one sensor at a time is looked through here")
                .help("name it by its number or id")),
        }
    }
}

/// Which sensors of each scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Sensors {
    All,
    /// A number from 0, or an id.
    One(String),
}

impl From<&str> for Sensors {
    fn from(text: &str) -> Self {
        match text {
            "all" => Self::All,
            one => Self::One(one.to_owned()),
        }
    }
}

/// A sensor of a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct Chosen {
    /// In file order from 0.
    pub(super) number: usize,
    /// Its id, or its number where it has none.
    pub(super) name: String,
}

/// The sensors that are meant, the first where nothing is said. That a scene has none is told by whoever looks
/// through it.
pub(super) fn chosen(description: &Description, wanted: Option<&Sensors>) -> Result<Vec<Chosen>> {
    let names = render::sensor_names(description);
    let sensor = |number: usize| Chosen {
        number,
        name: names.get(number).cloned().unwrap_or_default(),
    };
    Ok(match wanted {
        Some(Sensors::All) if !names.is_empty() => (0..names.len()).map(sensor).collect(),
        Some(Sensors::One(one)) => vec![sensor(render::find_sensor(description, one)?)],
        _ => vec![sensor(0)],
    })
}
