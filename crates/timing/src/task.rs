//! The timing of one cyclic task.

use crate::distribution::{Distribution, encoded};
use crate::follow::FollowTiming;
use crate::metric::Metric;
use crate::record::{CycleRecord, FollowRecord};
use crate::task_report::TaskReport;

/// The most cycles of a warm-up.
const WARM_UP_CYCLES: u64 = 100;
/// Longest time of a warm-up, unless one cycle takes longer.
const WARM_UP_NS: u64 = 1_000_000_000;

/// Default number of cycles at the start of a task with this period, in ns, that no distribution
/// includes: caches and branch predictors are cold, peers are connecting, and an adaptive margin
/// has not adapted yet. 100 cycles, or as many as fit into 1 s, but at least one.
pub const fn warm_up_cycles(period_ns: u64) -> u64 {
    match WARM_UP_NS.checked_div(period_ns) {
        Some(0) => 1,
        Some(cycles) if cycles < WARM_UP_CYCLES => cycles,
        _ => WARM_UP_CYCLES,
    }
}

/// Computes the timing of one task from its cycle records, in order.
///
/// - *release jitter*: start minus release.
/// - *execution*: end minus start.
/// - *response*: end minus release.
/// - *period error*: the difference between the interval of two starts and the interval of their
///   releases. Between consecutive cycles this is |interval - period|. After missed releases or
///   lost records the releases are several periods apart, and the starts should be, too.
///
/// A task that follows its data begins a cycle some time after its release. Its release jitter is that of
/// the grid: how late after the release the cycle stood ready to wait for data. *Follow wait* is start
/// minus release, *follow latency* the time from the frame that a cycle began with to the cycle's own.
///
/// The first [`warm_up_cycles`] records are excluded from the distributions. A missed release never
/// ran, so it is only counted.
#[derive(Debug, Clone)]
pub struct TaskTiming {
    period_ns: u64,
    warm_up_cycles: u64,
    first_cycle: u64,
    is_interrupted: bool,
    records: u64,
    last: Option<CycleRecord>,
    release_jitter: Distribution,
    execution: Distribution,
    response: Distribution,
    period_error: Distribution,
    /// Of a task that follows its data.
    follow: Option<Box<FollowTiming>>,
}

impl TaskTiming {
    /// Timing of a task with this period, in ns.
    pub fn new(period_ns: u64) -> Self {
        Self {
            period_ns,
            warm_up_cycles: warm_up_cycles(period_ns),
            records: 0,
            first_cycle: 0,
            is_interrupted: false,
            last: None,
            release_jitter: Distribution::new(),
            execution: Distribution::new(),
            response: Distribution::new(),
            period_error: Distribution::new(),
            follow: None,
        }
    }

    /// Of a task that follows its data.
    #[must_use]
    pub fn following(self) -> Self {
        Self { follow: Some(Box::default()), ..self }
    }

    /// Of a task whose first cycle has this number.
    #[must_use]
    pub fn counting_from(self, first_cycle: u64) -> Self {
        Self { first_cycle, ..self }
    }

    /// Of a task that another process runs at times: it ran the cycles of its records, and no others.
    #[must_use]
    pub fn with_interruptions(self) -> Self {
        Self { is_interrupted: true, ..self }
    }

    /// Excludes this number of records at the beginning instead.
    #[must_use]
    pub fn with_warm_up(self, warm_up_cycles: u64) -> Self {
        Self { warm_up_cycles, ..self }
    }

    /// Whether there is no cycle yet.
    pub fn is_empty(&self) -> bool {
        self.records == 0
    }

    /// Adds the next cycle.
    pub fn record(&mut self, record: &CycleRecord) {
        self.take(record, record.start_ns);
    }

    /// Adds the next cycle of a task that follows its data.
    pub fn record_following(&mut self, record: &CycleRecord, follow: &FollowRecord) {
        self.take(record, follow.ready_ns);
        self.end_following(follow);
        if let Some(timing) = self.follow.as_mut().filter(|_| self.records > self.warm_up_cycles) {
            timing.record(record, follow);
        }
    }

    fn take(&mut self, record: &CycleRecord, ready_ns: u64) {
        self.records += 1;
        let last = self.last.replace(*record);
        if self.records <= self.warm_up_cycles {
            return;
        }
        let jitter_ns = ready_ns.saturating_sub(record.release_ns);
        self.release_jitter.record(jitter_ns);
        self.execution.record(record.end_ns.saturating_sub(record.start_ns));
        self.response.record(record.end_ns.saturating_sub(record.release_ns));
        if let Some(last) = last {
            let interval_ns = record.start_ns.saturating_sub(last.start_ns);
            let due_interval_ns = record.release_ns.saturating_sub(last.release_ns);
            self.period_error.record(interval_ns.abs_diff(due_interval_ns));
        }
    }

    /// Takes in the last cycle again, when it is known to be the last: its counts stand even if its
    /// record and those before it were lost.
    pub fn end(&mut self, last: &CycleRecord) {
        if self.last.is_none_or(|seen| seen.cycle <= last.cycle) {
            self.last = Some(*last);
        }
    }

