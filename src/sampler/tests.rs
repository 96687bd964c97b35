//! What every sampler promises, and what each one does.

use std::path::Path;

use glam::Vec2;

use super::*;
use crate::description::{Description, Kind, Options};
use crate::error::Error;
use crate::lanes::{Kernel, MAX_LANES, Task};
use crate::math::random;

/// Single points, of the pixel that has `key`.
impl Sampler {
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32 {
        Stream { key, index }.number(self, dimension)
    }

    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        Stream { key, index }.pair(self, dimension)
    }
}

/// A sampler as a scene file asks for it, and the note on its count.
fn build(name: &str, inside: &str) -> Result<(Sampler, Option<Problem>)> {
    let text =
        format!(r#"<scene version="3.0.0"><sampler type="{name}">{inside}</sampler></scene>"#);
    let scene = Description::parse(&text, Path::new("test.xml"), &Options::default())?;
    let child = scene.root().children(Kind::Sampler)[0];
    let sampler = Sampler::build(&child, &())?;
    let note = sampler.rounding(&child)?;
    Ok((sampler, note))
}

fn sampler(name: &str, count: u32) -> Sampler {
    let count = format!(r#"<integer name="sample_count" value="{count}"/>"#);
    build(name, &count)
        .unwrap_or_else(|e: Error| panic!("{e}"))
        .0
}

/// Every sampler of the family, for about `count` samples.
fn every_sampler(count: u32) -> impl Iterator<Item = (&'static str, Sampler)> {
    Sampler::NAMES
        .iter()
        .map(move |name| (*name, sampler(name, count)))
}

/// Every sampler but `grid`, which is biased by its nature.
fn every_unbiased_sampler(count: u32) -> impl Iterator<Item = (&'static str, Sampler)> {
    every_sampler(count).filter(|(name, _)| *name != "grid")
}

/// The key of the `i`-th of many pixels.
fn pixel(i: u64) -> u64 {
    random::key(random::key(0, 77), i)
}

/// Counts and their rounding, as Mitsuba 3.9.1 has them where it has the sampler.
#[test]
fn counts_are_rounded_up_as_mitsuba_rounds_them_and_this_is_said() {
    let wanted = [1, 2, 3, 4, 5, 7, 8, 10, 16, 17, 30, 64, 100, 1000];
    for (name, counts) in [
        ("grid", [1, 4, 4, 4, 9, 9, 9, 16, 16, 25, 36, 64, 100, 1024]),
        ("independent", wanted),
        (
            "ldsampler",
            [4, 4, 4, 4, 16, 16, 16, 16, 16, 64, 64, 64, 256, 1024],
        ),
        (
            "multijitter",
            [1, 2, 3, 4, 6, 8, 8, 12, 16, 20, 30, 64, 100, 1023],
        ),
        (
            "orthogonal",
            [4, 4, 4, 4, 9, 9, 9, 25, 25, 25, 49, 121, 121, 1369],
        ),
        ("poisson", wanted),
        (
            "sobol",
            [1, 2, 4, 4, 8, 8, 8, 16, 16, 32, 32, 64, 128, 1024],
        ),
        (
            "stratified",
            [1, 4, 4, 4, 9, 9, 9, 16, 16, 25, 36, 64, 100, 1024],
        ),
    ] {
        for (wanted, count) in wanted.into_iter().zip(counts) {
            let property = format!(r#"<integer name="sample_count" value="{wanted}"/>"#);
            let (sampler, note) = build(name, &property).unwrap();
            assert_eq!(sampler.sample_count(), count, "{name} {wanted}");
            assert_eq!(note.is_some(), count != wanted, "{name} {wanted}");
        }
    }
    let (_, note) = build("stratified", r#"<integer name="sample_count" value="10"/>"#).unwrap();
    assert_eq!(
        note.unwrap().to_string(),
        "test.xml:1:51: 10 samples a pixel are rounded up to 16; stratified takes squares"
    );
    assert_eq!(sampler("poisson", 1500).sample_count(), 1500);
    assert_eq!(sampler("poisson", 1500).set_size(), 750);
    assert_eq!(sampler("poisson", 2049).sample_count(), 2049);
}

#[test]
fn every_sampler_takes_mitsubas_parameters_and_bounds_its_count() {
    for name in Sampler::NAMES {
        let (sampler, _) = build(name, r#"<integer name="seed" value="5"/>"#).unwrap();
        assert_eq!(sampler.sample_count(), 4, "{name}");
        for count in ["0", "-3", "1073741825"] {
            let count = format!(r#"<integer name="sample_count" value="{count}"/>"#);
            let error = build(name, &count).unwrap_err().to_string();
            assert!(
                error.contains("must be from 1 to 1073741824"),
                "{name}: {error}"
            );
        }
    }
    for name in ["multijitter", "orthogonal", "stratified"] {
        let text =
            r#"<integer name="sample_count" value="25"/><boolean name="jitter" value="false"/>"#;
        let (sampler, _) = build(name, text).unwrap();
        let x = sampler.get_1d(pixel(0), 3, 4) * 25.0;
        assert!((x.fract() - 0.5).abs() < 1e-4, "{name}: {x}");
    }
    assert!(build("orthogonal", r#"<integer name="strength" value="2"/>"#).is_ok());
    let error = build("orthogonal", r#"<integer name="strength" value="3"/>"#).unwrap_err();
    assert!(
        error.to_string().contains("they have strength 2"),
        "{error}"
    );
}

#[test]
fn every_sampler_fills_the_unit_square_evenly_and_repeats_itself() {
    for (name, sampler) in every_sampler(1000) {
        let n = sampler.sample_count();
        assert!(n >= 1000 && n % sampler.set_size() == 0, "{name}");
        for dimension in [0, 6, 40] {
            let points =
                |key| -> Vec<Vec2> { (0..n).map(|i| sampler.get_2d(key, i, dimension)).collect() };
            let inside = |x: f32| (0.0..1.0).contains(&x);
            assert!(
                points(9).iter().all(|p| inside(p.x) && inside(p.y)),
                "{name}"
            );
            assert!(
                (0..n).all(|i| inside(sampler.get_1d(9, i, dimension))),
                "{name}"
            );
            let mean = points(9).iter().sum::<Vec2>() / n as f32;
            // Five standard deviations of independent points.
            let tolerance = 5.0 * 0.289 / (n as f32).sqrt();
            let off = (mean - Vec2::splat(0.5)).abs().max_element();
            assert!(off < tolerance, "{name}: {mean}");
            assert_eq!(points(9), points(9), "{name}");
            assert_ne!(
                points(9),
                points(10),
                "{name} gives two pixels the same points"
            );
        }
    }
}

/// The largest counts are taken without making them all.
#[test]
fn every_sampler_works_at_the_largest_count() {
    for (name, sampler) in every_sampler(MAX_SAMPLES) {
        assert!(sampler.sample_count() >= MAX_SAMPLES, "{name}");
        for index in [0, 1, 12_345_678, sampler.sample_count() - 1] {
            for dimension in [0, 8, 1000, 100_000] {
                let p = sampler.get_2d(pixel(index.into()), index, dimension);
                let x = sampler.get_1d(pixel(index.into()), index, dimension + 1);
                assert!(
                    [p.x, p.y, x].iter().all(|x| (0.0..1.0).contains(x)),
                    "{name}"
                );
            }
        }
    }
}

#[test]
fn every_point_of_a_set_is_uniform_so_that_every_prefix_is_unbiased() {
    for (name, sampler) in every_unbiased_sampler(16) {
        for index in [0, 1, 5, sampler.set_size() - 1] {
            let keys = 1 << 14;
            let mut cells = [[0_u32; 8]; 3];
            for key in (0..keys).map(pixel) {
                let p = sampler.get_2d(key, index, 2);
                let x = sampler.get_1d(key, index, 4);
                for (cells, x) in cells.iter_mut().zip([p.x, p.y, x]) {
                    cells[(x * 8.0) as usize] += 1;
                }
            }
            let expected = keys as f64 / 8.0;
            for cells in cells {
                let square = |c: &u32| (f64::from(*c) - expected).powi(2) / expected;
                // χ² with 7 degrees of freedom: above 35 once in 100,000.
                let chi: f64 = cells.iter().map(square).sum();
                assert!(chi < 35.0, "{name}, point {index}: {chi}");
            }
        }
    }
}

/// Pearson's correlation of two lists.
fn correlation(a: &[f32], b: &[f32]) -> f64 {
    let n = a.len() as f64;
    let mean = |x: &[f32]| x.iter().map(|x| f64::from(*x)).sum::<f64>() / n;
    let (ma, mb) = (mean(a), mean(b));
    let products = |x: &[f32], mx: f64, y: &[f32], my: f64| -> f64 {
        let product = |(x, y): (&f32, &f32)| (f64::from(*x) - mx) * (f64::from(*y) - my);
        x.iter().zip(y).map(product).sum()
    };
    products(a, ma, b, mb) / (products(a, ma, a, ma) * products(b, mb, b, mb)).sqrt()
}

/// Neighbouring pixels, the dimensions of a path and the sets of a pixel know nothing of each other.
#[test]
fn no_sampler_correlates_pixels_dimensions_or_sets() {
    for (name, sampler) in every_sampler(16) {
        let n = sampler.sample_count();
        let samples = || {
            (0..64)
                .flat_map(|y| (0..64).map(move |x| (x, y)))
                .flat_map(|p| (0..n).map(move |i| (p, i)))
        };
        let mut columns: Vec<Vec<f32>> = vec![Vec::new(); 12];
        for ((x, y), index) in samples() {
            let mut put = |column: usize, stream: Stream| {
                let pair = stream.pair(&sampler, 2 * (column as u32 / 2));
                columns[column].push(pair.x);
                columns[column + 1].push(pair.y);
                columns[column + 2].push(stream.number(&sampler, column as u32 + 100));
            };
            put(0, Stream::new(1, x, y, index)); // the pixel
            put(3, Stream::new(1, x + 1, y, index)); // its neighbour
            put(6, Stream::new(1, x, y, index + n)); // its next set
            put(9, Stream::new(2, x, y, index)); // another seed
        }
        let tolerance = 5.0 / (columns[0].len() as f64).sqrt();
        for a in 0..12 {
            for b in 0..a {
                let r = correlation(&columns[a], &columns[b]);
                assert!(r.abs() < tolerance, "{name}: columns {a} and {b}: {r}");
            }
        }
        let dimensions: Vec<Vec<f32>> = (0..20)
            .map(|d| {
                let value = |((x, y), index)| {
                    let pair = Stream::new(1, x, y, index).pair(&sampler, d / 2 * 2);
                    if d % 2 == 0 { pair.x } else { pair.y }
                };
                samples().map(value).collect()
            })
            .collect();
        // Within a pixel points depend on each other: pixels are counted, not samples.
        let tolerance = 5.0 / f64::from(64 * 64).sqrt();
        for a in 0..20 {
            for b in 0..a {
                let r = correlation(&dimensions[a], &dimensions[b]);
                assert!(r.abs() < tolerance, "{name}: dimensions {a} and {b}: {r}");
            }
        }
    }
}

/// How many of `n` cells the places take, each of which must be a cell's number.
fn taken(n: u32, cells: impl Iterator<Item = u32>) -> usize {
    let mut seen = vec![false; n as usize];
    for cell in cells {
        seen[cell as usize] = true;
    }
    seen.iter().filter(|s| **s).count()
}

/// The interval of `n` equal ones in which a coordinate lies.
fn interval(x: f32, n: u32) -> u32 {
    // A coordinate that single precision put onto a boundary belongs to either side.
    ((f64::from(x) + 1e-7) * f64::from(n)) as u32
}

#[test]
fn every_sampler_but_independent_stratifies_single_dimensions() {
    for (name, sampler) in every_sampler(100).filter(|(name, _)| *name != "independent") {
        let n = sampler.set_size();
        for (key, set, dimension) in [(0, 0, 4), (1, 0, 5), (2, 3, 33)] {
            let points = (n * set..n * (set + 1))
                .map(|i| interval(sampler.get_1d(pixel(key), i, dimension), n));
            assert_eq!(taken(n, points), n as usize, "{name}");
        }
    }
}

#[test]
fn stratified_and_grid_points_lie_one_in_each_cell() {
    for name in ["grid", "stratified"] {
        let sampler = sampler(name, 64);
        let cell = |i| {
            let p = sampler.get_2d(4, i, 6);
            interval(p.x, 8) + 8 * interval(p.y, 8)
        };
        assert_eq!(taken(64, (64..128).map(cell)), 64);
    }
}

#[test]
fn the_points_of_a_grid_are_the_same_everywhere_and_come_in_another_order() {
    let grid = sampler("grid", 16);
    let points = |key| -> Vec<[u32; 2]> {
        let point = |i| (grid.get_2d(key, i, 0) * 4.0 - 0.5).as_uvec2().to_array();
        (0..16).map(point).collect()
    };
    let (mut a, mut b) = (points(pixel(0)), points(pixel(1)));
    assert_ne!(a, b);
    a.sort();
    b.sort();
    assert_eq!(a, b);
    let centre = grid.get_2d(0, 0, 0) * 4.0;
    assert_eq!(centre.fract(), Vec2::splat(0.5));
}

#[test]
fn multijittered_points_lie_one_in_each_cell_column_and_row() {
    for (count, columns, rows) in [(16, 4, 4), (20, 4, 5), (90, 9, 10), (1000, 31, 33)] {
        let sampler = sampler("multijitter", count);
        let n = columns * rows;
        for key in (0..4).map(pixel) {
            let points: Vec<Vec2> = (0..n).map(|i| sampler.get_2d(key, i, 8)).collect();
            let cell = |p: &Vec2| interval(p.x, columns) + columns * interval(p.y, rows);
            assert_eq!(taken(n, points.iter().map(cell)), n as usize);
            assert_eq!(
                taken(n, points.iter().map(|p| interval(p.x, n))),
                n as usize
            );
            assert_eq!(
                taken(n, points.iter().map(|p| interval(p.y, n))),
                n as usize
            );
        }
    }
}

/// Strength 2: in any two dimensions of a block, not only in pairs, each cell of p × p has one point.
#[test]
fn orthogonal_arrays_stratify_any_two_dimensions_of_a_block() {
    for (prime, block) in [(3, 4), (5, 6), (7, 8), (13, 14)] {
        let sampler = sampler("orthogonal", prime * prime);
        let n = prime * prime;
        for (key, first) in [(pixel(0), 0), (pixel(1), 3 * block)] {
            let column = |d: u32| -> Vec<f32> {
                let pair = |i| sampler.get_2d(key, i, first + d / 2 * 2).to_array()[d as usize % 2];
                (0..n).map(pair).collect()
            };
            let columns: Vec<Vec<f32>> = (0..block).map(column).collect();
            for (a, x) in columns.iter().enumerate() {
                let fine = x.iter().map(|x| interval(*x, n));
                assert_eq!(taken(n, fine), n as usize, "dimension {a}");
                for y in &columns[..a] {
                    let cells = x.iter().zip(y);
                    let cells =
                        cells.map(|(x, y)| interval(*x, prime) + prime * interval(*y, prime));
                    assert_eq!(taken(n, cells), n as usize, "{prime}, {a}");
                }
            }
        }
    }
}

/// The net property: one point in each box of area 1/n with sides that are powers of two.
fn is_net(points: &[Vec2]) -> bool {
    let n = points.len() as u32;
    (0..=n.trailing_zeros()).all(|k| {
        let (columns, rows) = (1 << k, n >> k);
        let cell = |p: &Vec2| (p.x * columns as f32) as u32 + columns * (p.y * rows as f32) as u32;
        taken(n, points.iter().map(cell)) == n as usize
    })
}

#[test]
fn pairs_of_sobol_and_ldsampler_are_nets() {
    for count in [4, 16, 64, 1024] {
        for name in ["ldsampler", "sobol"] {
            let sampler = sampler(name, count);
            // Those of all dimensions with ldsampler, of the first in a block with sobol.
            for (key, dimension) in [(pixel(0), 0), (pixel(1), 16), (pixel(2), 64)] {
                let points: Vec<Vec2> = (0..count)
                    .map(|i| sampler.get_2d(key, i, dimension))
                    .collect();
                assert!(is_net(&points), "{name} {count} {dimension}");
            }
        }
    }
}

#[test]
fn sobol_is_a_net_again_and_again_before_its_set_is_full() {
    let sampler = sampler("sobol", 1024);
    for dimension in [0, 16, 48] {
        let points: Vec<Vec2> = (0..1024)
            .map(|i| sampler.get_2d(pixel(5), i, dimension))
            .collect();
        for size in [2, 8, 64, 256] {
            assert!(points.chunks(size).all(is_net), "{size}");
        }
    }
}

/// A block's dimensions are placed jointly: what depends on several gains too.
#[test]
fn sobol_integrates_what_pixel_and_lens_do_together() {
    let random = sampler("independent", 256);
    let interaction = |p: Vec2, q: Vec2| f64::from((-4.0 * p.distance_squared(q)).exp());
    let gain = variance(&random, interaction) / variance(&sampler("sobol", 256), interaction);
    assert!(gain > 8.0, "{gain}");
    let edge =
        |p: Vec2, q: Vec2| f64::from(u8::from(0.4 * p.x + 0.3 * p.y + q.x + 0.3 * q.y < 0.95));
    let gain = variance(&random, edge) / variance(&sampler("sobol", 256), edge);
    assert!(gain > 5.0, "{gain}");
}

/// In sample space, whatever the pixel, the pair and the set.
#[test]
fn poisson_discs_are_seven_tenths_of_the_hexagonal_bound_apart() {
    for count in [
        4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 16, 23, 32, 50, 64, 100, 256, 500, 1024, 2500,
    ] {
        let sampler = sampler("poisson", count);
        let n = sampler.set_size();
        let bound = (2.0 / (3f64.sqrt() * f64::from(n))).sqrt();
        for (key, set, dimension) in [(0, 0, 0), (1, 0, 2), (2, 1, 6), (3, 5, 44)] {
            let point = |i| {
                sampler
                    .get_2d(pixel(key), set * n + i, dimension)
                    .as_dvec2()
            };
            let points: Vec<_> = (0..n).map(point).collect();
            let mut least = f64::INFINITY;
            for (i, p) in points.iter().enumerate() {
                for q in &points[..i] {
                    let apart = *p - *q;
                    least = least.min((apart - apart.round()).length());
                }
            }
            assert!(least >= 0.7 * bound, "{count}: {}", least / bound);
        }
    }
}

/// The variance of a mean over one set, over many pixels, from a function of the pixel and the lens.
fn variance(sampler: &Sampler, f: impl Fn(Vec2, Vec2) -> f64) -> f64 {
    let n = sampler.sample_count();
    let pixels = 300;
    let mean = |key| {
        let value = |i| f(sampler.get_2d(key, i, 0), sampler.get_2d(key, i, 2));
        (0..n).map(value).sum::<f64>() / f64::from(n)
    };
    let means: Vec<f64> = (0..pixels).map(|i| mean(pixel(i))).collect();
    let mean = means.iter().sum::<f64>() / pixels as f64;
    means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (pixels - 1) as f64
}

#[test]
fn points_in_strata_integrate_better_than_independent_ones() {
    type Function = fn(Vec2, Vec2) -> f64;
    let functions: [(&str, Function, f64); 3] = [
        ("smooth", |p, _| f64::from((-p.x - p.y * p.y).exp()), 20.0),
        (
            "edge",
            |p, _| f64::from(u8::from(p.x + 0.6 * p.y < 0.7)),
            3.0,
        ),
        (
            "sum of both pairs",
            |p, q| f64::from(p.x * p.y + q.x * q.y),
            10.0,
        ),
    ];
    for (what, f, factor) in functions {
        let random = sampler("independent", 64);
        let expected = variance(&random, f);
        for name in ["ldsampler", "multijitter", "poisson", "sobol", "stratified"] {
            let gain = expected / variance(&sampler(name, 64), f);
            // On the torus a function's two sides meet, and that is an edge.
            let factor = if name == "poisson" { 2.5 } else { factor };
            assert!(gain > factor, "{name}, {what}: {gain}");
        }
        let gain =
            variance(&sampler("independent", 49), f) / variance(&sampler("orthogonal", 49), f);
        assert!(gain > factor, "orthogonal, {what}: {gain}");
    }
}

#[test]
fn a_parted_sampler_gives_independent_parts_of_the_same_kind() {
    for (name, sampler) in every_sampler(256) {
        let parts = sampler.parted(4).unwrap();
        let (m, n) = (parts.sample_count(), sampler.sample_count());
        assert!(4 * m >= n && m < n, "{name}: {m} of {n}");
        assert_eq!(m % parts.set_size(), 0, "{name}");
        assert_eq!(sampler.parted(1).unwrap().sample_count(), n, "{name}");
        assert!(sampler.parted(n + 1).is_none());
    }
    assert_eq!(
        sampler("stratified", 100).parted(4).unwrap().sample_count(),
        25
    );
    assert_eq!(sampler("sobol", 100).parted(4).unwrap().sample_count(), 32);
    let parts = sampler("stratified", 256).parted(4).unwrap();
    // The spread of the parts' means says how far the mean of all is off, which that of samples does not.
    let f = |p: Vec2| f64::from(p.x + p.y * p.y);
    let (mut spread, mut error) = (0.0, 0.0);
    for key in (0..400).map(pixel) {
        let mean = |part: u32| {
            (0..64)
                .map(|i| f(parts.get_2d(key, part * 64 + i, 0)))
                .sum::<f64>()
                / 64.0
        };
        let means: Vec<f64> = (0..4).map(mean).collect();
        let all = means.iter().sum::<f64>() / 4.0;
        spread += means.iter().map(|m| (m - all).powi(2)).sum::<f64>() / 12.0;
        error += (all - (0.5 + 1.0 / 3.0)).powi(2);
    }
    assert!(
        (0.8..1.25).contains(&(spread / error)),
        "{}",
        spread / error
    );
}

/// The bits of numbers and pairs of samples.
struct Points<'a>(&'a Sampler, &'a [Stream], u32);

impl Task for Points<'_> {
    type Output = Vec<[u32; 3]>;

    #[inline(always)]
    fn run<F: Lanes>(self) -> Self::Output {
        let Self(sampler, streams, dimension) = self;
        let mut all = Vec::new();
        for some in streams.chunks(F::WIDTH) {
            let streams = Streams::<F>::of(some);
            let number: F = sampler.number(streams, dimension);
            let pair: crate::lanes::Vec2<F> = sampler.pair(streams, dimension);
            let numbers = [number, pair.x, pair.y];
            all.extend((0..some.len()).map(|lane| numbers.map(|x| x.lane(lane).to_bits())));
        }
        all
    }
}

#[test]
fn every_kernel_draws_the_same_bits() {
    for count in [1, 7, 64, 1000, MAX_SAMPLES] {
        for (name, sampler) in every_sampler(count) {
            let indices = [0, 1, 5, 63, 64, 999, 1 << 20, u32::MAX];
            let streams = (0..9).flat_map(|x| indices.map(|index| Stream::new(3, x, 1, index)));
            let streams: Vec<Stream> = streams.take(4 * MAX_LANES + 3).collect();
            for dimension in [0, 14, 200] {
                let points = |kernel: Kernel| kernel.run(Points(&sampler, &streams, dimension));
                let expected = points(Kernel::all()[0]);
                for kernel in Kernel::all() {
                    assert!(
                        points(kernel) == expected,
                        "{name} {count} {}",
                        kernel.name()
                    );
                }
            }
        }
    }
}
