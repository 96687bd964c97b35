//! Photons of caustics: where light comes to that mirrors and clear glass have led to a surface which scatters it, and where
//! it comes from there (Jensen, *Global illumination using photon maps*, 1996).
//!
//! Few of the paths that set out evenly from the lights meet a small glass sphere. So a path that brought a photon is changed
//! a little, in the numbers that it is made of, time and again (Kelemen et al., *A simple and robust mutation strategy for the
//! Metropolis light transport algorithm*, 2002): a chain from each of some such paths. Every path that brings a photon brings
//! one of the same weight: what is learnt from them proposes directions, and need not be exact.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::accel::{Counts, Order};
use crate::color::{ColorModel, Spectral as _};
use crate::interaction::{Hit, Interaction, Ray};
use crate::light::{Ball, Draw, Emission, Source};
use crate::math::random;
use crate::scene::{LightId, Scene};

/// Light that has come to a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Photon {
    /// World space.
    pub(super) position: Vec3,
    /// Toward where it came from; world space, unit length.
    pub(super) direction: Vec3,
}

/// What photons are shot with.
#[derive(Debug)]
pub(super) struct Shooting<'a, C: ColorModel> {
    pub(super) scene: &'a Scene<C>,
    /// The time in which they are.
    pub(super) shutter: (f32, f32),
    /// How many surfaces may lead them, at most [`MAX_BOUNCES`].
    pub(super) bounces: u32,
}

/// How many surfaces may lead a photon.
pub(super) const MAX_BOUNCES: u32 = 8;
/// Of a path's numbers: for the place and the direction, the light, the time and the wavelengths that it sets out with.
const PLACE: usize = 0;
const DIRECTION: usize = 2;
const LIGHT: usize = 4;
const TIME: usize = 5;
const WAVELENGTHS: usize = 6;
/// From there on, three for each surface, the last one included.
const BOUNCES: usize = 7;
const COUNT: usize = BOUNCES + 3 * (MAX_BOUNCES as usize + 1);

/// The numbers that a path is made of, in [0, 1).
type Numbers = [f32; COUNT];

/// A path that brought a photon.
#[derive(Clone, Copy, Debug)]
struct Found {
    photon: Photon,
    /// The most that it carries in any channel.
    flux: f32,
}

/// A lobe as narrow as this (1/sr) is as good as a mirror.
const SHARP: f32 = 16.0;
/// Light that is seen within more than 1/this (sr) is found without being led to.
const SMALL: f32 = 1.0;

/// Even paths set out so many at a time,
const ROUND: u32 = 1 << 14;
/// until they have brought so many photons
const ENOUGH: usize = 1024;
/// or so many rounds are over, and fewer where they bring none.
const ROUNDS: u32 = 32;
const EMPTY_ROUNDS: u32 = 8;
/// Paths that are followed together.
const TOGETHER: usize = 128;
/// Chains; a multiple of the above.
const CHAINS: usize = 1024;
/// The smallest and the largest step of a number.
const STEPS: [f32; 2] = [1.0 / 4096.0, 1.0 / 16.0];
/// A chain ends after so many times the steps that it would need if each brought a photon.
const PATIENCE: usize = 4;

/// The photons' seed: the same for all renders, so that films, crops and parts share them.
const SEED: u64 = 0x70_686f_746f_6e73;

