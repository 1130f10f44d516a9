//! The columns of a chart: the least and the greatest value of each, so that a spike of one
//! cycle is seen at any width.

use crate::{Shot, Track};

/// The least and the greatest of some finite values.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "the names say it")]
pub struct Extremes {
    pub low: f64,
    pub high: f64,
}

impl Extremes {
    /// Of those values and one more.
    pub fn with(those: Option<Self>, value: f64) -> Self {
        let Self { low, high } = those.unwrap_or(Self { low: value, high: value });
        Self { low: low.min(value), high: high.max(value) }
    }

    /// Of several; `None` of none.
    pub fn of(several: impl IntoIterator<Item = Self>) -> Option<Self> {
        several.into_iter().fold(None, |all, Self { low, high }| {
            Some(Self::with(Some(Self::with(all, low)), high))
        })
    }

    /// Where a value lies between them: 0 is the least, 1 the greatest. One half where they are the same.
    pub fn part(self, value: f64) -> f64 {
        // Halves: the span between two numbers can be more than a number.
        let span = self.high / 2.0 - self.low / 2.0;
        if span > 0.0 { ((value / 2.0 - self.low / 2.0) / span).clamp(0.0, 1.0) } else { 0.5 }
    }
}

/// One column of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Column {
    /// The values of this time, with the one that was left when it was entered; none in a gap.
    pub values: Option<Extremes>,
    /// There are NaN or infinite values.
    pub is_odd: bool,
    /// There is a time without values.
    pub is_gap: bool,
}

impl Column {
    /// Takes what another column has.
    pub(crate) fn join(&mut self, other: Self) {
        self.values = Extremes::of([self.values, other.values].into_iter().flatten());
        self.is_odd |= other.is_odd;
        self.is_gap |= other.is_gap;
    }
}

/// The time that a chart shows, divided into columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// The first instant, in ns.
    pub begin_ns: u64,
    /// The instant behind the last one.
    pub end_ns: u64,
    /// Number of columns.
    pub columns: usize,
}

impl Span {
    /// All of a shot.
    pub fn of(shot: &Shot, columns: usize) -> Self {
        Self { begin_ns: shot.begin_ns, end_ns: shot.end_ns, columns }
    }

    /// The column of an instant: the first one of what is earlier, the last one of what is later.
    pub fn column(self, at_ns: u64) -> usize {
        let after_ns = u128::from(at_ns.saturating_sub(self.begin_ns));
        let length_ns = u128::from(self.end_ns.saturating_sub(self.begin_ns)).max(1);
        let column = after_ns * self.columns as u128 / length_ns;
        usize::try_from(column).unwrap_or(usize::MAX).min(self.columns.saturating_sub(1))
    }
}

