//! How much lies around a trigger.

/// How much is captured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Before the cycle of the trigger, in ns.
    pub before_ns: u64,
    /// From that cycle on, in ns.
    pub after_ns: u64,
}

impl Window {
    /// From its first to its last instant, in ns.
    pub fn length_ns(self) -> u64 {
        self.before_ns.saturating_add(self.after_ns)
    }

    /// How many rows of a task with this period are kept at most: those of the window, and those that wait
    /// for another task's.
    pub fn rows(self, period_ns: u64) -> u64 {
        self.length_ns().saturating_add(LAG_NS).div_ceil(period_ns.max(1)).saturating_add(MARGIN)
    }
}

/// By how much one task's rows may come later than another's.
pub(crate) const LAG_NS: u64 = 4_000_000_000;
const MARGIN: u64 = 16;
