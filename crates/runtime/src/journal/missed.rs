//! From the records of cycles to those that are missing.

use isochrone_timing::CycleRecord;

use super::line::{Line, Missed, Unclear};

/// Which of a task's cycles have run.
#[derive(Debug, Default)]
pub(super) struct Progress {
    next: u64,
    missed: u64,
}

impl Progress {
    /// Whether a cycle is the one after the last.
    pub(super) fn is_next(&self, record: &CycleRecord) -> bool {
        (self.next, self.missed) == (record.cycle, record.missed)
    }

    /// Takes note of a cycle, and tells of those before it that were missed.
    pub(super) fn note(&mut self, task: &str, record: &CycleRecord) -> Option<Line> {
        let first = self.next;
        let missed = record.missed.saturating_sub(self.missed);
        (self.next, self.missed) = (record.cycle.saturating_add(1), record.missed);
        let (task, last) = (task.to_owned(), record.cycle.checked_sub(1)?);
        match record.cycle.checked_sub(first)? {
            0 => None,
            // The records of cycles that ran found no room.
            _ if missed == 0 => None,
            gap if gap == missed => Some(Line::Missed(Missed { task, first, last })),
            _ => Some(Line::Unclear(Unclear { task, first, last, missed })),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(cycles_and_missed: &[(u64, u64)]) -> Vec<Line> {
        let mut progress = Progress::default();
        let record = |(cycle, missed): &(u64, u64)| {
            let record = CycleRecord { cycle: *cycle, missed: *missed, ..Default::default() };
            progress.note("t", &record)
        };
        cycles_and_missed.iter().filter_map(record).collect()
    }

    fn missed(first: u64, last: u64) -> Line {
        Line::Missed(Missed { task: "t".into(), first, last })
    }

    #[test]
    fn a_gap_between_cycles_is_a_range_of_missed_ones() {
        assert_eq!(lines(&[(0, 0), (1, 0), (2, 0)]), []);
        assert_eq!(
            lines(&[(2, 2), (3, 2), (5, 3), (9, 6)]),
            [missed(0, 1), missed(4, 4), missed(6, 8)]
        );
    }

    #[test]
    fn records_that_were_lost_are_no_missed_cycles_and_make_missed_ones_unclear() {
        assert_eq!(lines(&[(0, 0), (7, 0), (9, 1)]), [missed(8, 8)]);
        let unclear = Unclear { task: "t".into(), first: 1, last: 6, missed: 2 };
        assert_eq!(lines(&[(0, 0), (7, 2), (8, 2)]), [Line::Unclear(unclear)]);
    }
}