/// What each column shows of one signal of a track. A value holds until the next cycle.
pub fn columns(shot: &Shot, track: &Track, place: usize, span: Span) -> Vec<Column> {
    let mut columns = vec![Column::default(); span.columns];
    let period_ns = track.period_ns.unwrap_or_default();
    let mut rows = track.rows.signal(place).peekable();
    while let Some((head, value)) = rows.next() {
        let is_last = rows.peek().is_none();
        let next = rows.peek().filter(|(head, _)| head.lost == 0);
        let end_ns = match next {
            // It holds until the end of the chart, and beyond.
            _ if is_last && track.next.is_some_and(|head| head.lost == 0) => span.end_ns,
            // The edge from this value to the next one belongs to the next one's column.
            Some((next, after)) if value.is_finite() && after.is_finite() => next.release_ns,
            Some((next, _)) => next.release_ns.saturating_sub(1),
            None => head.release_ns.saturating_add(period_ns.saturating_sub(1)),
        };
        let (first, last) = (span.column(head.release_ns), span.column(end_ns));
        for column in columns.iter_mut().take(last + 1).skip(first) {
            if value.is_finite() {
                column.values = Some(Extremes::with(column.values, value));
            } else {
                column.is_odd = true;
            }
        }
    }
    for gap in shot.gaps(track) {
        let (first, last) = (span.column(gap.begin_ns), span.column(gap.end_ns.saturating_sub(1)));
        columns.iter_mut().take(last + 1).skip(first).for_each(|column| column.is_gap = true);
    }
    columns
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{Head, Rows};

    fn shot(values: &[f64], gap_before: &[usize]) -> Shot {
        let mut rows = Rows::new(1);
        let mut release_ns = 90_000;
        for (cycle, value) in values.iter().enumerate() {
            let lost = if gap_before.contains(&cycle) { 3 } else { 0 };
            release_ns += 10_000 * (1 + lost);
            rows.push(Head { cycle: cycle as u64, release_ns, lost, missed: 0 }, &[*value]);
        }
        let track = Track { period_ns: Some(10_000), rows, ..Track::default() };
        Shot {
            tracks: vec![track],
            begin_ns: 100_000,
            end_ns: release_ns + 10_000,
            ..Shot::default()
        }
    }

    fn drawn(shot: &Shot, count: usize) -> Vec<Column> {
        columns(shot, &shot.tracks[0], 0, Span::of(shot, count))
    }

    fn values(columns: &[Column]) -> Vec<Option<(f64, f64)>> {
        columns.iter().map(|column| column.values.map(|it| (it.low, it.high))).collect()
    }

    #[test]
    fn a_spike_of_one_cycle_is_in_its_column_however_few_there_are() {
        let mut row = vec![0.0; 1_000];
        row[503] = 9.0;
        for count in [1, 7, 80, 999, 1_000, 5_000] {
            let drawn = drawn(&shot(&row, &[]), count);
            let high = drawn.iter().position(|column| column.values.unwrap().high == 9.0);
            assert_eq!(high, Some(503 * count / 1_000), "{count}");
            assert!(drawn.iter().all(|column| !column.is_gap && !column.is_odd));
        }
    }

    #[test]
    fn a_value_holds_until_the_next_cycle_and_the_edge_joins_both() {
        let drawn = drawn(&shot(&[1.0, 2.0], &[]), 6);
        let expected =
            [(1.0, 1.0), (1.0, 1.0), (1.0, 1.0), (1.0, 2.0), (2.0, 2.0), (2.0, 2.0)].map(Some);
        assert_eq!(values(&drawn), expected);
    }

    #[test]
    fn a_gap_is_empty_and_nothing_joins_its_sides() {
        let drawn = drawn(&shot(&[1.0, 2.0], &[1]), 5);
        let expected = [Some((1.0, 1.0)), None, None, None, Some((2.0, 2.0))];
        assert_eq!(values(&drawn), expected);
        let gaps: Vec<bool> = drawn.iter().map(|column| column.is_gap).collect();
        assert_eq!(gaps, [false, true, true, true, false]);
    }

    #[test]
    fn what_is_no_number_has_a_mark_and_no_part_in_the_extremes() {
        let drawn = drawn(&shot(&[1.0, f64::NAN, f64::INFINITY, 2.0], &[]), 4);
        assert_eq!(values(&drawn), [Some((1.0, 1.0)), None, None, Some((2.0, 2.0))]);
        let odd: Vec<bool> = drawn.iter().map(|column| column.is_odd).collect();
        assert_eq!(odd, [false, true, true, false]);
        let all = Extremes::of(drawn.iter().filter_map(|column| column.values)).unwrap();
        assert_eq!((all.part(1.0), all.part(1.5), all.part(9.0)), (0.0, 0.5, 1.0));
        let widest = Extremes { low: -1.7e308, high: 1.7e308 };
        assert_eq!((widest.part(0.0), Extremes { low: 3.0, high: 3.0 }.part(3.0)), (0.5, 0.5));
    }

    proptest! {
        #[test]
        fn the_columns_together_have_the_extremes_of_all_values_and_no_holes(
            values in prop::collection::vec(-1e3..1e3, 1..300),
            count in 1usize..400,
        ) {
            let drawn = drawn(&shot(&values, &[]), count);
            prop_assert_eq!(drawn.len(), count);
            let all = Extremes::of(drawn.iter().map(|column| column.values.unwrap())).unwrap();
            let expected = Extremes::of(values.iter().map(|v| Extremes { low: *v, high: *v }));
            prop_assert_eq!(Some(all), expected);
        }
    }
}
