//! Samples by the distance from a gaze: all of the scene's where the eye looks, and fewer where it sees less sharply.
//!
//! At an eccentricity of e degrees the eye tells periods of ω(e) = m·e + ω₀ degrees apart, the linear model of the minimum
//! angle of resolution with m and ω₀ by Guenter et al., *Foveated 3D Graphics*, 2012. A display of pixels p wide shows
//! none below 2·p. So the eye averages over an area ∝ max(ω, 2·p)², and samples in inverse proportion to that area leave it
//! as much noise there as where it looks.
//!
//! Every block of 8 × 8 pixels gets one set of samples of its own size, from a ladder of sizes: the first samples of a larger
//! set would not be spread evenly. The number depends on the place alone and not on what samples see, so that no mean is
//! biased. Where it is the scene's, samples are those of a render without gaze.

use glam::{DVec2, DVec3, Vec2};

use super::adaptive::{Given, HalfBlock, Part, pixels_of};
use super::checkpoint::Keeper;
use super::named;
use super::options::Options;
use super::origin::Outcome;
use super::plan::{Completed, PASS};
use super::prepare::{Job, View};
use super::progress::{Phase, Progress};
use super::rounds::Rounds;
use super::samples;
use super::unit;
use crate::color::ColorModel;
use crate::error::{Error, Result};
use crate::film::{Accumulator as _, BLOCK, Blocks, Grid, Layout, Summed, Sums, Tally};
use crate::image::Image;
use crate::sampler::{Sampler, Stream};
use crate::sensor::{Film, Sensor, Window};

/// Degrees of resolution that are lost with a degree of eccentricity: 1.32 arc minutes, of which people said that they see no
/// difference; 1.65 where they cannot tell when quality is lowered.
const SLOPE: f64 = 1.32 / 60.0;
/// The shortest period, in degrees, that is seen where the eye looks.
const FOVEAL: f64 = 1.0 / 48.0;
/// How far away an image is seen that tells no angles, in its heights: as the high-definition television of
/// Recommendation ITU-R BT.709 is meant to be.
const HEIGHTS: f64 = 3.0;
/// Steps of the ladder to a doubling.
const STEPS: i32 = 4;

/// How samples fall off around a gaze.
#[derive(Debug)]
pub(super) struct Fovea {
    /// The block of each pixel of the film is a whole one: all that can be sampled.
    sampled: Window,
    /// The sampler of each step, the largest first.
    steps: Vec<Sampler>,
    /// The step of each block of the film, row by row.
    chosen: Vec<u8>,
}

impl Fovea {
    /// For what is looked at `gaze`, in pixels of the film.
    ///
    /// # Errors
    /// Where that is not on the film.
    pub(super) fn new<C: ColorModel>(view: &View<C>, gaze: [f64; 2]) -> Result<Self> {
        let View {
            sensor,
            film,
            sampler,
            ..
        } = view;
        let ([x, y], (width, height)) = (gaze, (film.width, film.height));
        if !((0.0..=width.into()).contains(&x) && (0.0..=height.into()).contains(&y)) {
            let message = format!("the gaze {x},{y} is not on the film, which is {width}x{height}");
            return Err(Error::input(message)
                .help("--foveate takes pixels of the whole film, from its upper left corner"));
        }
        let acuity = Acuity::new(sensor, film, DVec2::new(x, y));
        let steps = ladder(sampler);
        let sampled = film.sampled();
        let all = f64::from(sampler.sample_count());
        let blocks = blocks(&sampled).map(|block| {
            let wanted = (acuity.share(&block, film.margin()) * all).ceil();
            // The smallest that is enough.
            let enough = steps.partition_point(|step| f64::from(step.sample_count()) >= wanted);
            enough.saturating_sub(1) as u8
        });
        Ok(Self {
            sampled,
            chosen: blocks.collect(),
            steps,
        })
    }

    /// What places the samples of a pixel, counted from the first that can be sampled: as many as its set has.
    pub(super) fn sampler_of(&self, [x, y]: [u32; 2]) -> &Sampler {
        let across = self.sampled.width.div_ceil(BLOCK);
        let block = (y / BLOCK) * across + x / BLOCK;
        &self.steps[usize::from(self.chosen[block as usize])]
    }

    /// What places the samples of a block.
    fn sampler(&self, block: &Window) -> &Sampler {
        self.sampler_of([block.x, block.y])
    }