    /// As [`end`](Self::end), for the additional record of the last cycle of a task that follows its data.
    pub fn end_following(&mut self, last: &FollowRecord) {
        if let Some(timing) = &mut self.follow {
            timing.begun = last.begun;
        }
    }

    /// Cycles that ran so far, including the warm-up and cycles whose records were lost.
    pub fn cycles(&self) -> u64 {
        if self.is_interrupted {
            return self.records;
        }
        // Every release up to the last record's either ran or was missed.
        let before = self.first_cycle;
        self.last.map_or(0, |last| {
            last.cycle.saturating_add(1).saturating_sub(before).saturating_sub(last.missed)
        })
    }

    /// Cycles seen during the warm-up, which the distributions exclude.
    pub fn warm_up_cycles(&self) -> u64 {
        self.records.min(self.warm_up_cycles)
    }

    /// Missed releases, including those during the warm-up.
    pub fn missed(&self) -> u64 {
        self.last.map_or(0, |last| last.missed)
    }

    /// Cycles that ended after the next release, including those of the warm-up.
    pub fn overruns(&self) -> u64 {
        self.last.map_or(0, |last| last.overruns)
    }

    /// Cycles that ran but whose records were dropped because the ring was full.
    pub fn lost_records(&self) -> u64 {
        self.cycles().saturating_sub(self.records)
    }

    /// The report of a task of this name, from its records alone.
    pub fn report(&self, name: impl Into<String>) -> TaskReport {
        self.complete(TaskReport { name: name.into(), ..TaskReport::default() })
    }

