//! The result of a repeated run.

use isochrone_timing::units::counted;

use super::Rerun;
use crate::replay::document::{Outcome, TaskOutcome};
use crate::replay::operations::Tally;
use crate::replay::task::Broken;

impl Rerun<'_> {
    /// The result.
    pub(in crate::replay) fn finish(self) -> Outcome {
        let mut notes: Vec<String> = self.unlike.into_iter().collect();
        notes.extend(self.missing.notes());
        let some = |tally: &Tally, thing: &str, what: &str| {
            let things = counted(tally.count, thing);
            (tally.count > 0).then(|| format!("{things} {what}; the first: {}", tally.first))
        };
        if self.changes_left_out > 0 {
            let changes = counted(self.changes_left_out, "online change");
            notes.push(format!("{changes} of the run left out: the given configuration stays"));
        }
        notes.extend(some(
            &self.unfit,
            "operation",
            "of the run left out, which cannot be done here",
        ));
        notes.extend(some(&self.rejects, "recorded value", "that an input cannot hold left out"));
        if !self.is_other {
            let was = "not as the journal says it was before a change";
            notes.extend(some(&self.operations.differences, "value", was));
        }
        let left = self.operations.left() as u64;
        if left > 0 && !self.is_other {
            let left = counted(left, "operation");
            notes.push(format!("{left} of the run left out, as no cycle that was repeated has it"));
        }
        let without_rows = self.tasks.iter().filter(|task| task.last.is_none() && task.left == 0);
        notes.extend(without_rows.map(|task| {
            format!("the recording has no cycle of task \"{}\"; it does not run", task.name)
        }));
        let tasks = self.tasks.into_iter().map(|task| {
            let broken = task.broken.map(|Broken { cycle, why }| (cycle, why)).unzip();
            let (uncompared_from, uncompared_why) = broken;
            let missed = task.last.map_or(0, |last| last.missed);
            let (name, cycles, left) = (task.name, task.cycles, task.left);
            TaskOutcome { name, cycles, missed, left, uncompared_from, uncompared_why }
        });
        Outcome {
            tasks: tasks.collect(),
            comparison: self.comparison,
            missing: self.missing,
            may_miss: self.may_miss,
            notes,
            is_damaged: self.recorded.condition.damaged > 0,
            is_whole: self.recorded.condition.is_whole(),
            may_be_incomplete: false,
        }
    }
}
