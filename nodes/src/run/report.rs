//! The outcome of a node as a report.

use isochrone_report::{RecordingReport, Report};
use isochrone_runtime::{Outcome, RecordingOutcome};
use isochrone_timing::{Warning, WarningCode};

/// Adds what the node did.
pub(super) fn complete(report: &mut Report, outcome: &Outcome) {
    add_alarms(&mut report.warnings, outcome.alarms.iter().map(Into::into));
    report.tasks.extend(outcome.tasks.iter().cloned().map(Into::into));
    report.links.extend(outcome.links.iter().cloned().map(Into::into));
    report.recording = outcome.recording.as_ref().map(recording_report);
}

/// Adds alarms to what was said at the start.
fn add_alarms(warnings: &mut Vec<Warning>, alarms: impl Iterator<Item = Warning>) {
    // No phase and no `within` helps behind a source that is kept from running.
    let is_starved = warnings.iter().any(|it| it.code == WarningCode::StarvedSource);
    warnings.extend(alarms.filter(|it| !(is_starved && it.code == WarningCode::LateFrames)));
}

fn recording_report(recording: &RecordingOutcome) -> RecordingReport {
    let RecordingOutcome { file, cycles, lost, entries, bytes, incomplete } = recording.clone();
    RecordingReport { file, cycles, lost, entries, bytes, is_complete: incomplete.is_none() }
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
