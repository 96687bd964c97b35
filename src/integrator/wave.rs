//! The wave: paths of a batch that go a bounce further together. All their rays are traced; those that have met a surface
//! are shaded in blocks of one material, over lanes; then all their shadow rays are traced, and what they let through is
//! added by slot. What a bounce does with light is said by whoever implements [`Shading`].

use std::any::{Any, TypeId};
use std::cell::RefCell;
use std::collections::HashMap;

use super::arrival::{Arrival, Scattered, look_through_emitters};
use super::bounce::Decisions;
use super::cones::Cones;
use super::runs::Runs;
use super::{Cost, Estimate, Footprint, Start};
use crate::accel::Met;
use crate::color::{ColorModel, Spectra as _, Spectral};
use crate::interaction::{Hit, Points, Ray, ShadowRays};
use crate::lanes::{Lanes, MAX_LANES, Mask as _, Task, Vec3};
use crate::light::LightSamples;
use crate::material::Material;
use crate::sampler::{Sampler, Stream, Streams};
use crate::scene::Scene;

/// A path on its way, beside its ray; `M` is what it carries beside its light: through media, or of other ways to make it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walker<C: ColorModel, M = ()> {
    pub(super) throughput: C::Sample,
    pub(super) wavelengths: C::Wavelengths,
    pub(super) stream: Stream,
    /// Index of the start, and of the estimate.
    pub(super) slot: u32,
    /// Product of the indices of refraction passed.
    pub(super) eta: f32,
    /// Where the ray was scattered, unless at the camera or into a delta lobe.
    pub(super) scattered: Option<Scattered>,
    pub(super) media: M,
}

/// Things with a ray each.
#[derive(Debug)]
pub(super) struct WithRays<T> {
    pub(super) rays: Vec<Ray>,
    pub(super) things: Vec<T>,
}

impl<T> Default for WithRays<T> {
    fn default() -> Self {
        Self {
            rays: Vec::new(),
            things: Vec::new(),
        }
    }
}

impl<T> WithRays<T> {
    pub(super) fn push(&mut self, ray: Ray, thing: T) {
        self.rays.push(ray);
        self.things.push(thing);
    }

    pub(super) fn clear(&mut self) {
        self.rays.clear();
        self.things.clear();
    }

    /// Cleared, with room for so many.
    fn emptied(mut self, count: usize) -> Self {
        self.clear();
        self.rays.reserve(count);
        self.things.reserve(count);
        self
    }

    /// Keeps those of which `kept` says so.
    pub(super) fn keep(&mut self, kept: &[bool]) {
        keep(&mut self.rays, kept);
        keep(&mut self.things, kept);
    }
}

/// Keeps those items of which `kept` says so.
pub(super) fn keep<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    items.retain(|_| *kept.next().expect("there is an answer an item"));
}

/// What a bounce does with light.
pub(super) trait Shading<C: ColorModel, M = ()> {
    /// What is added to an estimate where a shadow ray meets nothing.
    type Shadow;

    /// Lights and scatters paths that have met one material. Must be `#[inline(always)]`.
    fn shade<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F, M>,
        out: &mut Outcome<'_, C, Self::Shadow, M>,
    );
}

/// Paths that have met one material.
pub(super) struct Block<'a, C: ColorModel, F: Lanes, M = ()> {
    pub(super) scene: &'a Scene<C>,
    pub(super) material: &'a Material<C>,
    /// What they have met.
    pub(super) at: Points<'a, F>,
    pub(super) throughput: C::Columns<F>,
    /// From the first lane on.
    pub(super) wavelengths: &'a [C::Wavelengths],
    sampler: &'a Sampler,
    streams: Streams<F>,
    /// The bounce's first dimension.
    first: u32,
    walkers: &'a WithRays<Walker<C, M>>,
    hits: &'a [Hit],
    /// Of the lanes, which walkers they are.
    indices: &'a [u32],
}

