//! Triggers as they are written.

use std::fmt;
use std::str::FromStr;

use crate::comparator::SIGNS;
use crate::{Comparator, Condition};

/// A trigger as it is written: `ramp.delayedValue > 1.0`, `rising ramp.error`, `falling level 0.5`,
/// `changed mode`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trigger {
    /// The signal that is looked at.
    pub signal: String,
    /// The condition on the signal.
    pub kind: Kind,
    /// The number that it is compared with, as it is written.
    pub level: Option<String>,
}

/// A condition on a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A comparison with the level becomes true.
    Compare(Comparator),
    /// It comes from below the level and reaches it; a BOOL becomes TRUE.
    Rising,
    /// It comes from above the level and reaches it; a BOOL becomes FALSE.
    Falling,
    /// It becomes another number.
    Changed,
}

const WORDS: [(&str, Kind); 3] =
    [("rising", Kind::Rising), ("falling", Kind::Falling), ("changed", Kind::Changed)];

/// The form of a trigger, as the end of an error message.
const FORMS: &str = "write for instance 'ramp.delayedValue > 1.0', 'rising ramp.error', \
                     'falling level 0.5' or 'changed mode'";

/// Why a text is no trigger: what is wrong with it, and what to write instead.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct TriggerError(String);

/// The sentence, for a `main` that returns it.
impl fmt::Debug for TriggerError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl TriggerError {
    fn levels(text: &str) -> Self {
        Self(format!("\"{text}\" is more than one level; {FORMS}"))
    }
}

impl Kind {
    /// Its word or sign.
    pub fn word(self) -> &'static str {
        match self {
            Self::Compare(comparison) => comparison.sign(),
            kind => WORDS.into_iter().find(|(_, known)| *known == kind).map_or("", |it| it.0),
        }
    }
}

impl FromStr for Trigger {
    type Err = TriggerError;

    fn from_str(text: &str) -> Result<Self, TriggerError> {
        let text = text.trim();
        // A signal may be called like a word: a sign decides.
        if let Some((place, sign, comparison)) = first_sign(text) {
            let (signal, level) = (text[..place].trim(), text[place + sign.len()..].trim());
            let signal = one_word(signal)?;
            let level = match one_word(level) {
                _ if level.is_empty() => {
                    return Err(TriggerError(format!("there is nothing behind {sign}; {FORMS}")));
                }
                Err(_) => return Err(TriggerError::levels(level)),
                Ok(level) => Some(level),
            };
            return Ok(Self { signal, kind: Kind::Compare(comparison), level });
        }
        if let Some((signal, _)) = text.split_once('=') {
            let signal = signal.trim();
            return Err(TriggerError(format!(
                "= is no comparison; write == to wait until \"{signal}\" is equal to something"
            )));
        }
        let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let Some((_, kind)) = WORDS.into_iter().find(|(known, _)| *known == word) else {
            return Err(TriggerError(format!("\"{text}\" does not say what to wait for; {FORMS}")));
        };
        let rest = rest.trim();
        let (signal, level) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let (signal, level) = (one_word(signal)?, level.trim());
        if kind == Kind::Changed && !level.is_empty() {
            return Err(TriggerError(format!(
                "changed takes no level: it waits until \"{signal}\" becomes any other number"
            )));
        }
        let level = (!level.is_empty()).then(|| one_word(level)).transpose();
        let level = level.map_err(|_| TriggerError::levels(rest))?;
        Ok(Self { signal, kind, level })
    }
}

/// The first sign in a text, and where it stands.
fn first_sign(text: &str) -> Option<(usize, &'static str, Comparator)> {
    let found = SIGNS.into_iter().filter_map(|(sign, comparison)| {
        let place = text.find(sign)?;
        Some((place, sign, comparison))
    });
    // Of two at one place the longer one is meant, which comes first.
    found.min_by_key(|(place, ..)| *place)
}

fn one_word(text: &str) -> Result<String, TriggerError> {
    let is_one = !text.is_empty() && !text.contains(char::is_whitespace);
    if is_one {
        Ok(text.to_owned())
    } else {
        Err(TriggerError(format!("\"{text}\" is not the name of one signal; {FORMS}")))
    }
}

