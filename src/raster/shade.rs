//! What fragments look like: the textbook's equation, I = I_a·k_a + Σ I_i·[k_d·max(0, L·N) + k_s·max(0, R·V)ⁿ], of the integrator
//! `phong`, for each fragment (Phong) or for the corners of its triangle, between which colours are interpolated (Gouraud,
//! *Continuous shading of curved surfaces*, 1971). Of area lights the middle shines. An environment shines from a few
//! directions, without shadows, and mirrors show it and nothing else. Textures with levels are looked up by how far the
//! neighbouring pixels see texture coordinates change; at corners of triangles by the finest level.

use std::f32::consts::FRAC_1_PI;
use std::ops::Range;

use glam::{Vec2, Vec3};

use super::drawn::Drawn;
use super::fragments::{Look, Seen};
use super::projection::Projection;
use super::shadow::{ShadowMap, ShadowSettings, Source};
use crate::accel::Met;
use crate::color::{ColorModel, Spectra as _, Spectral};
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Points, Ray, Reference};
use crate::lanes::{self, Lanes, MAX_LANES, Mask as _, Task};
use crate::light::LightSamples;
use crate::material::{BsdfSample, Material};
use crate::scene::{LightId, Scene};

/// Where the equation is evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// At the corners of triangles.
    Gouraud,
    /// At every fragment.
    #[default]
    Phong,
}

/// In which units light comes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lighting {
    /// As the integrator `phong` has it: no π, and no falloff with distance.
    #[default]
    Textbook,
    /// The same with the inverse square of the distance.
    InverseSquare,
    /// As `path` has it.
    Radiometric,
}

/// How fragments are shaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadeSettings {
    /// Where.
    pub shading: Shading,
    /// In which units.
    pub lighting: Lighting,
    /// Whether lights cast shadows, and how.
    pub shadows: Option<ShadowSettings>,
    /// Whether lights and the surroundings are not seen.
    pub hide_emitters: bool,
}

/// Points that are seen.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// The rays that see them.
    pub rays: Vec<Ray>,
    /// What each has met; none missed.
    pub hits: Vec<Hit>,
    /// How far to its side the neighbours of each look, to the right and down, world space; only of scenes with mipmaps.
    pub steps: Vec<[Vec3; 2]>,
}

impl Batch {
    /// Takes all points out.
    pub fn clear(&mut self) {
        self.rays.clear();
        self.hits.clear();
        self.steps.clear();
    }
}

/// What a light comes to.
#[derive(Debug)]
enum Lamp<S> {
    /// One all around: directions from which it shines, each with what it brings at right angles.
    Around(Vec<(Vec3, S)>),
    /// One that is asked for every point, and what it sees.
    Single(LightId, Option<ShadowMap>),
}

/// Shades fragments of a scene at one time.
#[derive(Debug)]
pub struct Shader<'s, C: ColorModel> {
    scene: &'s Scene<C>,
    settings: ShadeSettings,
    lamps: Vec<Lamp<C::Sample>>,
    /// By material, whether it may have single directions that show the environment.
    mirrors: Vec<bool>,
    wavelengths: C::Wavelengths,
    time: f32,
}

/// From how many directions an environment shines.
const DIRECTIONS: u32 = 16;

/// A number in [0, 1) whose digits are those of `i` turned around.
fn radical_inverse(i: u32) -> f32 {
    i.reverse_bits() as f32 / (1_u64 << 32) as f32
}

impl<'s, C: ColorModel> Shader<'s, C> {
    /// Without shadow maps.
    pub fn new(
        scene: &'s Scene<C>,
        settings: ShadeSettings,
        wavelengths: C::Wavelengths,
        time: f32,
    ) -> Self {
        let from = Reference {
            position: Vec3::ZERO,
            time,
        };
        let lights = scene.light_ids().zip(scene.lights());
        let lamps = lights.map(|(id, light)| {
            if !light.is_environment() {
                return Lamp::Single(id, None);
            }
            let each = 1.0 / DIRECTIONS as f32;
            let around = (0..DIRECTIONS).filter_map(|i| {
                let u = Vec2::new((i as f32 + 0.5) * each, radical_inverse(i) + 0.5 * each);
                let sample = light.sample(from, u, &wavelengths)?;
                Some((sample.direction, sample.radiance * (each / sample.pdf)))
            });
            Lamp::Around(around.collect())
        });
        let mirrors = (0..scene.material_count())
            .map(|i| scene.has_environment() && is_mirror(scene.material_at(i), &wavelengths));
        Self {
            scene,
            settings,
            lamps: lamps.collect(),
            mirrors: mirrors.collect(),
            wavelengths,
            time,
        }
    }

