//! A progress bar on standard error.

use etendue::render::Phase;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::State;

/// Shows the phases of one render after another.
#[derive(Debug)]
pub(super) struct Bar(ProgressBar);

impl Bar {
    /// Nothing is seen where standard error is no terminal.
    pub(super) fn new() -> Self {
        let target = ProgressDrawTarget::stderr_with_hz(5);
        Self(ProgressBar::with_draw_target(Some(0), target))
    }

    pub(super) fn begin(&self, state: &State<'_>) {
        let (verb, template) = match state.phase {
            Phase::Load => ("loading", "{prefix} [{bar:30}] {pos}/{len} shapes"),
            Phase::Build => ("building", "{prefix} {elapsed}"),
            Phase::Render => (
                "rendering",
                "{prefix} [{bar:30}] {percent:>3} % {msg}, {eta} left",
            ),
        };
        self.0.reset();
        self.0.set_length(state.total);
        self.0.set_prefix(format!("{verb} {}", state.name));
        self.0
            .set_style(ProgressStyle::with_template(template).expect("the template is right"));
    }

    pub(super) fn advance(&self, state: &State<'_>) {
        self.0.set_position(state.done);
        let [samples, rays] = state.rates().map(|rate| rate * 1e-6);
        self.0
            .set_message(format!("{samples:.2} M samples/s, {rays:.2} M rays/s"));
    }

    pub(super) fn say(&self, text: &str) {
        self.0.println(text);
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
        self.0.finish_and_clear();
    }
}
