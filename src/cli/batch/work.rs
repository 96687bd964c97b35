//! One image of a batch: a process, its end, and whether it is tried again.

use std::fmt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use etendue::error::{Error, Result};
use etendue::render::human_duration;
use serde_json::{Value, json};

use super::manifest::Unit;
use crate::cli::progress::Told;
use crate::cli::status;
use crate::cli::stop::Stop;

/// What became of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Status {
    Rendered,
    Skipped,
    Interrupted,
    NotBegun,
    Failed,
}

impl Status {
    pub(super) const ALL: [Self; 5] = [
        Self::Rendered,
        Self::Skipped,
        Self::Interrupted,
        Self::NotBegun,
        Self::Failed,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Rendered => "rendered",
            Self::Skipped => "skipped",
            Self::Interrupted => "interrupted",
            Self::NotBegun => "not begun",
            Self::Failed => "failed",
        }
    }
}

/// What became of an image, and how.
#[derive(Clone, Debug)]
pub(super) struct Done {
    pub(super) status: Status,
    /// The exit status that it asks for.
    pub(super) exit: u8,
    /// How often it was begun.
    attempts: u32,
    seconds: f64,
    /// The problems, as the process told them.
    problems: Value,
    /// The first of them, or how the process ended.
    why: String,
}

impl Done {
    /// It was too late for it.
    pub(super) fn not_begun() -> Self {
        Self {
            status: Status::NotBegun,
            exit: status::DONE,
            attempts: 0,
            seconds: 0.0,
            problems: json!([]),
            why: String::new(),
        }
    }

    /// For programs.
    pub(super) fn object(&self) -> Value {
        json!({
            "status": self.status.name(),
            "attempts": self.attempts,
            "seconds": self.seconds,
            "problems": self.problems,
        })
    }
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.status.name())?;
        match self.status {
            Status::Rendered => {
                write!(
                    f,
                    ", {}",
                    human_duration(Duration::from_secs_f64(self.seconds))
                )
            }
            Status::Failed => write!(f, ": {}", self.why),
            _ => Ok(()),
        }
    }
}

/// Starts processes, one after another.
#[derive(Debug)]
pub(super) struct Worker<'a> {
    /// From which files are named.
    pub(super) folder: &'a Path,
    pub(super) told: Told,
    /// The option for the memory of each process.
    pub(super) memory: Option<String>,
    pub(super) retries: u32,
    pub(super) stop: &'a Stop,
}

impl Worker<'_> {
    /// Renders an image: again, where that may help and is allowed.
    pub(super) fn render(&self, unit: &Unit) -> Result<Done> {
        let began = Instant::now();
        let mut attempts = 0;
        loop {
            attempts += 1;
            let output = self.attempt(unit)?;
            let code = output
                .status
                .code()
                .and_then(|code| u8::try_from(code).ok());
            let may_help = !matches!(code, Some(status::DONE | status::INPUT | status::USAGE));
            if may_help && attempts <= self.retries && !self.stop.signalled() {
                continue;
            }
            let told: Value = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
            let status = match (code, told["status"].as_str()) {
                (Some(status::DONE), Some("skipped")) => Status::Skipped,
                (Some(status::DONE), _) => Status::Rendered,
                (Some(status::INTERRUPTED), Some("interrupted")) => Status::Interrupted,
                (Some(status::INTERRUPTED), _) => Status::NotBegun,
                _ => Status::Failed,
            };
            let first = told["problems"][0]["message"].as_str();
            return Ok(Done {
                status,
                exit: match status {
                    Status::Failed => code.unwrap_or(status::SYSTEM),
                    _ => status::DONE,
                },
                attempts,
                seconds: began.elapsed().as_secs_f64(),
                why: first.map_or_else(|| output.status.to_string(), str::to_owned),
                problems: match &told["problems"] {
                    Value::Null => json!([]),
                    problems => problems.clone(),
                },
            });
        }
    }

    /// A process, whose errors and progress go where ours do. It has a group of its own: a signal to ours comes to it
    /// once, from here.
    fn attempt(&self, unit: &Unit) -> Result<Output> {
        let program = std::env::current_exe().map_err(|e| started(&e))?;
        let told = self.told.to_possible_value();
        let told = told.as_ref().map_or("none", |value| value.get_name());
        let mut command = Command::new(program);
        command
            .args(&unit.arguments)
            .arg("-o")
            .arg(&unit.item.output)
            .args(["--skip-same", "--quiet", "--json", "--progress", told])
            .args(&self.memory)
            .current_dir(self.folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped());
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let child = command.spawn().map_err(|e| started(&e))?;
        self.wait(child).map_err(|e| started(&e))
    }

    /// Waits for its end, and asks for that when a signal has come.
    fn wait(&self, child: Child) -> std::io::Result<Output> {
        const LOOK: Duration = Duration::from_millis(50);
        let (id, over) = (child.id(), AtomicBool::new(false));
        thread::scope(|scope| {
            scope.spawn(|| {
                while !over.load(Ordering::Relaxed) {
                    if self.stop.signalled() {
                        return interrupt(id);
                    }
                    thread::sleep(LOOK);
                }
            });
            let output = child.wait_with_output();
            over.store(true, Ordering::Relaxed);
            output
        })
    }
}

/// Asks a process to come to an end.
fn interrupt(id: u32) {
    #[cfg(unix)]
    if let Some(id) = i32::try_from(id)
        .ok()
        .and_then(rustix::process::Pid::from_raw)
    {
        // Where it has ended by itself there is nothing to ask for.
        rustix::process::kill_process(id, rustix::process::Signal::TERM).ok();
    }
    #[cfg(not(unix))]
    let _ = id;
}

fn started(cause: &std::io::Error) -> Error {
    Error::system("start", Path::new("etendue render"), cause)
}
