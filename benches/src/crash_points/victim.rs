//! A process that runs under the tracer.

use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_testing::afresh;
use nix::sys::signal::{Signal, kill, killpg};
use nix::unistd::Pid;

use super::output::Output;
use super::tracer::{Aim, Counts, Event, Tracer};
use crate::Failure;

/// A process under the tracer. It is killed when this is dropped.
#[derive(Debug)]
pub(super) struct Victim {
    /// Its process id.
    pub(super) pid: Pid,
    /// What it prints.
    pub(super) output: Output,
    settled: Arc<AtomicBool>,
    events: Receiver<Event>,
    tracer: Option<JoinHandle<Result<Counts, Failure>>>,
}

impl Victim {
    /// Starts the program of `command`, which is not yet started, with its output piped.
    ///
    /// # Errors
    /// It cannot be started, or may not be traced.
    pub(super) fn start(command: &Command, aim: Option<Aim>) -> Result<Self, Failure> {
        let (started, pids) = channel();
        let (report, events) = channel();
        let settled = Arc::new(AtomicBool::new(false));
        let gated = gated(command);
        let flag = settled.clone();
        // Only the thread that attached to a process may trace it.
        let tracer = thread::spawn(move || {
            let (tracer, output) = Tracer::attach(gated, aim, report, flag)?;
            // If nobody waits any more the process is killed.
            let _ = started.send((tracer.leader, output));
            tracer.trace()
        });
        match pids.recv() {
            Ok((pid, output)) => Ok(Self { pid, output, settled, events, tracer: Some(tracer) }),
            Err(_) => Err(joined(tracer).err().unwrap_or_else(|| "the process is gone".into())),
        }
    }

    /// Whether its start is over.
    pub(super) fn is_settled(&self) -> bool {
        self.settled.load(Ordering::Relaxed)
    }

    /// What happened to it next, if that comes within this time.
    pub(super) fn event(&self, within: Duration) -> Option<Event> {
        self.events.recv_timeout(within).ok()
    }

    /// Sends it a signal.
    pub(super) fn signal(&self, signal: Signal) {
        let _ = kill(self.pid, signal);
    }

    /// The calls that it made, once it has ended; it is killed if it has not.
    ///
    /// # Errors
    /// It could not be traced to its end.
    pub(super) fn counts(mut self) -> Result<Counts, Failure> {
        self.tracer.take().map_or_else(|| Ok(Counts::new()), joined)
    }
}

/// Whether this process may trace those that it starts.
///
/// # Errors
/// It may not, or they cannot be started.
pub fn can_trace() -> Result<(), Failure> {
    Victim::start(&Command::new("true"), None)?.counts().map(drop)
}

impl Drop for Victim {
    fn drop(&mut self) {
        if let Some(tracer) = self.tracer.take() {
            // Its id is its own until the tracer has waited for it.
            if !tracer.is_finished() {
                let _ = killpg(self.pid, Signal::SIGKILL);
            }
            let _ = joined(tracer);
        }
    }
}

fn joined(tracer: JoinHandle<Result<Counts, Failure>>) -> Result<Counts, Failure> {
    tracer.join().unwrap_or_else(|_| Err("the tracer panicked".into()))
}

/// The same program behind a shell that says a line and waits for one before it becomes the program, so
/// that a tracer can attach before the program's first instruction.
fn gated(command: &Command) -> Command {
    let mut gated = Command::new("/bin/sh");
    gated.args(["-c", "echo; read -r go && exec \"$0\" \"$@\" </dev/null"]);
    gated.arg(command.get_program()).args(command.get_args());
    if let Some(folder) = command.get_current_dir() {
        gated.current_dir(folder);
    }
    gated.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).process_group(0);
    // Whoever runs this may ignore SIGINT, with which victims are asked to end.
    afresh(&mut gated);
    gated
}

#[cfg(test)]
mod tests {
    use super::super::call::Call;
    use super::super::point::{Blow, Phase};
    use super::super::tracer::Site;
    use super::*;

    const PATIENCE: Duration = Duration::from_secs(60);

    /// A process that makes the folders a, b and c, struck at the second.
    fn maker(folder: &tempfile::TempDir, blow: Blow) -> Option<Victim> {
        if let Err(why) = can_trace() {
            assert!(std::env::var_os("CI").is_none(), "{why}");
            return None;
        }
        let call: Call = "mkdir".parse().or_else(|_| "mkdirat".parse()).unwrap();
        let aim = Aim { site: Site { phase: Phase::Start, thread: 0, call }, k: 2, steps: 0, blow };
        let mut mkdir = Command::new("mkdir");
        mkdir.args(["a", "b", "c"]).current_dir(folder);
        let victim = Victim::start(&mkdir, Some(aim)).unwrap();
        assert_eq!(victim.event(PATIENCE), Some(Event::Struck));
        Some(victim)
    }

    fn made(folder: &tempfile::TempDir) -> usize {
        folder.path().read_dir().unwrap().count()
    }

    #[test]
    fn the_call_at_which_a_process_is_killed_is_not_made() {
        let folder = tempfile::tempdir().unwrap();
        let Some(victim) = maker(&folder, Blow::Kill) else { return };
        assert_eq!(victim.event(PATIENCE), Some(Event::Ended(None)));
        assert_eq!(made(&folder), 1);
    }

    #[test]
    fn a_process_that_is_stopped_goes_on_after_the_call() {
        let folder = tempfile::tempdir().unwrap();
        let Some(victim) = maker(&folder, Blow::Stop) else { return };
        while made(&folder) < 2 {
            thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(victim.event(Duration::from_millis(50)), None);
        assert_eq!(made(&folder), 2);
        victim.signal(Signal::SIGCONT);
        assert_eq!(victim.event(PATIENCE), Some(Event::Ended(Some(0))));
        assert_eq!(made(&folder), 3);
    }

    #[test]
    fn a_process_that_is_dropped_is_dead() {
        let victim = Victim::start(Command::new("sleep").arg("60"), None);
        let Ok(victim) = victim else { return };
        let pid = victim.pid;
        drop(victim);
        assert!(kill(pid, None).is_err());
    }
}
