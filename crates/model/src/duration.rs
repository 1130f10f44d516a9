//! Durations as people write them: `50us`, `2.5ms`, `1h`, `T#100ms`.

use isochrone_blocks::literal::{AmountError, UNITS, amount_ns, parse_time_ns};

/// Parses a duration, also as a TIME literal such as `T#1s500ms`, into whole nanoseconds. `Err` says what is wrong with it.
pub fn parse_duration_ns(text: &str) -> Result<u64, String> {
    let text = text.trim();
    // Two of them begin an option.
    if text.starts_with('-') && !text.starts_with("--") {
        return Err("a duration cannot be negative".into());
    }
    if text.contains(',') {
        return Err(format!("decimals have a point, not a comma: \"{}\"", text.replace(',', ".")));
    }
    if text.contains('#') {
        return match parse_time_ns(text)? {
            (true, 1..) => Err("a duration cannot be negative".into()),
            (_, duration_ns) => Ok(duration_ns),
        };
    }
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = (&text[..split], text[split..].trim());
    if amount_ns(number, 0) == Err(AmountError::NoNumber) {
        return Err("a duration is a number and a unit, such as \"1ms\"".into());
    }
    let Some(&(_, unit_ns)) = UNITS.iter().find(|(name, _)| *name == unit) else {
        return Err(match unit {
            "" => format!("the unit is missing: \"{number}ms\"?"),
            _ => format!("there is no unit \"{unit}\"; units are ns, us, ms, s, min, h"),
        });
    };
    amount_ns(number, unit_ns).map_err(|error| match error {
        AmountError::NoNumber => "a duration is a number and a unit, such as \"1ms\"".into(),
        AmountError::NotWhole => "a duration is whole nanoseconds".into(),
        AmountError::TooLong => "the duration is too long".into(),
    })
}

/// A duration whose unit is written as some people write it (`200 msec`), as it should be (`200ms`).
pub fn respelled(text: &str) -> Option<String> {
    const SPELLINGS: [(&str, &[&str]); 6] = [
        ("ns", &["nsec", "nanosecond"]),
        ("us", &["usec", "microsecond"]),
        ("ms", &["msec", "milli", "millisecond"]),
        ("s", &["sec", "second"]),
        ("min", &["minute"]),
        ("h", &["hr", "hour"]),
    ];
    let text = text.trim();
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.')?;
    let (number, unit) = text.split_at(split);
    let unit = unit.trim().to_lowercase();
    let singular = unit.strip_suffix('s').unwrap_or(&unit);
    let is_meant = |(known, others): &&(&str, &[&str])| {
        *known == unit || *known == singular || others.contains(&singular)
    };
    let (known, _) = SPELLINGS.iter().find(is_meant)?;
    Some(format!("{number}{known}"))
}

/// Parses a time on a command line into seconds, greater than 0: a number alone is seconds (`10`,
/// `0.5`, `1e3`), one with a unit a duration (`500ms`, `5min`). `Err` says what is wrong with it.
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = match text.trim().parse::<f64>() {
        Ok(seconds) => seconds,
        Err(_) => parse_duration_ns(text).map_err(|why| {
            format!("{why}; give seconds, such as 10 or 0.5, or a time with its unit, such as 500ms or 5min")
        })? as f64
            / 1e9,
    };
    // Not `<=`, as NaN is not a time, either.
    if seconds > 0.0 {
        return Ok(seconds);
    }
    Err("give a time greater than 0, such as 10 or 0.5 (seconds), 500ms or 5min".into())
}

/// Parses a time on a command line into whole nanoseconds: a number alone is milliseconds (`1`,
/// `0.25`), one with a unit a duration (`250us`). `Err` says what is wrong with it.
pub fn parse_milliseconds_ns(text: &str) -> Result<u64, String> {
    let is_number = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    if is_number && !text.is_empty() {
        return parse_duration_ns(&format!("{text}ms"));
    }
    parse_duration_ns(text)
}

