//! `watch`: values as they change.

use std::time::{Duration, Instant};

use isochrone_engine::parse_seconds;
use isochrone_runtime::control::{ByTask, ReadAt, Value};

use super::known::Known;
use super::node::{self, Reading};
use crate::failure::Failure;
use crate::{numbers, terminal};

/// Between two looks for changes.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// Print values of a running node as they change
///
/// Looks every 20 ms and prints a line with the values that are different: what changes and changes
/// back in between is not seen (`subscribe` shows every frame). With --rate, prints all values at that
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
    let mut known = Known::default();
    let mut last: Vec<(String, Value)> = Vec::new();
    let mut next = Instant::now();
    let mut lines = 0;
    while args.count.is_none_or(|count| lines < count) {
        let read = node.read(&args.names);
        let Some(mut reading) = node.unless_ended(read)? else { break };
        if !args.json && reading.values.iter().any(|(name, _)| known.get(name).is_none()) {
            let found = node.known(reading.values.iter().map(|(name, _)| name));
            let Some(found) = node.unless_ended(found)? else { break };
            known = found;
        }
        let all = reading.values.0.clone();
        if args.rate.is_none() {
            let before = std::mem::replace(&mut last, all);
            reading.values.0 = changed(&before, reading.values.0);
        }
        if !reading.values.0.is_empty() {
            terminal::print(&if args.json {
                terminal::json_line(&reading)?
            } else {
                line(&reading, &known)
            })?;
            lines += 1;
        }
        // Those that were missed are not made up for.
        next = (next + interval).max(Instant::now());
        node.sleep_until(next);
    }
    Ok(())
}

/// The values that are not what they were, to the bit: a NaN stays the same.
fn changed(before: &[(String, Value)], now: Vec<(String, Value)>) -> Vec<(String, Value)> {
    let is_same = |a: Value, b: Value| match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.to_bits() == b.to_bits(),
        (a, b) => a == b,
    };
    let is_new = |(place, (name, value)): &(usize, (String, Value))| {
        before.get(*place).is_none_or(|(old, was)| old != name || !is_same(*was, *value))
    };
    now.into_iter().enumerate().filter(is_new).map(|(_, one)| one).collect()
}

/// Cycles and values in a line.
fn line(reading: &Reading, known: &Known) -> String {
    let value = |(name, value): (&str, Value)| format!("  {name}={}", known.shown(name, value));
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
    use super::*;

    #[test]
    fn a_line_has_what_is_different_and_a_nan_stays_the_same() {
        let of = |values: &[(&str, f64)]| {
            let one = |(name, value): &(&str, f64)| ((*name).to_owned(), Value::Number(*value));
            values.iter().map(one).collect::<Vec<_>>()
        };
        let before = of(&[("a", 1.0), ("b", f64::NAN), ("c", 0.0)]);
        assert_eq!(changed(&[], before.clone()).len(), 3, "the first line has all");
        assert_eq!(changed(&before, of(&[("a", 1.0), ("b", f64::NAN), ("c", 0.0)])), []);
        let now = of(&[("a", 2.0), ("b", f64::NAN), ("c", -0.0)]);
        assert_eq!(changed(&before, now), of(&[("a", 2.0), ("c", -0.0)]));
    }

    #[test]
    fn a_line_begins_with_the_cycle_of_each_task() {
        let at = |cycle| ReadAt { cycle, release_ns: 0 };
        let values = [("a.y", 0.5)].into_iter().collect();
        let mut reading = Reading { tasks: [("fast".to_owned(), at(7))].into(), values };
        let known = Known::default();
        assert_eq!(line(&reading, &known), "7  a.y=0.5\n");
        reading.tasks.insert("slow".to_owned(), at(3));
        assert_eq!(line(&reading, &known), "fast:7 slow:3  a.y=0.5\n");
    }
}
