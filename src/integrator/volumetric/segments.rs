//! Light on its way to where it was asked for: along a shadow ray through media and through surfaces that let it pass,
//! until it is there or something stands in the way.

use super::{Mean, Path, SEGMENT_DRAWS, over, way};
use crate::accel::Met;
use crate::color::{ColorModel, Spectra, Spectral};
use crate::integrator::runs::Runs;
use crate::integrator::wave::{WithRays, keep};
use crate::integrator::{Cost, Estimate};
use crate::interaction::{Hit, Ray};
use crate::lanes::{Lanes, MAX_LANES, Task, Vec3};
use crate::sampler::{Stream, Streams};
use crate::scene::{MediumId, Scene};

/// Light that was asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment<C: ColorModel> {
    /// What it brings where nothing stands in the way, over the hero's density of the path alone.
    pub(super) value: C::Sample,
    /// The density of having drawn it, in 1/sr.
    pub(super) light_pdf: f32,
    /// That of having gone there by the BSDF or the phase function; 0 where nobody would have.
    pub(super) other_pdf: f32,
    /// The path's densities where light was asked for.
    pub(super) density: C::Sample,
    /// Each channel's density of having come by the other way as far as this, over that of having asked.
    pub(super) passed: C::Sample,
    pub(super) medium: Option<MediumId>,
    pub(super) hero: u32,
    pub(super) slot: u32,
    pub(super) stream: Stream,
    pub(super) wavelengths: C::Wavelengths,
}

impl<C: ColorModel> Segment<C> {
    /// That of a path, in the medium where it is.
    #[inline(always)]
    pub(super) fn of(path: &Path<C>) -> Self {
        Self {
            value: C::Sample::zero(),
            light_pdf: 0.0,
            other_pdf: 0.0,
            density: path.media.density,
            passed: C::Sample::splat(1.0),
            medium: path.media.medium,
            hero: path.media.hero,
            slot: path.slot,
            stream: path.stream,
            wavelengths: path.wavelengths,
        }
    }

    /// Adds what came through.
    fn arrive(&self, mean: Mean, estimates: &mut [Estimate<C::Sample>]) {
        let asked = self.density * self.light_pdf;
        let other = self.density * self.passed * self.other_pdf;
        let value = over(self.value, mean.one(asked + other));
        estimates[self.slot as usize].radiance += value;
    }
}

/// Follows light.
pub(super) struct Segments<'a, C: ColorModel> {
    scene: &'a Scene<C>,
    hits: Vec<Hit>,
    blocked: Vec<bool>,
    /// Which segments go on.
    kept: Vec<bool>,
    media: Runs,
    materials: Runs,
}

impl<'a, C: ColorModel> Segments<'a, C> {
    pub(super) fn new(scene: &'a Scene<C>) -> Self {
        Self {
            scene,
            hits: Vec::new(),
            blocked: Vec::new(),
            kept: Vec::new(),
            media: Runs::new(scene.medium_count()),
            materials: Runs::new(scene.material_count()),
        }
    }

    /// Adds what comes through of light that was asked for in the round of first dimension `first`.
    pub(super) fn settle(
        &mut self,
        first: u32,
        asked: &mut WithRays<Segment<C>>,
        mean: Mean,
        estimates: &mut [Estimate<C::Sample>],
        cost: &mut Cost,
    ) {
        let scene = self.scene;
        for part in 0.. {
            if asked.things.is_empty() {
                return;
            }
            self.hits.clear();
            self.kept.clear();
            if scene.has_passages() {
                cost.segments(scene, &asked.rays, &mut self.hits);
                let open = |hit: &Hit| hit.is_miss() || scene.passes(hit);
                self.kept.extend(self.hits.iter().map(open));
                keep(&mut self.hits, &self.kept);
                asked.keep(&self.kept);
            } else {
                cost.occluded(scene, &asked.rays, &mut self.blocked);
                self.kept
                    .extend(self.blocked.iter().map(|blocked| !blocked));
                asked.keep(&self.kept);
                let through = asked.rays.iter().map(|ray| Hit::miss(ray.t_max));
                self.hits.extend(through);
            }
            let media = asked.things.iter().map(|segment| segment.medium);
            self.media
                .sort(media.map(|medium| medium.map(|medium| medium.index())));
            if self.media.count() > 0 {
                let thin = Thin {
                    scene,
                    runs: &self.media,
                    hits: &self.hits,
                    asked,
                    dimension: first + SEGMENT_DRAWS,
                    part,
                };
                scene.tracer().kernel().run(thin);
            }
            self.materials.sort(self.hits.iter().map(|hit| {
                let met = !hit.is_miss();
                met.then(|| scene.material_of(hit).index())
            }));
            for (segment, hit) in asked.things.iter().zip(&self.hits) {
                if hit.is_miss() {
                    segment.arrive(mean, estimates);
                }
            }
            if self.materials.count() == 0 {
                return;
            }
            let pass = Pass {
                scene,
                runs: &self.materials,
                hits: &self.hits,
                asked,
            };
            scene.tracer().kernel().run(pass);
            let both = asked.things.iter().zip(&self.hits);
            let goes_on = both.map(|(segment, hit)| !hit.is_miss() && !segment.value.is_black());
            self.kept.clear();
            self.kept.extend(goes_on);
            asked.keep(&self.kept);
        }
    }
}

