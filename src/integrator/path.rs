//! `path`: unidirectional path tracing (Kajiya, *The rendering equation*, 1986) with one light sample a
//! bounce, multiple importance sampling and Russian roulette.
//!
//! `max_depth`, `rr_depth` and `hide_emitters`: see [`super::limits`].

use super::arrival::{Arrival, Scattered, look_through_emitters, opacity_at_start};
use super::bounce::{Bounces, Decisions};
use super::limits::{self, Limits};
use super::mis::power;
use super::runs::Runs;
use super::{Context, Cost, Estimate, Estimates, Estimator, Start};
use crate::accel::Met;
use crate::color::{ColorModel, Spectra as _, Spectral as _};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::{Hit, Points, Ray};
use crate::lanes::{Lanes, MAX_LANES, Mask as _, Task, Vec3};
use crate::material::Material;
use crate::sampler::{Sampler, Stream};
use crate::scene::Scene;

/// The path tracer's settings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Path {
    limits: Limits,
    hide_emitters: bool,
}

/// A bounce decides on a light and on the way on.
const BOUNCES: Bounces = Bounces { decisions: 2 };
/// The first decision.
const LIGHT: u32 = 0;
/// The second.
const WAY: u32 = 1;

/// A path on its way, beside its ray.
#[derive(Clone, Copy, Debug)]
struct Walker<C: ColorModel> {
    throughput: C::Sample,
    wavelengths: C::Wavelengths,
    stream: Stream,
    /// Index of the start, and of the estimate.
    slot: u32,
    /// Product of the indices of refraction passed.
    eta: f32,
    /// Where the ray was scattered, unless at the camera or into a delta lobe.
    scattered: Option<Scattered>,
}

/// A light sample whose visibility is still to be asked, beside its ray.
#[derive(Clone, Copy, Debug)]
struct Shadow<S> {
    contribution: S,
    slot: u32,
}

/// Things with a ray each.
#[derive(Debug)]
struct WithRays<T> {
    rays: Vec<Ray>,
    things: Vec<T>,
}

impl<T> WithRays<T> {
    fn with_capacity(count: usize) -> Self {
        Self {
            rays: Vec::with_capacity(count),
            things: Vec::with_capacity(count),
        }
    }

    fn push(&mut self, ray: Ray, thing: T) {
        self.rays.push(ray);
        self.things.push(thing);
    }

    fn clear(&mut self) {
        self.rays.clear();
        self.things.clear();
    }
}

impl Path {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "paths: emission, light samples and material samples",
        properties: &[limits::COMMON, limits::LIMITS],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &Context) -> Result<Self> {
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?,
        })
    }

    /// Adds what the rays' ends bring.
    fn arrive<C: ColorModel>(
        &self,
        scene: &Scene<C>,
        walkers: &WithRays<Walker<C>>,
        hits: &[Hit],
        estimates: &mut [Estimate<C::Sample>],
    ) {
        for ((walker, ray), hit) in walkers.things.iter().zip(&walkers.rays).zip(hits) {
            let brings_light = if hit.is_miss() {
                scene.has_environment()
            } else {
                scene.gives_light(hit) || scene.has_ambient()
            };
            if !brings_light {
                continue;
            }
            let estimate = &mut estimates[walker.slot as usize];
            let at = (!hit.is_miss()).then(|| scene.interaction(ray, hit));
            let arrival = Arrival {
                scene,
                ray,
                at: at.as_ref(),
                wavelengths: &walker.wavelengths,
                throughput: walker.throughput,
                scattered: walker.scattered,
                hides_surroundings: self.hide_emitters && estimate.alpha == 0.0,
            };
            arrival.add_to(estimate);
        }
    }
}

