//! At most so many messages in a second.

/// Which frames are sent.
#[derive(Debug, Clone, Copy)]
pub(super) struct RateLimit {
    interval_ns: u64,
    next_ns: u64,
}

impl RateLimit {
    /// Frames at this distance at least; 0 for all.
    pub(super) fn new(interval_ns: u64) -> Self {
        Self { interval_ns, next_ns: 0 }
    }

    /// Whether a frame that was due at this time is sent. So frames of a regular source keep the mean rate.
    pub(super) fn takes(&mut self, due_ns: u64) -> bool {
        if due_ns < self.next_ns && self.next_ns - due_ns <= self.interval_ns {
            return false;
        }
        let next_ns = self.next_ns.saturating_add(self.interval_ns);
        // After a pause, or from a source that is slower, the interval begins anew.
        self.next_ns = if next_ns > due_ns && self.next_ns <= due_ns {
            next_ns
        } else {
            due_ns.saturating_add(self.interval_ns)
        };
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(interval_ns: u64, due: impl Iterator<Item = u64>) -> Vec<u64> {
        let mut limit = RateLimit::new(interval_ns);
        due.filter(|due_ns| limit.takes(*due_ns)).collect()
    }

    #[test]
    fn frames_of_a_faster_source_come_at_the_rate() {
        let due = (0..1000).map(|n| 5_000 + n * 10);
        assert_eq!(taken(100, due.clone()).len(), 100);
        // 3 of 10 frames, as the rate is no whole part of the source's.
        assert_eq!(taken(33, due.clone()).len(), 303);
        assert_eq!(taken(0, due.clone()).len(), 1000);
        assert_eq!(taken(11, due).len(), 909);
    }

    #[test]
    fn frames_of_a_slower_source_all_come() {
        assert_eq!(taken(100, (0..50).map(|n| 7 + n * 150)).len(), 50);
    }

    #[test]
    fn a_pause_is_not_made_up_for_and_a_clock_that_begins_anew_is_followed() {
        let with_pause = (0..100).chain(500..600).map(|n| 10_000 + n * 10);
        assert_eq!(taken(100, with_pause).len(), 20);
        let begun_anew = (500..600).chain(0..100).map(|n| 10_000 + n * 10);
        assert_eq!(taken(100, begun_anew).len(), 20);
    }
}
