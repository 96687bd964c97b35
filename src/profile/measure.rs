//! Rounds over all renders of a profile. In each round every render has its turn, and each round begins with
//! another sweep. A render that is too short to be timed is made several times in its turn, after one that warms
//! the caches. Threads are pinned; between sweeps the machine's own noise is measured.

use std::num::NonZeroUsize;
use std::time::Instant;

use super::axis::{Axis, Effort};
use super::noise::Loops;
use super::subject::{Stage, Subject};
use super::sweep::{Extent, Setting, Sweep};
use super::{FORMAT, Fit, Growth, Point, Profile, Series, scaling, verdict};
use crate::accel::Build;
use crate::budget::Budget;
use crate::error::{Error, Result};
use crate::render::{Colors, Options, Overrides, Report, Seconds, Session, Silent, machine};

/// What to profile, and how.
#[derive(Clone, Debug)]
pub struct Settings {
    /// What is rendered.
    pub subject: Subject,
    /// Which axes.
    pub axes: Vec<Axis>,
    /// How much.
    pub effort: Effort,
    /// The most threads.
    pub threads: NonZeroUsize,
    /// Rounds over all renders; as many as the effort's time allows where absent.
    pub rounds: Option<usize>,
    /// Values in place of the subject's own, where a sweep has none.
    pub overrides: Overrides,
    /// Which of a scene's sensors, by id or number; the first where absent.
    pub sensor: Option<String>,
    /// The most bytes that a render may take.
    pub budget: Budget,
}

/// Somebody who watches a run.
pub trait Watch {
    /// Renders a sweep's x now; `part` of the work is done.
    fn at(&self, what: &str, part: f64);
    /// Whether to stop. What rounds are complete then becomes the profile.
    fn stop(&self) -> bool {
        false
    }
}

/// Bytes that a triangle takes while its tree is built: see [`crate::render`]'s estimate.
const BYTES_A_TRIANGLE: u64 = 400;

impl Effort {
    /// Seconds that all rounds may take.
    fn budget(self) -> f64 {
        match self {
            Self::Tiny => 0.0,
            Self::Quick => 11.5,
            Self::Usual => 95.0,
            Self::Full => 600.0,
        }
    }

    /// The fewest and the most rounds.
    fn rounds(self) -> [usize; 2] {
        match self {
            Self::Tiny => [2, 2],
            Self::Quick => [3, 7],
            Self::Usual => [3, 11],
            Self::Full => [3, 11],
        }
    }

    /// Seconds of one arithmetic loop.
    fn of_a_loop(self) -> f64 {
        if self == Self::Tiny { 1e-3 } else { 0.06 }
    }

    /// Seconds below which a render is made several times.
    fn least(self) -> f64 {
        match self {
            Self::Tiny => 0.0,
            Self::Quick => 0.01,
            Self::Usual | Self::Full => 0.04,
        }
    }
}

/// Measures, fits and judges. `None` where it was stopped before the first round was complete.
///
/// # Errors
/// Names what is wrong with the subject, and a lack of memory.
pub fn run(settings: &Settings, watch: &dyn Watch) -> Result<Option<Profile>> {
    let begin = Instant::now();
    let mut stage = Stage::new(settings)?;
    let mut notes = stage.notes().to_vec();
    let extent = Extent {
        axes: settings.axes.clone(),
        effort: settings.effort,
        threads: settings.threads.get(),
        own: stage.own_triangles(),
        most: most_triangles(settings, &mut notes),
    };
    let mut sweeps = if stage.is_scalable() {
        extent.sweeps()
    } else {
        extent.sweeps_of_scene()
    };
    if !stage.has_depth() && settings.axes.contains(&Axis::Depth) {
        sweeps.retain(|sweep| sweep.axis != Axis::Depth);
        notes.push("depth is left out: the scene's integrator has no max_depth".to_owned());
    }
    if settings.axes.contains(&Axis::Objects) && !stage.is_scalable() {
        notes.push(
            "O is left out: a scene has the triangles that it has; profile its mesh".to_owned(),
        );
    }
    if sweeps.is_empty() {
        return Err(Error::input(
            "of the axes that were asked for, none can be swept",
        ));
    }
    let mut rounds = Rounds {
        settings,
        stage: &mut stage,
        watch,
        session: Session::default(),
        loops: Loops::new(settings.threads.get(), settings.effort.of_a_loop()),
        series: sweeps.iter().map(empty).collect(),
        sweeps: &sweeps,
        begin,
    };
    let complete = rounds.all()?;
    let Rounds {
        loops, mut series, ..
    } = rounds;
    if complete == 0 {
        return Ok(None);
    }
    for (series, sweep) in series.iter_mut().zip(&sweeps) {
        for point in &mut series.points {
            point.seconds.truncate(complete);
        }
        series.points.sort_by(|a, b| a.x.total_cmp(&b.x));
        // The coarsest meshes may come out alike.
        series.points.dedup_by(|a, b| a.x == b.x);
        series.fits = fits(series, sweep);
    }
    let noise = loops.noise();
    Ok(Some(Profile {
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        subject: settings.subject.name(),
        machine: machine(),
        effort: settings.effort,
        rounds: complete,
        seconds: begin.elapsed().as_secs_f64(),
        crossover: scaling::Crossover::of(&series),
        scaling: scaling::Scaling::of(&series, &noise),
        bytes_per_triangle: bytes_per_triangle(&series),
        verdicts: verdict::all(&series, &noise),
        noise,
        series,
        notes,
    }))
}

