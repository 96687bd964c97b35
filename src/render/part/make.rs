//! Rendering a part: some passes over the job's crop, into a file.

use std::convert::Infallible;
use std::io::{self, Write};
use std::iter;
use std::path::Path;
use std::time::Instant;

use super::super::adaptive::{self, Ladder, Rest};
use super::super::plan::Completed;
use super::super::prepare::Job;
use super::super::progress::{Phase, Progress};
use super::super::{uniform, unit};
use super::write::Writer;
use super::{Head, Tail};
use crate::color::ColorModel;
use crate::error::Result;
use crate::file;
use crate::film::{Accumulator as _, Blocks, Grid, Sums, Tally};
use crate::sensor::Window;

/// What became of a part; its file is there if it is whole.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Made {
    pub(in super::super) completed: Completed,
    pub(in super::super) tally: Tally,
}

/// What a part is written to.
type Out<'a> = Writer<&'a mut (dyn Write + Send)>;

/// Renders the passes that the head tells, of adaptive samples where their ladder is given.
pub(in super::super) fn make<C: ColorModel>(
    job: &Job<'_, C>,
    head: &Head,
    ladder: Option<&Ladder>,
    path: &Path,
    progress: &dyn Progress,
) -> Result<Made> {
    match ladder {
        None => uniformly(job, head, path, progress),
        Some(ladder) => adaptively(job, head, ladder, path, progress),
    }
}

/// Writes the file with what `fill` makes, if that is whole.
fn written(
    path: &Path,
    head: &Head,
    fill: impl FnOnce(&mut Out<'_>) -> io::Result<Made>,
) -> Result<Made> {
    let began = Instant::now();
    let mut made = None;
    let result = file::stream_atomically(path, |file| {
        let mut writer = Writer::begin(file, head)?;
        let Made { completed, tally } = *made.insert(fill(&mut writer)?);
        match completed.is_whole() {
            true => writer.finish(&Tail {
                tally,
                seconds: began.elapsed().as_secs_f64(),
            }),
            false => Err(io::ErrorKind::Interrupted.into()),
        }
    });
    match made {
        Some(made) if !made.completed.is_whole() => Ok(made),
        made => result.map(|()| made.expect("what was written was made")),
    }
}

/// The same number of samples for every pixel.
fn uniformly<C: ColorModel>(
    job: &Job<'_, C>,
    head: &Head,
    path: &Path,
    progress: &dyn Progress,
) -> Result<Made> {
    let film = &job.view.film;
    let plan = job.plan(head.spp);
    let units = plan.units_of(head.passes.clone());
    let shown = film.shown();
    let mut sums = match head.passes.start {
        0 => Some(Sums::new(shown, job.layout())?),
        _ => None,
    };
    let before = plan.samples(units.start);
    progress.begin(Phase::Render, plan.samples(units.end) - before);
    written(path, head, |writer| {
        let mut tally = Tally::default();
        let take = |part: Sums| {
            tally.add(&part.tally);
            match &mut sums {
                Some(sums) => sums.add(&part),
                None => {
                    let (window, rows) = part.rows_within(&shown);
                    writer.record(place(&window), rows)?;
                }
            }
            Ok::<_, io::Error>(())
        };
        let next = unit::run(units.clone(), progress, take, |unit| {
            uniform::render_unit(job, &plan, unit, progress)
        })?;
        let completed = plan.completed(next).since(&plan.completed(units.start));
        let completed = Completed {
            passes: [completed.passes[0], head.passes.len() as u32],
            units: [completed.units[0], units.len()],
            ..completed
        };
        if let (Some(sums), true) = (&sums, completed.is_whole()) {
            writer.record(place(&shown), iter::once(sums.data()))?;
        }
        Ok(Made { completed, tally })
    })
}

fn place(window: &Window) -> [u32; 4] {
    [window.x, window.y, window.width, window.height]
}

/// As many samples as the noise asks for. What that is the pilots say, so that they are made whichever passes are wanted;
/// what they cost counts where they are among these.
fn adaptively<C: ColorModel>(
    job: &Job<'_, C>,
    head: &Head,
    ladder: &Ladder,
    path: &Path,
    progress: &dyn Progress,
) -> Result<Made> {
    let grid = Grid::new(&job.view.film, job.layout().count());
    let mut blocks = match head.passes.start {
        0 => Some(Blocks::new(grid)?),
        _ => None,
    };
    let pilots = grid.tiles();
    let mut steps = vec![0; 2 * grid.blocks()];
    written(path, head, |writer| {
        progress.begin(
            Phase::Render,
            adaptive::pilot_samples(&grid, ladder, 0..pilots),
        );
        let take = |part: adaptive::Part| {
            for record in &part.0 {
                steps[record.slot] = record.step() as usize;
            }
            if let Some(blocks) = &mut blocks {
                blocks.add(&part);
            }
            Ok::<_, Infallible>(())
        };
        let Ok(next) = unit::run(0..pilots, progress, take, |tile| {
            adaptive::pilot(job, ladder, &grid, tile, progress)
        });
        let passes = head.passes.len() as u32;
        if next < pilots {
            let completed = Completed {
                samples: 0,
                passes: [0, passes],
                units: [next, pilots + 1],
            };
            let tally = Tally::default();
            return Ok(Made { completed, tally });
        }
        let rest = Rest::new(&grid, ladder, steps);
        let units = rest.units_of(head.passes.start.saturating_sub(1)..head.passes.end - 1);
        progress.begin(Phase::Render, rest.samples(&grid, units.clone()));
        let mut tally = Tally::default();
        let take = |part: adaptive::Part| {
            match &mut blocks {
                Some(blocks) => blocks.add(&part),
                None => {
                    tally.add(&part.1);
                    for record in &part.0 {
                        let runs = iter::once(record.numbers());
                        writer.record([record.slot as u32, 0, 0, 0], runs)?;
                    }
                }
            }
            Ok::<_, io::Error>(())
        };
        let next = unit::run(units.clone(), progress, take, |unit| {
            rest.render(job, ladder, &grid, unit, progress)
        })?;
        let whole = next == units.end;
        let completed = Completed {
            samples: if whole { ladder.limits()[0] } else { 0 },
            passes: [if whole { passes } else { 0 }, passes],
            units: [pilots + next - units.start, pilots + units.len()],
        };
        if let Some(blocks) = &blocks {
            tally = *blocks.tally();
            for (slot, numbers) in blocks.records().enumerate() {
                writer.record([slot as u32, 0, 0, 0], iter::once(numbers))?;
            }
        }
        Ok(Made { completed, tally })
    })
}