impl<C: ColorModel, F: Lanes, M> Block<'_, C, F, M> {
    /// The random numbers of the bounce's decision `number`.
    #[inline(always)]
    pub(super) fn decisions(&self, number: u32) -> Decisions<'_, F> {
        Decisions::new(self.sampler, self.streams, self.first, number)
    }

    /// A lane's path.
    #[inline(always)]
    pub(super) fn walker(&self, lane: usize) -> &Walker<C, M> {
        &self.walkers.things[self.indices[lane] as usize]
    }

    /// What a lane's path has met.
    #[inline(always)]
    pub(super) fn hit(&self, lane: usize) -> &Hit {
        &self.hits[self.indices[lane] as usize]
    }

    /// The products of the indices of refraction that the paths have passed.
    #[inline(always)]
    pub(super) fn eta(&self) -> F {
        let mut row = F::ROW;
        for lane in 0..self.indices.len() {
            row[lane] = self.walker(lane).eta;
        }
        F::load(&row)
    }

    /// A lane's ray from `origin`.
    #[inline(always)]
    fn ray(&self, lane: usize, origin: glam::Vec3, direction: glam::Vec3, t_max: f32) -> Ray {
        Ray {
            origin,
            direction,
            t_max,
            time: self.walkers.rays[self.indices[lane] as usize].time,
        }
    }
}

/// How paths are scattered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ways<F: Lanes, S> {
    /// The lanes that go on.
    pub(super) lives: F::Mask,
    /// In the shading frame.
    pub(super) wo: Vec3<F>,
    pub(super) throughput: S,
    pub(super) eta: F,
    /// Density per solid angle in 1/sr, times the share of samples that are drawn so.
    pub(super) pdf: F,
    /// Where light sampling would not find what is met.
    pub(super) delta: F::Mask,
    /// The share of samples that are drawn of lights.
    pub(super) light_share: f32,
}

/// What comes of a bounce.
#[derive(Debug)]
pub(super) struct Outcome<'a, C: ColorModel, T, M = ()> {
    pub(super) shadows: &'a mut WithRays<T>,
    pub(super) next: &'a mut WithRays<Walker<C, M>>,
    pub(super) cones: &'a mut Cones,
}

impl<C: ColorModel, T, M: Copy> Outcome<'_, C, T, M> {
    /// Asks in lanes that are `lit` whether light can be seen, and if so adds what `shadow` says of the lane.
    #[inline(always)]
    pub(super) fn ask<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F, M>,
        light: &LightSamples<F, C::Columns<F>>,
        lit: F::Mask,
        shadow: impl Fn(usize) -> T,
    ) {
        let rays = block
            .at
            .shadow(light.direction, light.target, light.distant);
        self.ask_along(block, &rays, lit, shadow);
    }

    /// The same of any shadow rays.
    #[inline(always)]
    pub(super) fn ask_along<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F, M>,
        rays: &ShadowRays<F>,
        lit: F::Mask,
        shadow: impl Fn(usize) -> T,
    ) {
        let (origins, directions) = (rays.origin.rows(), rays.direction.rows());
        let ends = rays.t_max.row();
        for lane in lit.lanes() {
            let origin = Vec3::<F>::of(&origins, lane);
            let direction = Vec3::<F>::of(&directions, lane);
            let ray = block.ray(lane, origin, direction, ends[lane]);
            self.shadows.push(ray, shadow(lane));
        }
    }

    /// Sends paths on their way.
    #[inline(always)]
    pub(super) fn send<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F, M>,
        ways: &Ways<F, C::Columns<F>>,
    ) {
        self.send_changed(block, ways, |_, _, _| ());
    }

    /// Sends paths on their way, after a last word on each lane's by whoever knows its direction.
    #[inline(always)]
    pub(super) fn send_changed<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F, M>,
        ways: &Ways<F, C::Columns<F>>,
        change: impl Fn(usize, glam::Vec3, &mut Walker<C, M>),
    ) {
        let at = &block.at;
        let direction = at.frame.to_world(ways.wo);
        let (origins, directions) = (at.origin(direction).rows(), direction.rows());
        let (places, throughputs) = (at.position.rows(), ways.throughput.rows());
        let (etas, pdfs) = (ways.eta.row(), ways.pdf.row());
        let delta = ways.delta.to_bits();
        for lane in ways.lives.lanes() {
            let scattered = (delta >> lane & 1 == 0).then(|| Scattered {
                from: Vec3::<F>::of(&places, lane),
                pdf: pdfs[lane],
                light_share: ways.light_share,
            });
            let origin = Vec3::<F>::of(&origins, lane);
            let direction = Vec3::<F>::of(&directions, lane);
            let ray = block.ray(lane, origin, direction, f32::INFINITY);
            let throughput = C::Columns::<F>::of(&throughputs, lane);
            let mut walker = Walker {
                throughput,
                wavelengths: C::narrowed(&block.walker(lane).wavelengths, &throughput),
                eta: etas[lane],
                scattered,
                ..*block.walker(lane)
            };
            change(lane, direction, &mut walker);
            if self.cones.are_told() {
                let pdf = scattered.map(|scattered| scattered.pdf);
                self.cones.scatter(walker.slot, block.hit(lane).t, pdf);
            }
            self.next.push(ray, walker);
        }
    }
}

