//! A group of shapes with its tree. What has no finite box stands beside the tree, in a short list that
//! every ray is held against.

use std::sync::Arc;

use glam::Vec3;

use crate::shape::{Bounds, Geometry};

use super::wide::{Leaves, Tree};
use super::{Method, Recipe};

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
}

impl Shapes {
    pub(super) fn new(shapes: Vec<Arc<Geometry>>) -> Self {
        let mut next = 0_u32;
        let starts = shapes.iter().map(|shape| {
            let start = next;
            let after = next.checked_add(shape.primitive_count());
            next = after.expect("fewer than 2³² primitives fit into memory");
            start
        });
        Self {
            starts: starts.collect(),
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
        let shape = self.starts.partition_point(|start| *start <= number) - 1;
        Item::primitive(shape as u32, number - self.starts[shape])
    }

    #[inline]
    pub(super) fn get(&self, shape: u32) -> &Geometry {
        &self.shapes[shape as usize]
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Geometry> {
        self.shapes.iter().map(|shape| &**shape)
    }
}

/// What a tree is built over.
struct Members<'a> {
    items: &'a [Item],
    shapes: &'a Shapes,
}

impl Leaves for Members<'_> {
    fn is_triangle(&self, item: u32) -> bool {
        let item = self.items[item as usize];
        item.as_instance().is_none() && matches!(self.shapes.get(item.shape), Geometry::Mesh(_))
    }

    fn triangle(&self, item: u32) -> (u32, [Vec3; 3]) {
        let item = self.items[item as usize];
        match self.shapes.get(item.shape) {
            Geometry::Mesh(mesh) => (self.shapes.number(item), mesh.corners(item.index)),
            _ => unreachable!("the tree has asked whether it is a triangle"),
        }
    }
}

/// See the module.
#[derive(Debug)]
pub(super) struct Group {
    unbounded: Vec<Item>,
    /// All others for brute force; those that are no triangles for a tree.
    items: Vec<Item>,
    tree: Tree,
    bounds: Bounds,
}

impl Group {
    /// A group of items in their boxes.
    pub(super) fn new(
        placed: impl Iterator<Item = (Item, Bounds)>,
        recipe: Recipe,
        shapes: &Shapes,
    ) -> Self {
        let is_finite = |b: &Bounds| b.min.is_finite() && b.max.is_finite();
        let mut unbounded = Vec::new();
        let (mut items, mut boxes) = (Vec::new(), Vec::new());
        for (item, bounds) in placed.filter(|(_, bounds)| !bounds.is_empty()) {
            if is_finite(&bounds) {
                items.push(item);
                boxes.push(bounds);
            } else {
                unbounded.push(item);
            }
        }
        let bounds = boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union);
        let mut tree = Tree::default();
        if recipe.method == Method::Tree {
            let others;
            let members = Members {
                items: &items,
                shapes,
            };
            (tree, others) = Tree::build(&boxes, &members, recipe.build);
            items = others.into_iter().map(|i| items[i as usize]).collect();
        }
        Self {
            unbounded,
            items,
            tree,
            bounds,
        }
    }

    /// What the tree does not hold.
    pub(super) fn unbounded(&self) -> &[Item] {
        &self.unbounded
    }

    /// What the tree holds, for brute force; else those of it that are no triangles.
    pub(super) fn items(&self) -> &[Item] {
        &self.items
    }

    pub(super) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// A box around what the tree holds.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    pub(super) fn bytes(&self) -> usize {
        (self.unbounded.len() + self.items.len()) * size_of::<Item>() + self.tree.bytes()
    }
}
