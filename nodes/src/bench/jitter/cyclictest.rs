//! Turns of the real cyclictest: its latencies, one by one, as the records of a loop.

use std::io::Read;
use std::process::{ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic, ThreadUsage};
use isochrone_engine::config::EPOCH_OFFSET_NS;
use isochrone_engine::format_duration_ns;
use isochrone_timing::CycleRecord;
use rustix::thread::sched_getaffinity;

use super::arm::{Arm, Turn, Used, cycles};
use super::{Settings, WARM_UP};
use crate::bench::watch::{Watching, keep_off};
use crate::failure::Failure;
use crate::stop::Program;

const SECOND_NS: u64 = 1_000_000_000;
const LOOK_INTERVAL: Duration = Duration::from_millis(20);
/// At shorter periods it writes full buffers instead of lines: there is one every few milliseconds.
const LINES_FROM_NS: u64 = 100_000;
/// Latencies it keeps until it prints them, every 10 ms; beyond that it overwrites them and says nothing.
const KEPT_LATENCIES: u64 = 16_384;

/// Whether it is installed, and can run what the other arms run.
pub(super) fn check(settings: &Settings) -> Result<(), Failure> {
    if settings.priority.is_none() {
        return Err(Failure::usage("cyclictest runs with a priority; give --priority"));
    }
    let periods = settings.periods_ns.iter().map(|period_ns| ("period", *period_ns));
    for (what, ns) in periods.chain([("phase", settings.phase_ns)]) {
        if ns % 1_000 != 0 {
            return Err(Failure::usage(format!(
                "the arm cyclictest cannot run at a {what} of {}: it knows whole microseconds only; \
                 give another --{what}, or leave the arm out (--arms sleep,hybrid)",
                format_duration_ns(ns)
            )));
        }
    }
    let help = Command::new("cyclictest").arg("--help").output();
    if help.is_err() || !rustix::process::geteuid().is_root() {
        return Err(Failure::usage(
            "cyclictest is not installed, or may not run: install rt-tests and be root",
        ));
    }
    Ok(())
}

/// Runs it for the turn.
pub(super) fn turn(arm: &mut Arm, turn: &Turn<'_>) -> Result<Used, Failure> {
    let failed = |what: String| Failure::found(format!("cyclictest: {what}"));
    // Begun first, so that the counted part of the turn is watched from its beginning.
    let watching = Watching::begin(arm.cpu, None);
    let mut program = Program::start(&mut command(arm, turn.counted))
        .map_err(|error| failed(format!("cannot be started: {error}")))?;
    let (stdout, stderr) = program.printed();
    let printed = listen(stdout.ok_or_else(|| failed("its output is missing".into()))?, arm.cpu)
        .map_err(|error| failed(format!("cannot start a thread: {error}")))?;
    let mut transcript =
        Transcript::new(arm.period_ns, EPOCH_OFFSET_NS + arm.phase_ns, turn.counted);
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
    if let Some(from_ns) = transcript.counted_from_ns() {
        let around = |at_ns| watch.around(at_ns);
        arm.timing.block(&transcript.records, from_ns, watch.since(from_ns), around);
    }
    Ok(meter.used())
}

fn command(arm: &Arm, counted: Duration) -> Command {
    let mut command = Command::new("cyclictest");
    command
        .args(["--verbose", "--nsecs", "--mlockall", "--threads=1"])
        .arg(format!("--priority={}", arm.request.priority.unwrap_or(1)))
        // It counts its phase from whole seconds.
        .arg(format!("--secaligned={}", (EPOCH_OFFSET_NS + arm.phase_ns) % SECOND_NS / 1_000))
        .arg(format!("--affinity={}", arm.cpu))
        .arg(format!("--interval={}", arm.period_ns / 1_000))
        // Its own end, should nobody be left to end it.
        .arg(format!("--loops={}", cycles(arm.period_ns, counted)))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    if arm.period_ns >= LINES_FROM_NS {
        command.arg("--unbuffered");
    }
    // What prints is not to disturb what is measured.
    if let Ok(allowed) = sched_getaffinity(None) {
        let others = (0..rustix::thread::CpuSet::MAX_CPU)
            .filter(|cpu| *cpu != arm.cpu && allowed.is_set(*cpu))
            .map(|cpu| cpu.to_string());
        let others = others.collect::<Vec<_>>().join(",");
        if !others.is_empty() {
            command.arg(format!("--mainaffinity={others}"));
        }
    }
    command
}