    /// The samples that the grid's blocks want, all in their first halves.
    fn counts(&self, grid: &Grid) -> Vec<u32> {
        (0..grid.blocks())
            .flat_map(|block| [self.sampler(&grid.block(block)).sample_count(), 0])
            .collect()
    }

    /// The fewest and the most samples of a pixel of the crop.
    fn limits(&self, film: &Film) -> [u32; 2] {
        let counts = pixels_of(film.shown()).map(|pixel| self.sampler_of(pixel).sample_count());
        counts.fold([u32::MAX, 0], |[least, most], count| {
            [least.min(count), most.max(count)]
        })
    }
}

/// The sampler's sets, from its own down to the smallest.
fn ladder(sampler: &Sampler) -> Vec<Sampler> {
    let all = sampler.sample_count();
    let mut steps = vec![sampler.clone()];
    for i in 1.. {
        let size = f64::from(all) * 2f64.powf(-f64::from(i) / f64::from(STEPS));
        let step = sampler.with_count(size.ceil() as u32);
        if step.sample_count() < steps[steps.len() - 1].sample_count() {
            steps.push(step);
        }
        if size <= 1.0 {
            break;
        }
    }
    steps
}

/// The blocks of a film, row by row.
fn blocks(film: &Window) -> impl Iterator<Item = Window> {
    let [across, down] = [film.width, film.height].map(|n| n.div_ceil(BLOCK));
    let at = |x: u32, y: u32| Window {
        x: x * BLOCK,
        y: y * BLOCK,
        width: BLOCK,
        height: BLOCK,
    };
    let film = *film;
    (0..down).flat_map(move |y| (0..across).map(move |x| at(x, y).grown(0, &film)))
}

/// How sharply a place of the film is seen.
struct Acuity<'a> {
    sensor: &'a Sensor,
    film: &'a Film,
    gaze: DVec2,
    /// The shortest period that the film shows, in degrees.
    shown: f64,
}

impl<'a> Acuity<'a> {
    fn new(sensor: &'a Sensor, film: &'a Film, gaze: DVec2) -> Self {
        let mut acuity = Self {
            sensor,
            film,
            gaze,
            shown: 0.0,
        };
        let half = DVec2::new(0.5, 0.0);
        acuity.shown = 2.0 * acuity.angle(gaze - half, gaze + half);
        acuity
    }

    /// The direction in which a place of the film is seen, which is in pixels.
    fn direction(&self, place: DVec2) -> DVec3 {
        let size = DVec2::new(self.film.width.into(), self.film.height.into());
        if self.sensor.has_field_of_view() {
            let place = (place / size).as_vec2();
            let (open, _) = self.sensor.shutter();
            let ray = self.sensor.ray(place, Vec2::splat(0.5), open);
            return ray.direction.as_dvec3();
        }
        let from_middle = (place - 0.5 * size) / size.y;
        from_middle.extend(HEIGHTS)
    }

    /// Between two places, in degrees.
    fn angle(&self, a: DVec2, b: DVec2) -> f64 {
        let (a, b) = (self.direction(a), self.direction(b));
        a.cross(b).length().atan2(a.dot(b)).to_degrees()
    }

    /// The share of all samples that a block gets, whose pixels are counted with the film's margin: what its place nearest to
    /// the gaze needs.
    fn share(&self, block: &Window, margin: u32) -> f64 {
        let first = DVec2::new(block.x.into(), block.y.into()) - f64::from(margin);
        let size = DVec2::new(block.width.into(), block.height.into());
        let nearest = self.gaze.clamp(first, first + size);
        let resolved = SLOPE * self.angle(self.gaze, nearest) + FOVEAL;
        (FOVEAL.max(self.shown) / resolved.max(self.shown)).powi(2)
    }
}

/// What a render by a gaze came to, beside the image.
#[derive(Clone, Debug, serde::Serialize)]
pub struct FoveatedReport {
    /// Where the eye looks, in pixels of the film.
    #[serde(serialize_with = "named::place")]
    pub gaze: [f64; 2],
    /// The fewest and the most samples of a pixel of the crop.
    #[serde(serialize_with = "named::range")]
    pub limits: [u32; 2],
    /// Samples a pixel of the crop, on average.
    pub mean_spp: f64,
    /// The share of the crop's pixels that have the most.
    pub at_limit: f64,
}

