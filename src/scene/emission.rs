//! Paths that set out from a scene's lights: which light, and how densely.

use glam::Vec3;

use super::{LightId, Scene};
use crate::color::ColorModel;
use crate::light::{Ball, Draw, Emission, Seen};

impl<C: ColorModel> Scene<C> {
    /// A ball around all shapes that have an end.
    pub fn ball(&self) -> Ball {
        Ball::around(self.tracer.bounds())
    }

    /// The beginning of a path from one of the lights, which `u` in [0, 1) chooses. Density and flux include the choice.
    pub fn emit(
        &self,
        ball: &Ball,
        u: f32,
        draw: &Draw,
        w: &C::Wavelengths,
    ) -> Option<(LightId, Emission<'_, C::Sample>)> {
        let id = LightId(self.departures.sample::<f32>(u)?.0);
        let mut emission = self.light(id).emit(ball, draw, w)?;
        let probability = self.departures.probability(id);
        emission.flux = emission.flux * probability.recip();
        emission.density *= probability;
        Some((id, emission))
    }

    /// The density with which [`Scene::sample_lights`] draws the place that a path has set out from, from where it has come
    /// to.
    pub fn emission_pdf(
        &self,
        id: LightId,
        emission: &Emission<'_, C::Sample>,
        from: Vec3,
        time: f32,
    ) -> f32 {
        self.choice.probability(id) * self.light(id).emission_pdf(emission, from, time)
    }

    /// The density of paths from a light where that is seen; `seen.pdf` includes the choice for light sampling.
    pub fn emission_density(&self, ball: &Ball, id: LightId, seen: &Seen) -> f32 {
        let chosen = self.choice.probability(id);
        if chosen <= 0.0 {
            return 0.0;
        }
        let own = Seen {
            pdf: seen.pdf / chosen,
            ..*seen
        };
        self.departures.probability(id) * self.light(id).emission_density(ball, &own)
    }
}
