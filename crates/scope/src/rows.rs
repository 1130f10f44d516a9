//! Rows of values: one for each cycle.

use std::collections::VecDeque;

/// The data of a cycle besides its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Head {
    /// Its number.
    pub cycle: u64,
    /// When it was due, in ns.
    pub release_ns: u64,
    /// How many rows are missing immediately before it.
    pub lost: u64,
    /// How many cycles the task missed immediately before it: the values before held meanwhile.
    pub missed: u64,
}

/// Rows in the order of their cycles, each with the same number of values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    width: usize,
    heads: VecDeque<Head>,
    /// Row by row.
    values: VecDeque<f64>,
}

impl Rows {
    /// No rows yet; each will have this many values.
    pub fn new(width: usize) -> Self {
        Self { width, heads: VecDeque::new(), values: VecDeque::new() }
    }

    /// Appends a row. Values that are too many are left out, those that are missing are NaN.
    pub fn push(&mut self, head: Head, values: &[f64]) {
        self.heads.push_back(head);
        let given = values.iter().copied().chain(std::iter::repeat(f64::NAN));
        self.values.extend(given.take(self.width));
    }

    /// Takes the oldest row away.
    pub fn pop(&mut self) {
        self.heads.pop_front();
        self.values.drain(..self.width.min(self.values.len()));
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// Values in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The oldest row's head.
    pub fn first(&self) -> Option<&Head> {
        self.heads.front()
    }

    /// The newest row's head.
    pub fn last(&self) -> Option<&Head> {
        self.heads.back()
    }

    /// The heads of the rows.
    pub fn heads(&self) -> impl ExactSizeIterator<Item = &Head> {
        self.heads.iter()
    }

    /// The values of one signal, with the head of each row.
    pub fn signal(&self, place: usize) -> impl Iterator<Item = (&Head, f64)> {
        // A place that is none has no values, and none of a row's neighbour.
        let skipped = if place < self.width { place } else { self.values.len() };
        let values = self.values.iter().skip(skipped).step_by(self.width.max(1));
        self.heads.iter().zip(values.copied())
    }

    /// Each row with its values.
    pub fn iter(&self) -> impl Iterator<Item = (&Head, impl Iterator<Item = f64>)> {
        let row = |(index, head)| {
            let first = index * self.width;
            (head, self.values.range(first..first + self.width).copied())
        };
        self.heads.iter().enumerate().map(row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(cycle: u64) -> Head {
        Head { cycle, release_ns: cycle * 10, ..Head::default() }
    }

    #[test]
    fn rows_keep_their_values_together_whatever_is_pushed_and_popped() {
        let mut rows = Rows::new(2);
        for cycle in 0..5 {
            rows.push(head(cycle), &[cycle as f64, -(cycle as f64), 99.0]);
        }
        rows.pop();
        rows.push(head(5), &[5.0]);
        let of: Vec<(u64, f64)> = rows.signal(0).map(|(head, value)| (head.cycle, value)).collect();
        assert_eq!(of, [(1, 1.0), (2, 2.0), (3, 3.0), (4, 4.0), (5, 5.0)]);
        let last =
            rows.iter().last().map(|(head, values)| (head.cycle, values.collect::<Vec<_>>()));
        let (cycle, values) = last.unwrap();
        assert!(cycle == 5 && values[0] == 5.0 && values[1].is_nan(), "{values:?}");
        assert_eq!(rows.signal(2).count(), 0);
        (0..9).for_each(|_| rows.pop());
        assert!(rows.is_empty());
    }

    #[test]
    fn rows_without_values_are_still_cycles() {
        let mut rows = Rows::new(0);
        rows.push(head(3), &[1.0]);
        assert_eq!((rows.len(), rows.iter().count(), rows.signal(0).count()), (1, 1, 0));
    }
}
