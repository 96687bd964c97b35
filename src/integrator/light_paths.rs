//! Paths from lights: each is connected with the sensor from every surface that it comes to (Arvo, *Backward ray tracing*,
//! 1986; Dutré, Lafortune and Willems, *Monte Carlo light tracing with direct computation of pixel intensities*, 1993).
//!
//! A surface scatters light on its way from a light as it does for paths that come from the camera, with the two directions
//! exchanged. What shading normals and bent rays do to that is Veach's: *Robust Monte Carlo methods for light transport
//! simulation* (1997), 5.2 and 5.3.
//!
//! Where paths also begin at the camera, each way to make a whole path is weighted against the others by the power
//! heuristic. The density of a path that was drawn otherwise differs by a factor at each of its surfaces, and a path carries
//! their product (ibid., 10.2.1; Georgiev, *Implementing vertex connection and merging*, 2012): at each the density with which
//! the surface before would have been found from here, over that with which this one was found from there. Distances cancel
//! out, cosines do not. Directions without any choice count as of density 1 on both sides.

use super::arrival::look_through_emitters;
use super::bounce::Bounces;
use super::lens::Lens;
use super::limits::Limits;
use super::mis::power_of_three;
use super::wave::{Block, Outcome, Shading, Wave, Ways, WithRays};
use super::{Cost, Splat, Start};
use crate::color::{ColorModel, Spectra as _, Spectral as _};
use crate::interaction::Ray;
use crate::lanes::{Lanes, Mask as _, Vec3};
use crate::light::{Ball, Draw, Emission, Source};
use crate::sampler::Sampler;
use crate::scene::{LightId, Scene};

/// What tells the stream of a path from a light from that of its sample.
const PATH: u64 = 1;
/// The dimensions of an emission and of the lens.
const PLACE: u32 = 0;
const DIRECTION: u32 = 2;
const LIGHT: u32 = 4;
const LENS: u32 = 6;
/// A bounce decides on the way on.
const BOUNCES: Bounces = Bounces { decisions: 1 };

/// Paths from the lights of a scene.
pub(super) struct LightPaths<'a, C: ColorModel> {
    pub(super) scene: &'a Scene<C>,
    pub(super) sampler: &'a Sampler,
    pub(super) lens: &'a Lens,
    pub(super) limits: &'a Limits,
    pub(super) ball: Ball,
    /// Whether the camera looks through lights.
    pub(super) hide_emitters: bool,
    /// Whether paths begin at the camera too, so that these are weighted against those.
    pub(super) weighted: bool,
}

/// A path that has set out.
struct Departed<'s, S> {
    light: LightId,
    emission: Emission<'s, S>,
    /// Index of the start.
    start: u32,
}

/// What a path carries.
#[derive(Clone, Copy, Debug)]
struct Carried<S> {
    /// What it set out with.
    flux: S,
    /// How dense the paths are that the camera begins and that draw the light, relative to this; and those that meet it.
    others: [f32; 2],
}

/// What is added where nothing stands between a surface and the sensor.
pub(super) struct Seen<S>(Splat<S>);

