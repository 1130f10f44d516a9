//! A child process.

use std::ffi::OsStr;
use std::io;
use std::os::unix::process::ExitStatusExt;
use std::process::{ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::ending::Ending;
use crate::orphan;
use crate::running::running;

/// How long a program may take to end in order. A process that waits for a domain's lock needs two
/// seconds; a report that is written to a disk which others keep busy can take a minute.
const PATIENCE: Duration = Duration::from_secs(120);
const LOOK_INTERVAL: Duration = Duration::from_millis(1);

/// Why an operation on a [`Child`] failed: the program, and how it ended or what the system says.
#[derive(thiserror::Error)]
#[error("{0}")]
pub struct ChildError(String);

/// A child process.
///
/// It is asked to end, and killed if it does not, when this is dropped or when a second signal ends
/// this program at once. A program that calls [`end_with_parent`](crate::end_with_parent) also ends
/// when this program is killed. To be exact, it ends with the thread that started it, so start it in a
/// thread that lasts.
#[derive(Debug)]
pub struct Child {
    name: String,
    child: std::process::Child,
    ended: Option<ExitStatus>,
}

impl Child {
    /// Starts the program; errors call it `name`.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn start(name: impl Into<String>, command: &mut Command) -> Result<Self, ChildError> {
        let name = name.into();
        orphan::tell(command);
        // Held meanwhile, so that a signal finds every program that was started.
        let mut running = running();
        match command.spawn() {
            Ok(child) => {
                running.push(Pid::from_child(&child));
                Ok(Self { name, child, ended: None })
            }
            Err(cause) => {
                Err(ChildError(format!("cannot start {name}: {cause}; see that it is installed")))
            }
        }
    }

    /// Starts any other program such that it ends when this one is killed, as an isochrone program does; errors call
    /// it `name`. `set_up` adds its arguments and other settings.
    ///
    /// This program is run once more for it, and calls [`end_with_parent`](crate::end_with_parent), which replaces it
    /// by the other. If that fails, its exit status is 126, and its stderr says why.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn start_bound(
        name: impl Into<String>,
        program: &OsStr,
        set_up: impl FnOnce(&mut Command) -> &mut Command,
    ) -> Result<Self, ChildError> {
        Self::start(name, set_up(&mut orphan::bound(program)))
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Its stdin, if it is piped; `None` on later calls.
    pub fn stdin(&mut self) -> Option<ChildStdin> {
        self.child.stdin.take()
    }

    /// Its stdout, if it is piped; `None` on later calls.
    pub fn stdout(&mut self) -> Option<ChildStdout> {
        self.child.stdout.take()
    }

    /// Its stderr, if it is piped; `None` on later calls.
    pub fn stderr(&mut self) -> Option<ChildStderr> {
        self.child.stderr.take()
    }

    /// Its exit status; `None` while it runs.
    ///
    /// # Errors
    /// Another part of the program has already waited for it.
    pub fn ended(&mut self) -> Result<Option<ExitStatus>, ChildError> {
        if self.ended.is_none() {
            let ended = self.child.try_wait();
            self.ended = ended.map_err(|cause| self.lost(cause))?;
            self.forget();
        }
        Ok(self.ended)
    }

    /// Fails unless it still runs.
    ///
    /// # Errors
    /// It has ended, or another part of the program has already waited for it.
    pub fn check(&mut self) -> Result<(), ChildError> {
        match self.ended()? {
            Some(status) => Err(ChildError(format!("{} ended early: {status}", self.name))),
            None => Ok(()),
        }
    }

    /// Waits until it ends by itself.
    ///
    /// # Errors
    /// Another part of the program has already waited for it.
    pub fn wait(&mut self) -> Result<ExitStatus, ChildError> {
        let waited = self.child.wait().map_err(|cause| self.lost(cause));
        self.ended = waited.as_ref().ok().copied().or(self.ended);
        self.forget();
        waited
    }

    /// Waits until it ends by itself, up to a limit; `None` if it still runs then.
    ///
    /// # Errors
    /// Another part of the program has already waited for it.
    pub fn wait_within(&mut self, patience: Duration) -> Result<Option<ExitStatus>, ChildError> {
        let since = Instant::now();
        loop {
            let ended = self.ended()?;
            if ended.is_some() || since.elapsed() >= patience {
                return Ok(ended);
            }
            thread::sleep(LOOK_INTERVAL);
        }
    }

    /// Sends it a signal, unless it is known to have ended: another process may have its id by then.
    pub fn signal(&self, signal: Signal) {
        if self.ended.is_none() {
            let _ = kill_process(Pid::from_child(&self.child), signal);
        }
    }

    /// Asks it to end (SIGTERM), kills it if it does not within two minutes, and waits until it is
    /// gone.
    ///
    /// # Errors
    /// Another part of the program has already waited for it.
    pub fn end(&mut self) -> Result<ExitStatus, ChildError> {
        if self.ended()?.is_none() {
            self.signal(Signal::TERM);
        }
        match self.wait_within(PATIENCE)? {
            Some(status) => Ok(status),
            None => self.kill(),
        }
    }

    /// Kills it, and waits until it is gone.
    ///
    /// # Errors
    /// Another part of the program has already waited for it.
    pub fn kill(&mut self) -> Result<ExitStatus, ChildError> {
        if self.ended()?.is_none() {
            self.signal(Signal::KILL);
        }
        self.wait()
    }

    /// Ends a program of isochrone as [`end`](Self::end) does, and checks its exit status: success, or
    /// that it was ended before it had begun or before a frame arrived.
    ///
    /// # Errors
    /// It failed.
    pub fn finish(&mut self) -> Result<(), ChildError> {
        let status = self.end()?;
        let is_told = status.signal() == Some(Signal::TERM.as_raw());
        if status.success() || status.code() == Some(Ending::Nobody as i32) || is_told {
            return Ok(());
        }
        Err(ChildError(format!("{} failed: {status}", self.name)))
    }

    fn lost(&self, cause: io::Error) -> ChildError {
        ChildError(format!("{} is nowhere to be found: {cause}", self.name))
    }

    /// Its id may be reused as soon as its end was seen.
    fn forget(&self) {
        if self.ended.is_some() {
            running().retain(|program| *program != Pid::from_child(&self.child));
        }
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        // Not SIGKILL at once, which would leave its own children and files behind.
        let _ = self.end();
    }
}

isochrone_model::debug_as_display!(ChildError);

#[cfg(test)]
mod tests {
    use super::*;

    fn sleep() -> Child {
        Child::start("sleep", Command::new("sleep").arg("60")).unwrap()
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
        assert!(program.check().is_ok());
        let id = Pid::from_child(&program.child);
        kill_process(id, Signal::KILL).unwrap();
        let status = program.wait_within(PATIENCE).unwrap().unwrap();
        assert!(!status.success() && !running().contains(&id));
        let early = program.check().unwrap_err().to_string();
        assert!(early.contains("sleep ended early"), "{early}");
    }

    #[test]
    fn a_program_that_does_not_listen_is_killed() {
        let mut program = sleep();
        program.signal(Signal::STOP);
        assert_eq!(program.wait_within(Duration::from_millis(20)).unwrap(), None);
        assert_eq!(program.kill().unwrap().signal(), Some(Signal::KILL.as_raw()));
    }

    #[test]
    fn a_program_that_does_not_exist_is_named() {
        let error = Child::start("nonsense", &mut Command::new("/no/such/program")).unwrap_err();
        assert!(error.to_string().starts_with("cannot start nonsense: "), "{error}");
    }
}
