//! Disturbances of a loop.

use serde::{Deserialize, Serialize};

/// Part of a turn that the host may take before the turn is invalid.
const STEAL: f64 = 0.001;

/// What disturbed a period of time, as counted by the kernel. What it did not count is `None`, `null`
/// in JSON.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Disturbance {
    /// CPU time that the host took from the arm's CPU, in ns.
    pub steal_ns: Option<u64>,
    /// Time during which a CPU limit stopped the arm's control group, in ns.
    pub throttled_ns: Option<u64>,
    /// Page faults of the arm's thread.
    pub faults: Option<u64>,
    /// Times the kernel took the CPU away from the arm's thread.
    pub preemptions: Option<u64>,
    /// Interrupts on the arm's CPU, except those of its own timer.
    pub interrupts: Option<u64>,
}

/// What most likely made a release late; a word in reports.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "&'static str")]
pub enum Cause {
    /// The host took the CPU.
    Steal,
    /// A CPU limit stopped the control group.
    Throttled,
    /// A page fault.
    Fault,
    /// The kernel gave the CPU to another thread.
    Preempted,
    /// An interrupt.
    Interrupt,
    /// Nothing was counted, or a later version wrote a cause that this one does not know.
    #[default]
    Unknown,
}

impl Cause {
    /// All causes, from the gravest to none.
    pub const ALL: [Self; 6] = [
        Self::Steal,
        Self::Throttled,
        Self::Fault,
        Self::Preempted,
        Self::Interrupt,
        Self::Unknown,
    ];

    /// The word used in reports: `steal`, `throttled`, `fault`, `preempted`, `interrupt` or
    /// `unknown`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Steal => "steal",
            Self::Throttled => "throttled",
            Self::Fault => "fault",
            Self::Preempted => "preempted",
            Self::Interrupt => "interrupt",
            Self::Unknown => "unknown",
        }
    }
}

impl From<Cause> for &'static str {
    fn from(cause: Cause) -> Self {
        cause.as_str()
    }
}

impl From<String> for Cause {
    fn from(word: String) -> Self {
        Self::ALL.into_iter().find(|cause| cause.as_str() == word).unwrap_or_default()
    }
}

impl Disturbance {
    /// The increase since `earlier` of what was counted both times.
    #[must_use]
    pub fn since(self, earlier: Self) -> Self {
        self.combine(earlier, u64::saturating_sub)
    }

    /// This and `other` together, of what was counted in both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        self.combine(other, u64::saturating_add)
    }

    fn combine(self, other: Self, combined: fn(u64, u64) -> u64) -> Self {
        let both = |one: Option<u64>, other: Option<u64>| Some(combined(one?, other?));
        Self {
            steal_ns: both(self.steal_ns, other.steal_ns),
            throttled_ns: both(self.throttled_ns, other.throttled_ns),
            faults: both(self.faults, other.faults),
            preemptions: both(self.preemptions, other.preemptions),
            interrupts: both(self.interrupts, other.interrupts),
        }
    }

    /// The most likely cause: the gravest that was counted.
    pub const fn cause(&self) -> Cause {
        match self {
            Self { steal_ns: Some(1..), .. } => Cause::Steal,
            Self { throttled_ns: Some(1..), .. } => Cause::Throttled,
            Self { faults: Some(1..), .. } => Cause::Fault,
            Self { preemptions: Some(1..), .. } => Cause::Preempted,
            Self { interrupts: Some(1..), .. } => Cause::Interrupt,
            _ => Cause::Unknown,
        }
    }

    /// Why a turn of `elapsed_ns` says little about its arm: more than 0.1 % of its time was
    /// stolen, its control group was throttled, or it had a page fault. The rule never looks at the
    /// measured times. A count that the kernel does not give invalidates nothing.
    pub fn invalidates(&self, elapsed_ns: u64) -> Option<String> {
        let stolen = self.steal_ns.map(|ns| ns as f64 / elapsed_ns.max(1) as f64);
        match (self.throttled_ns, stolen, self.faults) {
            (Some(ns @ 1..), _, _) => Some(format!("throttled for {} us", ns / 1_000)),
            (_, Some(part), _) if part > STEAL => {
                Some(format!("the host took {:.2} % of the CPU", 100.0 * part))
            }
            (_, _, Some(1)) => Some("1 page fault".to_owned()),
            (_, _, Some(faults @ 2..)) => Some(format!("{faults} page faults")),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_little_steal_and_interrupts_are_life() {
        let little = Disturbance {
            steal_ns: Some(900_000),
            interrupts: Some(70),
            preemptions: Some(2),
            ..Disturbance::default()
        };
        assert_eq!(little.invalidates(1_000_000_000), None);
    }

    #[test]
    fn the_cause_is_what_explains_most() {
        let one = Some(1);
        let mut counted = Disturbance {
            steal_ns: one,
            throttled_ns: one,
            faults: one,
            preemptions: one,
            interrupts: one,
        };
        let mut causes = Vec::new();
        for count in 0..=5 {
            causes.push(counted.cause());
            // Counted, and there was none; or not counted.
            match count {
                0 => counted.steal_ns = Some(0),
                1 => counted.throttled_ns = None,
                2 => counted.faults = Some(0),
                3 => counted.preemptions = None,
                _ => counted.interrupts = Some(0),
            }
        }
        assert_eq!(causes, Cause::ALL);
    }

    #[test]
    fn a_cause_reads_back_from_its_word_and_that_of_a_later_version_is_unknown() {
        for cause in Cause::ALL {
            let word = serde_json::to_string(&cause).unwrap();
            assert_eq!(word, format!("\"{}\"", cause.as_str()));
            assert_eq!(serde_json::from_str::<Cause>(&word).unwrap(), cause);
        }
        assert_eq!(serde_json::from_str::<Cause>("\"gremlins\"").unwrap(), Cause::Unknown);
    }

    #[test]
    fn what_was_counted_before_does_not_count_and_what_was_not_counted_is_not_0() {
        let earlier =
            Disturbance { interrupts: Some(5), steal_ns: Some(3), ..Disturbance::default() };
        let later = Disturbance { interrupts: Some(7), faults: Some(1), ..Disturbance::default() };
        assert_eq!(
            later.since(earlier),
            Disturbance { interrupts: Some(2), ..Disturbance::default() }
        );
        assert_eq!(
            later.and(earlier),
            Disturbance { interrupts: Some(12), ..Disturbance::default() }
        );
    }

    #[test]
    fn a_machine_that_counts_nothing_invalidates_no_turn_and_says_null() {
        assert_eq!(Disturbance::default().invalidates(1_000_000_000), None);
        let json = serde_json::to_value(Disturbance::default()).unwrap();
        assert!(json.as_object().unwrap().values().all(serde_json::Value::is_null), "{json}");
    }
}
