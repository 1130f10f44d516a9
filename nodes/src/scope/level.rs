//! The level of a trigger that names none: half way between what is seen of its signal.

use std::cell::RefCell;
use std::rc::Rc;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::{Client, ClientError, Trace, signals_by_task};
use isochrone_ipc::{Participant, ipc};
use isochrone_processes::Stop;
use isochrone_scope::{Extremes, Kind, Trigger};

use crate::failure::Failure;
use crate::numbers::six_digits;
use crate::operate::{Purpose, failure};
use crate::terminal;

/// So long the signal of a running node is looked at.
const LOOK: Duration = Duration::from_secs(1);
/// Between two looks for rows.
const TURN: Duration = Duration::from_millis(10);

/// Whether a trigger of a signal of this type needs a level and names none.
pub(super) fn is_missing(trigger: &Trigger, value_type: &str) -> bool {
    let crosses = matches!(trigger.kind, Kind::Rising | Kind::Falling);
    crosses && trigger.level.is_none() && value_type != "BOOL"
}

/// The trigger with the level half way between what was seen of its signal. Without anything finite, it stays as it
/// is.
pub(super) fn between(trigger: &Trigger, seen: Option<Extremes>) -> Result<Trigger, Failure> {
    let Some(Extremes { low, high }) = seen else { return Ok(trigger.clone()) };
    let (signal, word) = (&trigger.signal, trigger.kind.word());
    if low == high {
        // A signal that stands still crosses what lies before it.
        let step = if low.abs() < 1e6 { 1.0 } else { low.abs() / 10.0 };
        let beyond = if trigger.kind == Kind::Rising { low + step } else { low - step };
        return Err(Failure::usage(format!(
            "trigger '{trigger}': {signal} is no BOOL and was {} all the time, so there is no level to guess; write \
             the one to cross, such as '{word} {signal} {beyond:?}'",
            six_digits(low)
        )));
    }
    let level = middle(low, high);
    terminal::note(&format!(
        "note: '{trigger}' names no level; it is {level:?}, half way between {} and {} as {signal} was seen",
        six_digits(low),
        six_digits(high)
    ));
    Ok(Trigger { level: Some(format!("{level:?}")), ..trigger.clone() })
}

/// Half way between two numbers, with as few digits as the distance between them asks for.
fn middle(low: f64, high: f64) -> f64 {
    let middle = low / 2.0 + high / 2.0;
    let digit = 10_f64.powf((high / 2.0 - low / 2.0).log10().floor() - 1.0);
    let rounded = (middle / digit).round() * digit;
    // Without the digits that the multiplication adds, as 0.1 * 3 has them.
    let rounded = format!("{rounded:.12e}").parse().unwrap_or(rounded);
    if low < rounded && rounded < high { rounded } else { middle }
}

/// The trigger with a level, where it needs one: of what the signal does for a second.
pub(super) fn of_node(
    trigger: &Trigger,
    participant: &Participant<ipc::Service>,
    client: &Rc<RefCell<Client>>,
    stop: &Stop,
) -> Result<Trigger, Failure> {
    let look = |error| failure(error, Purpose::Look);
    // A name that does not exist, or matches several signals, is reported with the names that are shown.
    let found = signals_by_task(&mut client.borrow_mut(), &[&trigger.signal]).unwrap_or_default();
    let mut signals = found.into_iter().flat_map(|(_, signals)| signals);
    match (signals.next(), signals.next()) {
        (Some(signal), None) if is_missing(trigger, &signal.value_type) => {
            terminal::note(&format!("looking at {} for its level", signal.name));
            let seen = look_at(participant, client, &signal.name, stop).map_err(look)?;
            seen.check_turns(trigger)?;
            between(trigger, seen.extremes)
        }
        _ => Ok(trigger.clone()),
    }
}

/// The changes of a signal while it was observed.
#[derive(Debug, Clone, Copy, Default)]
struct SignalActivity {
    extremes: Option<Extremes>,
    last: Option<f64>,
    has_risen: bool,
    has_fallen: bool,
}

impl SignalActivity {
    fn with(self, value: f64) -> Self {
        Self {
            extremes: Some(Extremes::with(self.extremes, value)),
            last: Some(value),
            has_risen: self.has_risen || self.last.is_some_and(|last| last < value),
            has_fallen: self.has_fallen || self.last.is_some_and(|last| value < last),
        }
    }

