//! A group of shapes with its tree: the items (primitives and instances) in the order of the leaves.

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
    items: Vec<Item>,
    tree: Tree,
    bounds: Bounds,
}

impl Group {
    pub(super) fn new((items, boxes): (Vec<Item>, Vec<Bounds>), method: Method) -> Self {
        let bounds = boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union);
        match method {
            Method::Brute => Self {
                items,
                tree: Tree::default(),
                bounds,
            },
            Method::Tree => {
                let (tree, order) = Tree::build(&boxes);
                let items = order.into_iter().map(|i| items[i as usize]).collect();
                Self {
                    items,
                    tree,
                    bounds,
                }
            }
        }
    }

    pub(super) fn items(&self) -> &[Item] {
        &self.items
    }

    pub(super) fn tree(&self) -> &Tree {
        &self.tree
    }

    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    pub(super) fn bytes(&self) -> usize {
        self.items.len() * size_of::<Item>() + self.tree.bytes()
    }
}
