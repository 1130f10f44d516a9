//! An arm: a task of one workload and size, and its turns.

use std::collections::BTreeMap;
use std::hint::black_box;

use isochrone_blocks::BlockType;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::{Plan, Rules, TaskEngine, Workload};
use isochrone_processes::Stop;
use isochrone_report::{CostReport, Turns};
use isochrone_timing::units::counted;
use isochrone_timing::{Distribution, Metric, Summary};
use rustix::thread::gettid;

use crate::BenchError;
use crate::watch::Watch;

/// Shortest batch that is timed.
const BATCH_NS: u64 = 50_000;
/// A batch lasts this many readings of the clock, so that they are less than 0.1 % of it.
const BATCH_READINGS: u64 = 1_200;

/// A task that is stepped as fast as it can be.
pub(super) struct Arm {
    workload: Workload,
    instances: usize,
    engine: TaskEngine,
    cycle: u64,
    warm_up_cycles: u64,
    /// Cycles that are timed together; 0 until the first turn.
    batch: u64,
    turns: Turns,
}

/// How the present thread takes turns, and room for the samples of one.
pub(super) struct Turn {
    origin_ns: u64,
    turn_ns: u64,
    batch_ns: u64,
    cpu: Option<usize>,
    /// The thread that takes them.
    thread: Option<u32>,
    stop: Stop,
    /// In ps per instance and cycle.
    samples: Vec<u64>,
}

impl Turn {
    /// Turns of `turn_ns` in a bench that began at `origin_ns`, on a CPU (any if there is none).
    pub(super) fn new(
        origin_ns: u64,
        turn_ns: u64,
        clock_read_ns: Option<u64>,
        cpu: Option<usize>,
        stop: Stop,
    ) -> Self {
        let batch_ns =
            clock_read_ns.map_or(BATCH_NS, |ns| BATCH_NS.max(BATCH_READINGS.saturating_mul(ns)));
        // Batches are found to last twice as long at most. Written to, the memory is there: a page
        // fault would make a turn invalid.
        let room = 2 * turn_ns / batch_ns + 1;
        let mut samples = vec![u64::MAX; usize::try_from(room).unwrap_or(usize::MAX)];
        samples.clear();
        // The first look takes page faults of its own, which no turn should be blamed for.
        let thread = u32::try_from(gettid().as_raw_nonzero().get()).ok();
        drop(Watch::begin(cpu, thread));
        Self { origin_ns, turn_ns, batch_ns, cpu, thread, stop, samples }
    }
}

impl Arm {
    /// A task of so many instances.
    pub(super) fn build(
        workload: &Workload,
        instances: usize,
        catalogue: &[BlockType],
    ) -> Result<Self, BenchError> {
        let rules = Rules { catalogue, ..Rules::default() };
        let plan =
            Plan::new(workload.source(instances), &rules).map_err(BenchError::Configuration)?;
        let engine = TaskEngine::build(&plan)?.pop();
        Ok(Self {
            workload: *workload,
            instances,
            engine: engine.ok_or_else(|| BenchError::no_task(workload.name()))?,
            cycle: 0,
            warm_up_cycles: 0,
            batch: 0,
            turns: Turns::default(),
        })
    }

    pub(super) fn name(&self) -> &'static str {
        self.workload.name()
    }

    /// Steps the task for a turn, and takes it in.
    pub(super) fn take(&mut self, turn: &mut Turn) {
        self.warm_up(turn);
        turn.samples.clear();
        let mut watch = Watch::begin(turn.cpu, turn.thread);
        let per_sample = u128::from(self.batch) * self.instances as u128;
        let from_ns = Monotonic.now_ns();
        let mut end_ns = from_ns;
        loop {
            let begin_ns = Monotonic.now_ns();
            self.step(self.batch);
            end_ns = Monotonic.now_ns().max(end_ns);
            let ps = u128::from(end_ns - begin_ns) * 1_000 / per_sample.max(1);
            turn.samples.push(u64::try_from(ps).unwrap_or(u64::MAX));
            let is_full = turn.samples.len() == turn.samples.capacity();
            if end_ns - from_ns >= turn.turn_ns || is_full || turn.stop.is_due() {
                break;
            }
        }
        watch.look();
        let disturbance = watch.since(from_ns);
        let mut distribution = Distribution::new();
        turn.samples.iter().for_each(|ps| distribution.record(*ps));
        let at_s = from_ns.saturating_sub(turn.origin_ns) as f64 / 1e9;
        self.turns.push(at_s, end_ns - from_ns, &distribution, 0, disturbance);
    }

    /// The arm before this one left its data in the caches.
    fn warm_up(&mut self, turn: &Turn) {
        let first = self.cycle;
        if self.batch == 0 {
            self.find_batch(turn);
        }
        let begin_ns = Monotonic.now_ns();
        loop {
            self.step(self.batch);
            let is_warm = Monotonic.now_ns() - begin_ns >= turn.turn_ns / 10;
            if is_warm || turn.stop.is_due() {
                break;
            }
        }
        self.warm_up_cycles += self.cycle - first;
    }

    /// Doubles the batch until it is long enough. What interrupts one try is not in the best of three.
    fn find_batch(&mut self, turn: &Turn) {
        self.batch = 1;
        loop {
            let tries = [(); 3].map(|()| {
                let begin_ns = Monotonic.now_ns();
                self.step(self.batch);
                Monotonic.now_ns() - begin_ns
            });
            if tries.iter().all(|ns| *ns >= turn.batch_ns) {
                break;
            }
            self.batch *= 2;
        }
    }

    fn step(&mut self, cycles: u64) {
        for _ in 0..cycles {
            self.engine.step(black_box(self.cycle));
            self.cycle += 1;
        }
    }

    /// What an instance costs so far, in a line.
    pub(super) fn so_far(&self) -> String {
        so_far(self.instances, &self.turns.all().summary())
    }

    /// What an instance costs; `None` if it had no turn yet.
    pub(super) fn report(&self) -> Option<CostReport> {
        let all = self.turns.all();
        (all.count() > 0).then(|| CostReport {
            name: self.name().to_owned(),
            instances: self.instances as u64,
            cycles: self.cycle,
            warm_up_cycles: self.warm_up_cycles,
            step_ps: all.summary(),
            histograms: BTreeMap::from([(Metric::STEP.key.to_owned(), all.encode())]),
            turns: self.turns.reports().to_vec(),
        })
    }
}

/// The percentiles that there are, as those of times in ps.
fn so_far(instances: usize, step_ps: &Summary) -> String {
    let percentile = |(name, ps): (&str, Option<u64>)| {
        ps.map(|ps| format!("{name} {}  ", Metric::STEP.shown(ps)))
    };
    let percentiles = [("p50", step_ps.p50), ("p99", step_ps.p99)];
    let percentiles: String = percentiles.into_iter().filter_map(percentile).collect();
    format!(
        "{}: {percentiles}({})",
        counted(instances, "instance"),
        counted(step_ps.count, "sample")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_is_shown_only_once_the_samples_support_it() {
        let after = |samples: u64| {
            let mut all = Distribution::new();
            all.record_many(2_000, samples);
            so_far(10, &all.summary())
        };
        assert_eq!(after(1), "10 instances: (1 sample)");
        assert_eq!(after(99), "10 instances: p50 2.00 ns  (99 samples)");
        assert_eq!(after(100), "10 instances: p50 2.00 ns  p99 2.00 ns  (100 samples)");
    }
}
