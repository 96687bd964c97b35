//! One image from its parts, with the bits that one run would have given it: the parts of a crop are added in the order
//! of their passes, and crops put side by side. Parts are read as they are added, a crop a thread, so that what stands in
//! memory is the image and the sums of those crops.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use super::adaptive::{self, AdaptiveReport, Given};
use super::memory::{self, Estimate};
use super::origin::{Origin, Outcome};
use super::part::{Head, Piece, Reader, Tail, cover};
use super::provenance::Provenance;
use crate::error::{Error, Problems, Result};
use crate::film::{Accumulator as _, Blocks, Grid, Record, Sums, Tally};
use crate::image::{Image, Metadata, Window};
use crate::integrator::Stats;
use crate::sensor;

/// An image and what it was made of.
#[derive(Debug)]
pub struct Merged {
    /// All that the parts cover.
    pub image: Image,
    /// Where that lies on the film.
    pub window: Window,
    /// How the image was made, for the file.
    pub metadata: Metadata,
    /// What it was made of.
    pub provenance: Provenance,
    /// What was counted.
    pub report: MergeReport,
}

/// What merging did, and what rendering the parts did.
#[derive(Clone, Debug, Serialize)]
pub struct MergeReport {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples a pixel; on average where sampling is adaptive.
    pub spp: u32,
    /// Where samples went, if sampling is adaptive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveReport>,
    /// How many parts there were.
    pub parts: usize,
    /// Passes over the film.
    pub passes: u32,
    /// Rays, steps and tests. Where crops meet, samples of both sides are counted twice.
    pub stats: Stats,
    /// Samples that were not finite and were dropped.
    pub dropped_samples: u64,
    /// Seconds that rendering the parts took, one after another.
    pub render_seconds: f64,
    /// Seconds that merging took.
    pub seconds: f64,
}

/// Makes an image of its parts, which cover the whole film, or `crop` where that is given. It may take `limit` bytes.
///
/// # Errors
/// Names the parts that are damaged, that are of other images, that share passes or pixels, and what no part is of.
pub fn merge(
    parts: &[PathBuf],
    crop: Option<sensor::Window>,
    limit: Option<u64>,
) -> Result<Merged> {
    let began = Instant::now();
    let heads = heads(parts)?;
    let Some(first) = heads.first() else {
        return Err(Error::input("there are no parts to merge"));
    };
    let target = crop.unwrap_or_else(|| first.film.full());
    if !first.film.full().contains(&target) {
        let (width, height) = (first.film.width, first.film.height);
        let message = format!("the crop leaves the film of {width} × {height}");
        return Err(Error::input(message));
    }
    let pieces: Vec<Piece<'_>> = parts
        .iter()
        .zip(&heads)
        .map(|(path, head)| Piece {
            path,
            window: head.film.crop,
            passes: head.passes.clone(),
        })
        .collect();
    let crops = cover(&pieces, &target, first.all_passes)?;
    check_memory(first, &target, crops.keys(), limit)?;

    let names = channels(first);
    let image = Mutex::new(Image::try_new(target.width, target.height, names)?);
    let done = crops
        .into_par_iter()
        .map(|(window, pieces)| {
            let (developed, cost) = develop(first, window, &pieces)?;
            let mut image = image.lock().expect("no thread panics while it pastes");
            paste(
                &mut image,
                &developed,
                [window.x - target.x, window.y - target.y],
            );
            Ok(cost)
        })
        .collect::<Vec<Result<Cost>>>();
    let mut total = Cost::default();
    let mut problems = Problems::default();
    for cost in done {
        if let Some(cost) = problems.take(cost) {
            total.tally.add(&cost.tally);
            total.seconds += cost.seconds;
            total.given.add(&cost.given);
        }
    }
    problems.finish()?;
    let image = image.into_inner().expect("no thread panicked");
    Ok(finish(&heads, &target, image, &total, began))
}

/// What rendering the parts of a crop took.
#[derive(Clone, Copy, Debug, Default)]
struct Cost {
    tally: Tally,
    seconds: f64,
    given: Given,
}

/// What the parts say of themselves, if they are of one image.
fn heads(parts: &[PathBuf]) -> Result<Vec<Head>> {
    let mut problems = Problems::default();
    let mut heads: Vec<Head> = Vec::new();
    let mut first: Option<&Path> = None;
    for path in parts {
        let Some(Reader { head, .. }) = problems.take(Reader::open(path)) else {
            continue;
        };
        if let (Some(first), Some(of_first)) = (first, heads.first())
            && let Some(what) = of_first.difference(&head)
        {
            problems.push(
                Error::input(format!(
                    "{} is a part of another image than {}: {what} differs",
                    path.display(),
                    first.display()
                ))
                .help("merge what the same command rendered, but for --crop and --passes"),
            );
            continue;
        }
        first = first.or(Some(path));
        heads.push(head);
    }
    problems.finish()?;
    Ok(heads)
}

/// Refuses what does not fit: the image, and the sums of as many crops as there are threads.
fn check_memory<'a>(
    first: &Head,
    target: &sensor::Window,
    crops: impl Iterator<Item = &'a sensor::Window>,
    limit: Option<u64>,
) -> Result<()> {
    let channels = first.layout.count();
    let of = |crop: sensor::Window| {
        let film = sensor::Film {
            crop,
            ..first.film.clone()
        };
        memory::film(&film, channels, first.adaptive.is_some())
    };
    let mut sums: Vec<u64> = crops.map(|crop| of(*crop)).collect();
    sums.sort_unstable_by(|a, b| b.cmp(a));
    let at_once: u64 = sums.iter().take(rayon::current_num_threads()).sum();
    let image = 8 * u64::from(target.width) * u64::from(target.height) * channels as u64;
    let estimate = Estimate {
        film: at_once.saturating_add(image),
        ..Estimate::default()
    };
    estimate.check(limit)
}

