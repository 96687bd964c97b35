//! A group of shapes with its tree. What has no finite box stands beside the tree, in a short list that
//! every ray is held against.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use crate::math::Moving;
use crate::shape::{Bounds, DeformingMesh, Geometry, Moment, Surface as _};

use super::wide::{Leaves, Tree};
use super::{CacheUse, Method, Recipe};

/// A primitive of a shape, or an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Item {
    /// Index of the shape; `INSTANCE` for an instance.
    pub(super) shape: u32,
    /// Index of the primitive in its shape, or of the instance.
    pub(super) index: u32,
}

const INSTANCE: u32 = u32::MAX;

impl Item {
    pub(super) fn primitive(shape: u32, index: u32) -> Self {
        Self { shape, index }
    }

    pub(super) fn instance(index: u32) -> Self {
        Self {
            shape: INSTANCE,
            index,
        }
    }

    #[inline]
    pub(super) fn as_instance(&self) -> Option<u32> {
        (self.shape == INSTANCE).then_some(self.index)
    }
}

/// The shapes of a scene, whose primitives are numbered through.
#[derive(Debug)]
pub(super) struct Shapes {
    shapes: Vec<Arc<Geometry>>,
    /// The number of each shape's first primitive.
    starts: Vec<u32>,
    /// For runs of 2^`shift` numbers the shape of the first.
    guide: Vec<u32>,
    shift: u32,
}

/// Runs of the guide to a shape, about.
const RUNS: usize = 4;

impl Shapes {
    pub(super) fn new(shapes: Vec<Arc<Geometry>>) -> Self {
        let mut next = 0_u32;
        let starts = shapes.iter().map(|shape| {
            let start = next;
            let after = next.checked_add(shape.primitive_count());
            next = after.expect("fewer than 2³² primitives fit into memory");
            start
        });
        let starts: Vec<u32> = starts.collect();
        let runs = (RUNS * shapes.len()).next_power_of_two() as u32;
        let shift = (u32::BITS - next.leading_zeros()).saturating_sub(runs.ilog2());
        let shape_of = |number: u32| starts.partition_point(|start| *start <= number) as u32 - 1;
        let guide = match next.checked_sub(1) {
            Some(last) => (0..=last >> shift)
                .map(|run| shape_of(run << shift))
                .collect(),
            None => Vec::new(),
        };
        Self {
            guide,
            shift,
            starts,
            shapes,
        }
    }

    /// A primitive's number.
    #[inline]
    pub(super) fn number(&self, item: Item) -> u32 {
        self.starts[item.shape as usize] + item.index
    }

    /// The primitive with a number.
    #[inline]
    pub(super) fn numbered(&self, number: u32) -> Item {
        // The last shape that starts there or before; empty ones before it start there too.
        let mut shape = self.guide[(number >> self.shift) as usize] as usize;
        while self
            .starts
            .get(shape + 1)
            .is_some_and(|start| *start <= number)
        {
            shape += 1;
        }
        Item::primitive(shape as u32, number - self.starts[shape])
    }

    #[inline]
    pub(super) fn get(&self, shape: u32) -> &Geometry {
        &self.shapes[shape as usize]
    }

    /// All of them, to be held by somebody else as well.
    pub(super) fn shared(&self) -> Vec<Arc<Geometry>> {
        self.shapes.clone()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Geometry> {
        self.shapes.iter().map(|shape| &**shape)
    }

    pub(super) fn primitive_count(&self) -> usize {
        self.iter().map(|s| s.primitive_count() as usize).sum()
    }
}

/// What a group's tree is built over: items with finite boxes, numbered through. They are never listed one by one,
/// for there may be tens of millions.
pub(super) struct Members<'a> {
    shapes: &'a Shapes,
    /// The boxes of instances, which are in the world alone.
    instances: Option<&'a [Bounds]>,
    runs: Vec<Run>,
    count: u32,
    /// Items that have no finite box.
    unbounded: Vec<Item>,
}

/// Items whose indices follow one another.
struct Run {
    /// The number of the first item.
    start: u32,
    first: Item,
}

/// Items whose boxes one task joins.
const GRAIN: u32 = 1 << 14;
/// Cells of a group's box along an axis.
const CELLS: usize = 4;

