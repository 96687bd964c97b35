//! How fast: rays against a bumpy sphere of 327,680 triangles, building its tree, and whole renders.
//!
//!     cargo bench                    # everything
//!     cargo bench -- closest         # those with "closest" in their name
//!
//! Rays are traced by one thread, renders by all. Compare only what was measured in one run on one machine.

use std::sync::{Arc, OnceLock};

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use etendue::accel::{Counts, Method, Order, Tracer};
use etendue::budget::Budget;
use etendue::description::{self, Description, Kind};
use etendue::interaction::{Hit, Ray};
use etendue::lanes::warp;
use etendue::math::random;
use etendue::mesh;
use etendue::render::{Colors, Options, Overrides, Silent, render};
use etendue::sampler::{Sampler, Stream};
use etendue::shape::{Geometry, TriangleMesh};
use glam::{Vec2, Vec3};

fn main() {
    divan::main();
}

/// Rays of a batch.
const RAYS: u32 = 1 << 16;

fn geometry() -> Vec<Arc<Geometry>> {
    let mesh = mesh::bumpy_sphere(7, 1);
    vec![Arc::new(Geometry::Mesh(TriangleMesh::new(mesh)))]
}

fn tracer() -> &'static Tracer {
    static TRACER: OnceLock<Tracer> = OnceLock::new();
    TRACER.get_or_init(|| Tracer::new(geometry(), &[0], Vec::new(), Method::Tree))
}

fn unit(seed: u64, i: u32) -> f32 {
    random::unit(random::bits(seed, i))
}

fn direction(seed: u64, i: u32) -> Vec3 {
    let u = Vec2::new(unit(seed, 2 * i), unit(seed, 2 * i + 1));
    warp::uniform_sphere::<f32>(u.into()).into()
}

/// From outside, side by side, as a camera's.
fn primary() -> Vec<Ray> {
    let side = 1 << 8;
    let place = |i: u32| (i as f32 + 0.5) / side as f32 * 2.0 - 1.0;
    (0..RAYS)
        .map(|i| {
            let origin = Vec3::new(0.0, 0.0, 4.0);
            let target = Vec3::new(place(i % side), place(i / side), 0.0);
            ray(origin, (target - origin).normalize(), f32::INFINITY)
        })
        .collect()
}

fn ray(origin: Vec3, direction: Vec3, t_max: f32) -> Ray {
    Ray {
        origin,
        direction,
        t_max,
        time: 0.0,
    }
}

/// From where the primary rays end, in all directions.
fn incoherent() -> Vec<Ray> {
    let rays = primary();
    let mut hits = Vec::new();
    tracer().closest(&rays, Order::Any, &mut hits, &mut Counts::default());
    rays.iter()
        .zip(&hits)
        .filter(|(_, hit)| !hit.is_miss())
        .enumerate()
        .map(|(i, (ray, hit))| tracer().interaction(ray, hit).spawn(direction(2, i as u32)))
        .collect()
}

/// From where the primary rays end, toward a light above.
fn shadow() -> Vec<Ray> {
    let light = Vec3::new(0.0, 5.0, 2.0);
    let toward = |r: Ray| {
        ray(
            r.origin,
            (light - r.origin).normalize(),
            r.origin.distance(light),
        )
    };
    incoherent().into_iter().map(toward).collect()
}

fn closest(bencher: Bencher<'_, '_>, rays: &[Ray]) {
    let mut hits: Vec<Hit> = Vec::new();
    bencher
        .counter(ItemsCount::new(rays.len()))
        .bench_local(|| {
            tracer().closest(
                black_box(rays),
                Order::Any,
                &mut hits,
                &mut Counts::default(),
            )
        });
}

#[divan::bench(sample_count = 20)]
fn closest_primary(bencher: Bencher<'_, '_>) {
    closest(bencher, &primary());
}

#[divan::bench(sample_count = 20)]
fn closest_incoherent(bencher: Bencher<'_, '_>) {
    closest(bencher, &incoherent());
}

#[divan::bench(sample_count = 20)]
fn occluded_shadow(bencher: Bencher<'_, '_>) {
    let (rays, mut blocked) = (shadow(), Vec::new());
    bencher
        .counter(ItemsCount::new(rays.len()))
        .bench_local(|| {
            tracer().occluded(
                black_box(&rays),
                Order::Any,
                &mut blocked,
                &mut Counts::default(),
            );
        });
}

#[divan::bench(sample_count = 5)]
fn build_tree(bencher: Bencher<'_, '_>) {
    let geometry = geometry();
    bencher.bench_local(|| Tracer::new(geometry.clone(), &[0], Vec::new(), Method::Tree));
}

/// 64 samples of four pairs each in a row of pixels, as a path draws them.
#[divan::bench(args = Sampler::NAMES, sample_count = 20)]
fn draw_pairs(bencher: Bencher<'_, '_>, name: &str) {
    let sampler = format!(
        r#"<scene version="3.0.0"><sampler type="{name}"><integer name="sample_count" value="64"/></sampler></scene>"#
    );
    let scene = Description::parse(
        &sampler,
        "bench.xml".as_ref(),
        &description::Options::default(),
    );
    let scene = scene.expect("the scene is right");
    let properties = scene.root().children(Kind::Sampler)[0];
    let sampler = Sampler::build(&properties, &()).expect("the sampler is right");
    let (pixels, samples, pairs) = (16, 64, 4);
    bencher
        .counter(ItemsCount::new(pixels * samples * pairs))
        .bench_local(|| {
            let mut sum = Vec2::ZERO;
            for (pixel, sample) in (0..pixels).flat_map(|x| (0..samples).map(move |i| (x, i))) {
                let stream = Stream::new(0, pixel, 0, sample);
                for pair in 0..pairs {
                    sum += stream.pair(black_box(&sampler), 2 * pair);
                }
            }
            sum
        });
}

/// A scene of `scenes/`, small.
#[divan::bench(args = ["cornell-box", "soft-shadow", "spheres"], sample_count = 5)]
fn scene(bencher: Bencher<'_, '_>, name: &str) {
    render_small(bencher, name, Colors::Rgb);
}

#[divan::bench(args = [8, 16, 32], sample_count = 5)]
fn cornell_box_in_bands(bencher: Bencher<'_, '_>, bands: usize) {
    render_small(bencher, "cornell-box", Colors::bands(bands));
}

fn render_small(bencher: Bencher<'_, '_>, name: &str, colors: Colors) {
    let path = format!("{}/scenes/{name}.xml", env!("CARGO_MANIFEST_DIR"));
    let options = description::Options::default();
    let mut description =
        Description::read(path.as_ref(), &options, &Budget::default()).expect("the scene is right");
    let (spp, size) = (4, (128, 96));
    Overrides {
        spp: Some(spp),
        size: Some(size),
        ..Overrides::default()
    }
    .apply(&mut description);
    let options = Options {
        colors,
        ..Options::default()
    };
    bencher
        .counter(ItemsCount::new(spp * size.0 * size.1))
        .bench_local(|| render(&description, &options, &Silent).expect("the scene is right"));
}
