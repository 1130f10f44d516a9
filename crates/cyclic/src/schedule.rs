//! What a task asks for: when it is due, how it waits, what it does when it is late.

use crate::margin::CEILING_NS;

/// When a task runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule {
    /// Time between releases, in ns; meant for 10 us to 1 h. Zero counts as 1.
    pub period_ns: u64,
    /// Offset of the first release from the node's epoch, in ns.
    pub phase_ns: u64,
    /// How to wait for the release.
    pub wake: Wake,
    /// What to do when releases were missed.
    pub overrun: Overrun,
    /// How many missed releases end the loop, whatever `overrun` says; `None`: any number passes.
    pub limit: Option<MissLimit>,
}

impl Schedule {
    /// Releases on the whole grid, skipped when they were missed, however many that are.
    pub const fn every(period_ns: u64, wake: Wake) -> Self {
        Self { period_ns, phase_ns: 0, wake, overrun: Overrun::Skip, limit: None }
    }
}

/// Missed releases that are too many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissLimit {
    /// This many ...
    pub misses: u32,
    /// ... within this many cycles of the grid.
    pub cycles: u64,
}

/// How a task waits for its release: CPU time against punctuality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wake {
    /// Sleep until the release. Costs no CPU time; late by the system's wake-up latency.
    Sleep,
    /// Sleep until a margin before the release, then watch the clock.
    Hybrid(Margin),
    /// Watch the clock all the time. Costs a whole CPU, and with real-time priority the kernel's
    /// throttling takes that CPU away for 50 ms of every second unless it is switched off.
    Spin,
}

/// How long before the release a hybrid wait is awake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Margin {
    /// Always this long, in ns.
    Fixed(u64),
    /// As long as the observed wake-up latency asks for, but no longer than this part of the
    /// period: the most that the wait costs of a CPU.
    Adaptive {
        /// 0 to 1.
        cpu_budget: f64,
    },
}

impl Default for Margin {
    /// Adaptive, at most a fifth of a CPU.
    fn default() -> Self {
        Self::Adaptive { cpu_budget: 0.2 }
    }
}

impl Wake {
    /// The name used in configurations and reports: `sleep`, `hybrid` or `spin`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Sleep => "sleep",
            Self::Hybrid(_) => "hybrid",
            Self::Spin => "spin",
        }
    }

    /// The longest that this wait watches the clock before a release of a task of this period;
    /// both in ns. Sleeping costs no CPU time, watching does.
    pub fn longest_watch_ns(self, period_ns: u64) -> u64 {
        match self {
            Self::Sleep => 0,
            Self::Hybrid(margin) => margin.longest_ns(period_ns),
            Self::Spin => period_ns,
        }
    }
}

impl Margin {
    /// The longest that this margin becomes for a task of this period; both in ns.
    pub fn longest_ns(self, period_ns: u64) -> u64 {
        match self {
            Self::Fixed(margin_ns) => margin_ns.min(period_ns),
            Self::Adaptive { cpu_budget } => {
                CEILING_NS.min(cpu_budget * period_ns as f64).max(0.0) as u64
            }
        }
    }
}

/// What a task does about releases it missed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overrun {
    /// Skip them and go on with the release that is current: the grid is kept, inputs are fresh.
    Skip,
    /// Run them late, back to back, at most [`crate::MAX_BURST`] in a row; then skip.
    CatchUp,
    /// End the loop after the cycle that came late, so that its frame tells of it.
    Stop,
}

impl Overrun {
    /// The name used in configurations: `skip`, `catch_up` or `stop`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Skip => "skip",
            Self::CatchUp => "catch_up",
            Self::Stop => "stop",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_watches_the_clock_for_its_longest_margin_at_most() {
        const MS: u64 = 1_000_000;
        let adaptive = |cpu_budget| Wake::Hybrid(Margin::Adaptive { cpu_budget });
        for (wake, period_ns, watched_ns) in [
            (Wake::Sleep, MS, 0),
            (Wake::Spin, MS, MS),
            (Wake::Hybrid(Margin::Fixed(80_000)), MS, 80_000),
            (Wake::Hybrid(Margin::Fixed(2 * MS)), MS, MS),
            (adaptive(0.5), MS / 10, 50_000),
            (adaptive(0.5), MS, 200_000),
        ] {
            assert_eq!(wake.longest_watch_ns(period_ns), watched_ns, "{wake:?} {period_ns}");
        }
    }
}
