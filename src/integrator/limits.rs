//! What integrators read alike: how long a path may become and whether emitters are hidden. `max_depth` counts
//! edges (1 is emission seen directly, 2 direct light, −1, the default, no limit). From `rr_depth` (5) on roulette
//! lets a path live with probability min(max(throughput)·η², 0.95). With `hide_emitters` (false) the camera looks
//! through surfaces that give light, and sees no surroundings.
//!
//! Every integrator of Mitsuba also reads `block_size`, `samples_per_pass` and `timeout` (seconds). They say how it
//! divides its work, and have no effect here: tiles and passes are fixed, and what ends a render early is
//! `--time-limit`, which says so.

use super::Estimate;
use super::bounce::Decisions;
use crate::color::{ColorModel, Spectra, Spectral as _};
use crate::description::Properties;
use crate::description::declared::{Row, boolean, float, integer};
use crate::error::{Problem, Result};
use crate::lanes::Lanes;
use crate::scene::Scene;

const HIDE_EMITTERS: Row = boolean(
    "hide_emitters",
    false,
    "whether the camera looks through lights",
);
const BLOCK_SIZE: Row = integer("block_size", 0, "how Mitsuba cuts the film").without_effect();
const SAMPLES_PER_PASS: Row =
    integer("samples_per_pass", 0, "how Mitsuba parts samples").without_effect();
const TIMEOUT: Row =
    float("timeout", -1.0, "seconds; --time-limit takes its place").without_effect();
const MAX_DEPTH: Row = integer(
    "max_depth",
    -1,
    "most edges of a path: 1 is emission alone, 2 direct light; −1 no limit",
)
.at_least(-1.0);
const RR_DEPTH: Row =
    integer("rr_depth", 5, "from which depth on roulette ends paths").at_least(1.0);

/// What every integrator that asks for light reads.
pub(super) const COMMON: &[Row] = &[HIDE_EMITTERS, BLOCK_SIZE, SAMPLES_PER_PASS, TIMEOUT];

/// How long paths may become.
pub(super) const LIMITS: &[Row] = &[MAX_DEPTH, RR_DEPTH];

/// The same of those that follow no paths.
pub(super) const NO_DEPTHS: &[Row] = &[MAX_DEPTH.without_effect(), RR_DEPTH.without_effect()];

/// What integrators accept that do not ask for light themselves.
pub(super) const UNUSED: &[Row] = &[
    HIDE_EMITTERS.without_effect(),
    MAX_DEPTH.without_effect(),
    RR_DEPTH.without_effect(),
    BLOCK_SIZE,
    SAMPLES_PER_PASS,
    TIMEOUT,
];

/// The note that `timeout` does not end the render, where the integrator has one.
pub fn timeout_note(properties: &Properties<'_>) -> Result<Option<Problem>> {
    let given: Option<f64> = properties.given("timeout")?;
    let seconds = given.filter(|seconds| *seconds > 0.0);
    Ok(seconds.map(|seconds| {
        let error = properties.error("timeout", "timeout does not end a render here");
        let error = error.help(format!("--time-limit {seconds}s does"));
        error.problems()[0].clone()
    }))
}

/// How long a path may become.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Edges; `u32::MAX` is no limit.
    pub(super) max_depth: u32,
    rr_depth: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_depth: u32::MAX,
            rr_depth: 5,
        }
    }
}

/// The longest life that roulette grants.
const MAX_SURVIVAL: f32 = 0.95;

impl Limits {
    pub(super) fn build(properties: &Properties<'_>) -> Result<Self> {
        let depth = |name| -> Result<u32> {
            Ok(u32::try_from(properties.integer(name)?).unwrap_or(u32::MAX))
        };
        Ok(Self {
            max_depth: depth("max_depth")?,
            rr_depth: depth("rr_depth")?,
        })
    }

    /// What a path comes to that has met nothing yet.
    pub(super) fn start<C: ColorModel>(
        &self,
        scene: &Scene<C>,
        hide_emitters: bool,
    ) -> Estimate<C::Sample> {
        let surrounded = scene.has_environment() && !hide_emitters && self.max_depth > 0;
        Estimate {
            radiance: C::Sample::zero(),
            alpha: if surrounded { 1.0 } else { 0.0 },
        }
    }

    /// Roulette after the bounce at `depth`: the paths that live on, and with which throughputs.
    #[inline(always)]
    pub(super) fn roulette<F: Lanes, S: Spectra<F>>(
        &self,
        depth: u32,
        throughput: S,
        eta: F,
        decision: &Decisions<'_, F>,
    ) -> (F::Mask, S) {
        let lit = !throughput.is_black();
        if !self.plays(depth) {
            return (lit, throughput);
        }
        let survival = survival(throughput, eta);
        let lives = lit & decision.survival().lt(survival);
        (lives, throughput * (F::one() / survival))
    }

    /// Whether roulette follows the bounce at `depth`.
    pub(super) fn plays(&self, depth: u32) -> bool {
        depth.saturating_add(1) >= self.rr_depth
    }
}

/// The probability with which roulette lets paths live.
#[inline(always)]
pub(super) fn survival<F: Lanes, S: Spectra<F>>(throughput: S, eta: F) -> F {
    (throughput.max_value() * eta * eta).min(F::splat(MAX_SURVIVAL))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::color::Rgb;
    use crate::description::{Description, Kind, Options};
    use crate::integrator::{Context, Integrator, Lens};
    use crate::sensor::{Film, Sensor};

    fn integrator(name: &str, inside: &str) -> Description {
        let nested = match name {
            "moment" => "<integrator type='path'/>",
            _ => "",
        };
        let text = format!(
            "<scene version='3.0.0'><integrator type='{name}'>{inside}{nested}</integrator></scene>"
        );
        Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap()
    }

    /// With a sensor that light finds.
    fn context() -> Context {
        let text = "<scene version='3.0.0'><sensor type='perspective'/></scene>";
        let scene = Description::parse(text, Path::new("test.xml"), &Options::default()).unwrap();
        let film = Film::default();
        let sensor = Sensor::build(&scene.root().children(Kind::Sensor)[0], &film).unwrap();
        Context {
            lens: Lens::new(&sensor, &film),
            ..Context::default()
        }
    }

    #[test]
    fn every_integrator_reads_what_mitsuba_s_do() {
        let inside =
            "<boolean name='hide_emitters' value='true'/><float name='timeout' value='30'/>
            <integer name='block_size' value='16'/><integer name='samples_per_pass' value='4'/>";
        for name in Integrator::<Rgb>::NAMES {
            let scene = integrator(name, inside);
            let properties = &scene.root().children(Kind::Integrator)[0];
            Integrator::<Rgb>::build(properties, &context())
                .unwrap_or_else(|e| panic!("{name}: {e}"));
            let note = timeout_note(properties).unwrap().unwrap();
            assert!(note.to_string().contains("timeout does not end"), "{note}");
        }
    }

    #[test]
    fn a_timeout_that_is_none_is_not_worth_a_word() {
        for inside in ["", "<float name='timeout' value='-1'/>"] {
            let scene = integrator("path", inside);
            let properties = &scene.root().children(Kind::Integrator)[0];
            assert_eq!(timeout_note(properties).unwrap(), None);
        }
    }
}
