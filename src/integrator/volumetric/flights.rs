//! How far paths get in their media, and what they do where they are scattered there: light is asked for, and the phase
//! function turns them.

use super::{Carried, FLIGHT, FLIGHT_DRAWS, LIGHT, Mean, Path, Segment, WAY, over, way};
use crate::color::{ColorModel, Spectra, Spectral as _};
use crate::integrator::Estimate;
use crate::integrator::arrival::Scattered;
use crate::integrator::bounce::Decisions;
use crate::integrator::limits::Limits;
use crate::integrator::runs::Runs;
use crate::integrator::wave::{Outcome, WithRays};
use crate::interaction::{Hit, Interaction, Points, Ray, Source};
use crate::lanes::{Frame, Lanes, MAX_LANES, Mask as _, Task, Vec2, Vec3};
use crate::mesh::Mesh;
use crate::sampler::{Sampler, Streams};
use crate::scene::Scene;

/// Paths that are on their way to what they will meet.
pub(super) struct Round<'a, C: ColorModel> {
    pub(super) scene: &'a Scene<C>,
    pub(super) sampler: &'a Sampler,
    pub(super) limits: &'a Limits,
    pub(super) mean: Mean,
    /// The round's first dimension.
    pub(super) first: u32,
    pub(super) paths: &'a mut WithRays<Path<C>>,
    pub(super) hits: &'a [Hit],
    pub(super) out: Outcome<'a, C, Segment<C>, Carried<C::Sample>>,
    /// Of each path, whether it does.
    pub(super) gets_there: &'a mut [bool],
    pub(super) estimates: &'a mut [Estimate<C::Sample>],
}

/// Paths in media, sorted by these.
struct Flights<'a, C: ColorModel> {
    round: Round<'a, C>,
    runs: &'a Runs,
}

impl<C: ColorModel> Task for Flights<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        let Self { mut round, runs } = self;
        for (medium, run) in runs.part(0..runs.count()) {
            for indices in run.chunks(F::WIDTH) {
                round.block::<F>(medium, indices);
            }
        }
    }
}

/// Where paths are scattered in a medium.
struct Inside<'a> {
    rays: &'a [Ray],
    indices: &'a [u32],
    distances: [f32; MAX_LANES],
}

impl Inside<'_> {
    fn ray(&self, lane: usize) -> &Ray {
        &self.rays[self.indices[lane] as usize]
    }
}

impl Source for Inside<'_> {
    fn interaction(&self, lane: usize) -> Interaction<'_> {
        let ray = self.ray(lane);
        Interaction {
            position: ray.at(self.distances[lane]),
            time: ray.time,
            ..Interaction::at_uv(glam::Vec2::ZERO)
        }
    }

    fn time(&self, lane: usize) -> f32 {
        self.ray(lane).time
    }

    fn on_mesh(&self, _lane: usize) -> Option<(&Mesh, u32, glam::Vec2)> {
        None
    }
}

