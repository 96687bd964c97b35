//! The images of both sides: judged as they come, so that a thousand seeds take the memory of one, and kept
//! as means where somebody wants to look at them.

use std::path::Path;

use super::Failure;
use crate::budget::Budget;
use crate::compare::map::{Map, Scale, robust_top};
use crate::compare::seeds::{self, Verdict};
use crate::compare::{Layer, Selection, signed};
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
    /// By how much Étendue's is brighter, as a part of the reference: see [`signed::relative`].
    pub brighter: Vec<f32>,
}

impl Pictures {
    /// Writes the mean images `mitsuba.exr` and `etendue.exr` and two maps into a folder that is there: `error.png`, of
    /// how many standard errors they are apart, and `signed.png`, of where Étendue's is brighter and where darker.
    pub(super) fn keep(&self, folder: &Path) -> Result<(), Failure> {
        for (image, name) in [
            (&self.reference, "mitsuba.exr"),
            (&self.ours, "etendue.exr"),
        ] {
            image::write(&folder.join(name), image, &Metadata::default())?;
        }
        let width = self.reference.width() as usize;
        for (values, label, scale, name) in [
            (
                &self.standard_errors,
                "standard errors apart",
                Scale::FromZero,
                "error.png",
            ),
            (
                &self.brighter,
                "brighter than Mitsuba",
                Scale::AboutZero,
                "signed.png",
            ),
        ] {
            let top = robust_top(values);
            let map = Map {
                width,
                values,
                label,
                top,
                scale,
            };
            image::write_codes(&folder.join(name), &map.draw()?, image::Tag::Srgb)?;
        }
        Ok(())
    }
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

    /// Holds the sides against each other.
    pub(super) fn judge(&self) -> Result<Verdict, Failure> {
        let [reference, ours] = self.sides()?;
        Ok(seeds::judge(reference, ours, CONFIDENCE)?)
    }

    /// The mean images, and how far they are apart.
    pub(super) fn pictures(self) -> Result<Pictures, Failure> {
        let [reference, ours] = self.sides()?;
        let standard_errors = seeds::map(reference, ours)?;
        let [reference, ours] = self.means.map(|mean| mean.image);
        let none = || Failure::Broken("there are no images".to_owned());
        let (reference, ours) = (reference.ok_or_else(none)?, ours.ok_or_else(none)?);
        Ok(Pictures {
            brighter: signed::relative(&reference, &ours, reference.rgb())?,
            reference,
            ours,
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
