//! The timing of a task's cycles as channels of a frame, as telemetry and traces show it.

use isochrone_model::Schedule;
use isochrone_timing::FollowRecord;

use crate::records::Cycle;

/// The timing of every task.
const TIMING: [&str; 6] =
    ["cycle", "release_jitter_ns", "execution_ns", "response_ns", "missed", "overruns"];

/// Further channels of a task that follows its data.
const FOLLOWING: [&str; 5] =
    ["follow_wait_ns", "followed", "found_ready", "timed_out", "follow_latency_ns"];

/// Names of the channels of a task's timing: `task.NAME.cycle` and so on.
pub(crate) fn names(task: &str, schedule: &Schedule) -> impl ExactSizeIterator<Item = String> {
    let following = schedule.follow_within_ns.map_or(0, |_| FOLLOWING.len());
    let name =
        move |at: usize| TIMING.iter().chain(&FOLLOWING).nth(at).copied().unwrap_or_default();
    (0..TIMING.len() + following).map(move |at| format!("task.{task}.{}", name(at)))
}

/// Their values after a cycle; only the first ones for a task that follows nothing.
pub(crate) fn values(cycle: &Cycle) -> impl Iterator<Item = f64> {
    timing_of(cycle).into_iter().chain(following_of(cycle))
}

fn timing_of(cycle: &Cycle) -> [f64; TIMING.len()] {
    let Cycle { record, follow } = cycle;
    let ready_ns = follow.map_or(record.start_ns, |follow| follow.ready_ns);
    let timing = [
        record.cycle,
        ready_ns.saturating_sub(record.release_ns),
        record.end_ns.saturating_sub(record.start_ns),
        record.end_ns.saturating_sub(record.release_ns),
        record.missed,
        record.overruns,
    ];
    timing.map(|value| value as f64)
}

fn following_of(cycle: &Cycle) -> [f64; FOLLOWING.len()] {
    let Cycle { record, follow } = cycle;
    let follow = follow.unwrap_or_default();
    let FollowRecord { begun, latency_ns, .. } = follow;
    let [followed, found_ready, timed_out] = [begun.followed, begun.found_ready, begun.timed_out];
    let wait_ns = record.start_ns.saturating_sub(record.release_ns);
    let latency_ns = latency_ns.map_or(f64::NAN, |latency_ns| latency_ns as f64);
    [wait_ns as f64, followed as f64, found_ready as f64, timed_out as f64, latency_ns]
}
