//! Numbers as people write them: with a base (`16#8F00`, `2#1010_0000`, `-8#17`), a comma or a unit.

use isochrone_blocks::literal::parse_based;

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
