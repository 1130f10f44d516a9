//! `watch`: values as they change.

use std::time::{Duration, Instant};

use isochrone_control::{ByTask, ReadAt, Value};
use isochrone_engine::parse_seconds;

use super::node;
use super::reading::Reading;
use super::types::typed;
use crate::failure::Failure;
use crate::{numbers, terminal};

/// Between two looks for changes.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// Print values of a running node as they change
///
/// Looks every 20 ms and prints a line with the values that are different, or whose flags are, such as
/// `[STALE]` behind one computed from a dead sensor: what changes and changes back in between is not seen (`subscribe` shows every frame). With --rate, prints all values at that
/// rate, changed or not. All values of a task in one line are of the cycle that it begins with.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone watch level level_raw level.y\n  \
    isochrone watch level 'ramp.*' --rate 1 | tee ramp.log\n  \
    isochrone watch level level_raw.ok --json")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Signals: inputs, `block.pin`, `block.17.pin`; `*` matches within one part of a name
    #[arg(required = true, value_name = "NAME")]
    names: Vec<String>,
    /// Print all values at this rate, at most 50 Hz
    #[arg(long, value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Stop after this many lines
    #[arg(long, value_parser = numbers::parse_count, allow_negative_numbers = true)]
    count: Option<u64>,
    /// Stop after this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect_for(args.seconds)?;
    let interval = args.rate.map_or(LOOK_INTERVAL, |rate| Duration::from_secs_f64(1.0 / rate));
    let mut last: Vec<WatchedValue> = Vec::new();
    let mut next = Instant::now();
    let mut lines = 0;
    while args.count.is_none_or(|count| lines < count) {
        let read = if args.json { node.read(&args.names) } else { node.read_typed(&args.names) };
        let Some(mut reading) = node.unless_ended(read)? else { break };
        if args.rate.is_none() {
            let values = std::mem::take(&mut reading.values.0).into_iter();
            let now: Vec<WatchedValue> = values
                .map(|(name, value)| WatchedValue { flags: reading.flags(&name), name, value })
                .collect();
            reading.values.0 = changed(&last, &now);
            last = now;
        }
        if !reading.values.0.is_empty() {
            terminal::print(&if args.json {
                terminal::json_line(&reading)?
            } else {
                line(&reading)
            })?;
            lines += 1;
        }
        // Those that were missed are not made up for.
        next = (next + interval).max(Instant::now());
        node.sleep_until(next);
    }
    Ok(())
}

/// A value and its flags.
#[derive(Clone)]
struct WatchedValue {
    name: String,
    value: Value,
    flags: String,
}

/// The values that are not what they were, to the bit, or whose flags are not: a NaN stays the same.
fn changed(before: &[WatchedValue], now: &[WatchedValue]) -> Vec<(String, Value)> {
    let is_same = |a: Value, b: Value| match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.to_bits() == b.to_bits(),
        (a, b) => a == b,
    };
    let is_new = |(place, now): &(usize, &WatchedValue)| {
        before.get(*place).is_none_or(|old| {
            old.name != now.name || old.flags != now.flags || !is_same(old.value, now.value)
        })
    };
    let new = now.iter().enumerate().filter(is_new);
    new.map(|(_, shown)| (shown.name.clone(), shown.value)).collect()
}

/// Cycles and values in a line.
fn line(reading: &Reading) -> String {
    let value = |(name, value): (&str, Value)| {
        let flags = Some(reading.flags(name)).filter(|flags| !flags.is_empty());
        let flags = flags.map_or_else(String::new, |flags| format!(" [{flags}]"));
        format!("  {name}={}{flags}", typed(reading.types.get(name), value))
    };
    let values = reading.values.iter().map(value);
    format!("{}{}\n", cycles(&reading.tasks), values.collect::<String>())
}

/// The cycle, of each task where there are several.
fn cycles(tasks: &ByTask<ReadAt>) -> String {
    let one = |(task, at): (&String, &ReadAt)| match tasks.len() {
        1 => at.cycle.to_string(),
        _ => format!("{task}:{}", at.cycle),
    };
    tasks.iter().map(one).collect::<Vec<_>>().join(" ")
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if (0.001..=50.0).contains(&rate) => Ok(rate),
        _ => Err("give a rate from 0.001 to 50 Hz; `subscribe` shows every frame".into()),
    }
}

#[cfg(test)]
mod tests {
    use isochrone_control::Types;

    use super::*;

    #[test]
    fn a_line_has_what_is_different_and_a_nan_stays_the_same() {
        let of = |values: &[(&str, f64)]| {
            let one = |(name, value): &(&str, f64)| WatchedValue {
                name: (*name).to_owned(),
                value: Value::Number(*value),
                flags: String::new(),
            };
            values.iter().map(one).collect::<Vec<_>>()
        };
        let before = of(&[("a", 1.0), ("b", f64::NAN), ("c", 0.0)]);
        let names = |before: &[WatchedValue], now: &[WatchedValue]| {
            changed(before, now).into_iter().map(|(name, _)| name).collect::<Vec<_>>()
        };
        assert_eq!(names(&[], &before), ["a", "b", "c"], "the first line has all");
        assert!(names(&before, &before.clone()).is_empty());
        let now = of(&[("a", 2.0), ("b", f64::NAN), ("c", -0.0)]);
        assert_eq!(names(&before, &now), ["a", "c"]);
        let mut stale = before.clone();
        stale[1].flags = "STALE".into();
        assert_eq!(names(&before, &stale), ["b"]);
    }

    #[test]
    fn a_line_begins_with_the_cycle_of_each_task() {
        let at = |cycle| ReadAt { cycle, release_ns: 0 };
        let values = [("a.y", 0.5)].into_iter().collect();
        let tasks = [("fast".to_owned(), at(7))].into();
        let mut reading = Reading { tasks, values, quality: None, types: Types::new() };
        assert_eq!(line(&reading), "7  a.y=0.5\n");
        reading.tasks.insert("slow".to_owned(), at(3));
        assert_eq!(line(&reading), "fast:7 slow:3  a.y=0.5\n");
        let flags = vec!["STALE".to_owned(), "UPSTREAM".to_owned()];
        reading.quality = Some([("a.y".to_owned(), flags)].into());
        assert_eq!(line(&reading), "fast:7 slow:3  a.y=0.5 [STALE UPSTREAM]\n");
    }
}
