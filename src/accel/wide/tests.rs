//! Each step of each kernel against plain arithmetic, on random lanes.

#![allow(unsafe_code)]

use glam::Vec3;

use super::kernel::{Ends, FILED, Lanes};
use super::node::{BLOCK, BOTTOM, Corners, DONE, Entry, LEAF, OTHER, Slabs, WIDTH, entry};
use super::portable::Portable;
use super::state::State;
use super::*;
use crate::interaction::Ray;
use crate::math::random;

fn number(seed: u64, i: u32) -> f32 {
    random::unit(random::bits(seed, i)) * 2.0 - 1.0
}

fn point(seed: u64, i: u32) -> Vec3 {
    Vec3::new(
        number(seed, 3 * i),
        number(seed, 3 * i + 1),
        number(seed, 3 * i + 2),
    )
}

fn ray<L: Lanes>(i: u32) -> State {
    let mut direction = point(2, i);
    if i.is_multiple_of(5) {
        direction[i as usize / 5 % 3] = if i.is_multiple_of(2) { 0.0 } else { -0.0 };
    }
    let start = Start {
        ray: Ray {
            origin: point(1, i) * 2.0,
            direction,
            t_max: 1.0,
            time: 0.0,
        },
        instance: 0,
        entry: number(3, i).max(0.0),
        part: number(10, i).abs(),
        best: Best {
            t: 1.0 + number(4, i),
            id: u32::MAX,
            place: Place::NOWHERE,
        },
    };
    let mut state = State::IDLE;
    state.begin(0, 0);
    state.enter(&Tree::default(), &start);
    // SAFETY: the caller has what the kernel needs.
    unsafe { L::aim(&start.ray, &mut state) };
    state.part = start.part;
    state.lanes = random::bits(5, i) as u8 & 15;
    state
}

fn node(i: u32) -> Node {
    let boxes: Vec<Bounds> = (0..i % 9)
        .map(|lane| {
            let corner = |k: u32| point(6, 16 * i + 2 * lane + k);
            Bounds::EMPTY.with(corner(0)).with(corner(1))
        })
        .collect();
    let mut node = Node::new(&boxes);
    node.children = std::array::from_fn(|lane| lane as u32);
    node
}

fn block(i: u32) -> Block {
    let corner = |lane: u32, c: u32| point(7, 16 * i + 4 * lane + c) + 0.3 * point(8, 4 * i + lane);
    let triangle = |lane: u32| (9 - lane, [0, 1, 2].map(|c| corner(lane, c)));
    let mut triangles: Vec<_> = (0..1 + i % 4).map(triangle).collect();
    if i.is_multiple_of(7) {
        triangles[0].1[1] = triangles[0].1[2];
    }
    Block::new(&mut triangles)
}

/// How far a node and a block go.
fn ways(i: u32, node: &Node, block: &Block) -> (Slabs, Corners) {
    let mut slabs = Slabs([[0.0; WIDTH]; 6]);
    let mut corners = Corners([[[0.0; BLOCK]; 3]; 3]);
    let gone = |k: u32| 0.2 * number(12, 128 * i + k);
    for (k, (way, plane)) in (0..).zip(slabs.0.iter_mut().zip(&node.slabs)) {
        for (lane, way) in (0..)
            .zip(way)
            .filter(|(lane, _)| plane[*lane as usize].is_finite())
        {
            *way = gone(8 * k + lane);
        }
    }
    for (k, corner) in (48..).zip(corners.0.as_flattened_mut()) {
        let there = (0..)
            .zip(corner)
            .zip(block.ids)
            .filter(|(_, id)| *id != u32::MAX);
        for ((lane, way), _) in there {
            *way = gone(4 * k - 144 + lane);
        }
    }
    (slabs, corners)
}

