//! An arm that is a loop: its release jitter, turn by turn.

use std::ops::Range;

use isochrone_machine::Disturbance;
use isochrone_timing::{
    CycleRecord, Distribution, FollowRecord, Metric, TaskReport, TaskTiming, encoded,
};

use super::turns::Turns;
use crate::report::{Outlier, TaskArm};

/// Outliers that a report keeps: the largest.
const OUTLIERS: usize = 200;
/// An outlier is at least this many times as late as the median of its turn ...
const OUTLIER_TIMES: u64 = 10;
/// ... and at least this late, in ns.
const OUTLIER_NS: u64 = 1_000;

/// Collects the turns of a loop.
#[derive(Debug, Clone)]
pub struct LoopArm {
    period_ns: u64,
    /// When the bench began.
    origin_ns: u64,
    turns: Turns,
    timing: TaskTiming,
    /// Release jitter of the cycles that ran. The turns hold the corrected one.
    raw: Distribution,
    cycles: u64,
    warm_up_cycles: u64,
    outliers: Vec<Outlier>,
}

impl LoopArm {
    /// A loop with this period, in a bench that started at `origin_ns`.
    pub fn new(period_ns: u64, origin_ns: u64) -> Self {
        Self {
            period_ns,
            origin_ns,
            turns: Turns::default(),
            timing: TaskTiming::new(period_ns).with_warm_up(0),
            raw: Distribution::new(),
            cycles: 0,
            warm_up_cycles: 0,
            outliers: Vec::new(),
        }
    }

    /// Adds a turn: its cycles in order, the range of due times that count, in ns (earlier ones are
    /// warm-up), what disturbed it, and a function that returns the disturbance around an instant.
    ///
    /// A missed release counts if it was due in `counted`, even if the cycle that ran in its place
    /// was not. `records` must therefore contain the first cycle after the end, too.
    ///
    /// Of a loop that follows its data, `follows` has what each of the records leaves out; of others it is
    /// empty. The release jitter is that of the grid: up to where a cycle begins to wait for its data.
    pub fn turn(
        &mut self,
        records: &[CycleRecord],
        follows: &[FollowRecord],
        counted: Range<u64>,
        disturbance: Disturbance,
        around: impl Fn(u64) -> Disturbance,
    ) {
        let mut raw = Distribution::new();
        let mut corrected = Distribution::new();
        // The latest release of each cycle, and when the cycle came.
        let mut lates = Vec::new();
        let mut missed_before = records.first().map_or(0, |first| first.missed);
        if !follows.is_empty() && self.timing.is_empty() {
            self.timing = self.timing.clone().following();
        }
        for (index, record) in records.iter().enumerate() {
            let follow = follows.get(index);
            let ready_ns = follow.map_or(record.start_ns, |follow| follow.ready_ns);
            let late_ns = ready_ns.saturating_sub(record.release_ns);
            let newly_missed = record.missed.saturating_sub(missed_before);
            missed_before = record.missed;
            // The release before this one was a period later than this one, and so on.
            for periods in 0..=newly_missed {
                let earlier_ns = periods * self.period_ns;
                if counted.contains(&record.release_ns.saturating_sub(earlier_ns)) {
                    corrected.record(late_ns.saturating_add(earlier_ns));
                    lates.push((late_ns.saturating_add(earlier_ns), ready_ns));
                }
            }
            if counted.contains(&record.release_ns) {
                raw.record(late_ns);
                match follow {
                    Some(follow) => self.timing.record_following(record, follow),
                    None => self.timing.record(record),
                }
            }
            self.cycles += u64::from(record.release_ns < counted.end);
            self.warm_up_cycles += u64::from(record.release_ns < counted.start);
        }
        if corrected.count() == 0 {
            return;
        }
        let least_ns = OUTLIER_NS.max(raw.quantile(0.5).saturating_mul(OUTLIER_TIMES));
        for (late_ns, at_ns) in lates.into_iter().filter(|(late_ns, _)| *late_ns >= least_ns) {
            self.note(late_ns, at_ns, &around);
        }
        self.raw.merge(&raw);
        let (elapsed_ns, missed) =
            (corrected.count() * self.period_ns, corrected.count() - raw.count());
        self.turns.push(self.at_s(counted.start), elapsed_ns, &corrected, missed, disturbance);
    }

