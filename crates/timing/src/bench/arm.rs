//! An arm that is a loop: its release jitter, block by block.

use serde::{Deserialize, Serialize};

use super::blocks::{Blocks, Disturbance};
use crate::distribution::{Distribution, encoded};
use crate::report::TaskReport;
use crate::task::{CycleRecord, TaskTiming};

/// Outliers that a report keeps: the largest.
const OUTLIERS: usize = 200;

/// A release that was later than most.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Outlier {
    /// When, in seconds since the bench began.
    pub at_s: f64,
    /// How late, in ns; with releases missed before it, how late the first of them was.
    pub late_ns: u64,
    /// What the kernel counted around it, as [`Disturbance::cause`] names it.
    pub cause: String,
}

/// Collects the blocks of a loop.
#[derive(Debug, Clone)]
pub struct LoopArm {
    period_ns: u64,
    /// When the bench began.
    origin_ns: u64,
    blocks: Blocks,
    timing: TaskTiming,
    /// Release jitter with the releases that were missed, each as late as it would have been.
    corrected: Distribution,
    cycles: u64,
    warm_up_cycles: u64,
    outliers: Vec<Outlier>,
}

impl LoopArm {
    /// A loop of this period, in a bench that began at `origin_ns`.
    pub fn new(period_ns: u64, origin_ns: u64) -> Self {
        Self {
            period_ns,
            origin_ns,
            blocks: Blocks::default(),
            timing: TaskTiming::new(period_ns).with_warm_up(0),
            corrected: Distribution::new(),
            cycles: 0,
            warm_up_cycles: 0,
            outliers: Vec::new(),
        }
    }

    /// Takes in a block: its cycles in order, of which those due before `from_ns` are warm-up, what
    /// disturbed it, and what there was around an instant (in ns).
    pub fn block(
        &mut self,
        records: &[CycleRecord],
        from_ns: u64,
        disturbance: Disturbance,
        around: impl Fn(u64) -> Disturbance,
    ) {
        let warm_up = records.partition_point(|record| record.release_ns < from_ns);
        let (before, counted) = records.split_at(warm_up);
        let last_before = before.last().or(counted.first());
        let mut missed_before = last_before.map_or(0, |record| record.missed);
        let mut jitter = Distribution::new();
        let mut missed = 0;
        for record in counted {
            let late_ns = record.start_ns.saturating_sub(record.release_ns);
            let newly_missed = record.missed.saturating_sub(missed_before);
            missed_before = record.missed;
            missed += newly_missed;
            jitter.record(late_ns);
            self.timing.record(record);
            // The release before this one was a period later than this one, and so on.
            for periods in 0..=newly_missed {
                self.corrected.record(late_ns.saturating_add(periods * self.period_ns));
            }
            let late_ns = late_ns.saturating_add(newly_missed * self.period_ns);
            self.note(late_ns, record.start_ns, &around);
        }
        self.cycles += records.len() as u64;
        self.warm_up_cycles += warm_up as u64;
        let elapsed_ns = (counted.len() as u64 + missed) * self.period_ns;
        self.blocks.push(self.at_s(from_ns), elapsed_ns, &jitter, missed, disturbance);
    }

    /// Takes in a block of another program, of which only the distribution is known.
    pub fn foreign_block(&mut self, from_ns: u64, jitter: &Distribution, disturbance: Disturbance) {
        self.cycles += jitter.count();
        let elapsed_ns = jitter.count() * self.period_ns;
        self.blocks.push(self.at_s(from_ns), elapsed_ns, jitter, 0, disturbance);
    }

    /// Keeps a release if it is among the latest.
    fn note(&mut self, late_ns: u64, at_ns: u64, around: &impl Fn(u64) -> Disturbance) {
        let least_ns = self.outliers.last().map_or(0, |least| least.late_ns);
        if self.outliers.len() < OUTLIERS || late_ns > least_ns {
            let place = self.outliers.partition_point(|kept| kept.late_ns >= late_ns);
            let (at_s, cause) = (self.at_s(at_ns), around(at_ns).cause().to_owned());
            self.outliers.insert(place, Outlier { at_s, late_ns, cause });
            self.outliers.truncate(OUTLIERS);
        }
    }

    fn at_s(&self, ns: u64) -> f64 {
        ns.saturating_sub(self.origin_ns) as f64 / 1e9
    }

    /// The blocks so far.
    pub fn blocks(&self) -> &Blocks {
        &self.blocks
    }

