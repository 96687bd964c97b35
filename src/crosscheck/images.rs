//! The images of both sides: judged as they come, so that a thousand seeds take the memory of one, and kept
//! as means where somebody wants to look at them.

use std::path::Path;

use super::Failure;
use crate::budget::Budget;
use crate::compare::map::{Map, robust_top};
use crate::compare::seeds::{self, Verdict};
use crate::compare::{Layer, Selection};
use crate::error::Error;
use crate::image::{self, Image, Metadata};

/// The probability that two sides of one image are found to agree.
const CONFIDENCE: f64 = 0.99;

/// Reads the main colour of a render.
pub(super) fn read(path: &Path) -> Result<Layer, Failure> {
    let picture = image::read(path, &Budget::default().open())?;
    Layer::of(&picture, &Selection::default()).map_err(not_comparable)
}

fn not_comparable(error: Error) -> Failure {
    Failure::NotComparable(error.to_string())
}

/// What both sides have made.
#[derive(Clone, Debug)]
pub struct Pictures {
    /// The mean over Mitsuba's seeds.
    pub reference: Image,
    /// The mean over Étendue's.
    pub ours: Image,
    /// How many standard errors a pixel's two means are apart, row by row.
    pub standard_errors: Vec<f32>,
}

/// The images of both sides so far; the reference comes first.
#[derive(Debug, Default)]
pub(super) struct Images {
    sides: Option<[seeds::Side; 2]>,
    means: [Mean; 2],
}

impl Images {
    /// Takes a pair.
    pub(super) fn push(&mut self, mut reference: Layer, mut ours: Layer) -> Result<(), Failure> {
        Layer::align(&mut reference, &mut ours).map_err(not_comparable)?;
        let sides = match &mut self.sides {
            Some(sides) => sides,
            none => none.insert([
                seeds::Side::new(&reference.image, reference.rgb)?,
                seeds::Side::new(&ours.image, ours.rgb)?,
            ]),
        };
        for (i, (layer, name)) in [(&reference, "Mitsuba"), (&ours, "Étendue")]
            .into_iter()
            .enumerate()
        {
            sides[i]
                .push(&layer.image)
                .map_err(|e| Failure::Broken(format!("{name}'s image: {e}")))?;
            self.means[i].push(&layer.image);
        }
        Ok(())
    }

    /// Pixels across and down.
    pub(super) fn size(&self) -> [u32; 2] {
        let mean = self.means[0].image.as_ref();
        mean.map_or([0; 2], |image| [image.width(), image.height()])
    }

    /// Holds the sides against each other.
    pub(super) fn judge(&self) -> Result<Verdict, Failure> {
        let [reference, ours] = self.sides()?;
        Ok(seeds::judge(reference, ours, CONFIDENCE)?)
    }

    /// Writes the mean images `mitsuba.exr` and `etendue.exr`, and `error.png`, a map of how many standard
    /// errors they are apart, into a folder that is there.
    pub(super) fn keep(&self, folder: &Path) -> Result<(), Failure> {
        for (mean, name) in self.means.iter().zip(["mitsuba.exr", "etendue.exr"]) {
            if let Some(image) = &mean.image {
                image::write(&folder.join(name), image, &Metadata::default())?;
            }
        }
        let [reference, ours] = self.sides()?;
        let values = seeds::map(reference, ours)?;
        let map = Map {
            width: self.size()[0] as usize,
            values: &values,
            label: "standard errors apart",
            top: robust_top(&values),
        };
        image::write_codes(&folder.join("error.png"), &map.draw()?, image::Tag::Srgb)?;
        Ok(())
    }

    /// The mean images, and how far they are apart.
    pub(super) fn pictures(self) -> Result<Pictures, Failure> {
        let [reference, ours] = self.sides()?;
        let standard_errors = seeds::map(reference, ours)?;
        let [reference, ours] = self.means.map(|mean| mean.image);
        let none = || Failure::Broken("there are no images".to_owned());
        Ok(Pictures {
            reference: reference.ok_or_else(none)?,
            ours: ours.ok_or_else(none)?,
            standard_errors,
        })
    }

    fn sides(&self) -> Result<&[seeds::Side; 2], Failure> {
        let none = || Failure::Broken("there are no images to judge".to_owned());
        self.sides.as_ref().ok_or_else(none)
    }
}

/// The mean of images.
#[derive(Debug, Default)]
struct Mean {
    image: Option<Image>,
    sums: Vec<f64>,
    count: usize,
}

impl Mean {
    fn push(&mut self, image: &Image) {
        let mean = self.image.get_or_insert_with(|| image.clone());
        self.sums.resize(mean.data().len(), 0.0);
        self.count += 1;
        for ((mean, sum), value) in mean
            .data_mut()
            .iter_mut()
            .zip(&mut self.sums)
            .zip(image.data())
        {
            *sum += f64::from(*value);
            *mean = (*sum / self.count as f64) as f32;
        }
    }
}
