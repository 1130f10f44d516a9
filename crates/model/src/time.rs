//! TIME constants as PLC programmers write them: `100ms`, `T#1m30s`, `TIME#-1.5s`.

use isochrone_blocks::literal::parse_time_ms;

/// How a TIME constant is written.
pub const TIME_FORMS: &str = "a TIME is whole milliseconds: 100, \"100ms\" or \"T#100ms\"";

/// Whether a text is a TIME constant, right or wrong. The name of an input or block neither begins
/// with a digit, sign or point nor contains a `#`.
pub fn is_time(text: &str) -> bool {
    text.contains('#')
        || text.trim_start().starts_with(|c: char| matches!(c, '0'..='9' | '+' | '-' | '.'))
}

/// What to write for `key` instead of a text that is not a TIME: a suggested time, or the possible forms.
pub fn time_help(key: &str, written: &str) -> String {
    let plain = written.trim().replace(',', ".");
    match [plain.clone(), plain + "ms"].into_iter().find(|plain| parse_time_ms(plain).is_ok()) {
        Some(plain) => format!("write {key} = \"{plain}\""),
        None => TIME_FORMS.into(),
    }
}

/// A TIME in milliseconds, as PLC programmers write it: `T#1s500ms`.
pub fn format_time_ms(ms: i64) -> String {
    const PARTS: [(&str, u64); 5] =
        [("d", 86_400_000), ("h", 3_600_000), ("m", 60_000), ("s", 1_000), ("ms", 1)];
    let mut rest = ms.unsigned_abs();
    let mut text = String::from(if ms < 0 { "T#-" } else { "T#" });
    for (unit, unit_ms) in PARTS {
        let amount = rest / unit_ms;
        rest %= unit_ms;
        if amount > 0 || (ms == 0 && unit == "ms") {
            text += &format!("{amount}{unit}");
        }
    }
    text
}

/// Another TIME in the notation of a text: with or without its prefix. `None`: the text is not a TIME.
pub fn in_form_of(written: &str, ms: i64) -> Option<String> {
    parse_time_ms(written).ok()?;
    let time = format_time_ms(ms);
    let amounts = time.strip_prefix("T#")?;
    let prefix = written.trim().split_once('#').map_or(String::new(), |(it, _)| format!("{it}#"));
    Some(format!("{prefix}{amounts}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_in_a_time_is_answered_with_the_time_that_was_meant() {
        for (text, help) in [
            ("T#0,5s", "write timeRange = \"T#0.5s\""),
            ("100", "write timeRange = \"100ms\""),
            ("T#100", "write timeRange = \"T#100ms\""),
            ("T#0.5ms", TIME_FORMS),
            ("S5T#1s", TIME_FORMS),
        ] {
            assert!(parse_time_ms(text).is_err());
            assert_eq!(time_help("timeRange", text), help, "{text}");
        }
    }

    #[test]
    fn another_time_keeps_the_notation_and_reads_back() {
        for (written, ms, expected) in [
            ("T#100ms", 500, "T#500ms"),
            ("t#100MS", 1_500, "t#1s500ms"),
            ("TIME#1s", -90_061_001, "TIME#-1d1h1m1s1ms"),
            ("100ms", 90_000, "1m30s"),
            ("1.5s", 0, "0ms"),
        ] {
            assert_eq!(in_form_of(written, ms).as_deref(), Some(expected));
            assert_eq!(parse_time_ms(expected).map(i64::from), Ok(ms));
        }
        assert_eq!(in_form_of("fast", 5), None);
    }

    #[test]
    fn names_and_wires_are_no_time() {
        for text in ["raw", "time", "t", "_1ms", "ramp.0.delayedValue@prev", "T100ms", ""] {
            assert!(!is_time(text), "{text}");
        }
    }
}
