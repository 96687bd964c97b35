//! What a series of images came to, told as the arguments ask: a line or a JSON object for each image, a
//! table of all, and the exit status.

use std::path::Path;
use std::time::Duration;

use etendue::error::Error;
use etendue::render::{Report, human_duration};
use serde_json::{Value, json};

use super::images::Item;
use super::{output, report, status};

/// How much is told.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style {
    pub(super) quiet: bool,
    pub(super) json: bool,
    pub(super) stats: bool,
}

/// What became of an image.
#[derive(Debug)]
pub(super) enum Ending {
    Rendered(Report),
    /// Written as far as it was when a signal came.
    Interrupted(Report),
    /// Written as far as it was when its time was over.
    TimeLimit(Report),
    /// It was there.
    Skipped,
    /// A signal came before any of it was complete.
    NotBegun,
    Failed(Error),
}

impl Ending {
    fn name(&self) -> &'static str {
        match self {
            Self::Rendered(_) => "rendered",
            Self::Interrupted(_) => "interrupted",
            Self::TimeLimit(_) => "time limit",
            Self::Skipped => "skipped",
            Self::NotBegun => "not begun",
            Self::Failed(_) => "failed",
        }
    }

    fn report(&self) -> Option<&Report> {
        match self {
            Self::Rendered(report) | Self::Interrupted(report) | Self::TimeLimit(report) => {
                Some(report)
            }
            _ => None,
        }
    }
}

/// How many samples a pixel has, in words.
pub(super) fn samples(spp: u32) -> String {
    format!("{spp} sample{} a pixel", if spp == 1 { "" } else { "s" })
}

/// The warning that an image is not whole.
pub(super) fn incomplete(item: &Item, report: &Report) -> Error {
    let completed = &report.completed;
    let ([passes, of_passes], [tiles, of_tiles]) = (completed.passes, completed.units);
    let mut message = format!(
        "{} is not whole: {passes} of {of_passes} passes ({tiles} of {of_tiles} tiles) are done, {} of {}",
        item.output.display(),
        completed.samples,
        samples(report.spp)
    );
    if passes == 0 {
        message += "; where no tile is done it is black";
    }
    Error::input(message)
}

/// The warning that a part is not there, for it was stopped.
pub(super) fn lost(item: &Item, report: &Report) -> Error {
    let [tiles, of_tiles] = report.completed.units;
    Error::input(format!(
        "{} is not written: {tiles} of {of_tiles} tiles were done, and a part is whole or not there",
        item.output.display()
    ))
}

/// Tells of one image.
pub(super) fn tell(style: Style, item: &Item, ending: &Ending, total: Duration) {
    if style.json {
        return output::object(object(item, ending, total));
    }
    let Some(report) = ending.report() else {
        return;
    };
    if !style.quiet {
        line(&item.output, report, total);
    }
    if style.stats {
        stats(report);
    }
}

/// Tells of an input whose sensors could not be found out, so that none of its images is known.
pub(super) fn tell_unread(style: Style, input: &str, error: &Error) {
    if style.json {
        output::object(json!({
            "status": "failed",
            "input": input,
            "problems": report::json(error.problems()),
        }));
    }
}

/// What became of an image, for programs.
pub(super) fn object(item: &Item, ending: &Ending, total: Duration) -> Value {
    let mut object = match ending.report() {
        Some(report) => serde_json::to_value(report).expect("a report has only names and numbers"),
        None => json!({}),
    };
    object["status"] = ending.name().into();
    object["input"] = item.input.display().to_string().into();
    object["output"] = item.output.display().to_string().into();
    if let Some(frame) = item.frame {
        object["frame"] = frame.into();
    }
    object["sensor"] = item.sensor.into();
    if let Ending::Failed(error) = ending {
        object["problems"] = report::json(error.problems());
    }
    if ending.report().is_some() {
        object["seconds"]["total"] = total.as_secs_f64().into();
    }
    object
}

fn line(path: &Path, report: &Report, total: Duration) {
    let [width, height] = report.size;
    let several = |mean: f64, [least, most]: [u32; 2], at_limit: f64| {
        let mut taken = format!("{mean:.1} samples a pixel, {least} to {most}");
        if at_limit > 0.0 {
            taken += &format!(" ({:.1} % have all of them)", 100.0 * at_limit);
        }
        taken
    };
    let taken = match (&report.adaptive, &report.foveated) {
        (Some(adaptive), _) => several(adaptive.mean_spp, adaptive.limits, adaptive.at_limit),
        (None, Some(foveated)) => several(foveated.mean_spp, foveated.limits, foveated.at_limit),
        (None, None) => match &report.passes {
            None => samples(report.completed.samples),
            Some(passes) => format!("passes {}:{}", passes.start, passes.end),
        },
    };
    output::line(&format!(
        "{}: {width}×{height}, {taken}, {}",
        path.display(),
        human_duration(total)
    ));
}

