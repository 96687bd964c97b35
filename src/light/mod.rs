//! Lights: what emits, how much arrives from where, and how to draw a direction toward it.

mod ambient;
mod area;
mod block;
mod brightness;
mod constant;
mod directional;
mod directionalarea;
mod emission;
mod envmap;
mod grid;
mod point;
mod projector;
mod spot;
mod sunsky;
mod timed_sunsky;

mod skylight;
mod sun_position;

use std::sync::Arc;

use glam::{Mat3, Vec2, Vec3};

use crate::color::{ColorModel, Rgb, Spectral};
use crate::description::Properties;
use crate::description::declared::{Row, float, motion};
use crate::error::Result;
use crate::family::{self, family};
use crate::interaction::{Interaction, Reference};
use crate::math::{Frame, Moving};
use crate::shape::{Geometry, SurfaceSample};
use crate::texture::{Palettes, Texture};

pub use block::LightSamples;
pub use emission::{Ball, Draw, Emission, Seen, Source};

/// A direction drawn toward a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<S> {
    /// World space, unit length.
    pub direction: Vec3,
    /// Where the light is; `None` where it is infinitely far.
    pub target: Option<Vec3>,
    /// Radiance from there (of a delta light: the irradiance at right angles), not divided by the density.
    pub radiance: S,
    /// Density per solid angle in 1/sr; 1 for a delta light.
    pub pdf: f32,
    /// Whether the light is a point or a direction that no path meets by chance.
    pub delta: bool,
}

/// What every light does.
pub trait Emitter<C: ColorModel>: std::fmt::Debug + Send + Sync {
    /// A direction from `from` toward the light as it stands at that time; `None` where none of its light arrives.
    fn sample(
        &self,
        from: Reference,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>>;

    /// Radiance that leaves the light's surface at `at` toward `at.wi`.
    fn surface_radiance(&self, _at: &Interaction<'_>, _wavelengths: &C::Wavelengths) -> C::Sample {
        C::Sample::zero()
    }
    /// The density with which [`Emitter::sample`] draws the surface point `at` from `from`, at the time of `at`.
    fn surface_pdf(&self, _from: Vec3, _at: &Interaction<'_>) -> f32 {
        0.0
    }

    /// All light that it gives to a scene of this radius, in any unit that is the same for all lights; 0 for
    /// one that cannot be drawn. Which light is drawn goes by it, so that it need not be exact.
    fn power(&self, _color: &C, _radius: f64) -> f64 {
        0.0
    }

    /// The beginning of a path that goes from the light; `None` where none does, or of a light of which none is drawn.
    fn emit(
        &self,
        ball: &Ball,
        draw: &Draw,
        wavelengths: &C::Wavelengths,
    ) -> Option<Emission<'_, C::Sample>> {
        emission::from_afar(self, ball, draw, wavelengths)
    }
    /// The density of such paths where the light is seen: per unit area at right angles and solid angle (where it is a point
    /// or a single direction, without what no path could meet by chance).
    fn emission_density(&self, ball: &Ball, seen: &Seen) -> f32 {
        emission::density_from_afar(ball, seen)
    }
    /// Whether its paths can be drawn.
    fn sends_paths(&self) -> bool {
        true
    }
    /// As [`Emitter::power`]; by it lights are chosen that paths set out from.
    fn emitted_power(&self, color: &C, radius: f64) -> f64 {
        self.power(color, radius)
    }

    /// Whether it comes from nowhere, so that there is no direction to draw.
    fn is_ambient(&self) -> bool {
        false
    }
    /// What an ambient light brings to every point.
    fn ambient_radiance(&self, _wavelengths: &C::Wavelengths) -> C::Sample {
        C::Sample::zero()
    }

    /// Whether it is an environment: what a ray meets that meets nothing.
    fn is_environment(&self) -> bool {
        false
    }
    /// Radiance of the environment from a world direction at `time`.
    fn environment_radiance(
        &self,
        _direction: Vec3,
        _time: f32,
        _wavelengths: &C::Wavelengths,
    ) -> C::Sample {
        C::Sample::zero()
    }
    /// The density with which [`Emitter::sample`] draws an environment's direction at `time`.
    fn environment_pdf(&self, _direction: Vec3, _time: f32) -> f32 {
        0.0
    }
}

/// What lights are built with.
#[derive(Debug)]
pub struct LightContext<'a, C: ColorModel> {
    /// Colours and numbers.
    pub palettes: &'a Palettes<C>,
    /// The shape that an area light stands on.
    pub shape: Option<&'a Arc<Geometry>>,
    /// From the shape's space to the world, where it moves.
    pub motion: Option<&'a Moving>,
}

family! {
    /// Every light there is.
    #[derive(Clone, Debug)]
    pub enum Light<C>: Emitter, context LightContext<'_, C> {
        "ambient" => Ambient(ambient::Ambient<C>),
        "area" => Area(area::Area<C>),
        "constant" => Constant(constant::Constant<C>),
        "directional" => Directional(directional::Directional<C>),
        "directionalarea" => DirectionalArea(directionalarea::DirectionalArea<C>),
        "envmap" => Envmap(envmap::Envmap<C>),
        "point" => Point(point::Point<C>),
        "projector" => Projector(projector::Projector<C>),
        "spot" => Spot(spot::Spot<C>),
        "sunsky" => SunSky(sunsky::SunSky<C>),
        "timed_sunsky" => TimedSunSky(timed_sunsky::TimedSunSky<C>),
    }
}