impl Trigger {
    /// What is waited for, once it is known what the level is as a number and whether the signal is a BOOL,
    /// which needs no level to rise or fall.
    ///
    /// # Errors
    /// The level is missing, or NaN.
    pub fn condition(&self, level: Option<f64>, is_bool: bool) -> Result<Condition, TriggerError> {
        /// Between FALSE and TRUE.
        const HALF: f64 = 0.5;
        let signal = &self.signal;
        let level = level.or((is_bool && self.level.is_none()).then_some(HALF));
        if level.is_some_and(f64::is_nan) {
            return Err(TriggerError(format!(
                "NaN compares with nothing; 'changed {signal}' waits until {signal} becomes another number or NaN"
            )));
        }
        match (self.kind, level) {
            (Kind::Changed, _) => Ok(Condition::Changed),
            (Kind::Compare(comparison), Some(level)) => Ok(Condition::Compare(comparison, level)),
            (Kind::Rising, Some(level)) => Ok(Condition::Rising(level)),
            (Kind::Falling, Some(level)) => Ok(Condition::Falling(level)),
            (kind @ (Kind::Rising | Kind::Falling | Kind::Compare(_)), None) => {
                let word = kind.word();
                Err(TriggerError(format!(
                    "\"{word} {signal}\" needs the level to cross, as {signal} is no BOOL: '{word} {signal} 1.5'"
                )))
            }
        }
    }
}

impl fmt::Display for Trigger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { signal, kind, level } = self;
        match (kind, level) {
            (Kind::Compare(_), Some(level)) => write!(f, "{signal} {} {level}", kind.word()),
            (_, Some(level)) => write!(f, "{} {signal} {level}", kind.word()),
            (_, None) => write!(f, "{} {signal}", kind.word()),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(text: &str) -> Trigger {
        text.parse().unwrap()
    }

    #[test]
    fn a_trigger_is_read_with_and_without_blanks_and_shown_as_it_is_written() {
        for (text, shown) in [
            ("ramp.delayedValue > 1.0", "ramp.delayedValue > 1.0"),
            ("level>=0.5", "level >= 0.5"),
            ("  a.17.y  !=  -1e-3 ", "a.17.y != -1e-3"),
            ("delay==T#100ms", "delay == T#100ms"),
            ("rising ramp.error", "rising ramp.error"),
            ("falling level  0.5", "falling level 0.5"),
            ("changed mode", "changed mode"),
            ("rising > 1", "rising > 1"),
        ] {
            assert_eq!(read(text).to_string(), shown);
        }
        let Trigger { signal, kind, level } = read("rising > 1");
        let greater = Kind::Compare(Comparator::Greater);
        assert_eq!((signal.as_str(), kind, level.as_deref()), ("rising", greater, Some("1")));
    }

    #[test]
    fn what_is_no_trigger_is_told_with_a_way_out() {
        for (text, says) in [
            ("", "does not say what to wait for; write for instance"),
            ("ramp.value", "\"ramp.value\" does not say what to wait for"),
            ("raising x", "\"raising x\" does not say what to wait for"),
            ("x = 1", "= is no comparison; write == to wait until \"x\""),
            ("> 1", "\"\" is not the name of one signal"),
            ("rising x > 1", "\"rising x\" is not the name of one signal"),
            ("x >", "there is nothing behind >"),
            ("x > 1 2", "\"1 2\" is more than one level"),
            ("rising", "\"\" is not the name of one signal"),
            ("rising x 1 2", "\"x 1 2\" is more than one level"),
            ("changed x 1", "changed takes no level"),
        ] {
            let error = text.parse::<Trigger>().unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
    }

    #[test]
    fn only_a_bool_rises_without_a_level_and_no_level_is_nan() {
        let rising = read("rising x");
        assert_eq!(rising.condition(None, true), Ok(Condition::Rising(0.5)));
        let error = rising.condition(None, false).unwrap_err().to_string();
        assert!(error.ends_with("is no BOOL: 'rising x 1.5'"), "{error}");
        assert_eq!(read("falling x 2").condition(Some(2.0), false), Ok(Condition::Falling(2.0)));
        assert_eq!(read("changed x").condition(None, false), Ok(Condition::Changed));
        let nan = read("x == NaN").condition(Some(f64::NAN), false);
        assert!(nan.unwrap_err().to_string().contains("'changed x' waits"));
    }

    proptest! {
        #[test]
        fn any_text_is_a_trigger_that_reads_back_or_an_error(text in "\\PC{0,40}|[a-c .<>=!0-9]{0,20}") {
            if let Ok(trigger) = text.parse::<Trigger>() {
                prop_assert_eq!(trigger.to_string().parse::<Trigger>(), Ok(trigger));
            }
        }
    }
}
