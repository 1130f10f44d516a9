//! Requests that tasks have not applied yet.

use isochrone_model::{Action, PendingEntry, Value, Values};

use super::{ForceRecord, Kind, Operator, PendingRequest};

impl Operator {
    /// The requests that tasks have not applied yet, in the order of their numbers: an entry for each task.
    pub fn pending(&self) -> impl Iterator<Item = PendingEntry> {
        self.sent.iter().flat_map(move |(&transaction, sent)| {
            let due = sent.due.iter();
            due.filter_map(move |(&task, &cycle)| self.to_come(transaction, sent, (task, cycle)))
        })
    }

    fn to_come(
        &self,
        transaction: u64,
        sent: &PendingRequest,
        (task, cycle): (usize, u64),
    ) -> Option<PendingEntry> {
        let action = match sent.kind {
            Kind::Set => Action::Set,
            Kind::Force => Action::Force,
            Kind::Release => Action::Release,
            Kind::Undo { .. } => Action::Undo,
            Kind::Read | Kind::Change => return None,
        };
        let written = sent.writes.iter().filter(|((of, _), _)| *of == task);
        let written = written.filter_map(|((_, slot), value)| {
            let signal = self.signal_at(task, *slot)?;
            Some((signal.name, Some(Value::of(*value, signal.value_type))))
        });
        let is_its = |forced: &&ForceRecord| forced.transaction == transaction;
        let forces = self.forces.get(task).into_iter().flat_map(|of| of.values().flatten());
        let forced = forces.filter(is_its).map(|forced| (forced.name.clone(), Some(forced.value)));
        let released = sent.releases.iter().filter(|(of, _)| *of == task);
        let released =
            released.filter_map(|(_, slot)| Some((self.signal_at(task, *slot)?.name, None)));
        let mut named: Vec<(String, Option<Value>)> =
            written.chain(forced).chain(released).collect();
        named.sort_unstable_by(|(one, _), (other, _)| one.cmp(other));
        // Values that the program gives to its inputs are no changes by an operator.
        named.first()?;
        let values = named.iter().filter_map(|(name, value)| Some((name.clone(), (*value)?)));
        let values: Values = values.collect();
        let named_type =
            |(name, _): (&str, _)| Some((name.to_owned(), self.value_type(name)?.to_string()));
        Some(PendingEntry {
            transaction,
            action,
            task: self.signals.task_name(task).to_owned(),
            cycle,
            types: values.iter().filter_map(named_type).collect(),
            values,
            names: named.into_iter().map(|(name, _)| name).collect(),
            by: sent.by.clone(),
        })
    }
}
