//! The outcome of a node as a report.

use isochrone_engine::{Plan, TaskPlan};
use isochrone_report::{RecordingReport, Report};
use isochrone_runtime::{InputOutcome, Link, Outcome, RecordingOutcome, TaskOutcome};
use isochrone_timing::{InputReport, LinkReport, TaskReport, Warning, WarningCode};

/// Adds what the node did.
pub(super) fn complete(report: &mut Report, plan: &Plan, outcome: &Outcome) {
    add_alarms(&mut report.warnings, outcome.alarms.iter().map(Into::into));
    for task in &outcome.tasks {
        let planned = plan.tasks.iter().find(|planned| planned.name == task.name);
        report.tasks.extend(planned.map(|planned| task_report(planned, task).into()));
    }
    report
        .links
        .extend(outcome.tasks.iter().flat_map(|task| &task.links).map(link_report).map(Into::into));
    report.recording = outcome.recording.as_ref().map(recording_report);
}

/// Adds alarms to what was said at the start.
fn add_alarms(warnings: &mut Vec<Warning>, alarms: impl Iterator<Item = Warning>) {
    // No phase and no `within` helps behind a source that is kept from running.
    let is_starved = warnings.iter().any(|it| it.code == WarningCode::StarvedSource);
    warnings.extend(alarms.filter(|it| !(is_starved && it.code == WarningCode::LateFrames)));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_a_source_that_is_kept_from_running_are_not_said_to_need_another_phase() {
        use WarningCode::{InputNotOk, LateFrames, StarvedSource};
        for (known, expected) in [
            (StarvedSource, vec![StarvedSource, InputNotOk]),
            (InputNotOk, vec![InputNotOk, LateFrames, InputNotOk]),
        ] {
            let mut warnings = vec![Warning::new(known, "at the start")];
            let alarms = [LateFrames, InputNotOk].map(|code| Warning::new(code, "at the end"));
            add_alarms(&mut warnings, alarms.into_iter());
            assert_eq!(warnings.into_iter().map(|it| it.code).collect::<Vec<_>>(), expected);
        }
    }
}