/// Something it printed, and when that came.
type Chunk = (u64, Vec<u8>);

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

/// What it printed, as the records of a loop.
struct Transcript {
    period_ns: u64,
    /// Where its grid lies in a second.
    offset_ns: u64,
    counted_ns: u64,
    /// The beginning of a line whose end has not come yet.
    line: Vec<u8>,
    /// Cycles it printed.
    printed: u64,
    first_release_ns: Option<u64>,
    missed: u64,
    records: Vec<CycleRecord>,
    /// What it prints from now on may be overwritten.
    is_late: bool,
}

impl Transcript {
    fn new(period_ns: u64, offset_ns: u64, counted: Duration) -> Self {
        Self {
            period_ns,
            offset_ns,
            counted_ns: counted.as_nanos() as u64,
            line: Vec::new(),
            printed: 0,
            first_release_ns: None,
            missed: 0,
            records: Vec::with_capacity(cycles(period_ns, counted)),
            is_late: false,
        }
    }

    /// Takes in what came so far; whether nothing will come any more.
    fn drain(&mut self, printed: &Receiver<Chunk>) -> Result<bool, String> {
        loop {
            match printed.try_recv() {
                Ok((at_ns, chunk)) => self.take(at_ns, &chunk)?,
                Err(TryRecvError::Empty) => return Ok(false),
                Err(TryRecvError::Disconnected) => return Ok(true),
            }
        }
    }

    /// Takes in something it printed, which came at `at_ns`.
    fn take(&mut self, at_ns: u64, chunk: &[u8]) -> Result<(), String> {
        for piece in chunk.split_inclusive(|byte| *byte == b'\n') {
            self.line.extend_from_slice(piece);
            if self.line.ends_with(b"\n") {
                let line = std::mem::take(&mut self.line);
                if let Some((cycle, latency_ns)) = parse(&line) {
                    self.record(at_ns, cycle, latency_ns)?;
                }
            }
        }
        Ok(())
    }

    fn record(&mut self, at_ns: u64, cycle: u64, latency_ns: u64) -> Result<(), String> {
        if cycle != self.printed {
            return Err(format!("it printed cycle {cycle} in place of cycle {}", self.printed));
        }
        self.printed += 1;
        let first_ns = *self
            .first_release_ns
            .get_or_insert_with(|| first_release_ns(at_ns, self.offset_ns, self.period_ns));
        // A wake-up after further releases is late for the last of them, as in our own loop; it goes
        // on with the next one, as we do.
        self.missed = self.missed.saturating_add(latency_ns / self.period_ns);
        let cycle = cycle.saturating_add(self.missed);
        let release_ns = self.release_ns(first_ns, cycle);
        let start_ns = release_ns.saturating_add(latency_ns % self.period_ns);
        let kept_ns = KEPT_LATENCIES * self.period_ns;
        self.is_late = self.is_late || at_ns.saturating_sub(release_ns) > kept_ns;
        if !self.is_late && release_ns < self.end_ns(first_ns) {
            // It tells nothing of a cycle's end, and has nothing to do in one.
            let (end_ns, overruns, missed) = (start_ns, 0, self.missed);
            let record = CycleRecord { cycle, release_ns, start_ns, end_ns, missed, overruns };
            self.records.push(record);
        }
        Ok(())
    }

