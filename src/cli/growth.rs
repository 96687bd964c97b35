//! A profile as tables on standard output.

use etendue::profile::{
    Comparison, Fit, Growth, Model, Point, Profile, Quantity, Series, median, median_interval,
};
use etendue::render::human_duration;
use std::time::Duration;

use super::output::line;

/// Prints all of it: the answer, series, fits, what trees and threads bring, verdicts, and what changed.
pub(super) fn print(profile: &Profile, comparison: Option<&Comparison>) {
    if let Some(answer) = profile.answer() {
        line(&answer);
    }
    line(&format!(
        "{} on {}: {} rounds in {}",
        profile.subject,
        profile.machine,
        profile.rounds,
        human_duration(Duration::from_secs_f64(profile.seconds))
    ));
    for series in &profile.series {
        self::series(series);
    }
    verdicts(profile);
    if let Some(comparison) = comparison {
        changes(comparison);
    }
    for note in &profile.notes {
        line(&format!("note: {note}"));
    }
    facts(profile);
}

fn series(series: &Series) {
    line("");
    line(&format!("{}  ({})", series.title(), series.axis.label()));
    let names = [
        "rays",
        "steps/ray",
        "tests/ray",
        "shaded",
        "load s",
        "build s",
        "render s",
        "± %",
        "trace",
        "shade",
        "film",
    ];
    let head: String = names.iter().map(|name| format!("{name:>11}")).collect();
    line(&format!("{:>10}{head}", series.axis.name()));
    for point in &series.points {
        line(&row(point));
    }
    for growth in &series.fits {
        line(&format!("  {}", self::growth(series, growth)));
    }
}

fn row(point: &Point) -> String {
    let stats = &point.stats;
    let rays = stats.rays().max(1) as f64;
    let middle = |quantity: Quantity| median(&quantity.of(point));
    let renders = Quantity::Render.of(point);
    let [low, high] = median_interval(&renders);
    let render = median(&renders);
    // Parts of the threads' time.
    let phases = [Quantity::Trace, Quantity::Shade, Quantity::Film].map(middle);
    let all: f64 = phases.iter().sum();
    let part = |phase: f64| format!("{:.0} %", 100.0 * phase / all.max(1e-12));
    let cells = [
        stats.rays().to_string(),
        format!("{:.3}", stats.tracing.node_steps as f64 / rays),
        format!("{:.3}", stats.tracing.primitive_tests as f64 / rays),
        stats.shaded.to_string(),
        format!("{:.4}", middle(Quantity::Load)),
        format!("{:.4}", middle(Quantity::Build)),
        format!("{render:.5}"),
        format!("{:.1}", 50.0 * (high - low) / render),
        part(phases[0]),
        part(phases[1]),
        part(phases[2]),
    ];
    let cells: String = cells.iter().map(|cell| format!("{cell:>11}")).collect();
    format!("{:>10}{cells}", point.x)
}

fn growth(series: &Series, growth: &Growth) -> String {
    let Fit {
        model,
        a,
        b,
        interval: [low, high],
        held_out,
    } = growth.fit;
    let axis = series.axis.name();
    let law = match model {
        Model::Power => format!("{a:.3e} · {axis}^{b:.3} [{low:.3}, {high:.3}]"),
        Model::Logarithm => format!("{a:.3} + {b:.3} [{low:.3}, {high:.3}] · log2 {axis}"),
        Model::Line => format!("{a:.3e} + {b:.3e} [{low:.2e}, {high:.2e}] · {axis}"),
    };
    let predicted = held_out.map_or(String::new(), |off| {
        format!("; largest predicted to {:+.1} %", 100.0 * off)
    });
    let from = if growth.from > 0.0 {
        format!(" from {}", growth.from)
    } else {
        String::new()
    };
    format!("{:18} ≈ {law}{predicted}{from}", growth.quantity.name())
}

fn facts(profile: &Profile) {
    line("");
    for fact in profile.facts() {
        line(&fact);
    }
    if let Some(warning) = profile.noise.warning() {
        line(&format!("warning: {warning}; times are not judged"));
    }
}

fn verdicts(profile: &Profile) {
    line("");
    for verdict in &profile.verdicts {
        line(&format!(
            "{:17} {}: {}; {}",
            verdict.outcome.name(),
            verdict.subject,
            verdict.predicted,
            verdict.measured
        ));
    }
}

fn changes(comparison: &Comparison) {
    line("");
    line(&format!(
        "since version {}: {}",
        comparison.version,
        comparison.summary()
    ));
    for change in &comparison.changes {
        let [low, high] = change.interval;
        line(&format!(
            "  {} · {} at {}: {} × {:.4} [{low:.4}, {high:.4}]",
            change.axis,
            change.way.name(),
            change.place(),
            change.quantity.bare_name(),
            change.ratio
        ));
    }
}
