//! One mesh: its builds, then in each round every tracer with each number of threads, taking turns.

use std::hint::black_box;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Barrier};
use std::thread;
use std::time::Instant;

use etendue::interaction::{Hit, Ray};
use etendue::shape::Geometry;
use glam::{DVec3, Vec3};

use crate::arguments::Arguments;
use crate::meshes::{Named, triangles};
use crate::ours;
use crate::peer::{Maker, Peer};
use crate::rays::{Batch, Question, Set, Stage, sets};
use crate::report::{BuildRow, BuildTime, Differences, MeshReport, Ratio, Row, SetReport, Speed};

/// Builds, traces and compares.
pub(crate) fn mesh(
    name: Named,
    geometry: &Arc<Geometry>,
    makers: &[Maker],
    arguments: &Arguments,
) -> Result<MeshReport, String> {
    let (mut builds, mut peers) = (Vec::new(), Vec::new());
    for maker in makers.iter().filter(|m| m.traced || !arguments.once) {
        let (row, made) = build(maker, geometry, arguments.once)?;
        builds.push(row);
        peers.extend(made);
    }
    let mesh = triangles(geometry);
    let normal = |ray: &Ray, hit: &Hit| {
        let corners = mesh.corners(&mesh.triangles[hit.primitive as usize]);
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).normalize_or(DVec3::Z).as_vec3();
        normal * -normal.dot(ray.direction).signum()
    };
    let stage = Stage {
        bounds: mesh.bounds().expect("the mesh is not empty"),
        normal: &normal,
    };
    let sets = sets(&stage, &*peers[0], arguments.rays());
    let (mut reports, mut gains) = (Vec::new(), Vec::new());
    for set in sets.iter().filter(|set| !set.rays.is_empty()) {
        let answering = peers.iter().filter(|p| p.answers(set.question));
        let answering: Vec<&dyn Peer> = answering.map(|p| &**p).collect();
        reports.push(race(set, &answering, arguments.repeat, &mut gains));
    }
    Ok(MeshReport {
        name: name.name(),
        primitives: "triangles",
        triangles: mesh.triangles.len(),
        rays: arguments.rays(),
        rounds: arguments.repeat,
        builds,
        sets: reports,
        arithmetic_gain: median(&gains),
    })
}

/// 1, and 2 where there are as many.
pub(crate) fn thread_counts() -> &'static [usize] {
    match thread::available_parallelism() {
        Ok(n) if n.get() >= 2 => &[1, 2],
        _ => &[1],
    }
}

/// Builds with each number of threads, short ones several times; or `once`.
fn build(
    maker: &Maker,
    geometry: &Arc<Geometry>,
    once: bool,
) -> Result<(BuildRow, Vec<Box<dyn Peer>>), String> {
    /// Seconds after which it is not built once more.
    const ENOUGH: f64 = 0.5;
    let mut row = BuildRow {
        name: maker.name,
        seconds: Vec::new(),
        bytes: 0,
    };
    let mut peers = Vec::new();
    let all = thread_counts();
    let (counts, most) = if once {
        (&all[all.len() - 1..], 1)
    } else {
        (all, 5)
    };
    for &threads in counts {
        let mut times = Vec::new();
        while times.len() < most && times.iter().sum::<f64>() < ENOUGH {
            peers.clear(); // before the next one takes its memory
            let built = (maker.build)(geometry, threads)?;
            times.push(built.seconds);
            (peers, row.bytes) = (built.peers, built.bytes);
        }
        let median = median(&times);
        row.seconds.push(BuildTime { threads, median });
    }
    Ok((row, peers))
}

/// All rounds of one set. Ratios are to the first tracer that is Embree's, else to the first of others.
pub(crate) fn race(set: &Set, peers: &[&dyn Peer], rounds: u32, gains: &mut Vec<f64>) -> SetReport {
    let batches = set.batches();
    let answers: Vec<Answers> = peers
        .iter()
        .map(|p| Answers::of(*p, set, &batches))
        .collect();
    let threads = thread_counts();
    // Seconds by tracer, number of threads and round.
    let mut seconds = vec![vec![Vec::new(); threads.len()]; peers.len()];
    for round in 0..rounds as usize {
        for turn in 0..peers.len() {
            let i = (round + turn) % peers.len();
            for (times, &threads) in seconds[i].iter_mut().zip(threads) {
                times.push(time(peers[i], set.question, &batches, threads));
            }
        }
        gains.extend(arithmetic_gain(threads));
    }
    let names: Vec<String> = peers.iter().map(|p| p.name()).collect();
    let reference = names.iter().position(|n| n == "Embree");
    let reference = reference.or_else(|| names.iter().position(|n| n != ours::NAME));
    let reference = reference.unwrap_or(0);
    let row = |i: usize| Row {
        name: names[i].clone(),
        speeds: (0..threads.len())
            .map(|t| Speed {
                threads: threads[t],
                million_rays_per_second: set.rays.len() as f64 / median(&seconds[i][t]) / 1e6,
                ratio: Ratio::of(&seconds[reference][t], &seconds[i][t]),
            })
            .collect(),
        gain: seconds[i].get(1).map(|two| Ratio::of(&seconds[i][0], two)),
        differences: answers[i].differences(&answers[0]),
    };
    SetReport {
        name: set.name,
        hit: answers[0].hit_share(),
        reference: names[reference].clone(),
        rows: (0..peers.len()).map(row).collect(),
    }
}