    /// The report of the arm. How it waited and what it cost is for the caller to fill in.
    pub fn report(&self, name: impl Into<String>) -> TaskReport {
        let raw = self.blocks.all();
        // Of another program nobody knows which releases it missed.
        let corrected = (self.corrected.count() > 0).then_some(&self.corrected);
        let mut histograms = encoded([("release_jitter_ns", raw)]);
        histograms
            .extend(corrected.map(|all| ("release_jitter_corrected_ns".to_owned(), all.encode())));
        TaskReport {
            period_ns: self.period_ns,
            cycles: self.cycles,
            warm_up_cycles: self.warm_up_cycles,
            missed: self.blocks.missed(),
            overruns: 0,
            lost_records: 0,
            release_jitter_ns: raw.summary(),
            release_jitter_corrected_ns: corrected.map(Distribution::summary),
            release_jitter_valid_ns: Some(self.blocks.valid().summary()),
            histograms,
            blocks: self.blocks.reports().to_vec(),
            outliers: self.outliers.clone(),
            ..self.timing.report(name)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 1_000_000;
    const ORIGIN_NS: u64 = 4_000_000_000;

    fn record(cycle: u64, late_ns: u64, missed: u64) -> CycleRecord {
        let release_ns = ORIGIN_NS + 1_000_000_000 + cycle * PERIOD_NS;
        let start_ns = release_ns + late_ns;
        CycleRecord { cycle, release_ns, start_ns, end_ns: start_ns, missed, overruns: 0 }
    }

    fn arm(records: &[CycleRecord], warm_up: usize) -> TaskReport {
        let mut arm = LoopArm::new(PERIOD_NS, ORIGIN_NS);
        let none = Disturbance::default();
        let interrupt = Disturbance { interrupts: 1, ..none };
        arm.block(records, records[warm_up].release_ns, none, |_| interrupt);
        arm.report("hybrid")
    }

    #[test]
    fn a_stall_of_k_periods_is_k_missed_releases_each_as_late_as_it_would_have_been() {
        let stall = 7;
        let records =
            [record(0, 100, 0), record(1 + stall, 250, stall), record(2 + stall, 100, stall)];
        let report = arm(&records, 0);
        assert_eq!((report.missed, report.release_jitter_ns.count), (stall, 3));
        assert_eq!(report.release_jitter_ns.max, Some(250));
        let corrected = report.release_jitter_corrected_ns.unwrap();
        assert_eq!(corrected.count, 3 + stall);
        assert_eq!(corrected.max, Some(250 + stall * PERIOD_NS));
        let sum_ns: u64 = 200 + (0..=stall).map(|periods| 250 + periods * PERIOD_NS).sum::<u64>();
        let mean_ns = sum_ns as f64 / (3 + stall) as f64;
        assert!((corrected.mean.unwrap() - mean_ns).abs() < 0.1, "{corrected:?}");
        assert_eq!(report.outliers[0].late_ns, 250 + stall * PERIOD_NS);
    }

    #[test]
    fn what_is_missed_in_the_warm_up_does_not_count() {
        let records = [record(0, 0, 0), record(9, 0, 8), record(10, 70, 8), record(12, 0, 9)];
        let report = arm(&records, 2);
        assert_eq!((report.missed, report.cycles, report.warm_up_cycles), (1, 4, 2));
        assert_eq!(report.release_jitter_corrected_ns.unwrap().count, 3);
    }

    #[test]
    fn a_later_block_counts_only_its_own_misses() {
        let mut arm = LoopArm::new(PERIOD_NS, ORIGIN_NS);
        for first in [record(0, 10, 0), record(5_000, 10, 3)] {
            let next = CycleRecord { missed: first.missed + 2, ..first };
            arm.block(&[first, next], 0, Disturbance::default(), |_| Disturbance::default());
        }
        assert_eq!(arm.report("a").missed, 4);
    }

    #[test]
    fn the_largest_outliers_are_kept_with_their_time_and_cause() {
        let records: Vec<_> = (0..5_000).map(|cycle| record(cycle, cycle % 1_000, 0)).collect();
        let outliers = arm(&records, 0).outliers;
        assert_eq!(outliers.len(), OUTLIERS);
        assert!(outliers.windows(2).all(|pair| pair[0].late_ns >= pair[1].late_ns));
        assert_eq!((outliers[0].late_ns, outliers[0].cause.as_str()), (999, "interrupt"));
        assert!((outliers[0].at_s - 1.999).abs() < 1e-3, "{}", outliers[0].at_s);
    }

    #[test]
    fn of_another_program_only_the_distribution_is_known() {
        let mut jitter = Distribution::new();
        jitter.record_many(15_000, 2_000);
        let mut arm = LoopArm::new(PERIOD_NS, ORIGIN_NS);
        arm.foreign_block(ORIGIN_NS, &jitter, Disturbance::default());
        let report = arm.report("cyclictest");
        assert_eq!((report.cycles, report.release_jitter_ns.count), (2_000, 2_000));
        assert_eq!(report.release_jitter_corrected_ns, None);
        assert_eq!(report.blocks.len(), 1);
    }
}
