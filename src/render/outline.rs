//! What an image will be and take, told without loading its scene: for lists of what there is to do, and for who cuts it
//! into parts.

use serde::Serialize;

use super::adaptive::Ladder;
use super::memory::{self, Estimate};
use super::options::Options;
use super::plan::Plan;
use super::prepare;
use super::session::Task;
use crate::color::ColorModel;
use crate::description::{Description, Part};
use crate::error::Result;
use crate::sensor::Window;

/// What an image will be and take.
#[derive(Clone, Debug, Serialize)]
pub struct Outline {
    /// What is rendered.
    pub crop: Window,
    /// Whether that is less than the film.
    pub cropped: bool,
    /// Samples of a pixel; the most where not all pixels get the same number.
    pub spp: u32,
    /// Passes over the film; the most where sampling is adaptive.
    pub passes: u32,
    /// Whether pixels get different numbers of samples: by the noise, or by the distance from a gaze.
    pub adaptive: bool,
    /// Estimated seconds of a processor. It knows pixels, samples and files, and no paths: it may be wrong by a factor of
    /// ten, and alike for images of one scene.
    pub seconds: f64,
    /// Estimated bytes of memory.
    pub bytes: u64,
}

/// What rendering `description` will make and take.
///
/// # Errors
/// Where its sensor, film, sampler or integrator is wrong.
pub fn outline(description: &Description, options: &Options) -> Result<Outline> {
    Outlined {
        description,
        options,
    }
    .run_in(description, options)
}

struct Outlined<'a> {
    description: &'a Description,
    options: &'a Options,
}

/// Rays and bytes of files that a processor deals with in a second.
const RAYS: f64 = 2e6;
const BYTES: f64 = 2e7;
/// Seconds until a process has begun.
const START: f64 = 0.05;

impl Task for Outlined<'_> {
    type Output = Outline;

    fn run<C: ColorModel>(self, color: C) -> Result<Outline> {
        let sensor = prepare::sensor(self.description, self.options)?;
        let view = prepare::view::<C>(self.description, sensor)?;
        let film = &view.film;
        let (spp, passes) = match &self.options.adaptive {
            None => {
                let spp = view.sampler.sample_count();
                (spp, Plan::new(film, spp).passes())
            }
            Some(adaptive) => {
                let ladder = Ladder::checked(&view.sampler, adaptive)?;
                (ladder.limits()[1], ladder.passes())
            }
        };
        let channels = prepare::layout(&color, &view.integrator).count();
        let estimate = Estimate {
            film: memory::film(film, channels, self.options.by_blocks()),
            ..Estimate::of_files(self.description)
        };
        let files = self.description.files(Part::Scene);
        let lengths = files.iter().filter_map(|file| file.metadata().ok());
        let bytes: u64 = lengths.map(|about| about.len()).sum();
        Ok(Outline {
            crop: film.crop,
            cropped: film.crop != film.full(),
            spp,
            passes,
            adaptive: self.options.by_blocks(),
            seconds: START + prepare::rays(film, spp) as f64 / RAYS + bytes as f64 / BYTES,
            bytes: estimate.total(),
        })
    }
}
