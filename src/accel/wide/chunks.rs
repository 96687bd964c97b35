//! Cutting the items into chunks that are built one by one, each by one thread: for whole scenes at once
//! obvhs would want more than 200 bytes an item. The items are counted into the cells of a grid by their
//! centres, and the cells are parted by planes of least cost (Wald, *On fast construction of SAH-based bounding
//! volume hierarchies*, 2007) until few enough items are left; a cell that holds too many gets a
//! grid of its own. The cuts are the first levels of the binary tree.

use glam::Vec3;
use obvhs::bvh2::node::Bvh2Node;
use rayon::prelude::*;

use super::binary::{aabb, centre};
use crate::shape::Bounds;

/// Items of a chunk: the least and the greatest limit, and how many chunks there should be between.
const LEAST: usize = 1 << 13;
const MOST: usize = 1 << 17;
const CHUNKS: usize = 64;
/// Cells along an axis, as a power of two, and items to a cell, likewise.
const FINEST: u32 = 6;
const TO_A_CELL: u32 = 4;
/// Items that are sorted at once.
const BLOCK: usize = 1 << 15;

/// Items in chunks, under the cuts that part them.
#[derive(Debug)]
pub(super) struct Chunks {
    /// A binary tree, parents before children: the root comes first, children stand in pairs. A leaf names a
    /// chunk.
    pub(super) cuts: Vec<Bvh2Node>,
    /// The items of each chunk, ascending.
    pub(super) items: Vec<Vec<u32>>,
}

/// One cell of a grid, if anything is in it.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Along each axis.
    place: [u8; 3],
    items: u32,
    bounds: Bounds,
}

impl Cell {
    const EMPTY: Self = Self {
        place: [0; 3],
        items: 0,
        bounds: Bounds::EMPTY,
    };

    fn add(&mut self, other: &Self) {
        self.items += other.items;
        self.bounds = self.bounds.union(other.bounds);
    }
}

/// Half the area of a box: infinite where it overflows.
fn area(bounds: &Bounds) -> f32 {
    let d = bounds.max - bounds.min;
    let area = d.x * d.y + d.y * d.z + d.z * d.x;
    if area.is_nan() { f32::INFINITY } else { area }
}

/// The most items of a chunk, where there are so many in all.
pub(super) fn most(items: usize) -> usize {
    (items / CHUNKS).clamp(LEAST, MOST)
}

/// The items with these boxes in chunks of so many at most, unless more have one centre. There is at least one.
pub(super) fn chunks(boxes: &[Bounds], most: usize) -> Chunks {
    let mut chunks = Chunks {
        cuts: vec![Bvh2Node::default()],
        items: Vec::new(),
    };
    let all = (0..boxes.len() as u32).collect();
    // Items that are still too many, and the node over them.
    let mut open: Vec<(Vec<u32>, usize)> = vec![(all, 0)];
    while let Some((items, place)) = open.pop() {
        let grid = Grid::new(boxes, &items);
        let parts = grid.cut(place, most, &mut chunks);
        for (part, (place, is_chunk)) in grid.sorted(&items, &parts).into_iter().zip(parts.places) {
            if is_chunk || part.len() == items.len() {
                let bounds = chunks.cuts[place].aabb;
                chunks.cuts[place] = Bvh2Node::new(bounds, 1, chunks.items.len() as u32);
                chunks.items.push(part);
            } else {
                open.push((part, place));
            }
        }
    }
    chunks
}

/// A grid over the centres of some items.
struct Grid {
    bits: u32,
    /// The cell of each item, as numbers with `bits` bits an axis.
    cell_of: Vec<u32>,
    /// The cells that hold something.
    cells: Vec<Cell>,
}

/// Cells by what they belong to.
struct Parts {
    /// For each cell of the grid, also empty ones.
    part_of: Vec<u32>,
    /// The node over each part, and whether it is small enough.
    places: Vec<(usize, bool)>,
}

impl Grid {
    fn new(boxes: &[Bounds], items: &[u32]) -> Self {
        let bounds_of = |item: &u32| &boxes[*item as usize];
        let around = items.par_chunks(BLOCK).map(|items| {
            let centres = items.iter().map(|item| centre(bounds_of(item)));
            centres.fold(Bounds::EMPTY, Bounds::with)
        });
        let around = around.reduce(|| Bounds::EMPTY, Bounds::union);
        let bits = (items.len().ilog2().saturating_sub(TO_A_CELL) / 3).clamp(1, FINEST);
        let most = Vec3::splat(((1 << bits) - 1) as f32);
        let scale = Vec3::splat((1 << bits) as f32) / (around.max - around.min);
        let cell_of = (items.par_iter().with_min_len(BLOCK)).map(|item| {
            // Where all are in one plane this is no number, and they come out alike.
            let at = ((centre(bounds_of(item)) - around.min) * scale).min(most);
            (at.x as u32) << (2 * bits) | (at.y as u32) << bits | at.z as u32
        });
        let cell_of: Vec<u32> = cell_of.collect();
        let share = items
            .len()
            .div_ceil(rayon::current_num_threads())
            .max(BLOCK);
        let counted = items.par_chunks(share).zip(cell_of.par_chunks(share));
        let counted = counted.map(|(items, cell_of)| {
            let mut cells = vec![Cell::EMPTY; 1 << (3 * bits)];
            for (item, cell) in items.iter().zip(cell_of) {
                cells[*cell as usize].add(&Cell {
                    items: 1,
                    bounds: *bounds_of(item),
                    ..Cell::EMPTY
                });
            }
            cells
        });
        let counted = counted.reduce_with(|mut cells, others| {
            cells.iter_mut().zip(&others).for_each(|(a, b)| a.add(b));
            cells
        });
        let axis = |i: usize, axis: u32| (i >> ((2 - axis) * bits) & ((1 << bits) - 1)) as u8;
        let cells = counted.unwrap_or_default().into_iter().enumerate();
        let cells = cells
            .filter(|(_, cell)| cell.items > 0)
            .map(|(i, cell)| Cell {
                place: [0, 1, 2].map(|a| axis(i, a)),
                ..cell
            });
        Self {
            bits,
            cell_of,
            cells: cells.collect(),
        }
    }