    /// With maps of the shadows of what is drawn, if the settings ask for any. What shines casts none.
    ///
    /// # Errors
    /// Where there is no memory for the maps.
    pub fn with_maps(mut self, drawn: &Drawn<'_>) -> Result<Self> {
        let scene = self.scene;
        let bounds = scene.tracer().bounds();
        let Some(shadows) = self.settings.shadows.filter(|_| !bounds.is_empty()) else {
            return Ok(self);
        };
        let casters = drawn.without(|shape| scene.shines(shape));
        for lamp in &mut self.lamps {
            let Lamp::Single(id, map) = lamp else {
                continue;
            };
            let light = &scene.lights()[id.index()];
            // From the scene's middle nothing may be seen of a light that shines beside it.
            let middle = 0.5 * bounds.min + 0.5 * bounds.max;
            let mut samples =
                std::iter::once(middle)
                    .chain(bounds.corners())
                    .filter_map(|position| {
                        let from = Reference {
                            position,
                            time: self.time,
                        };
                        light.sample(from, MIDDLE, &self.wavelengths)
                    });
            let Some(sample) = samples.next() else {
                continue;
            };
            let source = match sample.target {
                Some(target) => Source::At(target),
                None => Source::Along(-sample.direction),
            };
            let receivers = drawn.without(|shape| scene.light_of(shape) == Some(*id));
            let drawn = [&casters, &receivers];
            *map = Some(ShadowMap::draw(source, drawn, &bounds, shadows)?);
        }
        Ok(self)
    }

    /// The wavelengths at which it sees.
    pub fn wavelengths(&self) -> &C::Wavelengths {
        &self.wavelengths
    }

    /// What is seen where nothing is: the surroundings, and whether there are any.
    pub fn background(&self, ray: &Ray) -> (C::Sample, f32) {
        if self.settings.hide_emitters || !self.scene.has_environment() {
            return (C::Sample::zero(), 0.0);
        }
        let seen = self.scene.surrounding(ray, &self.wavelengths);
        (
            seen.map_or(C::Sample::zero(), |(radiance, _)| radiance),
            1.0,
        )
    }

