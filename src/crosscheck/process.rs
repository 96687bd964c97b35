//! A worker in a process of its own: asked line by line, with a time limit on every answer, and ended with
//! all that it started when nobody needs it any more. What it says on standard error is kept for its last
//! words.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::order::Reply;
use super::{Failure, Side, Watch};

/// How often somebody who waits looks whether to stop.
const LOOK: Duration = Duration::from_millis(50);
/// How long a worker may take to leave after its last answer.
const LEAVE: Duration = Duration::from_secs(2);
/// Bytes of standard error that are kept, from its beginning and from its end.
const KEPT: usize = 8 << 10;

/// A worker that listens.
#[derive(Debug)]
pub(super) struct Worker {
    side: Side,
    child: Child,
    /// Absent once the worker was told that nothing more comes.
    input: Option<ChildStdin>,
    answers: Receiver<String>,
    /// Gives what standard error said; absent once it was asked.
    said: Option<JoinHandle<Said>>,
}

impl Worker {
    /// Starts `command`.
    pub(super) fn start(side: Side, mut command: Command) -> Result<Self, Failure> {
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        // A group of its own: Ctrl-C reaches this program, which ends the group as a whole.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(|error| {
            let program = command.get_program().to_string_lossy().into_owned();
            Failure::Broken(format!("{side}: cannot start {program}: {error}"))
        })?;
        let pipe = "the pipe was asked for";
        let input = child.stdin.take().expect(pipe);
        let output = child.stdout.take().expect(pipe);
        let errors = child.stderr.take().expect(pipe);
        let (send, answers) = mpsc::channel();
        // Both threads end with the pipes that they read.
        thread::spawn(move || {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if send.send(line).is_err() {
                    break;
                }
            }
        });
        Ok(Self {
            side,
            child,
            input: Some(input),
            answers,
            said: Some(thread::spawn(move || Said::read(errors))),
        })
    }

    /// Writes a line and waits for the answer, at most for `limit`.
    pub(super) fn ask(
        &mut self,
        question: &impl Serialize,
        limit: Duration,
        watch: &dyn Watch,
    ) -> Result<Reply, Failure> {
        let text = serde_json::to_string(question).expect("a question has only names and numbers");
        let written = self.input.as_mut().map(|input| {
            writeln!(input, "{text}")?;
            input.flush()
        });
        if !matches!(written, Some(Ok(()))) {
            return Err(self.died());
        }
        let begin = Instant::now();
        loop {
            match self.answers.recv_timeout(LOOK) {
                Ok(line) => {
                    return serde_json::from_str(&line).map_err(|_| {
                        Failure::Broken(format!(
                            "{} answered {line:?}, which means nothing",
                            self.side
                        ))
                    });
                }
                Err(RecvTimeoutError::Disconnected) => return Err(self.died()),
                Err(RecvTimeoutError::Timeout) if watch.stop() => return Err(Failure::Stopped),
                Err(RecvTimeoutError::Timeout) if begin.elapsed() > limit => {
                    let message = format!("{} took more than {} s", self.side, limit.as_secs_f64());
                    return Err(Failure::Broken(message));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// The most memory that the worker has held so far, in bytes; known on Linux only.
    pub(super) fn peak_memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
        let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
        kibibytes.checked_mul(1024)
    }

    /// What became of a worker that does not answer any more.
    fn died(&mut self) -> Failure {
        drop(self.input.take());
        let how = match self.leave() {
            Ok(Some(status)) => describe(status),
            _ => "did not answer".to_owned(),
        };
        self.kill();
        let said = self.said.take().and_then(|thread| thread.join().ok());
        let words = said.map(|said| said.last_words()).unwrap_or_default();
        Failure::Died {
            side: self.side,
            how,
            words,
        }
    }

    /// Waits a moment for the worker to end by itself.
    fn leave(&mut self) -> io::Result<Option<ExitStatus>> {
        let begin = Instant::now();
        loop {
            let status = self.child.try_wait()?;
            if status.is_some() || begin.elapsed() > LEAVE {
                return Ok(status);
            }
            thread::sleep(Duration::from_millis(2));
        }
    }

    /// Ends the worker and all that it started.
    fn kill(&mut self) {
        #[cfg(unix)]
        let _ = rustix::process::kill_process_group(
            rustix::process::Pid::from_child(&self.child),
            rustix::process::Signal::KILL,
        );
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        drop(self.input.take());
        self.kill();
    }
}

fn describe(status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return format!("ended by signal {signal}");
    }
    match status.code() {
        Some(code) => format!("ended with status {code}"),
        None => "ended".to_owned(),
    }
}

/// The beginning and the end of what was said.
#[derive(Debug, Default)]
struct Said {
    first: Vec<u8>,
    last: Vec<u8>,
}

impl Said {
    fn read(mut errors: impl Read) -> Self {
        let mut said = Self::default();
        let mut piece = [0; 4096];
        while let Ok(n @ 1..) = errors.read(&mut piece) {
            let room = KEPT.saturating_sub(said.first.len()).min(n);
            said.first.extend_from_slice(&piece[..room]);
            said.last.extend_from_slice(&piece[room..n]);
            let excess = said.last.len().saturating_sub(KEPT);
            said.last.drain(..excess);
        }
        said
    }

    /// The first line that tells of an error, where there is one, and the last few.
    fn last_words(&self) -> String {
        const LINES: usize = 6;
        let text = [&self.first[..], &self.last].concat();
        let text = String::from_utf8_lossy(&text);
        let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
        let (early, late) = lines.split_at(lines.len().saturating_sub(LINES));
        let error = early
            .iter()
            .find(|line| line.to_lowercase().contains("error"));
        let words: Vec<&str> = error.into_iter().chain(late).copied().collect();
        words.join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(said: &str) -> String {
        Said::read(said.as_bytes()).last_words()
    }

    #[test]
    fn last_words_are_the_last_lines_and_the_first_error_before_them() {
        assert_eq!(words("a\n\nb\n"), "a\nb");
        let many: String = (0..5000).map(|i| format!("line {i}\n")).collect();
        let said = words(&format!("start\nLLVM ERROR: what\n{many}"));
        let lines: Vec<&str> = said.lines().collect();
        assert_eq!(lines.len(), 7);
        assert_eq!((lines[0], lines[6]), ("LLVM ERROR: what", "line 4999"));
    }
}
