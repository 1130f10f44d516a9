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

/// How many bytes a condition may have: names and a comparison need far fewer, and each table of alarms shows it where an
/// alarm has no text.
const MOST_CONDITION: usize = 4000;

/// `file` is the text of the whole file.
pub(super) fn alarm(section: Section<'_>, file: &str) -> AlarmSection {
    let text = section.string(&keys::WHEN).filter(|text| {
        let bytes = text.get_ref().len();
        if bytes > MOST_CONDITION {
            let message = format!("[[alarm]] when has {bytes} bytes");
            let help =
                format!("at most {MOST_CONDITION} are possible; compute the condition in a block");
            let diagnostic = Diagnostic::new(Problem::OutOfRange, text.span(), message);
            section.report(diagnostic.help(help));
        }
        bytes <= MOST_CONDITION
    });
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
        text: section.comment(&keys::TEXT),
        task: section.string(&keys::TASK),
    }
}

/// Where a byte of a text's value stands in the file, in which characters may be escaped.
fn place_in_file(file: &str, text: &Spanned<String>, offset: usize) -> usize {
    let (span, value) = (text.span(), text.get_ref());
    let written = file.get(span.clone()).unwrap_or_default();
    if let Some(start) = written.find(value.as_str()) {
        return span.start + start + offset;
    }
    let quotes = ["\"\"\"", "'''", "\"", "'"].into_iter().find(|it| written.starts_with(it));
    let quotes = quotes.unwrap_or_default();
    // The longest part of it that is read as the value up to there.
    let is_before = |end: &usize| {
        let read = written.get(..*end).and_then(|part| format!("{part}{quotes}").parse().ok());
        read.as_ref().and_then(toml::Value::as_str) == value.get(..offset)
    };
    let end = (quotes.len()..=written.len().saturating_sub(quotes.len())).rev().find(is_before);
    span.start + end.unwrap_or_default()
}
