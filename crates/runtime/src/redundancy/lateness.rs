//! How long after its release the holder of a node has usually finished a cycle.

/// How many cycles count.
const WINDOW: usize = 1000;
/// Added to what was measured: the standby wakes at its own time, and the frame is on its way.
const MARGIN_NS: u64 = 50_000;

/// The last cycles of one task of the holder.
#[derive(Debug)]
pub(crate) struct Lateness {
    late_ns: Box<[u64; WINDOW]>,
    seen: usize,
    most_ns: u64,
}

impl Lateness {
    /// None were seen yet, of a task with this period.
    pub(crate) fn new(period_ns: u64) -> Self {
        Self { late_ns: Box::new([0; WINDOW]), seen: 0, most_ns: period_ns }
    }

    /// Takes in how late a cycle was.
    pub(crate) fn note(&mut self, late_ns: u64) {
        if let Some(oldest) = self.late_ns.get_mut(self.seen % WINDOW) {
            *oldest = late_ns;
        }
        self.seen += 1;
    }

    /// When to look for the state after a cycle, in ns after its release: 99.9 % of the last thousand had come by then. At
    /// most a period.
    pub(crate) fn delay_ns(&self) -> u64 {
        // While few were seen, half a period.
        let few = if self.seen < WINDOW / 10 { self.most_ns / 2 } else { 0 };
        let (mut most, mut second) = (0, 0);
        for late_ns in self.late_ns.iter() {
            second = second.max(most.min(*late_ns));
            most = most.max(*late_ns);
        }
        // Of a thousand, one may have been later.
        second.max(few).saturating_add(MARGIN_NS).min(self.most_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 10_000_000;

    #[test]
    fn one_cycle_in_a_thousand_may_be_later() {
        let mut lateness = Lateness::new(PERIOD_NS);
        assert_eq!(lateness.delay_ns(), PERIOD_NS / 2 + MARGIN_NS);
        (0..WINDOW).for_each(|_| lateness.note(100_000));
        assert_eq!(lateness.delay_ns(), 100_000 + MARGIN_NS);
        lateness.note(3_000_000);
        assert_eq!(lateness.delay_ns(), 100_000 + MARGIN_NS);
        lateness.note(2_000_000);
        assert_eq!(lateness.delay_ns(), 2_000_000 + MARGIN_NS);
        (0..WINDOW).for_each(|_| lateness.note(100_000));
        assert_eq!(lateness.delay_ns(), 100_000 + MARGIN_NS);
    }

    #[test]
    fn a_state_is_looked_for_within_a_period() {
        let mut lateness = Lateness::new(PERIOD_NS);
        (0..WINDOW).for_each(|_| lateness.note(u64::MAX));
        assert_eq!(lateness.delay_ns(), PERIOD_NS);
    }
}