impl<C: ColorModel> Round<'_, C> {
    /// Lets paths that are in media fly.
    pub(super) fn fly(self, runs: &mut Runs) {
        let media = self.paths.things.iter().map(|path| path.media.medium);
        runs.sort(media.map(|medium| medium.map(|medium| medium.index())));
        let kernel = self.scene.tracer().kernel();
        kernel.run(Flights { round: self, runs });
    }

    /// Paths in one medium.
    #[inline(always)]
    fn block<F: Lanes>(&mut self, medium: usize, indices: &[u32]) {
        let medium = self.scene.medium_at(medium);
        let some = &self.paths.things[indices[0] as usize];
        let mut wavelengths = [some.wavelengths; MAX_LANES];
        let mut streams = [some.stream; MAX_LANES];
        for (lane, index) in indices.iter().enumerate() {
            let path = &self.paths.things[*index as usize];
            (wavelengths[lane], streams[lane]) = (path.wavelengths, path.stream);
        }
        let streams = Streams::of(&streams[..indices.len()]);
        let hero = |index: usize| self.paths.things[index].media.hero;
        let way = way::<C, F>(&self.paths.rays, self.hits, indices, hero, &wavelengths);
        let numbers = Decisions::new(self.sampler, streams, self.first, FLIGHT);
        let draws = streams.draws(self.first + FLIGHT_DRAWS);
        let flight = medium.fly(&way, numbers.u1(), draws);
        let (throughputs, densities) = (flight.throughput.rows(), flight.density.rows());
        let (asked, distances) = (flight.asked.row(), flight.distance.row());
        if medium.emits() {
            let emitted = flight.emitted.rows();
            for lane in flight.scattered.lanes() {
                let path = &self.paths.things[indices[lane] as usize];
                let emitted: C::Sample = C::Columns::<F>::of(&emitted, lane);
                let density =
                    path.media.density * C::Columns::<F>::of::<C::Sample>(&densities, lane);
                let light = over(path.throughput * emitted, self.mean.one(density));
                self.estimates[path.slot as usize].radiance += light;
            }
        }
        for (lane, index) in indices.iter().enumerate() {
            let path = &mut self.paths.things[*index as usize];
            path.throughput *= C::Columns::<F>::of::<C::Sample>(&throughputs, lane);
            path.media.density *= C::Columns::<F>::of::<C::Sample>(&densities, lane);
            path.media.asked = path.media.asked * asked[lane];
        }
        let (mut ended, mut plays) = (0_u32, 0_u32);
        for lane in flight.scattered.lanes() {
            let index = indices[lane] as usize;
            let path = &mut self.paths.things[index];
            self.gets_there[index] = false;
            self.estimates[path.slot as usize].alpha = 1.0;
            plays |= u32::from(self.limits.plays(path.media.depth)) << lane;
            path.media.depth += 1;
            ended |= u32::from(path.media.depth >= self.limits.max_depth) << lane;
        }
        let goes_on = flight.scattered & !F::Mask::from_bits(ended);
        if !goes_on.any() {
            return;
        }
        let mut inside = Inside {
            rays: &self.paths.rays,
            indices,
            distances: [0.0; MAX_LANES],
        };
        for lane in 0..indices.len() {
            inside.distances[lane] = distances[lane];
        }
        let zero = Vec3::splat(0.0);
        let wi = -way.direction;
        let frame = Frame::around(wi);
        let at = Points {
            active: goes_on,
            position: way.origin + way.direction * flight.distance,
            error: zero,
            normal: zero,
            frame,
            uv: Vec2::splat(0.0),
            dp_du: frame.s,
            dp_dv: frame.t,
            footprint: [Vec2::splat(0.0); 2],
            wi: Vec3::all(glam::Vec3::Z),
            source: &inside,
        };
        let throughput = C::Columns::<F>::from_samples(|lane| match indices.get(lane) {
            Some(index) => self.paths.things[*index as usize].throughput,
            None => C::Sample::zero(),
        });
        if medium.samples_emitters() {
            let numbers = Decisions::new(self.sampler, streams, self.first, LIGHT);
            let light = self
                .scene
                .sample_lights(&at, numbers.u1(), numbers.u2(), &wavelengths);
            let value = medium.phase().eval_lanes(at.position, wi, light.direction);
            let contribution = throughput * light.radiance * value;
            let lit = goes_on & F::zero().lt(light.pdf) & !contribution.is_black();
            if lit.any() {
                let rays = at.shadow(light.direction, light.target, light.distant);
                let (origins, directions) = (rays.origin.rows(), rays.direction.rows());
                let (ends, values) = (rays.t_max.row(), contribution.rows());
                let (light_pdfs, pdfs) = (light.pdf.row(), value.row());
                let delta = light.delta.to_bits();
                for lane in lit.lanes() {
                    let index = indices[lane] as usize;
                    let ray = Ray {
                        origin: Vec3::<F>::of(&origins, lane),
                        direction: Vec3::<F>::of(&directions, lane),
                        t_max: ends[lane],
                        time: self.paths.rays[index].time,
                    };
                    let segment = Segment {
                        value: C::Columns::<F>::of(&values, lane),
                        light_pdf: light_pdfs[lane],
                        other_pdf: match delta >> lane & 1 {
                            0 => pdfs[lane],
                            _ => 0.0,
                        },
                        ..Segment::of(&self.paths.things[index])
                    };
                    self.out.shadows.push(ray, segment);
                }
            }
        }
        let numbers = Decisions::new(self.sampler, streams, self.first, WAY);
        let sample = (medium.phase()).sample_lanes(at.position, wi, numbers.u1(), numbers.u2());
        let densities = C::Columns::<F>::from_samples(|lane| match indices.get(lane) {
            Some(index) => self.paths.things[*index as usize].media.density,
            None => C::Sample::zero(),
        });
        let plays = F::Mask::from_bits(plays);
        let lives = goes_on & F::zero().lt(sample.pdf) & !throughput.is_black();
        let (survives, throughput) =
            self.mean
                .roulette(plays, throughput, densities, F::one(), &numbers);
        let lives = lives & survives;
        let throughputs = throughput.rows();
        let (places, directions) = (at.position.rows(), sample.wo.rows());
        let pdfs = sample.pdf.row();
        for lane in lives.lanes() {
            let index = indices[lane] as usize;
            let before = &self.paths.things[index];
            let place = Vec3::<F>::of(&places, lane);
            let ray = Ray {
                origin: place,
                direction: Vec3::<F>::of(&directions, lane),
                t_max: f32::INFINITY,
                time: self.paths.rays[index].time,
            };
            let path = Path::<C> {
                throughput: C::Columns::<F>::of(&throughputs, lane),
                scattered: medium.samples_emitters().then(|| Scattered {
                    from: place,
                    pdf: pdfs[lane],
                    light_share: 1.0,
                }),
                media: Carried {
                    asked: over(before.media.density, pdfs[lane]),
                    ..before.media
                },
                ..*before
            };
            (self.out.cones).scatter(path.slot, distances[lane], Some(pdfs[lane]));
            self.out.next.push(ray, path);
        }
    }
}