/// Everything that a kernel's steps say of many random lanes.
fn answers<L: Lanes>() -> Vec<u32> {
    let mut said = Vec::new();
    for i in 0..5000 {
        let (ray, node, block) = (ray::<L>(i), node(i), block(i));
        let ways = ways(i, &node, &block);
        let (nodes_way, blocks_way) = match i.is_multiple_of(3) {
            true => (Some(&ways.0), Some(&ways.1)),
            false => (None, None),
        };
        let mut stack: [Entry; WIDTH] = [0; WIDTH];
        let distance = |k: u32| 1.0 + number(9, 8 * i + k);
        let mut entries: [Entry; WIDTH] = std::array::from_fn(|k| entry(distance(k as u32), 0));
        entries[..(i % 9) as usize].fill(BOTTOM);
        // SAFETY: the caller has what the kernel needs; there is room for eight.
        unsafe {
            let count = L::enter(&node, nodes_way, &ray, stack.as_mut_ptr());
            said.push(count);
            said.extend(stack.iter().take(count as usize).map(|e| (e >> 32) as u32));
            said.extend(stack.iter().take(count as usize).map(|e| *e as u32));
            said.push(L::pop(entries.as_ptr(), ray.bound));
            said.push(L::inside(&block, blocks_way, &ray));
            let (t, lane) = L::meet(&block, blocks_way, &ray);
            said.extend(if t.is_nan() {
                [0, 0]
            } else {
                [t.to_bits(), lane as u32]
            });
        }
    }
    said
}

#[test]
fn every_kernel_takes_the_steps_that_plain_arithmetic_takes() {
    let plain = answers::<Portable>();
    for kernel in Kernel::all() {
        let (said, lists) = match kernel.name() {
            #[cfg(target_arch = "x86_64")]
            "AVX2" => (answers::<avx2::Avx2>(), filed::<avx2::Avx2>()),
            #[cfg(target_arch = "x86_64")]
            "AVX-512" => (answers::<avx512::Avx512>(), filed::<avx512::Avx512>()),
            _ => continue,
        };
        assert!(said == plain, "{}", kernel.name());
        assert!(lists == filed::<Portable>(), "{}", kernel.name());
    }
    assert!(
        plain.contains(&(WIDTH as u32)),
        "some ray enters all children"
    );
}

/// Where a kernel files many rays.
fn filed<L: Lanes>() -> Vec<Vec<u32>> {
    const ROOM: usize = 4 * FILED;
    let mut said = Vec::new();
    for count in 0..=3 * FILED as u32 {
        let slots: [u32; ROOM] = std::array::from_fn(|i| 100 + i as u32);
        let current = |i: usize| match random::bits(10, 100 * count + i as u32) % 5 {
            0 => DONE,
            1 => OTHER | i as u32,
            2 => LEAF | 3 << 28 | i as u32,
            3 => LEAF | i as u32,
            _ => i as u32,
        };
        let currents: [u32; ROOM] = std::array::from_fn(current);
        let mut lists = [[0_u32; 2 * ROOM]; 3];
        let starts = lists.each_mut().map(|list| list.as_mut_ptr());
        let [nodes, leaves, rest] = starts;
        let mut ends = Ends {
            nodes,
            leaves,
            rest,
        };
        // SAFETY: the caller has what the kernel needs; there is room for all in each list and sixteen more.
        let lengths = unsafe {
            L::file(slots.as_ptr(), currents.as_ptr(), count as usize, &mut ends);
            [
                ends.nodes.offset_from(nodes),
                ends.leaves.offset_from(leaves),
                ends.rest.offset_from(rest),
            ]
        };
        assert_eq!(lengths.iter().sum::<isize>(), count as isize);
        said.extend((lists.iter().zip(lengths)).map(|(list, n)| list[..n as usize].to_vec()));
    }
    said
}

/// So many items that are no triangles, in boxes whose area is no number.
struct Others(u32);

impl Leaves for Others {
    fn count(&self) -> u32 {
        self.0
    }

    fn bounds(&self, item: u32) -> Bounds {
        Bounds {
            min: Vec3::new(-3e38, -3e38, item as f32),
            max: Vec3::new(3e38, 3e38, item as f32),
        }
    }

    fn is_triangle(&self, _: u32) -> bool {
        false
    }

    fn triangle(&self, _: u32) -> (u32, [Vec3; 3]) {
        unreachable!("there is none")
    }

    fn numbers(&self) -> Vec<Range<u32>> {
        Vec::new()
    }

    fn digest(&self, _: &mut blake3::Hasher) {
        unreachable!("it is not kept")
    }
}

#[test]
fn boxes_whose_area_is_no_number_have_a_tree_too() {
    for count in [1, 2, 3, 9, 100] {
        let (_, mut items, _) = Tree::build(&Others(count), Build::Medium, None);
        items.sort_unstable();
        assert!(items.into_iter().eq(0..count), "{count}");
    }
}