    fn index(&self, cell: &Cell) -> usize {
        let [x, y, z] = cell.place.map(usize::from);
        x << (2 * self.bits) | y << self.bits | z
    }

    /// Parts the cells under a node until no part of several has more than `most` items.
    fn cut(&self, place: usize, most: usize, chunks: &mut Chunks) -> Parts {
        let mut parts = Parts {
            part_of: vec![0; 1 << (3 * self.bits)],
            places: Vec::new(),
        };
        let mut cells = self.cells.clone();
        let mut open = vec![(&mut cells[..], place)];
        while let Some((cells, place)) = open.pop() {
            let mut all = Cell::EMPTY;
            cells.iter().for_each(|cell| all.add(cell));
            chunks.cuts[place] = Bvh2Node::new(aabb(&all.bounds), 0, 0);
            let is_chunk = all.items as usize <= most;
            if is_chunk || cells.len() == 1 {
                for cell in cells.iter() {
                    parts.part_of[self.index(cell)] = parts.places.len() as u32;
                }
                parts.places.push((place, is_chunk));
                continue;
            }
            let (axis, plane) = best_plane(cells);
            cells.sort_by_key(|cell| cell.place[axis] >= plane);
            let middle = cells.partition_point(|cell| cell.place[axis] < plane);
            let (low, high) = cells.split_at_mut(middle);
            let children = chunks.cuts.len();
            chunks.cuts[place].first_index = children as u32;
            chunks.cuts.extend([Bvh2Node::default(); 2]);
            open.extend([(high, children + 1), (low, children)]);
        }
        parts
    }

    /// The items of each part.
    fn sorted(&self, items: &[u32], parts: &Parts) -> Vec<Vec<u32>> {
        let count = parts.places.len();
        let part = |cell: &u32| parts.part_of[*cell as usize] as usize;
        let blocks = items.par_chunks(BLOCK).zip(self.cell_of.par_chunks(BLOCK));
        let blocks = blocks.map(|(items, cell_of)| {
            let mut starts = vec![0_u32; count + 1];
            cell_of.iter().for_each(|cell| starts[part(cell) + 1] += 1);
            (0..count).for_each(|i| starts[i + 1] += starts[i]);
            let (mut sorted, mut next) = (vec![0; items.len()], starts.clone());
            for (item, cell) in items.iter().zip(cell_of) {
                let next = &mut next[part(cell)];
                sorted[*next as usize] = *item;
                *next += 1;
            }
            (sorted, starts)
        });
        let blocks: Vec<(Vec<u32>, Vec<u32>)> = blocks.collect();
        let gathered = (0..count).into_par_iter().map(|part| {
            let pieces = blocks
                .iter()
                .map(|(sorted, starts)| &sorted[starts[part] as usize..starts[part + 1] as usize]);
            pieces.collect::<Vec<_>>().concat()
        });
        gathered.collect()
    }
}

/// The plane that parts cells at least cost: the axis, and the first place beyond.
fn best_plane(cells: &[Cell]) -> (usize, u8) {
    let mut best = (f32::INFINITY, 0, 0);
    let mut fallback = (0, 0);
    for axis in 0..3 {
        let mut slabs = [Cell::EMPTY; 1 << FINEST];
        for cell in cells {
            slabs[usize::from(cell.place[axis])].add(cell);
        }
        let cost = |cell: &Cell| area(&cell.bounds) * cell.items as f32;
        let mut above = [0.0; 1 << FINEST];
        let mut sum = Cell::EMPTY;
        for i in (0..slabs.len()).rev() {
            sum.add(&slabs[i]);
            above[i] = if sum.items == 0 { f32::NAN } else { cost(&sum) };
        }
        let mut sum = Cell::EMPTY;
        for i in 1..slabs.len() {
            sum.add(&slabs[i - 1]);
            if sum.items == 0 || above[i].is_nan() {
                continue;
            }
            fallback = (axis, i as u8);
            let cost = cost(&sum) + above[i];
            if cost < best.0 {
                best = (cost, axis, i as u8);
            }
        }
    }
    if best.0 < f32::INFINITY {
        (best.1, best.2)
    } else {
        fallback
    }
}
