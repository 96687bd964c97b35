//! Each step of each kernel against plain arithmetic, on random lanes.

#![allow(unsafe_code)]

use glam::Vec3;

use super::kernel::Lanes;
use super::node::WIDTH;
use super::portable::Portable;
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

fn ray(i: u32) -> State {
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
        entry: number(3, i).max(0.0),
        best: Best {
            t: 1.0 + number(4, i),
            id: u32::MAX,
            place: Place::NOWHERE,
        },
    };
    let mut state = State::IDLE;
    state.begin(0, &start, 0);
    state.lanes = random::bits(5, i) as u32 & 15;
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

/// Everything that a kernel's steps say of many random lanes.
fn answers<L: Lanes>() -> Vec<u32> {
    let mut said = Vec::new();
    for i in 0..5000 {
        let (ray, node, block) = (ray(i), node(i), block(i));
        let (mut distances, mut names) = ([0.0_f32; WIDTH], [0_u32; WIDTH]);
        let sorted: [f32; WIDTH] = std::array::from_fn(|k| 1.0 + number(9, 8 * i + k as u32));
        // SAFETY: the caller has what the kernel needs; there is room for eight.
        unsafe {
            let count = L::enter::<false>(&node, &ray, distances.as_mut_ptr(), names.as_mut_ptr());
            said.push(count);
            said.extend(distances.iter().take(count as usize).map(|d| d.to_bits()));
            said.extend(names.iter().take(count as usize));
            assert_eq!(
                L::enter::<true>(&node, &ray, distances.as_mut_ptr(), names.as_mut_ptr()),
                count
            );
            said.push(L::pop(sorted.as_ptr(), ray.limit));
            said.push(L::inside(&block, &ray));
            let (t, lane) = L::meet(&block, &ray);
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
        let said = match kernel.name() {
            #[cfg(target_arch = "x86_64")]
            "AVX2" => answers::<avx::Avx2>(),
            #[cfg(target_arch = "x86_64")]
            "AVX-512" => answers::<avx::Avx512>(),
            _ => continue,
        };
        assert!(said == plain, "{}", kernel.name());
    }
    assert!(
        plain.contains(&(WIDTH as u32)),
        "some ray enters all children"
    );
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
}

#[test]
fn boxes_whose_area_is_no_number_have_a_tree_too() {
    for count in [1, 2, 3, 9, 100] {
        let (_, mut items) = Tree::build(&Others(count), Build::Medium);
        items.sort_unstable();
        assert!(items.into_iter().eq(0..count), "{count}");
    }
}
