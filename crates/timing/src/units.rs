//! Formatting numbers: three significant digits and a unit.

use std::fmt::Display;

/// Formats a time in ns: `98 ns`, `2.10 us`, `52.0 us`, `231 ms` or `1.50 s`; from 1000 s on whole seconds.
pub fn duration(ns: f64) -> String {
    // The bound is where rounding to three digits would carry into the next unit.
    if ns < 999.5 {
        format!("{} ns", ns.round())
    } else if ns < 999_500.0 {
        format!("{} us", three_digits(ns / 1e3))
    } else if ns < 999_500_000.0 {
        format!("{} ms", three_digits(ns / 1e6))
    } else {
        format!("{} s", three_digits(ns / 1e9))
    }
}

/// Formats a time in ps with three digits, below a nanosecond as well: `0.412 ns`, `7.31 ns`, `1.20 us`.
pub fn picoseconds(ps: u64) -> String {
    match ps {
        0..999_500 => format!("{} ns", three_digits(ps as f64 / 1e3)),
        _ => duration(ps as f64 / 1e3),
    }
}

/// Formats a number with three significant digits and at most three decimals; from 1000 on as an
/// integer.
pub fn three_digits(value: f64) -> String {
    let decimals = if value < 0.9995 {
        3
    } else if value < 9.995 {
        2
    } else if value < 99.95 {
        1
    } else {
        0
    };
    format!("{value:.decimals$}")
}

/// Formats a period in ns exactly, in the largest unit that needs no fraction below 0.001: `1 ms`, `2.5 ms`.
pub fn period(ns: u64) -> String {
    let (unit, unit_ns) = match ns {
        0..1_000 => ("ns", 1),
        1_000..1_000_000 => ("us", 1_000),
        1_000_000..1_000_000_000 => ("ms", 1_000_000),
        _ => ("s", 1_000_000_000),
    };
    let (whole, rest) = (ns / unit_ns, ns % unit_ns);
    if rest == 0 {
        return format!("{whole} {unit}");
    }
    let width = unit_ns.ilog10() as usize;
    let fraction = format!("{rest:0width$}");
    format!("{whole}.{} {unit}", fraction.trim_end_matches('0'))
}

/// Formats a number of bytes: `214.6 kB`, `1.2 MB`, `3.45 GB`.
pub fn size(bytes: u64) -> String {
    match bytes {
        0..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.2} GB", bytes as f64 / 1e9),
    }
}

/// Formats a count with its noun: `1 cycle`, `2 cycles`.
pub fn counted<N: Copy + Display + PartialEq + From<u8>>(count: N, thing: &str) -> String {
    format!("{count} {thing}{}", if count == N::from(1) { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_has_three_digits_and_the_unit_that_keeps_them_short() {
        for (ns, text) in [
            (0.0, "0 ns"),
            (98.0, "98 ns"),
            (999.0, "999 ns"),
            (999.6, "1.00 us"),
            (2_104.0, "2.10 us"),
            (9_996.0, "10.0 us"),
            (52_000.0, "52.0 us"),
            (99_960.0, "100 us"),
            (231_000.0, "231 us"),
            (999_499.0, "999 us"),
            (999_500.0, "1.00 ms"),
            (1_500_000_000.0, "1.50 s"),
            (3_600_000_000_000.0, "3600 s"),
        ] {
            assert_eq!(duration(ns), text, "{ns} ns");
        }
    }

    #[test]
    fn a_time_in_picoseconds_keeps_three_digits_below_a_nanosecond() {
        for (ps, text) in
            [(0, "0.000 ns"), (412, "0.412 ns"), (7_312, "7.31 ns"), (999_600, "1.00 us")]
        {
            assert_eq!(picoseconds(ps), text);
        }
    }

    #[test]
    fn a_number_has_three_digits() {
        for (value, text) in [(0.5, "0.500"), (0.9996, "1.00"), (20.0, "20.0"), (1234.5, "1234")] {
            assert_eq!(three_digits(value), text);
        }
    }

    #[test]
    fn a_period_is_exact() {
        for (ns, text) in [
            (0, "0 ns"),
            (50_000, "50 us"),
            (1_000_000, "1 ms"),
            (2_500_000, "2.5 ms"),
            (1_000_001, "1.000001 ms"),
            (3_600_000_000_000, "3600 s"),
        ] {
            assert_eq!(period(ns), text);
        }
    }
}
