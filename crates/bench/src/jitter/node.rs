//! Turns of the whole node, as `run` runs it.

use std::ops::Range;
use std::thread;
use std::time::Duration;

use isochrone_engine::Plan;
use isochrone_ipc::Participant;
use isochrone_runtime::{End, Node, POLL_INTERVAL, Places};
use isochrone_timing::{CycleRecord, FollowRecord};

use super::turn::{Taken, Terms, Turn, Used, WARM_UP, cycles};
use crate::BenchError;
use crate::watch::Watching;

/// More than a node needs until its first cycle.
const SET_UP: Duration = Duration::from_secs(10);

/// Starts the node, runs it for the turn, and ends it.
pub(super) fn turn(
    arm: &str,
    terms: &Terms,
    (plan, places): (&Plan, &Places),
    turn: &Turn<'_>,
) -> Result<Taken, BenchError> {
    let failed = |error: &dyn std::fmt::Display| BenchError::Arm {
        arm: arm.to_owned(),
        cause: error.to_string(),
    };
    let name = format!("isochrone/{}", plan.node);
    let participant = Participant::join(&name, turn.domain);
    let participant = participant.map_err(|error| failed(&error))?;
    // It ends with its first cycle after the turn; longer than this it never takes.
    let stop = turn.stop.within(WARM_UP + turn.counted + SET_UP);
    let records = Vec::with_capacity(cycles(terms.period_ns, turn.counted));
    let for_ns = turn.counted.as_nanos() as u64;
    let mut seen = Seen { records, follows: Vec::new(), counted: 0..0, for_ns };
    // It has no thread yet to watch; what its thread meets is in its outcome.
    let watching = Watching::begin(terms.cpu, None);
    let prepared = Node::prepare_at(plan, places, participant).map_err(|error| failed(&error))?;
    let mut node = prepared.start();
    loop {
        thread::sleep(POLL_INTERVAL);
        (turn.pass)();
        if stop.is_due() || seen.is_complete() {
            node.stop();
        }
        let news = node.poll();
        let cycles = news.records().iter().zip(news.follow_records());
        let first = cycles.filter(|((task, _), _)| *task == 0);
        first.for_each(|((_, record), follow)| seen.note(record, *follow));
        if !news.is_running() {
            break;
        }
    }
    let outcome = node.finish().map_err(|error| failed(&error))?;
    let watch = watching.end();
    if let End::Overrun { task, .. } = &outcome.end {
        return Err(failed(&format!("task \"{task}\" overran and stopped the node, as it is to")));
    }
    let warnings = outcome.warnings().collect();
    let Some(task) = outcome.tasks.into_iter().next() else {
        return Err(BenchError::NoTask { arm: arm.to_owned() });
    };
    let is_begun = !seen.records.is_empty();
    Ok(Taken {
        records: seen.records,
        follows: seen.follows,
        counted: is_begun.then_some(seen.counted),
        watch,
        told: task.costs.map(|costs| costs.usage),
        grant: Some(task.grant),
        margin_ns: task.margin_ns,
        used: task.costs.map(|costs| Used {
            cpu_ns: costs.usage.cpu_ns,
            elapsed_ns: costs.elapsed_ns,
            usage: Some(costs.usage),
        }),
        warnings,
    })
}

/// The cycles of the first task.
struct Seen {
    records: Vec<CycleRecord>,
    /// One for each, if it follows a service.
    follows: Vec<FollowRecord>,
    /// Which of them count: from when to when they are due.
    counted: Range<u64>,
    /// For how long they count.
    for_ns: u64,
}

impl Seen {
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
