//! The outcome of a node as a report.

use isochrone_machine::Environment;
use isochrone_report::{RecordingReport, Report};
use isochrone_timing::Warning;

use crate::error::NodePanicked;
use crate::keeping::recorder::RecordingOutcome;
use crate::node::outcome::Outcome;
use crate::node::warning::warning;

impl Outcome {
    /// The report that `isochrone run --report` writes: the activity and cost of each task and port, the warnings,
    /// the machine, and the command line of this process.
    ///
    /// Add other warnings, such as what [`prepare_process`](isochrone_cyclic::prepare_process) was refused, before
    /// its own.
    pub fn report(&self) -> Report {
        report(self, Vec::new())
    }

    /// The alarms that a report has as warnings. Block errors and missed releases are not among them, as the numbers
    /// of the tasks show them.
    pub fn warnings(&self) -> impl Iterator<Item = Warning> {
        self.alarms.iter().filter(|alarm| !alarm.is_counted()).map(Warning::from)
    }
}

impl NodePanicked {
    /// As [`Outcome::report`], with a warning for each panic.
    pub fn report(&self) -> Report {
        let panics = match self {
            Self::Tasks { panics, .. } => panics.iter().map(Warning::from).collect(),
            Self::Supervisor { panic, .. } => vec![Warning::from(panic)],
        };
        report(self.outcome(), panics)
    }
}

fn report(outcome: &Outcome, panics: Vec<Warning>) -> Report {
    let arguments = std::env::args_os().skip(1);
    // Names of files may not be valid Unicode.
    let arguments = arguments.map(|it| it.to_string_lossy().into_owned()).collect();
    let mut report = Report::new(arguments, Environment::read()).started_at(outcome.started);
    report.warnings = outcome.refusals.iter().map(warning).collect();
    report.warnings.extend(panics);
    report.warnings.extend(outcome.warnings());
    report.tasks.extend(outcome.tasks.iter().cloned().map(Into::into));
    report.links.extend(outcome.links.iter().cloned().map(Into::into));
    report.process_alarms = outcome.process_alarms.clone();
    report.recording = outcome.recording.as_ref().map(recording_report);
    report
}

fn recording_report(recording: &RecordingOutcome) -> RecordingReport {
    let RecordingOutcome { file, cycles, lost, entries, bytes, incomplete } = recording.clone();
    RecordingReport { file, cycles, lost, entries, bytes, is_complete: incomplete.is_none() }
}
