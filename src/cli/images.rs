//! What a call is to render: inputs × frames × sensors, each with an output of its own, known before the
//! first of them is begun.

use std::path::{Path, PathBuf};

use etendue::budget::Budget;
use etendue::error::{Error, Result};
use etendue::render::Session;

use super::folders::{Wanted, files, pattern};
use super::output::Names;
use super::overrides::{self, Chosen, Sensors};
use super::parse::Frames;
use super::scene::SceneArguments;
use super::stereo::Eye;

/// One image.
#[derive(Clone, Debug)]
pub(super) struct Item {
    pub(super) input: PathBuf,
    pub(super) frame: Option<i64>,
    /// In file order from 0.
    pub(super) sensor: usize,
    /// Where there are two looks.
    pub(super) eye: Option<Eye>,
    pub(super) output: PathBuf,
    /// Where the picture of its node steps goes.
    pub(super) heatmap: Option<PathBuf>,
}

impl Item {
    /// Where the render is kept: beside the image.
    pub(super) fn checkpoint(&self) -> PathBuf {
        let mut name = self.output.as_os_str().to_owned();
        name.push(".checkpoint");
        name.into()
    }

    /// What it writes.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        [Some(&self.output), self.heatmap.as_ref()]
            .into_iter()
            .flatten()
            .map(PathBuf::as_path)
    }

    /// For messages: `box.xml`, frame 7, sensor 1.
    pub(super) fn name(&self) -> String {
        let mut name = self.input.display().to_string();
        if let Some(frame) = self.frame {
            name += &format!(", frame {frame}");
        }
        if self.sensor > 0 {
            name += &format!(", sensor {}", self.sensor);
        }
        if let Some(eye) = self.eye {
            name += &format!(", {} eye", eye.name());
        }
        name
    }
}

/// The images of a call.
#[derive(Debug, Default)]
pub(super) struct Images {
    pub(super) items: Vec<Item>,
    /// Inputs whose sensors could not be found out.
    pub(super) failed: Vec<(PathBuf, Error)>,
}

/// What they are made of.
#[derive(Debug)]
pub(super) struct Request<'a> {
    pub(super) inputs: &'a [PathBuf],
    pub(super) frames: Option<Frames>,
    /// The first sensor where absent.
    pub(super) sensors: Option<&'a Sensors>,
    /// None for one look.
    pub(super) eyes: &'a [Eye],
    pub(super) output: &'a str,
    pub(super) heatmap: Option<&'a str>,
    pub(super) scene: &'a SceneArguments,
    pub(super) budget: &'a Budget,
}

impl Request<'_> {
    /// All images, by input, frame and sensor.
    pub(super) fn images(&self) -> Result<Images> {
        let mut images = Images::default();
        let output = pattern(self.output, self.eyes.len());
        for input in &files(self.inputs, Wanted::Scenes)? {
            let chosen = match self.chosen(input) {
                Ok(chosen) => chosen,
                Err(error) => {
                    images.failed.push((input.clone(), error));
                    continue;
                }
            };
            for frame in self.numbers() {
                for (sensor, eye) in chosen.iter().flat_map(|sensor| self.looks(sensor)) {
                    let names = Names {
                        input,
                        frame: frame.unwrap_or(0),
                        sensor: &sensor.name,
                        eye: eye.map(Eye::name),
                    };
                    images.items.push(Item {
                        input: input.clone(),
                        frame,
                        sensor: sensor.number,
                        eye,
                        output: names.expand(&output)?,
                        heatmap: self.heatmap.map(|path| names.expand(path)).transpose()?,
                    });
                }
            }
        }
        Ok(images)
    }

    /// The looks through a sensor.
    fn looks<'s>(&self, sensor: &'s Chosen) -> Vec<(&'s Chosen, Option<Eye>)> {
        match self.eyes {
            [] => vec![(sensor, None)],
            eyes => eyes.iter().map(|eye| (sensor, Some(*eye))).collect(),
        }
    }

    fn numbers(&self) -> Vec<Option<i64>> {
        match self.frames {
            Some(frames) => frames.iter().map(Some).collect(),
            None => vec![None],
        }
    }

    /// Numbers and names of the sensors that are meant. The scene is read only where they depend on it.
    fn chosen(&self, input: &Path) -> Result<Vec<Chosen>> {
        let mut patterns = [Some(self.output), self.heatmap].into_iter().flatten();
        if self.sensors.is_none() && !patterns.any(|pattern| pattern.contains("{sensor}")) {
            return Ok(vec![Chosen::default()]);
        }
        let frame = self.numbers()[0];
        let mut session = Session::default();
        let description =
            self.scene
                .describe(input, &self.scene.options(frame), self.budget, &mut session)?;
        overrides::chosen(&description, self.sensors)
    }
}