    /// Keeps a release if it is among the latest.
    fn note(&mut self, late_ns: u64, at_ns: u64, around: &impl Fn(u64) -> Disturbance) {
        let least_ns = self.outliers.last().map_or(0, |least| least.late_ns);
        if self.outliers.len() < OUTLIERS || late_ns > least_ns {
            let place = self.outliers.partition_point(|kept| kept.late_ns >= late_ns);
            let (at_s, cause) = (self.at_s(at_ns), around(at_ns).cause());
            self.outliers.insert(place, Outlier { at_s, late_ns, cause });
            self.outliers.truncate(OUTLIERS);
        }
    }

    fn at_s(&self, ns: u64) -> f64 {
        ns.saturating_sub(self.origin_ns) as f64 / 1e9
    }

    /// Release jitter of the cycles that ran so far.
    pub fn raw(&self) -> &Distribution {
        &self.raw
    }

    /// The turns so far, with corrected release jitter.
    pub fn turns(&self) -> &Turns {
        &self.turns
    }

    /// The report of the arm. The caller fills in how it waited and what it cost.
    pub fn report(&self, name: impl Into<String>) -> TaskArm {
        let corrected = self.turns.all();
        let task = TaskReport {
            cycles: self.cycles,
            warm_up_cycles: self.warm_up_cycles,
            missed: self.turns.missed(),
            // Not counted from turn to turn.
            overruns: None,
            lost_records: None,
            release_jitter_ns: self.raw.summary(),
            histograms: encoded([
                (Metric::RELEASE_JITTER.key, &self.raw),
                (Metric::RELEASE_JITTER_CORRECTED.key, corrected),
            ]),
            ..self.timing.report(name)
        };
        TaskArm {
            task,
            release_jitter_corrected_ns: Some(corrected.summary()),
            release_jitter_valid_ns: Some(self.turns.valid().summary()),
            turns: self.turns.reports().to_vec(),
            outliers: self.outliers.clone(),
            ..TaskArm::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_machine::Cause;
    use isochrone_timing::CycleStartCounts;

    use super::*;

    const PERIOD_NS: u64 = 1_000_000;
    const ORIGIN_NS: u64 = 4_000_000_000;

    fn record(cycle: u64, late_ns: u64, missed: u64) -> CycleRecord {
        let release_ns = ORIGIN_NS + 1_000_000_000 + cycle * PERIOD_NS;
        let start_ns = release_ns + late_ns;
        CycleRecord { cycle, release_ns, start_ns, end_ns: start_ns, missed, overruns: 0 }
    }

    fn arm(records: &[CycleRecord], counted: Range<u64>) -> TaskArm {
        let mut arm = LoopArm::new(PERIOD_NS, ORIGIN_NS);
        let interrupt = Disturbance { interrupts: Some(1), ..Disturbance::default() };
        let due_ns = |cycle| record(cycle, 0, 0).release_ns;
        let counted = due_ns(counted.start)..due_ns(counted.end);
        arm.turn(records, &[], counted, Disturbance::default(), |_| interrupt);
        arm.report("hybrid")
    }

    #[test]
    fn a_loop_that_follows_its_data_is_as_late_as_it_stood_ready() {
        let waited = |cycle| {
            let record = record(cycle, 300_000, 0);
            CycleRecord { end_ns: record.start_ns + 7, ..record }
        };
        let records: Vec<_> = (0..20).map(waited).collect();
        let ready = |record: &CycleRecord| FollowRecord {
            ready_ns: record.release_ns + 11,
            begun: CycleStartCounts { timed_out: record.cycle + 1, ..CycleStartCounts::default() },
            ..FollowRecord::default()
        };
        let follows: Vec<_> = records.iter().map(ready).collect();
        let mut arm = LoopArm::new(PERIOD_NS, ORIGIN_NS);
        let none = Disturbance::default();
        arm.turn(&records, &follows, 0..u64::MAX, none, |_| none);
        let TaskArm { task, release_jitter_corrected_ns, outliers, .. } = arm.report("follows");
        assert_eq!(task.release_jitter_ns.max, Some(11));
        assert_eq!(release_jitter_corrected_ns.unwrap().max, Some(11));
        assert_eq!((task.execution_ns.max, task.response_ns.max), (Some(7), Some(300_007)));
        assert_eq!(task.follow_wait_ns.unwrap().p50, Some(300_000));
        assert_eq!((task.followed, task.timed_out), (Some(0), Some(20)));
        assert_eq!(outliers, []);
    }

    #[test]
    fn a_stall_of_k_periods_is_k_missed_releases_each_as_late_as_it_would_have_been() {
        let stall = 7;
        let records =
            [record(0, 100, 0), record(1 + stall, 250, stall), record(2 + stall, 100, stall)];
        let report = arm(&records, 0..100);
        assert_eq!((report.task.missed, report.task.release_jitter_ns.count), (stall, 3));
        assert_eq!(report.task.release_jitter_ns.max, Some(250));
        let corrected = report.release_jitter_corrected_ns.unwrap();
        assert_eq!(corrected.count, 3 + stall);
        assert_eq!(corrected.max, Some(250 + stall * PERIOD_NS));
        let sum_ns: u64 = 200 + (0..=stall).map(|periods| 250 + periods * PERIOD_NS).sum::<u64>();
        let mean_ns = sum_ns as f64 / (3 + stall) as f64;
        assert!((corrected.mean.unwrap() - mean_ns).abs() < 0.1, "{corrected:?}");
        assert_eq!(report.outliers[0].late_ns, 250 + stall * PERIOD_NS);
    }

    #[test]
    fn what_is_missed_counts_where_it_was_due() {
        // Missed: 1 to 8, of which 5 to 8 are due after the warm-up; 11; and 13 to 29 of which the
        // turn has those up to 19.
        let records = [record(0, 0, 0), record(9, 0, 8), record(10, 70, 8), record(12, 0, 9)];
        let after_the_end = record(30, 500, 26);
        let report = arm(&[&records[..], &[after_the_end]].concat(), 5..20);
        assert_eq!(report.task.missed, 4 + 1 + 7);
        assert_eq!((report.task.cycles, report.task.warm_up_cycles), (4, 1));
        assert_eq!(report.task.release_jitter_ns.count, 3);
        let corrected = report.release_jitter_corrected_ns.unwrap();
        assert_eq!(corrected.count, 15, "each release that was due, once");
        assert_eq!(corrected.max, Some(500 + 17 * PERIOD_NS));
    }

    #[test]
    fn what_an_arm_does_not_count_is_null_and_not_0() {
        let json = serde_json::to_value(arm(&[record(0, 100, 0)], 0..1)).unwrap();
        assert_eq!(json["cycles"], 1);
        assert!(json["overruns"].is_null() && json["lost_records"].is_null(), "{json}");
    }

    #[test]
    fn a_later_turn_counts_only_its_own_misses() {
        let mut arm = LoopArm::new(PERIOD_NS, ORIGIN_NS);
        for first in [record(0, 10, 0), record(5_000, 10, 3)] {
            let next = CycleRecord { missed: first.missed + 2, ..record(first.cycle + 3, 10, 0) };
            let none = Disturbance::default();
            arm.turn(&[first, next], &[], 0..u64::MAX, none, |_| none);
        }
        assert_eq!(arm.report("a").task.missed, 4);
    }

    #[test]
    fn the_largest_outliers_are_kept_with_their_time_and_cause() {
        let late_ns = |cycle: u64| if cycle.is_multiple_of(10) { 20_000 + cycle } else { 900 };
        let records: Vec<_> = (0..5_000).map(|cycle| record(cycle, late_ns(cycle), 0)).collect();
        let outliers = arm(&records, 0..5_000).outliers;
        assert_eq!(outliers.len(), OUTLIERS);
        assert!(outliers.windows(2).all(|pair| pair[0].late_ns >= pair[1].late_ns));
        assert_eq!((outliers[0].late_ns, outliers[0].cause), (24_990, Cause::Interrupt));
        assert!((outliers[0].at_s - 5.990).abs() < 1e-3, "{}", outliers[0].at_s);
    }

    #[test]
    fn what_is_late_as_most_are_is_no_outlier() {
        let records: Vec<_> = (0..100).map(|cycle| record(cycle, 15_000 + cycle, 0)).collect();
        assert_eq!(arm(&records, 0..100).outliers, []);
        let records: Vec<_> = (0..100).map(|cycle| record(cycle, cycle, 0)).collect();
        assert_eq!(arm(&records, 0..100).outliers, []);
    }

    #[test]
    fn a_turn_that_ended_before_it_counted_leaves_no_turn() {
        let report = arm(&[record(0, 10, 0), record(1, 10, 0)], 5..20);
        assert_eq!((report.turns.len(), report.task.warm_up_cycles), (0, 2));
    }
}