/// Light that is added where a shadow ray meets nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contribution<S> {
    value: S,
    slot: u32,
}

impl<S: Spectral> Contribution<S> {
    pub(super) fn add_to(&self, estimates: &mut [Estimate<S>]) {
        estimates[self.slot as usize].radiance += self.value;
    }
}

impl<C: ColorModel, M: Copy> Outcome<'_, C, Contribution<C::Sample>, M> {
    /// Asks whether light that was drawn can be seen, where it would bring anything.
    #[inline(always)]
    pub(super) fn light<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F, M>,
        light: &LightSamples<F, C::Columns<F>>,
        value: C::Columns<F>,
    ) {
        let lit = block.at.active & F::zero().lt(light.pdf) & !value.is_black();
        if !lit.any() {
            return;
        }
        let values = value.rows();
        self.ask(block, light, lit, |lane| Contribution {
            value: C::Columns::<F>::of(&values, lane),
            slot: block.walker(lane).slot,
        });
    }
}

/// Shadow rays that are asked about at once: a scene may have any number of lights.
const SHADOWS: usize = 1 << 14;

/// Paths of a batch, and what they have met; `T` is what belongs to a shadow ray.
#[derive(Debug)]
pub(super) struct Wave<'a, C: ColorModel, T: 'static, M: 'static = ()> {
    scene: &'a Scene<C>,
    sampler: &'a Sampler,
    walkers: WithRays<Walker<C, M>>,
    hits: Vec<Hit>,
    next: WithRays<Walker<C, M>>,
    shadows: WithRays<T>,
    cones: Cones,
    blocked: Vec<bool>,
    /// Those that have met a surface, by material.
    runs: Runs,
}

/// The room that a wave took.
type Room<C, T, M> = (
    WithRays<Walker<C, M>>,
    WithRays<Walker<C, M>>,
    WithRays<T>,
    Vec<Hit>,
);

thread_local! {
    /// The room of waves that are over, by its kind, for the next of its thread. Given back and asked for again with each
    /// batch it would be the system's in between, which took a tenth of the time of a render.
    static ROOMS: RefCell<HashMap<TypeId, Box<dyn Any>>> = RefCell::default();
}

/// Room for so many paths.
fn room<C: ColorModel, T: 'static, M: 'static>(count: usize) -> Room<C, T, M> {
    let kept = ROOMS.with_borrow_mut(|rooms| rooms.remove(&TypeId::of::<Room<C, T, M>>()));
    let kept = kept.and_then(|room| room.downcast::<Room<C, T, M>>().ok());
    let (walkers, next, shadows, mut hits) = *kept.unwrap_or_default();
    hits.clear();
    let [walkers, next] = [walkers, next].map(|room| room.emptied(count));
    (walkers, next, shadows.emptied(count), hits)
}

impl<C: ColorModel, T: 'static, M: 'static> Drop for Wave<'_, C, T, M> {
    fn drop(&mut self) {
        let room: Room<C, T, M> = (
            std::mem::take(&mut self.walkers),
            std::mem::take(&mut self.next),
            std::mem::take(&mut self.shadows),
            std::mem::take(&mut self.hits),
        );
        ROOMS.with_borrow_mut(|rooms| rooms.insert(TypeId::of::<Room<C, T, M>>(), Box::new(room)));
    }
}

impl<'a, C: ColorModel, T: 'static> Wave<'a, C, T> {
    /// At the camera.
    pub(super) fn new(scene: &'a Scene<C>, sampler: &'a Sampler, starts: &[Start<C>]) -> Self {
        Self::carrying(scene, sampler, starts, |_, _| ())
    }
}