/// Writes a duration in the largest unit that keeps it whole.
pub fn format_duration_ns(duration_ns: u64) -> String {
    UNITS
        .iter()
        .rev()
        .filter(|(name, _)| *name != "µs")
        .find(|(_, unit_ns)| duration_ns >= *unit_ns && duration_ns.is_multiple_of(*unit_ns))
        .map_or_else(
            || format!("{duration_ns}ns"),
            |(name, unit_ns)| format!("{}{name}", duration_ns / unit_ns),
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_that_is_written_in_another_way_is_the_one_that_was_meant() {
        for (text, plain) in [
            ("200 msec", "200ms"),
            ("200 milliseconds", "200ms"),
            ("1.5 Seconds", "1.5s"),
            ("3secs", "3s"),
            ("5 mins", "5min"),
            ("20 MS", "20ms"),
            ("2hrs", "2h"),
            ("7 usec", "7us"),
        ] {
            assert_eq!(respelled(text).as_deref(), Some(plain), "{text}");
            assert!(parse_duration_ns(plain).is_ok());
        }
        for text in ["5 parsecs", "200", "", "msec"] {
            let meant = respelled(text);
            assert!(meant.is_none_or(|meant| parse_duration_ns(&meant).is_err()), "{text}");
        }
    }

    #[test]
    fn decimals_are_exact() {
        assert_eq!(parse_duration_ns("50us"), Ok(50_000));
        assert_eq!(parse_duration_ns("2.5ms"), Ok(2_500_000));
        assert_eq!(parse_duration_ns("0.001us"), Ok(1));
        assert_eq!(parse_duration_ns("1h"), Ok(3_600_000_000_000));
        assert_eq!(parse_duration_ns("1.10 s"), Ok(1_100_000_000));
    }

    #[test]
    fn a_time_literal_is_a_duration() {
        assert_eq!(parse_duration_ns("T#100ms"), Ok(100_000_000));
        assert_eq!(parse_duration_ns("time#1s_500ms"), Ok(1_500_000_000));
        assert_eq!(parse_duration_ns("T#1m"), Ok(60_000_000_000));
        assert_eq!(parse_duration_ns("t#250us"), Ok(250_000));
    }

    #[test]
    fn what_is_no_duration_is_refused_with_the_reason() {
        for (text, reason) in [
            ("-1ms", "negative"),
            ("1", "unit is missing"),
            ("1,5ms", "a point, not a comma: \"1.5ms\""),
            ("1 parsec", "no unit \"parsec\""),
            ("1e3us", "no unit"),
            ("T#-2ms", "negative"),
            ("T#0,5s", "a point, not a comma: \"T#0.5s\""),
            ("S5T#2s", "T# or TIME#, not S5T#"),
            ("ms", "a number and a unit"),
            ("1.ms", "a number and a unit"),
            ("1.2.3ms", "a number and a unit"),
            ("", "a number and a unit"),
            ("0.5ns", "whole nanoseconds"),
            ("99999999999999999999s", "too long"),
            ("99999999999h", "too long"),
        ] {
            let error = parse_duration_ns(text).unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }

    #[test]
    fn a_number_alone_counts_in_the_unit_of_its_flag_and_a_unit_always_counts() {
        let seconds = [("10", 10.0), ("0.5", 0.5), ("1e3", 1e3), ("500ms", 0.5), ("1s", 1.0)];
        for (text, expected) in seconds.into_iter().chain([("5min", 300.0), ("250us", 2.5e-4)]) {
            assert_eq!(parse_seconds(text), Ok(expected), "{text}");
        }
        for (text, expected_ns) in
            [("1", 1_000_000), ("0.25", 250_000), ("250us", 250_000), ("1s", 1_000_000_000)]
        {
            assert_eq!(parse_milliseconds_ns(text), Ok(expected_ns), "{text}");
        }
    }

    #[test]
    fn what_is_no_time_on_a_command_line_is_refused_with_what_would_be() {
        for (text, reason) in [
            ("0", "greater than 0"),
            ("0ms", "greater than 0"),
            ("-1", "greater than 0"),
            ("nan", "greater than 0"),
            ("-1s", "negative"),
            ("ten", "500ms"),
            ("", "500ms"),
            ("1,5ms", "a point, not a comma: \"1.5ms\""),
            ("1 parsec", "no unit \"parsec\""),
        ] {
            let error = parse_seconds(text).unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
        for (text, reason) in [("", "a number and a unit"), ("-1", "negative"), ("1.", "number")] {
            let error = parse_milliseconds_ns(text).unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }

    #[test]
    fn formatting_reads_back() {
        for duration_ns in
            [0, 1, 999, 1_000, 2_500_000, 1_000_000_000, 60_000_000_000, 90_000_000_000]
        {
            assert_eq!(parse_duration_ns(&format_duration_ns(duration_ns)), Ok(duration_ns));
        }
    }
}
