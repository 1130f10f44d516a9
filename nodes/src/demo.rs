//! `demo`: publisher, control node and subscriber as three processes.

use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use isochrone_ipc::{ipc, load_config, remove_leftovers};
use isochrone_timing::Report;
use rustix::process::{Pid, Signal, kill_process};

use crate::failure::Failure;
use crate::stop::{Stop, parse_seconds};
use crate::terminal;

/// Run publisher, control node and subscriber as three processes and show live values
///
/// A 4-20 mA transmitter is simulated, its level scaled and ramped. Ends with a summary of jitter
/// and latency.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// End after this many seconds
    #[arg(long, default_value = "10", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: f64,
    /// Print the summary as JSON; live values go to stderr
    #[arg(long)]
    json: bool,
}

impl Default for Args {
    fn default() -> Self {
        Self { seconds: 10.0, json: false }
    }
}

const CONFIGURATION: &str = include_str!("../../examples/level.toml");
const INPUT: &str = "plant/analog";
const OUTPUT: &str = "plant/level";
/// The subscriber shows every 500th frame: two lines a second.
const SHOWN: &str = "500";
/// How long the children outlive a parent that was killed.
const GRACE_S: f64 = 5.0;
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let stop = Stop::on_signal(Some(args.seconds))?;
    let folder = Folder::create()?;
    let limit = (args.seconds + GRACE_S).to_string();
    let mut node = folder.start(&["run", "level.toml", "--json", "--seconds", &limit])?;
    let mut publisher = folder.start(&[
        "publish",
        INPUT,
        "--wave",
        "sine",
        "--amplitude",
        "13824",
        "--offset",
        "13824",
        "--frequency",
        "0.2",
        "--seconds",
        &limit,
    ])?;
    let mut subscriber = folder.start(&[
        "subscribe",
        OUTPUT,
        "--stats",
        "--json",
        "--every",
        SHOWN,
        "--spin",
        "--seconds",
        &limit,
    ])?;
    let node_report = node.document(|_| ());
    let _ = publisher.document(|_| ());
    let json = args.json;
    let link_report = subscriber.document(move |line| match json {
        true => terminal::note(line),
        // The pipe's reader may be gone; the summary will tell.
        false => drop(terminal::print(&format!("{line}\n"))),
    });

    let mut early = None;
    while early.is_none() && !stop.is_due() {
        thread::sleep(LOOK_INTERVAL);
        early = [&mut node, &mut publisher, &mut subscriber].into_iter().find_map(Process::failure);
    }
    // From the reader to the writer, so that the reader sees no end of its frames.
    let failures = [subscriber.end(), node.end(), publisher.end()];
    if let Some(failure) = early.or(failures.into_iter().flatten().next()) {
        return Err(failure);
    }
    let reports = [node_report, link_report].map(|report| report.recv().unwrap_or_default());
    if reports.iter().any(String::is_empty) {
        terminal::note("stopped before anything was measured");
        return Ok(());
    }
    let [node, link] = reports.map(|report| parse(&report));
    let (node, link) = (node?, link?);
    let report = Report {
        command: vec!["demo".into(), "--seconds".into(), args.seconds.to_string()],
        links: link.links,
        ..node
    };
    match args.json {
        true => terminal::print_json(&report),
        false => terminal::print(&format!("\n{report}")),
    }
}

fn parse(document: &str) -> Result<Report, Failure> {
    let unreadable = |error| Failure::found(format!("a process's report cannot be read: {error}"));
    serde_json::from_str(document).map_err(unreadable)
}

/// Where the demo lives: its configuration, and an iceoryx2 domain of its own, so that it meets
/// nothing else that runs on the machine.
struct Folder {
    folder: tempfile::TempDir,
}

const DOMAIN_FILE: &str = "iceoryx2.toml";

impl Folder {
    fn create() -> Result<Self, Failure> {
        let folder = tempfile::Builder::new()
            .prefix("isochrone-")
            .tempdir()
            .map_err(|error| Failure::found(format!("cannot create a folder: {error}")))?;
        let domain = format!(
            "[global]\nroot-path = {:?}\nprefix = \"isodemo{}_\"\n",
            folder.path().display().to_string(),
            std::process::id()
        );
        for (name, text) in [("level.toml", CONFIGURATION), (DOMAIN_FILE, &domain)] {
            std::fs::write(folder.path().join(name), text)
                .map_err(|error| Failure::found(format!("cannot write {name}: {error}")))?;
        }
        Ok(Self { folder })
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Starts this program with a verb.
    fn start(&self, arguments: &[&str]) -> Result<Process, Failure> {
        let verb = arguments.first().copied().unwrap_or_default().to_owned();
        let child = std::env::current_exe().and_then(|program| {
            Command::new(program)
                .args(arguments)
                .args(["--iceoryx2-config", DOMAIN_FILE])
                .current_dir(self.path())
                // A Ctrl-C of the terminal is for us; we end the children in order.
                .process_group(0)
                .stdin(Stdio::null())
                .stdout(Stdio::piped())
                .spawn()
        });
        let child =
            child.map_err(|error| Failure::found(format!("cannot start {verb}: {error}")))?;
        Ok(Process { verb, child, ended: false })
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if let Ok(config) = load_config(Some(&self.path().join(DOMAIN_FILE))) {
            remove_leftovers::<ipc::Service>(&config);
        }
    }
}

/// One of the three processes. It is killed if the demo ends without ending it.
struct Process {
    verb: String,
    child: Child,
    ended: bool,
}

impl Process {
    /// Reads its stdout in the background: hands on line after line, and in the end sends what
    /// follows from the first line "{": a JSON document.
    fn document(&mut self, line: impl Fn(&str) + Send + 'static) -> Receiver<String> {
        let (sender, receiver) = channel();
        if let Some(stdout) = self.child.stdout.take() {
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

    /// Why the process ended, if it did so before it was told to.
    fn failure(&mut self) -> Option<Failure> {
        let status = self.child.try_wait().ok().flatten()?;
        self.ended = true;
        Some(Failure::found(format!("`isochrone {}` ended early: {status}", self.verb)))
    }

    /// Ends the process with SIGTERM and waits for it.
    fn end(&mut self) -> Option<Failure> {
        if !self.ended
            && let Ok(pid) = i32::try_from(self.child.id())
            && let Some(pid) = Pid::from_raw(pid)
        {
            let _ = kill_process(pid, Signal::TERM);
        }
        let status = self.child.wait();
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
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}
