//! The outcome of a node as a report.

use isochrone_engine::{Plan, TaskPlan};
use isochrone_machine::Environment;
use isochrone_report::{RecordingReport, Report};
use isochrone_timing::{InputReport, LinkReport, TaskReport, Warning};

use crate::error::{NodePanicked, TaskPanicked};
use crate::outcome::{InputOutcome, Link, Outcome, TaskOutcome};
use crate::recorder::RecordingOutcome;
use crate::warning::warning;

impl Outcome {
    /// The report that `isochrone run --report` writes: what each task and port did and cost, the warnings, and
    /// the machine and the command line of this process. `plan` is the one that the node was made from.
    ///
    /// What else is to be read with it, such as what
    /// [`prepare_process`](isochrone_cyclic::prepare_process) was refused, goes before its warnings.
    pub fn report(&self, plan: &Plan) -> Report {
        report(plan, self, &[])
    }

    /// The alarms that a report has as warnings. Block errors and missed releases are not among them, as its
    /// tasks have their numbers.
    pub fn warnings(&self) -> impl Iterator<Item = Warning> {
        self.alarms.iter().filter(|alarm| !alarm.is_counted()).map(Warning::from)
    }
}

impl NodePanicked {
    /// As [`Outcome::report`], with a warning for each panic.
    pub fn report(&self, plan: &Plan) -> Report {
        report(plan, &self.outcome, &self.panics)
    }
}

fn report(plan: &Plan, outcome: &Outcome, panics: &[TaskPanicked]) -> Report {
    let arguments = std::env::args_os().skip(1);
    // Names of files may be no Unicode.
    let arguments = arguments.map(|it| it.to_string_lossy().into_owned()).collect();
    let mut report = Report::new(arguments, Environment::read()).started_at(outcome.started);
    report.warnings = outcome.refusals.iter().map(warning).collect();
    report.warnings.extend(panics.iter().map(Warning::from));
    report.warnings.extend(outcome.warnings());
    for task in &outcome.tasks {
        let planned = plan.tasks.iter().find(|planned| planned.name == task.name);
        report.tasks.extend(planned.map(|planned| task_report(planned, task).into()));
    }
    report
        .links
        .extend(outcome.tasks.iter().flat_map(|task| &task.links).map(link_report).map(Into::into));
    report.recording = outcome.recording.as_ref().map(recording_report);
    report
}

fn task_report(plan: &TaskPlan, task: &TaskOutcome) -> TaskReport {
    let usage = task.costs.map(|costs| costs.usage);
    let allocations = task.costs.and_then(|costs| costs.allocations);
    TaskReport {
        phase_ns: Some(plan.schedule.phase_ns),
        phase_reason: plan.phase_choice.reason().map(str::to_owned),
        wake: plan.schedule.wake.as_str().into(),
        scheduler: task.grant.scheduler.clone(),
        cpu: task.grant.cpu,
        cpu_reason: task.cpu_reason.clone(),
        margin_ns: task.margin_ns,
        cpu_fraction: task.costs.map(|costs| costs.cpu_fraction()),
        allocations: allocations.map(|allocations| allocations.cycle),
        ipc_allocations: allocations.map(|allocations| allocations.library),
        minor_faults: usage.map(|usage| usage.minor_faults),
        major_faults: usage.map(|usage| usage.major_faults),
        voluntary_switches: usage.map(|usage| usage.voluntary_switches),
        involuntary_switches: usage.map(|usage| usage.involuntary_switches),
        block_errors: Some(task.block_errors),
        input_rejects: Some(task.input_rejects),
        inputs: task.inputs.iter().map(input_report).collect(),
        connects: Some(task.connects),
        connect_errors: Some(task.connect_errors),
        lost_snapshots: Some(task.lost_snapshots),
        ..task.timing.report(&task.name)
    }
}

fn recording_report(recording: &RecordingOutcome) -> RecordingReport {
    let RecordingOutcome { file, cycles, lost, entries, bytes, incomplete } = recording.clone();
    RecordingReport { file, cycles, lost, entries, bytes, is_complete: incomplete.is_none() }
}

fn input_report(input: &InputOutcome) -> InputReport {
    let InputOutcome { name, is_ok, falls, not_ok_ns, .. } = input;
    InputReport { name: name.clone(), ok: *is_ok, falls: *falls, not_ok_ns: *not_ok_ns }
}

fn link_report(link: &Link) -> LinkReport {
    LinkReport {
        service: link.service.clone(),
        direction: Some(link.direction),
        frames: link.frames,
        lost: link.lost,
        restarts: link.restarts,
        other_writers: link.other_writers,
        future_stamps: link.future_stamps,
        past_stamps: link.past_stamps,
        unknown_layouts: link.unknown_layouts,
        ..LinkReport::default()
    }
}
