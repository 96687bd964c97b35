//! What is measured of a render: counts, the same on every machine, and times, one a repetition.

use serde::{Deserialize, Serialize};

use super::Point;
use crate::render::Seconds;

/// A quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Rays of all kinds.
    Rays,
    /// Shadow rays.
    ShadowRays,
    /// Primitives that camera rays and bounces are tested against.
    FirstTests,
    /// Primitives that shadow rays are tested against.
    ShadowTests,
    /// Nodes that all rays enter.
    NodeSteps,
    /// The same by ray.
    StepsPerRay,
    /// Seconds to load meshes.
    Load,
    /// Seconds to build the tree.
    Build,
    /// Seconds to render.
    Render,
    /// Seconds of threads in the tracer.
    Trace,
    /// Nanoseconds of threads in the tracer by ray.
    TracePerRay,
    /// Seconds of threads in the tracer for shadow rays.
    Shadows,
    /// Seconds of threads in materials, lights and cameras.
    Shade,
    /// Seconds of threads in making pixels of samples.
    Film,
}

impl Quantity {
    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rays => "rays",
            Self::ShadowRays => "shadow rays",
            Self::FirstTests => "primary tests",
            Self::ShadowTests => "shadow tests",
            Self::NodeSteps => "node steps",
            Self::StepsPerRay => "node steps a ray",
            Self::Load => "load, s",
            Self::Build => "build, s",
            Self::Render => "render, s",
            Self::Trace => "trace, s",
            Self::TracePerRay => "trace a ray, ns",
            Self::Shadows => "shadow rays, s",
            Self::Shade => "shade, s",
            Self::Film => "film, s",
        }
    }

    /// The same without its unit.
    pub fn bare_name(self) -> &'static str {
        let name = self.name();
        name.split_once(',').map_or(name, |(bare, _)| bare)
    }

    /// Whether it is counted, so that it is exact and the same everywhere.
    pub fn is_count(self) -> bool {
        use Quantity::{FirstTests, NodeSteps, Rays, ShadowRays, ShadowTests, StepsPerRay};
        matches!(
            self,
            Rays | ShadowRays | FirstTests | ShadowTests | NodeSteps | StepsPerRay
        )
    }

    /// Its values at a point: one for a count, one a repetition for a time.
    pub fn of(self, point: &Point) -> Vec<f64> {
        let stats = &point.stats;
        let (all, shadow) = (&stats.tracing, &stats.shadow_tracing);
        let rays = stats.rays() as f64;
        let count = |n: u64| vec![n as f64];
        let times = |time: &dyn Fn(&Seconds) -> f64| point.seconds.iter().map(time).collect();
        match self {
            Self::Rays => count(stats.rays()),
            Self::ShadowRays => count(stats.shadow_rays),
            Self::FirstTests => count(all.primitive_tests - shadow.primitive_tests),
            Self::ShadowTests => count(shadow.primitive_tests),
            Self::NodeSteps => count(all.node_steps),
            Self::StepsPerRay => vec![all.node_steps as f64 / rays],
            Self::Load => times(&|s| s.load),
            Self::Build => times(&|s| s.build),
            Self::Render => times(&|s| s.render),
            Self::Trace => times(&|s| s.closest + s.occluded),
            Self::TracePerRay => times(&|s| 1e9 * (s.closest + s.occluded) / rays),
            Self::Shadows => times(&|s| s.occluded),
            Self::Shade => times(&|s| s.shade),
            Self::Film => times(&|s| s.film),
        }
    }
}
