//! What disturbs a loop.

use serde::{Deserialize, Serialize};

/// Part of a turn that the host may take before the turn is invalid.
const STEAL: f64 = 0.001;

/// What disturbed a period of time, as counted by the kernel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Disturbance {
    /// CPU time that the host took from the arm's CPU, in ns.
    pub steal_ns: u64,
    /// Time during which a CPU limit stopped the arm's control group, in ns.
    pub throttled_ns: u64,
    /// Page faults of the arm's thread.
    pub faults: u64,
    /// Times the kernel took the CPU away from the arm's thread.
    pub preemptions: u64,
    /// Interrupts on the arm's CPU, except those of its own timer.
    pub interrupts: u64,
}

impl Disturbance {
    /// The cause if nothing was counted.
    pub const UNKNOWN: &'static str = "unknown";

    /// The increase since `earlier`.
    #[must_use]
    pub fn since(self, earlier: Self) -> Self {
        Self {
            steal_ns: self.steal_ns.saturating_sub(earlier.steal_ns),
            throttled_ns: self.throttled_ns.saturating_sub(earlier.throttled_ns),
            faults: self.faults.saturating_sub(earlier.faults),
            preemptions: self.preemptions.saturating_sub(earlier.preemptions),
            interrupts: self.interrupts.saturating_sub(earlier.interrupts),
        }
    }

    /// The most likely cause: `steal`, `throttled`, `fault`, `preempted`, `interrupt` or `unknown`.
    pub const fn cause(&self) -> &'static str {
        match self {
            Self { steal_ns: 1.., .. } => "steal",
            Self { throttled_ns: 1.., .. } => "throttled",
            Self { faults: 1.., .. } => "fault",
            Self { preemptions: 1.., .. } => "preempted",
            Self { interrupts: 1.., .. } => "interrupt",
            _ => Self::UNKNOWN,
        }
    }

    /// Why a turn of `elapsed_ns` says little about its arm: more than 0.1 % of its time was
    /// stolen, its control group was throttled, or it had a page fault. The rule never looks at the
    /// measured times.
    pub fn invalidates(&self, elapsed_ns: u64) -> Option<String> {
        let steal = self.steal_ns as f64 / elapsed_ns.max(1) as f64;
        if self.throttled_ns > 0 {
            Some(format!("throttled for {} us", self.throttled_ns / 1_000))
        } else if steal > STEAL {
            Some(format!("the host took {:.2} % of the CPU", 100.0 * steal))
        } else if self.faults > 0 {
            Some(format!("{} page fault{}", self.faults, if self.faults == 1 { "" } else { "s" }))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_little_steal_and_interrupts_are_life() {
        let little = Disturbance {
            steal_ns: 900_000,
            interrupts: 70,
            preemptions: 2,
            ..Disturbance::default()
        };
        assert_eq!(little.invalidates(1_000_000_000), None);
    }

    #[test]
    fn the_cause_is_what_explains_most() {
        let all =
            Disturbance { steal_ns: 1, throttled_ns: 1, faults: 1, preemptions: 1, interrupts: 1 };
        assert_eq!(all.cause(), "steal");
        let fault = Disturbance { steal_ns: 0, throttled_ns: 0, ..all };
        assert_eq!(fault.cause(), "fault");
        assert_eq!(Disturbance::default().cause(), "unknown");
    }

    #[test]
    fn what_was_counted_before_does_not_count() {
        let earlier = Disturbance { interrupts: 5, ..Disturbance::default() };
        let later = Disturbance { interrupts: 7, faults: 1, ..Disturbance::default() };
        assert_eq!(
            later.since(earlier),
            Disturbance { interrupts: 2, faults: 1, ..Disturbance::default() }
        );
    }
}
