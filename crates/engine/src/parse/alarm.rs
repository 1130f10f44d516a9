//! `[[alarm]]`: conditions that people should know of.

use std::ops::Range;

use toml::Spanned;

use super::condition::condition;
use super::section::Section;
use crate::Diagnostic;
use crate::config::{AlarmCondition, AlarmSection};
use crate::diagnostic::Problem;
use crate::keys::alarm as keys;
use isochrone_model::AlarmSeverity;

/// `file` is the text of the whole file.
pub(super) fn alarm(section: Section<'_>, file: &str) -> AlarmSection {
    let text = section.string(&keys::WHEN);
    let when = text.as_ref().and_then(|text| {
        let place = |within: Range<usize>| {
            let at = |offset| place_in_file(file, text, offset);
            at(within.start)..at(within.end)
        };
        condition(text.get_ref(), &place).map_err(|diagnostic| section.report(diagnostic)).ok()
    });
    let hysteresis = section.number(&keys::HYSTERESIS);
    if let (Some(hysteresis), Some(when)) = (&hysteresis, &when) {
        let is_ordering = matches!(when, AlarmCondition::Comparison { relation, .. } if relation.get_ref().is_ordering());
        if !is_ordering && *hysteresis.get_ref() != 0.0 {
            let message = "[[alarm]] hysteresis goes with >, >=, < and <= only";
            let diagnostic = Diagnostic::new(Problem::Conflict, hysteresis.span(), message);
            section.report(diagnostic.help("leave hysteresis out; for gives the alarm a delay"));
        }
    }
    AlarmSection {
        name: section.name(&keys::NAME),
        text_of_when: text.map_or_else(String::new, |text| text.get_ref().trim().to_owned()),
        when,
        delay_ns: section.duration_ns(&keys::FOR).map_or(0, Spanned::into_inner),
        hysteresis: hysteresis.map_or(0.0, Spanned::into_inner),
        severity: section
            .choice(&keys::SEVERITY, &AlarmSeverity::ALL)
            .map_or_else(AlarmSeverity::default, Spanned::into_inner),
        text: section.string(&keys::TEXT).map(Spanned::into_inner),
        task: section.string(&keys::TASK),
    }
}

/// Where a byte of a text's value stands in the file, in which characters may be escaped.
fn place_in_file(file: &str, text: &Spanned<String>, offset: usize) -> usize {
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
    for c in text.get_ref().get(..offset).unwrap_or_default().chars() {
        let is_escaped = quotes.starts_with('"') && rest.starts_with('\\');
        let len = match rest.as_bytes().get(1) {
            Some(b'u') if is_escaped => 6,
            Some(b'U') if is_escaped => 10,
            Some(b'x') if is_escaped => 4,
            _ if is_escaped => 2,
            _ if rest.starts_with(c) => c.len_utf8(),
            // A line that is continued: the whole text is the place.
            _ => return if offset == text.get_ref().len() { span.end } else { span.start },
        };
        rest = rest.get(len..).unwrap_or_default();
    }
    span.end - rest.len()
}