impl<C: ColorModel> Shooting<'_, C> {
    /// About `count` photons, or fewer where they are hard to find, in an order that depends on nothing but the scene.
    pub(super) fn shoot(&self, count: usize) -> Vec<Photon> {
        let seeds = self.evenly();
        let mut photons: Vec<Photon> = seeds.iter().map(|seed| seed.1.photon).collect();
        let total: f64 = seeds.iter().map(|seed| f64::from(seed.1.flux)).sum();
        if total > 0.0 && total.is_finite() {
            // Where the sum of their flux passes an even grid.
            let (mut starts, mut sum) = (Vec::with_capacity(CHAINS), 0.0);
            for (numbers, found) in &seeds {
                sum += f64::from(found.flux) * CHAINS as f64 / total;
                while (starts.len() as f64 + 0.5) < sum && starts.len() < CHAINS {
                    starts.push((*numbers, found.flux));
                }
            }
            let wanted = count.saturating_sub(photons.len()).div_ceil(CHAINS);
            let groups = starts.par_chunks(TOGETHER).enumerate();
            let found: Vec<Vec<Photon>> = groups
                .map(|(group, starts)| self.chains(group as u64, starts, wanted * starts.len()))
                .collect();
            photons.extend(found.into_iter().flatten());
        }
        photons.truncate(count);
        photons
    }

    /// Paths that set out evenly: those that brought a photon.
    fn evenly(&self) -> Vec<(Numbers, Found)> {
        let mut found = Vec::new();
        for round in 0..ROUNDS {
            if found.len() >= ENOUGH || (round >= EMPTY_ROUNDS && found.is_empty()) {
                break;
            }
            let parts = (0..ROUND).into_par_iter().step_by(TOGETHER);
            let parts: Vec<Vec<(Numbers, Found)>> = parts
                .map(|first| {
                    let first = round * ROUND + first;
                    let paths = first..first + TOGETHER as u32;
                    let numbers: Vec<Numbers> = paths.map(even_numbers).collect();
                    let results = self.follow(&numbers);
                    let pairs = numbers.into_iter().zip(results);
                    pairs.filter_map(|(n, found)| Some((n, found?))).collect()
                })
                .collect();
            found.extend(parts.into_iter().flatten());
        }
        found
    }

    /// Chains that begin with paths of some flux, until they have brought so many photons or have lost patience.
    fn chains(&self, group: u64, starts: &[(Numbers, f32)], wanted: usize) -> Vec<Photon> {
        let mut states = starts.to_vec();
        let mut photons = Vec::with_capacity(wanted);
        let key = random::key(random::key(SEED, 1), group);
        let steps = PATIENCE * wanted.div_ceil(states.len());
        for step in 0..steps as u64 {
            if photons.len() >= wanted {
                break;
            }
            let key = |chain: usize| random::key(random::key(key, step), chain as u64);
            let changed = states.iter().enumerate();
            let numbers: Vec<Numbers> = changed
                .map(|(chain, (numbers, _))| changed_numbers(numbers, key(chain)))
                .collect();
            let found = self.follow(&numbers);
            for (chain, (numbers, found)) in numbers.into_iter().zip(found).enumerate() {
                let Some(found) = found else { continue };
                photons.push(found.photon);
                let u = random::unit(random::bits(key(chain), 2 * COUNT as u32));
                if u * states[chain].1 < found.flux {
                    states[chain] = (numbers, found.flux);
                }
            }
        }
        photons
    }

    /// Follows paths: what each brings.
    fn follow(&self, numbers: &[Numbers]) -> Vec<Option<Found>> {
        let scene = self.scene;
        let mut all = vec![None; numbers.len()];
        let mut flights = self.set_out(numbers);
        let (mut rays, mut hits) = (Vec::new(), Vec::new());
        for bounce in 0..=self.bounces.min(MAX_BOUNCES) {
            if flights.is_empty() {
                break;
            }
            rays.clear();
            rays.extend(flights.iter().map(|flight| flight.ray));
            scene.closest(&rays, Order::Any, &mut hits, &mut Counts::default());
            let mut kept = Vec::with_capacity(flights.len());
            for (mut flight, hit) in flights.into_iter().zip(&hits) {
                let index = flight.index;
                let own = numbers[index].get(BOUNCES + 3 * bounce as usize..);
                match self.meet(&mut flight, hit, own.unwrap_or_default()) {
                    Met::Nothing => {}
                    Met::Surface(found) => all[index] = Some(found),
                    Met::Mirror => kept.push(flight),
                }
            }
            flights = kept;
        }
        all
    }

    /// The beginnings of paths.
    fn set_out(&self, numbers: &[Numbers]) -> Vec<Flight<'_, C>> {
        let (scene, ball) = (self.scene, self.scene.ball());
        let (open, close) = self.shutter;
        let mut flights = Vec::with_capacity(numbers.len());
        for (index, n) in numbers.iter().enumerate() {
            let draw = Draw {
                place: Vec2::new(n[PLACE], n[PLACE + 1]),
                direction: Vec2::new(n[DIRECTION], n[DIRECTION + 1]),
                time: open + n[TIME] * (close - open),
            };
            let wavelengths = scene.color().wavelengths(|| n[WAVELENGTHS]);
            let Some(departure) = begin(scene, &ball, n[LIGHT], &draw, &wavelengths) else {
                continue;
            };
            let emission = &departure.1;
            flights.push(Flight {
                index,
                ray: Ray {
                    origin: emission.origin,
                    direction: emission.direction,
                    t_max: f32::INFINITY,
                    time: draw.time,
                },
                flux: emission.flux,
                wavelengths,
                departure: Some(departure),
                led: false,
            });
        }
        flights
    }

    /// What becomes of a path where it meets something.
    fn meet(&self, flight: &mut Flight<'_, C>, hit: &Hit, numbers: &[f32]) -> Met {
        if hit.is_miss() {
            return Met::Nothing;
        }
        let at = self.scene.interaction(&flight.ray, hit);
        if let Some((light, emission)) = flight.departure.take() {
            let light = &self.scene.lights()[light.index()];
            if light.emission_pdf(&emission, at.position, at.time) < SMALL {
                return Met::Nothing;
            }
        }
        let &[u1, x, y, ..] = numbers else {
            return Met::Nothing;
        };
        let material = self.scene.material(&at);
        let u2 = Vec2::new(x, y);
        let Some(sample) = material.sample(&at, at.wi, u1, u2, &flight.wavelengths) else {
            return Met::Nothing;
        };
        if !sample.delta && sample.pdf < SHARP {
            return match flight.led {
                true => Met::Surface(flight.end(&at)),
                false => Met::Nothing,
            };
        }
        flight.flux *= sample.weight;
        if flight.flux.is_black() {
            return Met::Nothing;
        }
        flight.wavelengths = C::narrowed(&flight.wavelengths, &flight.flux);
        flight.ray = at.spawn(at.frame.to_world(sample.wo));
        flight.led |= !sample.null;
        Met::Mirror
    }
}

