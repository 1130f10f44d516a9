//! How long a task's cycles take as a rule.

use isochrone_timing::CycleRecord;

/// An odd number, so that one of them is the median.
const KEPT: usize = 63;

/// The responses of a task's last cycles: from the release to the end of the cycle.
#[derive(Debug)]
pub(crate) struct Responses {
    kept_ns: [u64; KEPT],
    seen: usize,
}

impl Responses {
    pub(crate) fn note(&mut self, record: &CycleRecord) {
        if let Some(kept_ns) = self.kept_ns.get_mut(self.seen % KEPT) {
            *kept_ns = record.end_ns.saturating_sub(record.release_ns);
        }
        self.seen = self.seen.wrapping_add(1);
    }

    /// The median, which a cycle that was held up does not move; `None`: no cycle was seen yet.
    pub(crate) fn median_ns(&self) -> Option<u64> {
        let mut kept_ns = self.kept_ns;
        let kept_ns = kept_ns.get_mut(..self.seen.min(KEPT))?;
        kept_ns.sort_unstable();
        kept_ns.get(kept_ns.len() / 2).copied()
    }
}

impl Default for Responses {
    fn default() -> Self {
        Self { kept_ns: [0; KEPT], seen: 0 }
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
        let long_ago = [1_000; KEPT].into_iter().chain([5; KEPT]);
        assert_eq!(of(long_ago).median_ns(), Some(5));
    }
}
