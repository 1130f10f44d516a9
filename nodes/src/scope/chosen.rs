//! Which signals are meant, and what a trigger is of.

use isochrone_scope::{Edge, Trigger};

use crate::failure::Failure;
use crate::numbers::type_of;
use crate::operate::{Written, number};

/// As many as a chart can show.
pub(super) const MOST: usize = 64;

/// Refuses more signals than a chart has room for.
pub(super) fn check_count(count: usize) -> Result<(), Failure> {
    if count <= MOST {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "these are {count} signals; scope shows at most {MOST}: name fewer"
    )))
}

/// What a trigger waits for, where its signal has this type and unit.
pub(super) fn edge(trigger: &Trigger, value_type: &str, unit: &str) -> Result<Edge, Failure> {
    let refused = |why: String| Failure::usage(format!("trigger '{trigger}': {why}"));
    let level = trigger.level.as_deref().map(|level| {
        let written = Written::read(level)?;
        written.of(type_of(value_type), Some(unit)).map(number)
    });
    let level = level.transpose().map_err(refused)?;
    let condition = trigger.condition(level, value_type == "BOOL");
    condition.map(Edge::new).map_err(|error| refused(error.to_string()))
}