impl<'a> Members<'a> {
    /// The primitives of some `shapes`, and for the world all `instances` in their boxes.
    pub(super) fn new(all: &'a Shapes, shapes: &[u32], instances: Option<&'a [Bounds]>) -> Self {
        let mut members = Self {
            shapes: all,
            instances,
            runs: Vec::new(),
            count: 0,
            unbounded: Vec::new(),
        };
        for &shape in shapes {
            let geometry = all.get(shape);
            let (first, count) = (Item::primitive(shape, 0), geometry.primitive_count());
            match geometry {
                // All triangles are finite.
                Geometry::Mesh(_) => members.push(first, count),
                _ => members.sift(first, count),
            }
        }
        members.sift(Item::instance(0), members.boxes().len() as u32);
        members
    }

    fn boxes(&self) -> &'a [Bounds] {
        self.instances.unwrap_or_default()
    }

    /// Takes `count` items from `first` on.
    fn push(&mut self, first: Item, count: u32) {
        if count == 0 {
            return;
        }
        let start = self.count;
        let goes_on = (self.runs.last()).is_some_and(|last| last.item(start) == first);
        if !goes_on {
            self.runs.push(Run { start, first });
        }
        self.count = start
            .checked_add(count)
            .expect("fewer than 2³² items fit into memory");
    }

    /// Takes those items of `count` from `first` on that have a finite box.
    fn sift(&mut self, first: Item, count: u32) {
        for item in (first.index..count).map(|index| Item { index, ..first }) {
            let bounds = self.bounds_of(item);
            if bounds.is_unbounded() {
                self.unbounded.push(item);
            } else if !bounds.is_empty() {
                self.push(item, 1);
            }
        }
    }

    #[inline]
    fn item(&self, number: u32) -> Item {
        let run = self.runs.partition_point(|run| run.start <= number) - 1;
        self.runs[run].item(number)
    }

    #[inline]
    fn bounds_of(&self, item: Item) -> Bounds {
        match item.as_instance() {
            Some(instance) => self.boxes()[instance as usize],
            None => self.shapes.get(item.shape).bounds(item.index),
        }
    }

    /// The runs, each with the number after its last item's.
    fn runs(&self) -> impl Iterator<Item = (&Run, u32)> {
        let ends = self.runs.iter().skip(1).map(|run| run.start);
        self.runs.iter().zip(ends.chain([self.count]))
    }

    /// A box around all items.
    fn union(&self) -> Bounds {
        let boxes = self.runs().map(|(run, end)| match run.first.as_instance() {
            // A mesh is one run.
            None if let Geometry::Mesh(mesh) = self.shapes.get(run.first.shape) => {
                let bounds = mesh.mesh().bounds();
                bounds.map_or(Bounds::EMPTY, |(min, max)| Bounds { min, max })
            }
            _ => {
                let items = (run.start..end)
                    .into_par_iter()
                    .with_min_len(GRAIN as usize);
                let boxes = items.map(|item| self.bounds(item));
                boxes.reduce(|| Bounds::EMPTY, Bounds::union)
            }
        });
        boxes.fold(Bounds::EMPTY, Bounds::union)
    }

    /// Boxes that hold all items, each those whose centres are in one cell of a coarse grid over `bounds`.
    fn parts(&self, bounds: &Bounds) -> Vec<Bounds> {
        const NONE: [Bounds; CELLS * CELLS * CELLS] = [Bounds::EMPTY; _];
        let scale = CELLS as f32 / (bounds.max - bounds.min);
        let cell = |item: &Bounds| {
            let place = (0.5 * item.min + 0.5 * item.max - bounds.min) * scale;
            // What is no number, in a flat box, is in the first cell.
            let [x, y, z] = place.to_array().map(|at| (at as usize).min(CELLS - 1));
            (z * CELLS + y) * CELLS + x
        };
        let tasks = (0..self.count.div_ceil(GRAIN)).into_par_iter().map(|part| {
            let end = self.count.min((part + 1).saturating_mul(GRAIN));
            let mut parts = NONE;
            for bounds in (part * GRAIN..end).map(|item| self.bounds(item)) {
                let part = &mut parts[cell(&bounds)];
                *part = part.union(bounds);
            }
            parts
        });
        let union = |a: [Bounds; _], b: [Bounds; _]| std::array::from_fn(|i| a[i].union(b[i]));
        let parts = tasks.reduce(|| NONE, union);
        parts.into_iter().filter(|part| !part.is_empty()).collect()
    }
}

impl Run {
    fn item(&self, number: u32) -> Item {
        let index = self.first.index + (number - self.start);
        Item {
            index,
            ..self.first
        }
    }
}

