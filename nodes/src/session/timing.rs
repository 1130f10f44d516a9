//! The timing of a task's cycles over the last second and the last minute.

use std::collections::{HashMap, VecDeque};

use isochrone_timing::{CycleStartCounts, Distribution, Summary};

use super::news::{FollowSample, Sample};

const SECOND_NS: u64 = 1_000_000_000;
const MINUTE_NS: u64 = 60 * SECOND_NS;

/// Between two looks at percentiles: digits that change faster cannot be read.
const INTERVAL_NS: u64 = 1_000_000_000;

/// The timing of all tasks.
#[derive(Debug, Default)]
pub(crate) struct Timings {
    samples: HashMap<String, TaskSamples>,
    windows: HashMap<String, Windows>,
    due_ns: u64,
}

impl Timings {
    pub(crate) fn take(&mut self, samples: Vec<Sample>) {
        for sample in samples {
            self.samples.entry(sample.task.clone()).or_default().take(sample);
        }
    }

    /// Time goes on.
    pub(crate) fn tick(&mut self, now_ns: u64) {
        if now_ns < self.due_ns {
            return;
        }
        self.due_ns = now_ns + INTERVAL_NS;
        let mut scratch = Distribution::new();
        let tasks = self.samples.iter_mut();
        let windows =
            tasks.map(|(task, samples)| (task.clone(), samples.windows(now_ns, &mut scratch)));
        self.windows = windows.collect();
    }

    /// The samples of a task.
    pub(crate) fn windows(&self, task: &str) -> Windows {
        self.windows.get(task).copied().unwrap_or_default()
    }
}

/// The cycles of a task that telemetry showed within the last minute.
#[derive(Debug, Default)]
struct TaskSamples {
    samples: VecDeque<Sample>,
}

/// The summary of the samples of a time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Window {
    /// Cycles that telemetry showed.
    pub(crate) shown: u64,
    /// Cycles that there were from the first to the last of them.
    pub(crate) cycles: u64,
    /// Release jitter of those that were shown, ns.
    pub(crate) jitter: Summary,
}

/// How the cycles of a task that follows its data began within the last second.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct FollowWindow {
    /// Of all cycles since the one that was shown last before.
    pub(crate) begun: CycleStartCounts,
    /// Median of those that were shown, ns.
    pub(crate) wait_ns: Option<u64>,
    pub(crate) latency_ns: Option<u64>,
}

/// The summaries of both times.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Windows {
    /// Of a task that follows its data.
    pub(crate) second: Option<FollowWindow>,
    pub(crate) minute: Window,
}

impl TaskSamples {
    /// Takes a cycle in. Telemetry repeats the newest cycle of a task until there is a newer one.
    fn take(&mut self, sample: Sample) {
        let newest = self.samples.back().map(|newest| newest.cycle);
        if newest == Some(sample.cycle) {
            return;
        }
        if newest > Some(sample.cycle) {
            // The node was started again.
            self.samples.clear();
        }
        self.samples.push_back(sample);
    }

    /// The summaries of the last second and the last minute before `now_ns`; drops older samples.
    fn windows(&mut self, now_ns: u64, scratch: &mut Distribution) -> Windows {
        let is_old = |sample: &Sample| sample.at_ns.saturating_add(MINUTE_NS) < now_ns;
        while self.samples.front().is_some_and(is_old) {
            self.samples.pop_front();
        }
        Windows {
            second: self.second(now_ns.saturating_sub(SECOND_NS), scratch),
            minute: self.minute(scratch),
        }
    }

    fn second(&self, since_ns: u64, scratch: &mut Distribution) -> Option<FollowWindow> {
        let first = self.samples.partition_point(|sample| sample.at_ns < since_ns);
        // What was counted until the first of them is told by the one before.
        let counted = self.samples.range(first.saturating_sub(1)..);
        let follows = self.samples.range(first..);
        FollowWindow::of(
            counted.filter_map(|sample| sample.follow),
            follows.filter_map(|sample| sample.follow),
            scratch,
        )
    }

    fn minute(&self, scratch: &mut Distribution) -> Window {
        let cycles = match (self.samples.front(), self.samples.back()) {
            (Some(first), Some(last)) => last.cycle - first.cycle + 1,
            _ => 0,
        };
        let jitter = summary(scratch, self.samples.iter().map(|sample| sample.release_jitter_ns));
        Window { shown: self.samples.len() as u64, cycles, jitter }
    }
}

