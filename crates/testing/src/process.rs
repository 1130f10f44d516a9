//! Programs that tests start.

use std::borrow::BorrowMut;
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::{Command, ExitStatus, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_processes::Child;
use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, prlimit};
use serde_json::Value;

use crate::{PATIENCE, afresh, assert_says, wait_for_ok};

/// The program `isochrone`, as cargo built it beside the test program that runs.
pub fn program() -> PathBuf {
    let own = std::env::current_exe().unwrap();
    // target/<profile>/deps/<test>
    let program = own.ancestors().nth(2).unwrap().join("isochrone");
    assert!(program.exists(), "{program:?} is not built: cargo build -p isochrone-cli");
    program
}

/// Why this user cannot mount file systems for processes of his own (`unshare -rm`); `None`: he can.
pub fn mount_refusal() -> Option<String> {
    let probe = ["-rm", "mount", "-t", "tmpfs", "tmpfs", "/dev/shm"];
    match Command::new("unshare").args(probe).stdin(Stdio::null()).output() {
        Ok(output) if output.status.success() => None,
        Ok(output) => Some(String::from_utf8_lossy(&output.stderr).trim().to_owned()),
        Err(error) => Some(format!("unshare: {error}")),
    }
}

/// A process and what it printed so far. What happens to it when it is dropped: see [`Process::ends_in_order`].
pub struct Process {
    child: Child,
    ends_in_order: bool,
    stdout: Text,
    stderr: Text,
}

/// How a process ended, and what it printed.
pub struct Ended {
    /// Its exit status.
    pub status: ExitStatus,
    /// All that it printed to standard output.
    pub stdout: String,
    /// All that it printed to standard error.
    pub stderr: String,
}

impl Ended {
    /// It ended with this exit status.
    #[track_caller]
    pub fn expect_code(self, code: i32) -> Self {
        assert_eq!(self.status.code(), Some(code), "{}\n{}", self.stdout, self.stderr);
        self
    }

    /// Its exit status.
    #[track_caller]
    pub fn code(&self) -> i32 {
        self.status.code().unwrap_or_else(|| panic!("{}", self.status))
    }

    /// It printed all of this to standard error.
    #[track_caller]
    pub fn says<S: AsRef<str>>(self, parts: &[S]) -> Self {
        assert_says(&self.stderr, parts);
        self
    }

    /// It printed all of this to standard output.
    #[track_caller]
    pub fn prints<S: AsRef<str>>(self, parts: &[S]) -> Self {
        assert_says(&self.stdout, parts);
        self
    }

    /// The JSON that it printed to standard output.
    #[track_caller]
    pub fn json(&self) -> Value {
        let Self { stdout, stderr, .. } = self;
        serde_json::from_str(stdout).unwrap_or_else(|error| panic!("{error}: {stdout}\n{stderr}"))
    }

    /// It did what it should, and had nothing to remark: what it printed to standard output.
    #[track_caller]
    pub fn silently(self) -> String {
        let ended = self.expect_code(0);
        assert_eq!(ended.complaints(), "");
        ended.stdout
    }

    /// It refused with this exit status, and printed no result: what it said.
    #[track_caller]
    pub fn refused(self, code: i32) -> String {
        let ended = self.expect_code(code);
        assert_eq!(ended.stdout, "", "{}", ended.stderr);
        ended.stderr
    }

    /// Whatever a user does, there is no panic, no backtrace, and no escape sequence in a pipe.
    #[track_caller]
    pub fn expect_readable(self) -> Self {
        let Self { stdout, stderr, .. } = &self;
        for ugly in ["panicked", "backtrace", "\u{1b}"] {
            let is_ugly = stdout.contains(ugly) || stderr.contains(ugly);
            assert!(!is_ugly, "{ugly:?} in:\n{stdout}\n{stderr}");
        }
        self
    }

