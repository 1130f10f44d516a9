//! How long a task's cycles have taken lately.

use isochrone_timing::CycleRecord;

/// Cycles that count: at 1 kHz those of the last second.
const CYCLES: usize = 1000;
/// One in so many is left out: a machine that takes the CPU away once does not make a task busy.
const OUTLIERS: usize = 100;

/// The responses of a task's last cycles: from the release to the end of the cycle.
#[derive(Debug, Default)]
pub(crate) struct Busiest {
    responses_ns: Vec<u64>,
    /// Where the next one goes, once there are as many as count.
    next: usize,
}

impl Busiest {
    pub(crate) fn note(&mut self, record: &CycleRecord) {
        let response_ns = record.end_ns.saturating_sub(record.release_ns);
        match self.responses_ns.get_mut(self.next) {
            Some(oldest) => *oldest = response_ns,
            None => self.responses_ns.push(response_ns),
        }
        self.next = (self.next + 1) % CYCLES;
    }

    /// What 99 % of the last cycles did not exceed; `None`: no cycle was seen yet.
    pub(crate) fn longest_ns(&self) -> Option<u64> {
        let mut responses_ns = self.responses_ns.clone();
        let last = responses_ns.len().checked_sub(1)?;
        let longest = last - responses_ns.len().div_ceil(OUTLIERS).min(last);
        Some(*responses_ns.select_nth_unstable(longest).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note(busiest: &mut Busiest, response_ns: u64) {
        busiest.note(&CycleRecord { end_ns: response_ns, ..CycleRecord::default() });
    }

    #[test]
    fn one_long_cycle_in_a_hundred_does_not_make_a_task_busy_and_two_do() {
        let mut busiest = Busiest::default();
        assert_eq!(busiest.longest_ns(), None);
        note(&mut busiest, 9_000);
        assert_eq!(busiest.longest_ns(), Some(9_000), "it is all that is known");
        (1..100).for_each(|_| note(&mut busiest, 20));
        assert_eq!(busiest.longest_ns(), Some(20));
        note(&mut busiest, 8_000);
        note(&mut busiest, 7_000);
        assert_eq!(busiest.longest_ns(), Some(7_000));
    }

    #[test]
    fn what_is_a_thousand_cycles_old_is_forgotten() {
        let mut busiest = Busiest::default();
        (0..500).for_each(|_| note(&mut busiest, 70));
        (0..985).for_each(|_| note(&mut busiest, 20));
        assert_eq!(busiest.longest_ns(), Some(70), "15 of them are left");
        (0..10).for_each(|_| note(&mut busiest, 20));
        assert_eq!(busiest.longest_ns(), Some(20), "5 of them are left");
    }
}
