//! What light transport costs: [`Stats`] are counted and the same on every machine, times are not. An integrator
//! asks the scene through [`Cost`], the one place where rays are counted by kind and tracing is timed.

use std::time::{Duration, Instant};

use crate::accel::{Counts, Order};
use crate::color::ColorModel;
use crate::interaction::{Hit, Ray};
use crate::scene::Scene;

/// What light transport costs, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Stats {
    /// Rays from the camera.
    pub camera_rays: u64,
    /// Rays that continue a path.
    pub bounce_rays: u64,
    /// Rays that ask whether a light is visible.
    pub shadow_rays: u64,
    /// Points whose material was asked.
    pub shaded: u64,
    /// Steps and tests of all rays.
    pub tracing: Counts,
    /// Those of them that shadow rays took.
    #[serde(default)]
    pub shadow_tracing: Counts,
}

impl Stats {
    /// Rays of all kinds.
    pub fn rays(&self) -> u64 {
        self.camera_rays + self.bounce_rays + self.shadow_rays
    }

    /// Adds another part's counts.
    pub fn add(&mut self, other: &Self) {
        self.camera_rays += other.camera_rays;
        self.bounce_rays += other.bounce_rays;
        self.shadow_rays += other.shadow_rays;
        self.shaded += other.shaded;
        self.tracing.add(&other.tracing);
        self.shadow_tracing.add(&other.shadow_tracing);
    }
}

/// What an integrator's work has cost so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// The counts.
    pub stats: Stats,
    /// Time in the tracer for camera rays and bounces.
    pub closest: Duration,
    /// Time in the tracer for shadow rays.
    pub occluded: Duration,
}

impl Cost {
    /// The first hits of rays that have bounced `depth` times.
    pub(super) fn closest<C: ColorModel>(
        &mut self,
        scene: &Scene<C>,
        depth: u32,
        rays: &[Ray],
        hits: &mut Vec<Hit>,
    ) {
        let begin = Instant::now();
        let stats = &mut self.stats;
        let kind = match depth {
            0 => &mut stats.camera_rays,
            _ => &mut stats.bounce_rays,
        };
        *kind += rays.len() as u64;
        // A camera's rays come pixel by pixel.
        let order = match depth {
            0 => Order::Coherent,
            _ => Order::Any,
        };
        scene.closest(rays, order, hits, &mut stats.tracing);
        self.closest += begin.elapsed();
    }

    /// The first hits of shadow rays, which may go on behind them.
    pub(super) fn segments<C: ColorModel>(
        &mut self,
        scene: &Scene<C>,
        rays: &[Ray],
        hits: &mut Vec<Hit>,
    ) {
        let begin = Instant::now();
        let stats = &mut self.stats;
        stats.shadow_rays += rays.len() as u64;
        let mut counts = Counts::default();
        scene.closest(rays, Order::Any, hits, &mut counts);
        stats.tracing.add(&counts);
        stats.shadow_tracing.add(&counts);
        self.occluded += begin.elapsed();
    }

    /// Whether anything lies on each shadow ray.
    pub(super) fn occluded<C: ColorModel>(
        &mut self,
        scene: &Scene<C>,
        rays: &[Ray],
        blocked: &mut Vec<bool>,
    ) {
        let begin = Instant::now();
        let stats = &mut self.stats;
        stats.shadow_rays += rays.len() as u64;
        let mut counts = Counts::default();
        scene.occluded(rays, Order::Any, blocked, &mut counts);
        stats.tracing.add(&counts);
        stats.shadow_tracing.add(&counts);
        self.occluded += begin.elapsed();
    }
}
