//! The machine's own noise and limits: a loop of additions and multiplications, each of which waits for the one
//! before, in registers alone, so that nothing but the processor can delay it. Its times spread as the machine
//! is noisy; threads that wait for a processor are found by their processor time, which stands still meanwhile;
//! and the loop on several threads says by how much the machine is faster with them at best.

use std::hint::black_box;
use std::sync::Barrier;
use std::thread;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::fit::median;
use crate::render::pin;

/// A wider spread of the loop's times is too noisy; a smaller one is what medians and intervals are for.
const MOST_SPREAD: f64 = 0.15;
/// A larger part of the time without a processor is too noisy.
const MOST_WAITING: f64 = 0.03;

/// What the loops say of the machine during a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Median seconds of the loop on one thread.
    pub seconds: f64,
    /// Threads of the wide loop.
    pub threads: usize,
    /// How many times as much so many threads do in the same time.
    pub gain: f64,
    /// How far the ninth of ten times is from the first of ten, in parts of the median: the larger of one
    /// thread's and all threads'.
    pub spread: f64,
    /// The part of the loops' time in which threads waited for a processor; absent where the system does not
    /// tell.
    pub waiting: Option<f64>,
    /// How many loops there were of each width.
    pub loops: usize,
}

impl Noise {
    /// Why times mean little, if so.
    pub fn warning(&self) -> Option<String> {
        let percent = |part: f64| format!("{:.0} %", 100.0 * part);
        if let Some(waiting) = self.waiting.filter(|part| *part > MOST_WAITING) {
            return Some(format!(
                "the machine is busy: {} of the time, threads of the arithmetic loop waited for a processor",
                percent(waiting)
            ));
        }
        (self.spread > MOST_SPREAD).then(|| {
            format!(
                "the machine is noisy: times of the arithmetic loop spread over {}",
                percent(self.spread)
            )
        })
    }
}

/// Times of loops so far.
#[derive(Debug)]
pub(super) struct Loops {
    threads: usize,
    iterations: u64,
    one: Vec<f64>,
    all: Vec<f64>,
    /// Seconds on a processor, and seconds.
    shares: Vec<(f64, f64)>,
}

impl Loops {
    /// Finds out how long a loop must be to take so many seconds.
    pub(super) fn new(threads: usize, seconds: f64) -> Self {
        const TRIAL: u64 = 1 << 20;
        let fastest = (0..5)
            .map(|_| one(TRIAL).seconds)
            .fold(f64::INFINITY, f64::min);
        Self {
            threads,
            iterations: (TRIAL as f64 * seconds / fastest.max(1e-6)) as u64,
            one: Vec::new(),
            all: Vec::new(),
            shares: Vec::new(),
        }
    }

    /// Goes once around on one thread and once on all.
    pub(super) fn run(&mut self) {
        for threads in [1, self.threads] {
            let laps = laps(threads, self.iterations);
            let end = |lap: &Lap| lap.begun + lap.seconds;
            let begin = laps
                .iter()
                .map(|lap| lap.begun)
                .fold(f64::INFINITY, f64::min);
            let seconds = laps.iter().map(end).fold(0.0, f64::max) - begin;
            let times = if threads == 1 {
                &mut self.one
            } else {
                &mut self.all
            };
            times.push(seconds);
            let on_processor = laps.iter().map(|lap| lap.cpu.map(|cpu| (cpu, lap.seconds)));
            self.shares.extend(on_processor.flatten());
        }
        if self.threads == 1 {
            self.all.clone_from(&self.one);
        }
    }

    pub(super) fn noise(&self) -> Noise {
        let (seconds, all) = (median(&self.one), median(&self.all));
        let (on, total) =
            (self.shares.iter()).fold((0.0, 0.0), |sum, share| (sum.0 + share.0, sum.1 + share.1));
        Noise {
            seconds,
            threads: self.threads,
            gain: self.threads as f64 * seconds / all,
            spread: spread(&self.one).max(spread(&self.all)),
            waiting: (total > 0.0).then(|| (1.0 - on / total).max(0.0)),
            loops: self.one.len(),
        }
    }
}

/// From the first of ten to the ninth, in parts of the median.
fn spread(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    let at = |tenths: usize| {
        sorted
            .get((last * tenths + 5) / 10)
            .copied()
            .unwrap_or(f64::NAN)
    };
    (at(9) - at(1)) / median(times)
}

/// One thread's way through the loop.
#[derive(Clone, Copy, Debug)]
struct Lap {
    /// Seconds since all were ready.
    begun: f64,
    seconds: f64,
    /// Seconds on a processor.
    cpu: Option<f64>,
}

/// The loop on so many threads, which have all been started before the first begins.
fn laps(threads: usize, iterations: u64) -> Vec<Lap> {
    let ready = Barrier::new(threads);
    let origin = Instant::now();
    thread::scope(|scope| {
        let begin = |index: usize| {
            let ready = &ready;
            scope.spawn(move || {
                pin(index);
                ready.wait();
                let begun = origin.elapsed().as_secs_f64();
                Lap {
                    begun,
                    ..one(iterations)
                }
            })
        };
        let running: Vec<_> = (0..threads).map(begin).collect();
        let end = |thread: thread::ScopedJoinHandle<'_, Lap>| thread.join().expect("it only adds");
        running.into_iter().map(end).collect()
    })
}

/// The loop on this thread.
fn one(iterations: u64) -> Lap {
    let (begin, cpu) = (Instant::now(), thread_seconds());
    let mut x = black_box(1.0_f64);
    for _ in 0..iterations {
        x = x * 0.75 + 1.0;
    }
    black_box(x);
    Lap {
        begun: 0.0,
        seconds: begin.elapsed().as_secs_f64(),
        cpu: cpu.and_then(|before| Some(thread_seconds()? - before)),
    }
}

/// Seconds that this thread has been on a processor.
fn thread_seconds() -> Option<f64> {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
    }
    #[cfg(not(unix))]
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(spread: f64, waiting: f64) -> Noise {
        Noise {
            seconds: 0.06,
            threads: 2,
            gain: 2.0,
            spread,
            waiting: Some(waiting),
            loops: 9,
        }
    }

    #[test]
    fn a_calm_machine_is_not_warned_of_and_a_busy_one_is_called_so() {
        assert_eq!(noise(0.01, 0.001).warning(), None);
        assert!(noise(0.5, 0.0).warning().unwrap().contains("noisy"));
        // A neighbour that never pauses spreads nothing.
        assert!(noise(0.0, 0.3).warning().unwrap().contains("busy"));
    }

    #[test]
    fn the_loops_take_turns_and_are_counted() {
        let mut loops = Loops::new(2, 1e-3);
        for _ in 0..3 {
            loops.run();
        }
        let noise = loops.noise();
        assert_eq!((noise.loops, noise.threads), (3, 2));
        assert!(noise.seconds > 0.0 && noise.gain > 0.0);
    }

    #[test]
    fn the_spread_leaves_out_the_first_and_the_last_of_ten() {
        let mut times: Vec<f64> = (0..11).map(|i| 1.0 + 0.01 * f64::from(i)).collect();
        times[10] = 9.0;
        assert!((spread(&times) - 0.08 / 1.05).abs() < 1e-12);
    }
}