impl<C: ColorModel> LightPaths<'_, C> {
    /// Follows a path a start, and adds what comes to the film.
    pub(super) fn trace(
        &self,
        starts: &[Start<C>],
        splats: &mut Vec<Splat<C::Sample>>,
        cost: &mut Cost,
    ) {
        if self.limits.max_depth < 2 {
            return;
        }
        let (scene, limits) = (self.scene, self.limits);
        let (departed, begun) = self.set_out(starts);
        let carried = |slot: usize, _: &Start<C>| Carried {
            flux: departed[slot].emission.flux,
            others: [0.0; 2],
        };
        let mut wave = Wave::carrying(scene, self.sampler, &begun, carried);
        for depth in 0.. {
            if wave.is_over() {
                break;
            }
            wave.trace(depth + 1, false, cost);
            let Some(first) = BOUNCES.first(depth) else {
                break;
            };
            let mut bounce = Bounce {
                paths: self,
                departed: &departed,
                depth,
                // The surfaces so far, this one and the next, and the sensor.
                goes_on: limits.max_depth.saturating_sub(depth) > 2,
                splats,
            };
            let (mut hits, mut blocked) = (Vec::new(), Vec::new());
            let settle = |bounce: &mut Bounce<'_, '_, C>,
                          seen: &mut WithRays<Seen<C::Sample>>,
                          cost: &mut Cost| {
                let WithRays { rays, things } = seen;
                if self.hide_emitters {
                    cost.segments(scene, rays, &mut hits);
                    look_through_emitters(scene, rays, &mut hits, |_| true, cost);
                    blocked.clear();
                    blocked.extend(hits.iter().map(|hit| !hit.is_miss()));
                } else {
                    cost.occluded(scene, rays, &mut blocked);
                }
                let seen = things
                    .iter()
                    .zip(&blocked)
                    .filter(|(_, blocked)| !**blocked);
                bounce.splats.extend(seen.map(|(seen, _)| seen.0));
            };
            wave.shade_and(first, 1, &mut bounce, settle, cost);
        }
    }

    /// The beginnings of paths, of those starts whose light sends any.
    fn set_out(&self, starts: &[Start<C>]) -> (Vec<Departed<'_, C::Sample>>, Vec<Start<C>>) {
        let mut departed = Vec::with_capacity(starts.len());
        let mut begun = Vec::with_capacity(starts.len());
        for (index, start) in (0..).zip(starts) {
            let stream = start.stream.other(PATH);
            let draw = Draw {
                place: stream.pair(self.sampler, PLACE),
                direction: stream.pair(self.sampler, DIRECTION),
                time: start.ray.time,
            };
            let choice = stream.number(self.sampler, LIGHT);
            let emitted = (self.scene).emit(&self.ball, choice, &draw, &start.wavelengths);
            let Some((light, emission)) = emitted else {
                continue;
            };
            if emission.flux.is_black() {
                continue;
            }
            begun.push(Start {
                ray: Ray {
                    origin: emission.origin,
                    direction: emission.direction,
                    t_max: f32::INFINITY,
                    time: start.ray.time,
                },
                pass: start.pass,
                wavelengths: start.wavelengths,
                stream,
            });
            departed.push(Departed {
                light,
                emission,
                start: index,
            });
        }
        (departed, begun)
    }
}

/// A bounce: a connection with the sensor, and a way on.
struct Bounce<'a, 's, C: ColorModel> {
    paths: &'a LightPaths<'a, C>,
    departed: &'a [Departed<'s, C::Sample>],
    /// 0 at the first surface.
    depth: u32,
    goes_on: bool,
    splats: &'a mut Vec<Splat<C::Sample>>,
}

type Outgoing<'o, C> =
    Outcome<'o, C, Seen<<C as ColorModel>::Sample>, Carried<<C as ColorModel>::Sample>>;

impl<C: ColorModel> Shading<C, Carried<C::Sample>> for Bounce<'_, '_, C> {
    type Shadow = Seen<C::Sample>;

    #[inline(always)]
    fn shade<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F, Carried<C::Sample>>,
        out: &mut Outgoing<'_, C>,
    ) {
        let at = &block.at;
        let toward = at.frame.to_world(at.wi);
        let cos_in = at.normal.dot(toward).abs();
        let others = self.others(block, cos_in);
        if block.material.is_smooth() {
            self.connect(block, cos_in, others, out);
        }
        if self.goes_on {
            self.way(block, cos_in, others, out);
        }
    }
}

impl<C: ColorModel> Bounce<'_, '_, C> {
    /// How dense the other ways are to make the paths up to here, without the factor that depends on where they go on.
    #[inline(always)]
    fn others<F: Lanes>(&self, block: &Block<'_, C, F, Carried<C::Sample>>, cos_in: F) -> [F; 2] {
        let (mut drawn, mut met) = (F::ROW, F::ROW);
        if !self.paths.weighted {
            return [F::zero(); 2];
        }
        if self.depth > 0 {
            for lane in block.at.lanes() {
                [drawn[lane], met[lane]] = block.walker(lane).media.others;
            }
        } else {
            let positions = block.at.position.rows();
            for lane in block.at.lanes() {
                let Departed {
                    light, emission, ..
                } = &self.departed[block.walker(lane).slot as usize];
                let from = Vec3::<F>::of(&positions, lane);
                let density = match emission.source {
                    Source::Point => emission.density / from.distance_squared(emission.origin),
                    _ => emission.density,
                };
                let time = block.at.source.time(lane);
                let pdf = (self.paths.scene).emission_pdf(*light, emission, from, time);
                drawn[lane] = pdf / density;
                if matches!(emission.source, Source::Surface(_) | Source::Environment) {
                    met[lane] = density.recip();
                }
            }
        }
        [F::load(&drawn) / cos_in, F::load(&met) / cos_in]
    }

