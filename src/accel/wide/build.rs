//! The binary tree: obvhs's PLOC (Meister and Bittner, *Parallel locally-ordered clustering for bounding
//! volume hierarchy construction*, 2018) with reinsertion (the same, *Parallel reinsertion for bounding
//! volume hierarchy optimization*, 2018).
//!
//! obvhs 0.4 builds a chain, in quadratic time, over boxes that have one centre; so it is given one box for
//! all of those, and they are halved by size below it. A tree that comes out deep all the same is
//! halved by position instead.

use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use crate::accel::Build;
use crate::shape::Bounds;

/// The most levels of a binary tree.
const DEEPEST: u32 = 256;

/// A binary tree whose leaves are single items.
#[derive(Debug)]
pub(super) struct Binary {
    /// The root comes first, and children in pairs. What is below a node's children follows upon them:
    /// first what is below the second, then what is below the first.
    pub(super) nodes: Vec<Bvh2Node>,
}

/// The tree over these boxes; none over none.
pub(super) fn binary(boxes: &[Bounds], work: Build) -> Option<Binary> {
    if boxes.is_empty() {
        return None;
    }
    let mut items = by_centre(boxes);
    let mut tree = clustered(boxes, &mut items, work);
    tree.reorder_in_stack_traversal_order();
    if depth(&tree.nodes) > DEEPEST {
        let mut all: Vec<u32> = (0..boxes.len() as u32).collect();
        tree.nodes = vec![Bvh2Node::default()];
        halve(boxes, &mut all, 0, &mut tree.nodes);
        tree.reorder_in_stack_traversal_order();
    }
    Some(Binary { nodes: tree.nodes })
}

/// Items whose boxes have one centre, next to each other: the items, and where each run begins.
struct Runs {
    items: Vec<u32>,
    starts: Vec<u32>,
}

fn by_centre(boxes: &[Bounds]) -> Runs {
    let hasher = BuildHasherDefault::<DefaultHasher>::default();
    let mut keys: Vec<(u64, u32)> = (boxes.par_iter().zip(0..boxes.len() as u32))
        .map(|(Bounds { min, max }, item)| {
            let centre = (0.5 * *min + 0.5 * *max).to_array();
            (hasher.hash_one(centre.map(|c| (c + 0.0).to_bits())), item)
        })
        .collect();
    keys.par_sort_unstable();
    // Each run where its first item stands, for neighbours in a file are neighbours in space.
    let mut runs: Vec<&[(u64, u32)]> = keys.chunk_by(|a, b| a.0 == b.0).collect();
    if runs.len() == boxes.len() {
        let all: Vec<u32> = (0..boxes.len() as u32).collect();
        return Runs {
            starts: all.clone(),
            items: all,
        };
    }
    runs.par_sort_unstable_by_key(|run| run[0].1);
    let mut all = Runs {
        items: Vec::with_capacity(boxes.len()),
        starts: Vec::with_capacity(runs.len()),
    };
    for run in runs {
        all.starts.push(all.items.len() as u32);
        all.items.extend(run.iter().map(|(_, item)| item));
    }
    all
}

fn union(boxes: &[Bounds], items: &[u32]) -> Bounds {
    let boxes = items.iter().map(|item| boxes[*item as usize]);
    boxes.fold(Bounds::EMPTY, Bounds::union)
}

fn aabb(bounds: &Bounds) -> Aabb {
    Aabb {
        min: Vec3A::from(bounds.min),
        max: Vec3A::from(bounds.max),
    }
}

