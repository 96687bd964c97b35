//! Progress for programs: one JSON object a line on standard error. `docs/progress.md` says what each event holds.

use std::time::Duration;

use etendue::render::Phase;
use serde_json::{Value, json};

use super::State;
use crate::cli::output;

/// An event of that name, with what else it says.
pub(in super::super) fn emit(name: &str, mut about: Value) {
    about["event"] = name.into();
    output::note(&output::formatted(about).to_string());
}

/// What a phase was that is over.
pub(super) fn over(name: &str, phase: Phase, elapsed: Duration, steps: u64) {
    let seconds = elapsed.as_secs_f64();
    match phase {
        Phase::Load => emit(
            "loaded",
            json!({ "name": name, "seconds": seconds, "shapes": steps }),
        ),
        Phase::Build => emit("built", json!({ "name": name, "seconds": seconds })),
        Phase::Render => {}
    }
}

pub(super) fn advance(state: &State<'_>) {
    let [samples, rays] = state.rates();
    emit(
        "progress",
        json!({
            "name": state.name,
            "phase": match state.phase {
                Phase::Load => "load",
                Phase::Build => "build",
                Phase::Render => "render",
            },
            "done": state.done,
            "total": state.total,
            "percent": 100.0 * state.share(),
            "seconds": state.elapsed.as_secs_f64(),
            "seconds_left": state.left().map(|left| left.as_secs_f64()),
            "samples_per_second": samples,
            "rays_per_second": rays,
        }),
    );
}