/// What every light that can be drawn reads.
const SAMPLING: &[Row] = &[float(
    "sampling_weight",
    1.0,
    "how often the light is chosen for light sampling, beside others; 0 is never",
)
.at_least(0.0)];
/// Where a light stands.
const TO_WORLD: Row = motion("to_world", "from the light's space to the world");

/// How often a light is chosen for light sampling, beside others that are alike; at least 0.
pub fn sampling_weight(properties: &Properties<'_>) -> Result<f64> {
    let known = Light::<Rgb>::PLUGINS.iter().copied();
    family::declared(properties, known)?.float("sampling_weight")
}

/// The property `to_world`.
fn to_world(properties: &Properties<'_>) -> Result<Moving> {
    properties.motion("to_world")
}

/// Where the property `to_world` puts the origin, whatever else it does.
#[derive(Clone, Debug)]
enum Origin {
    /// At all times there.
    Still(Vec3),
    /// The origin's image.
    Moving(Moving),
}

impl Origin {
    fn of(properties: &Properties<'_>) -> Result<Self> {
        if properties.animation("to_world")?.is_some() {
            return Ok(Self::Moving(to_world(properties)?));
        }
        let matrix = properties.transform("to_world")?;
        Ok(Self::Still(matrix.w_axis.truncate().as_vec3()))
    }

    #[inline]
    fn at(&self, time: f32) -> Vec3 {
        match self {
            Self::Still(position) => *position,
            Self::Moving(moving) => moving.at(time).translation(),
        }
    }
}

/// The property `to_world` of a light that is infinitely far: a rotation, maybe mirrored.
#[derive(Clone, Debug)]
enum Rotation {
    /// The same at all times.
    Still(Mat3),
    /// A rotation with a scale that does not count.
    Moving(Moving),
}

impl Rotation {
    fn of(properties: &Properties<'_>) -> Result<Self> {
        let moving = to_world(properties)?;
        let mut rotations = moving
            .times()
            .into_iter()
            .map(|time| rotation(moving.at(time).linear()));
        let Some(still) = rotations
            .next()
            .flatten()
            .filter(|_| rotations.all(|r| r.is_some()))
        else {
            return Err(properties
                .error("to_world", "an environment cannot be stretched or sheared")
                .help("leave a rotation"));
        };
        Ok(match moving.is_still() {
            true => Self::Still(still),
            false => Self::Moving(moving),
        })
    }

    #[inline]
    fn at(&self, time: f32) -> Mat3 {
        match self {
            Self::Still(rotation) => *rotation,
            Self::Moving(moving) => {
                let linear = moving.at(time).linear();
                linear * linear.x_axis.length().recip()
            }
        }
    }

    fn is_still(&self) -> bool {
        matches!(self, Self::Still(_))
    }
}

/// The rotation in a linear map that neither stretches nor shears.
fn rotation(linear: Mat3) -> Option<Mat3> {
    let rotation = linear * linear.x_axis.length().recip();
    let product = rotation.transpose() * rotation;
    product
        .abs_diff_eq(Mat3::IDENTITY, 1e-4)
        .then_some(rotation)
}

/// The mean of a path's channels in use.
fn mean_lane<C: ColorModel>(color: &C, sample: C::Sample) -> f64 {
    let unit = color.unit();
    let (mut sum, mut count) = (0.0, 0.0);
    for i in 0..C::Sample::LANES {
        sum += f64::from(sample[i].abs() * unit[i]);
        count += f64::from(unit[i]);
    }
    sum / count
}

/// The mean of a stored colour over its channels, and over enough wavelengths to meet a narrow line.
fn mean_of<C: ColorModel>(color: &C, stored: &C::Stored) -> f64 {
    const SHIFTS: u16 = 64;
    let shift = |i| (f32::from(i) + 0.5) / f32::from(SHIFTS);
    let value = |i| mean_lane(color, C::evaluate(stored, &color.wavelengths(|| shift(i))));
    (0..SHIFTS).map(value).sum::<f64>() / f64::from(SHIFTS)
}

/// The mean of a texture over the unit square.
fn mean_over_square<C: ColorModel>(color: &C, texture: &Texture<C>) -> f64 {
    const SIDE: u16 = 64;
    let wavelengths = color.wavelengths(|| 0.5);
    let along = |i| (f32::from(i) + 0.5) / f32::from(SIDE);
    let points = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| Vec2::new(along(x), along(y))));
    let value = |uv| mean_lane(color, texture.eval(&Interaction::at_uv(uv), &wavelengths));
    points.map(value).sum::<f64>() / f64::from(SIDE).powi(2)
}

/// A point of a shape as a texture sees it.
fn interaction<'s>(shape: &'s Geometry, point: &SurfaceSample) -> Interaction<'s> {
    let normal = match shape {
        Geometry::Mesh(mesh) => mesh.triangle_normal(point.primitive),
        _ => point.normal,
    };
    Interaction {
        primitive: point.primitive,
        barycentric: point.barycentric,
        mesh: shape.mesh(),
        ..texture_point(point.position, normal, shape.uv(point))
    }
}

/// A point of a light as its texture sees it.
fn texture_point(position: Vec3, normal: Vec3, uv: Vec2) -> Interaction<'static> {
    Interaction {
        t: 0.0,
        position,
        error: Vec3::ZERO,
        normal,
        frame: Frame::around(normal),
        uv,
        dp_du: Vec3::ZERO,
        dp_dv: Vec3::ZERO,
        footprint: [Vec2::ZERO; 2],
        wi: Vec3::Z,
        time: 0.0,
        shape: 0,
        primitive: 0,
        mesh: None,
        barycentric: Vec2::ZERO,
    }
}

#[cfg(test)]
mod tests;
