//! How far a task has come, and what is lost on the way.

use crate::CycleRecord;

/// How far a task has come: a cycle that ran, and how many did not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// The cycle.
    pub cycle: u64,
    /// Cycles that did not run, until then.
    pub missed: u64,
}

impl Progress {
    /// That of a record.
    pub fn of(record: &CycleRecord) -> Self {
        Self { cycle: record.cycle, missed: record.missed }
    }

    /// The place before the first cycle of a task that counts from `first_cycle`.
    pub fn before(first_cycle: u64) -> Option<Self> {
        first_cycle.checked_sub(1).map(|cycle| Self { cycle, missed: 0 })
    }

    /// How many cycles have run, this one and those of earlier runs included.
    pub fn ran(self) -> u64 {
        self.cycle.saturating_add(1).saturating_sub(self.missed)
    }

    /// How many ran between another one, or the start, and this one.
    pub fn lost_since(self, before: Option<Self>) -> u64 {
        self.lost_until_end(before).saturating_sub(1)
    }

    /// The same with this one, where it is lost itself.
    pub fn lost_until_end(self, before: Option<Self>) -> u64 {
        self.ran().saturating_sub(before.map_or(0, Self::ran))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lost_is_what_ran_and_did_not_come() {
        let lost = |(cycle, missed), before: Option<(u64, u64)>| {
            let before = before.map(|(cycle, missed)| Progress { cycle, missed });
            Progress { cycle, missed }.lost_since(before)
        };
        assert_eq!(lost((8, 3), Some((7, 3))), 0);
        assert_eq!(lost((12, 7), Some((7, 3))), 0);
        assert_eq!(lost((12, 4), Some((7, 3))), 3);
        assert_eq!(lost((2, 0), Some((7, 3))), 0, "never less than none");
        assert_eq!((lost((0, 0), None), lost((5, 5), None), lost((5, 1), None)), (0, 0, 4));
        let end = Progress { cycle: 9, missed: 1 };
        assert_eq!(end.lost_until_end(Some(end)), 0);
        assert_eq!(end.lost_until_end(Some(Progress { cycle: 7, missed: 1 })), 2);
    }
}
