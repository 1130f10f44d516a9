//! Turns of the real cyclictest.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic, ThreadUsage};
use isochrone_timing::Distribution;
use serde::Deserialize;

use super::WARM_UP;
use super::arm::{Arm, Turn, Used};
use crate::bench::watch::Watching;
use crate::failure::Failure;

const LOOK_INTERVAL: Duration = Duration::from_millis(20);
/// Longer latencies, in ns, are counted and not told.
const LONGEST_TOLD_NS: u64 = 2_000_000;

/// Whether it is installed, and this process may raise its priority.
pub(super) fn can_run() -> bool {
    let help = Command::new("cyclictest").arg("--help").output();
    help.is_ok() && rustix::process::geteuid().is_root()
}

/// Runs it for the turn. It has no warm-up that could be left out.
pub(super) fn turn(arm: &mut Arm, turn: &Turn<'_>) -> Result<Used, Failure> {
    let failed = |what: String| Failure::found(format!("cyclictest: {what}"));
    let folder = tempfile::tempdir().map_err(|error| failed(error.to_string()))?;
    let json = folder.path().join("cyclictest.json");
    let loops = (turn.counted.as_nanos() as u64 / arm.period_ns).max(1);
    // Its phase counts from whole milliseconds, ours from the middle of one.
    let phase_us = (isochrone_engine::config::EPOCH_OFFSET_NS + arm.phase_ns) / 1_000;
    let from_ns = Monotonic.now_ns();
    let watching = Watching::begin(arm.cpu, None);
    let mut child = Command::new("cyclictest")
        .args(["--quiet", "--mlockall", "--threads=1", "--nsecs"])
        .arg(format!("--priority={}", arm.request.priority.unwrap_or(1)))
        .arg(format!("--secaligned={phase_us}"))
        .arg(format!("--histogram={LONGEST_TOLD_NS}"))
        .arg(format!("--affinity={}", arm.cpu))
        .arg(format!("--interval={}", (arm.period_ns / 1_000).max(1)))
        .arg(format!("--loops={loops}"))
        .arg(format!("--json={}", json.display()))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|error| failed(error.to_string()))?;
    let mut meter = Meter::default();
    let status = loop {
        thread::sleep(LOOK_INTERVAL);
        // Its start-up is left out, as the warm-up of the others is.
        if Monotonic.now_ns() >= from_ns + WARM_UP.as_nanos() as u64 {
            meter.look(child.id());
        }
        (turn.pass)();
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if turn.stop.is_due() => {
                // What it measured so far it tells nobody; a turn more or less.
                let _ = child.kill();
                let _ = child.wait();
                return Ok(Used::default());
            }
            Ok(None) => {}
            Err(error) => return Err(failed(error.to_string())),
        }
    };
    let watch = watching.end();
    if turn.stop.is_due() {
        return Ok(Used::default());
    }
    if !status.success() {
        return Err(failed(format!("it ended with {status}")));
    }
    let _ = (watch, read(&json));
    Ok(meter.used())
}

/// What it writes with `--json`.
#[derive(Deserialize)]
struct Output {
    thread: BTreeMap<String, Thread>,
}

#[derive(Deserialize)]
struct Thread {
    /// How often each latency occurred, by nanoseconds.
    histogram: BTreeMap<String, u64>,
    cycles: u64,
    max: u64,
}

fn read(path: &Path) -> Result<Distribution, String> {
    let text = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
    let output: Output = serde_json::from_str(&text).map_err(|error| error.to_string())?;
    let thread = output.thread.get("0").ok_or("it measured no thread")?;
    let mut jitter = Distribution::new();
    for (ns, count) in &thread.histogram {
        jitter.record_many(ns.parse().map_err(|_| format!("a latency of \"{ns}\""))?, *count);
    }
    // Those beyond the histogram: all that is known of them is the largest.
    jitter.record_many(thread.max, thread.cycles.saturating_sub(jitter.count()));
    Ok(jitter)
}

/// CPU time of all threads of a process so far.
fn cpu_ns(process: u32) -> Option<u64> {
    let threads = std::fs::read_dir(format!("/proc/{process}/task")).ok()?;
    let of_thread = |thread: std::fs::DirEntry| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<u64>().ok()
    };
    threads.flatten().map(of_thread).sum()
}

/// What a process used between its start-up and the last time that somebody looked.
#[derive(Default)]
struct Meter {
    /// When, and CPU time by then.
    first: Option<(u64, u64)>,
    last: Option<(u64, u64)>,
}

impl Meter {
    fn look(&mut self, process: u32) {
        if let Some(cpu_ns) = cpu_ns(process) {
            let now = (Monotonic.now_ns(), cpu_ns);
            self.first.get_or_insert(now);
            self.last = Some(now);
        }
    }

    fn used(&self) -> Used {
        let (Some((first_ns, before_ns)), Some((last_ns, cpu_ns))) = (self.first, self.last) else {
            return Used::default();
        };
        let cpu_ns = cpu_ns.saturating_sub(before_ns);
        Used {
            usage: ThreadUsage { cpu_ns, ..ThreadUsage::default() },
            elapsed_ns: last_ns.saturating_sub(first_ns),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Distribution, String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read(file.path())
    }

    #[test]
    fn latencies_beyond_its_histogram_count_as_the_largest() {
        let text = r#"{"thread": {"0": {"histogram": {"13000": 5, "14000": 3}, "cycles": 10,
            "min": 13000, "max": 9000000, "avg": 1.0}}}"#;
        let jitter = read_text(text).unwrap();
        assert_eq!(jitter.count(), 10);
        assert_eq!(jitter.summary().max, Some(9_000_000));
        assert_eq!(jitter.summary().min, Some(13_000));
    }

    #[test]
    fn something_else_is_an_error() {
        assert!(read_text("{}").is_err());
        assert!(read_text(r#"{"thread": {}}"#).unwrap_err().contains("no thread"));
    }
}
