//! What a transaction has done, as people read it.

use isochrone_report::Table;
use isochrone_runtime::control::{ByTask, Finding, ForceResult, Part, SetResult, Value, Values};

use crate::terminal;

/// The result of a request that changed something.
pub(super) struct Transaction<'a> {
    pub(super) number: u64,
    pub(super) tasks: &'a ByTask<Part>,
    pub(super) before: &'a Values,
    pub(super) warnings: &'a [Finding],
}

impl<'a> From<&'a SetResult> for Transaction<'a> {
    fn from(result: &'a SetResult) -> Self {
        let SetResult { transaction, tasks, before, warnings, .. } = result;
        Self { number: *transaction, tasks, before, warnings }
    }
}

impl<'a> From<&'a ForceResult> for Transaction<'a> {
    fn from(result: &'a ForceResult) -> Self {
        let ForceResult { transaction, tasks, before, warnings, .. } = result;
        Self { number: *transaction, tasks, before, warnings }
    }
}

impl Transaction<'_> {
    /// A line for the transaction, then one for each value with what it was and what it is.
    pub(super) fn text(&self, after: &Values) -> String {
        let mut text = format!("transaction {}{}\n", self.number, since(self.tasks));
        let mut table = Table::default();
        for (name, before) in self.before.iter() {
            let after = after.get(name).map_or_else(String::new, |after| alike(after, before));
            table.row([name.to_owned(), before.to_string(), format!("-> {after}")]);
        }
        text += &table.draw(2);
        text
    }

    /// Says what blocks will think of the new values.
    pub(super) fn warn(&self) {
        for warning in self.warnings {
            terminal::note(&format!("warning: {warning}"));
        }
    }
}

/// From which cycle of each task on it acts.
pub(super) fn since(tasks: &ByTask<Part>) -> String {
    let parts = tasks.iter().map(|(task, part)| match part.pending {
        false => format!(", from cycle {} of task \"{task}\" on", part.cycle),
        true => format!(", due in cycle {} of task \"{task}\", which is still to come", part.cycle),
    });
    parts.collect()
}

/// A value as the one before it is written: an LREAL may be given as a whole number.
fn alike(after: Value, before: Value) -> String {
    match (after, before) {
        (Value::Integer(after), Value::Number(_)) => Value::Number(after as f64).to_string(),
        _ => after.to_string(),
    }
}

/// Who asks, for the journal.
pub(crate) fn client() -> Option<String> {
    let user = ["USER", "LOGNAME"].into_iter().find_map(|name| std::env::var(name).ok());
    Some(user.filter(|user| !user.is_empty()).unwrap_or_else(crate::program::name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transaction_is_told_with_its_cycles_and_old_and_new_values() {
        let result = SetResult {
            transaction: 7,
            tasks: [
                ("fast".to_owned(), Part { cycle: 120, pending: false }),
                ("slow".to_owned(), Part { cycle: 99, pending: true }),
            ]
            .into(),
            before: [("a.rate", Value::Number(10.0)), ("b.on", Value::Bool(false))]
                .into_iter()
                .collect(),
            after: Values::default(),
            warnings: Vec::new(),
        };
        let after: Values =
            [("a.rate", Value::Integer(5)), ("b.on", Value::Bool(true))].into_iter().collect();
        assert_eq!(
            Transaction::from(&result).text(&after),
            "transaction 7, from cycle 120 of task \"fast\" on, due in cycle 99 of task \"slow\", \
             which is still to come\n  a.rate  10.0   -> 5.0\n  b.on    false  -> true\n"
        );
    }
}
