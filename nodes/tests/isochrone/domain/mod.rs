//! An iceoryx2 domain for each test and the processes in it, so that tests run in parallel and
//! leave nothing behind.
#![allow(dead_code, reason = "each test file uses a part")]

use std::io::{BufRead, BufReader, Read, Write};
use std::ops::Deref;
use std::path::PathBuf;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use isochrone_ipc::{IsolatedDomain, Participant, ipc};
use isochrone_processes::Child;
use rustix::process::Signal;
use serde_json::Value;

/// Longer than anything here takes on a machine that is busy with other tests.
pub(crate) const PATIENCE: Duration = Duration::from_secs(180);

/// Waits until something is so, and leaves the CPU to others in between.
#[track_caller]
pub(crate) fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let since = Instant::now();
    while !is_so() {
        assert!(since.elapsed() < PATIENCE, "waited until {what}");
        thread::sleep(Duration::from_millis(2));
    }
}

/// A domain in which a node runs, whose configuration is in the file `tank.toml`.
pub(crate) fn tank(text: &str) -> (Domain, Process) {
    let domain = Domain::new();
    domain.write("tank.toml", text);
    let mut node = domain.start("run tank.toml");
    node.wait_for("is running");
    (domain, node)
}

/// A node that passes its input on.
pub(crate) const RELAY: &str = r#"
[node]
name = "relay"
[[task]]
name = "t"
period = "2ms"
[[input]]
name = "x"
service = "relay/in"
[[output]]
service = "relay/out"
signals = ["x"]
"#;

/// [`RELAY`] with further keys of its input, and entries behind it.
pub(crate) fn relay_with(keys: &str) -> String {
    RELAY.replace("[[output]]", &format!("{keys}\n[[output]]"))
}

pub(crate) struct Domain(IsolatedDomain);

impl Domain {
    pub(crate) fn new() -> Self {
        Self(IsolatedDomain::new("isoproc").unwrap())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.folder().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) -> PathBuf {
        std::fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    pub(crate) fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    /// Waits until a recording holds the row of a cycle: what has arrived is written at the reader's
    /// next look.
    #[track_caller]
    pub(crate) fn wait_for_cycle(&self, name: &str, cycle: u64) {
        let is_of_cycle = |row: &str| row.split(',').nth(1) == Some(&cycle.to_string());
        self.wait_for_recording(name, |text| text.lines().any(is_of_cycle));
    }

    /// Waits until a recording holds so many rows.
    #[track_caller]
    pub(crate) fn wait_for_rows(&self, name: &str, rows: usize) {
        self.wait_for_recording(name, |text| text.lines().count() > rows);
    }

    #[track_caller]
    fn wait_for_recording(&self, name: &str, is_complete: impl Fn(&str) -> bool) {
        let since = Instant::now();
        while !std::fs::read_to_string(self.path(name)).is_ok_and(|text| is_complete(&text)) {
            assert!(since.elapsed() < PATIENCE, "{name}: {}", self.read(name));
            thread::sleep(Duration::from_millis(2));
        }
    }

    pub(crate) fn config_file(&self) -> PathBuf {
        self.0.file()
    }

    /// Joins it from within the test.
    pub(crate) fn join(&self, name: &str) -> Participant<ipc::Service> {
        Participant::join(name, &self.0).unwrap()
    }

    /// Starts the program in this domain; the arguments are separated by spaces.
    pub(crate) fn start(&self, arguments: &str) -> Process {
        self.start_with(&arguments.split_whitespace().collect::<Vec<_>>())
    }

    /// Starts the program in this domain with arguments as they are.
    pub(crate) fn start_with(&self, arguments: &[&str]) -> Process {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
        command.args(arguments).current_dir(self.0.folder());
        if !["simulate", "compare", "check", "replay"].contains(&arguments[0]) {
            command.arg("--iceoryx2-config").arg(self.config_file());
        }
        Process::start(command)
    }

    /// Runs the program to its end.
    pub(crate) fn run(&self, arguments: &str) -> Ended {
        self.start(arguments).finish()
    }

    /// What the program prints that does what it should and has nothing to remark.
    #[track_caller]
    pub(crate) fn stdout(&self, arguments: &str) -> String {
        let ended = self.run(arguments).expect_code(0);
        assert_eq!(ended.complaints(), "", "{arguments}");
        ended.stdout
    }

    /// Files that are left, in shared memory and in the root path.
    pub(crate) fn leftovers(&self) -> Vec<PathBuf> {
        self.0.files()
    }
}

impl Deref for Domain {
    type Target = IsolatedDomain;

    fn deref(&self) -> &IsolatedDomain {
        &self.0
    }
}

/// Says that this machine lacks what a test needs. It goes past the test harness, which keeps what
/// tests that pass print to itself.
pub(crate) fn not_tested(what: &str, why: &str) {
    let _ = writeln!(std::io::stderr(), "NOT TESTED: {what}: {why}");
}

/// Files in shared memory whose names begin with `prefix`.
pub(crate) fn shared_memory(prefix: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir("/dev/shm").unwrap();
    let of_domain = |path: &PathBuf| {
        path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix))
    };
    entries.map(|entry| entry.unwrap().path()).filter(of_domain).collect()
}

