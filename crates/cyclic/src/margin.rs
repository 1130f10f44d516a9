//! How long before the release a hybrid wait must be awake.

use isochrone_model::LONGEST_ADAPTIVE_MARGIN_NS;

/// No margin is shorter: below this, arming the timer costs more than the sleep saves.
const FLOOR_NS: f64 = 5_000.0;
/// No margin is longer.
const CEILING_NS: f64 = LONGEST_ADAPTIVE_MARGIN_NS as f64;
/// Where a margin starts, before anything was observed.
const INITIAL_NS: f64 = 50_000.0;
/// A late wake-up raises the margin to this multiple of its latency ...
const HEADROOM: f64 = 1.25;
/// ... plus this, which also covers the few clock reads around the sleep.
const HEADROOM_NS: f64 = 2_000.0;
/// Part of the margin that is given back per second without a late wake-up.
const DECAY_PER_S: f64 = 0.01;

/// Follows the tail of the wake-up latency: up at once, down by 1 % per second.
///
/// The margin lies between 5 us and min(cpu_budget * period, 200 us). A latency beyond that upper bound is
/// ignored, because no permitted margin would have hidden it and a longer one would only burn CPU.
#[derive(Debug, Clone)]
pub(crate) struct AdaptiveMargin {
    margin_ns: f64,
    floor_ns: f64,
    ceiling_ns: f64,
    keep_per_wake: f64,
}

impl AdaptiveMargin {
    /// A margin for a task of this period in ns, before any observation; at most the part
    /// `cpu_budget` of the period.
    pub(crate) fn new(period_ns: u64, cpu_budget: f64) -> Self {
        let period = period_ns as f64;
        let ceiling_ns = CEILING_NS.min(cpu_budget * period);
        let floor_ns = FLOOR_NS.min(ceiling_ns);
        Self {
            margin_ns: INITIAL_NS.max(floor_ns).min(ceiling_ns),
            floor_ns,
            ceiling_ns,
            keep_per_wake: (1.0 - DECAY_PER_S * period / 1e9).max(0.0),
        }
    }

    /// Takes in one wake-up that came `latency_ns` after the time that was slept for.
    #[inline]
    pub(crate) fn observe(&mut self, latency_ns: u64) {
        let latency = latency_ns as f64;
        let kept = (self.margin_ns * self.keep_per_wake).max(self.floor_ns);
        let wanted = HEADROOM * latency + HEADROOM_NS;
        self.margin_ns =
            if latency > self.ceiling_ns { kept } else { kept.max(wanted.min(self.ceiling_ns)) };
    }

    /// The margin in ns.
    #[inline]
    pub(crate) fn ns(&self) -> u64 {
        self.margin_ns as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_late_wake_up_raises_the_margin_at_once() {
        let mut margin = AdaptiveMargin::new(MS, 0.4);
        margin.observe(80_000);
        assert_eq!(margin.ns(), 102_000);
    }

    #[test]
    fn the_margin_falls_by_one_percent_in_a_second_of_punctual_wake_ups() {
        let mut margin = AdaptiveMargin::new(MS, 0.4);
        margin.observe(100_000);
        let before = margin.ns() as f64;
        for _ in 0..1000 {
            margin.observe(0);
        }
        let kept = margin.ns() as f64 / before;
        assert!((0.9899..0.9902).contains(&kept), "kept {kept}");
    }

    #[test]
    fn punctual_wake_ups_bring_the_margin_down_to_its_floor() {
        let mut margin = AdaptiveMargin::new(100 * MS, 0.4);
        for _ in 0..100_000 {
            margin.observe(0);
        }
        assert_eq!(margin.ns(), 5_000);
    }

    #[test]
    fn a_latency_that_no_margin_could_hide_leaves_the_margin_alone() {
        let mut margin = AdaptiveMargin::new(MS, 0.4);
        let before = margin.ns();
        margin.observe(10 * MS);
        assert!(margin.ns() <= before);
    }

    #[test]
    fn a_short_period_caps_the_margin_at_two_fifths_of_itself() {
        assert_eq!(AdaptiveMargin::new(10_000, 0.4).ns(), 4_000);
    }

    proptest! {
        #[test]
        fn the_margin_stays_within_its_bounds(
            period_ns in 10_000u64..=3_600_000_000_000,
            latencies in prop::collection::vec(prop_oneof![0u64..400_000, any::<u64>()], 0..200),
        ) {
            let mut margin = AdaptiveMargin::new(period_ns, 0.4);
            let ceiling = (period_ns * 2 / 5).min(200_000);
            for latency in latencies {
                margin.observe(latency);
                prop_assert!(margin.ns() >= ceiling.min(5_000) && margin.ns() <= ceiling);
            }
        }

        #[test]
        fn the_margin_covers_the_wake_up_just_seen_if_any_margin_could(
            period_ns in 10_000u64..=1_000_000_000,
            latencies in prop::collection::vec(0u64..400_000, 1..200),
        ) {
            let mut margin = AdaptiveMargin::new(period_ns, 0.4);
            let ceiling = (period_ns * 2 / 5).min(200_000);
            for latency in latencies {
                margin.observe(latency);
                prop_assert!(latency > ceiling || margin.ns() >= latency);
            }
        }
    }
}