impl<C: ColorModel> Estimator<C> for Path {
    fn estimate(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        let estimates = &mut estimates.values;
        estimates.clear();
        let alpha = match self.limits.max_depth {
            0 => 0.0,
            _ => opacity_at_start(scene, self.hide_emitters),
        };
        let radiance = C::Sample::zero();
        estimates.resize(starts.len(), Estimate { radiance, alpha });
        if self.limits.max_depth == 0 {
            return;
        }
        let room = starts.len();
        let mut walkers = WithRays::with_capacity(room);
        let mut next = WithRays::with_capacity(room);
        for (slot, start) in (0..).zip(starts) {
            let walker = Walker {
                throughput: scene.color().unit(),
                wavelengths: start.wavelengths,
                stream: start.stream,
                slot,
                eta: 1.0,
                scattered: None,
            };
            walkers.push(start.ray, walker);
        }
        let (mut hits, mut blocked) = (Vec::new(), Vec::new());
        let mut shadows = WithRays::with_capacity(room);
        let mut runs = Runs::new(scene.material_count());
        for depth in 0.. {
            if walkers.things.is_empty() {
                break;
            }
            cost.closest(scene, depth, &walkers.rays, &mut hits);
            if depth == 0 && self.hide_emitters {
                look_through_emitters(scene, &mut walkers.rays, &mut hits, cost);
            }
            self.arrive(scene, &walkers, &hits, estimates);
            let Some(first) = BOUNCES.first(depth) else {
                break;
            };
            if depth + 1 >= self.limits.max_depth {
                break;
            }
            runs.sort(hits.iter().map(|hit| {
                let met = !hit.is_miss();
                met.then(|| scene.material_of(hit).index())
            }));
            cost.stats.shaded += runs.count() as u64;
            next.clear();
            let scatter = Scatter {
                limits: &self.limits,
                scene,
                sampler,
                depth,
                first,
                walkers: &walkers,
                hits: &hits,
                runs: &runs,
                estimates,
                shadows: &mut shadows,
                next: &mut next,
            };
            C::run(scene.tracer().kernel(), scatter);
            cost.occluded(scene, &shadows.rays, &mut blocked);
            for (shadow, blocked) in shadows.things.iter().zip(&blocked) {
                if !blocked {
                    estimates[shadow.slot as usize].radiance += shadow.contribution;
                }
            }
            shadows.clear();
            std::mem::swap(&mut walkers, &mut next);
        }
    }
}

/// A bounce: paths that have met surfaces are lit and scattered.
struct Scatter<'a, C: ColorModel> {
    limits: &'a Limits,
    scene: &'a Scene<C>,
    sampler: &'a Sampler,
    depth: u32,
    /// The bounce's first dimension.
    first: u32,
    walkers: &'a WithRays<Walker<C>>,
    hits: &'a [Hit],
    /// By material.
    runs: &'a Runs,
    estimates: &'a mut [Estimate<C::Sample>],
    shadows: &'a mut WithRays<Shadow<C::Sample>>,
    next: &'a mut WithRays<Walker<C>>,
}

/// Paths that have met one material.
struct Block<'a, C: ColorModel> {
    material: &'a Material<C>,
    /// Which walkers.
    indices: &'a [u32],
    wavelengths: &'a [C::Wavelengths],
    streams: &'a [Stream],
}

impl<C: ColorModel> Task for Scatter<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(mut self) {
        let Some(some) = self.walkers.things.first() else {
            return;
        };
        let mut wavelengths = [some.wavelengths; MAX_LANES];
        let mut streams = [some.stream; MAX_LANES];
        for (material, run) in self.runs.iter() {
            let material = self.scene.material_at(material);
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
                let block = Block {
                    material,
                    indices,
                    wavelengths: &wavelengths,
                    streams: &streams[..indices.len()],
                };
                self.block(&block, &met.points::<F>());
            }
        }
    }
}

