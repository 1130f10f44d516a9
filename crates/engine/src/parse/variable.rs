//! `[[variable]]`: values that operators give.

use isochrone_blocks::PinType;

use super::limits::bounds;
use super::section::Section;
use crate::ConfigFinding;
use crate::config::Variable;
use crate::finding::Problem;
use crate::keys::variable as keys;

pub(super) fn variable(section: Section<'_>) -> Variable {
    let value_type = section.value_type(&keys::TYPE);
    let variable = Variable {
        name: section.name(&keys::NAME),
        value_type,
        task: section.string(&keys::TASK),
        initial: section.value(&keys::INITIAL, value_type),
        range: section
            .read(&keys::RANGE, |value| bounds(value, "[[variable]] range", "range").map_err(Some)),
    };
    if let Some(finding) = misfit(&variable) {
        section.report(finding);
    }
    variable
}

/// Why a variable cannot have its range.
fn misfit(variable: &Variable) -> Option<ConfigFinding> {
    let range = variable.range.as_ref()?;
    if variable.value_type == Some(PinType::Bool) {
        let message = "[[variable]] range is for numbers, and the variable is a BOOL";
        let finding = ConfigFinding::new(Problem::Conflict, range.span(), message);
        return Some(finding.help("leave it out: a BOOL is TRUE or FALSE"));
    }
    let (initial, (min, max)) = (variable.initial.as_ref()?, *range.get_ref());
    if (min..=max).contains(initial.get_ref()) {
        return None;
    }
    let message = format!(
        "[[variable]] initial {:?} is outside of its range {min:?} to {max:?}",
        initial.get_ref()
    );
    let finding = ConfigFinding::new(Problem::OutOfRange, initial.span(), message);
    Some(finding.help("change initial or range"))
}
