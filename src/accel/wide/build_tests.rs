//! What trees cost that are built in chunks, and that nothing gets lost.

use glam::Vec3;

use super::*;
use crate::mesh;

/// The triangles of a mesh, numbered as they are.
struct Triangles(mesh::Mesh);

impl Triangles {
    fn boxes(&self) -> Vec<Bounds> {
        (0..self.count()).map(|item| self.bounds(item)).collect()
    }
}

impl Leaves for Triangles {
    fn count(&self) -> u32 {
        self.0.triangles.len() as u32
    }

    fn bounds(&self, item: u32) -> Bounds {
        let (_, corners) = self.triangle(item);
        corners.into_iter().fold(Bounds::EMPTY, Bounds::with)
    }

    fn is_triangle(&self, _: u32) -> bool {
        true
    }

    fn triangle(&self, item: u32) -> (u32, [Vec3; 3]) {
        let corners = self.0.triangles[item as usize];
        (item, corners.map(|c| self.0.positions[c as usize]))
    }

    fn numbers(&self) -> Vec<Range<u32>> {
        std::iter::once(0..self.count()).collect()
    }

    fn digest(&self, hasher: &mut blake3::Hasher) {
        hasher.update(self.0.triangles_hash().as_bytes());
    }
}

/// What a ray costs on average: nodes by the share of their area in the root's, and blocks at 0.8.
fn cost(tree: &Tree) -> f64 {
    let area = |sides: [f64; 3]| sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0];
    let child = |node: &Node, lane: usize| {
        let [low, high] =
            [0, 1].map(|side| [0, 2, 4].map(|a| f64::from(node.slabs[a + side][lane])));
        area(std::array::from_fn(|axis| high[axis] - low[axis]))
    };
    let whole = std::array::from_fn(|axis| {
        let [low, high] = [0, 1].map(|side| tree.nodes[0].slabs[2 * axis + side]);
        let low = low.into_iter().fold(f32::INFINITY, f32::min);
        f64::from(high.into_iter().fold(f32::NEG_INFINITY, f32::max) - low)
    });
    let lanes = tree
        .nodes
        .iter()
        .flat_map(|node| (0..node::WIDTH).map(move |lane| (node, lane)));
    let costs = lanes.map(|(node, lane)| match node.children[lane] {
        node::DONE => 0.0,
        name if name >= node::LEAF => 0.8 * child(node, lane),
        _ => child(node, lane),
    });
    1.0 + costs.sum::<f64>() / area(whole)
}

/// A tree as numbers, to the bit.
fn bits(tree: &Tree) -> Vec<u32> {
    let nodes = tree.nodes.iter().flat_map(|node| {
        let slabs = node.slabs.into_iter().flatten().map(f32::to_bits);
        slabs.chain(node.children).chain(node.order)
    });
    let blocks = tree.blocks.iter().flat_map(|block| {
        let corners = block
            .corners
            .into_iter()
            .flatten()
            .flatten()
            .map(f32::to_bits);
        corners.chain(block.ids)
    });
    nodes.chain(blocks).chain([tree.levels as u32]).collect()
}

#[test]
fn a_tree_in_chunks_costs_no_more_than_one_tree() {
    for (name, mesh) in [
        ("bumpy sphere", mesh::bumpy_sphere(6, 7)),
        ("terrain", mesh::terrain(100_000, 1)),
        ("hair", mesh::hair(100_000, 1)),
    ] {
        let leaves = Triangles(mesh);
        let boxes = leaves.boxes();
        for work in [Build::Fast, Build::Medium] {
            let [one, chunked] = [usize::MAX, 4096].map(|most| {
                let sketches = build::build_in(most, &boxes, &leaves, work);
                cost(&sketches.tree(&leaves).0)
            });
            assert!(
                chunked < 1.01 * one,
                "{name}, {work:?}: {chunked} and {one}"
            );
        }
    }
}

#[test]
fn a_tree_is_the_same_whatever_the_threads() {
    let leaves = Triangles(mesh::hair(60_000, 1));
    let trees = [1, 2, 5].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let build = || bits(&Tree::build(&leaves, Build::Fast, None).0);
        pool.build().unwrap().install(build)
    });
    assert!(trees[0] == trees[1] && trees[1] == trees[2]);
}

#[test]
fn every_triangle_stands_in_one_chunk_and_one_block() {
    // Most in one place, which is cut again.
    let mut mesh = mesh::bumpy_sphere(6, 7);
    let far = Vec3::splat(1e4);
    mesh.positions.iter_mut().take(100).for_each(|p| *p += far);
    let leaves = Triangles(mesh);
    let boxes = leaves.boxes();
    let chunks = chunks::chunks(&boxes, 1000);
    let sizes = chunks.items.iter().map(Vec::len);
    assert!(sizes.min() > Some(0) && chunks.items.iter().all(|items| items.len() <= 1000));
    let mut items = chunks.items.concat();
    items.sort_unstable();
    assert!(items.into_iter().eq(0..boxes.len() as u32));
    let sketches = build::build_in(1000, &boxes, &leaves, Build::Fast);
    let (tree, _) = sketches.tree(&leaves);
    let ids = tree.blocks.iter().flat_map(|block| block.ids);
    let mut ids: Vec<u32> = ids.filter(|id| *id != u32::MAX).collect();
    ids.sort_unstable();
    assert!(ids.into_iter().eq(0..boxes.len() as u32));
}
