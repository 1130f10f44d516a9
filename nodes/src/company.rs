//! Several processes of this program that belong together, in an iceoryx2 domain of their own.

use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use isochrone_ipc::IsolatedDomain;
use rustix::process::Signal;

use crate::failure::Failure;
use crate::stop::Program;

/// Where the processes live: an iceoryx2 domain of its own and the folder that it is in, so that they
/// meet nothing else that runs on the machine. Drop the processes before.
pub(crate) struct Company {
    domain: IsolatedDomain,
}

impl Company {
    /// Makes the domain, whose prefix begins with a word.
    pub(crate) fn gather(word: &str) -> Result<Self, Failure> {
        Ok(Self { domain: IsolatedDomain::new(word).map_err(Failure::found)? })
    }

    pub(crate) fn domain(&self) -> &IsolatedDomain {
        &self.domain
    }

    pub(crate) fn path(&self) -> &Path {
        self.domain.folder()
    }

    /// Writes a file into the folder.
    pub(crate) fn write(&self, name: &str, text: &str) -> Result<(), Failure> {
        std::fs::write(self.path().join(name), text)
            .map_err(|error| Failure::found(format!("cannot write {name}: {error}")))
    }

    /// Starts this program with a verb, in the folder and the domain.
    pub(crate) fn start(&self, arguments: &[&str]) -> Result<Process, Failure> {
        let file = self.domain.file().display().to_string();
        let domain = ["--iceoryx2-config", &file];
        self.start_with(&[arguments, &domain].concat(), |command| command.stdin(Stdio::null()))
    }

    /// Starts this program with a verb, in the folder.
    pub(crate) fn start_with(
        &self,
        arguments: &[&str],
        set_up: impl FnOnce(&mut Command) -> &mut Command,
    ) -> Result<Process, Failure> {
        let verb = arguments.first().copied().unwrap_or_default().to_owned();
        let program = std::env::current_exe().and_then(|program| {
            let mut command = Command::new(program);
            // A Ctrl-C of the terminal is for us; we end the children in order.
            command.args(arguments).current_dir(self.path()).process_group(0);
            Program::start(set_up(command.stdout(Stdio::piped())))
        });
        let program =
            program.map_err(|error| Failure::found(format!("cannot start {verb}: {error}")))?;
        Ok(Process { verb, program, ended: false })
    }
}

/// A process of the company. It is killed if nobody ends it before.
pub(crate) struct Process {
    verb: String,
    program: Program,
    ended: bool,
}

impl Process {
    /// Reads its stdout in the background: hands on line after line, and in the end sends what
    /// follows from the first line "{": a JSON document.
    pub(crate) fn document(&mut self, line: impl Fn(&str) + Send + 'static) -> Receiver<String> {
        let (sender, receiver) = channel();
        if let (Some(stdout), _) = self.program.printed() {
            thread::spawn(move || {
                let mut stdout = BufReader::new(stdout);
                let mut text = String::new();
                while stdout.read_line(&mut text).is_ok_and(|length| length > 0) {
                    if text == "{\n" {
                        let _ = stdout.read_to_string(&mut text);
                        break;
                    }
                    line(text.trim_end());
                    text.clear();
                }
                let _ = sender.send(text);
            });
        }
        receiver
    }

    /// The pipes to its stdin, where one was asked for, and from its stdout, once.
    pub(crate) fn pipes(&mut self) -> (Option<ChildStdin>, Option<ChildStdout>) {
        (self.program.stdin(), self.program.printed().0)
    }

    /// Why the process ended, if it did so before it was told to.
    pub(crate) fn failure(&mut self) -> Option<Failure> {
        let status = self.program.ended().ok().flatten()?;
        self.ended = true;
        Some(Failure::found(format!("`isochrone {}` ended early: {status}", self.verb)))
    }

    /// Ends the process with SIGTERM and waits for it.
    pub(crate) fn end(&mut self) -> Option<Failure> {
        let status = self.program.end();
        let told = Some(Signal::TERM.as_raw());
        self.ended = true;
        match status {
            Ok(status) if status.success() => None,
            // It was told to end before it had begun, or before a frame came.
            Ok(status) if status.code() == Some(3) || status.signal() == told => None,
            Ok(status) => {
                Some(Failure::found(format!("`isochrone {}` failed: {status}", self.verb)))
            }
            Err(error) => Some(Failure::found(format!("`isochrone {}`: {error}", self.verb))),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if !self.ended {
            let _ = self.program.kill();
        }
    }
}
