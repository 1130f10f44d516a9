//! The result of a replay, as text and as JSON.

use std::path::Path;

use serde::Serialize;

use super::Args;
use super::comparison::{Comparison, Signal};
use super::missing::{Missing, MissingRow};
use super::recorded::Recorded;
use crate::terminal;

/// The result of a replay.
pub(super) struct Outcome {
    pub(super) tasks: Vec<TaskOutcome>,
    pub(super) comparison: Comparison,
    pub(super) missing: Missing,
    /// Whether missing parts are allowed.
    pub(super) may_miss: bool,
    /// Remarks on it.
    pub(super) notes: Vec<String>,
    pub(super) is_damaged: bool,
    /// Whether the file has everything that was recorded, and all of it was read.
    pub(super) is_whole: bool,
    /// Whether what it lacks is accepted.
    pub(super) may_be_incomplete: bool,
}

/// The result for a task.
#[derive(Serialize)]
pub(super) struct TaskOutcome {
    #[serde(rename = "task")]
    pub(super) name: String,
    /// Cycles that were repeated.
    pub(super) cycles: u64,
    /// Cycles that were missed in the run, and here.
    pub(super) missed: u64,
    /// Recorded cycles that were not repeated.
    #[serde(rename = "uncompared_cycles")]
    pub(super) left: u64,
    /// The first cycle that cannot be compared, with all behind it, and why.
    pub(super) uncompared_from: Option<u64>,
    pub(super) uncompared_why: Option<String>,
}

impl Outcome {
    /// Cycles that were repeated.
    pub(super) fn cycles(&self) -> u64 {
        self.tasks.iter().map(|task| task.cycles).sum()
    }

    /// Prints the remarks to stderr.
    pub(super) fn note(&self) {
        for note in &self.notes {
            terminal::note(&format!("note: {note}"));
        }
        if self.comparison.first().is_some() || self.may_be_incomplete {
            for why in self.broken() {
                terminal::note(&format!("note: {why}"));
            }
        }
    }

    /// Why not everything was compared, as sentences in one.
    pub(super) fn uncompared(&self) -> Option<String> {
        let mut why: Vec<String> = self.broken().filter(|_| !self.may_be_incomplete).collect();
        why.extend(self.missing.summary().filter(|_| !self.may_miss));
        if !self.is_whole && !self.may_be_incomplete {
            why.push("the file has only a part of the run".into());
        }
        if why.is_empty() && self.comparison.compared == 0 {
            why.push("no value was compared".into());
        }
        (!why.is_empty()).then(|| why.join("; "))
    }

    /// Whether the recording has less than the run.
    pub(super) fn is_part(&self) -> bool {
        !self.is_whole || self.broken().next().is_some()
    }

    fn broken(&self) -> impl Iterator<Item = String> {
        self.tasks.iter().filter_map(|task| {
            let (cycle, why) = task.uncompared_from.zip(task.uncompared_why.as_ref())?;
            let name = &task.name;
            Some(format!("task \"{name}\" cannot be compared from cycle {cycle} on: {why}"))
        })
    }

    /// The same for programs.
    pub(super) fn document<'a>(&'a self, args: &'a Args, recorded: &'a Recorded) -> Document<'a> {
        let Self { comparison, .. } = self;
        Document {
            recording: &args.file,
            node: &recorded.node.name,
            version: &recorded.node.version,
            configuration: args.config.as_deref(),
            tolerance: args.tolerance,
            is_same: comparison.different == 0 && self.uncompared().is_none(),
            is_damaged: self.is_damaged,
            is_complete: !self.is_part(),
            unread_bytes: recorded.condition.unread_bytes,
            unread_cycles: recorded.gaps.cycles(),
            missing: self.missing.rows(),
            allow_missing: self.may_miss,
            compared_values: comparison.compared,
            different_values: comparison.different,
            tasks: &self.tasks,
            signals: comparison.differing().collect(),
            notes: &self.notes,
        }
    }
}

/// What `--report` writes.
#[derive(Serialize)]
pub(super) struct Document<'a> {
    recording: &'a Path,
    node: &'a str,
    version: &'a str,
    configuration: Option<&'a Path>,
    tolerance: Option<f64>,
    is_same: bool,
    is_damaged: bool,
    is_complete: bool,
    unread_bytes: u64,
    unread_cycles: u64,
    missing: Vec<MissingRow<'a>>,
    allow_missing: bool,
    compared_values: u64,
    different_values: u64,
    tasks: &'a [TaskOutcome],
    signals: Vec<&'a Signal>,
    notes: &'a [String],
}
