//! `alarms`: what is wrong now.

use std::cell::Cell;

use isochrone_control::{ActiveAlarm, AlarmEntry};
use isochrone_report::Table;
use jiff::Timestamp;
use serde_json::json;

use super::journal::time;
use super::node::{self, Node};
use super::process_alarms::{self, event_line, events, newest_event};
use crate::base::failure::Failure;
use crate::base::terminal;

/// List the alarms of a running node: those of the process, and what is wrong with the node itself
///
/// First the process alarms that the configuration describes ([[alarm]]), if they stand or nobody has acknowledged
/// them: number of the newest occurrence, severity, state, when the first unacknowledged occurrence came and when the
/// alarm last came or went (UTC, cycle and value), and text. `isochrone ack` acknowledges them.
///
/// Then what is wrong with the node: blocks that report an error, with their status word, blocks whose limits are off after manual mode, inputs that are not ok, and what is wrong with the frames of a
/// service (a second publisher, stamps of another clock, another machine that sends what a task follows, a channel
/// that carries another signal, samples that go round in a loop): the task, since when (UTC) and since which cycle of it, how often, and why. --follow says when an alarm goes to a tenth
/// of a second; the log of `run` has the cycle.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone alarms level\n  isochrone alarms level --follow\n  isochrone alarms level --events\n  \
    isochrone alarms level --json | jq '.[].name'"
)]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Go on with each alarm that comes or goes until Ctrl-C
    #[arg(long)]
    follow: bool,
    /// Only the process alarms, which --json leaves out otherwise
    #[arg(long)]
    process: bool,
    /// What the process alarms did: the last 4096 events, one a second at most for each alarm
    #[arg(long, conflicts_with = "process")]
    events: bool,
    /// Print one JSON document; with --follow, one JSON object per line
    #[arg(long)]
    json: bool,
}

impl Args {
    fn lists_node(&self) -> bool {
        !self.process && !self.events
    }

    fn lists_process(&self) -> bool {
        self.process || !self.events && !self.json
    }
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    if args.follow {
        return follow(&mut node, args);
    }
    if args.events {
        let events = events(&mut node, 0)?;
        return if args.json {
            terminal::print_json(&events)
        } else {
            terminal::print(&events.iter().map(event_line).collect::<String>())
        };
    }
    let (alarms, process) = node.alarms()?;
    if args.json {
        let of_process = || terminal::print_json(&process);
        return if args.process { of_process() } else { terminal::print_json(&alarms) };
    }
    if process.is_empty() && (args.process || alarms.is_empty()) {
        terminal::note(if args.process { "no process alarm stands" } else { "nothing is wrong" });
        return Ok(());
    }
    if !process.is_empty() {
        terminal::print(&process_alarms::table(&process))?;
    }
    if args.process || alarms.is_empty() {
        return Ok(());
    }
    if !process.is_empty() {
        terminal::print("\n")?;
    }
    let mut table = Table::default();
    table.row(["name", "task", "status", "since", "since cycle", "times", "meaning"]);
    for alarm in alarms {
        let ActiveAlarm { name, task, meaning, .. } = &alarm;
        let (cycle, count) = (alarm.since_cycle.to_string(), alarm.count.to_string());
        let since = alarm.since_unix_ns.map_or_else(String::new, time);
        table.row([name, task, &status(&alarm), &since, &cycle, &count, meaning]);
    }
    terminal::print(&table.draw(0))
}

fn follow(node: &mut Node, args: &Args) -> Result<(), Failure> {
    let (json, mut known) = (args.json, Vec::<ActiveAlarm>::new());
    let lists_events = args.events || args.lists_process();
    // Without --events they begin with the next one.
    let newest = if lists_events && !args.events { newest_event(node)? } else { 0 };
    let known_event = Cell::new(newest);
    let tell = |(now, events): (Vec<ActiveAlarm>, Vec<AlarmEntry>)| {
        for event in &events {
            known_event.set(event.sequence);
            terminal::print(&if json { terminal::json_line(event)? } else { event_line(event) })?;
        }
        let now_ns = u64::try_from(Timestamp::now().as_nanosecond()).unwrap_or_default();
        for (alarm, change) in changes(&known, &now) {
            terminal::print(&if json {
                let line = json!({"change": change.word(), "unix_ns": now_ns, "alarm": alarm});
                terminal::json_line(&line)?
            } else {
                line(alarm, change, now_ns)
            })?;
        }
        known = now;
        Ok(())
    };
    let read = |node: &mut Node| {
        let alarms = if args.lists_node() { node.alarms()?.0 } else { Vec::new() };
        // A node of an earlier version has none, and refuses to be asked for them.
        let has_new = lists_events && newest_event(node)? > known_event.get();
        let events = if has_new { events(node, known_event.get() + 1)? } else { Vec::new() };
        Ok((alarms, events))
    };
    let first = read(node)?;
    node.follow(first, tell, read)
}

