//! `--at` on a command line: before which cycle something happens.

use std::str::FromStr;

use isochrone_control::DescribeParams;

use super::known::Known;
use super::node::Node;
use crate::failure::Failure;

/// A cycle of a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum At {
    /// This one.
    Cycle(u64),
    /// The one that is so many after the one that runs.
    In(u64),
}

impl FromStr for At {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, at): (_, fn(u64) -> Self) = match text.strip_prefix('+') {
            Some(number) => (number, Self::In),
            None => (text, Self::Cycle),
        };
        let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
        match number.parse() {
            Ok(number) if is_number => Ok(at(number)),
            _ => Err("give a cycle, such as 250000, or +500: in 500 cycles".into()),
        }
    }
}

impl At {
    /// The number of the cycle, of the task that all of these signals are of.
    pub(super) fn cycle(self, node: &mut Node, signals: &Known) -> Result<u64, Failure> {
        let ahead = match self {
            Self::Cycle(cycle) => return Ok(cycle),
            Self::In(ahead) => ahead,
        };
        let of = signals.tasks();
        if of.len() > 1 {
            let names: Vec<_> = of.into_iter().collect();
            return Err(Failure::usage(format!(
                "--at +{ahead}: the signals are of several tasks ({}), each of which counts its own \
                 cycles; make one request for each",
                names.join(", ")
            )));
        }
        let tasks = node.call(&DescribeParams {})?.tasks;
        // The node refuses names that it does not know, at whatever cycle.
        let task = tasks.iter().find(|task| of.contains(task.name.as_str())).or(tasks.first());
        Ok(task.map_or(0, |task| task.cycle).saturating_add(ahead))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_is_named_by_its_number_or_counted_from_now() {
        assert_eq!("250000".parse(), Ok(At::Cycle(250_000)));
        assert_eq!("+50".parse(), Ok(At::In(50)));
        for text in ["", "+", "++5", "-5", "5s", "+5s", "1.5"] {
            assert!(text.parse::<At>().unwrap_err().contains("+500"), "{text}");
        }
    }
}