impl Leaves for Members<'_> {
    fn count(&self) -> u32 {
        self.count
    }

    fn bounds(&self, item: u32) -> Bounds {
        self.bounds_of(self.item(item))
    }

    fn is_triangle(&self, item: u32) -> bool {
        let item = self.item(item);
        item.as_instance().is_none() && matches!(self.shapes.get(item.shape), Geometry::Mesh(_))
    }

    fn triangle(&self, item: u32) -> (u32, [Vec3; 3]) {
        let item = self.item(item);
        match self.shapes.get(item.shape) {
            Geometry::Mesh(mesh) => (self.shapes.number(item), mesh.corners(item.index)),
            _ => unreachable!("the tree has asked whether it is a triangle"),
        }
    }

    fn numbers(&self) -> Vec<Range<u32>> {
        // A mesh is one run.
        let shapes = self
            .runs
            .iter()
            .filter(|run| run.first.as_instance().is_none());
        let meshes = shapes.filter(|run| self.shapes.get(run.first.shape).mesh().is_some());
        let numbers = meshes.map(|run| {
            let first = self.shapes.number(run.first);
            first..first + self.shapes.get(run.first.shape).primitive_count()
        });
        numbers.collect()
    }

    fn digest(&self, hasher: &mut blake3::Hasher) {
        for (run, end) in self.runs() {
            hasher.update(&(end - run.start).to_le_bytes());
            let shape = run.first.as_instance().is_none();
            let shape = shape.then(|| self.shapes.get(run.first.shape));
            if let Some(Geometry::Mesh(mesh)) = shape {
                hasher.update(&self.shapes.number(run.first).to_le_bytes());
                hasher.update(mesh.triangles_hash().as_bytes());
                continue;
            }
            for Bounds { min, max } in (run.start..end).map(|item| self.bounds(item)) {
                for c in min.to_array().into_iter().chain(max.to_array()) {
                    hasher.update(&c.to_le_bytes());
                }
            }
        }
    }
}

/// A mesh that deforms, half way from one set of its vertices to the next.
struct Halfway<'a> {
    mesh: &'a DeformingMesh,
    segment: usize,
    /// The number of the first triangle.
    first: u32,
}

impl Leaves for Halfway<'_> {
    fn count(&self) -> u32 {
        self.mesh.primitive_count()
    }

    fn bounds(&self, item: u32) -> Bounds {
        let (_, corners) = self.triangle(item);
        corners.into_iter().fold(Bounds::EMPTY, Bounds::with)
    }

    fn is_triangle(&self, _item: u32) -> bool {
        true
    }

    fn triangle(&self, item: u32) -> (u32, [Vec3; 3]) {
        let moment = Moment {
            segment: self.segment,
            part: 0.5,
        };
        (self.first + item, self.mesh.corners(item, moment))
    }

    fn numbers(&self) -> Vec<Range<u32>> {
        std::iter::once(self.first..self.first + self.count()).collect()
    }

    fn digest(&self, hasher: &mut blake3::Hasher) {
        hasher.update(b"half way");
        for item in 0..self.count() {
            let (number, corners) = self.triangle(item);
            hasher.update(&number.to_le_bytes());
            for c in corners.iter().flat_map(|corner| corner.to_array()) {
                hasher.update(&c.to_le_bytes());
            }
        }
    }
}

/// The trees of a mesh that deforms.
#[derive(Debug)]
struct Deforming {
    /// When its sets of vertices are.
    times: Vec<f32>,
    /// For the way from each set to the next.
    trees: Vec<Tree>,
}

/// See the module.
#[derive(Debug)]
pub(super) struct Group {
    unbounded: Vec<Item>,
    /// All others for brute force; those that are no triangles for a tree.
    items: Vec<Item>,
    has_instances: bool,
    tree: Tree,
    /// Of a mesh that deforms.
    deforming: Option<Deforming>,
    bounds: Bounds,
    /// Boxes that together hold what the tree holds; the world has none.
    parts: Vec<Bounds>,
}