    /// Adds to a batch the points whose colours make up that of what is seen, and tells of each its weight: the point itself,
    /// or the corners of its triangle.
    pub fn add_points(
        &self,
        (batch, weights): (&mut Batch, &mut Vec<f32>),
        (drawn, projection): (&Drawn<'_>, &Projection),
        look: &Look,
        seen: &Seen,
    ) {
        let (ray, hit) = (&look.ray, seen.hit);
        let mut add = |ray: Ray, hit: Hit, steps: [Vec3; 2], weight: f32| {
            batch.rays.push(ray);
            batch.hits.push(hit);
            if self.scene.has_mipmaps() {
                batch.steps.push(steps);
            }
            weights.push(weight);
        };
        if self.settings.shading == Shading::Phong {
            let steps = projection.steps(seen.a.into()).map(|step| step.as_vec3());
            add(*ray, hit, steps, 1.0);
            return;
        }
        let of_mesh = self.scene.tracer().shape(hit.shape).mesh().is_some();
        let corners = drawn.corners(look.number).into_iter().zip(seen.weights);
        for (corner, (place, weight)) in corners.enumerate() {
            let place = place.as_vec3();
            let (origin, direction) = match projection.is_perspective() {
                true => (ray.origin, (place - ray.origin).normalize()),
                false => (place - hit.t * ray.direction, ray.direction),
            };
            let to_corner = Ray {
                origin,
                direction,
                ..*ray
            };
            let at = |number| match of_mesh && corner == number {
                true => 1.0,
                false => 0.0,
            };
            let hit = Hit {
                t: (place - origin).length(),
                u: at(1),
                v: at(2),
                ..hit
            };
            add(to_corner, hit, [Vec3::ZERO; 2], weight);
        }
    }

    /// What points look like. Where `blocked` is given it says what lies on rays to lights, in place of the maps.
    pub fn shade(
        &self,
        batch: &Batch,
        mut blocked: Option<&mut Blocked<'_>>,
        colors: &mut Vec<C::Sample>,
    ) {
        // Neighbours are of one shape as a rule.
        let mut end = 0;
        let of_shapes = batch.hits.chunk_by(|a, b| a.shape == b.shape).map(|hits| {
            let first = end;
            end += hits.len() as u32;
            (self.scene.material_of(&hits[0]).index(), first..end)
        });
        let mut runs: Vec<(usize, Range<u32>)> = of_shapes.collect();
        runs.sort_by_key(|(material, _)| *material);
        colors.clear();
        colors.resize(batch.hits.len(), C::Sample::zero());
        let mut indices = Vec::with_capacity(batch.hits.len());
        for runs in runs.chunk_by(|a, b| a.0 == b.0) {
            let material = runs[0].0;
            indices.clear();
            indices.extend(runs.iter().flat_map(|(_, places)| places.clone()));
            let of_one = OfOneMaterial {
                shader: self,
                material: self.scene.material_at(material),
                is_mirror: self.mirrors[material],
                batch,
                indices: &indices,
                blocked: blocked.as_deref_mut(),
                colors,
            };
            self.scene.tracer().kernel().run(of_one);
        }
    }

    /// What a mirror or a clear boundary shows of the environment.
    fn mirrored(&self, at: &Interaction<'_>) -> C::Sample {
        let (scene, w) = (self.scene, &self.wavelengths);
        let mut sum = C::Sample::zero();
        // The two ends of what chooses a lobe: one each where there are two.
        let mut first = None;
        for u1 in ENDS {
            let drawn = scene.material(at).sample(at, at.wi, u1, MIDDLE, w);
            let Some(sample) = drawn.filter(|sample| sample.delta && !sample.null) else {
                continue;
            };
            if first == Some(sample.wo) {
                continue;
            }
            first = Some(sample.wo);
            let ray = Ray {
                origin: at.position,
                direction: at.frame.to_world(sample.wo),
                t_max: f32::INFINITY,
                time: self.time,
            };
            if let Some((radiance, _)) = scene.surrounding(&ray, w) {
                sum += sample.weight * radiance * sample.pdf;
            }
        }
        sum
    }
}

/// Whether anything lies on a ray to a light.
pub type Blocked<'a> = dyn FnMut(&Ray) -> bool + 'a;

/// Points of one material.
struct OfOneMaterial<'a, 'b, C: ColorModel> {
    shader: &'a Shader<'a, C>,
    material: &'a Material<C>,
    is_mirror: bool,
    batch: &'a Batch,
    indices: &'a [u32],
    blocked: Option<&'a mut Blocked<'b>>,
    colors: &'a mut [C::Sample],
}

impl<C: ColorModel> Task for OfOneMaterial<'_, '_, C> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(mut self) {
        let (shader, batch) = (self.shader, self.batch);
        let (scene, w) = (shader.scene, &shader.wavelengths);
        for indices in self.indices.chunks(F::WIDTH) {
            let met = Met {
                tracer: scene.tracer(),
                rays: &batch.rays,
                hits: &batch.hits,
                indices,
            };
            let mut at = met.points::<F>();
            if scene.has_mipmaps() {
                let mut rows = [[F::ROW; 3]; 2];
                for (lane, index) in indices.iter().enumerate() {
                    for (rows, step) in rows.iter_mut().zip(batch.steps[*index as usize]) {
                        for (row, value) in rows.iter_mut().zip(step.to_array()) {
                            row[lane] = value;
                        }
                    }
                }
                at.footprint = at.beside(
                    -met.directions(),
                    rows.map(|rows| lanes::Vec3::<F>::load(&rows)),
                );
            }
            let lit = self.lit(&met, &at).rows();
            for (lane, index) in indices.iter().enumerate() {
                let mut color: C::Sample = C::Columns::<F>::of(&lit, lane);
                let shines = !shader.settings.hide_emitters && scene.shines(met.hit(lane).shape);
                if shines || self.is_mirror {
                    let at = at.lane(lane);
                    let origin = met.ray(lane).origin;
                    if let (true, Some((emission, _))) = (shines, scene.emitted(&at, origin, w)) {
                        color += emission;
                    }
                    if self.is_mirror {
                        color += shader.mirrored(&at);
                    }
                }
                self.colors[*index as usize] = color;
            }
        }
    }
}

