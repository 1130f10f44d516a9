//! Turns of the real cyclictest: its latencies, one by one, as the records of a loop.

mod transcript;

use std::io::Read;
use std::process::{ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::EPOCH_OFFSET_NS;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::format_duration_ns;
use isochrone_processes::Child;

use self::transcript::{Chunk, SECOND_NS, Transcript};
use super::settings::JitterSettings;
use super::turn::{Terms, Turn, TurnResult, Used, cycles};
use crate::BenchError;
use crate::watch::{LOOK_INTERVAL, Watching, allowed_cpus, keep_off};

/// At shorter periods it writes full buffers instead of lines: there is one every few milliseconds.
const LINES_FROM_NS: u64 = 100_000;

/// Whether it is installed, and can run what the other arms run.
pub(super) fn check(settings: &JitterSettings) -> Result<(), BenchError> {
    if settings.priority.is_none() {
        return Err(BenchError::Usage("cyclictest runs with a priority; give --priority".into()));
    }
    let periods = settings.periods_ns.iter().map(|period_ns| ("period", *period_ns));
    for (what, ns) in periods.chain([("phase", settings.phase_ns)]) {
        if ns % 1_000 != 0 {
            return Err(BenchError::Usage(format!(
                "the arm cyclictest cannot run at a {what} of {}: it knows whole microseconds only; give \
                 another --{what}, or leave the arm out (--arms sleep,hybrid)",
                format_duration_ns(ns)
            )));
        }
    }
    let help = Command::new("cyclictest").arg("--help").output();
    if help.is_err() || !rustix::process::geteuid().is_root() {
        let missing = "cyclictest is not installed, or may not run: install rt-tests and be root";
        return Err(BenchError::Usage(missing.into()));
    }
    Ok(())
}

/// Runs it for the turn.
pub(super) fn turn(terms: &Terms, turn: &Turn<'_>) -> Result<TurnResult, BenchError> {
    let failed = |what: String| BenchError::Failed(format!("cyclictest: {what}"));
    // Begun first, so that the counted part of the turn is watched from its beginning.
    let watching = Watching::begin(terms.cpu, None);
    let mut program = Child::start("cyclictest", &mut command(terms, turn.counted))?;
    let (stdout, stderr) = (program.stdout(), program.stderr());
    let printed = listen(stdout.ok_or_else(|| failed("its output is missing".into()))?, terms.cpu)
        .map_err(|error| failed(format!("cannot start a thread: {error}")))?;
    let mut transcript =
        Transcript::new(terms.period_ns, EPOCH_OFFSET_NS + terms.phase_ns, turn.counted);
    let mut meter = Meter::new(program.id());
    let ended = loop {
        thread::sleep(LOOK_INTERVAL);
        let is_over = transcript.drain(&printed).map_err(failed)?;
        if transcript.counts() {
            meter.look();
        }
        (turn.pass)();
        if is_over || transcript.is_complete() || turn.stop.is_due() {
            break is_over;
        }
    };
    let watch = watching.end();
    // Ctrl-C ends it, too.
    if ended && !transcript.is_complete() && !turn.stop.is_due() {
        let mut said = String::new();
        if let Some(mut stderr) = stderr {
            let _ = stderr.read_to_string(&mut said);
        }
        let cycles = transcript.printed;
        return Err(failed(format!("it ended after {cycles} cycles of the turn. {}", said.trim())));
    }
    drop(program);
    Ok(TurnResult {
        counted: transcript.counted(),
        records: transcript.records,
        follows: Vec::new(),
        watch,
        thread_usage: None,
        grant: None,
        margin_ns: None,
        used: meter.used(),
        warnings: Vec::new(),
    })
}

fn command(terms: &Terms, counted: Duration) -> Command {
    let mut command = Command::new("cyclictest");
    command
        .args(["--verbose", "--nsecs", "--mlockall", "--threads=1"])
        .arg(format!("--priority={}", terms.request.priority.unwrap_or(1)))
        // It counts its phase from whole seconds.
        .arg(format!("--secaligned={}", (EPOCH_OFFSET_NS + terms.phase_ns) % SECOND_NS / 1_000))
        .arg(format!("--affinity={}", terms.cpu))
        .arg(format!("--interval={}", terms.period_ns / 1_000))
        // Its own end, should nobody be left to end it.
        .arg(format!("--loops={}", cycles(terms.period_ns, counted)))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    if terms.period_ns >= LINES_FROM_NS {
        command.arg("--unbuffered");
    }
    // What prints is not to disturb what is measured.
    let allowed = allowed_cpus().unwrap_or_default();
    let others: Vec<String> =
        allowed.iter().filter(|cpu| **cpu != terms.cpu).map(usize::to_string).collect();
    if !others.is_empty() {
        command.arg(format!("--mainaffinity={}", others.join(",")));
    }
    command
}

/// Passes on what it prints until it ends, or nobody wants to know.
fn listen(mut stdout: ChildStdout, cpu: usize) -> std::io::Result<Receiver<Chunk>> {
    let (pass_on, printed) = channel();
    thread::Builder::new().name("cyclictest".into()).spawn(move || {
        keep_off(cpu);
        let mut buffer = [0; 65_536];
        while let Ok(length @ 1..) = stdout.read(&mut buffer) {
            let chunk = buffer.get(..length).unwrap_or_default().to_vec();
            if pass_on.send((Monotonic.now_ns(), chunk)).is_err() {
                break;
            }
        }
    })?;
    Ok(printed)
}

/// CPU time of the thread that measures; the other one prints.
struct Meter {
    process: u32,
    /// When, and CPU time by then.
    first: Option<(u64, u64)>,
    last: Option<(u64, u64)>,
}

impl Meter {
    const fn new(process: u32) -> Self {
        Self { process, first: None, last: None }
    }

    fn look(&mut self) {
        // Of a thread that is gone the last look stays.
        if let Some(cpu_ns) = self.cpu_ns() {
            let now = (Monotonic.now_ns(), cpu_ns);
            self.first.get_or_insert(now);
            self.last = Some(now);
        }
    }

    fn cpu_ns(&self) -> Option<u64> {
        let leader = self.process.to_string();
        let threads = std::fs::read_dir(format!("/proc/{leader}/task")).ok()?;
        let measuring = threads.flatten().find(|thread| *thread.file_name() != *leader)?;
        let text = std::fs::read_to_string(measuring.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    }

    fn used(&self) -> Option<Used> {
        let ((first_ns, before_ns), (last_ns, cpu_ns)) = self.first.zip(self.last)?;
        let cpu_ns = cpu_ns.saturating_sub(before_ns);
        let elapsed_ns = last_ns.saturating_sub(first_ns);
        Some(Used { cpu_ns, elapsed_ns, usage: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_measures_in_a_process_of_one_thread() {
        let program = Child::start("sleep", Command::new("sleep").arg("60")).unwrap();
        let mut meter = Meter::new(program.id());
        meter.look();
        assert!(meter.used().is_none());
        assert!(meter.first.is_none());
    }
}