impl<C: ColorModel> Scatter<'_, C> {
    #[inline(always)]
    fn block<F: Lanes>(&mut self, block: &Block<'_, C>, at: &Points<'_, F>) {
        let walkers = &self.walkers.things;
        let throughput = C::Columns::<F>::from_samples(|lane| match block.indices.get(lane) {
            Some(index) => walkers[*index as usize].throughput,
            None => C::Sample::zero(),
        });
        if block.material.is_smooth() {
            self.light(block, at, throughput);
        }
        self.way(block, at, throughput);
    }

    /// Draws light toward the points, where any may arrive.
    #[inline(always)]
    fn light<F: Lanes>(
        &mut self,
        block: &Block<'_, C>,
        at: &Points<'_, F>,
        throughput: C::Columns<F>,
    ) {
        let numbers = Decisions::new(self.sampler, block.streams, self.first, LIGHT);
        let (u2, u1) = (numbers.u2::<F>(), numbers.u1::<F>());
        let w = block.wavelengths;
        let light = self.scene.sample_lights(at, u1, u2, w);
        let wo = at.frame.to_local(light.direction);
        let value = block.material.eval_lanes(at, at.wi, wo, w);
        let weight = F::select(light.delta, F::one(), power(light.pdf, value.pdf));
        let contribution = throughput * value.value * light.radiance * (weight / light.pdf);
        let lit = at.active & F::zero().lt(light.pdf) & !contribution.is_black();
        if !lit.any() {
            return;
        }
        let rays = at.shadow(light.direction, light.target, light.distant);
        let (origins, directions) = (rays.origin.rows(), rays.direction.rows());
        let ends = rays.t_max.row();
        let contributions = contribution.rows();
        for lane in lit.lanes() {
            let index = block.indices[lane] as usize;
            let ray = Ray {
                origin: Vec3::<F>::of(&origins, lane),
                direction: Vec3::<F>::of(&directions, lane),
                t_max: ends[lane],
                time: self.walkers.rays[index].time,
            };
            let shadow = Shadow {
                contribution: C::Columns::<F>::of(&contributions, lane),
                slot: self.walkers.things[index].slot,
            };
            self.shadows.push(ray, shadow);
        }
    }

    /// Turns the paths; those that go on are the next walkers.
    #[inline(always)]
    fn way<F: Lanes>(
        &mut self,
        block: &Block<'_, C>,
        at: &Points<'_, F>,
        throughput: C::Columns<F>,
    ) {
        let numbers = Decisions::new(self.sampler, block.streams, self.first, WAY);
        let (u2, u1) = (numbers.u2::<F>(), numbers.u1::<F>());
        let w = block.wavelengths;
        let sample = block.material.sample_lanes(at, at.wi, u1, u2, w);
        let walkers = &self.walkers.things;
        for lane in (at.active & !(sample.drawn & sample.null)).lanes() {
            let slot = walkers[block.indices[lane] as usize].slot;
            self.estimates[slot as usize].alpha = 1.0;
        }
        let passed = F::from_fn(|lane| match block.indices.get(lane) {
            Some(index) => walkers[*index as usize].eta,
            None => 1.0,
        });
        let eta = passed * sample.eta;
        let throughput = throughput * sample.weight;
        let (lives, throughput) = self.limits.roulettes(self.depth, throughput, eta, &numbers);
        let lives = lives & sample.drawn & at.active;
        if !lives.any() {
            return;
        }
        let direction = at.frame.to_world(sample.wo);
        let (origins, directions) = (at.origin(direction).rows(), direction.rows());
        let (places, throughputs) = (at.position.rows(), throughput.rows());
        let (etas, pdfs) = (eta.row(), sample.pdf.row());
        let delta = sample.delta.to_bits();
        for lane in lives.lanes() {
            let index = block.indices[lane] as usize;
            let scattered = (delta >> lane & 1 == 0).then(|| Scattered {
                from: Vec3::<F>::of(&places, lane),
                pdf: pdfs[lane],
                light_share: 1.0,
            });
            let ray = Ray {
                origin: Vec3::<F>::of(&origins, lane),
                direction: Vec3::<F>::of(&directions, lane),
                t_max: f32::INFINITY,
                time: self.walkers.rays[index].time,
            };
            let walker = Walker {
                throughput: C::Columns::<F>::of(&throughputs, lane),
                eta: etas[lane],
                scattered,
                ..self.walkers.things[index]
            };
            self.next.push(ray, walker);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path;

    use super::*;
    use crate::accel::Method;
    use crate::color::{Bands, Rgb};
    use crate::description::{self, Description, Kind};
    use crate::integrator::Integrator;
    use crate::lanes::Kernel;
    use crate::math::random;
    use crate::scene::{self, Assets};

    /// Surfaces, textures, lights and materials of many kinds, some in lanes and some asked one by one.
    const SCENE: &str = "<scene version='3.0.0'>
        <integrator type='path'><integer name='rr_depth' value='3'/></integrator>
        <emitter type='constant'><rgb name='radiance' value='.2, .3, .4'/></emitter>
        <emitter type='point'><point name='position' value='0, 3, 1'/></emitter>
        <shape type='rectangle'><transform name='to_world'><scale value='.5'/><rotate x='1' angle='90'/>
            <translate y='2.5'/></transform><emitter type='area'/></shape>
        <shape type='sphere'><point name='center' value='2, 1, 0'/><float name='radius' value='.3'/>
            <emitter type='area'/></shape>
        <shape type='cube'><transform name='to_world'><scale value='.2'/><translate x='-2' y='1'/></transform>
            <emitter type='area'/></shape>
        <shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/>
            </transform><bsdf type='diffuse'><texture name='reflectance' type='checkerboard'>
            <transform name='to_uv'><scale value='6'/></transform></texture></bsdf></shape>
        <shape type='sphere'><point name='center' value='-1, .5, 0'/><float name='radius' value='.5'/>
            <bsdf type='dielectric'/></shape>
        <shape type='sphere'><point name='center' value='0, .4, .3'/><float name='radius' value='.4'/>
            <bsdf type='roughplastic'><float name='alpha' value='.2'/></bsdf></shape>
        <shape type='disk'><transform name='to_world'><translate z='-1' y='.8'/></transform>
            <bsdf type='twosided'><bsdf type='roughconductor'><string name='material' value='Cu'/></bsdf></bsdf></shape>
        <shape type='cube'><transform name='to_world'><scale value='.3'/><translate x='1' y='.3' z='.5'/></transform>
            <bsdf type='mask'><float name='opacity' value='.6'/><bsdf type='plastic'/></bsdf></shape>
        <shape type='cylinder'><point name='p0' value='.5, 0, -.5'/><point name='p1' value='.5, 1, -.5'/>
            <float name='radius' value='.2'/><bsdf type='principled'/></shape>
        </scene>";

    fn scene<C: ColorModel>(color: C) -> (Description, Scene<C>) {
        let options = description::Options::default();
        let text = Description::parse(SCENE, path::Path::new("test.xml"), &options).unwrap();
        let assets = Assets::load(&text, None, None, &|| ()).unwrap();
        let scene = scene::build(&text, &assets, color, Method::Tree).unwrap();
        (text, scene)
    }

    /// What `count` rays into the scene come to, which meet all kinds of surfaces in no order.
    fn bits<C: ColorModel>(scene: &Scene<C>, text: &Description, count: u32) -> Vec<u32> {
        let properties = &text.root().children(Kind::Integrator)[0];
        let integrator = Integrator::<C>::build(properties, &Context::default()).unwrap();
        let number = |key, i| random::unit(random::bits(key, i));
        let starts = (0..count).map(|i| {
            let origin = glam::Vec3::new(4.0 * number(1, i) - 2.0, 1.5, 4.0);
            let target = glam::Vec3::new(5.0 * number(2, i) - 2.5, 2.5 * number(3, i), 0.0);
            Start {
                ray: Ray {
                    origin,
                    direction: (target - origin).normalize(),
                    t_max: f32::INFINITY,
                    time: 0.0,
                },
                wavelengths: scene.color().wavelengths(|| number(4, i)),
                stream: Stream::new(0, i, 0, 0),
            }
        });
        let starts: Vec<Start<C>> = starts.collect();
        let mut estimates = Estimates {
            values: Vec::new(),
            extra: Vec::new(),
        };
        let sampler = Sampler::default();
        integrator.estimate(
            scene,
            &sampler,
            &starts,
            &mut estimates,
            &mut Cost::default(),
        );
        let of_one = |estimate: &Estimate<C::Sample>| {
            let radiance = estimate.radiance;
            let channels = (0..C::Sample::LANES).map(move |c| radiance[c].to_bits());
            channels.chain([estimate.alpha.to_bits()])
        };
        estimates.values.iter().flat_map(of_one).collect()
    }

    #[test]
    fn every_kernel_sees_the_same_bits() {
        let (text, mut scene) = scene(Rgb);
        let mut expected = None;
        for kernel in Kernel::all() {
            scene = scene.with_kernel(kernel);
            let found = bits(&scene, &text, 3000);
            let lit = found.iter().filter(|bits| **bits != 0).count();
            assert!(lit > 10_000, "{lit}");
            let expected = expected.get_or_insert_with(|| found.clone());
            assert!(found == *expected, "{}", kernel.name());
        }
    }

    /// Which paths share a block does not matter to any of them.
    #[test]
    fn a_path_comes_to_the_same_bits_whatever_its_company() {
        let (text, scene) = scene(Rgb);
        let many = bits(&scene, &text, 1500);
        for count in [1, 7, 400] {
            let few = bits(&scene, &text, count);
            assert!(few == many[..few.len()], "{count}");
        }
        let (text, scene) = self::scene(Bands::<8>::new(5).unwrap());
        let many = bits(&scene, &text, 300);
        let few = bits(&scene, &text, 20);
        assert!(few == many[..few.len()]);
    }
}