impl<C: ColorModel> OfOneMaterial<'_, '_, C> {
    /// What points return of the scene's lights.
    #[inline(always)]
    fn lit<F: Lanes>(&mut self, met: &Met<'_>, at: &Points<'_, F>) -> C::Columns<F> {
        let (shader, material) = (self.shader, self.material);
        let scene = shader.scene;
        let w = &[shader.wavelengths; MAX_LANES];
        let mut lit = C::Columns::<F>::zero();
        if scene.has_ambient() {
            lit = C::Columns::<F>::from_samples(|lane| match lane < met.indices.len() {
                true => scene
                    .ambient(&at.lane(lane), &w[0])
                    .unwrap_or(C::Sample::zero()),
                false => C::Sample::zero(),
            });
        }
        let unit = F::splat(match shader.settings.lighting {
            Lighting::Radiometric => FRAC_1_PI,
            Lighting::Textbook | Lighting::InverseSquare => 1.0,
        });
        let lamps = if material.is_smooth() {
            &shader.lamps[..]
        } else {
            &[]
        };
        for lamp in lamps {
            match lamp {
                Lamp::Around(around) => lit = lit + self.returned_around(at, around, w) * unit,
                Lamp::Single(id, map) => {
                    let light = &scene.lights()[id.index()];
                    let sample = light.sample_lanes(at, lanes::Vec2::all(MIDDLE), w, at.active);
                    let returned = self.returned(at, sample.direction, w);
                    let asked = at.active & F::zero().lt(sample.pdf) & !returned.is_black();
                    if !asked.any() {
                        continue;
                    }
                    let share = self.shares(met, at, &sample, asked, map.as_ref());
                    // What a light sample brings has the inverse square in it.
                    let squared = match shader.settings.lighting {
                        Lighting::Textbook => {
                            let squared = (sample.target - at.position).length_squared();
                            F::select(sample.distant, F::one(), squared)
                        }
                        _ => F::one(),
                    };
                    let strength = unit * (share * squared / sample.pdf);
                    let brought = sample.radiance * returned * strength;
                    let seen = asked & F::zero().lt(share);
                    lit = lit + C::Columns::<F>::select(seen, brought, C::Columns::<F>::zero());
                }
            }
        }
        lit
    }

    /// What the material returns of light from all around. A matte one is asked once, along its normal, as the rest is cosines.
    #[inline(always)]
    fn returned_around<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        around: &[(Vec3, C::Sample)],
        w: &[C::Wavelengths],
    ) -> C::Columns<F> {
        let mut sum = C::Columns::<F>::zero();
        if !self.material.is_matte() {
            for (direction, brought) in around {
                let returned = self.returned(at, lanes::Vec3::all(*direction), w);
                sum = sum + returned * C::Columns::<F>::from_samples(|_| *brought);
            }
            return sum;
        }
        let normal = at.frame.n * F::one().copysign(at.wi.z);
        for (direction, brought) in around {
            let cosine = normal.dot(lanes::Vec3::all(*direction)).max(F::zero());
            sum = sum + C::Columns::<F>::from_samples(|_| *brought) * cosine;
        }
        self.returned(at, normal, w) * sum
    }

    /// What the material returns of light from a direction, by Phong's equation.
    #[inline(always)]
    fn returned<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        direction: lanes::Vec3<F>,
        w: &[C::Wavelengths],
    ) -> C::Columns<F> {
        let wo = at.frame.to_local(direction);
        let terms = self.material.phong_lanes(at, at.wi, wo, w);
        terms.diffuse + terms.specular
    }

    /// How much of a light those points get that are `asked`.
    #[inline(always)]
    fn shares<F: Lanes>(
        &mut self,
        met: &Met<'_>,
        at: &Points<'_, F>,
        sample: &LightSamples<F, C::Columns<F>>,
        asked: F::Mask,
        map: Option<&ShadowMap>,
    ) -> F {
        if self.shader.settings.shadows.is_none() {
            return F::one();
        }
        let mut shares = F::ROW;
        if let Some(blocked) = self.blocked.as_mut() {
            let rays = at.shadow(sample.direction, sample.target, sample.distant);
            let (origins, directions) = (rays.origin.rows(), rays.direction.rows());
            let ends = rays.t_max.row();
            for lane in asked.lanes() {
                let is_blocked = blocked(&Ray {
                    origin: lanes::Vec3::<F>::of(&origins, lane),
                    direction: lanes::Vec3::<F>::of(&directions, lane),
                    t_max: ends[lane],
                    time: met.ray(lane).time,
                });
                shares[lane] = if is_blocked { 0.0 } else { 1.0 };
            }
            return F::load(&shares);
        }
        let Some(map) = map else {
            return F::one();
        };
        map.lit(at.position, at.normal.dot(sample.direction), asked)
    }
}

/// The two ends of what chooses a lobe.
const ENDS: [f32; 2] = [1e-4, 0.9999];

/// Whether a material, seen from either side, draws a single direction that is not straight on.
fn is_mirror<C: ColorModel>(material: &Material<C>, wavelengths: &C::Wavelengths) -> bool {
    let at = Interaction::at_uv(MIDDLE);
    let sides = [1.0, -1.0].map(|side| Vec3::new(0.6, 0.0, 0.8 * side));
    let drawn = |wi: Vec3, u1: f32| material.sample(&at, wi, u1, MIDDLE, wavelengths);
    let single = |sample: BsdfSample<C::Sample>| sample.delta && !sample.null;
    let mut tries = sides.into_iter().flat_map(|wi| ENDS.map(|u1| (wi, u1)));
    tries.any(|(wi, u1)| drawn(wi, u1).is_some_and(single))
}

/// The middle of what is drawn evenly.
const MIDDLE: Vec2 = Vec2::splat(0.5);
