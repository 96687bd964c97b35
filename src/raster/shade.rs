//! What fragments look like: the textbook's equation, I = I_a·k_a + Σ I_i·[k_d·max(0, L·N) + k_s·max(0, R·V)ⁿ], of the integrator
//! `phong`, for each fragment (Phong) or for the corners of its triangle, between which colours are interpolated (Gouraud,
//! *Continuous shading of curved surfaces*, 1971). Of area lights the middle shines. An environment shines from a few
//! directions, without shadows, and mirrors show it and nothing else. Textures with levels are looked up by how far the
//! neighbouring pixels see texture coordinates change; at corners of triangles by the finest level.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::around::{Around, DIRECTIONS};
use super::drawn::Drawn;
use super::fragment::Fragment;
use super::shadow::{ShadowMap, ShadowSettings, Source};
use crate::color::{ColorModel, Spectra as _, Spectral};
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Points, Ray, Reference};
use crate::light::LightSample;
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

/// What a light comes to.
#[derive(Debug)]
enum Lamp<S> {
    /// One all around.
    Around(Box<Around<S>>),
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
            let around = Around::new(|i| {
                let u = Vec2::new((i as f32 + 0.5) * each, radical_inverse(i) + 0.5 * each);
                let sample = light.sample(from, u, &wavelengths)?;
                Some((sample.direction, sample.radiance * (each / sample.pdf)))
            });
            Lamp::Around(Box::new(around))
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

    /// With maps of the shadows of `casters`, if the settings ask for any.
    ///
    /// # Errors
    /// Where there is no memory for the maps.
    pub fn with_maps(mut self, casters: &Drawn<'_>) -> Result<Self> {
        let bounds = self.scene.tracer().bounds();
        let Some(shadows) = self.settings.shadows.filter(|_| !bounds.is_empty()) else {
            return Ok(self);
        };
        for lamp in &mut self.lamps {
            let Lamp::Single(id, map) = lamp else {
                continue;
            };
            let light = &self.scene.lights()[id.index()];
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
            *map = Some(ShadowMap::draw(source, casters, &bounds, shadows)?);
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

    /// A fragment that `ray` goes to.
    pub fn fragment(&self, ray: &Ray, fragment: &Fragment, is_perspective: bool) -> C::Sample {
        let hit = fragment.hit_of(ray);
        if self.settings.shading == Shading::Phong {
            let mut at = self.scene.interaction(ray, &hit);
            if self.scene.has_mipmaps() {
                at = at.seen_beside(-ray.direction, fragment.steps);
            }
            return self.point(ray, at, &mut |_, at, _, lamp| self.in_map(at, lamp));
        }
        let mut sum = C::Sample::zero();
        for (corner, weight) in fragment.weights.iter().enumerate() {
            let place = fragment.corners[corner].as_vec3();
            let (origin, direction) = match is_perspective {
                true => (ray.origin, (place - ray.origin).normalize()),
                false => (place - hit.t * ray.direction, ray.direction),
            };
            let to_corner = Ray {
                origin,
                direction,
                ..*ray
            };
            let of_mesh = self.scene.tracer().shape(hit.shape).mesh().is_some();
            let at = |number| {
                if of_mesh && corner == number {
                    1.0
                } else {
                    0.0
                }
            };
            let hit = Hit {
                t: (place - origin).length(),
                u: at(1),
                v: at(2),
                ..hit
            };
            let at = self.scene.interaction(&to_corner, &hit);
            let color = self.point(&to_corner, at, &mut |_, at, _, lamp| self.in_map(at, lamp));
            sum += color * *weight as f32;
        }
        sum
    }

    /// A point as rays find it, with `visible` for how much of a light a point gets.
    pub fn met(
        &self,
        ray: &Ray,
        at: Interaction<'_>,
        mut visible: impl FnMut(&Interaction<'_>, &LightSample<C::Sample>) -> f32,
    ) -> C::Sample {
        self.point(
            ray,
            at,
            &mut |_, at, sample, _| match self.settings.shadows {
                Some(_) => visible(at, sample),
                None => 1.0,
            },
        )
    }

    fn in_map(&self, at: &Interaction<'_>, (cosine, map): (f32, Option<&ShadowMap>)) -> f32 {
        map.map_or(1.0, |map| map.lit(at.position, cosine))
    }

    fn point(&self, ray: &Ray, at: Interaction<'_>, visible: &mut Visible<'_, C>) -> C::Sample {
        let (scene, w) = (self.scene, &self.wavelengths);
        let material = scene.material(&at);
        let mut lit = C::Sample::zero();
        if let Some(ambient) = scene.ambient(&at, w) {
            lit += ambient;
        }
        let points = Points::one(&at);
        let terms = |direction: Vec3| {
            let wo = at.frame.to_local(direction);
            let w = std::slice::from_ref(w);
            let terms = material.phong_lanes::<f32>(&points, at.wi.into(), wo.into(), w);
            let (diffuse, specular): (C::Sample, C::Sample) =
                (terms.diffuse.sample(0), terms.specular.sample(0));
            diffuse + specular
        };
        let lamps = if material.is_smooth() {
            &self.lamps[..]
        } else {
            &[]
        };
        for lamp in lamps {
            match lamp {
                Lamp::Around(around) => {
                    lit += around.lit(scene.tracer().kernel(), &at, material, w);
                }
                Lamp::Single(id, map) => {
                    let light = &scene.lights()[id.index()];
                    let Some(sample) = light.sample(at.reference(), MIDDLE, w) else {
                        continue;
                    };
                    let seen: C::Sample = terms(sample.direction);
                    if seen.is_black() {
                        continue;
                    }
                    // What a light sample brings has the inverse square in it.
                    let squared = match (self.settings.lighting, sample.target) {
                        (Lighting::Textbook, Some(target)) => {
                            (target - at.position).length_squared()
                        }
                        _ => 1.0,
                    };
                    let cosine = at.normal.dot(sample.direction);
                    let share = visible(*id, &at, &sample, (cosine, map.as_ref()));
                    if share > 0.0 {
                        lit += seen * sample.radiance * (share * squared / sample.pdf);
                    }
                }
            }
        }
        if self.settings.lighting == Lighting::Radiometric {
            lit = lit * FRAC_1_PI;
        }
        if let (false, Some((emission, _))) = (
            self.settings.hide_emitters,
            scene.emitted(&at, ray.origin, w),
        ) {
            lit += emission;
        }
        match self.mirrors[scene.made_of(at.shape).index()] {
            true => lit + self.mirrored(&at),
            false => lit,
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

/// How much of a light a point gets, of which a sample was taken; with the cosine at the surface and the light's map.
type Visible<'a, C> = dyn FnMut(
        LightId,
        &Interaction<'_>,
        &LightSample<<C as ColorModel>::Sample>,
        (f32, Option<&ShadowMap>),
    ) -> f32
    + 'a;

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