impl<'a, C: ColorModel, T: 'static, M: Copy + 'static> Wave<'a, C, T, M> {
    /// At their starts, with what each carries beside its light, by slot.
    pub(super) fn carrying(
        scene: &'a Scene<C>,
        sampler: &'a Sampler,
        starts: &[Start<C>],
        media: impl Fn(usize, &Start<C>) -> M,
    ) -> Self {
        let (mut walkers, next, shadows, hits) = room(starts.len());
        for (slot, start) in (0..).zip(starts) {
            let walker = Walker {
                throughput: scene.color().unit(),
                wavelengths: start.wavelengths,
                stream: start.stream,
                slot,
                eta: 1.0,
                scattered: None,
                media: media(slot as usize, start),
            };
            walkers.push(start.ray, walker);
        }
        Self {
            scene,
            sampler,
            walkers,
            hits,
            next,
            shadows,
            cones: Cones::default(),
            blocked: Vec::new(),
            runs: Runs::new(scene.material_count()),
        }
    }

    /// The same, whose paths, which are at their starts, have cones by the camera's footprint where the scene has
    /// textures that ask for them.
    pub(super) fn with_cones(mut self, footprint: Option<&Footprint>) -> Self {
        if let Some(footprint) = footprint.filter(|_| self.scene.has_mipmaps()) {
            self.cones = Cones::of(footprint, &self.walkers.rays);
        }
        self
    }

    /// Whether no path is on its way.
    pub(super) fn is_over(&self) -> bool {
        self.walkers.things.is_empty()
    }

    /// Traces rays that have bounced `depth` times; those of the camera go on to what lies behind emitters where these are
    /// hidden.
    pub(super) fn trace(&mut self, depth: u32, hide_emitters: bool, cost: &mut Cost) {
        self.trace_looking(depth, depth == 0 && hide_emitters, |_| true, cost);
    }

    /// Traces rays that have bounced `depth` times; where `looks` says so some of them go on to what lies behind emitters.
    pub(super) fn trace_looking(
        &mut self,
        depth: u32,
        hide_emitters: bool,
        looks: impl Fn(&M) -> bool,
        cost: &mut Cost,
    ) {
        self.next.clear();
        let WithRays { rays, things } = &mut self.walkers;
        cost.closest(self.scene, depth, rays, &mut self.hits);
        if hide_emitters {
            let looks = |i: usize| looks(&things[i].media);
            look_through_emitters(self.scene, rays, &mut self.hits, looks, cost);
        }
    }