/// Multiplies by what media let through on the way to what is met.
struct Thin<'a, C: ColorModel> {
    scene: &'a Scene<C>,
    runs: &'a Runs,
    hits: &'a [Hit],
    asked: &'a mut WithRays<Segment<C>>,
    dimension: u32,
    /// How many surfaces were passed.
    part: u32,
}

impl<C: ColorModel> Task for Thin<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        let WithRays { rays, things } = self.asked;
        let Some(some) = things.first() else {
            return;
        };
        let (mut wavelengths, mut streams) =
            ([some.wavelengths; MAX_LANES], [some.stream; MAX_LANES]);
        for (medium, run) in self.runs.part(0..self.runs.count()) {
            for indices in run.chunks(F::WIDTH) {
                for (lane, index) in indices.iter().enumerate() {
                    let segment = &things[*index as usize];
                    (wavelengths[lane], streams[lane]) = (segment.wavelengths, segment.stream);
                }
                let hero = |index: usize| things[index].hero;
                let way = way::<C, F>(rays, self.hits, indices, hero, &wavelengths);
                let streams = Streams::<F>::of(&streams[..indices.len()]);
                let draws = streams.draws(self.dimension).part(self.part);
                let through = self.scene.medium_at(medium).transmit(&way, draws);
                let rows = through.rows();
                for (lane, index) in indices.iter().enumerate() {
                    let through: C::Sample = C::Columns::<F>::of(&rows, lane);
                    let segment = &mut things[*index as usize];
                    segment.value *= through;
                    segment.passed *= through;
                }
            }
        }
    }
}

/// Multiplies by what surfaces let pass, and takes rays on behind them.
struct Pass<'a, C: ColorModel> {
    scene: &'a Scene<C>,
    runs: &'a Runs,
    hits: &'a [Hit],
    asked: &'a mut WithRays<Segment<C>>,
}

impl<C: ColorModel> Task for Pass<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        let WithRays { rays, things } = self.asked;
        let Some(some) = things.first() else {
            return;
        };
        let mut wavelengths = [some.wavelengths; MAX_LANES];
        for (material, run) in self.runs.part(0..self.runs.count()) {
            for indices in run.chunks(F::WIDTH) {
                for (lane, index) in indices.iter().enumerate() {
                    wavelengths[lane] = things[*index as usize].wavelengths;
                }
                let met = Met {
                    tracer: self.scene.tracer(),
                    rays,
                    hits: self.hits,
                    indices,
                };
                let at = met.points::<F>();
                let material = self.scene.material_at(material);
                let through = material.passing_lanes(&at, at.wi, &wavelengths);
                let (values, probabilities) = (through.value.rows(), through.pdf.row());
                let origins = at.origin(met.directions()).rows();
                let normals = at.normal.rows();
                for (lane, index) in indices.iter().enumerate() {
                    let index = *index as usize;
                    let (segment, hit) = (&mut things[index], &self.hits[index]);
                    segment.value *= C::Columns::<F>::of::<C::Sample>(&values, lane);
                    segment.passed = segment.passed * probabilities[lane];
                    let ray = &mut rays[index];
                    if let Some(boundary) = self.scene.boundary(hit) {
                        let normal = Vec3::<F>::of(&normals, lane);
                        segment.medium = boundary.beyond(normal, ray.direction);
                    }
                    *ray = Ray {
                        origin: Vec3::<F>::of(&origins, lane),
                        t_max: ray.t_max - hit.t,
                        ..*ray
                    };
                }
            }
        }
    }
}
