//! Turns of the whole node, as `run` runs it.

use std::ops::Range;
use std::time::Duration;

use isochrone_cyclic::ThreadUsage;
use isochrone_engine::Plan;
use isochrone_ipc::Participant;
use isochrone_runtime::{End, Node, TaskCpus};
use isochrone_timing::{CycleRecord, FollowRecord, TaskReport};

use super::turn::{Terms, Turn, TurnResult, Used, WARM_UP, cycles};
use crate::BenchError;
use crate::watch::Watching;

/// More than a node needs until its first cycle.
const SET_UP: Duration = Duration::from_secs(10);

/// How often the turn looks whether it is over.
const LOOK: Duration = Duration::from_millis(15);

/// Starts the node, runs it for the turn, and ends it.
pub(super) fn turn(
    arm: &str,
    terms: &Terms,
    (plan, cpus): (&Plan, &TaskCpus),
    turn: &Turn<'_>,
) -> Result<TurnResult, BenchError> {
    let failed =
        |error: &dyn std::fmt::Display| BenchError::Failed(format!("arm \"{arm}\": {error}"));
    let name = format!("isochrone/{}", plan.node);
    let participant = Participant::join(&name, turn.domain);
    let participant = participant.map_err(|error| failed(&error))?;
    // It ends with its first cycle after the turn; longer than this it never takes.
    let stop = turn.stop.within(WARM_UP + turn.counted + SET_UP);
    let records = Vec::with_capacity(cycles(terms.period_ns, turn.counted));
    let for_ns = turn.counted.as_nanos() as u64;
    let mut log = CycleLog { records, follows: Vec::new(), counted: 0..0, for_ns };
    // It has no thread yet to watch; what its thread meets is in its outcome.
    let watching = Watching::begin(terms.cpu, None);
    let prepared =
        Node::prepare_at(plan, cpus, None, participant).map_err(|error| failed(&error))?;
    let grant = prepared.grants().next().map(|(_, grant)| grant.clone());
    let events = prepared.events();
    let node = prepared.start();
    while let Some(batch) = events.within(LOOK) {
        (turn.pass)();
        let first = batch.cycles.iter().filter(|cycle| cycle.task == 0);
        first.for_each(|cycle| log.note(&cycle.record, cycle.follow));
        if stop.is_due() || log.is_complete() {
            node.stop();
        }
    }
    let outcome = node.finish().map_err(|error| failed(&error))?;
    let watch = watching.end();
    if let End::Overrun { task, .. } = &outcome.end {
        return Err(failed(&format!("task \"{task}\" overran and stopped the node, as it is to")));
    }
    let warnings = outcome.warnings().collect();
    let Some(task) = outcome.tasks.into_iter().next() else {
        return Err(BenchError::no_task(arm));
    };
    let is_begun = !log.records.is_empty();
    let used = used(&task);
    Ok(TurnResult {
        records: log.records,
        follows: log.follows,
        counted: is_begun.then_some(log.counted),
        watch,
        thread_usage: used.and_then(|used| used.usage),
        grant,
        margin_ns: task.margin_ns,
        used,
        warnings,
    })
}

/// What the task's thread used after its warm-up; `None` if it ended before.
fn used(task: &TaskReport) -> Option<Used> {
    let releases = (task.cycles + task.missed).saturating_sub(task.warm_up_cycles);
    let elapsed_ns = releases * task.period_ns;
    let cpu_ns = (task.cpu_fraction? * elapsed_ns as f64) as u64;
    let usage = ThreadUsage {
        cpu_ns,
        minor_faults: task.minor_faults?,
        major_faults: task.major_faults?,
        voluntary_switches: task.voluntary_switches?,
        involuntary_switches: task.involuntary_switches?,
    };
    Some(Used { cpu_ns, elapsed_ns, usage: Some(usage) })
}

/// The cycles of the first task.
struct CycleLog {
    records: Vec<CycleRecord>,
    /// One for each, if it follows a service.
    follows: Vec<FollowRecord>,
    /// Which of them count: from when to when they are due.
    counted: Range<u64>,
    /// For how long they count.
    for_ns: u64,
}

impl CycleLog {
    fn note(&mut self, record: &CycleRecord, follow: Option<FollowRecord>) {
        if self.records.is_empty() {
            let from_ns = record.release_ns + WARM_UP.as_nanos() as u64;
            self.counted = from_ns..from_ns + self.for_ns;
        }
        self.records.push(*record);
        self.follows.extend(follow);
    }

    fn is_complete(&self) -> bool {
        self.records.last().is_some_and(|record| record.release_ns >= self.counted.end)
    }
}
