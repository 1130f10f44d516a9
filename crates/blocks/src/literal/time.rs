//! TIME literals as PLC programmers write them: `100ms`, `T#1m30s`, `TIME#-1.5s`.

use alloc::format;
use alloc::string::{String, ToString};

use super::amount::{AmountError, UNITS, amount_ns};

/// Units beside those of durations: IEC 61131-3 has days, and minutes are `m`.
const MORE_UNITS: [(&str, u64); 2] = [("d", 86_400_000_000_000), ("m", 60_000_000_000)];
const MILLISECOND_NS: u64 = 1_000_000;

/// Parses a TIME constant, with or without `T#`, into milliseconds. `Err` says what is wrong.
pub fn parse_time_ms(text: &str) -> Result<i32, String> {
    let (is_negative, total_ns) = parse_time_ns(text)?;
    if !total_ns.is_multiple_of(MILLISECOND_NS) {
        return Err("there are fractions of a millisecond".into());
    }
    let ms = i128::from(total_ns / MILLISECOND_NS) * if is_negative { -1 } else { 1 };
    i32::try_from(ms).map_err(|_| "TIME holds -2147483648 to 2147483647 ms".into())
}

/// Parses a time, with or without `T#`: whether it is negative, and its nanoseconds.
pub fn parse_time_ns(text: &str) -> Result<(bool, u64), String> {
    let written = text.trim();
    let text = written.to_lowercase();
    let body = match text.split_once('#') {
        None => &*text,
        Some(("t" | "time", body)) => body,
        Some((prefix, _)) => {
            return Err(format!("a TIME begins with T# or TIME#, not {}#", prefix.to_uppercase()));
        }
    };
    let (is_negative, body) = match body.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, body.strip_prefix('+').unwrap_or(body)),
    };
    if body.starts_with('_') || body.ends_with('_') || body.contains("__") {
        return Err("an underscore stands alone and between two characters".into());
    }
    if body.contains(',') {
        return Err(format!(
            "decimals have a point, not a comma: \"{}\"",
            written.replace(',', ".")
        ));
    }
    Ok((is_negative, sum_ns(&body.replace('_', ""))?))
}

/// The sum of parts such as `1m` and `30s`, from long to short.
fn sum_ns(text: &str) -> Result<u64, String> {
    let mut total_ns = 0u64;
    let mut last: Option<(&str, &str, u64)> = None;
    let mut rest = text;
    while !rest.is_empty() || last.is_none() {
        let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        let (number, tail) = rest.split_at(end);
        let tail = tail.trim_start();
        let end = tail.find(|c: char| !c.is_alphabetic()).unwrap_or(tail.len());
        let (unit, tail) = tail.split_at(end);
        rest = tail.trim_start();
        let Some(&(_, unit_ns)) = MORE_UNITS.iter().chain(&UNITS).find(|(name, _)| *name == unit)
        else {
            return Err(match (number, unit) {
                ("", _) => "a number and a unit are missing".into(),
                (_, "") => format!("the unit is missing: \"{number}ms\"?"),
                _ => format!("there is no unit \"{unit}\"; units are d, h, m, s, ms"),
            });
        };
        if let Some((number, unit, longer_ns)) = last {
            if longer_ns <= unit_ns {
                return Err("each unit stands once, the longer before the shorter".into());
            }
            if number.contains('.') {
                return Err(format!("only the last number has decimals, not {number}{unit}"));
            }
        }
        let too_long = || "TIME holds -2147483648 to 2147483647 ms".to_string();
        let part_ns = amount_ns(number, unit_ns).map_err(|error| match error {
            AmountError::NoNumber if number.is_empty() => {
                format!("the number of {unit} is missing")
            }
            AmountError::NoNumber => format!("\"{number}\" is no number"),
            AmountError::NotWhole => "there are fractions of a millisecond".into(),
            AmountError::TooLong => too_long(),
        })?;
        total_ns = total_ns.checked_add(part_ns).ok_or_else(too_long)?;
        last = Some((number, unit, unit_ns));
    }
    Ok(total_ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_plc_programmers_write_is_read_exactly() {
        for (text, ms) in [
            ("100ms", 100),
            ("T#100ms", 100),
            ("t#100MS", 100),
            ("TIME#100ms", 100),
            ("Time#1s500ms", 1_500),
            ("T#1s_500ms", 1_500),
            ("T#-100ms", -100),
            ("T#+100ms", 100),
            ("-1.5s", -1_500),
            ("T#1.5s", 1_500),
            ("T#1m30s", 90_000),
            ("T#1min", 60_000),
            ("T#14h_12m", 51_120_000),
            ("T#5d14h12m18s3ms", 483_138_003),
            ("T#90s", 90_000),
            ("T#1_000ms", 1_000),
            ("1 s", 1_000),
            ("2000us", 2),
            ("T#0s", 0),
            ("T#24d20h31m23s647ms", i32::MAX),
            ("T#-24d_20h_31m_23s_648ms", i32::MIN),
        ] {
            assert_eq!(parse_time_ms(text), Ok(ms), "{text}");
        }
    }

    #[test]
    fn what_is_no_time_is_refused_with_the_reason() {
        for (text, reason) in [
            ("100", "the unit is missing: \"100ms\"?"),
            ("T#100", "the unit is missing"),
            ("T#", "a number and a unit are missing"),
            ("T#ms", "the number of ms is missing"),
            ("T#-", "a number and a unit"),
            ("", "a number and a unit"),
            ("T#1 parsec", "no unit \"parsec\""),
            ("T#1,5s", "a point, not a comma: \"T#1.5s\""),
            ("T#0.5ms", "fractions of a millisecond"),
            ("T#1us", "fractions of a millisecond"),
            ("T#0.0000000001s", "fractions of a millisecond"),
            ("T#500ms1s", "the longer before the shorter"),
            ("T#1s1s", "each unit stands once"),
            ("T#1.5s100ms", "only the last number has decimals, not 1.5s"),
            ("T#1.ms", "\"1.\" is no number"),
            ("T#1.2.3ms", "is no number"),
            (".5s", "is no number"),
            ("T#_100ms", "underscore"),
            ("T#1__0ms", "underscore"),
            ("T#--1ms", "a number and a unit are missing"),
            ("S5T#1s", "T# or TIME#, not S5T#"),
            ("LTIME#1s", "not LTIME#"),
            ("T#24d20h31m23s648ms", "TIME holds"),
            ("T#999999999999999999999s", "TIME holds"),
        ] {
            let error = parse_time_ms(text).unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }
}