/// What was counted and timed.
fn stats(report: &Report) {
    let stats = &report.stats;
    let rays = stats.rays().max(1) as f64;
    let rate = rays / report.seconds.render.max(1e-9) * 1e-6;
    let share = |seconds: f64| {
        let all = report.seconds;
        let all = all.closest + all.occluded + all.shade + all.film;
        format!("{seconds:.3} ({:.0} %)", 100.0 * seconds / all.max(1e-9))
    };
    let each = |counts: u64, rays: u64| counts as f64 / rays.max(1) as f64;
    let (all, shadow) = (stats.tracing, stats.shadow_tracing);
    let others = stats.camera_rays + stats.bounce_rays;
    let megabytes = |bytes: usize| bytes as f64 * 1e-6;
    let [geometry, trees] = report.bytes.map(megabytes);
    let kept = report.cache.as_ref().map(|cache| {
        let value = format!("{} read, {} written", cache.read, cache.written);
        ("trees kept", value)
    });
    let rows = [
        ("primitives", report.primitives.to_string()),
        ("lights", report.lights.to_string()),
        (
            "geometry, trees",
            format!("{geometry:.1} MB, {trees:.1} MB"),
        ),
        ("camera rays", stats.camera_rays.to_string()),
        ("bounce rays", stats.bounce_rays.to_string()),
        ("shadow rays", stats.shadow_rays.to_string()),
        ("points shaded", stats.shaded.to_string()),
        (
            "node steps a ray",
            format!(
                "{:.2} (shadow rays {:.2}, others {:.2})",
                each(all.node_steps, stats.rays()),
                each(shadow.node_steps, stats.shadow_rays),
                each(all.node_steps - shadow.node_steps, others)
            ),
        ),
        (
            "primitive tests a ray",
            format!(
                "{:.2} (shadow rays {:.2}, others {:.2})",
                each(all.primitive_tests, stats.rays()),
                each(shadow.primitive_tests, stats.shadow_rays),
                each(all.primitive_tests - shadow.primitive_tests, others)
            ),
        ),
        ("seconds to load", format!("{:.3}", report.seconds.load)),
        ("seconds to build", format!("{:.3}", report.seconds.build)),
        (
            "seconds to render",
            format!("{:.3} ({rate:.2} M rays/s)", report.seconds.render),
        ),
        ("thread seconds: trace", share(report.seconds.closest)),
        (
            "                shadow rays",
            share(report.seconds.occluded),
        ),
        ("                shade", share(report.seconds.shade)),
        ("                film", share(report.seconds.film)),
    ];
    for (name, value) in rows.into_iter().chain(kept) {
        output::line(&format!("  {name:27} {value}"));
    }
}

/// All images at a glance; JSON has had its object for each.
pub(super) fn table(style: Style, endings: &[(String, Ending)]) {
    if style.quiet || style.json {
        return;
    }
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for (_, ending) in endings {
        match counts.iter_mut().find(|(name, _)| *name == ending.name()) {
            Some((_, count)) => *count += 1,
            None => counts.push((ending.name(), 1)),
        }
    }
    let counts: Vec<String> = counts
        .iter()
        .map(|(name, n)| format!("{n} {name}"))
        .collect();
    output::line(&format!("{} images: {}", endings.len(), counts.join(", ")));
    for (name, ending) in endings {
        let why = match ending {
            Ending::Rendered(_) => continue,
            Ending::Failed(error) => error.problems()[0].to_string(),
            _ => String::new(),
        };
        let line = format!("  {:11} {name}  {why}", ending.name());
        output::line(line.trim_end());
    }
}

/// The exit status: an interruption's, else the gravest.
pub(super) fn status(endings: &[(String, Ending)], signalled: bool) -> u8 {
    if signalled {
        return status::INTERRUPTED;
    }
    let of = |(_, ending): &(String, Ending)| match ending {
        Ending::Failed(error) => status::of(error),
        _ => status::DONE,
    };
    endings.iter().map(of).max().unwrap_or(status::DONE)
}
