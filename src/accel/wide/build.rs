//! Building a tree: the items are cut into chunks, and each chunk is clustered, or sorted, and planned by itself, on one thread
//! and in little memory. What is kept of it is 16 bytes an item and its [crown](super::crown); once the crowns have been
//! joined it is known as how many children each of their subtrees is wanted, and the sketches are drawn. Nothing of
//! this depends on the number of threads.

use obvhs::bvh2::node::Bvh2Node;
use obvhs::ploc::PlocBuilder;
use rayon::prelude::*;

use super::Leaves;
use super::assembly::Sketches;
use super::binary::binary;
use super::chunks::{Chunks, chunks, most};
use super::collapse::{Collapse, Plan};
use super::crown::{Crown, Top, top};
use super::morton::{self, Curved, curved};
use crate::accel::Build;
use crate::shape::Bounds;

/// The tree over at least one item, without its boxes.
pub(super) fn build(boxes: &[Bounds], leaves: &impl Leaves, work: Build) -> Sketches {
    build_in(most(boxes.len()), boxes, leaves, work)
}

/// The same in chunks of so many items at most.
pub(super) fn build_in(
    most: usize,
    boxes: &[Bounds],
    leaves: &impl Leaves,
    work: Build,
) -> Sketches {
    let Chunks { cuts, items } = chunks(boxes, most);
    let several = items.len() > 1;
    let planned = items
        .into_par_iter()
        .map_init(PlocBuilder::new, |ploc, items| {
            let Curved { nodes, runs } = match work {
                Build::Quick if items.len() <= morton::MOST => {
                    curved(boxes, &items, |item| leaves.is_triangle(item))
                }
                _ => Curved {
                    nodes: binary(boxes, &items, work, ploc),
                    runs: Vec::new(),
                },
            };
            let alone =
                |leaf: &Bvh2Node| leaf.prim_count == 1 && !leaves.is_triangle(leaf.first_index);
            let (collapse, plans) =
                Collapse::new(&nodes, runs, |leaf| Plan::leaf(leaf, alone(leaf)));
            (collapse, several.then(|| Crown::new(&nodes, &plans)))
        });
    let (collapses, crowns): (Vec<Collapse>, Vec<Option<Crown>>) = planned.unzip();
    let crowns: Vec<Crown> = crowns.into_iter().flatten().collect();
    let top = several.then(|| top(cuts, &crowns, work));
    let drawn = (collapses.into_par_iter().enumerate()).map(|(chunk, collapse)| match &top {
        Some(Top { slots, .. }) => {
            let roots = crowns[chunk].roots.iter().copied();
            collapse.subtrees(&roots.zip(slots[chunk].iter().copied()).collect::<Vec<_>>())
        }
        None => collapse.sketch(),
    });
    Sketches {
        parts: drawn.collect(),
        top: top.map(|top| top.sketch),
    }
}
