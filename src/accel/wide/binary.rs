//! The binary tree: obvhs's PLOC (Meister and Bittner, *Parallel locally-ordered clustering for bounding
//! volume hierarchy construction*, 2018) with reinsertion (the same, *Parallel reinsertion for bounding
//! volume hierarchy optimization*, 2018).
//!
//! obvhs 0.4 builds a chain, in quadratic time, over boxes that have one centre; so it is given one box for
//! all of those, and they are halved by size below it. A tree that comes out deep all the same is
//! halved by position instead.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::accel::Build;
use crate::shape::Bounds;

/// The most levels of a binary tree.
pub(super) const DEEPEST: u32 = 256;
/// So many items with one centre are a crowd.
const CROWD: usize = 8;

/// A binary tree whose leaves are single items: the root comes first, and children in pairs, after their
/// parents. There is at least one item.
pub(super) fn binary(
    boxes: &[Bounds],
    items: &[u32],
    work: Build,
    builder: &mut PlocBuilder,
) -> Vec<Bvh2Node> {
    let mut runs = by_centre(boxes, items);
    let mut tree = clustered(boxes, &mut runs, work, builder);
    if depth_first(&mut tree) > DEEPEST {
        tree.nodes = vec![Bvh2Node::default()];
        halve(boxes, &mut runs.items, 0, &mut tree.nodes);
        depth_first(&mut tree);
    }
    tree.nodes
}

/// Brings the nodes into depth-first order; how many levels they have.
pub(super) fn depth_first(tree: &mut Bvh2) -> u32 {
    tree.reorder_in_stack_traversal_order();
    depth(&tree.nodes)
}

/// Items whose boxes have one centre, next to each other: the items, and where each run begins.
struct Runs {
    items: Vec<u32>,
    starts: Vec<u32>,
}

/// The middle of a box.
pub(super) fn centre(Bounds { min, max }: &Bounds) -> Vec3 {
    0.5 * *min + 0.5 * *max
}

/// Gathers crowds. Others are left alone, even if two or three have one centre.
fn by_centre(boxes: &[Bounds], items: &[u32]) -> Runs {
    let key = |item: u32| {
        let bits = centre(&boxes[item as usize]).to_array();
        let bits = bits.map(|c| u64::from((c + 0.0).to_bits()));
        bits.into_iter().fold(0_u64, |hash, bits| {
            (hash.rotate_left(29) ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        })
    };
    // Those that hash like one before them are few, as a rule.
    let size = (16 * items.len()).next_power_of_two();
    let mut seen = vec![0_u64; size.div_ceil(64)];
    let mut suspects = Vec::new();
    for item in items {
        let key = key(*item);
        let bit = (key >> 20) as usize & (size - 1);
        if seen[bit / 64] >> (bit % 64) & 1 == 1 {
            suspects.push(key);
        }
        seen[bit / 64] |= 1 << (bit % 64);
    }
    suspects.sort_unstable();
    let mut crowds = suspects.chunk_by(|a, b| a == b);
    if !crowds.any(|crowd| crowd.len() >= CROWD) {
        return Runs {
            items: items.to_vec(),
            starts: (0..items.len() as u32).collect(),
        };
    }
    let mut keys: Vec<(u64, u32)> = items.iter().map(|item| (key(*item), *item)).collect();
    keys.sort_unstable();
    // Each run where its first item stands, for neighbours in a file are neighbours in space.
    let mut runs: Vec<&[(u64, u32)]> = keys.chunk_by(|a, b| a.0 == b.0).collect();
    runs.sort_unstable_by_key(|run| run[0].1);
    let mut all = Runs {
        items: Vec::with_capacity(items.len()),
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

/// A box as obvhs has it.
pub(super) fn aabb(bounds: &Bounds) -> Aabb {
    Aabb {
        min: Vec3A::from(bounds.min),
        max: Vec3A::from(bounds.max),
    }
}

fn clustered(boxes: &[Bounds], runs: &mut Runs, work: Build, builder: &mut PlocBuilder) -> Bvh2 {
    let count = runs.starts.len();
    let end = runs.items.len() as u32;
    let ends = runs.starts.iter().skip(1).copied().chain([end]);
    let range = |(start, end): (u32, u32)| start as usize..end as usize;
    let ranges: Vec<_> = runs.starts.iter().copied().zip(ends).map(range).collect();
    // Areas of very large boxes overflow, and those of very small ones vanish.
    let whole = union(boxes, &runs.items);
    let largest = whole.min.abs().max(whole.max.abs()).max_element();
    let odd = !(1e-6..1e12).contains(&largest) && largest > 0.0;
    let scale = if odd {
        Vec3A::splat(1.0 / largest)
    } else {
        Vec3A::ONE
    };
    let aabbs = ranges.iter().map(|range| {
        let Aabb { min, max } = aabb(&union(boxes, &runs.items[range.clone()]));
        Aabb {
            min: min * scale,
            max: max * scale,
        }
    });
    let aabbs: Vec<Aabb> = aabbs.collect();
    // As obvhs's own presets of these names, but for those of its steps that make leaves.
    let (distance, precision, first_levels, share) = match work {
        Build::Quick | Build::Fast => (PlocSearchDistance::Low, SortPrecision::U64, 2, 0.02),
        Build::Medium => (PlocSearchDistance::Medium, SortPrecision::U64, 3, 0.05),
        Build::Slow => (PlocSearchDistance::High, SortPrecision::U128, 2, 0.2),
    };
    let indices = (0..count as u32).collect();
    let mut tree = builder.build(distance, &aabbs, indices, precision, first_levels);
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
pub(super) fn halve(boxes: &[Bounds], items: &mut [u32], place: usize, nodes: &mut Vec<Bvh2Node>) {
    let mut left = vec![(items, place)];
    while let Some((items, place)) = left.pop() {
        let bounds = union(boxes, items);
        if let [item] = items {
            nodes[place] = Bvh2Node::new(aabb(&bounds), 1, *item);
            continue;
        }
        let centre = |item: u32| centre(&boxes[item as usize]);
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
