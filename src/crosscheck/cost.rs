//! What a side took: seconds of the wall and of the processors, and memory. Both sides are measured alike:
//! seconds by the workers around the same work, the memory by the system.

use std::time::Instant;

use serde::{Deserialize, Serialize};

/// A stretch of time.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Time {
    /// Seconds by the clock on the wall.
    pub seconds: f64,
    /// Seconds of all processors together; absent where the system does not tell.
    pub cpu: Option<f64>,
}

/// A clock that was started.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    wall: Instant,
    cpu: Option<f64>,
}

impl Clock {
    pub(super) fn start() -> Self {
        Self {
            wall: Instant::now(),
            cpu: cpu_seconds(),
        }
    }

    /// Since the start.
    pub(super) fn time(&self) -> Time {
        let now = cpu_seconds();
        Time {
            seconds: self.wall.elapsed().as_secs_f64(),
            cpu: now.zip(self.cpu).map(|(now, then)| now - then),
        }
    }
}

/// What all threads of this process have taken.
#[cfg(unix)]
fn cpu_seconds() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
}

#[cfg(not(unix))]
fn cpu_seconds() -> Option<f64> {
    None
}

/// What one side took for a scene.
#[derive(Clone, Debug, Serialize)]
pub struct Cost {
    /// Name and version of the renderer.
    pub renderer: String,
    /// Seconds from the start of the program until it has loaded the scene, the loading included.
    pub start: f64,
    /// Reading the scene and building its trees.
    pub load: Time,
    /// Rendering, by seed.
    pub render: Vec<Time>,
    /// The most bytes of memory that the process held; absent where the system does not tell.
    pub peak_memory: Option<u64>,
}

impl Cost {
    /// The median over the seeds.
    pub fn seconds(&self) -> f64 {
        median(self.render.iter().map(|t| t.seconds)).unwrap_or(f64::NAN)
    }

    /// The median over the seeds.
    pub fn cpu(&self) -> Option<f64> {
        median(self.render.iter().filter_map(|t| t.cpu))
    }
}

/// How many times as long the first side takes: the median over the seeds, each of which the two sides
/// rendered one after the other, so that what slows the machine for a while slows both.
pub(super) fn ratio(a: &Cost, b: &Cost, of: impl Fn(&Time) -> Option<f64>) -> Option<f64> {
    let pairs = a.render.iter().zip(&b.render);
    median(pairs.filter_map(|(a, b)| Some(of(a)? / of(b)?)))
}

/// The middle value, or the mean of the two; `None` of nothing.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(seconds: &[f64]) -> Cost {
        let time = |s: &f64| Time {
            seconds: *s,
            cpu: None,
        };
        Cost {
            renderer: String::new(),
            start: 0.0,
            load: Time::default(),
            render: seconds.iter().map(time).collect(),
            peak_memory: None,
        }
    }

    #[test]
    fn a_ratio_is_the_median_over_pairs_of_seeds() {
        let (a, b) = (cost(&[2.0, 40.0, 3.0]), cost(&[1.0, 20.0, 1.0]));
        assert_eq!(ratio(&a, &b, |t| Some(t.seconds)), Some(2.0));
        assert_eq!(ratio(&a, &b, |t| t.cpu), None);
        assert_eq!(cost(&[1.0, 4.0]).seconds(), 2.5);
    }

    #[test]
    fn a_clock_counts_work_in_seconds_of_the_processor() {
        let clock = Clock::start();
        let mut x = 1.0_f64;
        while clock.time().seconds < 0.02 {
            x = (x + 1.0).sqrt();
        }
        assert!(x > 1.0);
        if cfg!(unix) {
            assert!(clock.time().cpu > Some(0.0));
        }
    }
}
