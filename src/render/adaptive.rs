//! Adaptive sampling: every block of 8 × 8 pixels gets as many samples as its noise asks for.
//!
//! A block's samples are two halves. Each begins with a pilot of four sets, scrambled independently; their
//! spread is the noise, which holds for stratified points too, where the spread of single samples would
//! not. What is seen in one half's pilot decides how many samples the *other* half gets: a number that
//! depends on a half's own samples would bias their mean, and the image, toward what is dark where
//! highlights are rare. For the same reason a pixel is the plain mean of its two halves, never weighted
//! by their sizes. (Kirk and Arvo, *Unbiased sampling techniques for image synthesis*, 1991.)
//!
//! To bring the variance v of every block to a threshold takes n ∝ v samples, and no fewer in all than the
//! same number everywhere that has the same mean error: the quiet parts pay for the noisy. The mean error
//! falls fastest with n ∝ √v, and with n ∝ v^⅔ almost as fast (for log-normal v of width s it takes e^(−2s²/9)
//! of a uniform budget, where the best takes e^(−s²/4)). So a block that needs `max_spp` samples to come to the
//! threshold gets these, and others n ∝ v^⅔: no block is noisier than was asked, and quiet ones are less noisy.
//!
//! What follows the pilot is one set of the sampler's as large as is needed, from a ladder of sizes. Before all pilots
//! comes a draft, one sample of each pixel, so that there is soon a whole picture; the pilots replace it.

use std::ops::Range;

use super::checkpoint::Keeper;
use super::named;
use super::options::{Adaptive, Options};
use super::origin::Outcome;
use super::plan::{Completed, PASS};
use super::prepare::Job;
use super::progress::{Phase, Progress};
use super::rounds::{Rounds, area};
use super::samples::{self, Sink};
use super::unit;
use crate::color::{ColorModel, luminance};
use crate::error::{Error, Result};
use crate::film::{Accumulator as _, Blocks, Grid, Group, Layout, Record, Summed, Sums, Tally};
use crate::filter::Filter;
use crate::image::Image;
use crate::lanes::Kernel;
use crate::math::random;
use crate::sampler::{Sampler, Stream};
use crate::sensor::{Film, Window};

/// Sets in a half's pilot.
const SETS: u32 = 4;
/// Steps of the ladder to a doubling.
const STEPS: i32 = 4;
/// Samples grow with this power of the variance.
const EXPONENT: f64 = 2.0 / 3.0;
/// Noise is relative to √L, but not where the luminance L is below this.
const DARK: f64 = 0.01;

/// The sets that halves may take.
#[derive(Debug)]
pub(super) struct Ladder {
    /// What places the pilot.
    pilot: Sampler,
    /// Points of a set of the pilot.
    set: u32,
    /// What may follow, from small to large.
    steps: Vec<Step>,
    noise_threshold: f64,
}

#[derive(Debug)]
struct Step {
    sampler: Sampler,
    /// Samples of each pixel.
    count: u32,
}

impl Ladder {
    /// The pilot and the largest step come to `min_spp` and `max_spp`, as far as the sampler's sets allow.
    pub(super) fn new(sampler: &Sampler, adaptive: &Adaptive) -> Self {
        let pilot = sampler.with_count(adaptive.min_spp.div_ceil(2 * SETS));
        let set = pilot.sample_count();
        let begun = SETS * set;
        let rest = adaptive.max_spp.div_ceil(2).saturating_sub(begun);
        let mut steps: Vec<Step> = Vec::new();
        for i in 0.. {
            let size = f64::from(begun) / 4.0 * 2f64.powf(f64::from(i) / f64::from(STEPS));
            let size = (size.ceil() as u32).min(rest);
            if size == 0 {
                break;
            }
            let sampler = sampler.with_count(size);
            let count = sampler.sample_count();
            if steps.last().is_none_or(|last| count > last.count) {
                steps.push(Step { sampler, count });
            }
            if size == rest {
                break;
            }
        }
        Self {
            pilot,
            set,
            steps,
            noise_threshold: adaptive.noise_threshold,
        }
    }

    /// The same, unless the sampler's sets tell nothing of the noise.
    pub(super) fn checked(sampler: &Sampler, adaptive: &Adaptive) -> Result<Self> {
        let ladder = Self::new(sampler, adaptive);
        match ladder.repeats_itself() {
            false => Ok(ladder),
            true => Err(Error::input(
                "the sampler's points are the same in every set, so that their spread tells nothing of the noise",
            )
            .help("take another --sampler, or --spp in place of --noise-threshold")),
        }
    }

