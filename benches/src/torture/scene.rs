//! A domain, the files in its folder, and processes of the program.

use std::fs;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_ipc::IsolatedDomain;
use isochrone_testing::{Ended, Process};

use super::turn::Stage;
use crate::Failure;

/// Longer than anything takes for which no time is promised, on a machine that is busy.
pub(super) const PATIENCE: Duration = Duration::from_secs(60);
/// Between two looks.
const LOOK: Duration = Duration::from_millis(1);

/// A domain of its own. Drop the processes before it.
pub(super) struct Scene {
    pub(super) stage: Stage,
    domain: IsolatedDomain,
}

impl Scene {
    /// With these files in its folder.
    pub(super) fn new(stage: &Stage, files: &[(&str, &str)]) -> Result<Self, Failure> {
        Self::within(&std::env::temp_dir(), stage, files)
    }

    /// As `new`, in a folder in `place`.
    pub(super) fn within(
        place: &Path,
        stage: &Stage,
        files: &[(&str, &str)],
    ) -> Result<Self, Failure> {
        let domain = IsolatedDomain::within(place, "torture")?;
        for (name, content) in files {
            fs::write(domain.folder().join(name), content)?;
        }
        Ok(Self { stage: stage.clone(), domain })
    }

    /// The domain.
    pub(super) fn domain(&self) -> &IsolatedDomain {
        &self.domain
    }

    /// A file in its folder.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.domain.folder().join(name)
    }

    /// The program in this domain, by another one whose words come first. Arguments are separated by spaces.
    fn command(&self, words: &[&str], arguments: &str) -> Command {
        let program = self.stage.program.as_os_str();
        let mut all = words.iter().map(std::ffi::OsStr::new).chain([program]);
        let mut command = Command::new(all.next().unwrap_or(program));
        command.args(all).args(arguments.split_whitespace()).current_dir(self.domain.folder());
        // Ctrl-C of the terminal is for this program, which ends the others.
        command.env("ICEORYX2_CONFIG", self.domain.file()).process_group(0);
        command
    }

    /// Starts the program.
    pub(super) fn start(&self, arguments: &str) -> Process {
        Process::start(self.command(&[], arguments))
    }

    /// Starts it, and waits until it has said this.
    pub(super) fn start_until(&self, arguments: &str, text: &str) -> Result<Process, String> {
        let mut process = self.start(arguments);
        self.until_said(&mut process, text)?;
        Ok(process)
    }

    /// Waits until a process has said this.
    pub(super) fn until_said(&self, process: &mut Process, text: &str) -> Result<(), String> {
        let said = self.wait(PATIENCE, || {
            let is_over = process.is_over();
            let is_said = process.printed().contains(text);
            (is_said || is_over).then_some(is_said)
        });
        match said {
            Some(true) => Ok(()),
            _ => Err(format!("a process did not say {text:?}, but {:?}", last(&process.printed()))),
        }
    }

    /// Runs the program to its end.
    pub(super) fn run(&self, arguments: &str) -> Result<Ended, String> {
        self.run_by(&[], arguments)
    }

    /// As `run`, by another program whose words come first.
    pub(super) fn run_by(&self, words: &[&str], arguments: &str) -> Result<Ended, String> {
        let mut process = Process::start(self.command(words, arguments));
        self.wait(PATIENCE, || process.ended_within(Duration::ZERO))
            .ok_or_else(|| format!("`{arguments}` does not end, it said {:?}", process.printed()))
    }

    /// Asks a process to end, and waits until it has: with one of these exit codes.
    pub(super) fn end(&self, process: Process, codes: &[i32]) -> Result<Ended, String> {
        process.signal(rustix::process::Signal::TERM);
        let mut process = process;
        let ended = self.wait(PATIENCE, || process.ended_within(Duration::ZERO));
        let ended = ended.ok_or("a process does not end that was asked to (SIGTERM)")?;
        match ended.status.code() {
            Some(code) if codes.contains(&code) => Ok(ended),
            _ => Err(format!("a process ended with {}: {:?}", ended.status, last(&ended.stderr))),
        }
    }

    /// Looks for something until it is there, for so long, or until the program is to end.
    pub(super) fn wait<T>(
        &self,
        within: Duration,
        mut look: impl FnMut() -> Option<T>,
    ) -> Option<T> {
        let since = Instant::now();
        loop {
            if let Some(found) = look() {
                return Some(found);
            }
            if since.elapsed() > within || self.stage.is_due() {
                return None;
            }
            thread::sleep(LOOK);
        }
    }
}

/// The last lines of what a process said.
pub(super) fn last(said: &str) -> String {
    let lines: Vec<&str> = said.lines().filter(|line| !line.is_empty()).collect();
    lines[lines.len().saturating_sub(4)..].join(" | ")
}

/// A process that was asked for too much ended in order: it worked, or it said why not. What is wrong otherwise.
pub(super) fn ended_well(ended: &Ended) -> Result<bool, String> {
    let Ended { status, stderr, .. } = ended;
    match status.code() {
        Some(0) => Ok(true),
        Some(1..=3) if !stderr.contains("panicked") && is_sentence(stderr) => Ok(false),
        _ => Err(format!("it ended with {status}, and said {:?}", last(stderr))),
    }
}

/// What is refused is named, with what to do, or there was nothing to read.
fn is_sentence(said: &str) -> bool {
    let error = said.split_once("  x ").map_or("", |(_, error)| error);
    let is_silence = error.contains("sent nothing") || error.contains("goes on without it");
    const REMEDIES: [&str; 10] = [
        "remove", "enlarge", "raise", "free ", "grant", "see that", "name ", "delete", "`run",
        "set ",
    ];
    is_silence || REMEDIES.iter().any(|remedy| error.contains(remedy))
}
