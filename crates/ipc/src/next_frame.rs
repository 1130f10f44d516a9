//! When a sleeping reader looks for the next frame. No ports, no clock.
//!
//! A reader is not woken, because that would cost the sending thread a system call. A reader of a service with an
//! announced period sleeps until the next frame is due.

use crate::following::longest_silence_ns;

/// Between two looks for a frame that was due just now.
const LATE_NAP_NS: u64 = 20_000;
/// How long a frame was due just now, unless its period is shorter.
const LATE_NS: u64 = 1_000_000;
/// Between two looks for a frame that may come at any time.
const NAP_NS: u64 = 100_000;
/// Between any two looks: no program ends later than this, and no writer that comes back is seen later.
const LONGEST_NAP_NS: u64 = 5_000_000;
/// A reader whose buffer fills faster sleeps this long regardless.
const LEAST_LONGEST_NAP_NS: u64 = 500_000;
/// The period assumed for a writer that announces none: the shortest of a task.
const SHORTEST_PERIOD_NS: u64 = 10_000;

/// When to look for the next frame of a service.
#[derive(Debug)]
pub(crate) struct NextFrame {
    /// Frames that may wait for the reader before one is lost to it.
    buffer: u64,
    /// As announced; 0: none.
    period_ns: u64,
    /// When the last frame was sent, by its stamp.
    sent_ns: u64,
    /// When that frame was taken, or the reader first looked.
    heard_ns: Option<u64>,
}

impl NextFrame {
    /// For a reader for which so many frames may wait.
    pub(crate) fn new(buffer: u64) -> Self {
        Self { buffer, period_ns: 0, sent_ns: 0, heard_ns: None }
    }

    /// Sets the period that the writer announced, in ns; 0: none.
    pub(crate) fn set_period(&mut self, period_ns: u64) {
        self.period_ns = period_ns;
    }

    /// Records that a frame was taken.
    pub(crate) fn taken(&mut self, sent_ns: u64, now_ns: u64) {
        (self.sent_ns, self.heard_ns) = (sent_ns, Some(now_ns));
    }

    /// The time in which the writer fills half of the buffer, within bounds.
    pub(crate) fn longest_nap_ns(&self) -> u64 {
        let period_ns = if self.period_ns > 0 { self.period_ns } else { SHORTEST_PERIOD_NS };
        let half_full_ns = (self.buffer / 2).saturating_mul(period_ns);
        half_full_ns.clamp(LEAST_LONGEST_NAP_NS, LONGEST_NAP_NS)
    }

    /// When to look again, given that nothing waits at `now_ns`; always later than that.
    pub(crate) fn look_ns(&mut self, now_ns: u64) -> u64 {
        let silent_ns = now_ns.saturating_sub(*self.heard_ns.get_or_insert(now_ns));
        let due_ns = self.sent_ns.saturating_add(self.period_ns);
        let nap_ns = match now_ns.checked_sub(due_ns) {
            // A stamp of this clock, which is over.
            None if due_ns - now_ns <= self.period_ns => due_ns - now_ns,
            Some(late_ns) if late_ns < LATE_NS.min(self.period_ns) => LATE_NAP_NS,
            // The writer has stopped, or not begun.
            _ if silent_ns >= longest_silence_ns(self.period_ns) => LONGEST_NAP_NS,
            _ => NAP_NS,
        };
        now_ns.saturating_add(nap_ns.min(self.longest_nap_ns()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US: u64 = 1_000;
    const MS: u64 = 1_000_000;
    const SENT_NS: u64 = 10_000 * MS;

    /// A reader that took a frame 50 us after it was sent.
    fn reader(period_ns: u64) -> NextFrame {
        let mut next = NextFrame::new(256);
        next.set_period(period_ns);
        next.taken(SENT_NS, SENT_NS + 50 * US);
        next
    }

    /// How long it sleeps, so long after the last frame was sent.
    fn nap_ns(next: &mut NextFrame, after_ns: u64) -> u64 {
        next.look_ns(SENT_NS + after_ns) - (SENT_NS + after_ns)
    }

    #[test]
    fn a_frame_of_an_announced_period_is_looked_for_when_it_is_due() {
        let mut next = reader(MS);
        assert_eq!(nap_ns(&mut next, 50 * US), 950 * US);
        assert_eq!(nap_ns(&mut next, 999 * US), US, "woken too early");
    }

    #[test]
    fn a_frame_that_is_late_is_looked_for_often_at_first() {
        let mut next = reader(10 * MS);
        assert_eq!(nap_ns(&mut next, 10 * MS), 20 * US);
        assert_eq!(nap_ns(&mut next, 11 * MS - 1), 20 * US);
        assert_eq!(nap_ns(&mut next, 11 * MS), 100 * US);
        let mut next = reader(50 * US);
        assert_eq!(nap_ns(&mut next, 99 * US), 20 * US);
        assert_eq!(nap_ns(&mut next, 100 * US), 100 * US, "the frame after it is late, too");
    }

    #[test]
    fn frames_without_a_period_and_those_of_another_clock_are_looked_for_every_100_us() {
        assert_eq!(nap_ns(&mut reader(0), 50 * US), 100 * US);
        assert_eq!(nap_ns(&mut reader(0), 900 * MS), 100 * US);
        for sent_ns in [5, SENT_NS + 60 * MS, u64::MAX] {
            let mut next = reader(MS);
            next.taken(sent_ns, SENT_NS);
            assert_eq!(nap_ns(&mut next, 50 * US), 100 * US, "{sent_ns}");
        }
    }

    #[test]
    fn a_writer_that_has_stopped_or_not_begun_is_looked_for_every_5_ms() {
        assert_eq!(nap_ns(&mut reader(MS), 2_000 * MS), 5 * MS);
        assert_eq!(nap_ns(&mut reader(1_000 * MS), 2_900 * MS), 100 * US, "it is slow");
        let mut next = NextFrame::new(256);
        next.set_period(MS);
        assert_eq!(nap_ns(&mut next, 0), 100 * US);
        assert_eq!(nap_ns(&mut next, 1_000 * MS), 5 * MS);
    }

    #[test]
    fn no_more_than_half_of_the_buffer_fills_in_one_nap_at_the_announced_period() {
        let longest_nap_ns = |buffer, period_ns| {
            let mut next = NextFrame::new(buffer);
            next.set_period(period_ns);
            next.longest_nap_ns()
        };
        assert_eq!(
            [2, 256, u64::MAX].map(|buffer| longest_nap_ns(buffer, 0)),
            [500 * US, 1_280 * US, 5 * MS]
        );
        assert_eq!(
            [2, 25, 256].map(|buffer| longest_nap_ns(buffer, 100 * US)),
            [500 * US, 1_200 * US, 5 * MS]
        );
        assert_eq!([2, 256].map(|buffer| longest_nap_ns(buffer, u64::MAX)), [5 * MS; 2]);
    }

    #[test]
    fn the_next_look_is_later_at_the_end_of_all_times_as_well() {
        let mut next = reader(u64::MAX);
        assert!(next.look_ns(u64::MAX - 5) > u64::MAX - 5);
    }
}