    /// How many passes there are at most: the pilots, and those after them.
    pub(super) fn passes(&self) -> u32 {
        1 + self.limits()[1].div_ceil(2 * PASS)
    }

    /// Whether all sets of the pilot are the same points, in whatever order, so that their spread tells
    /// nothing: those of `grid`, and of `stratified` without jitter.
    fn repeats_itself(&self) -> bool {
        let set = |first: u32| {
            let point = |i| {
                Stream::new(0, 0, 0, first + i)
                    .pair(&self.pilot, 0)
                    .to_array()
            };
            let mut points: Vec<_> = (0..self.set).map(point).collect();
            points.sort_by(|a, b| a.partial_cmp(b).expect("coordinates are numbers"));
            points
        };
        set(0) == set(self.set)
    }

    /// Samples of each pixel in a half's pilot.
    fn begun(&self) -> u32 {
        SETS * self.set
    }

    /// The fewest and the most samples that a pixel can get.
    pub(super) fn limits(&self) -> [u32; 2] {
        let most = self.steps.last().map_or(0, |step| step.count);
        [2 * self.begun(), 2 * (self.begun() + most)]
    }

    /// Samples of each pixel after the pilot, on step 0 none.
    fn count(&self, step: usize) -> u32 {
        step.checked_sub(1).map_or(0, |i| self.steps[i].count)
    }

    /// The step for a block of which two pilots leave so much noise.
    fn step(&self, noise_squared: f64) -> usize {
        let begun = f64::from(self.begun());
        let most = f64::from(self.limits()[1]) / 2.0;
        let to_threshold = begun * noise_squared / self.noise_threshold.powi(2);
        let wanted = most * (to_threshold / most).powf(EXPONENT);
        if wanted <= begun {
            return 0;
        }
        let below = self
            .steps
            .partition_point(|step| begun + f64::from(step.count) < wanted);
        (below + 1).min(self.steps.len())
    }
}

/// What an adaptive render came to, beside the image.
#[derive(Clone, Debug, serde::Serialize)]
pub struct AdaptiveReport {
    /// The noise that was asked for.
    pub noise_threshold: f64,
    /// The fewest and the most samples that a pixel could get, in whole sets.
    #[serde(serialize_with = "named::range")]
    pub limits: [u32; 2],
    /// Samples a pixel of the crop, on average.
    pub mean_spp: f64,
    /// The share of the crop's pixels that got as many samples as possible, and may be noisier.
    pub at_limit: f64,
}

/// The part of a pixel's samples that a sample belongs to: each draws other numbers.
fn stream(seed: u64, half: usize, after_pilot: bool, [x, y]: [u32; 2], index: u32) -> Stream {
    let part = 1 + 2 * half as u64 + u64::from(after_pilot);
    Stream::new(random::key(seed, part), x, y, index)
}

/// Renders the job's crop, going on from what `keeper` kept, until `progress` asks to stop.
pub(super) fn render<C: ColorModel>(
    job: &Job<'_, C>,
    options: (&Options, &Adaptive),
    progress: &dyn Progress,
    mut keeper: Option<&mut Keeper>,
) -> Result<(Summed<Blocks>, Completed, Ladder)> {
    let ladder = Ladder::checked(&job.view.sampler, options.1)?;
    let grid = Grid::new(&job.view.film, job.layout().count());
    let passes = ladder.passes() as usize - 1;
    let tiles = grid.tiles();
    let mut summed = Summed {
        sums: Blocks::new(grid)?,
        next: 0,
    };
    if let Some(keeper) = &mut keeper {
        keeper.resume(&mut summed, tiles * (2 + passes))?;
    }
    let mut growing = Growing {
        job,
        options,
        ladder: &ladder,
        grid,
        summed,
        keeper,
        progress,
    };
    // The draft's units, and those of the pilots.
    let first = growing.summed.next;
    let (drafted, piloted) = (first.min(tiles), first.clamp(tiles, 2 * tiles) - tiles);
    let samples = |drafts: usize, pilots: usize| {
        pixels(&grid, 0..drafts) + pilot_samples(&grid, &ladder, 0..pilots)
    };
    progress.begin(Phase::Render, samples(tiles, tiles));
    progress.advance(samples(drafted, piloted), 0);
    let take = |part| growing.take(&part);
    unit::run(first..2 * tiles, progress, take, |unit| {
        match unit.checked_sub(tiles) {
            None => draft(job, &ladder, &grid, unit, progress),
            Some(tile) => pilot(job, &ladder, &grid, tile, progress),
        }
    })?;
    let next = growing.summed.next;
    if next < 2 * tiles {
        let completed = Completed {
            samples: u32::from(next >= tiles),
            passes: [0, 1 + passes as u32],
            units: [next, 2 * tiles + 1],
        };
        return Ok((growing.summed, completed, ladder));
    }

    let rest = Rest::new(&grid, &ladder, growing.summed.sums.steps());
    let units = 2 * tiles + rest.rounds.units();
    if next > units {
        return Err(Error::input(
            "the checkpoint knows of more tiles than there are",
        ));
    }
    let done = next - 2 * tiles;
    progress.begin(Phase::Render, rest.samples(&grid, 0..rest.rounds.units()));
    progress.advance(rest.samples(&grid, 0..done), 0);
    let take = |part| growing.take(&part);
    unit::run(next..units, progress, take, |unit| {
        rest.render(job, &ladder, &grid, unit - 2 * tiles, progress)
    })?;
    let next = growing.summed.next;
    let completed = Completed {
        samples: ladder.limits()[0],
        passes: [
            1 + rest.rounds.pass(next - 2 * tiles),
            1 + rest.rounds.passes(),
        ],
        units: [next, units],
    };
    Ok((growing.summed, completed, ladder))
}

