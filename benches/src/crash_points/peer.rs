//! An ordinary process beside the one that is struck.

use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill, killpg};
use nix::unistd::Pid;

use super::output::Output;
use super::point::Role;
use crate::Failure;

/// Longer than anything takes to end, on a machine that is busy.
pub(super) const END_WITHIN: Duration = Duration::from_secs(5);

/// A process in a group of its own. It is killed when this is dropped.
#[derive(Debug)]
pub(super) struct Peer {
    role: Role,
    who: String,
    child: Child,
    pub(super) output: Output,
}

impl Peer {
    /// Starts it; `who` names it in what is said about it.
    pub(super) fn start(role: Role, who: &str, mut command: Command) -> Result<Self, Failure> {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.process_group(0).spawn()?;
        let output = Output::of(&mut child);
        Ok(Self { role, who: who.to_owned(), child, output })
    }

    fn pid(&self) -> Pid {
        Pid::from_raw(self.child.id().cast_signed())
    }

    /// How it ended, and what it said, if it has ended.
    pub(super) fn has_ended(&mut self) -> Option<String> {
        let status = self.child.try_wait().ok().flatten()?;
        Some(self.epitaph(status))
    }

    /// Whether it said that it runs, or why it does not. A subscriber of a service that does not exist
    /// has nothing to say.
    pub(super) fn has_spoken(&self) -> bool {
        self.role == Role::Subscriber || !self.output.errors().is_empty()
    }

    /// Its name.
    pub(super) fn who(&self) -> &str {
        &self.who
    }

    /// Asks it to end, and waits for it.
    pub(super) fn end(mut self) -> Result<(), String> {
        let _ = kill(self.pid(), Signal::SIGTERM);
        let since = Instant::now();
        while since.elapsed() < END_WITHIN {
            match self.child.try_wait() {
                Ok(Some(status)) if status.success() => return Ok(()),
                Ok(Some(status)) => return Err(self.epitaph(status)),
                _ => thread::sleep(Duration::from_millis(2)),
            }
        }
        Err(format!("the {} does not end: {}", self.who, self.output.errors()))
    }

    fn epitaph(&self, status: ExitStatus) -> String {
        format!("the {} ended with {status}: {}", self.who, self.output.last_words())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        if let Ok(None) = self.child.try_wait() {
            let _ = killpg(self.pid(), Signal::SIGKILL);
            let _ = self.child.wait();
        }
    }
}
