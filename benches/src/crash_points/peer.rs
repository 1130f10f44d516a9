//! An ordinary process beside the one that is struck.

use std::os::unix::process::CommandExt;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

use isochrone_processes::Child;
use isochrone_testing::afresh;
use rustix::process::{Pid, Signal, kill_process_group};

use super::output::Output;
use super::point::Role;
use crate::Failure;

/// Longer than anything takes to end, on a machine that is busy.
pub(super) const END_WITHIN: Duration = Duration::from_secs(60);

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
        let mut child = Child::start(who, afresh(command.process_group(0)))?;
        let output = Output::of(child.stdout(), child.stderr());
        Ok(Self { role, who: who.to_owned(), child, output })
    }

    /// How it ended, and what it said, if it has ended.
    pub(super) fn has_ended(&mut self) -> Option<String> {
        let status = self.child.ended().ok().flatten()?;
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
        self.child.signal(Signal::TERM);
        match self.child.wait_within(END_WITHIN) {
            Ok(Some(status)) if status.success() => Ok(()),
            Ok(Some(status)) => Err(self.epitaph(status)),
            _ => Err(format!("the {} does not end: {}", self.who, self.output.errors())),
        }
    }

    fn epitaph(&self, status: ExitStatus) -> String {
        format!("the {} ended with {status}: {}", self.who, self.output.last_words())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        if let (Ok(None), Some(group)) =
            (self.child.ended(), Pid::from_raw(self.child.id().cast_signed()))
        {
            let _ = kill_process_group(group, Signal::KILL);
            let _ = self.child.wait();
        }
    }
}