/// The film while its units come in.
struct Growing<'a, 'j, C: ColorModel> {
    job: &'a Job<'j, C>,
    options: (&'a Options, &'a Adaptive),
    ladder: &'a Ladder,
    grid: Grid,
    summed: Summed<Blocks>,
    keeper: Option<&'a mut Keeper>,
    progress: &'a dyn Progress,
}

impl<C: ColorModel> Growing<'_, '_, C> {
    fn take(&mut self, part: &Part) -> Result<()> {
        let tiles = self.grid.tiles();
        match (tiles..2 * tiles).contains(&self.summed.next) {
            true => self.summed.sums.replace(part),
            false => self.summed.sums.add(part),
        }
        self.summed.next += 1;
        if let Some(keeper) = &mut self.keeper {
            keeper.keep_when_due(&self.summed);
        }
        self.show()
    }

    /// Shows the image as it stands, where somebody wants to see it.
    fn show(&self) -> Result<()> {
        if !self.progress.wants_picture() {
            return Ok(());
        }
        let (job, (options, adaptive)) = (self.job, self.options);
        let (film, limits, blocks) = (&job.view.film, self.ladder.limits(), &self.summed.sums);
        let image = develop(film, &job.layout(), blocks)?;
        let report = Given::new(film, limits, blocks).report(adaptive.noise_threshold, limits);
        let outcome = Outcome {
            spp: report.mean_spp.round() as u32,
            samples_complete: 0,
            adaptive: Some(&report),
            foveated: None,
        };
        (self.progress).picture(&job.picture(&options.scene, image, &outcome));
        Ok(())
    }
}

/// How many pixels tiles have.
fn pixels(grid: &Grid, tiles: Range<usize>) -> u64 {
    let blocks = tiles.flat_map(|tile| grid.tile(tile));
    blocks.map(|block| area(&grid.block(block))).sum()
}

/// How many samples the pilots of tiles take.
pub(super) fn pilot_samples(grid: &Grid, ladder: &Ladder, tiles: Range<usize>) -> u64 {
    pixels(grid, tiles) * u64::from(2 * ladder.begun())
}

/// What a unit comes to.
pub(super) type Part = (Vec<Record>, Tally);

/// The first sample of each pixel of a tile, which the pilot takes again, and counts.
fn draft<C: ColorModel>(
    job: &Job<'_, C>,
    ladder: &Ladder,
    grid: &Grid,
    tile: usize,
    progress: &dyn Progress,
) -> Part {
    let records = grid.tile(tile).map(|block| {
        let mut sink = HalfBlock::new(job, grid, 2 * block);
        let pixels = pixels_of(grid.block(block)).map(|pixel| (pixel, 0..1));
        let stream = |pixel, index| stream(job.seed, 0, false, pixel, index);
        samples::estimate(job, &ladder.pilot, pixels, stream, progress, &mut sink);
        *sink.record.samples_mut() = 1.0;
        sink.record
    });
    (records.collect(), Tally::default())
}

