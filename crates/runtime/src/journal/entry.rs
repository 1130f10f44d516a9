//! Entries as the engine has them, and as files and answers do.

use std::sync::Arc;

use isochrone_engine::Plan;
use isochrone_engine::operate::{self, Client, Entry};

use super::line::Line;
use super::lines::without_place;
use crate::control::{Action, AppliedChange, AskedBy, Change, JournalEntry};

/// What one line of a journal says was done to a task of a plan.
///
/// # Errors
/// It is no line that a node of this version can have written of an entry of this plan; why, as part of a
/// sentence.
pub fn entry_of_line(line: &str, plan: &Plan) -> Result<Entry, String> {
    match serde_json::from_str(line) {
        Ok(Line::Entry(content)) => {
            let task = plan.task_index(&content.task);
            content.to_entry(task.ok_or_else(|| format!("there is no task \"{}\"", content.task))?)
        }
        Ok(_) => Err("a line that is no entry".into()),
        Err(error) => Err(without_place(&error.to_string())),
    }
}

impl JournalEntry {
    /// What was done to a task of this name.
    pub(crate) fn of(entry: &Entry, task: &str) -> Self {
        let (action, until_cycle, undone) = match entry.action {
            operate::Action::Set => (Action::Set, None, None),
            operate::Action::Force { until } => (Action::Force, until, None),
            operate::Action::Release => (Action::Release, None, None),
            operate::Action::Expiry => (Action::Expiry, None, None),
            operate::Action::Undo { of } => (Action::Undo, None, Some(of)),
            operate::Action::Apply => (Action::Apply, None, None),
        };
        let change = |change: &operate::Change| Change {
            name: change.name.clone(),
            before: change.before.into(),
            after: change.after.map(Into::into),
        };
        Self {
            sequence: entry.sequence,
            transaction: entry.transaction,
            action,
            task: task.to_owned(),
            cycle: entry.cycle,
            unix_ns: entry.unix_ns,
            until_cycle,
            undone,
            changes: entry.changes.iter().map(change).collect(),
            left_out: 0,
            by: AskedBy::of(&entry.client, entry.comment.as_deref()),
            configuration: None,
            applied: entry.configuration.as_deref().map(AppliedChange::of),
        }
    }

    /// The same as the engine has it, for a task of this index.
    ///
    /// # Errors
    /// It is none that a node of this version can have written; why, as part of a sentence.
    fn to_entry(&self, task: usize) -> Result<Entry, String> {
        let action = match self.action {
            Action::Set => operate::Action::Set,
            Action::Force => operate::Action::Force { until: self.until_cycle },
            Action::Release => operate::Action::Release,
            Action::Expiry => operate::Action::Expiry,
            Action::Undo => operate::Action::Undo { of: self.undone.unwrap_or_default() },
            Action::Apply => operate::Action::Apply,
        };
        if self.left_out > 0 {
            return Err("an entry without all of its values".into());
        }
        if self.until_cycle.is_some_and(|until| until <= self.cycle) {
            return Err("a force that ends before it begins".into());
        }
        let change = |change: &Change| operate::Change {
            name: change.name.clone(),
            before: change.before.into(),
            after: change.after.map(Into::into),
        };
        Ok(Entry {
            sequence: self.sequence,
            transaction: self.transaction,
            task,
            cycle: self.cycle,
            unix_ns: self.unix_ns,
            action,
            changes: self.changes.iter().map(change).collect(),
            client: Client::Program,
            comment: self.by.comment.as_deref().map(Into::into),
            configuration: self.configuration.as_deref().map(|text| {
                Arc::new(operate::Applied { text: text.into(), ..operate::Applied::default() })
            }),
        })
    }
}

impl AskedBy {
    pub(crate) fn of(client: &Client, comment: Option<&str>) -> Self {
        Self {
            client: client.name().map(str::to_owned),
            process: client.process(),
            comment: comment.map(str::to_owned),
        }
    }
}

impl AppliedChange {
    fn of(applied: &operate::Applied) -> Self {
        let summary = &applied.summary;
        Self {
            file: applied.file.as_deref().map(str::to_owned),
            sha256: applied.sha256.clone(),
            added: summary.added.len() as u64,
            removed: summary.removed.len() as u64,
            changed: summary.changed.len() as u64,
            limits: summary.limits.clone(),
        }
    }
}
