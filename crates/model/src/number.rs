//! Numbers as people write them: with a base (`16#8F00`, `2#1010_0000`, `-8#17`), a comma or a unit.

/// A whole number and the base that it is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Based {
    /// 2, 8 or 16.
    pub base: u32,
    /// The number.
    pub number: i64,
}

/// Reads a number such as `16#8F00`; `None` for a text that does not begin with a base and `#`.
/// `Some(Err)` says what is wrong with what follows.
pub fn parse_based(text: &str) -> Option<Result<Based, String>> {
    let text = text.trim();
    let (sign, unsigned) = match text.strip_prefix('-') {
        Some(unsigned) => ("-", unsigned),
        None => ("", text.strip_prefix('+').unwrap_or(text)),
    };
    let (prefix, digits) = unsigned.split_once('#')?;
    let (base, example) = match prefix {
        "2" => (2, "2#1010_0000"),
        "8" => (8, "8#17"),
        "16" => (16, "16#8F00"),
        _ => return None,
    };
    let is_digit = |c: char| c.is_digit(base) || c == '_';
    let has_blank_place = digits.starts_with('_') || digits.ends_with('_') || digits.contains("__");
    if digits.is_empty() || !digits.chars().all(is_digit) || has_blank_place {
        return Some(Err(format!("after {prefix}# come digits of base {base}, such as {example}")));
    }
    let digits = format!("{sign}{}", digits.replace('_', ""));
    let number = i64::from_str_radix(&digits, base);
    Some(number.map(|number| Based { base, number }).map_err(|_| format!("{text} is too large")))
}

/// Another number in the notation of one that [`parse_based`] reads: with its base, and at least as many
/// digits.
pub fn in_base_of(written: &str, number: i64) -> Option<String> {
    let base = parse_based(written)?.ok()?.base;
    let width = written.split_once('#')?.1.chars().filter(|c| *c != '_').count();
    let sign = if number < 0 { "-" } else { "" };
    let number = number.unsigned_abs();
    Some(match base {
        2 => format!("{sign}2#{number:0width$b}"),
        8 => format!("{sign}8#{number:0width$o}"),
        _ => format!("{sign}16#{number:0width$X}"),
    })
}

/// The number of a text that has a decimal comma or something behind it, as it is written alone: `0.5` for
/// `0,5`, `10` for `10 m/s`. `None` where two separators, as in `1,000.5`, leave more than one number that may be meant.
pub fn plain_number(text: &str) -> Option<String> {
    // The part before the # of a base is not the number.
    let plain = Some(text.trim()).filter(|text| !text.contains('#'))?.replace(',', ".");
    // inf and nan are words, so letters after them make another word.
    let begins = plain.trim_start_matches(['+', '-']).starts_with(|c: char| c.is_ascii_digit());
    let mut ends = (1..=plain.len()).rev().filter(|_| begins);
    let (number, behind) = ends.find_map(|end| {
        plain.split_at_checked(end).filter(|(number, _)| number.parse::<f64>().is_ok())
    })?;
    (!behind.starts_with('.')).then(|| number.trim_end_matches('.').to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_plc_programmers_write_is_read_exactly() {
        for (text, base, number) in [
            ("16#64", 16, 100),
            ("16#8f_00", 16, 0x8F00),
            (" 2#1010_0000 ", 2, 160),
            ("8#17", 8, 15),
            ("-16#8000", 16, -32_768),
            ("+16#0A", 16, 10),
        ] {
            assert_eq!(parse_based(text), Some(Ok(Based { base, number })), "{text}");
        }
    }

    #[test]
    fn what_begins_with_a_base_and_goes_on_wrong_is_refused_with_an_example() {
        for (text, said) in [
            ("16#", "digits of base 16, such as 16#8F00"),
            ("16#XY", "digits of base 16"),
            ("16#-64", "digits of base 16"),
            ("16#_64", "digits of base 16"),
            ("16#6__4", "digits of base 16"),
            ("2#12", "digits of base 2, such as 2#1010_0000"),
            ("8#8", "digits of base 8"),
            ("16#8000000000000000", "16#8000000000000000 is too large"),
        ] {
            let error = parse_based(text).unwrap().unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
        for text in ["100", "T#100ms", "10#5", "", "#64", "ramp.y"] {
            assert_eq!(parse_based(text), None, "{text}");
        }
    }

    #[test]
    fn a_number_is_found_without_its_comma_and_unit() {
        for (text, plain) in [
            ("0,0", "0.0"),
            ("10 m/s", "10"),
            ("-1,5e3 mm", "-1.5e3"),
            ("10e", "10"),
            ("5. ", "5"),
            ("100ms", "100"),
            ("1,5 l/min.", "1.5"),
        ] {
            assert_eq!(plain_number(text).as_deref(), Some(plain), "{text}");
        }
        for text in ["", "inf m", "m 5", "-", ",5", "raw", "16#0A", "10#5", "1,000.5", "1.000,5 m"]
        {
            assert_eq!(plain_number(text), None, "{text}");
        }
    }

    #[test]
    fn another_number_keeps_the_notation() {
        for (written, number, expected) in [
            ("16#0064", 200, "16#00C8"),
            ("16#64", 0x8F00, "16#8F00"),
            ("2#1010_0000", 5, "2#00000101"),
            ("8#17", -15, "-8#17"),
        ] {
            assert_eq!(in_base_of(written, number).as_deref(), Some(expected));
        }
        assert_eq!(in_base_of("100", 5), None);
    }
}