    /// When counting begins.
    fn counted_from_ns(&self) -> Option<u64> {
        self.first_release_ns.map(|first_ns| first_ns + WARM_UP.as_nanos() as u64)
    }

    fn release_ns(&self, first_ns: u64, cycle: u64) -> u64 {
        first_ns.saturating_add(cycle.saturating_mul(self.period_ns))
    }

    fn end_ns(&self, first_ns: u64) -> u64 {
        first_ns + WARM_UP.as_nanos() as u64 + self.counted_ns
    }

    /// Whether the warm-up is over.
    fn counts(&self) -> bool {
        let newest = self.records.last();
        newest
            .zip(self.counted_from_ns())
            .is_some_and(|(record, from_ns)| record.release_ns >= from_ns)
    }

    /// Whether the turn is over, or the rest of it cannot be known.
    fn is_complete(&self) -> bool {
        let next = self.printed.saturating_add(self.missed);
        let is_over = |first_ns| self.release_ns(first_ns, next) >= self.end_ns(first_ns);
        self.is_late || self.first_release_ns.is_some_and(is_over)
    }
}

/// The cycle and the latency of a line like `       0:      17:   13941`; what else it prints is not
/// for us.
fn parse(line: &[u8]) -> Option<(u64, u64)> {
    let mut fields = std::str::from_utf8(line).ok()?.split(':').map(str::trim);
    let (thread, cycle, latency_ns) = (fields.next()?, fields.next()?, fields.next()?);
    (thread == "0" && fields.next().is_none())
        .then(|| Some((cycle.parse().ok()?, latency_ns.parse().ok()?)))?
}

