//! `etendue crosscheck --against raster`: rays and the z-buffer, scene by scene.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use etendue::budget::Budget;
use etendue::error::{Error, Result};
use etendue::raster::{ALLOWED, Agreement, TOLERANCE};
use etendue::render::{Options, Session, Silent, Staging, find_sensor};
use serde_json::json;

use super::overrides::ImageArguments;
use super::scene::{ReadArguments, describe};
use super::stop::Stop;
use super::{output, report, status};

/// What is to be compared.
pub(super) struct Subject<'a> {
    pub(super) scenes: &'a [PathBuf],
    pub(super) read: &'a ReadArguments,
    pub(super) image: &'a ImageArguments,
    pub(super) threads: Option<NonZeroUsize>,
    pub(super) json: bool,
    pub(super) quiet: bool,
}

impl Subject<'_> {
    /// Runs the command; the answer is the exit status.
    pub(super) fn run(&self) -> Result<u8> {
        if self.scenes.is_empty() {
            return Err(Error::input(
                "there is no scene to be seen by rays and by the z-buffer",
            ));
        }
        let stop = Stop::on_signals()?;
        let (mut differ, mut failed) = (false, false);
        if !self.json {
            output::line(&line("scene", &HEADS.map(String::from)));
        }
        for scene in self.scenes {
            if stop.signalled() {
                return Ok(status::INTERRUPTED);
            }
            match self.compare(scene) {
                Ok(agreement) => {
                    differ |= !agreement.agrees();
                    self.tell(scene, &agreement);
                }
                Err(error) => {
                    failed = true;
                    self.fail(scene, &error);
                }
            }
        }
        if !self.json && !self.quiet {
            output::line(&format!(
                "\ndifferences are in parts of the distance, of 1 or of u and v; a pixel differs from {TOLERANCE:.0e} on; {} of 10000 pixels may",
                (ALLOWED * 1e4).round()
            ));
        }
        Ok(match (differ, failed) {
            (true, _) => status::DIFFERS,
            (false, true) => status::CANNOT_COMPARE,
            (false, false) => status::DONE,
        })
    }

    fn compare(&self, scene: &Path) -> Result<Agreement> {
        let options = self.read.options(None);
        let (mut session, budget) = (Session::default(), Budget::default());
        let staging = Staging::default();
        let mut description =
            describe(scene, &staging, &options, &budget, &mut session)?.description;
        self.image.overrides().apply(&mut description);
        let sensor = match self.image.sensor()? {
            Some(named) => find_sensor(&description, &named)?,
            None => 0,
        };
        let options = Options {
            scene: scene.display().to_string(),
            threads: self.threads,
            sensor,
            ..Options::default()
        };
        session.agreement(&description, &options, &Silent)
    }

    fn tell(&self, scene: &Path, agreement: &Agreement) {
        let verdict = if agreement.agrees() {
            "agree"
        } else {
            "differ"
        };
        if self.json {
            let mut object =
                serde_json::to_value(agreement).expect("it has only names and numbers");
            object["scene"] = scene.display().to_string().into();
            object["status"] = verdict.into();
            let notes = agreement.notes.iter().map(|note| note.message.clone());
            object["notes"] = notes.collect::<Vec<_>>().into();
            return output::object(object);
        }
        let worst = |name: &str| {
            let mut quantities = agreement.quantities.iter();
            let Some(q) = quantities.find(|q| q.name == name) else {
                return "–".to_owned();
            };
            match (name, q.differing) {
                ("shape" | "primitive", n) => n.to_string(),
                (_, 0) => format!("{:.1e}", q.worst),
                (_, n) => format!("{:.1e} ({n})", q.worst),
            }
        };
        let mut cells = vec![
            verdict.to_owned(),
            agreement.pixels.to_string(),
            agreement.silhouettes.to_string(),
            agreement.undrawn.to_string(),
            agreement.compared().to_string(),
        ];
        cells.extend(["shape", "primitive"].map(worst));
        cells.push(agreement.on_edges.to_string());
        cells.extend(["depth", "position", "geo_normal", "sh_normal", "uv"].map(worst));
        let cells: [String; HEADS.len()] = cells.try_into().expect("a cell a column");
        output::line(&line(&name(scene), &cells));
        if !self.quiet {
            report::warnings(&agreement.notes);
        }
    }

    fn fail(&self, scene: &Path, error: &Error) {
        if self.json {
            let (scene, reason) = (scene.display().to_string(), error.to_string());
            return output::object(
                json!({ "scene": scene, "status": "not comparable", "reason": reason }),
            );
        }
        let mut cells = HEADS.map(|_| String::new());
        cells[0] = "–".to_owned();
        output::line(&line(&name(scene), &cells));
        report::error(error);
    }
}

fn name(scene: &Path) -> String {
    let name = scene.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

const HEADS: [&str; 13] = [
    "verdict",
    "pixels",
    "silhouette",
    "undrawn",
    "compared",
    "shape",
    "primitive",
    "on edges",
    "depth",
    "position",
    "geo_normal",
    "sh_normal",
    "uv",
];

fn line(scene: &str, cells: &[String; HEADS.len()]) -> String {
    let mut line = format!("{scene:<24}");
    for (cell, head) in cells.iter().zip(HEADS) {
        let width = head.len().max(8);
        line.push_str(&format!("  {cell:>width$}"));
    }
    line.trim_end().to_owned()
}