/// The pilots of a tile's blocks, and what they decide.
pub(super) fn pilot<C: ColorModel>(
    job: &Job<'_, C>,
    ladder: &Ladder,
    grid: &Grid,
    tile: usize,
    progress: &dyn Progress,
) -> Part {
    let mut tally = Tally::default();
    let mut records = Vec::new();
    for block in grid.tile(tile) {
        let halves = [0, 1].map(|half| {
            let mut spread = Spread {
                record: HalfBlock::new(job, grid, 2 * block + half),
                set: ladder.set as usize,
                seen: 0,
                sets: Vec::new(),
            };
            let pixels = pixels_of(grid.block(block)).map(|pixel| (pixel, 0..ladder.begun()));
            let stream = |pixel, index| stream(job.seed, half, false, pixel, index);
            samples::estimate(job, &ladder.pilot, pixels, stream, progress, &mut spread);
            *spread.record.record.samples_mut() = ladder.begun().into();
            spread
        });
        let steps = [1, 0].map(|other: usize| ladder.step(halves[other].noise_squared()));
        for (half, step) in halves.into_iter().zip(steps) {
            let HalfBlock {
                mut record,
                tally: cost,
                ..
            } = half.record;
            *record.step_mut() = step as f64;
            records.push(record);
            tally.add(&cost);
        }
    }
    (records, tally)
}

/// All samples after the pilots.
pub(super) struct Rest {
    /// The step of each half of each block.
    steps: Vec<usize>,
    /// The samples of these steps.
    rounds: Rounds,
}

impl Rest {
    pub(super) fn new(grid: &Grid, ladder: &Ladder, steps: Vec<usize>) -> Self {
        let counts = steps.iter().map(|step| ladder.count(*step)).collect();
        Self {
            steps,
            rounds: Rounds::new(grid, counts),
        }
    }

    /// The units of some passes, of which the first after the pilots is 0; later ones than are needed have none.
    pub(super) fn units_of(&self, passes: Range<u32>) -> Range<usize> {
        self.rounds.units_of(passes)
    }

    /// How many samples units take.
    pub(super) fn samples(&self, grid: &Grid, units: Range<usize>) -> u64 {
        self.rounds.samples(grid, units)
    }

    pub(super) fn render<C: ColorModel>(
        &self,
        job: &Job<'_, C>,
        ladder: &Ladder,
        grid: &Grid,
        unit: usize,
        progress: &dyn Progress,
    ) -> Part {
        let mut tally = Tally::default();
        let mut records = Vec::new();
        for (slot, indices) in self.rounds.slots(grid, unit) {
            let sampler = &ladder.steps[self.steps[slot] - 1].sampler;
            let mut sink = HalfBlock::new(job, grid, slot);
            let count = indices.len() as u32;
            let pixels = pixels_of(grid.block(slot / 2)).map(|pixel| (pixel, indices.clone()));
            let stream = |pixel, index| stream(job.seed, slot % 2, true, pixel, index);
            samples::estimate(job, sampler, pixels, stream, progress, &mut sink);
            *sink.record.samples_mut() = count.into();
            tally.add(&sink.tally);
            records.push(sink.record);
        }
        (records, tally)
    }
}

/// A window's pixels, row by row.
pub(super) fn pixels_of(window: Window) -> impl Iterator<Item = [u32; 2]> {
    (window.y..window.y + window.height)
        .flat_map(move |y| (window.x..window.x + window.width).map(move |x| [x, y]))
}

/// Adds samples to the sums of one half of a block.
pub(super) struct HalfBlock<'f> {
    pub(super) record: Record,
    reach: Window,
    stride: usize,
    filter: &'f Filter,
    pub(super) tally: Tally,
}

impl<'f> HalfBlock<'f> {
    /// No samples yet.
    pub(super) fn new<C: ColorModel>(job: &'f Job<'_, C>, grid: &Grid, slot: usize) -> Self {
        Self {
            record: Record::new(grid, slot),
            reach: grid.reach(slot / 2),
            stride: grid.stride(),
            filter: &job.view.film.filter,
            tally: Tally::default(),
        }
    }
}

impl Sink for HalfBlock<'_> {
    fn tally(&mut self) -> &mut Tally {
        &mut self.tally
    }

    fn take(&mut self, kernel: Kernel, group: &Group, rows: &mut [f32]) {
        let sums = self.record.sums_mut();
        let dropped = group.splat(kernel, self.filter, rows, &self.reach, self.stride, sums);
        self.tally.drop(group.pixel, dropped);
    }
}

/// The same for a pilot, whose sets are also looked at one by one.
struct Spread<'f> {
    record: HalfBlock<'f>,
    /// Points of a set.
    set: usize,
    seen: usize,
    /// For each pixel and set the sum of luminances.
    sets: Vec<f64>,
}

