//! Comparison of recorded and computed values.

use std::collections::HashMap;
use std::fmt::{self, Write};

use isochrone_timing::units::counted;
use serde::Serialize;

use crate::numbers;

/// When two values are the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Tolerance {
    /// When all of their bits are.
    Bits,
    /// When they differ by at most so much; NaN is the same as NaN.
    Absolute(f64),
}

/// All that was compared.
pub(super) struct Comparison {
    tolerance: Tolerance,
    signals: Vec<Signal>,
    /// By task, service and name.
    known: HashMap<(String, String, String), usize>,
    pub(super) compared: u64,
    pub(super) different: u64,
}

/// A signal of an output.
#[derive(Debug, Serialize)]
pub(super) struct Signal {
    pub(super) task: String,
    pub(super) service: String,
    #[serde(rename = "signal")]
    pub(super) name: String,
    pub(super) compared: u64,
    pub(super) different: u64,
    pub(super) first: Option<Difference>,
    /// The largest that was seen of those that are numbers.
    #[serde(rename = "largest_difference", serialize_with = "numbers::serialize_some")]
    pub(super) largest: Option<f64>,
}

/// A value that is another one.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Difference {
    pub(super) cycle: u64,
    pub(super) release_ns: u64,
    #[serde(serialize_with = "numbers::serialize")]
    pub(super) recorded: f64,
    #[serde(serialize_with = "numbers::serialize")]
    pub(super) replayed: f64,
}

/// Which cycle values are of.
#[derive(Debug, Clone, Copy)]
pub(super) struct When {
    pub(super) cycle: u64,
    pub(super) release_ns: u64,
}

impl Tolerance {
    fn is_same(self, recorded: f64, replayed: f64) -> bool {
        recorded.to_bits() == replayed.to_bits()
            || match self {
                Self::Bits => false,
                Self::Absolute(most) => {
                    recorded == replayed
                        || (recorded - replayed).abs() <= most
                        || recorded.is_nan() && replayed.is_nan()
                }
            }
    }
}

impl Comparison {
    pub(super) fn new(tolerance: Tolerance) -> Self {
        let (signals, known) = (Vec::new(), HashMap::new());
        Self { tolerance, signals, known, compared: 0, different: 0 }
    }

    /// The number of a signal.
    pub(super) fn signal(&mut self, task: &str, service: &str, name: &str) -> usize {
        let key = (task.to_owned(), service.to_owned(), name.to_owned());
        let signals = &mut self.signals;
        *self.known.entry(key).or_insert_with_key(|(task, service, name)| {
            signals.push(Signal {
                task: task.clone(),
                service: service.clone(),
                name: name.clone(),
                compared: 0,
                different: 0,
                first: None,
                largest: None,
            });
            signals.len() - 1
        })
    }

    /// Compares a value of a signal, by its number.
    pub(super) fn compare(&mut self, signal: usize, when: When, recorded: f64, replayed: f64) {
        let Some(signal) = self.signals.get_mut(signal) else { return };
        self.compared += 1;
        signal.compared += 1;
        if self.tolerance.is_same(recorded, replayed) {
            return;
        }
        self.different += 1;
        signal.different += 1;
        let When { cycle, release_ns } = when;
        signal.first.get_or_insert(Difference { cycle, release_ns, recorded, replayed });
        let by = (recorded - replayed).abs();
        if !by.is_nan() && signal.largest.is_none_or(|largest| by > largest) {
            signal.largest = Some(by);
        }
    }

    /// The signals of which some value differs, in the order in which they began to.
    pub(super) fn differing(&self) -> impl Iterator<Item = &Signal> {
        let mut differing: Vec<&Signal> =
            self.signals.iter().filter(|signal| signal.first.is_some()).collect();
        differing.sort_by_key(|signal| signal.first.map(|first| first.release_ns));
        differing.into_iter()
    }

