//! Ending on a signal: Ctrl-C, SIGTERM and SIGHUP set a flag that every loop looks at. Programs that
//! this one started end with it.

use std::io;
use std::process::{Child, ChildStderr, ChildStdout, Command, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::failure::Failure;

/// Exit status of a program that a second Ctrl-C ends at once.
const INTERRUPTED: i32 = 130;

/// The flag that ends the program, and when it is to end by itself.
#[derive(Clone)]
pub(crate) struct Stop {
    flag: Arc<AtomicBool>,
    end: Option<Instant>,
    /// The flag of the run that this is a part of.
    whole: Option<Arc<AtomicBool>>,
}

impl Stop {
    /// Sets the flag on a signal; a second signal ends the program at once. `seconds` is how long
    /// to run; forever if it is not given.
    pub(crate) fn on_signal(seconds: Option<f64>) -> Result<Self, Failure> {
        let flag = Arc::new(AtomicBool::new(false));
        let signalled = flag.clone();
        ctrlc::set_handler(move || {
            if signalled.swap(true, Ordering::Relaxed) {
                // Nothing is dropped on this way out. It is a thread's, not the signal's own.
                for program in running().iter() {
                    let _ = kill_process(*program, Signal::TERM);
                }
                std::process::exit(INTERRUPTED);
            }
        })
        .map_err(|error| Failure::found(format!("cannot handle signals: {error}")))?;
        isochrone_ipc::interrupt_waiting_by(flag.clone());
        let end = seconds.map(|seconds| {
            // Beyond what a Duration holds is forever.
            let run = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
            let now = Instant::now();
            now.checked_add(run).unwrap_or(now + Duration::from_secs(u64::from(u32::MAX)))
        });
        Ok(Self { flag, end, whole: None })
    }

    /// A stop of its own for a part of the run: due with this one, after `run`, or when it is asked
    /// for, which leaves this one alone.
    pub(crate) fn within(&self, run: Duration) -> Self {
        let end = Instant::now().checked_add(run);
        Self { flag: Arc::default(), end, whole: Some(self.flag.clone()) }
    }

    /// The flag itself, for loops that are told to stop.
    pub(crate) fn flag(&self) -> Arc<AtomicBool> {
        self.flag.clone()
    }

    /// Whether it is time to end; sets the flag when the time is up.
    pub(crate) fn is_due(&self) -> bool {
        let whole_is_due = self.whole.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed));
        if whole_is_due || self.end.is_some_and(|end| Instant::now() >= end) {
            self.request();
        }
        self.flag.load(Ordering::Relaxed)
    }

    /// Asks everything to end.
    pub(crate) fn request(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }
}

/// The programs that run, for the way out that drops nothing.
static RUNNING: Mutex<Vec<Pid>> = Mutex::new(Vec::new());

fn running() -> MutexGuard<'static, Vec<Pid>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A program that this one started. It is asked to end when it is dropped, and when a second signal
/// ends this one at once.
pub(crate) struct Program {
    child: Child,
}

impl Program {
    /// Starts it.
    pub(crate) fn start(command: &mut Command) -> io::Result<Self> {
        // Held meanwhile, so that a signal finds every program that was started.
        let mut running = running();
        let child = command.spawn()?;
        running.push(Pid::from_child(&child));
        Ok(Self { child })
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// What it prints, if that is piped; once.
    pub(crate) fn printed(&mut self) -> (Option<ChildStdout>, Option<ChildStderr>) {
        (self.child.stdout.take(), self.child.stderr.take())
    }

    /// How it ended, if it did.
    pub(crate) fn ended(&mut self) -> io::Result<Option<ExitStatus>> {
        let status = self.child.try_wait()?;
        if status.is_some() {
            self.forget();
        }
        Ok(status)
    }

    /// Its id may be another's as soon as its end was seen.
    fn forget(&self) {
        running().retain(|program| *program != Pid::from_child(&self.child));
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        if let Ok(None) = self.child.try_wait() {
            // Not SIGKILL, which would leave its own children behind.
            let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
            let _ = self.child.wait();
        }
        self.forget();
    }
}

/// Reads a number of seconds.
pub(crate) fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 => Ok(seconds),
        _ => Err("give a number of seconds greater than 0, such as 10 or 0.5".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sleep() -> Program {
        Program::start(Command::new("sleep").arg("60")).unwrap()
    }

    #[test]
    fn a_program_that_is_dropped_is_gone_and_no_longer_known() {
        let program = sleep();
        let id = Pid::from_child(&program.child);
        assert!(running().contains(&id));
        drop(program);
        assert!(!running().contains(&id));
        assert!(rustix::process::test_kill_process(id).is_err());
    }

    #[test]
    fn a_program_that_ended_is_not_signalled_for_its_id_may_be_anothers() {
        let mut program = sleep();
        assert!(program.ended().unwrap().is_none());
        let id = Pid::from_child(&program.child);
        kill_process(id, Signal::KILL).unwrap();
        let status = loop {
            if let Some(status) = program.ended().unwrap() {
                break status;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        assert!(!status.success() && !running().contains(&id));
    }
}