    /// What is done with paths before they come to what they have met: they are given with their rays, their hits and
    /// what a bounce adds to. Those of which `goes_on` does not say so in the end go no further.
    pub(super) fn before(
        &mut self,
        goes_on: &mut Vec<bool>,
        act: impl FnOnce(&mut WithRays<Walker<C, M>>, &[Hit], Outcome<'_, C, T, M>, &mut [bool]),
    ) {
        goes_on.clear();
        goes_on.resize(self.walkers.things.len(), true);
        let out = Outcome {
            shadows: &mut self.shadows,
            next: &mut self.next,
            cones: &mut self.cones,
        };
        act(&mut self.walkers, &self.hits, out, goes_on);
        self.walkers.keep(goes_on);
        keep(&mut self.hits, goes_on);
    }

    /// The slots of paths, and whether each has met a surface.
    pub(super) fn met(&self) -> impl Iterator<Item = (usize, bool)> {
        let both = self.walkers.things.iter().zip(&self.hits);
        both.map(|(walker, hit)| (walker.slot as usize, !hit.is_miss()))
    }

    /// Tells of each ray's end that may bring light, and of its path's slot.
    pub(super) fn arrive(&self, mut take: impl FnMut(&Walker<C, M>, Arrival<'_, '_, C>)) {
        let scene = self.scene;
        let walkers = self.walkers.things.iter().zip(&self.walkers.rays);
        for ((walker, ray), hit) in walkers.zip(&self.hits) {
            let brings_light = if hit.is_miss() {
                scene.has_environment()
            } else {
                scene.gives_light(hit) || scene.has_ambient()
            };
            if !brings_light {
                continue;
            }
            let at = (!hit.is_miss()).then(|| {
                let at = scene.interaction(ray, hit);
                self.cones.seen(walker.slot, at)
            });
            let arrival = Arrival {
                scene,
                ray,
                at: at.as_ref(),
                wavelengths: &walker.wavelengths,
                throughput: walker.throughput,
                scattered: walker.scattered,
                hides_surroundings: false,
            };
            take(walker, arrival);
        }
    }

    /// Shades what was met, with random numbers from dimension `first` on and up to `shadows` shadow rays a path. Tells
    /// `shading` of those rays that nothing stands in the way of. The paths that were sent on are those that are next.
    pub(super) fn shade<S: Shading<C, M, Shadow = T>>(
        &mut self,
        first: u32,
        shadows: u32,
        shading: &mut S,
        mut light: impl FnMut(&mut S, &T),
        cost: &mut Cost,
    ) {
        let (scene, mut blocked) = (self.scene, std::mem::take(&mut self.blocked));
        let settle = |shading: &mut S, shadows: &mut WithRays<T>, cost: &mut Cost| {
            cost.occluded(scene, &shadows.rays, &mut blocked);
            for (shadow, blocked) in shadows.things.iter().zip(&blocked) {
                if !blocked {
                    light(shading, shadow);
                }
            }
        };
        self.shade_and(first, shadows, shading, settle, cost);
        self.blocked = blocked;
    }

    /// The same; what becomes of shadow rays is for `settle` to say.
    pub(super) fn shade_and<S: Shading<C, M, Shadow = T>>(
        &mut self,
        first: u32,
        shadows: u32,
        shading: &mut S,
        mut settle: impl FnMut(&mut S, &mut WithRays<T>, &mut Cost),
        cost: &mut Cost,
    ) {
        let scene = self.scene;
        self.runs.sort(self.hits.iter().map(|hit| {
            let met = !hit.is_miss();
            met.then(|| scene.material_of(hit).index())
        }));
        let count = self.runs.count();
        cost.stats.shaded += count as u64;
        let part = (SHADOWS / shadows.max(1) as usize).next_multiple_of(MAX_LANES);
        let mut done = 0;
        while done < count {
            let end = count.min(done.saturating_add(part));
            let blocks = Blocks {
                scene,
                sampler: self.sampler,
                first,
                walkers: &self.walkers,
                hits: &self.hits,
                runs: self.runs.part(done..end),
                shading: &mut *shading,
                out: Outcome {
                    shadows: &mut self.shadows,
                    next: &mut self.next,
                    cones: &mut self.cones,
                },
            };
            scene.tracer().kernel().run(blocks);
            settle(shading, &mut self.shadows, cost);
            self.shadows.clear();
            done = end;
        }
        std::mem::swap(&mut self.walkers, &mut self.next);
        self.cones.advance();
    }
}

/// Runs of paths that are to be shaded.
struct Blocks<'a, C: ColorModel, M, S: Shading<C, M>, R> {
    scene: &'a Scene<C>,
    sampler: &'a Sampler,
    first: u32,
    walkers: &'a WithRays<Walker<C, M>>,
    hits: &'a [Hit],
    runs: R,
    shading: &'a mut S,
    out: Outcome<'a, C, S::Shadow, M>,
}

impl<'a, C: ColorModel, M: Copy, S: Shading<C, M>, R: Iterator<Item = (usize, &'a [u32])>> Task
    for Blocks<'a, C, M, S, R>
{
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(mut self) {
        let Some(some) = self.walkers.things.first() else {
            return;
        };
        let mut wavelengths = [some.wavelengths; MAX_LANES];
        let mut streams = [some.stream; MAX_LANES];
        for (material, run) in self.runs {
            for indices in run.chunks(F::WIDTH) {
                for (lane, index) in indices.iter().enumerate() {
                    let walker = &self.walkers.things[*index as usize];
                    (wavelengths[lane], streams[lane]) = (walker.wavelengths, walker.stream);
                }
                let met = Met {
                    tracer: self.scene.tracer(),
                    rays: &self.walkers.rays,
                    hits: self.hits,
                    indices,
                };
                let walkers = &self.walkers.things;
                let mut at = met.points::<F>();
                if self.out.cones.are_told() {
                    let mut widths = F::ROW;
                    for (lane, index) in indices.iter().enumerate() {
                        let slot = walkers[*index as usize].slot;
                        widths[lane] = self.out.cones.width(slot, met.hit(lane).t);
                    }
                    at.footprint = at.within(F::load(&widths));
                }
                let block = Block {
                    scene: self.scene,
                    material: self.scene.material_at(material),
                    at,
                    throughput: C::Columns::<F>::from_samples(|lane| match indices.get(lane) {
                        Some(index) => walkers[*index as usize].throughput,
                        None => C::Sample::zero(),
                    }),
                    wavelengths: &wavelengths,
                    sampler: self.sampler,
                    streams: Streams::of(&streams[..indices.len()]),
                    first: self.first,
                    walkers: self.walkers,
                    hits: self.hits,
                    indices,
                };
                self.shading.shade(&block, &mut self.out);
            }
        }
    }
}
