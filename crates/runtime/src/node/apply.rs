//! A new configuration for a running node: prepared and checked in an ordinary thread, and put into effect by the
//! tasks.

use std::sync::Arc;
use std::time::Instant;

use isochrone_control::desk::{Draft, PreparedChange, RequestTerms};
use isochrone_control::{Code, Refusal};
use isochrone_cyclic::touch_new_memory;
use isochrone_engine::orders::Replacement;
use isochrone_engine::{AlarmPlan, BankPlan, Plan, Source, TaskEngine, TaskPlan};
use isochrone_model::{ChangeSummary, ChangedValue, Tuned};

use crate::error::ApplyError;
use crate::keeping::recorded::task_layouts;
use crate::keeping::recorder::{Capture, Recorder};
use crate::node::alarms::Alarm;
use crate::node::operating::{Operating, Shared};
use crate::redundancy::room::check_change;
use crate::redundancy::twin::Twin;
use crate::supervisor::{NewParts, cuts};
use crate::task::alarms::NewAlarms;
use crate::task::clocks::unix_ns;
use crate::task::events::Watch;
use crate::task::messages::{Messages, Moved};
use crate::task::orders::Changeover;
use crate::task::retained::{self, Copier, Copies};
use crate::task::snapshots::{Snapshots, Tap};
use crate::task::traces::NewSlots;

/// Shortest time from the request to the change, in ns, so that the change has reached the tasks by then.
const LEAD_NS: u64 = 20_000_000;
/// How often the copy is rehearsed; the longest run counts.
const REHEARSALS: usize = 3;

/// Whether a change may cost cycles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum IfMissed {
    /// A change that does not fit between two cycles is refused.
    #[default]
    Refuse,
    /// Cycles may be missed.
    Allow,
}

/// A change of the configuration that is on its way to the tasks.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Applying {
    /// Its number: [`Batch::applied`](crate::Batch::applied) has an entry of
    /// [`Action::Apply`](isochrone_model::Action::Apply) for each task that has changed.
    pub number: u64,
    /// The first cycle of each task that is to have it; if that is missed, it is the next that runs.
    pub cycles: Vec<u64>,
}

/// A configuration that was checked against the running node and has not been sent yet.
pub struct PreparedApply {
    prepared: PreparedChange,
    source: Source,
    tasks: Vec<NewTask>,
    snapshots: Snapshots,
    cuts: Vec<Alarm>,
    costs_ns: Vec<u64>,
}

/// What a task gets besides its engine.
struct NewTask {
    tap: Tap,
    watch: Watch,
    alarms: NewAlarms,
    alarm_plans: Vec<AlarmPlan>,
    messages: Arc<Messages>,
    moved: Arc<Moved>,
    banks: Vec<String>,
    /// Where the node is recorded.
    recorder: Option<(Box<Recorder>, Capture)>,
    /// Where the node retains its state.
    retained: Option<(Box<Copier>, Copies)>,
}

