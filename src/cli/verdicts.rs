//! What crosschecks came to: a paragraph or a JSON object for each scene, a table of all, and the exit status.

use etendue::budget::human_bytes;
use etendue::compare::map::robust_top;
use etendue::compare::seeds::{PlacesTest, Verdict};
use etendue::crosscheck::{Cost, Crosscheck, Failure, Pictures};
use etendue::image::Encoding;
use serde_json::{Value, json};

use super::page::{Pair, Scene};
use super::{output, status};

/// How much is told, and what counts as agreement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style {
    pub(super) quiet: bool,
    pub(super) json: bool,
    /// The widest interval around the bias of images that agree, as a part of the mean.
    pub(super) precision: f64,
}

/// What became of a scene.
#[derive(Debug)]
pub(super) struct Ending {
    kind: Kind,
    result: Result<Crosscheck, Failure>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Agree,
    Differ,
    TooNoisy,
    Timed,
    NotComparable,
    Failed,
    Stopped,
}

impl Kind {
    fn of(result: &Result<Crosscheck, Failure>, precision: f64) -> Self {
        match result {
            Err(Failure::NotComparable(_)) => Self::NotComparable,
            Err(Failure::Stopped) => Self::Stopped,
            Err(_) => Self::Failed,
            Ok(Crosscheck { verdict: None, .. }) => Self::Timed,
            Ok(Crosscheck {
                verdict: Some(verdict),
                ..
            }) if !verdict.agrees => Self::Differ,
            Ok(Crosscheck {
                verdict: Some(verdict),
                ..
            }) if verdict.means[0].half_width > precision => Self::TooNoisy,
            Ok(_) => Self::Agree,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Agree => "agree",
            Self::Differ => "differ",
            Self::TooNoisy => "too noisy to say",
            Self::Timed => "timed",
            Self::NotComparable => "not comparable",
            Self::Failed => "failed",
            Self::Stopped => "stopped",
        }
    }
}

impl Ending {
    pub(super) fn of(result: Result<Crosscheck, Failure>, style: Style) -> Self {
        Self {
            kind: Kind::of(&result, style.precision),
            result,
        }
    }

    /// The scene as a page shows it.
    pub(super) fn on_page<'a>(&'a self, name: &'a str) -> Scene<'a> {
        let status = self.kind.name();
        match &self.result {
            Err(failure) => Scene {
                name,
                status,
                lines: vec![("why".to_owned(), failure.to_string())],
                pair: None,
            },
            Ok(crosscheck) => {
                let lines = lines(crosscheck).into_iter();
                Scene {
                    name,
                    status,
                    lines: lines
                        .map(|(label, text)| (label.to_owned(), text))
                        .collect(),
                    pair: crosscheck.pictures.as_ref().map(pair),
                }
            }
        }
    }

    /// Whether no other scene can fare better.
    pub(super) fn is_hopeless(&self) -> bool {
        matches!(self.result, Err(Failure::NoMitsuba(_) | Failure::Stopped))
    }
}

/// Both sides' mean images.
fn pair(pictures: &Pictures) -> Pair<'_> {
    Pair {
        reference: &pictures.reference,
        other: &pictures.ours,
        encoding: Encoding::Linear,
        rgb: pictures.reference.rgb(),
        distance: &pictures.standard_errors,
        label: "standard errors apart",
        top: robust_top(&pictures.standard_errors),
        brighter: &pictures.brighter,
    }
}

/// Tells of one scene.
pub(super) fn tell(style: Style, scene: &str, ending: &Ending) {
    if style.json {
        return output::object(object(scene, ending));
    }
    if style.quiet && matches!(ending.kind, Kind::Agree | Kind::Timed) {
        return;
    }
    let name = ending.kind.name();
    match &ending.result {
        Err(failure) => {
            output::line(&format!("{scene}: {name}: {failure}"));
            if let Some(help) = failure.help() {
                output::line(&format!("  {:9} {help}", "help"));
            }
        }
        Ok(crosscheck) => {
            let Crosscheck { seeds, spp, .. } = crosscheck;
            output::line(&format!(
                "{scene}: {name} ({seeds} seeds of {spp} samples a side)"
            ));
            for (label, text) in lines(crosscheck) {
                output::line(&format!("  {label:9} {text}"));
            }
        }
    }
}

fn object(scene: &str, ending: &Ending) -> Value {
    let mut object = match &ending.result {
        Ok(crosscheck) => {
            serde_json::to_value(crosscheck).expect("a crosscheck has only names and numbers")
        }
        Err(failure) => json!({ "reason": failure.to_string(), "help": failure.help() }),
    };
    object["scene"] = scene.into();
    object["status"] = ending.kind.name().into();
    object
}

/// What is said of a scene, with labels.
fn lines(crosscheck: &Crosscheck) -> Vec<(&'static str, String)> {
    let Crosscheck {
        etendue, mitsuba, ..
    } = crosscheck;
    let mut lines = Vec::new();
    if let Some(verdict) = &crosscheck.verdict {
        lines.extend(judged(verdict, "Étendue"));
    }
    lines.push((
        "time",
        format!(
            "{}{:.3} s here, {:.3} s in Mitsuba",
            takes(crosscheck.seconds_ratio),
            etendue.seconds(),
            mitsuba.seconds(),
        ),
    ));
    if let Some((ours, theirs)) = etendue.cpu().zip(mitsuba.cpu()) {
        let takes = takes(crosscheck.cpu_ratio);
        lines.push((
            "CPU time",
            format!("{takes}{ours:.3} s here, {theirs:.3} s in Mitsuba"),
        ));
    }
    lines.push((
        "loading",
        format!(
            "{:.3} s here, {:.3} s in Mitsuba",
            etendue.load.seconds, mitsuba.load.seconds
        ),
    ));
    if let Some((ours, theirs)) = etendue.peak_memory.zip(mitsuba.peak_memory) {
        let [ours, theirs] = [ours, theirs].map(human_bytes);
        lines.push(("memory", format!("{ours} here, {theirs} in Mitsuba")));
    }
    lines.extend(crosscheck.notes.iter().map(|note| ("note", note.clone())));
    lines.push(("python", crosscheck.python.clone()));
    lines
}

