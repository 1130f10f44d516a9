//! When the frames of a publisher are due.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use isochrone_cyclic::{Clock, Cyclic, Monotonic, Schedule, Wake, epoch_after_ns};

use crate::csv_table::CsvTable;

/// Longest single sleep, so that a request to stop is noticed.
const SLICE_NS: u64 = 100_000_000;
/// Between the rows of a recording that has only one.
const ONE_ROW_PERIOD_NS: u64 = 1_000_000;

/// How often frames are sent.
pub(super) enum Pace {
    /// Every so many nanoseconds, so long after the releases of tasks without a phase.
    Grid { period_ns: u64, phase_ns: u64 },
    /// As they were recorded: nanoseconds after the first frame, and the time between two frames
    /// after the last of them.
    Recorded { after_ns: Vec<u64>, rest_ns: u64 },
}

/// When a frame is due.
pub(super) struct Due {
    /// Index on the grid, or of the row.
    pub(super) cycle: u64,
    pub(super) release_ns: u64,
    /// Releases that were missed so far.
    pub(super) missed: u64,
}

impl Pace {
    /// The pace that a recording was made at, if it says.
    pub(super) fn recorded(table: &CsvTable) -> Option<Self> {
        let after_ns = table.times_ns()?.to_vec();
        let span_ns = after_ns.last().copied().unwrap_or_default();
        let mean_ns = span_ns.checked_div(after_ns.len() as u64 - 1);
        let rest_ns = mean_ns.filter(|mean_ns| *mean_ns > 0).unwrap_or(ONE_ROW_PERIOD_NS);
        Some(Self::Recorded { after_ns, rest_ns })
    }

    /// Time between two frames, if it is the same between all of them, to a tenth.
    pub(super) fn period_ns(&self) -> Option<u64> {
        match self {
            Self::Grid { period_ns, .. } => Some(*period_ns),
            Self::Recorded { after_ns, rest_ns } => {
                let mut gaps = after_ns.windows(2).map(|pair| pair[1] - pair[0]);
                let is_even = gaps.all(|gap_ns| gap_ns.abs_diff(*rest_ns) <= rest_ns / 10);
                is_even.then_some(*rest_ns)
            }
        }
    }

    /// When the first frame is due that is not sent before `earliest_ns`.
    pub(super) fn first_ns(&self, earliest_ns: u64) -> u64 {
        match self {
            Self::Grid { phase_ns, .. } => epoch_after_ns(earliest_ns).saturating_add(*phase_ns),
            Self::Recorded { .. } => earliest_ns,
        }
    }

    /// Starts with the frame that is due at `first_ns`; ends when `stop` is set.
    pub(super) fn start(&self, first_ns: u64, stop: Arc<AtomicBool>) -> Pacer<'_> {
        match self {
            Self::Grid { period_ns, .. } => {
                let schedule = Schedule::every(*period_ns, Wake::Sleep);
                Pacer::Grid(Cyclic::new(Monotonic, schedule, first_ns, stop))
            }
            Self::Recorded { after_ns, rest_ns } => {
                Pacer::Recorded { after_ns, rest_ns: *rest_ns, first_ns, next: 0, stop }
            }
        }
    }
}

/// Waits for one frame after the other.
pub(super) enum Pacer<'a> {
    Grid(Cyclic<Monotonic>),
    Recorded { after_ns: &'a [u64], rest_ns: u64, first_ns: u64, next: u64, stop: Arc<AtomicBool> },
}

impl Pacer<'_> {
    /// Waits until the next frame is due; `None` once it is to stop.
    pub(super) fn wait(&mut self) -> Option<Due> {
        match self {
            Self::Grid(cyclic) => cyclic.wait().map(|release| Due {
                cycle: release.cycle,
                release_ns: release.release_ns,
                missed: release.missed,
            }),
            Self::Recorded { after_ns, rest_ns, first_ns, next, stop } => {
                let release_ns = *first_ns + due_after_ns(after_ns, *rest_ns, *next);
                sleep_until(release_ns, stop)?;
                let cycle = *next;
                *next += 1;
                Some(Due { cycle, release_ns, missed: 0 })
            }
        }
    }

    /// Releases that were missed. Of a recording none is: a row that is late is sent late.
    pub(super) fn missed(&self) -> u64 {
        match self {
            Self::Grid(cyclic) => cyclic.missed(),
            Self::Recorded { .. } => 0,
        }
    }
}

/// When a row is due after the first one; after the end of the table at even intervals.
fn due_after_ns(after_ns: &[u64], rest_ns: u64, row: u64) -> u64 {
    let index = usize::try_from(row).unwrap_or(usize::MAX);
    after_ns.get(index).copied().unwrap_or_else(|| {
        let beyond = (row + 1).saturating_sub(after_ns.len() as u64);
        after_ns.last().copied().unwrap_or_default().saturating_add(beyond.saturating_mul(rest_ns))
    })
}

/// Sleeps until an instant; `None` once it is to stop.
pub(super) fn sleep_until(deadline_ns: u64, stop: &AtomicBool) -> Option<()> {
    while !stop.load(Ordering::Relaxed) {
        let now_ns = Monotonic.now_ns();
        if now_ns >= deadline_ns {
            return Some(());
        }
        Monotonic.sleep_until_ns(deadline_ns.min(now_ns + SLICE_NS));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded(after_ns: &[u64], rest_ns: u64) -> Pace {
        Pace::Recorded { after_ns: after_ns.to_vec(), rest_ns }
    }

    #[test]
    fn a_recording_has_a_period_only_where_its_rows_are_evenly_spaced() {
        assert_eq!(recorded(&[0, 100, 205, 300], 100).period_ns(), Some(100));
        assert_eq!(recorded(&[0, 100, 300], 150).period_ns(), None);
    }

    #[test]
    fn after_its_end_a_recording_goes_on_evenly() {
        let due = |row| due_after_ns(&[0, 100, 300], 150, row);
        assert_eq!([0, 1, 2, 3, 4].map(due), [0, 100, 300, 450, 600]);
    }
}
