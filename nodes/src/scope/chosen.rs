//! Selecting the signals and the trigger.

use isochrone_blocks::PinType;
use isochrone_model::parse_value;
use isochrone_scope::{Comparator, Condition, Edge, Trigger};

use crate::failure::Failure;
use crate::numbers::{Digits, number, shown, type_of};

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

/// The condition of a trigger, for a signal of this type and unit.
pub(super) fn edge(trigger: &Trigger, value_type: &str, unit: &str) -> Result<Edge, Failure> {
    let refused = |why: String| Failure::usage(format!("trigger '{trigger}': {why}"));
    let pin_type = type_of(value_type);
    let level = trigger.level.as_deref();
    let level = level.map(|level| parse_value(level, pin_type, unit).map(number));
    let level = level.transpose().map_err(refused)?;
    let condition = trigger.condition(level, value_type == "BOOL");
    let condition = condition.map_err(|error| refused(error.to_string()))?;
    if let Some((low, high)) = pin_type.range()
        && !can_fire(condition, pin_type, (low, high))
    {
        let [low, high] = [low, high].map(|it| shown(it, pin_type, Digits::Exact));
        let whole = if pin_type == PinType::Int { "a whole number " } else { "" };
        return Err(refused(format!(
            "that never becomes true: {} is {pin_type}, {whole}from {low} to {high}",
            trigger.signal
        )));
    }
    Ok(Edge::new(condition))
}

/// Whether a value of a type with such bounds can be on either side of the condition.
fn can_fire(condition: Condition, pin_type: PinType, (low, high): (f64, f64)) -> bool {
    match condition {
        Condition::Compare(Comparator::Equal | Comparator::Unequal, level) => pin_type.holds(level),
        Condition::Compare(comparison, level) => {
            comparison.holds(low, level) != comparison.holds(high, level)
        }
        Condition::Rising(level) => low < level && level <= high,
        Condition::Falling(level) => low <= level && level < high,
        Condition::Changed => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trigger_that_no_value_of_its_type_makes_true_is_refused() {
        let is_taken = |text: &str, value_type: &str| {
            edge(&text.parse().unwrap(), value_type, "")
                .map(drop)
                .map_err(|failure| failure.report().unwrap().to_string())
        };
        for (text, value_type) in [
            ("n == 1.5", "INT"),
            ("n != 1.5", "INT"),
            ("n == 40000", "INT"),
            ("n > 32767", "INT"),
            ("n >= 32768", "INT"),
            ("n < -32768", "INT"),
            ("n <= 32767", "INT"),
            ("rising n 32767.5", "INT"),
            ("falling n 32767", "INT"),
            ("n == 16#10000", "WORD"),
            ("n < 0", "WORD"),
            ("n == 2", "BOOL"),
        ] {
            let why = is_taken(text, value_type).unwrap_err();
            assert!(why.contains("never becomes true"), "{text}: {why}");
        }
        let why = is_taken("n == 1.5", "INT").unwrap_err();
        assert!(why.ends_with("n is INT, a whole number from -32768 to 32767"), "{why}");
        for (text, value_type) in [
            ("n > 1.5", "INT"),
            ("n >= 32767", "INT"),
            ("n < 32767", "INT"),
            ("rising n 1.5", "INT"),
            ("rising n 32767", "INT"),
            ("n == 16#FFFF", "WORD"),
            ("n == T#100ms", "TIME"),
            ("n == true", "BOOL"),
            ("n > 0", "BOOL"),
            ("rising n", "BOOL"),
            ("n == 1.5", "LREAL"),
            ("n > 1e300", "LREAL"),
            ("n == 1.5", ""),
        ] {
            assert_eq!(is_taken(text, value_type), Ok(()), "{text} {value_type}");
        }
    }
}
