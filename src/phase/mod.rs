//! Phase functions: how light is scattered at a point of a medium. Directions are in world space: `wi` points to where
//! the path came from, `wo` to where it goes on, so that light that goes straight on has `wo` = −`wi`. A phase function
//! is a density per solid angle, drawn exactly: what a path carries does not change.

mod blendphase;
mod hg;
mod isotropic;
mod rayleigh;
mod sggx;
mod tabphase;

use crate::color::Mono;
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::family::family;
use crate::lanes::{Call, Frame, Lanes, Vec2, Vec3, sin_cos_turns};
use crate::texture::Palette;

/// What every phase function does.
pub trait Scatter: std::fmt::Debug + Send + Sync {
    /// Whether how much is scattered depends on where the light comes from, as among flakes: see
    /// [`Phase::projected_area`].
    fn has_flakes(&self) -> bool {
        false
    }
    /// A number that [`Phase::projected_area`] does not exceed.
    fn most_area(&self) -> f32 {
        1.0
    }
}

/// Directions drawn from a phase function.
#[derive(Clone, Copy, Debug)]
pub struct PhaseSamples<F> {
    /// World space, unit length.
    pub wo: Vec3<F>,
    /// Density per solid angle in 1/sr, which is the phase function's value too; 0 where none was drawn.
    pub pdf: F,
}

/// A phase function in lanes; all methods must be `#[inline(always)]`.
trait BlockPhase {
    /// The value for pairs of directions at places in the world, which is the density with which `wo` is drawn, in 1/sr.
    fn eval_lanes<F: Lanes>(&self, at: Vec3<F>, wi: Vec3<F>, wo: Vec3<F>) -> F;

    /// Draws directions: `u1` chooses the part, `u2` the direction.
    fn sample_lanes<F: Lanes>(
        &self,
        at: Vec3<F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
    ) -> PhaseSamples<F>;

    /// See [`Phase::projected_area`].
    #[inline(always)]
    fn projected_area<F: Lanes>(&self, _at: Vec3<F>, _wi: Vec3<F>) -> F {
        F::one()
    }
}

family! {
    /// Every phase function there is.
    #[derive(Clone, Debug)]
    pub enum Phase: Scatter, context Palette<Mono>, visitor Visitor {
        "blendphase" => Blend(blendphase::BlendPhase),
        "hg" => Hg(hg::Hg),
        "isotropic" => Isotropic(isotropic::Isotropic),
        "rayleigh" => Rayleigh(rayleigh::Rayleigh),
        "sggx" => Sggx(sggx::Sggx),
        "tabphase" => Tab(tabphase::TabPhase),
    }
}

impl Default for Phase {
    /// Mitsuba's: the same in all directions.
    fn default() -> Self {
        Self::Isotropic(isotropic::Isotropic)
    }
}

/// Something to be asked of whichever phase function it is. `visit` must be `#[inline(always)]`.
trait Visitor {
    type Output;

    fn visit<P: BlockPhase>(self, phase: &P) -> Self::Output;
}

/// Asks a phase function in a function that knows the instructions.
struct Ask<'a, V>(&'a Phase, V);

impl<F: Lanes, V: Visitor> Call<F> for Ask<'_, V> {
    type Output = V::Output;

    #[inline(always)]
    fn run(self) -> V::Output {
        self.0.visit(self.1)
    }
}

/// See [`BlockPhase::eval_lanes`].
struct Eval<F>(Vec3<F>, Vec3<F>, Vec3<F>);

impl<F: Lanes> Visitor for Eval<F> {
    type Output = F;

    #[inline(always)]
    fn visit<P: BlockPhase>(self, phase: &P) -> F {
        phase.eval_lanes(self.0, self.1, self.2)
    }
}

/// See [`BlockPhase::sample_lanes`].
struct Draw<F>(Vec3<F>, Vec3<F>, F, Vec2<F>);

impl<F: Lanes> Visitor for Draw<F> {
    type Output = PhaseSamples<F>;

    #[inline(always)]
    fn visit<P: BlockPhase>(self, phase: &P) -> PhaseSamples<F> {
        phase.sample_lanes(self.0, self.1, self.2, self.3)
    }
}

/// See [`Phase::projected_area`].
struct Area<F>(Vec3<F>, Vec3<F>);

impl<F: Lanes> Visitor for Area<F> {
    type Output = F;

    #[inline(always)]
    fn visit<P: BlockPhase>(self, phase: &P) -> F {
        phase.projected_area(self.0, self.1)
    }
}

impl Phase {
    /// The value for pairs of directions at places in the world, which is the density with which `wo` is drawn, in 1/sr.
    #[inline(always)]
    pub fn eval_lanes<F: Lanes>(&self, at: Vec3<F>, wi: Vec3<F>, wo: Vec3<F>) -> F {
        F::call(Ask(self, Eval(at, wi, wo)))
    }

    /// Draws directions: `u1` chooses the part, `u2` the direction.
    #[inline(always)]
    pub fn sample_lanes<F: Lanes>(
        &self,
        at: Vec3<F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
    ) -> PhaseSamples<F> {
        F::call(Ask(self, Draw(at, wi, u1, u2)))
    }

    /// What extinction is multiplied by for light along `wi`: the area that flakes show to it; 1 without flakes.
    #[inline(always)]
    pub fn projected_area<F: Lanes>(&self, at: Vec3<F>, wi: Vec3<F>) -> F {
        if !self.has_flakes() {
            return F::one();
        }
        F::call(Ask(self, Area(at, wi)))
    }

    /// The phase functions nested in a plugin, by the order of their names.
    fn nested(properties: &Properties<'_>, numbers: &Palette<Mono>) -> Result<Vec<Self>> {
        let children = properties.children(Kind::Phase);
        children
            .iter()
            .map(|child| Self::build(child, numbers))
            .collect()
    }
}

/// Directions around those in which light goes on, −`wi`, by the cosine of the angle and a share of a turn.
#[inline(always)]
fn around<F: Lanes>(wi: Vec3<F>, cosine: F, turn: F) -> Vec3<F> {
    let sine = (F::one() - cosine * cosine).max(F::zero()).sqrt();
    let (sin, cos) = sin_cos_turns(turn);
    Frame::around(-wi).to_world(Vec3::new(sine * cos, sine * sin, cosine))
}

#[cfg(test)]
mod tests;
