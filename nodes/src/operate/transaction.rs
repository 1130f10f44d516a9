//! The result of a transaction, as text.

use isochrone_control::{ByTask, Finding, ForceResult, Part, SetResult, Types, Values};
use isochrone_report::Table;

use super::types::typed;
use crate::failure::Failure;
use crate::terminal;

/// The result of a request that changed something.
pub(super) struct Transaction<'a> {
    pub(super) number: u64,
    pub(super) tasks: &'a ByTask<Part>,
    pub(super) before: &'a Values,
    pub(super) types: &'a Types,
    pub(super) warnings: &'a [Finding],
}

impl<'a> From<&'a SetResult> for Transaction<'a> {
    fn from(result: &'a SetResult) -> Self {
        let SetResult { transaction, tasks, before, types, warnings, .. } = result;
        Self { number: *transaction, tasks, before, types, warnings }
    }
}

impl<'a> From<&'a ForceResult> for Transaction<'a> {
    fn from(result: &'a ForceResult) -> Self {
        let ForceResult { transaction, tasks, before, types, warnings, .. } = result;
        Self { number: *transaction, tasks, before, types, warnings }
    }
}

impl Transaction<'_> {
    /// A line for the transaction, then one for each value with what it was and what it is: where the answer had
    /// no room for that, as it was `written`.
    pub(super) fn text(&self, after: &Values, written: impl Fn(&str) -> Option<String>) -> String {
        let mut text = format!("transaction {}{}\n", self.number, since(self.tasks));
        let mut table = Table::default();
        for (name, before) in self.before.iter() {
            let shown = |value| typed(self.types.get(name), value);
            let after = after.get(name).map(shown).or_else(|| written(name)).unwrap_or_default();
            table.row([name.to_owned(), shown(before), format!("-> {after}")]);
        }
        text += &table.draw(2);
        text
    }

    /// Says what blocks will think of the new values, and where the journal lacks them.
    pub(super) fn warn(&self) {
        warn(self.warnings);
    }
}

/// Says that a change was made, if its result could not be printed.
pub(super) fn made(transaction: u64, printed: Result<(), Failure>) -> Result<(), Failure> {
    printed.map_err(|failure| failure.after(&format!("transaction {transaction} was made")))
}

/// Prints the warnings about a change.
pub(super) fn warn(warnings: &[Finding]) {
    for warning in warnings {
        terminal::note(&format!("warning: {warning}"));
    }
}

/// From which cycle of each task on it acts.
pub(super) fn since(tasks: &ByTask<Part>) -> String {
    let parts = tasks.iter().map(|(task, Part { cycle, pending })| {
        if *pending {
            format!(", due in cycle {cycle} of task \"{task}\", which is still to come")
        } else {
            format!(", from cycle {cycle} of task \"{task}\" on")
        }
    });
    parts.collect()
}

/// Who asks, for the journal: `$USER`, `$LOGNAME`, or the account that the process runs under.
pub(crate) fn client() -> Option<String> {
    let user = ["USER", "LOGNAME"].into_iter().filter_map(|name| std::env::var(name).ok());
    let user = user.into_iter().find(|user| !user.is_empty());
    let id = rustix::process::getuid().as_raw();
    let accounts = || std::fs::read_to_string("/etc/passwd").unwrap_or_default();
    Some(user.or_else(|| account(&accounts(), id)).unwrap_or_else(|| format!("uid {id}")))
}

/// The account of an id, as `/etc/passwd` has it.
fn account(accounts: &str, id: u32) -> Option<String> {
    let account = |line: &str| {
        let mut fields = line.split(':');
        let (name, id) = (fields.next()?, fields.nth(1)?);
        Some((name.to_owned(), id.parse().ok()?))
    };
    let found = accounts.lines().filter_map(account).find(|(_, of): &(_, u32)| *of == id)?;
    Some(found.0)
}

#[cfg(test)]
mod tests {
    use isochrone_control::Value;

    use super::*;

    #[test]
    fn an_account_has_the_name_of_its_id() {
        let accounts = "root:x:0:0:root:/root:/bin/sh\nbad\nanna:x:1000:1000::/home/anna:/bin/sh\n";
        assert_eq!(account(accounts, 1000).as_deref(), Some("anna"));
        assert_eq!(account(accounts, 7), None);
    }

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
            types: Types::default(),
            warnings: Vec::new(),
        };
        let after: Values =
            [("a.rate", Value::Integer(5)), ("b.on", Value::Bool(true))].into_iter().collect();
        assert_eq!(
            Transaction::from(&result).text(&after, |_| None),
            "transaction 7, from cycle 120 of task \"fast\" on, due in cycle 99 of task \"slow\", \
             which is still to come\n  a.rate  10     -> 5\n  b.on    FALSE  -> TRUE\n"
        );
    }
}
