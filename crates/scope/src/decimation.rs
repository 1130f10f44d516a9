//! Signals over a time of unknown length, in bounded memory.

use crate::{Column, Extremes, Span};

/// Most buckets. When they are full, each two become one.
const MOST: usize = 4_096;

/// The least and the greatest value of each of some signals in buckets of equally many rows, which are due at equal
/// distances. However many rows there are, it stays as large as the buckets of its signals.
#[derive(Debug, Clone, PartialEq)]
pub struct Decimation {
    signals: usize,
    first_ns: u64,
    period_ns: u64,
    rows: u64,
    rows_per_bucket: u64,
    /// Bucket by bucket, a column of each signal.
    buckets: Vec<Column>,
}

impl Decimation {
    /// Of this many signals, without rows: when the first row is due, and the time between two, in ns.
    pub fn new(signals: usize, first_ns: u64, period_ns: u64) -> Self {
        let (rows, rows_per_bucket, buckets) = (0, 1, Vec::new());
        Self { signals, first_ns, period_ns, rows, rows_per_bucket, buckets }
    }

    /// When a row is due, in ns; that of the number of rows is the end.
    pub fn due_ns(&self, row: u64) -> u64 {
        self.first_ns.saturating_add(row.saturating_mul(self.period_ns))
    }

    /// Time between two rows, in ns.
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// Number of rows.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Rows of each bucket; the last one may have fewer.
    pub fn rows_per_bucket(&self) -> u64 {
        self.rows_per_bucket
    }

    /// Adds a row: a value of each signal.
    pub fn push(&mut self, row: &[f64]) {
        if self.signals == 0 {
            self.rows += 1;
            return;
        }
        if self.rows.is_multiple_of(self.rows_per_bucket) {
            if self.buckets.len() >= MOST * self.signals {
                self.halve();
            }
            let len = self.buckets.len() + self.signals;
            self.buckets.resize(len, Column::default());
        }
        let last = self.buckets.len().saturating_sub(self.signals);
        for (column, value) in self.buckets.iter_mut().skip(last).zip(row) {
            if value.is_finite() {
                column.values = Some(Extremes::with(column.values, *value));
            } else {
                column.is_odd = true;
            }
        }
        self.rows += 1;
    }

    /// The buckets of a signal, in the order of time.
    pub fn buckets(&self, signal: usize) -> impl ExactSizeIterator<Item = Column> {
        self.buckets.iter().skip(signal).step_by(self.signals.max(1)).copied()
    }

    /// What each column of a chart shows of a signal. A value holds until the next row.
    pub fn columns(&self, signal: usize, span: Span) -> Vec<Column> {
        let mut columns = vec![Column::default(); span.columns];
        let length_ns = span.end_ns.saturating_sub(span.begin_ns).max(1);
        // The edge from one bucket to the next belongs to the next one's column.
        let column_of = |at_ns: u64| {
            let after_ns = at_ns.saturating_sub(span.begin_ns).min(length_ns);
            (u128::from(after_ns) * span.columns as u128 / u128::from(length_ns)) as usize
        };
        let begins = (0..).map(|index: u64| index.saturating_mul(self.rows_per_bucket));
        for (bucket, begin) in self.buckets(signal).zip(begins) {
            let end = begin.saturating_add(self.rows_per_bucket).min(self.rows);
            let (begin_ns, end_ns) = (self.due_ns(begin), self.due_ns(end));
            if end_ns <= span.begin_ns || begin_ns >= span.end_ns {
                continue;
            }
            let (first, next) = (column_of(begin_ns), column_of(end_ns));
            for column in columns.iter_mut().take(next.max(first + 1)).skip(first) {
                column.join(bucket);
            }
        }
        columns
    }

