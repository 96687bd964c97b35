//! What was measured, as tables and as JSON.

use std::fs;
use std::path::Path;

use serde::Serialize;

use crate::measure::{median, thread_counts};

#[derive(Default, Serialize)]
pub(crate) struct Report {
    pub(crate) meshes: Vec<MeshReport>,
    pub(crate) watertight: Option<Misses>,
}

#[derive(Serialize)]
pub(crate) struct MeshReport {
    pub(crate) name: &'static str,
    /// What it is made of.
    pub(crate) primitives: &'static str,
    pub(crate) triangles: usize,
    /// In each set.
    pub(crate) rays: usize,
    pub(crate) rounds: u32,
    pub(crate) builds: Vec<BuildRow>,
    pub(crate) sets: Vec<SetReport>,
    /// What two threads gain over one at arithmetic; not a number where there is one.
    pub(crate) arithmetic_gain: f64,
}

#[derive(Serialize)]
pub(crate) struct BuildRow {
    pub(crate) name: &'static str,
    pub(crate) seconds: Vec<BuildTime>,
    /// Held beside the mesh's own arrays.
    pub(crate) bytes: usize,
}

#[derive(Serialize)]
pub(crate) struct BuildTime {
    pub(crate) threads: usize,
    /// Seconds, of several builds where they are short.
    pub(crate) median: f64,
}

#[derive(Serialize)]
pub(crate) struct SetReport {
    pub(crate) name: &'static str,
    /// The share of rays that hit.
    pub(crate) hit: f64,
    /// What ratios are to.
    pub(crate) reference: String,
    pub(crate) rows: Vec<Row>,
}

#[derive(Serialize)]
pub(crate) struct Row {
    pub(crate) name: String,
    pub(crate) speeds: Vec<Speed>,
    /// What two threads gain over one.
    pub(crate) gain: Option<Ratio>,
    pub(crate) differences: Differences,
}

#[derive(Serialize)]
pub(crate) struct Speed {
    pub(crate) threads: usize,
    /// By the median round.
    pub(crate) million_rays_per_second: f64,
    /// To the reference: 2 is twice as fast.
    pub(crate) ratio: Ratio,
}

/// Rays on which a tracer and Étendue do not agree.
#[derive(Default, Serialize)]
pub(crate) struct Differences {
    /// One hits, the other misses.
    pub(crate) hit_or_miss: usize,
    /// Both hit, at distances that differ by more than a ten thousandth.
    pub(crate) distance: usize,
}

/// How many times as fast.
#[derive(Serialize)]
pub(crate) struct Ratio {
    /// Of the medians.
    pub(crate) median: f64,
    /// Of one round.
    pub(crate) least: f64,
    /// Of one round.
    pub(crate) greatest: f64,
}

impl Ratio {
    /// `before` and `after` are seconds, round by round.
    pub(crate) fn of(before: &[f64], after: &[f64]) -> Self {
        let rounds: Vec<f64> = before.iter().zip(after).map(|(b, a)| b / a).collect();
        Self {
            median: median(&rounds),
            least: rounds.iter().copied().fold(f64::INFINITY, f64::min),
            greatest: rounds.iter().copied().fold(0.0, f64::max),
        }
    }

    fn text(&self) -> String {
        format!(
            "{:.2} ({:.2}–{:.2})",
            self.median, self.least, self.greatest
        )
    }
}

#[derive(Serialize)]
pub(crate) struct Misses {
    pub(crate) triangles: usize,
    /// At vertices, and as many at edges.
    pub(crate) rays: usize,
    pub(crate) rows: Vec<MissesRow>,
}

#[derive(Serialize)]
pub(crate) struct MissesRow {
    pub(crate) name: String,
    pub(crate) vertices: usize,
    pub(crate) edges: usize,
}

impl Report {
    pub(crate) fn write(&self, path: &Path) -> Result<(), String> {
        let json = serde_json::to_string_pretty(self).expect("the report is plain data");
        fs::write(path, json + "\n").map_err(|e| format!("cannot write {}: {e}", path.display()))
    }
}

const NAME: usize = 20;
/// What two threads gain at arithmetic where they have two cores for themselves, and a little less.
const QUIET: f64 = 1.8;

pub(crate) fn print_mesh(mesh: &MeshReport) {
    let count = mesh.triangles as f64;
    println!(
        "\n== {}: {:.0} k {}, {} rounds",
        mesh.name,
        count / 1e3,
        mesh.primitives,
        mesh.rounds
    );
    let gain = mesh.arithmetic_gain;
    if gain.is_finite() {
        println!("   two threads gain {gain:.2}× at arithmetic");
    }
    if gain < QUIET {
        println!("   which is little: others keep the machine busy, and only ratios mean anything");
    }
    let header = |threads: usize| format!("  {:>11}", format!("{threads} thr., s"));
    let threads = mesh.builds[0].seconds.iter().map(|s| s.threads);
    let header: String = threads.map(header).collect();
    println!("\n{:NAME$}{header}  bytes a primitive", "build");
    for row in &mesh.builds {
        let seconds = row.seconds.iter().map(|s| format!("  {:>11.3}", s.median));
        let seconds: String = seconds.collect();
        println!(
            "{:NAME$}{seconds}  {:>16.1}",
            row.name,
            row.bytes as f64 / count
        );
    }
    for set in &mesh.sets {
        print_set(set, mesh.rays);
    }
}

fn print_set(set: &SetReport, rays: usize) {
    println!("\n{}: {rays} rays, {:.1} % hit", set.name, 100.0 * set.hit);
    let mut header = format!("{:NAME$}", "");
    for threads in thread_counts() {
        let ratio = format!("× {}", set.reference);
        header += &format!("  {:>9}  {ratio:<18}", format!("{threads} thr., M/s"));
    }
    println!("{header}  two threads gain    differ: hit, distance");
    for row in &set.rows {
        let speed = |s: &Speed| {
            format!(
                "  {:>11.2}  {:<18}",
                s.million_rays_per_second,
                s.ratio.text()
            )
        };
        let speeds: String = row.speeds.iter().map(speed).collect();
        let gain = row.gain.as_ref().map_or(String::new(), Ratio::text);
        let Differences {
            hit_or_miss,
            distance,
        } = row.differences;
        println!(
            "{:NAME$}{speeds}  {gain:<18}  {hit_or_miss:>11}, {distance}",
            row.name
        );
    }
}

pub(crate) fn print_misses(misses: &Misses) {
    let Misses {
        triangles,
        rays,
        rows,
    } = misses;
    println!(
        "\n== watertight: a closed sphere of {triangles} triangles, {rays} rays at each; missed"
    );
    println!("{:NAME$}  {:>10}  {:>10}", "", "vertices", "edges");
    for row in rows {
        println!(
            "{:NAME$}  {:>10}  {:>10}",
            row.name, row.vertices, row.edges
        );
    }
}