    /// The first difference, as part of a sentence.
    pub(super) fn first(&self) -> Option<impl fmt::Display> {
        let signal = self.differing().next()?;
        let Signal { task, service, name, .. } = signal;
        let Difference { cycle, recorded, replayed, .. } = signal.first?;
        let (recorded, replayed) = both(recorded, replayed);
        Some(format!(
            "the first difference is in cycle {cycle} of task \"{task}\": \"{name}\" of \"{service}\" was \
             {recorded} and is {replayed}"
        ))
    }

    /// A line for each signal that differs.
    pub(super) fn table(&self) -> String {
        const SHOWN: usize = 40;
        let mut table = String::new();
        for signal in self.differing().take(SHOWN) {
            let Signal { task, service, name, compared, different, first, largest } = signal;
            let cycle = first.map_or(0, |first| first.cycle);
            let largest = largest.map_or("no number".into(), numbers::format);
            let _ = writeln!(
                table,
                "{task}: {service}.{name}: {different} of {compared} from cycle {cycle}, largest difference \
                 {largest}"
            );
        }
        let others = self.differing().count().saturating_sub(SHOWN);
        if others > 0 {
            let _ = writeln!(table, "and {}", counted(others as u64, "further signal"));
        }
        table
    }
}

/// Two values, with their bits where those tell them apart and the numbers do not.
fn both(recorded: f64, replayed: f64) -> (String, String) {
    let words = (numbers::format(recorded), numbers::format(replayed));
    if words.0 != words.1 {
        return words;
    }
    let bits = |word: &str, value: f64| format!("{word} (0x{:016x})", value.to_bits());
    (bits(&words.0, recorded), bits(&words.1, replayed))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHEN: When = When { cycle: 3, release_ns: 30 };

    fn differs(tolerance: Tolerance, recorded: f64, replayed: f64) -> bool {
        let mut comparison = Comparison::new(tolerance);
        let signal = comparison.signal("fast", "out", "y");
        comparison.compare(signal, WHEN, recorded, replayed);
        comparison.different == 1
    }

    #[test]
    fn without_a_tolerance_the_bits_decide() {
        let other_nan = f64::from_bits(f64::NAN.to_bits() ^ 1);
        for (recorded, replayed, expected) in [
            (1.0, 1.0, false),
            (0.0, -0.0, true),
            (f64::NAN, f64::NAN, false),
            (f64::NAN, other_nan, true),
            (1.0, 1.0 + f64::EPSILON, true),
        ] {
            assert_eq!(differs(Tolerance::Bits, recorded, replayed), expected, "{recorded}");
        }
    }

    #[test]
    fn a_tolerance_is_the_largest_difference_that_is_none() {
        let (tolerance, infinite) = (Tolerance::Absolute(0.5), f64::INFINITY);
        for (recorded, replayed, expected) in [
            (1.0, 1.5, false),
            (1.0, 1.75, true),
            (f64::NAN, -f64::NAN, false),
            (f64::NAN, 1.0, true),
            (infinite, infinite, false),
            (infinite, -infinite, true),
        ] {
            assert_eq!(differs(tolerance, recorded, replayed), expected, "{recorded} {replayed}");
        }
    }

    #[test]
    fn the_first_difference_is_the_earliest_and_shows_bits_that_numbers_hide() {
        let mut comparison = Comparison::new(Tolerance::Bits);
        let (a, b) = (comparison.signal("t", "out", "a"), comparison.signal("t", "out", "b"));
        comparison.compare(a, When { cycle: 9, release_ns: 90 }, 1.0, 2.0);
        comparison.compare(b, WHEN, f64::NAN, f64::from_bits(f64::NAN.to_bits() ^ 1));
        let first = comparison.first().unwrap().to_string();
        assert!(
            first.contains("cycle 3 of task \"t\": \"b\" of \"out\" was NaN (0x7ff8"),
            "{first}"
        );
        assert_eq!((comparison.compared, comparison.different), (2, 2));
    }
}