/// Where a thread puts what it finds.
#[derive(Default)]
struct Scratch {
    hits: Vec<Hit>,
    blocked: Vec<bool>,
}

impl Scratch {
    fn fill(&mut self, peer: &dyn Peer, question: Question, batch: &Batch<'_>) {
        self.hits.clear();
        self.blocked.clear();
        match question {
            Question::Any => peer.occluded(batch.rays, &mut self.blocked),
            Question::Coherent | Question::Closest => peer.closest(batch, &mut self.hits),
        }
    }
}

/// Seconds for all batches, which the threads take one after another.
fn time(peer: &dyn Peer, question: Question, batches: &[Batch<'_>], threads: usize) -> f64 {
    let next = AtomicUsize::new(0);
    on_each(threads, || {
        let mut scratch = Scratch::default();
        while let Some(batch) = batches.get(next.fetch_add(1, Ordering::Relaxed)) {
            scratch.fill(peer, question, black_box(batch));
            black_box(&scratch.hits);
            black_box(&scratch.blocked);
        }
    })
}

/// Seconds until `work` is done on so many threads, which are there when the time begins.
fn on_each(threads: usize, work: impl Fn() + Sync) -> f64 {
    let ready = Barrier::new(threads);
    thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(|| {
                ready.wait();
                work();
            });
        }
        ready.wait();
        let start = Instant::now();
        work();
        start
    })
    .elapsed()
    .as_secs_f64()
}

/// By how much two threads are faster than one at work that needs no memory: the machine's own limit. It takes
/// as long as a tracer does, for what is over in a few milliseconds says more of the scheduler.
fn arithmetic_gain(threads: &[usize]) -> Option<f64> {
    let work = || {
        let mut x: [f32; 16] = black_box(std::array::from_fn(|i| i as f32));
        for _ in 0..30_000_000 {
            x = x.map(|x| x * 0.75 + 1.0);
        }
        black_box(x);
    };
    let &[one, two] = threads else {
        return None;
    };
    Some(two as f64 * on_each(one, work) / on_each(two, work))
}

/// What a tracer says of each ray of a set.
enum Answers {
    Closest(Vec<Hit>),
    Any(Vec<bool>),
}

impl Answers {
    fn of(peer: &dyn Peer, set: &Set, batches: &[Batch<'_>]) -> Self {
        let (mut scratch, mut hits, mut blocked) = (Scratch::default(), Vec::new(), Vec::new());
        for batch in batches {
            scratch.fill(peer, set.question, batch);
            hits.append(&mut scratch.hits);
            blocked.append(&mut scratch.blocked);
        }
        match set.question {
            Question::Any => Self::Any(blocked),
            Question::Coherent | Question::Closest => Self::Closest(hits),
        }
    }

    /// The share of rays that hit anything.
    fn hit_share(&self) -> f64 {
        let (hit, all) = match self {
            Self::Closest(hits) => (hits.iter().filter(|h| !h.is_miss()).count(), hits.len()),
            Self::Any(blocked) => (blocked.iter().filter(|b| **b).count(), blocked.len()),
        };
        hit as f64 / all as f64
    }

    fn differences(&self, other: &Self) -> Differences {
        /// Relative; t is compared where both hit.
        const TOLERANCE: f32 = 1e-4;
        let mut found = Differences::default();
        match (self, other) {
            (Self::Any(a), Self::Any(b)) => {
                found.hit_or_miss = a.iter().zip(b).filter(|(a, b)| a != b).count();
            }
            (Self::Closest(a), Self::Closest(b)) => {
                for (a, b) in a.iter().zip(b) {
                    let apart = (a.t - b.t).abs() > TOLERANCE * a.t.max(b.t);
                    if a.is_miss() != b.is_miss() {
                        found.hit_or_miss += 1;
                    } else if !a.is_miss() && apart {
                        found.distance += 1;
                    }
                }
            }
            _ => unreachable!("one set has one question"),
        }
        found
    }
}

/// The middle one; the upper of two.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
