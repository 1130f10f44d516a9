//! Turns of the whole node, as `run` runs it.

use std::ops::Range;
use std::time::Duration;

use isochrone_cyclic::{ThreadGrant, ThreadUsage};
use isochrone_engine::Plan;
use isochrone_ipc::Participant;
use isochrone_processes::Stop;
use isochrone_report::Report;
use isochrone_timing::CycleRecord;

use super::WARM_UP;
use super::arm::{Arm, Turn, Used, cycles};
use crate::bench::watch::Watching;
use crate::failure::Failure;
use crate::run::{Observer, Options, run_tasks};

/// More than a node needs until its first cycle.
const SET_UP: Duration = Duration::from_secs(10);

/// Starts the node, runs it for the turn, and ends it.
pub(super) fn turn(arm: &mut Arm, plan: &Plan, turn: &Turn<'_>) -> Result<Used, Failure> {
    let participant =
        Participant::join_for_real_time(&format!("isochrone/{}", plan.node), turn.domain)
            .map_err(Failure::found)?;
    // It ends with its first cycle after the turn; longer than this it never takes.
    let stop = turn.stop.within(WARM_UP + turn.counted + SET_UP);
    let records = Vec::with_capacity(cycles(arm.period_ns, turn.counted));
    let mut seen = Seen { records, counted: 0..0, stop: stop.clone(), turn };
    let options = Options { cycles: None, strict: false, announce: false };
    let mut report = Report::default();
    // It has no thread yet to watch; what its thread meets is in its report.
    let watching = Watching::begin(arm.cpu, None);
    let overrun = run_tasks(&options, plan, &participant, &stop, &mut report, &mut seen)?;
    let watch = watching.end();
    if let Some(why) = overrun {
        return Err(Failure::found(format!("arm \"{}\": {why}", arm.name)));
    }
    let Some(task) = report.tasks.into_iter().next() else {
        return Err(Failure::found(format!("arm \"{}\" ran no task", arm.name)));
    };
    let mut disturbance = watch.since(seen.counted.start);
    disturbance.faults = task.task.faults().unwrap_or_default();
    disturbance.preemptions = task.task.involuntary_switches.unwrap_or_default();
    arm.timing.block(&seen.records, seen.counted, disturbance, |at_ns| watch.around(at_ns));
    arm.margin_ns = task.task.margin_ns;
    arm.grant = Some(ThreadGrant {
        scheduler: task.task.scheduler,
        cpu: task.task.cpu,
        refusals: Vec::new(),
    });
    let elapsed_ns = turn.counted.as_nanos() as u64;
    Ok(Used {
        usage: ThreadUsage {
            cpu_ns: (task.task.cpu_fraction.unwrap_or_default() * elapsed_ns as f64) as u64,
            minor_faults: task.task.minor_faults.unwrap_or_default(),
            major_faults: task.task.major_faults.unwrap_or_default(),
            voluntary_switches: task.task.voluntary_switches.unwrap_or_default(),
            involuntary_switches: task.task.involuntary_switches.unwrap_or_default(),
        },
        elapsed_ns,
    })
}

/// The cycles of the first task.
struct Seen<'a> {
    records: Vec<CycleRecord>,
    /// Which of them count: from when to when they are due.
    counted: Range<u64>,
    stop: Stop,
    turn: &'a Turn<'a>,
}

impl Observer for Seen<'_> {
    fn record(&mut self, task: usize, record: &CycleRecord) {
        if task != 0 {
            return;
        }
        if self.records.is_empty() {
            let from_ns = record.release_ns + WARM_UP.as_nanos() as u64;
            self.counted = from_ns..from_ns + self.turn.counted.as_nanos() as u64;
        }
        self.records.push(*record);
        if record.release_ns >= self.counted.end {
            self.stop.request();
        }
    }

    fn look(&mut self) {
        (self.turn.pass)();
    }
}
