//! What is measured: a [`Maker`] builds a tracer over a mesh, a [`Peer`] traces batches with it.

use std::sync::Arc;

use etendue::interaction::{Hit, Ray};
use etendue::shape::Geometry;

use crate::rays::{Batch, Question};

/// One way to trace: a tree, and how it is walked.
pub(crate) trait Peer: Send + Sync {
    /// As in the report.
    fn name(&self) -> String;

    /// Whether it has an answer.
    fn answers(&self, _question: Question) -> bool {
        true
    }

    /// The first hit of each ray; fills `hits`, which is empty.
    fn closest(&self, batch: &Batch<'_>, hits: &mut Vec<Hit>);

    /// Whether anything lies on each ray; fills `blocked`, which is empty.
    fn occluded(&self, rays: &[Ray], blocked: &mut Vec<bool>);
}

/// What a build came to.
pub(crate) struct Built {
    /// Ways to trace with it.
    pub(crate) peers: Vec<Box<dyn Peer>>,
    /// Of the build alone.
    pub(crate) seconds: f64,
    /// Held beside the mesh's own arrays.
    pub(crate) bytes: usize,
}

/// Builds over a mesh, with so many threads.
pub(crate) type Build = dyn Fn(&Arc<Geometry>, usize) -> Result<Built, String>;

/// A builder by its name.
pub(crate) struct Maker {
    pub(crate) name: &'static str,
    /// Whether it gives ways to trace: else only its build is of interest.
    pub(crate) traced: bool,
    pub(crate) build: Box<Build>,
}

/// Runs `work` on a pool of so many threads.
pub(crate) fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads can be started").install(work)
}
