//! The histogram that `cyclictest --histogram` prints.

use std::fmt::Write as _;

use super::picture::Series;

/// Rows that cyclictest allows.
const MOST_ROWS: u64 = 1_000_000;

/// Writes what `cyclictest --histogram=LIMIT_US` prints, with one column per series: the number of
/// samples in each whole microsecond below the limit (at most a million), then the totals.
/// cyclictest's threads have no names, so comments name the columns. Its lines about overflowed
/// cycles are missing, because a distribution does not contain them.
pub fn cyclictest_histogram(series: &[Series<'_>], limit_us: u64) -> String {
    let limit_us = limit_us.min(MOST_ROWS);
    let columns: Vec<Column> = series.iter().map(|series| Column::new(series, limit_us)).collect();
    let mut text = String::from("# Histogram\n");
    for (index, series) in series.iter().enumerate() {
        let name = series.name.replace(char::is_control, " ");
        let _ = writeln!(text, "# Column {index}: {name}");
    }
    for us in 0..limit_us as usize {
        let counts = columns.iter().map(|column| column.counts.get(us).copied().unwrap_or(0));
        let _ = writeln!(text, "{us:06} {}", joined(counts, 6, "\t"));
    }
    let mut total = |label: &str, width: usize, of: fn(&Column) -> u64| {
        let _ = writeln!(text, "# {label}: {}", joined(columns.iter().map(of), width, " "));
    };
    total("Total", 9, |column| column.total);
    total("Min Latencies", 5, |column| column.min_us);
    total("Avg Latencies", 5, |column| column.avg_us);
    total("Max Latencies", 5, |column| column.max_us);
    total("Histogram Overflows", 5, |column| column.overflows);
    text
}

struct Column {
    counts: Vec<u64>,
    /// Samples below the limit.
    total: u64,
    overflows: u64,
    min_us: u64,
    avg_us: u64,
    max_us: u64,
}

impl Column {
    fn new(series: &Series<'_>, limit_us: u64) -> Self {
        let mut counts = vec![0; limit_us as usize];
        let mut overflows = 0;
        for (ns, count) in series.distribution.buckets() {
            let row = usize::try_from(ns / 1_000).ok().and_then(|us| counts.get_mut(us));
            *row.unwrap_or(&mut overflows) += count;
        }
        let summary = series.distribution.summary();
        let us = |ns: Option<u64>| ns.unwrap_or(0) / 1_000;
        Self {
            total: series.distribution.count() - overflows,
            overflows,
            min_us: us(summary.min),
            avg_us: summary.mean.unwrap_or(0.0) as u64 / 1_000,
            max_us: us(summary.max),
            counts,
        }
    }
}

fn joined(numbers: impl Iterator<Item = u64>, width: usize, separator: &str) -> String {
    let numbers: Vec<String> = numbers.map(|number| format!("{number:0width$}")).collect();
    numbers.join(separator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::of_samples as of;

    #[test]
    fn a_histogram_has_a_row_for_each_microsecond_and_counts_what_lies_beyond() {
        let (a, b) = (of(&[(999, 2), (1_000, 3), (7_000_000, 1)]), of(&[(1_500, 4)]));
        let series = [
            Series { name: "hybrid", distribution: &a },
            Series { name: "two\nlines", distribution: &b },
        ];
        let expected = "# Histogram\n\
            # Column 0: hybrid\n\
            # Column 1: two lines\n\
            000000 000002\t000000\n\
            000001 000003\t000004\n\
            000002 000000\t000000\n\
            # Total: 000000005 000000004\n\
            # Min Latencies: 00000 00001\n\
            # Avg Latencies: 01167 00001\n\
            # Max Latencies: 07000 00001\n\
            # Histogram Overflows: 00001 00000\n";
        assert_eq!(cyclictest_histogram(&series, 3), expected);
    }

    #[test]
    fn a_limit_beyond_cyclictest_s_own_is_cut_to_it() {
        let rows =
            cyclictest_histogram(&[], u64::MAX).lines().filter(|l| !l.starts_with('#')).count();
        assert_eq!(rows as u64, MOST_ROWS);
    }
}
