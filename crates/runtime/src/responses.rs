//! How long a task's cycles take.

use isochrone_timing::CycleRecord;

/// Cycles that are kept: at 1 kHz those of the last second.
const KEPT: usize = 1000;
/// One in this many cycles is left out, the longest first: one interruption by the machine does not make a task busy.
const OUTLIERS: usize = 100;
/// How many of the last cycles the median is of: an odd number, so that it is one of them.
const LAST: usize = 63;

/// The responses of a task's last cycles: from the release to the end of the cycle.
#[derive(Debug, Default)]
pub(crate) struct Responses {
    kept_ns: Vec<u64>,
    /// The index for the next one, once the buffer is full.
    next: usize,
}

impl Responses {
    pub(crate) fn note(&mut self, record: &CycleRecord) {
        let response_ns = record.end_ns.saturating_sub(record.release_ns);
        match self.kept_ns.get_mut(self.next) {
            Some(oldest) => *oldest = response_ns,
            None => self.kept_ns.push(response_ns),
        }
        self.next = (self.next + 1) % KEPT;
    }

    /// The 99th percentile of the cycles that are kept; `None`: no cycle was seen yet.
    pub(crate) fn longest_ns(&self) -> Option<u64> {
        let mut kept_ns = self.kept_ns.clone();
        let last = kept_ns.len().checked_sub(1)?;
        let longest = last - kept_ns.len().div_ceil(OUTLIERS).min(last);
        Some(*kept_ns.select_nth_unstable(longest).1)
    }

    /// The median of the last cycles, which one delayed cycle does not change; `None`: no cycle was seen yet.
    pub(crate) fn median_ns(&self) -> Option<u64> {
        let (older, newer) = self.kept_ns.split_at_checked(self.next)?;
        let mut last_ns: Vec<u64> =
            older.iter().rev().chain(newer.iter().rev()).take(LAST).copied().collect();
        last_ns.sort_unstable();
        last_ns.get(last_ns.len() / 2).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(responses_ns: impl IntoIterator<Item = u64>) -> Responses {
        let mut responses = Responses::default();
        for end_ns in responses_ns {
            responses.note(&CycleRecord { end_ns, ..CycleRecord::default() });
        }
        responses
    }

    #[test]
    fn the_median_is_that_of_the_last_cycles_whatever_held_up_a_few() {
        assert_eq!(of([]).median_ns(), None);
        assert_eq!(of([7]).median_ns(), Some(7));
        assert_eq!(of([900_000, 7, 8]).median_ns(), Some(8));
        for before in [LAST, KEPT - 5, KEPT, 3 * KEPT + 7] {
            let long_ago = std::iter::repeat_n(1_000, before).chain([5; LAST]);
            assert_eq!(of(long_ago).median_ns(), Some(5), "{before}");
        }
        let half = std::iter::repeat_n(1_000, KEPT).chain([5; LAST / 2]);
        assert_eq!(of(half).median_ns(), Some(1_000));
    }

    #[test]
    fn one_long_cycle_in_a_hundred_does_not_make_a_task_busy_and_two_do() {
        assert_eq!(of([]).longest_ns(), None);
        assert_eq!(of([9_000]).longest_ns(), Some(9_000), "it is all that is known");
        let one = || [9_000].into_iter().chain([20; 99]);
        assert_eq!(of(one()).longest_ns(), Some(20));
        assert_eq!(of(one().chain([8_000, 7_000])).longest_ns(), Some(7_000));
    }

    #[test]
    fn what_is_a_thousand_cycles_old_is_forgotten() {
        let long = || std::iter::repeat_n(70, 500);
        let left = |short| of(long().chain(std::iter::repeat_n(20, short))).longest_ns();
        assert_eq!(left(985), Some(70), "15 of them are left");
        assert_eq!(left(995), Some(20), "5 of them are left");
    }
}
