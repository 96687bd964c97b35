//! Étendue, by its public name.

use std::sync::Arc;
use std::time::Instant;

use etendue::accel::{Counts, Method, Order, Tracer};
use etendue::interaction::{Hit, Ray};
use etendue::shape::Geometry;

use crate::peer::{Built, Maker, Peer, on_threads};
use crate::rays::Batch;

pub(crate) const NAME: &str = "Étendue";

pub(crate) fn makers() -> Vec<Maker> {
    vec![Maker {
        name: NAME,
        traced: true,
        build: Box::new(|geometry, threads| {
            let start = Instant::now();
            let tracer = on_threads(threads, || tracer(geometry));
            let seconds = start.elapsed().as_secs_f64();
            let bytes = tracer.tree_bytes();
            Ok(Built {
                peers: vec![Box::new(Ours(tracer))],
                seconds,
                bytes,
            })
        }),
    }]
}

/// A tracer over one mesh.
pub(crate) fn tracer(geometry: &Arc<Geometry>) -> Tracer {
    Tracer::new(vec![geometry.clone()], &[0], Vec::new(), Method::Tree)
}

/// As a peer.
pub(crate) fn peer(tracer: Tracer) -> Box<dyn Peer> {
    Box::new(Ours(tracer))
}

struct Ours(Tracer);

impl Peer for Ours {
    fn name(&self) -> String {
        NAME.to_owned()
    }

    fn closest(&self, batch: &Batch<'_>, hits: &mut Vec<Hit>) {
        self.0
            .closest(batch.rays, Order::Any, hits, &mut Counts::default());
    }

    fn occluded(&self, rays: &[Ray], blocked: &mut Vec<bool>) {
        self.0
            .occluded(rays, Order::Any, blocked, &mut Counts::default());
    }
}
