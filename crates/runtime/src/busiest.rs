//! How long a task's cycles have taken lately.

use isochrone_timing::CycleRecord;

/// Length of a window.
const WINDOW_NS: u64 = 1_000_000_000;

/// The longest response of a task in the last second or two: from the release to the end of the cycle.
#[derive(Debug, Default)]
pub(crate) struct Busiest {
    window: u64,
    longest_ns: Option<u64>,
    before_ns: Option<u64>,
}

impl Busiest {
    pub(crate) fn note(&mut self, record: &CycleRecord) {
        let window = record.release_ns / WINDOW_NS;
        if window != self.window {
            (self.window, self.before_ns) = (window, self.longest_ns.take());
        }
        let response_ns = record.end_ns.saturating_sub(record.release_ns);
        self.longest_ns = self.longest_ns.max(Some(response_ns));
    }

    /// `None`: no cycle was seen yet.
    pub(crate) fn longest_ns(&self) -> Option<u64> {
        self.longest_ns.max(self.before_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note(busiest: &mut Busiest, release_ns: u64, response_ns: u64) {
        let end_ns = release_ns + response_ns;
        busiest.note(&CycleRecord { release_ns, end_ns, ..CycleRecord::default() });
    }

    #[test]
    fn a_long_cycle_is_remembered_for_a_second_and_forgotten_after_two() {
        let mut busiest = Busiest::default();
        assert_eq!(busiest.longest_ns(), None);
        note(&mut busiest, WINDOW_NS / 2, 70);
        note(&mut busiest, WINDOW_NS + 1, 20);
        assert_eq!(busiest.longest_ns(), Some(70));
        note(&mut busiest, 2 * WINDOW_NS + 1, 30);
        assert_eq!(busiest.longest_ns(), Some(30));
    }
}
