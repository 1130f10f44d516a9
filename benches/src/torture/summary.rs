//! The table at the end: what was done, what must hold, how often it did not, and how to see that again.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::row::Row;
use super::turn::Turn;

/// Most failures that are shown of a row.
const SHOWN: usize = 5;

/// What all turns came to.
#[derive(Debug, Default)]
pub struct Summary {
    rows: Vec<(Row, RowSummary)>,
}

/// What the turns of a row came to.
#[derive(Debug, Default)]
struct RowSummary {
    turns: u64,
    done: u64,
    wrong: Vec<String>,
    /// Of the first turn that failed.
    seed: Option<u64>,
    untested: BTreeSet<String>,
    most: BTreeMap<&'static str, u64>,
}

impl Summary {
    /// Of these rows.
    pub fn new(rows: &[Row]) -> Self {
        Self { rows: rows.iter().map(|row| (*row, RowSummary::default())).collect() }
    }

    /// Adds a turn with this seed.
    pub fn add(&mut self, row: Row, seed: u64, turn: Turn) {
        let Some((_, of)) = self.rows.iter_mut().find(|(known, _)| *known == row) else { return };
        of.turns += 1;
        of.done += turn.done;
        of.seed = of.seed.or((!turn.wrong.is_empty()).then_some(seed));
        of.wrong.extend(turn.wrong);
        of.untested.extend(turn.untested);
        for (name, value) in turn.measured {
            let most = of.most.entry(name).or_default();
            *most = value.max(*most);
        }
    }

    /// Whether nothing failed.
    pub fn is_well(&self) -> bool {
        self.rows.iter().all(|(_, of)| of.wrong.is_empty())
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:<11} {:>7}  {:<57} {:>6}", "test", "done", "what must hold", "failed")?;
        for (row, of) in &self.rows {
            writeln!(f)?;
            let is_untested = of.done == 0 && !of.untested.is_empty();
            let failed = if is_untested { "NOT TESTED".into() } else { of.wrong.len().to_string() };
            for (at, line) in row.must_hold().iter().enumerate() {
                match at {
                    0 => writeln!(f, "{:<11} {:>7}  {line:<57} {failed:>6}", row.name(), of.done)?,
                    1 => writeln!(f, "{:>13} turns  {line}", of.turns)?,
                    _ => writeln!(f, "{:>19}  {line}", "")?,
                }
            }
            writeln!(f, "  done: {}", row.faults())?;
            for (name, value) in &of.most {
                writeln!(f, "  most {name}: {value}")?;
            }
            for untested in &of.untested {
                writeln!(f, "  NOT TESTED: {untested}")?;
            }
            for wrong in of.wrong.iter().take(SHOWN) {
                writeln!(f, "  FAILED: {wrong}")?;
            }
            if let Some(seed) = of.seed {
                writeln!(f, "  again: torture --only {} --seed {seed} --turns 1", row.name())?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use clap::ValueEnum;

    use super::*;

    #[test]
    fn a_stranger_reads_what_failed_and_how_to_see_it_again() {
        let mut summary = Summary::new(Row::value_variants());
        assert!(summary.is_well());
        summary.add(Row::Stop, 6, Turn { done: 20, ..Turn::default() });
        let wrong = vec!["the term goes back".to_owned()];
        summary.add(Row::Stop, 7, Turn { done: 3, wrong: wrong.clone(), ..Turn::default() });
        summary.add(Row::Stop, 8, Turn { done: 3, wrong, ..Turn::default() });
        let untested = vec!["disk: no namespace".to_owned()];
        summary.add(Row::Exhaustion, 9, Turn { untested, ..Turn::default() });
        let text = summary.to_string();
        assert!(!summary.is_well());
        for part in [
            "stop             26  ",
            " 2\n",
            "again: torture --only stop --seed 7 --turns 1",
            "NOT TESTED: disk",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
    }
}
