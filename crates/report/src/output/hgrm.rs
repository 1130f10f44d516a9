//! HdrHistogram's percentile table (`.hgrm`).

use std::fmt::Write as _;

use isochrone_timing::{Distribution, Metric};

/// Rows for each halving of the distance to 100 %, as HdrHistogram's own tools have them.
const TICKS_PER_HALF_DISTANCE: u32 = 5;

/// Writes a distribution as HdrHistogram's percentile table, for its plotters: in us if the metric
/// is in ns, in ns if it is in ps. The first line is a comment with the unit.
pub fn hgrm(distribution: &Distribution, metric: Metric) -> String {
    let unit = metric.unit.of_a_thousand();
    let histogram = distribution.histogram();
    let summary = distribution.summary();
    let max = summary.max.unwrap_or(0);
    let mut text = format!(
        "#[Unit: {unit}]\n{:>12} {:>14} {:>10} {:>14}\n\n",
        "Value", "Percentile", "TotalCount", "1/(1-Percentile)"
    );
    let mut passed = 0;
    for step in histogram.iter_quantiles(TICKS_PER_HALF_DISTANCE) {
        passed += step.count_since_last_iteration();
        let (value, quantile) =
            (thousandth(step.value_iterated_to().min(max)), step.quantile_iterated_to());
        let _ = write!(text, "{value:>12.3} {quantile:>14.12} {passed:>10}");
        // The last row has no distance to 100 % left.
        if quantile < 1.0 {
            let _ = write!(text, " {:>14.2}", 1.0 / (1.0 - quantile));
        }
        text.push('\n');
    }
    // The library keeps half a bucket more than its table has, to reach the lowest values.
    let buckets = usize::from(histogram.buckets());
    let sub_buckets = 2 * histogram.distinct_values() / (buckets + 1);
    let rows = [
        (
            ("Mean", figure(summary.mean.unwrap_or(0.0) / 1e3)),
            ("StdDeviation", figure(histogram.stdev() / 1e3)),
        ),
        (("Max", figure(thousandth(max))), ("Total count", distribution.count().to_string())),
        (("Buckets", buckets.to_string()), ("SubBuckets", sub_buckets.to_string())),
    ];
    for ((left, first), (right, second)) in rows {
        let _ = writeln!(text, "#[{left:<7} = {first:>12}, {right:<14} = {second:>12}]");
    }
    text
}

fn thousandth(value: u64) -> f64 {
    value as f64 / 1e3
}

fn figure(value: f64) -> String {
    format!("{value:.3}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::of_samples as of;

    #[test]
    fn a_table_names_its_unit_and_else_is_that_of_hdr_histogram_letter_by_letter() {
        let expected = "#[Unit: us]
       Value     Percentile TotalCount 1/(1-Percentile)

       1.000 0.000000000000          2           1.00
       1.000 0.100000000000          2           1.11
       1.000 0.200000000000          2           1.25
       1.000 0.300000000000          2           1.43
       1.000 0.400000000000          2           1.67
       1.000 0.500000000000          2           2.00
       1.000 0.550000000000          2           2.22
       1.000 0.600000000000          2           2.50
       1.000 0.650000000000          2           2.86
       2.000 0.700000000000          3           3.33
       2.000 1.000000000000          3
#[Mean    =        1.333, StdDeviation   =        0.471]
#[Max     =        2.000, Total count    =            3]
#[Buckets =           33, SubBuckets     =         2048]
";
        assert_eq!(hgrm(&of(&[(1_000, 2), (2_000, 1)]), Metric::ONE_WAY), expected);
    }

    #[test]
    fn the_table_rises_to_the_maximum_and_counts_all_samples() {
        let text = hgrm(&of(&[(1_000, 900), (50_000, 90), (2_000_001, 10)]), Metric::ONE_WAY);
        let rows: Vec<Vec<f64>> = text
            .lines()
            .filter(|line| line.trim_start().starts_with(|c: char| c.is_ascii_digit()))
            .map(|line| line.split_whitespace().map(|cell| cell.parse().unwrap()).collect())
            .collect();
        assert!(
            rows.windows(2).all(|pair| (0..3).all(|column| pair[0][column] <= pair[1][column]))
        );
        assert_eq!(rows.last().unwrap(), &[2_000.001, 1.0, 1_000.0]);
    }

    #[test]
    fn a_table_of_nothing_has_no_rows_and_counts_zero() {
        let text = hgrm(&Distribution::new(), Metric::ONE_WAY);
        assert!(text.contains("Total count    =            0]"), "{text}");
        assert_eq!(text.lines().count(), 6, "{text}");
    }

    #[test]
    fn what_is_measured_in_picoseconds_is_written_in_nanoseconds_and_says_so() {
        let text = hgrm(&of(&[(6_400, 3)]), Metric::STEP);
        assert!(text.starts_with("#[Unit: ns]\n"), "{text}");
        assert!(text.contains("#[Max     =        6.400,"), "{text}");
    }
}
