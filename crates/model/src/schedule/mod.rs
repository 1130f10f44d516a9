//! The schedule of a cyclic task: when it is due, how it waits, and what it does when it is late.

mod begun;
mod grid;
mod overrun;
mod wake;

pub use begun::{CycleStart, CycleStartCounts};
pub use grid::{
    EPOCH_GRID_NS, EPOCH_OFFSET_NS, KERNEL_TICK_NS, epoch_after_ns, greatest_common_divisor,
    phase_between_ticks_ns,
};
pub use overrun::{MissLimit, Overrun};
pub use wake::{LONGEST_ADAPTIVE_MARGIN_NS, Margin, Wake};

/// When a task runs.
///
/// ```
/// use isochrone_model::{Margin, Overrun, Schedule, Wake};
///
/// let schedule = Schedule::every(1_000_000, Wake::Hybrid(Margin::Fixed(80_000)));
/// assert_eq!(schedule.wake.as_str(), "hybrid");
/// assert_eq!(schedule.longest_watch_ns(), 80_000);
/// assert_eq!(schedule.overrun, Overrun::Skip);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule {
    /// Time between releases, in ns; meant for 10 us to 1 h. Zero counts as 1.
    pub period_ns: u64,
    /// Offset of the first release from the node's epoch, in ns; less than the period.
    pub phase_ns: u64,
    /// How to wait for the release.
    pub wake: Wake,
    /// The action after missed releases.
    pub overrun: Overrun,
    /// Number of missed releases that ends the loop, regardless of `overrun`; `None`: no limit.
    pub limit: Option<MissLimit>,
    /// How long after its release a cycle waits for new data at most, in ns, watching the clock and
    /// the port; `None`: it begins at its release.
    pub follow_within_ns: Option<u64>,
}

impl Schedule {
    /// Releases without a phase offset, at which cycles begin; missed releases are skipped, without a
    /// limit.
    pub const fn every(period_ns: u64, wake: Wake) -> Self {
        Self {
            period_ns,
            phase_ns: 0,
            wake,
            overrun: Overrun::Skip,
            limit: None,
            follow_within_ns: None,
        }
    }

    /// Longest time that the task watches the clock before a release, in ns. Watching uses CPU
    /// time, sleeping does not.
    pub fn longest_watch_ns(&self) -> u64 {
        match self.wake {
            Wake::Sleep => 0,
            Wake::Hybrid(margin) => margin.longest_ns(self.period_ns),
            Wake::Spin => self.period_ns,
        }
    }

    /// Longest time that the task watches the clock in a whole period, in ns: before a release and,
    /// where it follows its data, after it.
    pub fn longest_watch_in_a_period_ns(&self) -> u64 {
        let after_ns = self.follow_within_ns.unwrap_or(0);
        self.longest_watch_ns().saturating_add(after_ns).min(self.period_ns)
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
            assert_eq!(
                Schedule::every(period_ns, wake).longest_watch_ns(),
                watched_ns,
                "{wake:?} {period_ns}"
            );
        }
    }

    #[test]
    fn the_wait_for_data_counts_as_margin() {
        const MS: u64 = 1_000_000;
        for (wake, watched_ns) in [
            (Wake::Sleep, 300_000),
            (Wake::Hybrid(Margin::Fixed(80_000)), 380_000),
            (Wake::Hybrid(Margin::Fixed(800_000)), MS),
            (Wake::Spin, MS),
        ] {
            let follow_within_ns = Some(300_000);
            let schedule = Schedule { follow_within_ns, ..Schedule::every(MS, wake) };
            assert_eq!(schedule.longest_watch_in_a_period_ns(), watched_ns, "{wake:?}");
        }
    }
}
