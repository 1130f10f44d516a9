//! `[[variable]]`: values that operators give.

use isochrone_blocks::PinType;

use super::section::Section;
use crate::Diagnostic;
use crate::config::Variable;
use crate::diagnostic::Problem;
use crate::keys::variable as keys;

pub(super) fn variable(section: Section<'_>) -> Variable {
    let value_type = section.value_type(&keys::TYPE);
    let variable = Variable {
        name: section.name(&keys::NAME),
        value_type,
        task: section.string(&keys::TASK),
        initial: section.value(&keys::INITIAL, value_type),
        range: section.range(&keys::RANGE, value_type),
        unit: section.unit(&keys::UNIT, value_type),
        comment: section.comment(&keys::COMMENT),
    };
    if let Some(diagnostic) = misfit(&variable) {
        section.report(diagnostic);
    }
    variable
}

/// Why the initial value of a variable is not within its range.
fn misfit(variable: &Variable) -> Option<Diagnostic> {
    let (initial, range) = (variable.initial.as_ref()?, variable.range.as_ref()?);
    let (min, max) = *range.get_ref();
    if variable.value_type == Some(PinType::Bool) || (min..=max).contains(initial.get_ref()) {
        return None;
    }
    let message = format!(
        "[[variable]] initial {:?} is outside of its range {min:?} to {max:?}",
        initial.get_ref()
    );
    let diagnostic = Diagnostic::new(Problem::OutOfRange, initial.span(), message);
    Some(diagnostic.help("change initial or range"))
}