    /// Adds what the records say to a report that has everything else: name, wake, scheduler, CPU, usage and
    /// counters.
    pub fn complete(&self, report: TaskReport) -> TaskReport {
        let mut histograms = encoded([
            (Metric::RELEASE_JITTER.key, &self.release_jitter),
            ("execution_ns", &self.execution),
            ("response_ns", &self.response),
            ("period_error_ns", &self.period_error),
        ]);
        let follow = self.follow.as_deref();
        if let Some(FollowTiming { wait, latency, .. }) = follow {
            histograms.extend(encoded([("follow_wait_ns", wait), ("follow_latency_ns", latency)]));
        }
        TaskReport {
            period_ns: self.period_ns,
            cycles: self.cycles(),
            warm_up_cycles: self.warm_up_cycles(),
            missed: self.missed(),
            overruns: Some(self.overruns()),
            lost_records: Some(self.lost_records()),
            release_jitter_ns: self.release_jitter.summary(),
            execution_ns: self.execution.summary(),
            response_ns: self.response.summary(),
            period_error_ns: self.period_error.summary(),
            followed: follow.map(|follow| follow.begun.followed),
            found_ready: follow.map(|follow| follow.begun.found_ready),
            timed_out: follow.map(|follow| follow.begun.timed_out),
            follow_wait_ns: follow.map(|follow| follow.wait.summary()),
            follow_latency_ns: follow.map(|follow| follow.latency.summary()),
            histograms,
            ..report
        }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_model::CycleStartCounts;

    use super::*;

    const PERIOD_NS: u64 = 1_000_000;

    /// Cycle `cycle`, `jitter_ns` late, that works for 10 us.
    fn record(cycle: u64, jitter_ns: u64) -> CycleRecord {
        let release_ns = 7_000_000_000 + cycle * PERIOD_NS;
        let start_ns = release_ns + jitter_ns;
        CycleRecord {
            cycle,
            release_ns,
            start_ns,
            end_ns: start_ns + 10_000,
            ..CycleRecord::default()
        }
    }

    fn report(warm_up_cycles: u64, records: impl IntoIterator<Item = CycleRecord>) -> TaskReport {
        let mut timing = TaskTiming::new(PERIOD_NS).with_warm_up(warm_up_cycles);
        records.into_iter().for_each(|record| timing.record(&record));
        timing.report("fast")
    }

    #[test]
    fn a_warm_up_takes_a_hundred_cycles_or_a_second_but_at_least_one_cycle() {
        let warm_ups = [100_000, 1_000_000, 10_000_000, 100_000_000, 1_000_000_000, 60_000_000_000];
        assert_eq!(warm_ups.map(warm_up_cycles), [100, 100, 100, 10, 1, 1]);
    }

    #[test]
    fn a_cycle_that_waits_for_its_data_has_the_jitter_of_its_release() {
        let mut timing = TaskTiming::new(PERIOD_NS).with_warm_up(1).following();
        let waits = [(0, 0, None), (20, 120_000, Some(3_000)), (30, 300_000, None)];
        for ((ready_ns, wait_ns, latency_ns), cycle) in waits.into_iter().zip(0..) {
            let record = record(cycle, wait_ns);
            let follow = FollowRecord {
                ready_ns: record.release_ns + ready_ns,
                begun: CycleStartCounts {
                    followed: cycle.min(1),
                    found_ready: 1,
                    timed_out: cycle / 2,
                },
                sent: cycle,
                frame_ns: latency_ns.map(|_| record.start_ns),
                latency_ns,
            };
            timing.record_following(&record, &follow);
        }
        let begun = CycleStartCounts { followed: 1, found_ready: 1, timed_out: 2 };
        let last = FollowRecord { begun, ..Default::default() };
        timing.end_following(&last);
        let report = timing.report("fast");
        let jitter = report.release_jitter_ns;
        assert_eq!((jitter.count, jitter.min, jitter.max), (2, Some(20), Some(30)));
        let wait = report.follow_wait_ns.unwrap();
        assert_eq!((wait.count, wait.min, wait.max), (2, Some(120_000), Some(300_000)));
        let latency = report.follow_latency_ns.unwrap();
        assert_eq!((latency.count, latency.max), (1, Some(3_000)));
        let counts = (report.followed, report.found_ready, report.timed_out);
        assert_eq!(counts, (Some(1), Some(1), Some(2)));
        assert!(report.histograms.contains_key("follow_wait_ns"));
    }

    #[test]
    fn a_task_that_follows_nothing_reports_nothing_of_it() {
        let report = report(0, [record(0, 90)]);
        let counts = (report.followed, report.found_ready, report.timed_out);
        assert_eq!(counts, (None, None, None));
        assert_eq!((report.follow_wait_ns, report.follow_latency_ns), (None, None));
        assert!(!report.histograms.keys().any(|key| key.starts_with("follow")));
    }

    #[test]
    fn a_record_fits_in_48_bytes() {
        assert!(size_of::<CycleRecord>() <= 48);
    }

    #[test]
    fn jitter_execution_and_response_follow_from_the_three_times() {
        let report = report(0, [record(0, 90)]);
        assert_eq!(report.release_jitter_ns.max, Some(90));
        assert_eq!(report.execution_ns.max, Some(10_000));
        assert_eq!(report.response_ns.max, Some(10_090));
        assert_eq!(report.period_error_ns.count, 0, "one start has no interval");
    }

    #[test]
    fn the_period_error_is_how_far_an_interval_is_from_the_period() {
        let report = report(0, [record(0, 100), record(1, 30), record(2, 500)]);
        assert_eq!(report.period_error_ns.count, 2);
        assert_eq!(report.period_error_ns.min, Some(70));
        assert_eq!(report.period_error_ns.max, Some(470));
    }

    #[test]
    fn across_missed_releases_the_interval_should_span_several_periods() {
        let late = CycleRecord { missed: 49, ..record(50, 250) };
        let report = report(0, [record(0, 100), late]);
        assert_eq!(report.period_error_ns.max, Some(150));
        assert_eq!(report.missed, 49);
        assert_eq!(report.cycles, 2);
        assert_eq!(report.lost_records, Some(0));
    }

    #[test]
    fn the_warm_up_is_in_no_distribution_and_is_reported() {
        let slow_start = (0..100).map(|cycle| record(cycle, 500_000));
        let punctual = (100..300).map(|cycle| record(cycle, 50));
        let report = report(WARM_UP_CYCLES, slow_start.chain(punctual));
        assert_eq!(report.warm_up_cycles, 100);
        assert_eq!(report.cycles, 300);
        assert_eq!(report.release_jitter_ns.count, 200);
        assert_eq!(report.release_jitter_ns.max, Some(50));
        assert_eq!(report.execution_ns.count, 200);
        assert_eq!(report.response_ns.max, Some(10_050));
        assert_eq!(report.period_error_ns.count, 200, "the first interval began in the warm-up");
    }

    #[test]
    fn a_run_shorter_than_its_warm_up_reports_only_warm_up() {
        let report = report(WARM_UP_CYCLES, (0..30).map(|cycle| record(cycle, 50)));
        assert_eq!((report.cycles, report.warm_up_cycles), (30, 30));
        assert_eq!(report.release_jitter_ns.count, 0);
    }

    #[test]
    fn losses_in_the_warm_up_are_counted() {
        let late = CycleRecord { missed: 3, overruns: 1, ..record(4, 0) };
        let report = report(WARM_UP_CYCLES, [record(0, 0), late]);
        assert_eq!((report.missed, report.overruns), (3, Some(1)));
    }

    #[test]
    fn records_lost_at_the_end_are_counted_once_the_last_cycle_is_known() {
        let mut timing = TaskTiming::new(PERIOD_NS).with_warm_up(0);
        timing.record(&record(0, 10));
        timing.end(&CycleRecord { missed: 2, overruns: 1, ..record(6, 40) });
        assert_eq!((timing.cycles(), timing.missed(), timing.overruns()), (5, 2, 1));
        assert_eq!(timing.lost_records(), 4);
        assert_eq!(timing.report("fast").release_jitter_ns.max, Some(10));
    }

    #[test]
    fn records_lost_on_the_way_are_neither_hidden_nor_called_missed() {
        let report = report(0, [record(0, 10), record(1, 10), record(7, 40)]);
        assert_eq!(report.cycles, 8);
        assert_eq!(report.missed, 0);
        assert_eq!(report.lost_records, Some(5));
        assert_eq!(report.period_error_ns.max, Some(30));
    }
}