/// What a path has met.
enum Met {
    /// What ends it without a photon.
    Nothing,
    /// A surface that scatters.
    Surface(Found),
    /// One that leads it on.
    Mirror,
}

/// A path on its way.
struct Flight<'s, C: ColorModel> {
    /// Which of those that are followed together.
    index: usize,
    ray: Ray,
    flux: C::Sample,
    wavelengths: C::Wavelengths,
    /// How it set out, before it has met anything.
    departure: Option<(LightId, Emission<'s, C::Sample>)>,
    /// Whether a mirror or glass has led it.
    led: bool,
}

impl<C: ColorModel> Flight<'_, C> {
    /// Ends at a surface.
    fn end(&self, at: &Interaction<'_>) -> Found {
        Found {
            photon: Photon {
                position: at.position,
                direction: -self.ray.direction,
            },
            flux: self.flux.max_value(),
        }
    }
}

/// The beginning of a path from a light that paths from the camera can meet.
fn begin<'s, C: ColorModel>(
    scene: &'s Scene<C>,
    ball: &Ball,
    u: f32,
    draw: &Draw,
    wavelengths: &C::Wavelengths,
) -> Option<(LightId, Emission<'s, C::Sample>)> {
    let departure = scene.emit(ball, u, draw, wavelengths)?;
    let emission = &departure.1;
    let is_met = matches!(emission.source, Source::Surface(_) | Source::Environment);
    (is_met && !emission.flux.is_black()).then_some(departure)
}

/// The numbers of an even path: the first go along an additive recurrence (Roberts, *The unreasonable effectiveness of
/// quasirandom sequences*, 2018), as evenly as they are few; those of bounces are random.
fn even_numbers(path: u32) -> Numbers {
    /// 2³² times the powers of 1/x, where x⁶ = x + 1.
    const FACTORS: [u32; 5] = [
        3_785_032_107,
        3_335_640_777,
        2_939_605_023,
        2_590_590_015,
        2_283_013_049,
    ];
    let key = random::key(random::key(SEED, 0), u64::from(path));
    std::array::from_fn(|dimension| match FACTORS.get(dimension) {
        Some(factor) => {
            let fraction = (path.wrapping_add(1)).wrapping_mul(*factor);
            random::unit(u64::from(fraction) << 32)
        }
        None => random::unit(random::bits(key, dimension as u32)),
    })
}

/// Numbers a step away: small steps are as frequent as large ones, each in its order of magnitude.
fn changed_numbers(numbers: &Numbers, key: u64) -> Numbers {
    let [least, most] = STEPS;
    // One size for all, by a power of two between the two.
    let octaves = (most / least).log2().round() as u32 + 1;
    let size =
        least * (1_u32 << (random::bits(key, 2 * COUNT as u32 + 1) % u64::from(octaves))) as f32;
    std::array::from_fn(|dimension| {
        let unit = random::unit(random::bits(key, dimension as u32));
        let moved = numbers[dimension] + size * (2.0 * unit - 1.0);
        let wrapped = moved - moved.floor();
        wrapped.min(1f32.next_down())
    })
}