/// When its first release was, of which it told before `told_ns`. It does not say so; but it lies a
/// period after its place in a whole second, and is told of well within a second.
fn first_release_ns(told_ns: u64, offset_ns: u64, period_ns: u64) -> u64 {
    let place_ns = (offset_ns + period_ns) % SECOND_NS;
    told_ns.saturating_sub((told_ns % SECOND_NS + SECOND_NS - place_ns) % SECOND_NS)
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

    const PERIOD_NS: u64 = 1_000_000;
    /// A first line that comes 8 ms after the first release, at 501.5 ms of a second.
    const TOLD_NS: u64 = 7_009_500_000;
    const FIRST_NS: u64 = 7_001_500_000;
    const BANNER: &str = "Using 1 cpus.\nMax CPUs = 2\n# /dev/cpu_dma_latency set to 0us\n\
        Thread 0 using cpu 1.\nThread 0 Interval: 1500\n";

    fn transcript(counted: Duration) -> Transcript {
        Transcript::new(PERIOD_NS, 500_000, counted)
    }

    fn read(text: &str) -> Transcript {
        let mut transcript = transcript(Duration::from_millis(2));
        transcript.take(TOLD_NS, text.as_bytes()).unwrap();
        transcript
    }

    /// Its lines for these latencies.
    fn lines(latencies_ns: impl IntoIterator<Item = u64>) -> String {
        let line = |(cycle, ns)| format!("{:8}:{cycle:8}:{ns:8}\n", 0);
        latencies_ns.into_iter().enumerate().map(line).collect()
    }

    fn late_ns(transcript: &Transcript) -> Vec<(u64, u64, u64)> {
        let told = |r: &CycleRecord| (r.cycle, r.start_ns - r.release_ns, r.missed);
        transcript.records.iter().map(told).collect()
    }

    #[test]
    fn each_line_is_a_cycle_on_the_grid_of_its_whole_second() {
        let transcript = read(&(BANNER.to_owned() + &lines([44_445, 13_797])));
        assert_eq!(late_ns(&transcript), [(0, 44_445, 0), (1, 13_797, 0)]);
        assert_eq!(transcript.records[0].release_ns, FIRST_NS);
        assert_eq!(transcript.records[1].start_ns, FIRST_NS + PERIOD_NS + 13_797);
    }

    #[test]
    fn a_line_may_come_in_pieces() {
        let text = BANNER.to_owned() + &lines([44_445, 13_797, 9]);
        let mut pieces = transcript(Duration::from_millis(2));
        for byte in text.as_bytes() {
            pieces.take(TOLD_NS, &[*byte]).unwrap();
        }
        assert_eq!(pieces.records, read(&text).records);
        assert_eq!(pieces.records.len(), 3);
    }

    #[test]
    fn a_latency_of_k_periods_is_k_missed_releases_and_the_rest_is_its_lateness() {
        let transcript = read(&lines([100, 3_250_000, 80, 1_000_000, 70]));
        assert_eq!(
            late_ns(&transcript),
            [(0, 100, 0), (4, 250_000, 3), (5, 80, 3), (7, 0, 4), (8, 70, 4)]
        );
        assert_eq!(transcript.records[2].release_ns, FIRST_NS + 5 * PERIOD_NS);
        assert!(read(&lines([100, u64::MAX, u64::MAX])).is_complete());
    }

    #[test]
    fn what_is_no_latency_is_left_out() {
        for garbage in ["", "0", "0:1", "0: x: 5", "0:0:-5", "1:0:5", "0:0:5:5", "T: 0 (12) P:80"] {
            assert_eq!(parse(garbage.as_bytes()), None, "{garbage}");
        }
        assert_eq!(parse(b"\xff:0:5\n"), None);
        assert_eq!(read(BANNER).first_release_ns, None);
    }

    #[test]
    fn a_cycle_that_was_not_printed_is_an_error() {
        let mut transcript = read(&lines([100, 90]));
        let error = transcript.take(TOLD_NS, b"0:3:80\n").unwrap_err();
        assert_eq!(error, "it printed cycle 3 in place of cycle 2");
    }

    #[test]
    fn the_turn_is_warm_up_and_what_is_counted_and_no_more() {
        // 200 cycles and 2.
        let before = read(&lines((0..201).map(|_| 100)));
        assert!(before.counts() && !before.is_complete());
        let all = read(&lines((0..300).map(|_| 100)));
        assert!(all.is_complete());
        assert_eq!(all.records.len(), 202);
        assert_eq!(all.counted_from_ns(), Some(FIRST_NS + 200 * PERIOD_NS));
    }

    #[test]
    fn missed_releases_take_their_part_of_the_turn() {
        let stalled = read(&lines([100, 150_000_100].into_iter().chain((0..300).map(|_| 100))));
        assert!(stalled.is_complete());
        assert_eq!(stalled.records.len(), 202 - 150);
    }

    #[test]
    fn what_came_so_late_that_it_may_be_overwritten_is_not_believed() {
        let mut transcript = read(&lines([100, 90]));
        transcript.take(TOLD_NS + (KEPT_LATENCIES + 1) * PERIOD_NS, b"0:2:80\n").unwrap();
        assert!(transcript.is_complete());
        assert_eq!(transcript.records.len(), 2);
    }

    #[test]
    fn the_first_release_is_before_it_is_told_of_even_in_the_second_before() {
        assert_eq!(first_release_ns(7_001_600_000, 500_000, PERIOD_NS), FIRST_NS);
        assert_eq!(first_release_ns(7_001_500_000, 500_000, PERIOD_NS), FIRST_NS);
        // A place late in a second, told of in the next one.
        assert_eq!(first_release_ns(8_000_004_000, 999_000_000, 900_000), 7_999_900_000);
        assert_eq!(first_release_ns(8_003_000_000, 500_000, 1_000_000_000), 8_000_500_000);
    }

    #[test]
    fn nobody_measures_in_a_process_of_one_thread() {
        let program = Program::start(Command::new("sleep").arg("60")).unwrap();
        let mut meter = Meter::new(program.id());
        meter.look();
        assert_eq!(meter.used().elapsed_ns, 0);
        assert!(meter.first.is_none());
    }
}
