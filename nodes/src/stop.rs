//! Ending on a signal: Ctrl-C, SIGTERM and SIGHUP set a flag that every loop looks at, and the program
//! ends in order. One that hangs is ended by another signal. Programs that this one started end
//! with it.

use std::io;
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::failure::Failure;
use crate::terminal;

/// Signals within this time are one request to end: `timeout` sends two, one to its program and one
/// to the group. To end at once on the second would kill the program while it removes its files.
const ONE_REQUEST: Duration = Duration::from_millis(500);

/// Longest that the last words of a program that hangs may take: whatever it hangs on may be stderr.
const LAST_WORDS: Duration = Duration::from_millis(100);

/// Exit status of a program that did not end in order: something was wrong.
const NOT_IN_ORDER: i32 = 1;

/// The flag that ends the program, and when it is to end by itself.
#[derive(Clone)]
pub(crate) struct Stop {
    flag: Arc<AtomicBool>,
    end: Option<Instant>,
    /// The flag of the run that this is a part of.
    whole: Option<Arc<AtomicBool>>,
}

impl Stop {
    /// Sets the flag on a signal; another signal, 500 ms later or more, ends the program at once.
    /// `seconds` is how long to run; forever if it is not given.
    pub(crate) fn on_signal(seconds: Option<f64>) -> Result<Self, Failure> {
        let flag = Arc::new(AtomicBool::new(false));
        let signalled = flag.clone();
        let mut first = None;
        // This runs in a thread of its own, not in the signal's handler.
        ctrlc::set_handler(move || {
            signalled.store(true, Ordering::Relaxed);
            if first.get_or_insert_with(Instant::now).elapsed() >= ONE_REQUEST {
                end_at_once();
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

    /// Sets the flag when the time is up, also while nobody asks whether it is: for loops that wait
    /// for long.
    pub(crate) fn keep_time(&self) -> Result<(), Failure> {
        let Some(end) = self.end else { return Ok(()) };
        let flag = self.flag();
        let wait = move || {
            thread::sleep(end.saturating_duration_since(Instant::now()));
            flag.store(true, Ordering::Relaxed);
        };
        match thread::Builder::new().name("end".into()).spawn(wait) {
            Ok(_) => Ok(()),
            Err(error) => Err(Failure::found(format!("cannot start a thread: {error}"))),
        }
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

/// Ends a program that hangs. Nothing is dropped on this way out.
fn end_at_once() -> ! {
    for program in running().iter() {
        let _ = kill_process(*program, Signal::TERM);
    }
    let since = Instant::now();
    let last_words = thread::Builder::new().spawn(|| {
        terminal::note(
            "ended at once by another signal, not in order: what it would have said is lost, and \
             files may be left",
        );
    });
    let are_spoken = || last_words.as_ref().map_or(true, JoinHandle::is_finished);
    while !are_spoken() && since.elapsed() < LAST_WORDS {
        thread::sleep(Duration::from_millis(1));
    }
    std::process::exit(NOT_IN_ORDER);
}

/// The programs that run, for the way out that drops nothing.
static RUNNING: Mutex<Vec<Pid>> = Mutex::new(Vec::new());

fn running() -> MutexGuard<'static, Vec<Pid>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A program that this one started. It is asked to end when it is dropped, and when another signal
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

    /// What it reads, if that is piped; once.
    pub(crate) fn stdin(&mut self) -> Option<ChildStdin> {
        self.child.stdin.take()
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

    /// Asks it to end, and waits until it did.
    pub(crate) fn end(&mut self) -> io::Result<ExitStatus> {
        self.end_with(Signal::TERM)
    }

    /// Kills it, and waits until it is gone.
    pub(crate) fn kill(&mut self) -> io::Result<ExitStatus> {
        self.end_with(Signal::KILL)
    }

    fn end_with(&mut self, signal: Signal) -> io::Result<ExitStatus> {
        if self.child.try_wait()?.is_none() {
            let _ = kill_process(Pid::from_child(&self.child), signal);
        }
        let status = self.child.wait();
        self.forget();
        status
    }

    /// Its id may be another's as soon as its end was seen.
    fn forget(&self) {
        running().retain(|program| *program != Pid::from_child(&self.child));
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // Not SIGKILL, which would leave its own children behind.
        let _ = self.end();
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