/// A process and what it printed so far. It is killed when the test ends without ending it.
pub(crate) struct Process {
    child: Child,
    stdout: Text,
    stderr: Text,
}

pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Ended {
    #[track_caller]
    pub(crate) fn expect_code(self, code: i32) -> Self {
        assert_eq!(self.status.code(), Some(code), "{}\n{}", self.stdout, self.stderr);
        self
    }

    /// What it printed to standard error, without the word that it waited for another process to have
    /// started or ended: on a busy machine this is so at any time.
    pub(crate) fn complaints(&self) -> String {
        let waited = |line: &&str| line.contains("waiting for process");
        self.stderr.lines().filter(|line| !waited(line)).collect::<Vec<_>>().join("\n")
    }
}

/// The command with SIGINT and SIGHUP as a terminal would have them: a program goes on ignoring what the
/// test's own process was started to ignore, in the background of a script or under `nohup`.
fn with_default_signals(command: Command) -> Command {
    const INT_AND_HUP: u64 = 0b11;
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
    if u64::from_str_radix(ignored.trim(), 16).unwrap() & INT_AND_HUP == 0 {
        return command;
    }
    let mut env = Command::new("env");
    env.arg("--default-signal=INT,HUP").arg(command.get_program()).args(command.get_args());
    if let Some(folder) = command.get_current_dir() {
        env.current_dir(folder);
    }
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => env.env(name, value),
            None => env.env_remove(name),
        };
    }
    env
}

impl Process {
    pub(crate) fn start(command: Command) -> Self {
        let mut command = with_default_signals(command);
        let piped = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let name = format!("{:?}", piped.get_program());
        let mut child = Child::start(name, piped).unwrap();
        let stdout = Text::collect(child.stdout().unwrap());
        let stderr = Text::collect(child.stderr().unwrap());
        Self { child, stdout, stderr }
    }

    /// Waits until a text stands in what the process printed.
    #[track_caller]
    pub(crate) fn wait_for(&mut self, text: &str) {
        self.wait_until(text, |stdout, stderr| stdout.contains(text) || stderr.contains(text));
    }

    /// Waits until something is so of the process.
    #[track_caller]
    pub(crate) fn wait_until_it(&mut self, does: &str, mut met: impl FnMut(&Self) -> bool) {
        let since = Instant::now();
        while !met(self) {
            let waits = !self.is_over() && since.elapsed() < PATIENCE;
            assert!(waits, "waited until it {does}\n{}\n{}", self.stdout.get(), self.stderr.get());
            thread::sleep(Duration::from_millis(2));
        }
    }

    #[track_caller]
    pub(crate) fn wait_until(&mut self, what: &str, mut met: impl FnMut(&str, &str) -> bool) {
        let since = Instant::now();
        loop {
            // Asked first: what it said last is there by the time that it is over.
            let is_over = self.is_over();
            let (stdout, stderr) = (self.stdout.get(), self.stderr.get());
            if met(&stdout, &stderr) {
                break;
            }
            let waits = !is_over && since.elapsed() < PATIENCE;
            assert!(waits, "waited for {what}\n{stdout}\n{stderr}");
            thread::sleep(Duration::from_millis(2));
        }
    }

    /// Whether it has ended, and all that it printed was read.
    pub(crate) fn is_over(&mut self) -> bool {
        self.child.check().is_err() && self.stdout.is_complete() && self.stderr.is_complete()
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        self.child.signal(signal);
    }

    /// Whether the process handles SIGHUP, SIGINT and SIGTERM itself.
    pub(crate) fn handles_signals(&self) -> bool {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.id())).unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
        let caught = u64::from_str_radix(caught.trim(), 16).unwrap();
        let handles = |signal: &Signal| caught >> (signal.as_raw() - 1) & 1 == 1;
        [Signal::HUP, Signal::INT, Signal::TERM].iter().all(handles)
    }

    /// Waits until it does so.
    #[track_caller]
    pub(crate) fn wait_until_it_handles_signals(&mut self) {
        self.wait_until_it("handles signals", Self::handles_signals);
    }

    /// Kills the process as a crash would.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
    }

    /// Sends SIGTERM and waits for the end.
    pub(crate) fn stop(self) -> Ended {
        self.signal(Signal::TERM);
        self.finish()
    }

    /// Waits for the end.
    pub(crate) fn finish(mut self) -> Ended {
        self.ended_within(PATIENCE).unwrap_or_else(|| {
            panic!("the process does not end\n{}\n{}", self.stdout.get(), self.stderr.get())
        })
    }

    /// Waits for the end, so long.
    pub(crate) fn ended_within(&mut self, time: Duration) -> Option<Ended> {
        let status = self.child.wait_within(time).unwrap()?;
        Some(Ended { status, stdout: self.stdout.finish(), stderr: self.stderr.finish() })
    }
}

impl Drop for Process {
    fn drop(&mut self) {
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