    /// What it printed to standard error, without the word that it waited for another process to have
    /// started or ended: on a busy machine this is so at any time.
    pub fn complaints(&self) -> String {
        let waited = |line: &&str| line.contains("waiting for process");
        self.stderr.lines().filter(|line| !waited(line)).collect::<Vec<_>>().join("\n")
    }
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Self { status: output.status, stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

impl Process {
    /// Starts a program [`afresh`], with its output piped and nothing to read.
    pub fn start(mut command: impl BorrowMut<Command>) -> Self {
        let command = command.borrow_mut();
        let piped = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let name = format!("{:?}", piped.get_program());
        let mut child = Child::start(name, afresh(piped)).unwrap();
        let stdout = Text::collect(child.stdout().unwrap());
        let stderr = Text::collect(child.stderr().unwrap());
        Self { child, ends_in_order: false, stdout, stderr }
    }

    /// From now on it must end in order when it is dropped: on SIGTERM, with exit status 0. Otherwise it is killed.
    pub fn ends_in_order(mut self) -> Self {
        self.ends_in_order = true;
        self
    }

    /// Waits until a text stands in what the process printed.
    #[track_caller]
    pub fn wait_for(&mut self, text: &str) {
        self.wait_until(text, |stdout, stderr| stdout.contains(text) || stderr.contains(text));
    }

    /// Waits until something is so of what the process printed to standard output and standard error.
    #[track_caller]
    pub fn wait_until(&mut self, what: &str, mut met: impl FnMut(&str, &str) -> bool) {
        let what = format!("prints {what}");
        self.wait_until_it(&what, |process| met(&process.stdout.get(), &process.stderr.get()));
    }

    /// Waits until something is so of the process. One that has ended does nothing more.
    #[track_caller]
    pub fn wait_until_it(&mut self, does: &str, mut met: impl FnMut(&Self) -> bool) {
        let is_met = wait_for_ok(&format!("it {does}"), || {
            // Asked first: what it said last is there by the time that it is over.
            let is_over = self.is_over();
            let is_met = met(self);
            if is_met || is_over { Ok(is_met) } else { Err(self.printed()) }
        });
        assert!(is_met, "it ended before it {does}: {}", self.printed());
    }

    /// All that it has printed so far.
    pub fn printed(&self) -> String {
        format!("\n{}\n{}", self.stdout.get(), self.stderr.get())
    }

    /// Whether it has ended, and all that it printed was read.
    pub fn is_over(&mut self) -> bool {
        self.child.check().is_err() && self.stdout.is_complete() && self.stderr.is_complete()
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal.
    pub fn signal(&self, signal: Signal) {
        self.child.signal(signal);
    }

    /// Lets it have so much of a resource; `None`: as much as this process may.
    pub fn limit(&self, resource: Resource, most: Option<u64>) {
        let own = getrlimit(resource);
        let limit = Rlimit { current: most.or(own.maximum), maximum: own.maximum };
        prlimit(Pid::from_raw(self.id().cast_signed()), resource, limit).unwrap();
    }

    /// Whether the process handles SIGHUP, SIGINT and SIGTERM itself.
    pub fn handles_signals(&self) -> bool {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.id())).unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
        let caught = u64::from_str_radix(caught.trim(), 16).unwrap();
        let handles = |signal: &Signal| caught >> (signal.as_raw() - 1) & 1 == 1;
        [Signal::HUP, Signal::INT, Signal::TERM].iter().all(handles)
    }

    /// Waits until it does so.
    #[track_caller]
    pub fn wait_until_it_handles_signals(&mut self) {
        self.wait_until_it("handles signals", Self::handles_signals);
    }

    /// Kills the process as a crash would.
    pub fn kill(mut self) {
        self.ends_in_order = false;
        self.child.kill().unwrap();
    }

    /// Sends SIGTERM and waits for the end.
    pub fn stop(self) -> Ended {
        self.signal(Signal::TERM);
        self.finish()
    }

    /// Waits for the end.
    pub fn finish(mut self) -> Ended {
        self.wait_for_end()
    }

    fn wait_for_end(&mut self) -> Ended {
        let ended = self.ended_within(PATIENCE);
        ended.unwrap_or_else(|| panic!("the process does not end{}", self.printed()))
    }

    /// Waits for the end, so long.
    pub fn ended_within(&mut self, time: Duration) -> Option<Ended> {
        let status = self.child.wait_within(time).unwrap()?;
        self.ends_in_order = false;
        Some(Ended { status, stdout: self.stdout.finish(), stderr: self.stderr.finish() })
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if self.ends_in_order && !thread::panicking() {
            self.signal(Signal::TERM);
            self.wait_for_end().expect_code(0);
        }
        let _ = self.child.kill();
    }
}

/// What comes out of a pipe.
struct Text {
    text: Arc<Mutex<String>>,
    reader: Option<JoinHandle<()>>,
}

impl Text {
    fn collect(pipe: impl Read + Send + 'static) -> Self {
        let text = Arc::new(Mutex::new(String::new()));
        let collected = text.clone();
        let reader = thread::spawn(move || {
            for line in BufReader::new(pipe).lines() {
                let line = line.unwrap();
                collected.lock().unwrap().push_str(&(line + "\n"));
            }
        });
        Self { text, reader: Some(reader) }
    }

    fn get(&self) -> String {
        self.text.lock().unwrap().clone()
    }

    fn is_complete(&self) -> bool {
        self.reader.as_ref().is_none_or(JoinHandle::is_finished)
    }

    fn finish(&mut self) -> String {
        self.reader.take().unwrap().join().unwrap();
        self.get()
    }
}