impl FoveatedReport {
    /// Of the film's crop.
    pub(super) fn new(film: &Film, gaze: [f64; 2], limits: [u32; 2], blocks: &Blocks) -> Self {
        let given = Given::new(film, limits, blocks);
        Self {
            gaze,
            limits,
            mean_spp: given.mean_spp(),
            at_limit: given.at_limit(),
        }
    }
}

/// Renders the job's crop, going on from what `keeper` kept, until `progress` asks to stop; the last of the answer are the
/// fewest and the most samples of a pixel.
pub(super) fn render<C: ColorModel>(
    job: &Job<'_, C>,
    (options, gaze): (&Options, [f64; 2]),
    progress: &dyn Progress,
    mut keeper: Option<&mut Keeper>,
) -> Result<(Summed<Blocks>, Completed, [u32; 2])> {
    let fovea = Fovea::new(&job.view, gaze)?;
    let film = &job.view.film;
    let limits = fovea.limits(film);
    let grid = Grid::new(film, job.layout().count());
    let rounds = Rounds::new(&grid, fovea.counts(&grid));
    let mut summed = Summed {
        sums: Blocks::new(grid)?,
        next: 0,
    };
    if let Some(keeper) = &mut keeper {
        keeper.resume(&mut summed, rounds.units())?;
    }
    let first = summed.next;
    progress.begin(Phase::Render, rounds.samples(&grid, 0..rounds.units()));
    progress.advance(rounds.samples(&grid, 0..first), 0);
    let completed = |next: usize| {
        let passes = rounds.pass(next);
        Completed {
            samples: limits[0].min(passes * PASS),
            passes: [passes, rounds.passes()],
            units: [next, rounds.units()],
        }
    };
    let take = |part: Part| {
        summed.sums.add(&part);
        summed.next += 1;
        if let Some(keeper) = &mut keeper {
            keeper.keep_when_due(&summed);
        }
        if progress.wants_picture() {
            let image = develop(film, &job.layout(), &summed.sums)?;
            let report = FoveatedReport::new(film, gaze, limits, &summed.sums);
            let outcome = Outcome {
                spp: report.mean_spp.round() as u32,
                samples_complete: completed(summed.next).samples,
                adaptive: None,
                foveated: Some(&report),
            };
            progress.picture(&job.picture(&options.scene, image, &outcome));
        }
        Ok::<_, Error>(())
    };
    unit::run(first..rounds.units(), progress, take, |unit| {
        let mut tally = Tally::default();
        let mut records = Vec::new();
        for (slot, indices) in rounds.slots(&grid, unit) {
            let block = grid.block(slot / 2);
            let mut sink = HalfBlock::new(job, &grid, slot);
            let count = indices.len() as u32;
            let pixels = pixels_of(block).map(|pixel| (pixel, indices.clone()));
            let stream = |[x, y]: [u32; 2], index| Stream::new(job.seed, x, y, index);
            samples::estimate(
                job,
                fovea.sampler(&block),
                pixels,
                stream,
                progress,
                &mut sink,
            );
            *sink.record.samples_mut() = count.into();
            tally.add(&sink.tally);
            records.push(sink.record);
        }
        (records, tally)
    })?;
    let completed = completed(summed.next);
    Ok((summed, completed, limits))
}

/// The film, and beside its channels `samples`, how many samples each pixel got.
pub(super) fn develop(film: &Film, layout: &Layout, blocks: &Blocks) -> Result<Image> {
    let [all, _] = blocks.halves(layout)?;
    let mut sums = Sums::new(film.shown(), layout.clone())?;
    sums.add_film(&all);
    let image = sums.develop(film)?;
    let mut names = image.channels().to_vec();
    let (old, crop) = (names.len(), film.shown());
    names.push("samples".to_owned());
    let mut data = Vec::with_capacity(image.data().len() / old * names.len());
    for pixel in image.data().chunks_exact(old) {
        data.extend_from_slice(pixel);
        data.push(0.0);
    }
    for (own, samples) in blocks.counts() {
        for [x, y] in pixels_of(own.grown(0, &crop)) {
            let pixel = ((y - crop.y) * crop.width + (x - crop.x)) as usize;
            data[pixel * names.len() + old] = samples as f32;
        }
    }
    Image::from_data(crop.width, crop.height, names, data)
}
