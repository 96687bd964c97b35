//! `path`: unidirectional path tracing (Kajiya, *The rendering equation*, 1986) with one light sample a
//! bounce, multiple importance sampling and Russian roulette.
//!
//! `max_depth`, `rr_depth` and `hide_emitters`: see [`super::limits`].

use super::bounce::Bounces;
use super::limits::{self, Limits};
use super::mis::power;
use super::wave::{Block, Contribution, Outcome, Shading, Wave, Ways};
use super::{Context, Cost, Estimate, Estimates, Estimator, Footprint, Start};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Lanes, Mask as _};
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The path tracer's settings.
#[derive(Clone, Debug, Default)]
pub struct Path {
    limits: Limits,
    hide_emitters: bool,
    footprint: Option<Footprint>,
}

/// A bounce decides on a light and on the way on.
const BOUNCES: Bounces = Bounces { decisions: 2 };
/// The first decision.
const LIGHT: u32 = 0;
/// The second.
const WAY: u32 = 1;

impl Path {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "paths: emission, light samples and material samples",
        properties: &[limits::COMMON, limits::LIMITS],
    };

    /// Mitsuba's, without a limit, seen by a camera.
    pub(super) fn seen_by(footprint: Option<Footprint>) -> Self {
        Self {
            footprint,
            ..Self::default()
        }
    }

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?,
            footprint: context.footprint.clone(),
        })
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
        estimates.resize(starts.len(), self.limits.start(scene, self.hide_emitters));
        let mut wave = Wave::new(scene, sampler, starts).with_cones(self.footprint.as_ref());
        for depth in 0..self.limits.max_depth {
            if wave.is_over() {
                break;
            }
            wave.trace(depth, self.hide_emitters, cost);
            wave.arrive(|walker, mut arrival| {
                let estimate = &mut estimates[walker.slot as usize];
                arrival.hides_surroundings = self.hide_emitters && estimate.alpha == 0.0;
                arrival.add_to(estimate);
            });
            let Some(first) = BOUNCES.first(depth) else {
                break;
            };
            if depth + 1 == self.limits.max_depth {
                break;
            }
            let mut bounce = Bounce {
                limits: &self.limits,
                depth,
                estimates,
            };
            let light = |bounce: &mut Bounce<'_, C>, shadow: &Contribution<C::Sample>| {
                shadow.add_to(bounce.estimates);
            };
            wave.shade(first, 1, &mut bounce, light, cost);
        }
    }
}

/// A bounce: a light sample and a way on.
struct Bounce<'a, C: ColorModel> {
    limits: &'a Limits,
    depth: u32,
    estimates: &'a mut [Estimate<C::Sample>],
}

impl<C: ColorModel> Shading<C> for Bounce<'_, C> {
    type Shadow = Contribution<C::Sample>;

    #[inline(always)]
    fn shade<F: Lanes>(&mut self, block: &Block<'_, C, F>, out: &mut Outcome<'_, C, Self::Shadow>) {
        if block.material.is_smooth() {
            self.light(block, out);
        }
        self.way(block, out);
    }
}

impl<C: ColorModel> Bounce<'_, C> {
    /// Draws light toward the points, where any may arrive.
    #[inline(always)]
    fn light<F: Lanes>(
        &self,
        block: &Block<'_, C, F>,
        out: &mut Outcome<'_, C, Contribution<C::Sample>>,
    ) {
        let numbers = block.decisions(LIGHT);
        let (u2, u1) = (numbers.u2(), numbers.u1());
        let (at, w) = (&block.at, block.wavelengths);
        let light = block.scene.sample_lights(at, u1, u2, w);
        let wo = at.frame.to_local(light.direction);
        let value = block.material.eval_lanes(at, at.wi, wo, w);
        let weight = F::select(light.delta, F::one(), power(light.pdf, value.pdf));
        let contribution = block.throughput * value.value * light.radiance * (weight / light.pdf);
        out.light(block, &light, contribution);
    }

    /// Turns the paths.
    #[inline(always)]
    fn way<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F>,
        out: &mut Outcome<'_, C, Contribution<C::Sample>>,
    ) {
        let numbers = block.decisions(WAY);
        let (u2, u1) = (numbers.u2(), numbers.u1());
        let (at, w) = (&block.at, block.wavelengths);
        let sample = block.material.sample_lanes(at, at.wi, u1, u2, w);
        for lane in (at.active & !(sample.drawn & sample.null)).lanes() {
            self.estimates[block.walker(lane).slot as usize].alpha = 1.0;
        }
        let eta = block.eta() * sample.eta;
        let throughput = block.throughput * sample.weight;
        let (lives, throughput) = self.limits.roulette(self.depth, throughput, eta, &numbers);
        let lives = lives & sample.drawn & at.active;
        if !lives.any() {
            return;
        }
        let ways = Ways {
            lives,
            wo: sample.wo,
            throughput,
            eta,
            pdf: sample.pdf,
            delta: sample.delta,
            light_share: 1.0,
        };
        out.send(block, &ways);
    }
}

#[cfg(test)]
mod tests {
    use std::path;

    use super::*;
    use crate::accel::Method;
    use crate::color::{Bands, Rgb, Spectral as _};
    use crate::description::{self, Description, Kind};
    use crate::integrator::Integrator;
    use crate::interaction::Ray;
    use crate::lanes::Kernel;
    use crate::math::random;
    use crate::sampler::Stream;
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
        let mut estimates = Estimates::default();
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
        let (text, mut scene) = self::scene(Bands::<8>::visible(5).unwrap());
        let mut expected = None;
        for kernel in Kernel::all() {
            scene = scene.with_kernel(kernel);
            let found = bits(&scene, &text, 300);
            let expected = expected.get_or_insert_with(|| found.clone());
            assert!(found == *expected, "bands, {}", kernel.name());
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
        let (text, scene) = self::scene(Bands::<8>::visible(5).unwrap());
        let many = bits(&scene, &text, 300);
        let few = bits(&scene, &text, 20);
        assert!(few == many[..few.len()]);
    }
}