impl Sink for Spread<'_> {
    fn tally(&mut self) -> &mut Tally {
        self.record.tally()
    }

    fn take(&mut self, kernel: Kernel, group: &Group, rows: &mut [f32]) {
        for row in rows.chunks_exact(rows.len() / group.count) {
            let [_, r, g, b, ..] = row else {
                return;
            };
            if self.seen.is_multiple_of(self.set) {
                self.sets.push(0.0);
            }
            self.seen += 1;
            let y = luminance([*r, *g, *b]);
            if let Some(sum) = self.sets.last_mut()
                && y.is_finite()
            {
                *sum += f64::from(y);
            }
        }
        self.record.take(kernel, group, rows);
    }
}

impl Spread<'_> {
    /// The variance of the mean of two such pilots, averaged over the block's pixels and in proportion to
    /// their luminance.
    fn noise_squared(&self) -> f64 {
        let n = f64::from(SETS);
        let (mut variance, mut brightness) = (0.0, 0.0);
        let pixels = self.sets.chunks_exact(SETS as usize);
        let count = pixels.len() as f64;
        for sets in pixels {
            let mean = sets.iter().sum::<f64>() / n;
            let squares: f64 = sets.iter().map(|s| (s - mean).powi(2)).sum();
            variance += squares / ((n - 1.0) * n) / 2.0;
            brightness += mean;
        }
        let size = self.set as f64;
        let (variance, brightness) = (variance / (size * size), brightness / size);
        variance / count / (brightness / count).max(DARK)
    }
}

/// What was given to pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Given {
    pixels: u64,
    samples: u64,
    /// Pixels that got as many samples as possible.
    at_limit: u64,
}

impl Given {
    /// To those of the film's crop.
    pub(super) fn new(film: &Film, limits: [u32; 2], blocks: &Blocks) -> Self {
        let crop = film.shown();
        let mut given = Self::default();
        for (own, count) in blocks.counts() {
            let seen = own.grown(0, &crop);
            let pixels = area(&seen);
            given.pixels += pixels;
            given.samples += pixels * u64::from(count);
            given.at_limit += if count == limits[1] { pixels } else { 0 };
        }
        given
    }

    /// Adds what other pixels got.
    pub(super) fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.samples += other.samples;
        self.at_limit += other.at_limit;
    }

    /// In proportion to the pixels.
    pub(super) fn report(&self, noise_threshold: f64, limits: [u32; 2]) -> AdaptiveReport {
        AdaptiveReport {
            noise_threshold,
            limits,
            mean_spp: self.mean_spp(),
            at_limit: self.at_limit(),
        }
    }

    /// Samples a pixel, on average.
    pub(super) fn mean_spp(&self) -> f64 {
        self.samples as f64 / self.pixels as f64
    }

    /// The share of pixels that got as many samples as possible.
    pub(super) fn at_limit(&self) -> f64 {
        self.at_limit as f64 / self.pixels as f64
    }
}

/// The film, and beside its channels `samples`, how many samples each pixel got, and `error`, the standard
/// error of its luminance: half the difference of the halves' images, as its root mean square over a block.
pub(super) fn develop(film: &Film, layout: &Layout, blocks: &Blocks) -> Result<Image> {
    let halves = blocks.halves(layout)?;
    let mut sums = Sums::new(film.shown(), layout.clone())?;
    for half in &halves {
        sums.add_film(half);
    }
    let image = sums.develop(film)?;
    let mut names = image.channels().to_vec();
    let old = names.len();
    names.extend(["samples".to_owned(), "error".to_owned()]);
    let mut data = Vec::with_capacity(image.data().len() / old * names.len());
    for pixel in image.data().chunks_exact(old) {
        data.extend_from_slice(pixel);
        data.extend([0.0, 0.0]);
    }
    let crop = &film.shown();
    for (own, samples) in blocks.counts() {
        let seen = own.grown(0, crop);
        if seen.width == 0 || seen.height == 0 {
            continue;
        }
        let squares: f64 = pixels_of(own)
            .map(|pixel| {
                let [a, b] = [0, 1].map(|half| halves[half].luminance(pixel));
                ((a - b) / 2.0).powi(2)
            })
            .sum();
        let error = (squares / f64::from(own.width * own.height)).sqrt() as f32;
        for [x, y] in pixels_of(seen) {
            let i = ((y - crop.y) * crop.width + (x - crop.x)) as usize;
            let pixel = &mut data[i * names.len()..][old..names.len()];
            pixel.copy_from_slice(&[samples as f32, error]);
        }
    }
    Image::from_data(crop.width, crop.height, names, data)
}