    /// Connects the points with the sensor.
    #[inline(always)]
    fn connect<F: Lanes>(
        &self,
        block: &Block<'_, C, F, Carried<C::Sample>>,
        cos_in: F,
        [drawn, met]: [F; 2],
        out: &mut Outgoing<'_, C>,
    ) {
        let Self { paths, .. } = self;
        let at = &block.at;
        let place = |lane: usize| match paths.lens.has_lens() {
            true => block.walker(lane).stream.pair(paths.sampler, LENS),
            false => glam::Vec2::ZERO,
        };
        let connections = paths.lens.connect(at, at.active, place);
        if !connections.found.any() {
            return;
        }
        let wo = at.frame.to_local(connections.direction);
        let value = block.material.eval_lanes(at, wo, at.wi, block.wavelengths);
        let found = connections.density * at.normal.dot(connections.direction).abs();
        let drawn = match self.depth {
            0 => drawn,
            _ => drawn * value.pdf,
        };
        let weight = power_of_three(drawn * found, met * value.pdf * found);
        let throughput = block.throughput * value.value * (weight * found / cos_in);
        let lit = connections.found & at.active & F::zero().lt(cos_in) & !throughput.is_black();
        if !lit.any() {
            return;
        }
        let values = throughput.rows();
        let [x, y] = connections.film;
        let rays = at.shadow(
            connections.direction,
            connections.target,
            F::Mask::splat(false),
        );
        out.ask_along(block, &rays, lit, |lane| {
            let walker = block.walker(lane);
            let share: C::Sample = C::Columns::<F>::of(&values, lane);
            Seen(Splat {
                film: glam::Vec2::new(x[lane], y[lane]),
                value: share * walker.media.flux,
                start: self.departed[walker.slot as usize].start,
            })
        });
    }

    /// Turns the paths.
    #[inline(always)]
    fn way<F: Lanes>(
        &self,
        block: &Block<'_, C, F, Carried<C::Sample>>,
        cos_in: F,
        [drawn, met]: [F; 2],
        out: &mut Outgoing<'_, C>,
    ) {
        let numbers = block.decisions(0);
        let (u2, u1) = (numbers.u2(), numbers.u1());
        let (at, w) = (&block.at, block.wavelengths);
        let sample = block.material.sample_lanes(at, at.wi, u1, u2, w);
        let direction = at.frame.to_world(sample.wo);
        let cos_out = at.normal.dot(direction).abs();
        // What is bent, or mirrored by a normal that is not the surface's.
        let bent =
            sample.eta * sample.eta * (at.wi.z.abs() * cos_out) / (sample.wo.z.abs() * cos_in);
        let mut scattered = sample.weight * bent;
        let (mut back, mut pdf) = (F::one(), F::one());
        if block.material.is_smooth() {
            let value = block.material.eval_lanes(at, sample.wo, at.wi, w);
            let smooth = value.value * (cos_out / (cos_in * sample.pdf));
            scattered = C::Columns::<F>::select(sample.delta, scattered, smooth);
            back = F::select(sample.delta, back, value.pdf);
            pdf = F::select(sample.delta, pdf, sample.pdf);
        }
        let throughput = block.throughput * scattered;
        let (lives, throughput) =
            (self.paths.limits).roulette(self.depth, throughput, F::one(), &numbers);
        let lives = lives & sample.drawn & at.active & F::zero().lt(cos_in);
        if !lives.any() {
            return;
        }
        let ratio = cos_out / pdf;
        let drawn = match self.depth {
            // Light is not drawn where there is no choice.
            0 => F::select(sample.delta, F::zero(), drawn * ratio),
            _ => drawn * back * ratio,
        };
        let others = [drawn.row(), (met * back * ratio).row()];
        let ways = Ways {
            lives,
            wo: sample.wo,
            throughput,
            eta: F::one(),
            pdf: sample.pdf,
            delta: sample.delta,
            light_share: 1.0,
        };
        out.send_changed(block, &ways, |lane, _, walker| {
            walker.media.others = [others[0][lane], others[1][lane]];
        });
    }
}
