//! The history of changes, as far as the screen needs it to take one back.

use isochrone_control::{Action, Entry, Value};

use super::signals::Signals;
use crate::base::numbers::{Digits, shown_value, type_of};
use crate::operate::undo::{Last, last_change, taken_back};
use crate::operate::{time, word};

/// As many entries as the node keeps.
const KEPT: usize = 10_000;
/// How many changes of a transaction are listed; the others are counted.
const MOST_CHANGES: usize = 3;

/// The node's journal.
#[derive(Debug, Default)]
pub(super) struct History(Vec<Entry>);

impl History {
    /// Takes in entries; those that are known are passed over.
    pub(super) fn take(&mut self, entries: Vec<Entry>) {
        let last = self.0.last().map_or(0, |entry| entry.sequence);
        self.0.extend(entries.into_iter().filter(|entry| entry.sequence > last));
        let surplus = self.0.len().saturating_sub(KEPT);
        self.0.drain(..surplus);
    }

    /// The newest set that was not taken back.
    pub(super) fn undoable(&self) -> Option<u64> {
        match last_change(&self.0)? {
            Last::Set(transaction) => Some(transaction),
            Last::Apply(_) => None,
        }
    }

    /// Why there is no such set.
    pub(super) fn why_nothing(&self) -> String {
        match last_change(&self.0) {
            Some(Last::Apply(transaction)) => format!(
                "#{transaction}, the last change, is an apply, which cannot be taken back; type the \
                 number of a set"
            ),
            _ => "nothing was set since the node started, or all of it was taken back".into(),
        }
    }

    /// The changes of a transaction and its client; an error if it cannot be taken back.
    pub(super) fn describe(&self, transaction: u64, signals: &Signals) -> Result<String, String> {
        let of_it =
            |entry: &&Entry| entry.transaction == transaction && entry.action != Action::Expiry;
        let entries: Vec<_> = self.0.iter().filter(of_it).collect();
        let Some(first) = entries.first() else {
            return Err(format!("the node's journal has no transaction {transaction}"));
        };
        let mut text = word(first.action).to_owned();
        if let Some(undone) = first.undone {
            text += &format!(" of {undone},");
        }
        let all = entries.iter().flat_map(|entry| &entry.changes);
        let changes = all.clone().take(MOST_CHANGES).map(|change| {
            let value = |value| shown_as(signals, &change.name, value);
            let after = change.after.map_or("as computed".into(), value);
            format!(" {} {} -> {after}", change.name, value(change.before))
        });
        text += &changes.collect::<Vec<_>>().join(",");
        let left_out: u64 = entries.iter().map(|entry| entry.left_out).sum();
        let more = all.skip(MOST_CHANGES).count() as u64 + left_out;
        if more > 0 {
            text += &format!(" and {more} more");
        }
        if let Some(client) = &first.by.client {
            text += &format!(", by {client}");
        }
        let at = time(first.unix_ns);
        text += &at.get(11..19).map_or(String::new(), |clock| format!(" at {clock} UTC"));
        match first.action {
            Action::Set | Action::Undo if taken_back(&self.0).contains(&transaction) => {
                Err(format!("{text}: it was taken back already"))
            }
            Action::Set | Action::Undo => Ok(text),
            Action::Force => Err(format!("{text}: a force ends with r, not with u")),
            Action::Release | Action::Expiry | Action::Apply | Action::Ack => {
                Err(format!("{text}: only a set or an undo can be taken back"))
            }
        }
    }
}

/// A value as its signal's type has it.
pub(super) fn shown_as(signals: &Signals, name: &str, value: Value) -> String {
    match signals.find(name) {
        Some(signal) => shown_value(value, type_of(&signal.value_type), Digits::Six),
        None => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::top::fixtures::entry;

    #[test]
    fn the_newest_set_that_stands_is_proposed_and_each_transaction_is_told() {
        let mut history = History::default();
        let signals = Signals::default();
        assert_eq!(history.undoable(), None);
        history.take(vec![entry(1, Action::Set, 5.0), entry(2, Action::Set, 6.0)]);
        // Pages overlap.
        history.take(vec![entry(2, Action::Set, 6.0), entry(3, Action::Force, 7.0)]);
        assert_eq!(history.undoable(), Some(2));
        let description = |history: &History, number| history.describe(number, &signals);
        let set = "set ramp.setChangeRate 0.0 -> 6.0, by bert at 22:13:20 UTC";
        assert_eq!(description(&history, 2), Ok(set.into()));
        history.take(vec![Entry { undone: Some(2), ..entry(4, Action::Undo, 0.0) }]);
        assert_eq!(history.undoable(), Some(1));
        assert!(description(&history, 2).unwrap_err().contains("it was taken back already"));
        assert!(description(&history, 3).unwrap_err().contains("a force ends with r"));
        assert!(description(&history, 4).unwrap().starts_with("undo of 2, ramp.setChangeRate"));
        assert!(description(&history, 5).unwrap_err().contains("has no transaction 5"));
        history.take(vec![entry(6, Action::Apply, 0.0)]);
        assert_eq!(history.undoable(), None);
        assert!(history.why_nothing().contains("#6, the last change, is an apply"));
    }
}
