//! Materials: how surfaces scatter light. Directions are local to the shading frame (z is the normal);
//! `wi` points to where the path came from, `wo` to where it goes on. Values include the cosine:
//! f(wi, wo)·|cos θ_o|.

mod blendbsdf;
mod bumpmap;
mod circular;
mod conductor;
mod dielectric;
mod diffuse;
mod hair;
mod mask;
mod measured;
mod normalmap;
mod null;
mod phong;
mod plastic;
mod polarizer;
mod pplastic;
mod principled;
mod principledthin;
mod retarder;
mod roughconductor;
mod roughdielectric;
mod roughplastic;
mod thindielectric;
mod twosided;

mod block;
mod disney;
mod dispersion;
mod fresnel;
mod ior;
mod microfacet;
mod perturbed;
mod sheet;
mod surface;
mod tensor_file;
mod warp2d;

use glam::{Vec2, Vec3};

use crate::color::{ColorModel, Mono, Spectral};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::family::family;
use crate::interaction::Interaction;
use crate::texture::{Palettes, Texture};

use block::{BlockBsdf, Visitor, single_face};
pub use block::{BsdfSamples, BsdfValues, PhongTerms};
pub use surface::{Lambertian, Surface};

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample<S> {
    /// Local, unit length.
    pub wo: Vec3,
    /// f·|cos θ_o| over the density.
    pub weight: S,
    /// Density per solid angle in 1/sr; of a delta direction, the probability of its choice.
    pub pdf: f32,
    /// Index of refraction on the side of `wo` over that on the side of `wi`; 1 for a reflection.
    pub eta: f32,
    /// Whether no other direction would do: a mirror's or a clear glass's.
    pub delta: bool,
    /// Whether it goes straight on as if nothing were there, as through a hole.
    pub null: bool,
}

/// A BSDF's value for two directions, without its delta parts.
#[derive(Clone, Copy, Debug)]
pub struct BsdfValue<S> {
    /// f·|cos θ_o|.
    pub value: S,
    /// The density with which [`Bsdf::sample`] draws `wo`, in 1/sr.
    pub pdf: f32,
}

/// The ways in which a material scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lobes {
    /// Into more than single directions, so that sampling lights pays.
    pub smooth: bool,
    /// Through the surface.
    pub transmission: bool,
}

impl Lobes {
    /// Reflection into many directions.
    const REFLECTION: Self = Self {
        smooth: true,
        transmission: false,
    };
    /// Reflection into single directions.
    const MIRROR: Self = Self {
        smooth: false,
        transmission: false,
    };
}

/// What every material does. `Option`: `None` is black with density 0.
pub trait Bsdf<C: ColorModel>: std::fmt::Debug + Send + Sync {
    /// The ways in which it scatters anywhere.
    fn lobes(&self) -> Lobes;

    /// Whether it scatters into more than single directions, so that sampling lights pays.
    fn is_smooth(&self) -> bool {
        self.lobes().smooth
    }

    /// Whether what it returns of light goes by the cosine of the light's direction alone, on the side from which it is seen.
    fn is_matte(&self) -> bool {
        false
    }

    /// What it is made of where it scatters by Lambert's law and in no other way.
    fn lambertian(&self) -> Option<Lambertian<'_, C>> {
        None
    }

    /// Whether light may go straight on through it as if nothing were there: see [`Material::passing_lanes`].
    fn passes(&self) -> bool {
        false
    }

    /// The value and density of a pair of directions; none where all lobes are single directions.
    fn eval(
        &self,
        _at: &Interaction<'_>,
        _wi: Vec3,
        _wo: Vec3,
        _wavelengths: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        None
    }

    /// The diffuse reflectance, for the channel that shows it: π·f seen and lit along the normal.
    fn albedo(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        let straight = self.eval(at, Vec3::Z, Vec3::Z, wavelengths);
        straight.map_or(C::Sample::zero(), |v| v.value * std::f32::consts::PI)
    }

    /// The share of ambient light, which comes from nowhere and is never shadowed, that leaves toward `wi`.
    fn ambient(
        &self,
        _at: &Interaction<'_>,
        _wi: Vec3,
        _wavelengths: &C::Wavelengths,
    ) -> C::Sample {
        C::Sample::zero()
    }

    /// Draws `wo`: `u1` chooses the lobe, `u2` the direction.
    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        u1: f32,
        u2: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>>;
}

