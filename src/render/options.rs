//! What the caller of a render decides: settings of the run, and overrides of what the scene says.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use super::plugins::plugins;
use crate::accel::{Build, Method};
use crate::denoise::{ALBEDO, NORMAL};
use crate::description::{Description, Kind, NodeId, Value};
use crate::lanes::Kernel;
use crate::sensor::Window;

/// Which colour model a render uses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Colors {
    /// Linear BT.709.
    #[default]
    Rgb,
    /// Spectral bands.
    Bands {
        /// How many, 1 to [`MAX_BANDS`](crate::color::MAX_BANDS).
        count: usize,
        /// The first and the last wavelength in nm; where absent the visible range, or that of the film's responses.
        range: Option<[f32; 2]>,
    },
}

impl Colors {
    /// So many bands over the range where there is something to see.
    pub fn bands(count: usize) -> Self {
        Self::Bands { count, range: None }
    }
}

/// Where and how often a render is kept.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// The file.
    pub path: PathBuf,
    /// Time between two writings; `None`: it is written when the render is stopped, and only then.
    pub every: Option<Duration>,
    /// Whether a file that is there is continued.
    pub resume: bool,
}

/// As many samples in each part of the image as its noise asks for, in place of the scene's number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// The standard error of a pixel's luminance L that is aimed at, in proportion to √L; where L is below
    /// 0.01, to 0.1. Positive.
    pub noise_threshold: f64,
    /// The fewest samples that a pixel gets; whole sets of the sampler may be more.
    pub min_spp: u32,
    /// The most samples that a pixel gets; whole sets of the sampler may be more.
    pub max_spp: u32,
}

/// Settings of a run, which no scene file knows.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Names the scene in the image's metadata.
    pub scene: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Threads; one a processor where absent.
    pub threads: Option<NonZeroUsize>,
    /// Whether each thread stays on a processor of its own, where the system lets it: for measuring.
    pub pinned: bool,
    /// RGB or bands.
    pub colors: Colors,
    /// Where samples go; the same number to every pixel where absent.
    pub adaptive: Option<Adaptive>,
    /// Where on the film the eye looks, in pixels from its upper left corner: the scene's number of samples there, and fewer
    /// away from it. No adaptive sampling beside it.
    pub gaze: Option<[f64; 2]>,
    /// Tree or brute force.
    pub method: Method,
    /// How much work goes into the tree; what suits the scene and the rays where absent.
    pub build: Option<Build>,
    /// The instructions that are used; the image is the same to the bit.
    pub kernel: Kernel,
    /// A folder in which trees are kept from one run to the next.
    pub cache: Option<PathBuf>,
    /// Which of the scene's sensors, in file order from 0.
    pub sensor: usize,
    /// Whether it is told what the image was made of.
    pub recorded: bool,
    /// Whether a picture by the z-buffer comes first, before there is a tree.
    pub preview: bool,
    /// Where the render is kept, so that it can be continued after an interruption.
    pub checkpoint: Option<Checkpoint>,
}

/// Values in place of the scene's own.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// Samples a pixel.
    pub spp: Option<u32>,
    /// Sampler plugin.
    pub sampler: Option<String>,
    /// Width and height of the film.
    pub size: Option<(u32, u32)>,
    /// The part of the film to render.
    pub crop: Option<Window>,
    /// When the shutter opens and closes.
    pub shutter: Option<(f64, f64)>,
    /// Integrator plugin.
    pub integrator: Option<String>,
    /// The integrator's `max_depth`.
    pub max_depth: Option<i64>,
    /// Whether the image is made for [`crate::denoise`]: with the box filter, and with its guides as layers.
    pub denoise: bool,
}

impl Options {
    /// Whether pixels may get different numbers of samples, so that the film's sums stand block by block.
    pub(super) fn by_blocks(&self) -> bool {
        self.adaptive.is_some() || self.gaze.is_some()
    }
}

/// Integrators that know light as textbooks do. In place of another they know it as that does, or all would be far too bright.
const TEXTBOOK: [&str; 2] = ["phong", "raster"];

impl Overrides {
    /// Writes the values into `description`, so that they are checked as the file's own are.
    pub fn apply(&self, description: &mut Description) {
        let root = description.root().node_id();
        let integrator = description.child_or_new(root, Kind::Integrator, "path");
        if let Some(plugin) = &self.integrator {
            let is_textbook = |plugin: &str| TEXTBOOK.contains(&plugin);
            let becomes_textbook =
                is_textbook(plugin) && !is_textbook(description.node(integrator).plugin());
            replace(description, integrator, plugin);
            if becomes_textbook {
                let falloff = Value::String("radiometric".into());
                description.set(integrator, "falloff", falloff);
            }
        }
        if let Some(depth) = self.max_depth {
            let innermost = innermost(description, integrator);
            description.set(innermost, "max_depth", Value::Integer(depth));
        }
        for sensor in description.sensors() {
            self.apply_to_sensor(description, sensor);
        }
        if self.denoise {
            let guides = format!("{ALBEDO}:albedo, {NORMAL}:sh_normal");
            let aov = description.wrap(root, integrator, "aov");
            description.set(aov, "aovs", Value::String(guides));
        }
    }

    fn apply_to_sensor(&self, description: &mut Description, sensor: NodeId) {
        if let Some((open, close)) = self.shutter {
            description.set(sensor, "shutter_open", Value::Float(open));
            description.set(sensor, "shutter_close", Value::Float(close));
        }
        let film = description.child_or_new(sensor, Kind::Film, "hdrfilm");
        if self.denoise {
            let filter = description.child_or_new(film, Kind::Filter, "box");
            replace(description, filter, "box");
        }
        let mut set =
            |name: &str, value: u32| description.set(film, name, Value::Integer(value.into()));
        if let Some((width, height)) = self.size {
            set("width", width);
            set("height", height);
        }
        if let Some(crop) = self.crop {
            set("crop_offset_x", crop.x);
            set("crop_offset_y", crop.y);
            set("crop_width", crop.width);
            set("crop_height", crop.height);
        }
        let sampler = description.child_or_new(sensor, Kind::Sampler, "independent");
        if let Some(plugin) = &self.sampler {
            replace(description, sampler, plugin);
        }
        if let Some(spp) = self.spp {
            description.set(sampler, "sample_count", Value::Integer(spp.into()));
        }
    }
}

/// Makes a node another plugin, which keeps what it knows of the old one's properties.
fn replace(description: &mut Description, id: NodeId, plugin: &str) {
    let kind = description.node(id).kind();
    let listed = plugins();
    let table = listed.iter().find(|p| p.kind == kind && p.name == plugin);
    description.replace(id, plugin, |property| {
        table.is_some_and(|listed| listed.plugin.row(&property.name).is_some())
    });
}

/// The integrator inside a wrapper such as `moment`.
fn innermost(description: &Description, mut integrator: NodeId) -> NodeId {
    while let Some(child) = description
        .children_of(integrator, Kind::Integrator)
        .first()
    {
        integrator = *child;
    }
    integrator
}
