//! The timing of all of a task's cycles in the last second.

use isochrone_timing::{Distribution, Summary};

use crate::records::Cycle;
use isochrone_control::LastSecond;

const SECOND_NS: u64 = 1_000_000_000;

/// How late a cycle of a task may be before the task counts as standing still, in ns: a second and three periods.
pub(crate) fn longest_pause_ns(period_ns: u64) -> u64 {
    period_ns.saturating_mul(3).saturating_add(SECOND_NS)
}

/// Counts cycles second by second, and keeps the numbers of the last whole second.
#[derive(Debug, Default)]
pub(crate) struct Seconds {
    jitter: Distribution,
    execution_ns: u64,
    /// Release of the first cycle of the second that is being counted.
    begin_ns: Option<u64>,
    /// The last whole second, and when the next one began.
    whole: Option<(LastSecond, u64)>,
}

impl Seconds {
    pub(crate) fn note(&mut self, cycle: &Cycle) {
        let Cycle { record, follow } = cycle;
        let begin_ns = *self.begin_ns.get_or_insert(record.release_ns);
        if record.release_ns.saturating_sub(begin_ns) >= SECOND_NS {
            self.end(record.release_ns);
        }
        let ready_ns = follow.map_or(record.start_ns, |follow| follow.ready_ns);
        self.jitter.record(ready_ns.saturating_sub(record.release_ns));
        self.execution_ns += record.end_ns.saturating_sub(record.start_ns);
    }

    fn end(&mut self, next_ns: u64) {
        let jitter = self.jitter.summary();
        let execution_ns = self.execution_ns as f64 / jitter.count.max(1) as f64;
        let Summary { count: cycles, .. } = jitter;
        self.whole =
            Some((LastSecond { cycles, release_jitter_ns: jitter, execution_ns }, next_ns));
        self.jitter.clear();
        (self.execution_ns, self.begin_ns) = (0, Some(next_ns));
    }

    /// The cycles of the last second; `None` before the first is over, and of a task that stands still.
    pub(crate) fn last(&self, now_ns: u64, period_ns: u64) -> Option<LastSecond> {
        let (last, next_ns) = self.whole.as_ref()?;
        // By then the second that follows should be over, too.
        let stale_ns = longest_pause_ns(period_ns).saturating_add(SECOND_NS);
        (now_ns.saturating_sub(*next_ns) < stale_ns).then(|| last.clone())
    }
}

#[cfg(test)]
mod tests {
    use isochrone_timing::{CycleRecord, FollowRecord};

    use super::*;

    const PERIOD_NS: u64 = 1_000_000;

    /// A cycle on a grid of 1 ms that begins so late and takes 5 us.
    fn cycle(number: u64, jitter_ns: u64) -> Cycle {
        let release_ns = number * PERIOD_NS;
        let start_ns = release_ns + jitter_ns;
        let end_ns = start_ns + 5_000;
        let record =
            CycleRecord { cycle: number, release_ns, start_ns, end_ns, ..CycleRecord::default() };
        Cycle { record, follow: None }
    }

    #[test]
    fn the_percentiles_of_a_second_are_of_all_of_its_cycles() {
        let mut seconds = Seconds::default();
        for number in 0..1000 {
            seconds.note(&cycle(number, if number < 980 { 1_000 } else { 70_000 }));
        }
        assert_eq!(seconds.last(0, PERIOD_NS), None, "the first second is not over");
        seconds.note(&cycle(1000, 9));
        let last = seconds.last(1001 * PERIOD_NS, PERIOD_NS).unwrap();
        assert_eq!((last.cycles, last.execution_ns), (1000, 5_000.0));
        assert_eq!(last.release_jitter_ns.max, Some(70_000));
        assert!(
            last.release_jitter_ns.p50 < Some(2_000) && last.release_jitter_ns.p99 > Some(69_000)
        );
        for number in 1001..=2000 {
            seconds.note(&cycle(number, 9));
        }
        let last = seconds.last(2001 * PERIOD_NS, PERIOD_NS).unwrap();
        assert_eq!((last.cycles, last.release_jitter_ns.max), (1000, Some(9)));
        assert_eq!(
            seconds.last(2000 * PERIOD_NS + SECOND_NS + longest_pause_ns(PERIOD_NS), PERIOD_NS),
            None
        );
    }

    #[test]
    fn a_task_that_follows_is_late_until_it_waits_for_its_frame() {
        let mut seconds = Seconds::default();
        for number in 0..=1000 {
            let plain = cycle(number, 500_000);
            let ready_ns = plain.record.release_ns + 300;
            let follow = FollowRecord { ready_ns, ..FollowRecord::default() };
            seconds.note(&Cycle { follow: Some(follow), ..plain });
        }
        let last = seconds.last(1001 * PERIOD_NS, PERIOD_NS).unwrap();
        assert_eq!(last.release_jitter_ns.max, Some(300));
    }
}
