//! What came of a replay: in words, and as JSON.

use serde_json::{Value, json};

use super::Args;
use super::comparison::{Comparison, Signal};
use super::missing::Missing;
use super::recorded::Recorded;
use super::task::Broken;
use crate::{numbers, terminal};

/// What came of a replay.
pub(super) struct Outcome {
    pub(super) tasks: Vec<TaskOutcome>,
    pub(super) comparison: Comparison,
    pub(super) missing: Missing,
    /// Whether what is missing is meant to be.
    pub(super) may_miss: bool,
    /// What is to be known of it.
    pub(super) notes: Vec<String>,
    pub(super) is_damaged: bool,
    /// Whether the file has everything that was recorded, and all of it was read.
    pub(super) is_whole: bool,
    /// Whether what it lacks is accepted.
    pub(super) may_be_incomplete: bool,
}

/// What came of a task.
pub(super) struct TaskOutcome {
    pub(super) name: String,
    /// Cycles that were repeated.
    pub(super) cycles: u64,
    /// Cycles that were missed in the run, and here.
    pub(super) missed: u64,
    /// Recorded cycles that were not repeated.
    pub(super) left: u64,
    pub(super) broken: Option<Broken>,
}

impl Outcome {
    /// Cycles that were repeated.
    pub(super) fn cycles(&self) -> u64 {
        self.tasks.iter().map(|task| task.cycles).sum()
    }

    /// Says on stderr what is to be known.
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
            let Broken { cycle, why } = task.broken.as_ref()?;
            let name = &task.name;
            Some(format!("task \"{name}\" cannot be compared from cycle {cycle} on: {why}"))
        })
    }

    /// The same as JSON.
    pub(super) fn json(&self, args: &Args, recorded: &Recorded) -> Value {
        let Self { comparison, notes, is_damaged, .. } = self;
        let tasks: Vec<Value> = self.tasks.iter().map(TaskOutcome::json).collect();
        let signals: Vec<Value> = comparison.differing().map(Signal::json).collect();
        json!({
            "recording": args.file,
            "node": recorded.node.name,
            "version": recorded.node.version,
            "configuration": args.config,
            "tolerance": args.tolerance,
            "is_same": comparison.different == 0 && self.uncompared().is_none(),
            "is_damaged": is_damaged,
            "is_complete": !self.is_part(),
            "unread_bytes": recorded.condition.unread_bytes,
            "unread_cycles": recorded.gaps.cycles(),
            "missing": self.missing.json(),
            "allow_missing": self.may_miss,
            "compared_values": comparison.compared,
            "different_values": comparison.different,
            "tasks": tasks,
            "signals": signals,
            "notes": notes,
        })
    }
}

impl TaskOutcome {
    fn json(&self) -> Value {
        json!({
            "task": self.name,
            "cycles": self.cycles,
            "missed": self.missed,
            "uncompared_cycles": self.left,
            "uncompared_from": self.broken.as_ref().map(|broken| broken.cycle),
            "uncompared_why": self.broken.as_ref().map(|broken| &broken.why),
        })
    }
}

impl Signal {
    fn json(&self) -> Value {
        let first = self.first.map(|first| {
            json!({
                "cycle": first.cycle,
                "release_ns": first.release_ns,
                "recorded": number(first.recorded),
                "replayed": number(first.replayed),
            })
        });
        json!({
            "task": self.task,
            "service": self.service,
            "signal": self.name,
            "compared": self.compared,
            "different": self.different,
            "first": first,
            "largest_difference": self.largest.map(number),
        })
    }
}

/// A value; those that JSON has no numbers for are texts.
fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { json!(numbers::format(value)) }
}
