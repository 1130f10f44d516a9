//! Whole numbers with a base: `16#8F00`, `2#1010_0000`, `-8#17`.

use alloc::format;
use alloc::string::String;

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
}