/// The ratio of Mitsuba's time to ours in words, before the times themselves.
fn takes(ratio: Option<f64>) -> String {
    match ratio {
        None => String::new(),
        Some(ratio) if ratio >= 1.0 => format!("takes {ratio:.1} times as long in Mitsuba: "),
        Some(ratio) => format!("takes {:.1} times as long here: ", 1.0 / ratio),
    }
}

/// What is said of two sides; `other` names the second.
pub(super) fn judged(verdict: &Verdict, other: &str) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    let biases = verdict.means.iter().map(|mean| {
        let half_width = 100.0 * mean.half_width;
        let trust = if mean.agrees {
            "which may be chance"
        } else {
            "which is no chance"
        };
        let words = mean.in_words(other);
        format!("{words} (± {half_width:.3} %, {trust})")
    });
    lines.push(("mean", biases.collect::<Vec<_>>().join(", ")));
    for (label, test) in [("tiles", &verdict.tiles), ("pixels", &verdict.pixels)] {
        lines.push((label, places(test)));
    }
    let ratio = verdict.noise.ratio;
    lines.push((
        "noise",
        format!("pixels differ {ratio:.2} times as much as seeds among themselves (relMSE)"),
    ));
    lines
}

fn places(test: &PlacesTest) -> String {
    let PlacesTest {
        tests,
        differing,
        worst,
        ..
    } = test;
    let place = format!("at {}, {} in {}", worst.x, worst.y, worst.channel);
    let part = match worst.a {
        0.0 => format!("{:+.2e}", worst.difference),
        a => format!("{:+.2} %", 100.0 * worst.difference / a.abs()),
    };
    let differing = match differing {
        0 => "none".to_owned(),
        n => n.to_string(),
    };
    format!(
        "{differing} of {tests} differ; most: {part} {place}, {:+.1} standard errors",
        worst.t
    )
}

/// All scenes at a glance; JSON has had its object for each.
pub(super) fn table(style: Style, endings: &[(String, Ending)]) {
    if style.json {
        return;
    }
    let mut rows = vec![HEADS.map(str::to_owned)];
    rows.extend(endings.iter().map(|(scene, ending)| row(scene, ending)));
    let mut widths = [0; HEADS.len()];
    for (width, column) in widths.iter_mut().zip(0..) {
        *width = rows
            .iter()
            .map(|r| r[column].chars().count())
            .max()
            .unwrap_or(0);
    }
    output::line("");
    for row in &rows {
        let cell = |(i, text): (usize, &String)| match i {
            0 | 1 => format!("{text:<width$}", width = widths[i]),
            _ => format!("{text:>width$}", width = widths[i]),
        };
        let cells: Vec<String> = row.iter().enumerate().map(cell).collect();
        output::line(cells.join("  ").trim_end());
    }
}

const HEADS: [&str; 11] = [
    "scene",
    "verdict",
    "bias %",
    "± %",
    "relMSE",
    "s",
    "s Mitsuba",
    "ratio",
    "CPU ratio",
    "memory",
    "Mitsuba",
];

fn row(scene: &str, ending: &Ending) -> [String; HEADS.len()] {
    let mut row = [const { String::new() }; HEADS.len()];
    row[0] = scene.to_owned();
    row[1] = ending.kind.name().to_owned();
    let Ok(crosscheck) = &ending.result else {
        return row;
    };
    if let Some(Verdict { means, noise, .. }) = &crosscheck.verdict {
        row[2] = format!("{:+.3}", 100.0 * means[0].difference);
        row[3] = format!("{:.3}", 100.0 * means[0].half_width);
        row[4] = format!("{:.2}", noise.ratio);
    }
    let [ours, theirs] = [&crosscheck.etendue, &crosscheck.mitsuba];
    let ratio = |ratio: Option<f64>| ratio.map_or(String::new(), |r| format!("{r:.2}"));
    let memory = |cost: &Cost| cost.peak_memory.map_or(String::new(), human_bytes);
    row[5] = format!("{:.2}", ours.seconds());
    row[6] = format!("{:.2}", theirs.seconds());
    row[7] = ratio(crosscheck.seconds_ratio);
    row[8] = ratio(crosscheck.cpu_ratio);
    row[9] = memory(ours);
    row[10] = memory(theirs);
    row
}

/// The exit status: a difference weighs more than what could not be compared.
pub(super) fn status(endings: &[(String, Ending)]) -> u8 {
    let has = |kinds: &[Kind]| endings.iter().any(|(_, e)| kinds.contains(&e.kind));
    if has(&[Kind::Differ]) {
        status::DIFFERS
    } else if has(&[
        Kind::TooNoisy,
        Kind::NotComparable,
        Kind::Failed,
        Kind::Stopped,
    ]) {
        status::CANNOT_COMPARE
    } else {
        status::DONE
    }
}