impl Group {
    /// A group of these members, and what the folder of trees was good for.
    pub(super) fn new(members: Members<'_>, recipe: &Recipe) -> (Self, CacheUse) {
        let (tree, items, used) = match recipe.method {
            Method::Tree => Tree::build(&members, recipe.build, recipe.cache.as_deref()),
            Method::Brute | Method::Exhaustive => {
                let all = (0..members.count).collect();
                (Tree::default(), all, CacheUse::default())
            }
            Method::Never => (Tree::default(), Vec::new(), CacheUse::default()),
        };
        let bounds = match recipe.method {
            Method::Tree => tree.bounds(),
            Method::Brute | Method::Exhaustive | Method::Never => members.union(),
        };
        let parts = match members.instances {
            Some(_) => Vec::new(),
            None => members.parts(&bounds),
        };
        let group = Self {
            items: items.into_iter().map(|item| members.item(item)).collect(),
            has_instances: !members.boxes().is_empty(),
            unbounded: members.unbounded,
            tree,
            deforming: None,
            bounds,
            parts,
        };
        (group, used)
    }

    /// A mesh that deforms, by itself.
    pub(super) fn deforming(
        shapes: &Shapes,
        shape: u32,
        recipe: &Recipe,
    ) -> Option<(Self, CacheUse)> {
        let Geometry::Deforming(mesh) = shapes.get(shape) else {
            return None;
        };
        let brute = Recipe {
            method: Method::Brute,
            ..recipe.clone()
        };
        let (mut group, mut used) = Self::new(Members::new(shapes, &[shape], None), &brute);
        if recipe.method != Method::Tree {
            return Some((group, used));
        }
        group.items = Vec::new();
        let first = shapes.number(Item::primitive(shape, 0));
        let trees = (0..mesh.segments()).map(|segment| {
            let halfway = Halfway {
                mesh,
                segment,
                first,
            };
            let (tree, _, more) = Tree::build(&halfway, recipe.build, recipe.cache.as_deref());
            used.add(more);
            tree.fitted(&|number| mesh.ends(number - first, segment))
        });
        group.deforming = Some(Deforming {
            trees: trees.collect(),
            times: mesh.times().to_vec(),
        });
        Some((group, used))
    }

    /// The instance that is all there is in it, if that is so.
    pub(super) fn lone_instance(&self) -> Option<u32> {
        let [item] = &self.items[..] else { return None };
        let alone = self.unbounded.is_empty() && self.tree.holds_no_triangle();
        item.as_instance().filter(|_| alone)
    }

    /// Its tree, where it is the same at all times or at least of one way.
    pub(super) fn only_tree(&self) -> Option<&Tree> {
        match &self.deforming {
            None => Some(&self.tree),
            Some(Deforming { trees, .. }) if let [tree] = &trees[..] => Some(tree),
            Some(_) => None,
        }
    }

    /// Whether its tree moves.
    pub(super) fn deforms(&self) -> bool {
        self.deforming.is_some()
    }

    /// The tree at a time, and how far it has come on its way.
    #[inline]
    pub(super) fn tree_at(&self, time: f32) -> (&Tree, f32) {
        match &self.deforming {
            None => (&self.tree, 0.0),
            Some(Deforming { times, trees }) => {
                let moment = Moment::of(times, time);
                (&trees[moment.segment], moment.part)
            }
        }
    }

    /// Nodes on the longest way down.
    pub(super) fn levels(&self) -> usize {
        let moving = self.deforming.iter().flat_map(|d| &d.trees);
        moving
            .map(Tree::levels)
            .fold(self.tree.levels(), usize::max)
    }

    /// What the tree does not hold.
    pub(super) fn unbounded(&self) -> &[Item] {
        &self.unbounded
    }

    /// What the tree holds, for brute force; else those of it that are no triangles.
    pub(super) fn items(&self) -> &[Item] {
        &self.items
    }

    /// Whether instances stand in it.
    pub(super) fn has_instances(&self) -> bool {
        self.has_instances
    }

    pub(super) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// A box around what the tree holds.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// A box around an instance of the group, while the shutter is open. Turned one by one, the parts' boxes make a
    /// closer one than the whole's.
    pub(super) fn bounds_in(&self, to_world: &Moving, shutter: (f32, f32)) -> Bounds {
        if !self.unbounded.is_empty() {
            return Bounds::EVERYTHING;
        }
        let parts = self.parts.iter().map(|part| part.moved(to_world, shutter));
        parts.fold(Bounds::EMPTY, Bounds::union)
    }

    pub(super) fn bytes(&self) -> usize {
        (self.unbounded.len() + self.items.len()) * size_of::<Item>()
            + self.tree.bytes()
            + self
                .deforming
                .iter()
                .flat_map(|d| &d.trees)
                .map(Tree::bytes)
                .sum::<usize>()
    }
}
