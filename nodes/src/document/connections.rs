//! Who writes and who reads each signal, by names.

use std::collections::{BTreeMap, HashMap};

use isochrone_engine::Plan;

use crate::check::WireRow;

/// The wires of a plan in both directions.
pub(super) struct Connections {
    /// By the pin that is read.
    sources: HashMap<String, Vec<Source>>,
    /// By the signal that is read: pins, and outputs with the channel.
    readers: BTreeMap<String, Vec<String>>,
}

/// Where a wire comes from.
pub(super) struct Source {
    /// The signal, with its task if it is another one.
    pub(super) name: String,
    pub(super) unit: String,
}

impl Connections {
    pub(super) fn of(plan: &Plan) -> Self {
        let mut sources = HashMap::<String, Vec<Source>>::new();
        let mut readers = BTreeMap::<String, Vec<String>>::new();
        for (index, task) in plan.tasks.iter().enumerate() {
            for wire in WireRow::all(plan, index, task) {
                let [name, _, pin] = wire.cells();
                readers.entry(wire.signal().to_owned()).or_default().push(pin.clone());
                let source = Source { name, unit: wire.unit().to_owned() };
                sources.entry(pin).or_default().push(source);
            }
            let of_banks = task.banks.iter().filter(|bank| bank.block_type.is_alarm());
            let wires = of_banks.flat_map(|bank| &bank.wires).chain(&task.previous);
            for wire in wires {
                if let Some(alarm) = task.alarm_at(wire.to as usize) {
                    let name = plan.slot_name(index, wire.from as usize);
                    let names = readers.entry(name).or_default();
                    let reader = format!("alarm {alarm}");
                    // One that reads a signal twice stands there once.
                    if names.last() != Some(&reader) {
                        names.push(reader);
                    }
                }
            }
            for output in &task.outputs {
                for (channel, signal) in output.signals.iter().enumerate() {
                    let reader = format!("{}[{channel}]", output.service);
                    readers.entry(plan.slot_name(index, signal.slot)).or_default().push(reader);
                }
            }
        }
        Self { sources, readers }
    }

    /// Where the wire to a pin comes from; of an output of an `Expr`, what its expression reads.
    pub(super) fn sources(&self, pin: &str) -> &[Source] {
        self.sources.get(pin).map_or(&[], Vec::as_slice)
    }

    pub(super) fn readers(&self, signal: &str) -> &[String] {
        self.readers.get(signal).map_or(&[], Vec::as_slice)
    }
}

/// A name with a number in it: a pin of one of several instances, or a channel of an output.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Numbered<'a> {
    head: &'a str,
    tail: &'a str,
    first: usize,
    last: usize,
}

impl<'a> Numbered<'a> {
    fn of(name: &'a str) -> Option<Self> {
        let (begin, end) = match name.strip_suffix(']') {
            Some(channel) => (channel.rfind('[')? + 1, channel.len()),
            None => (name.find('.')? + 1, name.rfind('.')?),
        };
        let number = name.get(begin..end)?.parse().ok()?;
        let (head, tail) = (name.get(..begin)?, name.get(end..)?);
        Some(Self { head, tail, first: number, last: number })
    }
}

/// Names, those that differ only in numbers that follow each other as one: `axis.0…9.value`.
pub(super) fn joined(names: &[String]) -> String {
    let (mut numbered, mut parts) = (Vec::new(), Vec::new());
    for name in names {
        match Numbered::of(name) {
            Some(number) => numbered.push(number),
            None => parts.push(name.clone()),
        }
    }
    numbered.sort_unstable();
    let mut runs: Vec<Numbered<'_>> = Vec::new();
    for next in numbered {
        match runs.last_mut() {
            Some(run)
                if (run.head, run.tail, run.last + 1) == (next.head, next.tail, next.first) =>
            {
                run.last = next.last;
            }
            _ => runs.push(next),
        }
    }
    parts.extend(runs.iter().map(|Numbered { head, tail, first, last }| {
        if first == last {
            format!("{head}{first}{tail}")
        } else {
            format!("{head}{first}\u{2026}{last}{tail}")
        }
    }));
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instances_that_follow_each_other_are_one_name() {
        let names = [
            "r.1.value",
            "a.y",
            "r.0.value",
            "s[10]",
            "r.2.value",
            "r.2.callOB",
            "s[9]",
            "r.4.value",
        ];
        let names = names.map(str::to_owned);
        let expected = "a.y, r.2.callOB, r.0\u{2026}2.value, r.4.value, s[9\u{2026}10]";
        assert_eq!(joined(&names), expected);
        assert_eq!(joined(&[]), "");
    }
}