impl PreparedApply {
    /// Prepares everything that a new configuration needs. `file` is where its text came from, if that is known. The
    /// lock is held only while the operator is asked.
    pub(crate) fn new(
        shared: &Shared,
        text: &str,
        file: Option<String>,
        request: RequestTerms,
    ) -> Result<Self, ApplyError> {
        let configuration = shared.lock().configuration.clone();
        let source = Source::new(configuration.source.name, text);
        let plan = configuration.rules.plan(source)?;
        let draft = Draft::new(&plan)?.from_file(file);
        let operating = shared.lock();
        let basis = operating.operator.basis();
        let messages: Vec<Arc<Messages>> =
            operating.lanes.iter().map(|lane| lane.faults.messages()).collect();
        let tasks = 0..operating.lanes.len();
        let alarms: Vec<_> = tasks.map(|task| operating.process_alarms.plans(task)).collect();
        let is_recorded = operating.recording.is_some();
        let is_retained = operating.state.is_some();
        let twin = operating.twin.clone();
        drop(operating);
        let mut prepared = basis.change(draft, request)?;
        if let Some(twin) = twin {
            let engines = prepared.replacements_mut().map(|it| -> &TaskEngine { it.engine() });
            check_change(&twin, &plan, &engines.collect::<Vec<_>>())?;
        }
        let costs_ns = rehearse(&mut prepared);
        let (snapshots, taps) = Snapshots::of(&plan);
        let layouts = task_layouts(&plan).into_iter();
        let recorders = layouts.map(|layout| is_recorded.then(|| Recorder::new(layout)));
        let retained = retained(&mut prepared, &plan, is_retained);
        let parts = taps.into_iter().zip(&messages).zip(recorders).zip(retained).zip(&alarms);
        let tasks = plan.tasks.iter().zip(parts).map(
            |(task, ((((tap, old), recorder), retained), alarms))| {
                let messages = Arc::new(Messages::of(task));
                let moved = Arc::new(Moved::of(old, &messages));
                let banks = task.banks.iter().map(BankPlan::any_block).collect();
                let watch = Watch::following(task, old, &moved);
                let (alarms, alarm_plans) =
                    (NewAlarms::following(task, alarms), task.alarms.clone());
                NewTask {
                    tap,
                    watch,
                    alarms,
                    alarm_plans,
                    messages,
                    moved,
                    banks,
                    recorder,
                    retained,
                }
            },
        );
        let tasks = tasks.collect();
        touch_new_memory();
        let (cuts, Plan { source, .. }) = (cuts(&plan).collect(), plan);
        Ok(Self { prepared, source, tasks, snapshots, cuts, costs_ns })
    }

    /// What it changes.
    pub fn summary(&self) -> &ChangeSummary {
        self.prepared.summary()
    }

    /// The values of the pins that it changes, before and after; empty if there are more than ten thousand.
    pub fn values(&self) -> &[ChangedValue] {
        self.prepared.values()
    }

    /// Values that were set at run time and stay, although the new configuration gives others.
    pub fn tuned(&self) -> &[Tuned] {
        self.prepared.tuned()
    }

    /// How long the task with the most to copy takes for it, in ns, as measured in an ordinary thread.
    pub fn cost_ns(&self) -> u64 {
        self.costs_ns.iter().copied().max().unwrap_or_default()
    }
}

impl std::fmt::Debug for PreparedApply {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut debug = f.debug_struct("PreparedApply");
        debug.field("summary", self.summary()).field("costs_ns", &self.costs_ns);
        debug.finish_non_exhaustive()
    }
}

/// Both ends of the copies of each task's state, where the configuration retains it.
fn retained(
    prepared: &mut PreparedChange,
    plan: &Plan,
    is_retained: bool,
) -> Vec<Option<(Box<Copier>, Copies)>> {
    let ends = |(replacement, task): (&mut Replacement, &TaskPlan)| {
        if !is_retained {
            return None;
        }
        let ends = retained::ends(replacement.engine(), task, unix_ns());
        Some((Box::new(ends.0), ends.1))
    };
    prepared.replacements_mut().zip(&plan.tasks).map(ends).collect()
}

/// Rehearses what each task will copy; returns how long that took, in ns.
fn rehearse(prepared: &mut PreparedChange) -> Vec<u64> {
    let mut longest_ns = Vec::new();
    for replacement in prepared.replacements_mut() {
        let mut copy = || {
            let start = Instant::now();
            replacement.rehearse();
            u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX)
        };
        longest_ns.push((0..REHEARSALS).map(|_| copy()).max().unwrap_or_default());
    }
    longest_ns
}

/// The refusal of a change that would have both processes of a node go on with different configurations.
fn beside_twin(twin: &Twin, other: u32) -> Refusal {
    let (message, help) = if twin.holds() {
        (
            format!("process {other} stands by, and could not follow to another configuration"),
            "end it, apply the configuration, and start it with the new file",
        )
    } else {
        (
            format!("process {other} holds the node, and this one stands by"),
            "end this one, apply the configuration to the other, and start this one with the new file",
        )
    };
    Refusal::one(Code::CannotChange, "", message, help)
}

