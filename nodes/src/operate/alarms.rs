//! `alarms`: what is wrong now.

use isochrone_control::{ActiveAlarm, AlarmsParams};
use isochrone_report::Table;
use jiff::Timestamp;
use serde_json::json;

use super::journal::time;
use super::node::{self, Node};
use crate::base::failure::Failure;
use crate::base::terminal;

/// List what is wrong in a running node now
///
/// Blocks that report an error, with their status word, blocks whose limits are off after manual mode, inputs that are not ok, and what is wrong with the frames of a
/// service (a second publisher, stamps of another clock, another machine that sends what a task follows, a channel
/// that carries another signal, samples that go round in a loop): the task, since when (UTC) and since which cycle of it, how often, and why. --follow says when an alarm goes to a tenth
/// of a second; the log of `run` has the cycle.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone alarms level\n  isochrone alarms level --follow\n  \
    isochrone alarms level --json | jq '.[].name'"
)]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Go on with each alarm that comes or goes until Ctrl-C
    #[arg(long)]
    follow: bool,
    /// Print one JSON document; with --follow, one JSON object per line
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let alarms = of(&mut node)?;
    if args.follow {
        return follow(&mut node, alarms, args.json);
    }
    if args.json {
        return terminal::print_json(&alarms);
    }
    if alarms.is_empty() {
        terminal::note("nothing is wrong");
        return Ok(());
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

fn follow(node: &mut Node, first: Vec<ActiveAlarm>, json: bool) -> Result<(), Failure> {
    let mut known: Vec<ActiveAlarm> = Vec::new();
    let tell = |now: Vec<ActiveAlarm>| {
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
    node.follow(first, tell, of)
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

/// All alarms of a node.
pub(super) fn of(node: &mut Node) -> Result<Vec<ActiveAlarm>, Failure> {
    node.pages(
        |offset| AlarmsParams { offset: Some(offset), limit: None },
        |page| (page.total, page.alarms),
    )
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