impl FollowWindow {
    fn of(
        mut counted: impl Iterator<Item = FollowSample>,
        follows: impl Iterator<Item = FollowSample> + Clone,
        scratch: &mut Distribution,
    ) -> Option<Self> {
        let first = counted.next()?;
        let last = counted.last()?;
        Some(Self {
            begun: last.begun.since(first.begun),
            wait_ns: summary(scratch, follows.clone().map(|follow| follow.wait_ns)).p50,
            latency_ns: summary(scratch, follows.filter_map(|follow| follow.latency_ns)).p50,
        })
    }
}

fn summary(scratch: &mut Distribution, values: impl Iterator<Item = u64>) -> Summary {
    scratch.clear();
    values.for_each(|value| scratch.record(value));
    scratch.summary()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(cycle: u64, at_ns: u64, release_jitter_ns: u64) -> Sample {
        let (task, follow) = ("t".into(), None);
        Sample { task, cycle, at_ns, release_jitter_ns, follow }
    }

    /// One of twenty cycles of 1 ms is shown, for ninety seconds; its jitter is its number.
    fn ninety_seconds() -> TaskSamples {
        let mut samples = TaskSamples::default();
        for number in 0..90 * 50 {
            samples.take(sample(number * 20, number * 20_000_000, number));
        }
        samples
    }

    #[test]
    fn a_window_has_the_cycles_of_its_time_alone_and_says_how_many_those_are_of_how_many() {
        let mut samples = ninety_seconds();
        let now_ns = 90 * SECOND_NS;
        let windows = samples.windows(now_ns, &mut Distribution::new());
        assert_eq!((windows.minute.shown, windows.minute.cycles), (3000, 59_981));
        assert_eq!(windows.minute.jitter.min, Some(1500));
    }

    #[test]
    fn a_percentile_that_too_few_samples_support_is_none() {
        let mut samples = ninety_seconds();
        let mut scratch = Distribution::new();
        assert!(samples.windows(90 * SECOND_NS, &mut scratch).minute.jitter.p99.is_some());
        let last = samples.windows(149 * SECOND_NS, &mut scratch).minute;
        assert!(last.shown == 50 && last.jitter.p50.is_some() && last.jitter.p99.is_none());
    }

    #[test]
    fn a_window_tells_how_its_cycles_began_and_how_long_those_that_were_shown_waited() {
        let mut samples = TaskSamples::default();
        for number in 0..200 {
            let follow = FollowSample {
                begun: CycleStartCounts {
                    followed: number * 17,
                    found_ready: 5 + number * 2,
                    timed_out: number,
                },
                wait_ns: 100 + number,
                latency_ns: (number % 2 == 0).then_some(2_000),
            };
            let sample = sample(number * 20, number * 20_000_000, 1);
            samples.take(Sample { follow: Some(follow), ..sample });
        }
        let windows = samples.windows(4 * SECOND_NS, &mut Distribution::new());
        let expected = FollowWindow {
            begun: CycleStartCounts { followed: 50 * 17, found_ready: 50 * 2, timed_out: 50 },
            wait_ns: Some(274),
            latency_ns: Some(2_000),
        };
        assert_eq!(windows.second, Some(expected));
        let without = ninety_seconds().windows(90 * SECOND_NS, &mut Distribution::new());
        assert_eq!(without.second, None);
    }

    #[test]
    fn a_node_that_says_nothing_any_more_has_no_timing() {
        let mut samples = ninety_seconds();
        let mut scratch = Distribution::new();
        let later = samples.windows(100 * SECOND_NS, &mut scratch);
        assert_eq!(later.minute.shown, 2500);
        assert_eq!(samples.windows(200 * SECOND_NS, &mut scratch), Windows::default());
    }

    #[test]
    fn a_cycle_that_telemetry_repeats_counts_once_and_a_new_start_forgets_what_was_before() {
        let mut samples = TaskSamples::default();
        for (cycle, at_ns) in [(7, 1), (7, 2), (7, 3), (8, 4)] {
            samples.take(sample(cycle, at_ns, 1));
        }
        let mut scratch = Distribution::new();
        assert_eq!(samples.windows(5, &mut scratch).minute.shown, 2);
        samples.take(sample(0, 6, 9));
        let windows = samples.windows(7, &mut scratch);
        assert_eq!((windows.minute.shown, windows.minute.jitter.max), (1, Some(9)));
    }
}
