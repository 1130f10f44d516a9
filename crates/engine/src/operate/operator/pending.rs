//! What is still to come.

use std::sync::Arc;

use super::{Client, Forced, Kind, Operator, Sent};
use crate::operate::Value;

/// A transaction that waits for a cycle of a task.
#[derive(Debug, Clone, PartialEq)]
pub struct Pending {
    /// Its number.
    pub transaction: u64,
    /// What it will do, as journals say: `set`, `force`, `release` or `undo`.
    pub action: &'static str,
    /// Index of its task.
    pub task: usize,
    /// The cycle that it waits for.
    pub cycle: u64,
    /// The signals that it will change.
    pub names: Vec<String>,
    /// The values that it will give them, in the order of the names; none for a release.
    pub values: Vec<Value>,
    /// Who asked for it.
    pub client: Client,
    /// What they said of it.
    pub comment: Option<Arc<str>>,
}

impl Operator {
    /// What the tasks have not come to yet, in the order of its numbers: an entry for each task.
    pub fn pending(&self) -> impl Iterator<Item = Pending> {
        self.sent.iter().flat_map(move |(&transaction, sent)| {
            let due = sent.due.iter();
            due.filter_map(move |(&task, &cycle)| self.to_come(transaction, sent, (task, cycle)))
        })
    }

    fn to_come(
        &self,
        transaction: u64,
        sent: &Sent,
        (task, cycle): (usize, u64),
    ) -> Option<Pending> {
        let action = match sent.kind {
            Kind::Set => "set",
            Kind::Force => "force",
            Kind::Release => "release",
            Kind::Undo { .. } => "undo",
            Kind::Read | Kind::Change => return None,
        };
        let written = sent.writes.iter().filter(|((of, _), _)| *of == task);
        let written = written.filter_map(|((_, slot), value)| {
            let signal = self.signal_at(task, *slot)?;
            Some((signal.name, Some(Value::of(*value, signal.value_type))))
        });
        let is_its = |forced: &&Forced| forced.transaction == transaction;
        let forces = self.forces.get(task).into_iter().flat_map(|of| of.values().flatten());
        let forced = forces.filter(is_its).map(|forced| (forced.name.clone(), Some(forced.value)));
        let released = sent.releases.iter().filter(|(of, _)| *of == task);
        let released =
            released.filter_map(|(_, slot)| Some((self.signal_at(task, *slot)?.name, None)));
        let mut named: Vec<(String, Option<Value>)> =
            written.chain(forced).chain(released).collect();
        named.sort_unstable_by(|(one, _), (other, _)| one.cmp(other));
        // What the program gives to its inputs is no operator's doing.
        named.first()?;
        let (names, values): (Vec<_>, Vec<_>) = named.into_iter().unzip();
        let values = values.into_iter().flatten().collect();
        let (client, comment) = (sent.client.clone(), sent.comment.clone());
        Some(Pending { transaction, action, task, cycle, names, values, client, comment })
    }
}