fn clustered(boxes: &[Bounds], runs: &mut Runs, work: Build) -> Bvh2 {
    let count = runs.starts.len();
    let ends = |run: usize| {
        runs.starts
            .get(run + 1)
            .map_or(boxes.len(), |s| *s as usize)
    };
    let ranges = (0..count).map(|run| runs.starts[run] as usize..ends(run));
    let ranges: Vec<_> = ranges.collect();
    // Areas of very large boxes overflow, and those of very small ones vanish.
    let whole = union(boxes, &runs.items);
    let largest = whole.min.abs().max(whole.max.abs()).max_element();
    let odd = !(1e-6..1e12).contains(&largest) && largest > 0.0;
    let scale = if odd {
        Vec3A::splat(1.0 / largest)
    } else {
        Vec3A::ONE
    };
    let aabbs: Vec<Aabb> = (ranges.par_iter())
        .map(|range| {
            let Aabb { min, max } = aabb(&union(boxes, &runs.items[range.clone()]));
            Aabb {
                min: min * scale,
                max: max * scale,
            }
        })
        .collect();
    // As obvhs's own presets of these names, but for those of its steps that make leaves.
    let (distance, precision, first_levels, share) = match work {
        Build::Fast => (PlocSearchDistance::Low, SortPrecision::U64, 2, 0.02),
        Build::Medium => (PlocSearchDistance::Medium, SortPrecision::U64, 3, 0.05),
        Build::Slow => (PlocSearchDistance::High, SortPrecision::U128, 2, 0.2),
    };
    let indices = (0..count as u32).collect();
    let mut tree =
        PlocBuilder::with_capacity(count).build(distance, &aabbs, indices, precision, first_levels);
    ReinsertionOptimizer::default().run(&mut tree, share, None);
    drop(aabbs);
    for node in 0..tree.nodes.len() {
        if tree.nodes[node].is_leaf() {
            let run = tree.primitive_indices[tree.nodes[node].first_index as usize] as usize;
            let range = ranges[run].clone();
            if let [item] = runs.items[range.clone()] {
                tree.nodes[node] = Bvh2Node::new(aabb(&boxes[item as usize]), 1, item);
                continue;
            }
            halve(boxes, &mut runs.items[range], node, &mut tree.nodes);
        }
    }
    tree.parents = Vec::new();
    tree.primitive_indices = Vec::new();
    if odd {
        tree.reorder_in_stack_traversal_order();
        tree.refit_all();
    }
    tree
}

/// Puts a tree over some items in the place of a node: halved by position along the longest axis, or by
/// size where all are in one place.
fn halve(boxes: &[Bounds], items: &mut [u32], place: usize, nodes: &mut Vec<Bvh2Node>) {
    let mut left = vec![(items, place)];
    while let Some((items, place)) = left.pop() {
        let bounds = union(boxes, items);
        if let [item] = items {
            nodes[place] = Bvh2Node::new(aabb(&bounds), 1, *item);
            continue;
        }
        let centre = |item: u32| {
            let Bounds { min, max } = boxes[item as usize];
            0.5 * min + 0.5 * max
        };
        let mut centres = Bounds::EMPTY;
        for item in items.iter() {
            centres = centres.with(centre(*item));
        }
        let extent = centres.max - centres.min;
        let longest = (0..3).fold(0, |best, axis| {
            if extent[axis] > extent[best] {
                axis
            } else {
                best
            }
        });
        let size = |item: u32| (boxes[item as usize].max - boxes[item as usize].min).dot(Vec3::ONE);
        let key = |item: u32| {
            if extent[longest] > 0.0 {
                centre(item)[longest]
            } else {
                size(item)
            }
        };
        let middle = items.len() / 2;
        items.select_nth_unstable_by(middle, |a, b| key(*a).total_cmp(&key(*b)).then(a.cmp(b)));
        let (low, high) = items.split_at_mut(middle);
        let children = nodes.len();
        nodes[place] = Bvh2Node::new(aabb(&bounds), 0, children as u32);
        nodes.extend([Bvh2Node::default(); 2]);
        left.extend([(low, children), (high, children + 1)]);
    }
}

/// Levels of a tree whose parents stand before their children.
fn depth(nodes: &[Bvh2Node]) -> u32 {
    let mut depths = vec![0_u32; nodes.len()];
    let mut deepest = 0;
    for (i, node) in nodes.iter().enumerate() {
        deepest = deepest.max(depths[i]);
        if !node.is_leaf() {
            let child = node.first_index as usize;
            let level = depths[i] + 1;
            depths[child..child + 2].fill(level);
        }
    }
    deepest + 1
}
