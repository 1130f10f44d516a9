//! How the columns of a CSV file are headed.

use std::borrow::Cow;

/// The column of times in seconds.
pub(crate) const TIME: &str = "time_s";
/// The column of cycles.
pub(crate) const CYCLE: &str = "cycle";
/// The column of cycles that were missed before a row.
pub(crate) const MISSED: &str = "missed_cycles";

/// Whether a column of this name has no values of signals.
pub(crate) fn is_reserved(name: &str) -> bool {
    [TIME, CYCLE].contains(&name)
}

/// The header of a column: `level [m]`, or the name alone. A name that looks like that, or ends with a space that would
/// not be read, has ` []` behind it where it has no unit, and a unit that would be read as a part of the name is left out.
pub(crate) fn with_unit<'a>(name: Cow<'a, str>, unit: &str) -> Cow<'a, str> {
    let unit = if unit.contains(" [") { "" } else { unit };
    let is_plain = unit.is_empty() && name_and_unit(&name).0 == name.trim_end();
    if is_plain { name } else { format!("{name} [{unit}]").into() }
}

/// The name and the unit of such a header; the unit is empty if it has none.
pub(crate) fn name_and_unit(header: &str) -> (&str, &str) {
    let parts = header.strip_suffix(']').and_then(|header| header.rsplit_once(" ["));
    parts.filter(|(name, _)| !name.is_empty()).unwrap_or((header, ""))
}

/// A name as a field of a CSV file.
pub(crate) fn field(name: &str) -> Cow<'_, str> {
    if name.contains([',', '"', '\n', '\r']) || name.trim() != name {
        return format!("\"{}\"", name.replace('"', "\"\"")).into();
    }
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_reads_back_as_name_and_unit() {
        for (name, unit, header) in [
            ("level.y", "m", "level.y [m]"),
            ("level.y", "", "level.y"),
            ("a", "[x]", "a [[x]]"),
            ("a [m]", "", "a [m] []"),
            ("a [m]", "cm", "a [m] [cm]"),
            ("a []", "", "a [] []"),
            (" [m]", "", " [m]"),
            ("a ", "", "a  []"),
        ] {
            assert_eq!(with_unit(name.into(), unit), header);
            assert_eq!(name_and_unit(header), (name, unit));
        }
        assert_eq!(with_unit("a".into(), "m [x]"), "a");
        assert_eq!(name_and_unit("a[0]"), ("a[0]", ""));
    }

    #[test]
    fn a_name_stays_one_field_of_a_csv_file() {
        assert_eq!(field("level.y"), "level.y");
        assert_eq!(field("a,b"), "\"a,b\"");
        assert_eq!(field("a\"b"), "\"a\"\"b\"");
    }
}