/// An alarm that came in its cycle, or went or is another at this instant.
fn line(alarm: &ActiveAlarm, change: Change, now_ns: u64) -> String {
    let ActiveAlarm { name, task, since_cycle, meaning, .. } = alarm;
    let came = format!("in cycle {since_cycle} of task \"{task}\"");
    let when = match (change, alarm.since_unix_ns) {
        (Change::Came, Some(since_ns)) => format!("{}  {came}", time(since_ns)),
        (Change::Came, None) => came,
        (Change::Went, Some(since_ns)) => {
            let lasted = now_ns.saturating_sub(since_ns) as f64 / 1e9;
            format!("{}  after {lasted:.1} s, it came {came}", time(now_ns))
        }
        (Change::Went | Change::Is, _) => format!("{}  it came {came}", time(now_ns)),
    };
    let status = status(alarm);
    let blank = if status.is_empty() { "" } else { "  " };
    format!("{:<5}  {name}{blank}{status}  {when}: {meaning}\n", change.word())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    Came,
    Went,
    /// It stays, for another reason.
    Is,
}

impl Change {
    fn word(self) -> &'static str {
        match self {
            Self::Came => "came",
            Self::Went => "went",
            Self::Is => "is",
        }
    }
}

/// What went between two looks, then what came, then what has another reason; an alarm that went and came
/// again did both.
fn changes<'a>(
    before: &'a [ActiveAlarm],
    now: &'a [ActiveAlarm],
) -> impl Iterator<Item = (&'a ActiveAlarm, Change)> {
    let lacks = |all: &[ActiveAlarm], one: &ActiveAlarm| {
        let is_same = |other: &ActiveAlarm| {
            (&other.name, &other.code, other.status, other.count)
                == (&one.name, &one.code, one.status, one.count)
        };
        !all.iter().any(is_same)
    };
    let went = before.iter().filter(move |alarm| lacks(now, alarm));
    let came = now.iter().filter(move |alarm| lacks(before, alarm));
    let is_another = move |alarm: &&ActiveAlarm| {
        let mut same =
            before.iter().filter(|one| one.name == alarm.name && one.count == alarm.count);
        same.any(|one| {
            one.code == alarm.code && one.status == alarm.status && one.meaning != alarm.meaning
        })
    };
    let others = now.iter().filter(is_another);
    went.map(|alarm| (alarm, Change::Went))
        .chain(came.map(|alarm| (alarm, Change::Came)))
        .chain(others.map(|alarm| (alarm, Change::Is)))
}

fn status(alarm: &ActiveAlarm) -> String {
    alarm.status.map_or_else(String::new, |status| format!("16#{status:04X}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_that_came_again_went_and_came() {
        let alarm = |name: &str, count| ActiveAlarm {
            name: name.to_owned(),
            code: None,
            task: "fast".to_owned(),
            status: None,
            meaning: String::new(),
            since_cycle: 7,
            since_unix_ns: Some(1_700_000_000_000_000_000),
            count,
        };
        let before = [alarm("a", 1), alarm("b", 1)];
        let now = [alarm("a", 1), alarm("b", 2), alarm("c", 1)];
        let told: Vec<_> =
            changes(&before, &now).map(|(alarm, change)| (&*alarm.name, change)).collect();
        assert_eq!(told, [("b", Change::Went), ("b", Change::Came), ("c", Change::Came)]);
        assert_eq!(changes(&now, &now).count(), 0);
        let stale = ActiveAlarm { meaning: "stale".to_owned(), ..alarm("a", 1) };
        let told: Vec<_> = changes(&before[..1], std::slice::from_ref(&stale)).collect();
        assert_eq!(told, [(&stale, Change::Is)]);
        let went = line(&stale, Change::Went, 1_700_000_002_500_000_000);
        assert_eq!(
            went,
            "went   a  2023-11-14T22:13:22.500Z  after 2.5 s, it came in cycle 7 of task \"fast\": stale\n"
        );
        let came = line(&stale, Change::Came, 0);
        assert!(came.starts_with("came   a  2023-11-14T22:13:20.000Z  in cycle 7"), "{came}");
    }
}