/// The most triangles that fit into memory.
fn most_triangles(settings: &Settings, notes: &mut Vec<String>) -> u32 {
    let limit = settings.budget.limit();
    let fit = limit.map_or(u64::MAX, |bytes| bytes / BYTES_A_TRIANGLE);
    if fit < settings.effort.largest().into() {
        notes.push(format!(
            "sizes end at {fit} triangles, for which memory suffices"
        ));
    }
    u32::try_from(fit).unwrap_or(u32::MAX)
}

fn empty(sweep: &Sweep) -> Series {
    Series {
        axis: sweep.axis,
        way: sweep.way,
        points: Vec::new(),
        fits: Vec::new(),
    }
}

fn fits(series: &Series, sweep: &Sweep) -> Vec<Growth> {
    let growth = |&(quantity, model)| {
        let observed = series.observed(quantity, sweep.from);
        let fit = Fit::new(model, &observed)?;
        Some(Growth {
            quantity,
            from: sweep.from,
            fit,
        })
    };
    sweep.fitted.iter().filter_map(growth).collect()
}

/// Of the largest tree.
fn bytes_per_triangle(series: &[Series]) -> Option<[f64; 2]> {
    let points = series.iter().flat_map(|s| &s.points);
    let largest = points
        .filter(|p| p.bytes[1] > 0)
        .max_by_key(|p| p.primitives)?;
    Some(
        largest
            .bytes
            .map(|bytes| bytes as f64 / largest.primitives as f64),
    )
}

/// The rounds under way.
struct Rounds<'a> {
    settings: &'a Settings,
    stage: &'a mut Stage,
    watch: &'a dyn Watch,
    session: Session,
    loops: Loops,
    sweeps: &'a [Sweep],
    series: Vec<Series>,
    begin: Instant,
}

impl Rounds<'_> {
    /// All rounds; how many are complete.
    fn all(&mut self) -> Result<usize> {
        let [least, most] = self.settings.effort.rounds();
        let mut planned = self.settings.rounds.unwrap_or(least);
        let mut round = 0;
        while round < planned {
            if !self.round(round, planned)? {
                return Ok(round);
            }
            round += 1;
            if self.settings.rounds.is_none() {
                // As many more as fit into the time at the pace so far.
                let spent = self.begin.elapsed().as_secs_f64();
                let fit = self.settings.effort.budget() / (spent / round as f64);
                planned = (fit as usize).clamp(least, most);
            }
        }
        Ok(round)
    }

    /// One round; whether it is complete.
    fn round(&mut self, round: usize, planned: usize) -> Result<bool> {
        let count = self.sweeps.len();
        let renders: usize = self.sweeps.iter().map(|sweep| sweep.settings.len()).sum();
        let mut done = 0;
        for turn in 0..count {
            let sweep = (round + turn) % count;
            if turn % 2 == 0 {
                self.loops.run();
            }
            for i in 0..self.sweeps[sweep].settings.len() {
                if self.watch.stop() {
                    return Ok(false);
                }
                let part = (round as f64 + done as f64 / renders as f64) / planned as f64;
                self.watch.at(&self.series[sweep].title(), part);
                self.measure(sweep, i)?;
                done += 1;
            }
        }
        Ok(true)
    }

    /// A render's turn.
    fn measure(&mut self, sweep: usize, index: usize) -> Result<()> {
        let setting = &self.sweeps[sweep].settings[index];
        let description = self.stage.describe(setting)?.within(&self.settings.budget);
        let options = self.options(setting);
        if self.sweeps[sweep].fresh {
            self.session = Session::default();
        }
        let session = &mut self.session;
        let mut once = || Ok(session.render(&description, &options, &Silent)?.report);
        let first: Report = once()?;
        let least = self.settings.effort.least();
        let times = (least / first.seconds.render.max(1e-6))
            .ceil()
            .min(MOST_TIMES) as u32;
        let mut seconds = first.seconds;
        if times > 1 {
            let mut sum = Seconds::default();
            for _ in 0..times {
                sum.add(&once()?.seconds);
            }
            seconds = Seconds {
                load: first.seconds.load,
                build: first.seconds.build,
                ..sum.divided(times.into())
            };
        }
        let points = &mut self.series[sweep].points;
        match points.get_mut(index) {
            Some(point) => {
                debug_assert_eq!(point.stats, first.stats, "counts do not change");
                point.seconds.push(seconds);
            }
            None => points.push(point(self.sweeps[sweep].axis, setting, &first, seconds)),
        }
        Ok(())
    }

    fn options(&self, setting: &Setting) -> Options {
        Options {
            threads: NonZeroUsize::new(setting.threads),
            pinned: true,
            colors: setting.bands.map_or(Colors::Rgb, Colors::bands),
            method: setting.method,
            // The same for all, whatever the rays that are to come.
            build: Some(Build::Medium),
            sensor: self.stage.sensor(),
            ..Options::default()
        }
    }
}

/// The most often that a short render is repeated in its turn.
const MOST_TIMES: f64 = 1000.0;

fn point(axis: Axis, setting: &Setting, report: &Report, seconds: Seconds) -> Point {
    let pixels = u64::from(report.size[0]) * u64::from(report.size[1]);
    let x = match axis {
        Axis::Pixels => pixels as f64,
        Axis::Objects => report.primitives as f64,
        Axis::Lights => report.lights as f64,
        Axis::Bands => setting.bands.unwrap_or(3) as f64,
        Axis::Samples => f64::from(report.spp),
        Axis::Depth => f64::from(setting.depth.unwrap_or(0)),
        Axis::Threads => report.threads as f64,
    };
    Point {
        x,
        pixels,
        samples: report.spp,
        primitives: report.primitives,
        lights: report.lights,
        threads: report.threads,
        bytes: report.bytes,
        stats: report.stats,
        seconds: vec![seconds],
    }
}
