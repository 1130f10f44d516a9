//! Who writes and who reads each signal, by names.

use std::collections::{BTreeMap, HashMap};

use isochrone_engine::Plan;

use crate::check::WireRow;

/// The wires of a plan in both directions.
pub(super) struct Connections {
    /// By the pin that is read.
    sources: HashMap<String, Source>,
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
        let (mut sources, mut readers) = (HashMap::new(), BTreeMap::<String, Vec<String>>::new());
        for (index, task) in plan.tasks.iter().enumerate() {
            for wire in WireRow::all(plan, index, task) {
                let [name, _, pin] = wire.cells();
                readers.entry(wire.signal().to_owned()).or_default().push(pin.clone());
                sources.insert(pin, Source { name, unit: wire.unit().to_owned() });
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

    /// Where a wire to a pin comes from.
    pub(super) fn source(&self, pin: &str) -> Option<&Source> {
        self.sources.get(pin)
    }

    pub(super) fn readers(&self, signal: &str) -> &[String] {
        self.readers.get(signal).map_or(&[], Vec::as_slice)
    }
}

/// Names, those of one pin of instances that follow each other as one.
pub(super) fn joined(names: &[String]) -> String {
    struct Run<'a> {
        base: &'a str,
        pin: &'a str,
        first: usize,
        last: usize,
    }
    let mut parts: Vec<Result<Run<'_>, &str>> = Vec::new();
    for name in names {
        let numbered = name.split('.').collect::<Vec<_>>();
        let [base, number, pin] = numbered[..] else {
            parts.push(Err(name));
            continue;
        };
        let Ok(number) = number.parse::<usize>() else {
            parts.push(Err(name));
            continue;
        };
        match parts.last_mut() {
            Some(Ok(run)) if run.base == base && run.pin == pin && run.last + 1 == number => {
                run.last = number;
            }
            _ => parts.push(Ok(Run { base, pin, first: number, last: number })),
        }
    }
    let part = |part: &Result<Run<'_>, &str>| match part {
        Err(name) => (*name).to_owned(),
        Ok(Run { base, pin, first, last }) if first == last => format!("{base}.{first}.{pin}"),
        Ok(Run { base, pin, first, last }) => format!("{base}.{first}\u{2026}{last}.{pin}"),
    };
    parts.iter().map(part).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instances_that_follow_each_other_are_one_name() {
        let names =
            ["a.y", "r.0.value", "r.1.value", "r.2.value", "r.2.callOB", "r.4.value", "s[0]"];
        let names = names.map(str::to_owned);
        assert_eq!(joined(&names), "a.y, r.0\u{2026}2.value, r.2.callOB, r.4.value, s[0]");
        assert_eq!(joined(&[]), "");
    }
}
