//! `[[alarm]]`: conditions that people should know of.

use isochrone_blocks::expr::SignalComparison;
use toml::Spanned;

use super::formulas;
use super::section::Section;
use crate::Diagnostic;
use crate::config::{AlarmSection, Formula};
use crate::diagnostic::Problem;
use crate::keys::alarm as keys;
use isochrone_model::AlarmSeverity;

/// How many bytes a condition may have: most need far fewer, and each table of alarms shows it where an alarm has no
/// text.
const MOST_CONDITION: usize = 4000;

/// `file` is the text of the whole file.
pub(super) fn alarm(section: Section<'_>, file: &str) -> AlarmSection {
    let when = when(&section, file);
    let hysteresis = section.number(&keys::HYSTERESIS);
    if let (Some(hysteresis), Some(read)) =
        (&hysteresis, when.as_ref().map(|when| &when.expression))
        && let Some(expression) = read
        && !expression.comparison().as_ref().is_some_and(SignalComparison::is_ordering)
        && *hysteresis.get_ref() != 0.0
    {
        let message = "[[alarm]] hysteresis goes with one comparison of a signal by >, >=, < or <=";
        let diagnostic = Diagnostic::new(Problem::Conflict, hysteresis.span(), message);
        section.report(diagnostic.help(
            "leave hysteresis out, and wire a Hysteresis block where the condition has more; for gives the alarm a delay",
        ));
    }
    AlarmSection {
        name: section.name(&keys::NAME),
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

/// The condition, which names a signal at least.
fn when(section: &Section<'_>, file: &str) -> Option<Formula> {
    let text = section.string(&keys::WHEN)?;
    let (span, bytes) = (text.span(), text.get_ref().len());
    if bytes > MOST_CONDITION {
        let message = format!("[[alarm]] when has {bytes} bytes");
        let help =
            format!("at most {MOST_CONDITION} are possible; compute the condition in a block");
        section.report(Diagnostic::new(Problem::OutOfRange, span, message).help(help));
        return None;
    }
    let key = Spanned::new(span, keys::WHEN.name.to_owned());
    let when = formulas::read(section, "[[alarm]]", key, text, file);
    if let Some(text) = &when.text
        && when.expression.is_some()
        && when.names.is_empty()
    {
        let span = text.place(&(0..text.as_str().len()));
        let message = "[[alarm]] when: the condition names no signal, so it never changes";
        let diagnostic = Diagnostic::new(Problem::BadExpression, span, message);
        section.report(diagnostic.help("a condition is such as level.y > 1.6 AND NOT stop"));
        return None;
    }
    Some(when)
}