family! {
    /// Every material there is.
    #[derive(Clone, Debug)]
    pub enum Material<C>: Bsdf, context Palettes<C>, visitor Visitor {
        "blendbsdf" => BlendBsdf(blendbsdf::BlendBsdf<C>),
        "bumpmap" => BumpMap(bumpmap::BumpMap<C>),
        "circular" => Circular(circular::Circular<C>),
        "conductor" => Conductor(conductor::Conductor<C>),
        "dielectric" => Dielectric(dielectric::Dielectric<C>),
        "diffuse" => Diffuse(diffuse::Diffuse<C>),
        "hair" => Hair(hair::Hair<C>),
        "mask" => Mask(mask::Mask<C>),
        "measured" => Measured(measured::Measured<C>),
        "normalmap" => NormalMap(normalmap::NormalMap<C>),
        "null" => Null(null::Null),
        "phong" => Phong(phong::Phong<C>),
        "plastic" => Plastic(plastic::Plastic<C>),
        "polarizer" => Polarizer(polarizer::Polarizer<C>),
        "pplastic" => PPlastic(pplastic::PPlastic<C>),
        "principled" => Principled(principled::Principled<C>),
        "principledthin" => PrincipledThin(principledthin::PrincipledThin<C>),
        "retarder" => Retarder(retarder::Retarder<C>),
        "roughconductor" => RoughConductor(roughconductor::RoughConductor<C>),
        "roughdielectric" => RoughDielectric(roughdielectric::RoughDielectric<C>),
        "roughplastic" => RoughPlastic(roughplastic::RoughPlastic<C>),
        "thindielectric" => ThinDielectric(thindielectric::ThinDielectric<C>),
        "twosided" => TwoSided(twosided::TwoSided<C>),
    }
}

impl<C: ColorModel> Material<C> {
    /// The material of a shape that names none: grey, or black where the shape gives light.
    pub fn default_of_shape(palettes: &Palettes<C>, gives_light: bool) -> Self {
        Self::Diffuse(diffuse::Diffuse::grey(
            palettes,
            if gives_light { 0.0 } else { 0.5 },
        ))
    }
}

/// The materials nested in another; `allowed` says how many there may be.
fn nested<C: ColorModel>(
    properties: &Properties<'_>,
    palettes: &Palettes<C>,
    allowed: std::ops::RangeInclusive<usize>,
) -> Result<Vec<Material<C>>> {
    let children = properties.children(Kind::Bsdf);
    if !allowed.contains(&children.len()) {
        let (least, most) = (allowed.start(), allowed.end());
        let wanted = if least == most {
            format!("{least}")
        } else {
            format!("{least} or {most}")
        };
        let plugin = properties.plugin();
        return Err(properties.error(
            "",
            format!(
                "{plugin} needs {wanted} nested bsdf, and has {}",
                children.len()
            ),
        ));
    }
    children
        .iter()
        .map(|child| Material::build(child, palettes))
        .collect()
}

/// The texture's number, clamped to [0, 1].
fn fraction(texture: &Texture<Mono>, at: &Interaction<'_>) -> f32 {
    texture.eval(at, &())[0].clamp(0.0, 1.0)
}

/// The mean of a colour over texture coordinates and channels, by some samples: for choosing lobes. One that varies and
/// shows nothing there (a mesh's attribute, a volume elsewhere) counts as a half, so that its lobe is chosen at all.
fn mean<C: ColorModel>(palettes: &Palettes<C>, texture: &Texture<C>) -> f32 {
    let unit = palettes.colors.color.unit();
    let total = |value: C::Sample| (0..C::Sample::LANES).map(|c| value[c]).sum::<f32>();
    let (mut sum, mut count) = (0.0, 0.0);
    for value in samples(&palettes.colors.color, texture) {
        sum += total(value * unit);
        count += 1.0;
    }
    match texture.constant() {
        None if sum == 0.0 => 0.5,
        _ => sum / (total(unit) * count),
    }
}

/// A texture's values at points spread over texture coordinates and wavelengths.
fn samples<C: ColorModel>(color: &C, texture: &Texture<C>) -> impl Iterator<Item = C::Sample> {
    const STEPS: u16 = 16;
    let step = |i: u16| (f32::from(i) + 0.5) / f32::from(STEPS);
    (0..STEPS * STEPS).map(move |i| {
        let uv = Vec2::new(step(i % STEPS), step(i / STEPS));
        texture.eval(
            &Interaction::at_uv(uv),
            &color.wavelengths(|| step(i % STEPS)),
        )
    })
}

#[cfg(test)]
mod tests;