    /// A signal that only went the way in which it is to cross has left what lies half way behind it, and may never
    /// cross it again.
    fn check_turns(self, trigger: &Trigger) -> Result<(), Failure> {
        let Some((Extremes { low, high }, last)) = self.extremes.zip(self.last) else {
            return Ok(());
        };
        let (way, ahead) = match trigger.kind {
            Kind::Rising if self.has_risen && !self.has_fallen => ("rose", last + (high - low)),
            Kind::Falling if self.has_fallen && !self.has_risen => ("fell", last - (high - low)),
            _ => return Ok(()),
        };
        let (signal, word) = (&trigger.signal, trigger.kind.word());
        Err(Failure::usage(format!(
            "trigger '{trigger}': {signal} is no BOOL and only {way} in the last second, to {}, so no level half \
             way is ahead of it; write the one to cross, such as '{word} {signal} {}'",
            six_digits(last),
            six_digits(ahead)
        )))
    }
}

fn look_at(
    participant: &Participant<ipc::Service>,
    client: &Rc<RefCell<Client>>,
    signal: &str,
    stop: &Stop,
) -> Result<SignalActivity, ClientError> {
    let mut trace = Trace::open(participant, client, [signal])?;
    let (begun, mut seen) = (Instant::now(), SignalActivity::default());
    while begun.elapsed() < LOOK && !stop.is_due() {
        trace.maintain();
        while let Some(row) = trace.next_row() {
            let finite = row.values.iter().filter(|value| value.is_finite());
            seen = finite.fold(seen, |seen, value| seen.with(*value));
        }
        thread::sleep(TURN);
    }
    Ok(seen)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(text: &str, low: f64, high: f64) -> Result<String, String> {
        let trigger = text.parse().unwrap();
        let found = between(&trigger, Some(Extremes { low, high }));
        found.map(|it| it.to_string()).map_err(|error| error.report().unwrap().to_string())
    }

    #[test]
    fn a_level_lies_half_way_with_few_digits() {
        for (low, high, expected) in [
            (0.358102, 1.3419, "rising x 0.85"),
            (0.0, 1000.0, "rising x 500.0"),
            (-3.0, 3.0, "rising x 0.0"),
            (0.1, 0.5, "rising x 0.3"),
            (1e9, 1e9 + 1.0, "rising x 1000000000.5"),
            (-1.7e308, 1.7e308, "rising x 0.0"),
        ] {
            assert_eq!(level("rising x", low, high).as_deref(), Ok(expected), "{low} to {high}");
        }
        let next = 1_f64.next_up();
        let between: Trigger = level("falling x", 1.0, next).unwrap().parse().unwrap();
        let found: f64 = between.level.unwrap().parse().unwrap();
        assert!((1.0..=next).contains(&found));
    }

    #[test]
    fn a_signal_that_stands_still_has_no_level_and_the_way_out_is_one_that_it_can_cross() {
        let rising = level("rising x", 7.5, 7.5).unwrap_err();
        assert!(rising.contains("x is no BOOL and was 7.5") && rising.ends_with("'rising x 8.5'"));
        assert!(level("falling x", 7.5, 7.5).unwrap_err().ends_with("'falling x 6.5'"));
        assert!(level("rising x", 1e300, 1e300).unwrap_err().ends_with("'rising x 1.1e300'"));
    }

    #[test]
    fn a_signal_that_only_went_one_way_has_its_level_ahead() {
        let seen = |values: &[f64]| {
            values.iter().fold(SignalActivity::default(), |seen, it| seen.with(*it))
        };
        let told = |text: &str, values: &[f64]| {
            let checked = seen(values).check_turns(&text.parse().unwrap());
            checked.map_err(|error| error.report().unwrap().to_string())
        };
        let rose = told("rising x", &[1412.0, 1417.0, 1422.0]).unwrap_err();
        assert!(rose.contains("only rose") && rose.ends_with("such as 'rising x 1432'"), "{rose}");
        let fell = told("falling x", &[3.0, 2.0]).unwrap_err();
        assert!(fell.contains("only fell") && fell.ends_with("such as 'falling x 1'"), "{fell}");
        assert_eq!(told("falling x", &[1.0, 2.0]), Ok(()), "it falls back through half of that");
        assert_eq!(told("rising x", &[1.0, 3.0, 2.0]), Ok(()));
        assert_eq!(
            told("rising x", &[7.0, 7.0]),
            Ok(()),
            "what stands still is told in other words"
        );
    }

    #[test]
    fn only_what_crosses_and_is_no_bool_needs_a_level() {
        for (text, value_type, expected) in [
            ("rising x", "LREAL", true),
            ("falling x", "", true),
            ("rising x", "BOOL", false),
            ("rising x 1", "LREAL", false),
            ("changed x", "LREAL", false),
        ] {
            assert_eq!(is_missing(&text.parse().unwrap(), value_type), expected, "{text}");
        }
    }
}
