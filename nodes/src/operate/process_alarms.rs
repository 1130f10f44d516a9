//! The process alarms of a running node, for `alarms` and `ack`.

use isochrone_control::{AlarmEntry, AlarmMoment, AlarmsParams, ProcessAlarm, Value};
use isochrone_engine::escaped;
use isochrone_report::Table;

use super::journal::time;
use super::node::Node;
use super::types::typed;
use crate::base::failure::Failure;

/// The alarms that stand or that nobody has acknowledged.
pub(super) fn table(alarms: &[ProcessAlarm]) -> String {
    let mut table = Table::default();
    table.row(["alarm", "no.", "severity", "state", "first", "last", "text"]);
    for alarm in alarms {
        let shown =
            |at: &Option<AlarmMoment>| at.as_ref().map_or_else(String::new, |at| moment(alarm, at));
        let number = alarm.occurrence.to_string();
        let (first, last) = (shown(&alarm.first), shown(&alarm.last));
        table.row([
            &alarm.name,
            &number,
            alarm.severity.as_str(),
            &state(alarm),
            &first,
            &last,
            &escaped(&alarm.text),
        ]);
    }
    table.draw(0)
}

/// Its state in words.
pub(crate) fn state(alarm: &ProcessAlarm) -> String {
    let mut state = alarm.state.words().to_owned();
    if alarm.unacknowledged > 1 {
        state += &format!(" ({} times)", alarm.unacknowledged);
    }
    if !alarm.evaluated {
        state += "; cannot be evaluated";
    }
    state
}

/// When an alarm came or went, with the value.
pub(crate) fn moment(alarm: &ProcessAlarm, at: &AlarmMoment) -> String {
    let value = value(at.value, &alarm.value_type);
    format!("{} cycle {} {} = {value}", time(at.unix_ns), at.cycle, alarm.signal)
}

/// The line of an event.
pub(crate) fn event_line(event: &AlarmEntry) -> String {
    let AlarmEntry { alarm, at, change, occurrence, task, .. } = event;
    let what = change.words();
    let mut line = format!(
        "{}  {alarm} {occurrence} {what} in cycle {} of task \"{task}\", value {}",
        time(at.unix_ns),
        at.cycle,
        value(at.value, &event.value_type)
    );
    if let Some(client) = &event.by.client {
        line += &format!(", by {}", escaped(client));
    }
    if let Some(comment) = &event.by.comment {
        line += &format!(": {}", escaped(comment));
    }
    if event.left_out > 0 {
        line += &format!(" ({} before it left out)", event.left_out);
    }
    line + "\n"
}

fn value(value: Value, value_type: &str) -> String {
    typed(Some(&value_type.to_owned()), value)
}

/// The events from a number on, all that are kept.
pub(super) fn events(node: &mut Node, since: u64) -> Result<Vec<AlarmEntry>, Failure> {
    let mut events: Vec<AlarmEntry> = Vec::new();
    loop {
        let since = events.last().map_or(since, |event| event.sequence + 1);
        let params = AlarmsParams { offset: Some(u64::MAX), limit: None, since: Some(since) };
        let page = node.call(&params)?;
        let is_last = page.events.is_empty();
        events.extend(page.events);
        if is_last || events.last().is_some_and(|event| event.sequence >= page.newest_event) {
            return Ok(events);
        }
    }
}

/// The number of the newest event; 0: there was none.
pub(super) fn newest_event(node: &mut Node) -> Result<u64, Failure> {
    let params = AlarmsParams { offset: Some(u64::MAX), limit: None, since: None };
    Ok(node.call(&params)?.newest_event)
}
