//! `alarms`: what is wrong now.

use isochrone_report::Table;
use isochrone_runtime::control::{ActiveAlarm, AlarmsParams};
use serde_json::json;

use super::node::{self, Node};
use crate::failure::Failure;
use crate::terminal;

/// List what is wrong in a running node now
///
/// Blocks that report an error, with their status word, and inputs that are not ok: what it means, since
/// which cycle, and how often it came.
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
    /// Print one JSON document; with --follow, one JSON object a line
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
    table.row(["name", "status", "since cycle", "times", "meaning"]);
    for alarm in alarms {
        let (since, count) = (alarm.since_cycle.to_string(), alarm.count.to_string());
        table.row([&*alarm.name, &status(&alarm), &since, &count, &alarm.meaning]);
    }
    terminal::print(&table.draw(0))
}

fn follow(node: &mut Node, first: Vec<ActiveAlarm>, json: bool) -> Result<(), Failure> {
    let mut known: Vec<ActiveAlarm> = Vec::new();
    let tell = |now: Vec<ActiveAlarm>| {
        for (alarm, change) in changes(&known, &now) {
            terminal::print(&if json {
                terminal::json_line(&json!({"change": change.word(), "alarm": alarm}))?
            } else {
                let status = status(alarm);
                let blank = if status.is_empty() { "" } else { "  " };
                let ActiveAlarm { name, since_cycle, meaning, .. } = alarm;
                format!(
                    "{:<5}  {name}{blank}{status}  since cycle {since_cycle}: {meaning}\n",
                    change.word()
                )
            })?;
        }
        known = now;
        Ok(())
    };
    node.follow(first, tell, of)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    Came,
    Went,
}

impl Change {
    fn word(self) -> &'static str {
        match self {
            Self::Came => "came",
            Self::Went => "went",
        }
    }
}

/// What went between two looks, then what came; an alarm that went and came again did both.
fn changes<'a>(
    before: &'a [ActiveAlarm],
    now: &'a [ActiveAlarm],
) -> impl Iterator<Item = (&'a ActiveAlarm, Change)> {
    let lacks = |all: &[ActiveAlarm], one: &ActiveAlarm| {
        let is_same = |other: &ActiveAlarm| {
            (&other.name, other.status, other.count) == (&one.name, one.status, one.count)
        };
        !all.iter().any(is_same)
    };
    let went = before.iter().filter(move |alarm| lacks(now, alarm));
    let came = now.iter().filter(move |alarm| lacks(before, alarm));
    went.map(|alarm| (alarm, Change::Went)).chain(came.map(|alarm| (alarm, Change::Came)))
}

fn status(alarm: &ActiveAlarm) -> String {
    alarm.status.map_or_else(String::new, |status| format!("16#{status:04X}"))
}

/// All alarms of a node.
fn of(node: &mut Node) -> Result<Vec<ActiveAlarm>, Failure> {
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
            status: None,
            meaning: String::new(),
            since_cycle: 0,
            count,
        };
        let before = [alarm("a", 1), alarm("b", 1)];
        let now = [alarm("a", 1), alarm("b", 2), alarm("c", 1)];
        let told: Vec<_> =
            changes(&before, &now).map(|(alarm, change)| (&*alarm.name, change)).collect();
        assert_eq!(told, [("b", Change::Went), ("b", Change::Came), ("c", Change::Came)]);
        assert_eq!(changes(&now, &now).count(), 0);
    }
}
