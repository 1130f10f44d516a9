//! Where the parts of a text stand in the file, in which characters may be escaped.

use toml::Spanned;

/// The place in the file of each byte of a text's value, and of what stands behind it.
pub(super) fn places(file: &str, text: &Spanned<String>) -> Vec<usize> {
    let span = text.span();
    let written = file.get(span.clone()).unwrap_or_default();
    let quotes =
        ["\"\"\"", "'''", "\"", "'"].into_iter().find(|quotes| written.starts_with(quotes));
    let quotes = quotes.unwrap_or_default();
    let mut rest = written.get(quotes.len()..).unwrap_or_default();
    if quotes.len() == 3 {
        // TOML leaves out the line break behind them.
        rest = rest.strip_prefix("\r\n").or_else(|| rest.strip_prefix('\n')).unwrap_or(rest);
    }
    let mut places = Vec::new();
    for c in text.get_ref().chars() {
        let is_basic = quotes.starts_with('"');
        // A line that is continued: what is blank behind the backslash is not of the text.
        while let Some(behind) = rest.strip_prefix('\\').filter(|_| is_basic && quotes.len() == 3)
            && behind.starts_with(|c: char| c.is_ascii_whitespace())
        {
            rest = behind.trim_start();
        }
        let is_escaped = is_basic && rest.starts_with('\\');
        let len = match rest.as_bytes().get(1) {
            Some(b'u') if is_escaped => 6,
            Some(b'U') if is_escaped => 10,
            Some(b'x') if is_escaped => 4,
            _ if is_escaped => 2,
            _ if c == '\n' && rest.starts_with("\r\n") => 2,
            _ => c.len_utf8(),
        };
        places.extend(std::iter::repeat_n(span.end - rest.len(), c.len_utf8()));
        rest = rest.get(len..).unwrap_or_default();
    }
    places.push(span.end - quotes.len());
    places
}

#[cfg(test)]
mod tests {
    use toml::de::DeTable;

    use super::*;

    /// What stands in the file where a part of the value does.
    fn written<'a>(file: &'a str, part: &str) -> &'a str {
        let table = DeTable::parse(file).unwrap();
        let value = table.get_ref().get("x").unwrap();
        let text = Spanned::new(value.span(), value.get_ref().as_str().unwrap().to_owned());
        let places = places(file, &text);
        let start = text.get_ref().find(part).unwrap();
        &file[places[start]..places[start + part.len()]]
    }

    #[test]
    fn a_part_of_a_text_is_found_behind_escapes_and_line_breaks() {
        assert_eq!(written("x = 'a > bc'", "bc"), "bc");
        assert_eq!(written(r#"x = "\"p-1.y\" > \u0062c + d""#, "\"p-1.y\""), r#"\"p-1.y\""#);
        assert_eq!(written(r#"x = "\"p-1.y\" > \u0062c + d""#, "bc"), r"\u0062c");
        assert_eq!(written(r#"x = "\"p-1.y\" > \u0062c + d""#, "d"), "d");
        assert_eq!(written("x = \"\"\"\r\nab\r\n  + bc\"\"\"", "bc"), "bc");
        assert_eq!(written("x = \"\"\"\nab \\\n   + bc \\\n\n  - ef\"\"\"", "ef"), "ef");
        assert_eq!(written("x = '''\nab\n\\ bc'''", "bc"), "bc");
    }
}