impl Operating {
    /// Whether the tasks have time for a change between two cycles. Half of that time is left for the usual work in
    /// the slack, and because caches are colder there.
    pub(crate) fn check_slack(&self, prepared: &PreparedApply) -> Result<(), ApplyError> {
        for (lane, cost_ns) in self.lanes.iter().zip(&prepared.costs_ns) {
            let task = || lane.name.clone();
            let Some(longest_ns) = lane.responses.longest_ns() else {
                return Err(ApplyError::NotMeasured { task: task() });
            };
            let slack_ns = lane.schedule.period_ns.saturating_sub(longest_ns);
            if *cost_ns > slack_ns / 2 {
                return Err(ApplyError::NoSlack { task: task(), slack_ns, cost_ns: *cost_ns });
            }
        }
        Ok(())
    }

    /// The alarms of which a change loses occurrences that nobody has acknowledged.
    pub(crate) fn lost_alarms(&self, prepared: &PreparedApply) -> Vec<String> {
        self.process_alarms.lost_with(prepared.tasks.iter().map(|task| &task.alarm_plans[..]))
    }

    /// Sends a change to all tasks, to take effect at one instant.
    pub(crate) fn send_change(
        &mut self,
        prepared: PreparedApply,
        now_ns: u64,
    ) -> Result<Applying, ApplyError> {
        if self.have_ended() {
            return Err(ApplyError::Ended);
        }
        if let Some(full) = self.lanes.iter().find(|lane| !lane.orders.has_room()) {
            return Err(ApplyError::Busy { task: full.name.clone() });
        }
        let PreparedApply { prepared, source, tasks, snapshots, cuts, .. } = prepared;
        // Each task makes the change in the slack of the cycle before.
        let longest_ns = self.lanes.iter().map(|lane| lane.schedule.period_ns).max();
        let instant_ns = now_ns.saturating_add(longest_ns.unwrap_or_default() + LEAD_NS);
        let cycles = self.first_cycles(instant_ns);
        let lanes = self.lanes.iter().enumerate();
        let traces = lanes.map(|(task, lane)| NewSlots::of(&lane.traces, task, prepared.signals()));
        let traces: Vec<NewSlots> = traces.collect();
        // A change that is under way keeps the other process away already; this one is refused then.
        let twin = self.twin.as_ref().filter(|_| self.operator.changing().is_none());
        if let Some(twin) = twin {
            twin.begin_change().map_err(|other| beside_twin(twin, other))?;
        }
        let sent = self.operator.send_change(prepared, &cycles);
        let (number, replacements) = sent.inspect_err(|_| {
            twin.iter().for_each(|twin| twin.end_change(None));
        })?;
        let (mut banks, mut copies) = (Vec::new(), Vec::new());
        let parts = replacements.into_iter().zip(tasks).zip(traces);
        for (task, (lane, ((replacement, new), traces))) in
            self.lanes.iter_mut().zip(parts).enumerate()
        {
            let NewTask {
                tap,
                watch,
                alarms,
                alarm_plans,
                messages,
                moved,
                banks: of_task,
                recorder,
                retained,
            } = new;
            banks.push(of_task);
            self.process_alarms.expect(task, alarm_plans);
            lane.faults.expect(Arc::clone(&messages), moved);
            // If the other end is gone, the node ends and nothing logs any more.
            let _ = lane.messages.send(messages);
            let (recorder, capture) = recorder.unzip();
            if let (Some(recording), Some(capture)) = (&self.recording, capture) {
                recording.add(task, capture);
            }
            let (copier, of_task) = retained.unzip();
            copies.extend(of_task);
            let changeover =
                Changeover { replacement, tap, watch, alarms, traces, recorder, copier };
            lane.orders.send_change(Box::new(changeover));
        }
        self.expect(NewParts { source, banks, cuts, copies }, snapshots);
        Ok(Applying { number, cycles })
    }
}
