//! The output of cyclictest with `--verbose`: a line for each cycle.

use std::ops::Range;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

use isochrone_timing::CycleRecord;

use crate::jitter::turn::{WARM_UP, cycles};

pub(super) const SECOND_NS: u64 = 1_000_000_000;
/// Latencies it keeps until it prints them, every 10 ms; beyond that it overwrites them and says nothing.
const KEPT_LATENCIES: u64 = 16_384;

/// Something it printed, and when that came.
pub(super) type Chunk = (u64, Vec<u8>);

/// What it printed, as the records of a loop.
pub(super) struct Transcript {
    period_ns: u64,
    /// Where its grid lies in a second.
    offset_ns: u64,
    counted_ns: u64,
    /// The beginning of a line whose end has not come yet.
    line: Vec<u8>,
    /// Cycles it printed.
    pub(super) printed: u64,
    first_release_ns: Option<u64>,
    missed: u64,
    pub(super) records: Vec<CycleRecord>,
    /// What it prints from now on may be overwritten.
    is_late: bool,
}

impl Transcript {
    pub(super) fn new(period_ns: u64, offset_ns: u64, counted: Duration) -> Self {
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
    pub(super) fn drain(&mut self, printed: &Receiver<Chunk>) -> Result<bool, String> {
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
        // The first cycle after the end belongs to it: it tells what was missed before.
        let end_ns = self.end_ns(first_ns);
        let is_over = self.records.last().is_some_and(|last| last.release_ns >= end_ns);
        if !self.is_late && !is_over {
            // It tells nothing of a cycle's end, and has nothing to do in one.
            let (end_ns, overruns, missed) = (start_ns, 0, self.missed);
            let record = CycleRecord { cycle, release_ns, start_ns, end_ns, missed, overruns };
            self.records.push(record);
        }
        Ok(())
    }

    /// What is counted: from when to when.
    pub(super) fn counted(&self) -> Option<Range<u64>> {
        let first_ns = self.first_release_ns?;
        Some(first_ns + WARM_UP.as_nanos() as u64..self.end_ns(first_ns))
    }

    fn release_ns(&self, first_ns: u64, cycle: u64) -> u64 {
        first_ns.saturating_add(cycle.saturating_mul(self.period_ns))
    }

    fn end_ns(&self, first_ns: u64) -> u64 {
        first_ns + WARM_UP.as_nanos() as u64 + self.counted_ns
    }

    /// Whether the warm-up is over.
    pub(super) fn counts(&self) -> bool {
        let newest = self.records.last();
        newest
            .zip(self.counted())
            .is_some_and(|(record, counted)| record.release_ns >= counted.start)
    }

    /// Whether the turn is over, or the rest of it cannot be known.
    pub(super) fn is_complete(&self) -> bool {
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
    fn the_turn_is_warm_up_what_is_counted_and_the_cycle_that_follows() {
        // 200 cycles, 2, and 1.
        let before = read(&lines((0..201).map(|_| 100)));
        assert!(before.counts() && !before.is_complete());
        let all = read(&lines((0..300).map(|_| 100)));
        assert!(all.is_complete());
        assert_eq!(all.records.len(), 203);
        let counted = FIRST_NS + 200 * PERIOD_NS..FIRST_NS + 202 * PERIOD_NS;
        assert_eq!(all.counted(), Some(counted));
    }

    #[test]
    fn missed_releases_take_their_part_of_the_turn() {
        let stalled = read(&lines([100, 150_000_100].into_iter().chain((0..300).map(|_| 100))));
        assert!(stalled.is_complete());
        assert_eq!(stalled.records.len(), 203 - 150);
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
}
