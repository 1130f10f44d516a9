//! Entries of a journal as people read them.

use isochrone_control::{Action, AppliedChange, AskedBy, Change, Entry, PendingEntry};
use isochrone_engine::escaped;
use isochrone_report::Table;
use jiff::Timestamp;

use crate::operate::types::typed;

/// The value of a signal after a change, where a wire or a block gives it.
pub(in crate::operate) const COMPUTED: &str = "as computed";

/// A transaction that a task has not come to yet.
pub(super) fn to_come(entry: &PendingEntry) -> String {
    let PendingEntry { transaction, action, task, cycle, names, values, types, .. } = entry;
    let mut text = format!(
        "still to come             {action} {transaction}, cycle {cycle} of task \"{task}\""
    );
    text += &by(&entry.by);
    text += "\n";
    let mut table = Table::default();
    for name in names {
        let value = values.get(name).map(|value| format!("-> {}", typed(types.get(name), value)));
        table.row([escaped(name).into(), value.unwrap_or_default()]);
    }
    text + &table.draw(2)
}

/// Who asked, and why.
fn by(by: &AskedBy) -> String {
    let AskedBy { client, process, comment } = by;
    // One line, whatever others have put into it.
    let who = match (client.as_deref().map(escaped), process) {
        (Some(client), Some(process)) => format!(", by {client} (pid {process})"),
        (Some(client), None) => format!(", by {client}"),
        (None, Some(process)) => format!(", by pid {process}"),
        (None, None) => String::new(),
    };
    who + &comment.as_deref().map_or_else(String::new, |comment| format!(": {}", escaped(comment)))
}

/// Which configuration was applied.
fn applied(change: &AppliedChange) -> String {
    let AppliedChange { file, sha256, added, removed, changed, limits } = change;
    let file = file.as_deref().map_or_else(String::new, |file| format!("{}, ", escaped(file)));
    let short = sha256.get(..12).unwrap_or(sha256);
    let mut text =
        format!("  {file}sha256 {short}…: {added} added, {removed} removed, {changed} changed\n");
    for limit in limits {
        text += &format!("  limits {limit}\n");
    }
    text
}

/// An entry as people read it.
pub(super) fn text(entry: &Entry) -> String {
    let mut text = format!(
        "{}  {} {}, cycle {} of task \"{}\"",
        time(entry.unix_ns),
        word(entry.action),
        entry.transaction,
        entry.cycle,
        entry.task
    );
    if let Some(until) = entry.until_cycle {
        text += &format!(", until cycle {until}");
    }
    if let Some(undone) = entry.undone {
        text += &format!(", takes {undone} back");
    }
    text += &by(&entry.by);
    let mut table = Table::default();
    for change in &entry.changes {
        let Change { name, before, after, value_type } = change;
        let shown = |value| typed(value_type.as_ref(), value);
        let after = after.map_or(COMPUTED.to_owned(), shown);
        table.row([escaped(name).into(), shown(*before), format!("-> {after}")]);
    }
    text += "\n";
    text += &entry.applied.as_ref().map_or_else(String::new, applied);
    text += &table.draw(2);
    if entry.left_out > 0 {
        text += &format!("  and {} more\n", entry.left_out);
    }
    text
}

pub(crate) fn word(action: Action) -> &'static str {
    match action {
        Action::Set => "set",
        Action::Force => "force",
        Action::Release => "release",
        Action::Expiry => "end of force",
        Action::Undo => "undo",
        Action::Apply => "apply",
        Action::Ack => "ack",
    }
}

/// An instant of UTC to the millisecond.
pub(crate) fn time(unix_ns: u64) -> String {
    match Timestamp::from_nanosecond(unix_ns.into()) {
        Ok(time) => format!("{time:.3}"),
        Err(_) => format!("{unix_ns} ns"),
    }
}

#[cfg(test)]
mod tests {
    use isochrone_control::Value;

    use super::*;

    #[test]
    fn an_entry_tells_when_what_who_and_why() {
        let entry = Entry {
            sequence: 1,
            transaction: 12,
            action: Action::Force,
            task: "fast".to_owned(),
            cycle: 4711,
            unix_ns: 1_700_000_000_123_456_789,
            until_cycle: Some(5711),
            undone: None,
            changes: vec![Change {
                name: "a.y".to_owned(),
                before: Value::Number(0.5),
                after: None,
                value_type: None,
            }],
            left_out: 3,
            by: AskedBy {
                client: Some("anna".to_owned()),
                process: Some(42),
                comment: Some("pump\ntest".to_owned()),
            },
            configuration: None,
            applied: None,
        };
        assert_eq!(
            text(&entry),
            "2023-11-14T22:13:20.123Z  force 12, cycle 4711 of task \"fast\", until cycle 5711, by anna \
             (pid 42): pump\\ntest\n  a.y  0.5  -> as computed\n  and 3 more\n"
        );
    }
}