    fn halve(&mut self) {
        let signals = self.signals;
        for bucket in 0..self.buckets.len() / signals {
            for signal in 0..signals {
                let Some(from) = self.buckets.get(bucket * signals + signal).copied() else {
                    return;
                };
                let Some(into) = self.buckets.get_mut(bucket / 2 * signals + signal) else {
                    return;
                };
                if bucket % 2 == 0 { *into = from } else { into.join(from) }
            }
        }
        self.buckets.truncate(MOST / 2 * signals);
        self.rows_per_bucket *= 2;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// All rows, in a chart of so many columns.
    fn all(decimation: &Decimation, columns: usize) -> Span {
        let (begin_ns, end_ns) = (decimation.due_ns(0), decimation.due_ns(decimation.rows()));
        Span { begin_ns, end_ns, columns }
    }

    #[test]
    fn memory_stays_and_a_spike_of_one_row_is_kept_however_many_there_are() {
        let mut decimation = Decimation::new(2, 500, 1_000);
        for row in 0..1_000_000 {
            let spike = if row == 654_321 { 9.0 } else { 0.5 };
            decimation.push(&[spike, if row == 77 { f64::NAN } else { -1.0 }]);
        }
        assert_eq!((decimation.rows(), decimation.rows_per_bucket()), (1_000_000, 256));
        assert!(decimation.buckets.len() <= 2 * MOST);
        for width in [1, 7, 800] {
            let columns = decimation.columns(0, all(&decimation, width));
            let high = columns.iter().position(|column| column.values.unwrap().high == 9.0);
            let expected = 654_321 * width / 1_000_000;
            assert!(high.unwrap().abs_diff(expected) <= 1, "{width}: {high:?}");
            let odd = decimation.columns(1, all(&decimation, width));
            assert_eq!(odd.iter().filter(|it| it.is_odd).count(), 1);
        }
    }

    #[test]
    fn a_value_holds_over_the_columns_of_its_row() {
        let mut decimation = Decimation::new(1, 0, 333);
        [1.0, f64::INFINITY, 3.0].iter().for_each(|value| decimation.push(&[*value]));
        let columns = decimation.columns(0, all(&decimation, 6));
        let low: Vec<_> = columns.iter().map(|it| it.values.map(|it| it.low)).collect();
        assert_eq!(low, [Some(1.0), Some(1.0), None, None, Some(3.0), Some(3.0)]);
        assert_eq!(columns.iter().map(|it| it.is_odd).filter(|odd| *odd).count(), 2);
    }

    #[test]
    fn rows_of_two_rates_stand_at_their_times_and_what_lies_outside_is_left_out() {
        let (mut fast, mut slow) = (Decimation::new(1, 0, 10), Decimation::new(1, 5, 40));
        (0..10).for_each(|row| fast.push(&[f64::from(row)]));
        (0..3).for_each(|row| slow.push(&[f64::from(row)]));
        let span = Span { begin_ns: 20, end_ns: 120, columns: 10 };
        let low = |decimation: &Decimation| -> Vec<Option<f64>> {
            let columns = decimation.columns(0, span);
            columns.iter().map(|it| it.values.map(|it| it.low)).collect()
        };
        let expected: Vec<_> = (2..10).map(|row| Some(f64::from(row))).chain([None; 2]).collect();
        assert_eq!(low(&fast), expected);
        let expected = [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0].map(Some);
        assert_eq!(low(&slow), expected);
    }

    proptest! {
        #[test]
        fn every_column_has_the_least_and_the_greatest_of_its_rows(
            values in prop::collection::vec(-1e3..1e3, 1..6_000), width in 1usize..300,
        ) {
            let mut decimation = Decimation::new(1, 0, 333);
            values.iter().for_each(|value| decimation.push(&[*value]));
            let columns = decimation.columns(0, all(&decimation, width));
            prop_assert!(columns.iter().all(|it| it.values.is_some()));
            let per = decimation.rows_per_bucket() as usize;
            for (index, value) in values.iter().enumerate() {
                let column = index / per * per * width / values.len();
                let Extremes { low, high } = columns[column].values.unwrap();
                prop_assert!((low..=high).contains(value), "row {index}, column {column}");
            }
            let of = |it: &mut dyn Iterator<Item = Extremes>| Extremes::of(it);
            prop_assert_eq!(
                of(&mut columns.iter().filter_map(|it| it.values)),
                of(&mut values.iter().map(|v| Extremes { low: *v, high: *v }))
            );
        }
    }
}