/// The channels of the image.
fn channels(head: &Head) -> Vec<String> {
    let main = head.film.pixel_format.channels().map(str::to_owned);
    let others = &head.layout.names()[head.layout.others()];
    let noise = ["samples", "error"].map(str::to_owned);
    let noise = noise.into_iter().filter(|_| head.adaptive.is_some());
    main.chain(others.iter().cloned()).chain(noise).collect()
}

/// Adds the parts of a crop and develops them.
fn develop(first: &Head, window: sensor::Window, pieces: &[&Piece<'_>]) -> Result<(Image, Cost)> {
    let film = sensor::Film {
        crop: window,
        ..first.film.clone()
    };
    let mut cost = Cost::default();
    let image = match first.adaptive {
        None => {
            let mut sums = Sums::new(film.shown(), first.layout.clone())?;
            for piece in pieces {
                let reader = Reader::open(piece.path)?;
                cost.spend(add_uniform(&mut sums, reader)?);
            }
            sums.develop(&film)?
        }
        Some(noise) => {
            let grid = Grid::new(&film, first.layout.count());
            let mut blocks = Blocks::new(grid)?;
            for piece in pieces {
                let reader = Reader::open(piece.path)?;
                cost.spend(add_adaptive(&mut blocks, &grid, reader)?);
            }
            cost.given = Given::new(&film, noise.limits, &blocks);
            adaptive::develop(&film, &first.layout, &blocks)?
        }
    };
    Ok((image, cost))
}

impl Cost {
    fn spend(&mut self, tail: Tail) {
        self.tally.add(&tail.tally);
        self.seconds += tail.seconds;
    }
}

/// Adds a part's rectangles, some rows at a time.
fn add_uniform(sums: &mut Sums, mut reader: Reader) -> Result<Tail> {
    /// Numbers read at a time, but for longer rows.
    const CHUNK: usize = 1 << 15;
    let shown = *sums.window();
    let stride = reader.head.layout.stride();
    let mut numbers = Vec::new();
    while let Some(at) = reader.place()? {
        let [x, y, width, height] = at.place;
        let window = sensor::Window {
            x,
            y,
            width,
            height,
        };
        let row = width as usize * stride;
        let size = row.checked_mul(height as usize);
        if !shown.contains(&window) || size != Some(at.count) {
            return Err(reader.damaged("it holds what is not of its crop"));
        }
        let rows = (CHUNK / row).max(1) as u32;
        for first in (0..height).step_by(rows as usize) {
            let some = sensor::Window {
                y: y + first,
                height: rows.min(height - first),
                ..window
            };
            numbers.resize(row * some.height as usize, 0.0);
            reader.numbers(&mut numbers)?;
            sums.add_rectangle(&some, &numbers, 1.0);
        }
    }
    reader.finish()
}

/// Adds a part's halves of blocks.
fn add_adaptive(blocks: &mut Blocks, grid: &Grid, mut reader: Reader) -> Result<Tail> {
    while let Some(at) = reader.place()? {
        let slot = at.place[0] as usize;
        if slot >= 2 * grid.blocks() {
            return Err(reader.damaged("it holds what is not of its crop"));
        }
        let mut record = Record::new(grid, slot);
        if record.numbers().len() != at.count {
            return Err(reader.damaged("it holds what is not of its film"));
        }
        reader.numbers(record.numbers_mut())?;
        blocks.add(&(vec![record], Tally::default()));
    }
    reader.finish()
}

/// Puts an image into a larger one of the same channels.
fn paste(whole: &mut Image, part: &Image, [x, y]: [u32; 2]) {
    let channels = whole.channels().len();
    let (width, row) = (whole.width() as usize, part.width() as usize * channels);
    for (i, pixels) in part.data().chunks_exact(row).enumerate() {
        let first = ((y as usize + i) * width + x as usize) * channels;
        whole.data_mut()[first..][..row].copy_from_slice(pixels);
    }
}

fn finish(
    heads: &[Head],
    target: &sensor::Window,
    image: Image,
    total: &Cost,
    began: Instant,
) -> Merged {
    let first = &heads[0];
    let adaptive = first
        .adaptive
        .map(|noise| total.given.report(noise.threshold, noise.limits));
    let outcome = Outcome {
        spp: adaptive
            .as_ref()
            .map_or(first.spp, |adaptive| adaptive.mean_spp.round() as u32),
        samples_complete: adaptive.as_ref().map_or(first.spp, |a| a.limits[0]),
        adaptive: adaptive.as_ref(),
        foveated: None,
    };
    let mut machines: Vec<&str> = heads
        .iter()
        .map(|head| head.origin.machine.as_str())
        .collect();
    machines.sort_unstable();
    machines.dedup();
    let origin = Origin {
        machine: machines.join("; "),
        ..first.origin.clone()
    };
    let metadata = origin.metadata(&outcome);
    let spp = outcome.spp;
    Merged {
        window: Window {
            x: target.x,
            y: target.y,
            full_width: first.film.width,
            full_height: first.film.height,
        },
        metadata,
        provenance: Provenance::new(first.fingerprint.clone(), *target),
        report: MergeReport {
            width: image.width(),
            height: image.height(),
            spp,
            adaptive,
            parts: heads.len(),
            passes: first.all_passes,
            stats: total.tally.stats,
            dropped_samples: total.tally.dropped,
            render_seconds: total.seconds,
            seconds: began.elapsed().as_secs_f64(),
        },
        image,
    }
}
