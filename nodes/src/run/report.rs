//! The report of a run, with what was known before it.

use isochrone_report::Report;
use isochrone_timing::{Warning, WarningCode};

/// Adds what the node did.
pub(super) fn complete(beforehand: Report, node: Report) -> Report {
    let Report { mut warnings, isochrone, program, command, started, environment, .. } = beforehand;
    add(&mut warnings, node.warnings.into_iter());
    Report { warnings, isochrone, program, command, started, environment, ..node }
}

/// Adds warnings to those at the start.
fn add(warnings: &mut Vec<Warning>, more: impl Iterator<Item = Warning>) {
    // No phase and no `within` helps behind a source that is kept from running.
    let is_starved = warnings.iter().any(|it| it.code == WarningCode::StarvedSource);
    warnings.extend(more.filter(|it| !(is_starved && it.code == WarningCode::LateFrames)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_a_source_that_is_kept_from_running_are_not_said_to_need_another_phase() {
        use WarningCode::{InputNotOk, LateFrames, StarvedSource};
        for (known, expected) in [
            (StarvedSource, vec![StarvedSource, InputNotOk]),
            (InputNotOk, vec![InputNotOk, LateFrames, InputNotOk]),
        ] {
            let mut warnings = vec![Warning::new(known, "at the start")];
            let alarms = [LateFrames, InputNotOk].map(|code| Warning::new(code, "at the end"));
            add(&mut warnings, alarms.into_iter());
            assert_eq!(warnings.into_iter().map(|it| it.code).collect::<Vec<_>>(), expected);
        }
    }
}
