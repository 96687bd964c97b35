//! A group of shapes with its tree: the items (primitives and instances) in the order of the leaves. What has
//! no finite box stands beside the tree, in a short list that every ray is held against.

use crate::shape::Bounds;

use super::Method;
use super::tree::Tree;

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

/// See the module.
#[derive(Debug)]
pub(super) struct Group {
    unbounded: Vec<Item>,
    items: Vec<Item>,
    tree: Tree,
    bounds: Bounds,
}

impl Group {
    pub(super) fn new(placed: impl Iterator<Item = (Item, Bounds)>, method: Method) -> Self {
        let (mut unbounded, mut items, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
        for (item, bounds) in placed {
            if bounds.is_unbounded() {
                unbounded.push(item);
            } else {
                items.push(item);
                boxes.push(bounds);
            }
        }
        let bounds = boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union);
        match method {
            Method::Brute => Self {
                unbounded,
                items,
                tree: Tree::default(),
                bounds,
            },
            Method::Tree => {
                let (tree, order) = Tree::build(&boxes);
                let items = order.into_iter().map(|i| items[i as usize]).collect();
                Self {
                    unbounded,
                    items,
                    tree,
                    bounds,
                }
            }
        }
    }

    /// What the tree does not hold.
    pub(super) fn unbounded(&self) -> &[Item] {
        &self.unbounded
    }

    /// What the tree holds.
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
