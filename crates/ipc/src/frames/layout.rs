//! The layout of a frame: the meaning of its channels.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::{LayoutConflict, LayoutError};

/// Most channels of a frame.
const MAX_SIGNALS: usize = 65_536;
/// Longest name, type or unit.
const MAX_WORD_BYTES: usize = 255;

/// One channel of a frame.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct SignalSpec {
    /// Name, such as `level.y`; empty if it has none.
    #[serde(default)]
    pub name: String,
    /// `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`; empty if unknown.
    #[serde(rename = "type", default, skip_serializing_if = "String::is_empty")]
    pub value_type: String,
    /// Unit, such as `m`; empty if there is none or it is unknown.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
}

/// What the channels of a frame mean. The publisher announces it, see
/// [`LayoutAnnouncer`](crate::LayoutAnnouncer).
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct FrameLayout {
    /// The channels, in frame order.
    pub signals: Vec<SignalSpec>,
    /// Time between two frames in nanoseconds, if they are periodic.
    pub period_ns: Option<u64>,
}

impl SignalSpec {
    /// A channel of this name and type.
    pub fn new(name: impl Into<String>, value_type: impl Into<String>) -> Self {
        Self { name: name.into(), value_type: value_type.into(), unit: String::new() }
    }

    /// The same channel, with its values in this unit; empty: none is announced.
    #[must_use]
    pub fn in_unit(self, unit: impl Into<String>) -> Self {
        Self { unit: unit.into(), ..self }
    }
}

impl FrameLayout {
    /// The number that frames of this layout carry, never 0. Layouts with the same names, types and
    /// units in the same order have the same number in every process; the period does not count.
    ///
    /// It is the FNV-1a hash (64 bits) of each signal's name, type and unit in UTF-8, each followed by
    /// a byte 255, which no UTF-8 text contains. Other publishers may compute it differently: readers
    /// only compare it.
    pub fn number(&self) -> u64 {
        let words = self.signals.iter().flat_map(|s| [&s.name, &s.value_type, &s.unit]);
        // 0 says that there is no layout.
        fnv1a(words.flat_map(|word| word.bytes().chain([u8::MAX])))
    }

    /// Checks whether frames can have this layout, before a port is opened.
    ///
    /// # Errors
    /// There is no signal, or more than 65,536; a name, type or unit has a control character or more
    /// than 255 bytes; two signals have the same name, unless it is empty.
    pub fn check(&self) -> Result<(), LayoutError> {
        if self.signals.is_empty() {
            return Err(LayoutError("the frame has no signal; give it at least one".into()));
        }
        for (channel, signal) in self.signals.iter().enumerate() {
            let words = [&signal.name, &signal.value_type, &signal.unit];
            if let Some(word) = words.into_iter().find(|word| word.contains(char::is_control)) {
                return Err(LayoutError(format!(
                    "channel {channel}: {word:?} cannot be announced; a name has no control characters, which could do \
                     anything to a terminal"
                )));
            }
        }
        let mut channels = HashMap::new();
        for (channel, signal) in self.signals.iter().enumerate() {
            let first = *channels.entry(&signal.name).or_insert(channel);
            if first != channel && !signal.name.is_empty() {
                return Err(LayoutError(format!(
                    "channels {first} and {channel} are both called {:?}; give each a name of its own",
                    signal.name
                )));
            }
        }
        self.check_size()
    }

    /// The bounds that keep an announcement from filling its readers' memory.
    pub(crate) fn check_size(&self) -> Result<(), LayoutError> {
        if self.signals.len() > MAX_SIGNALS {
            return Err(LayoutError(format!(
                "there are {} signals; a frame has at most {MAX_SIGNALS}",
                self.signals.len()
            )));
        }
        for (channel, signal) in self.signals.iter().enumerate() {
            let words = [&signal.name, &signal.value_type, &signal.unit];
            if let Some(word) = words.into_iter().find(|word| word.len() > MAX_WORD_BYTES) {
                return Err(LayoutError(format!(
                    "channel {channel}: a name, type or unit of {} bytes; at most {MAX_WORD_BYTES} are possible",
                    word.len()
                )));
            }
        }
        Ok(())
    }

    /// Returns the index of the channel with this name.
    ///
    /// # Errors
    /// No channel has it.
    pub fn find(&self, name: &str) -> Result<usize, LayoutConflict> {
        let found = self.signals.iter().position(|signal| signal.name == name);
        found.ok_or_else(|| {
            let there = self.first_names();
            LayoutConflict(format!("its frames have no signal {name:?}; there is: {there}"))
        })
    }

    /// Checks that a channel is there and carries values of this type.
    ///
    /// If the publisher does not announce a type, any type matches.
    ///
    /// # Errors
    /// There is no such channel, or it is of another type.
    pub fn check_channel(&self, channel: usize, value_type: &str) -> Result<(), LayoutConflict> {
        let Some(signal) = self.signals.get(channel) else {
            let (available, needed) = (self.signals.len(), channel + 1);
            let plural = if available == 1 { "" } else { "s" };
            let are = if needed == 1 { "is" } else { "are" };
            return Err(LayoutConflict(format!(
                "its frames have {available} channel{plural}, {needed} {are} needed"
            )));
        };
        let available = &signal.value_type;
        if available.is_empty() || available == value_type {
            return Ok(());
        }
        // Only a wire converts.
        let remedy = if (available.as_str(), value_type) == ("INT", "LREAL") {
            "; write type = \"INT\" at the input: a wire from it feeds LREAL pins all the same"
        } else {
            ""
        };
        Err(LayoutConflict(format!(
            "channel {channel} ({}) carries {available}, {value_type} is needed{remedy}",
            signal.name
        )))
    }

    /// The unit of a channel; empty if none is announced.
    pub fn unit(&self, channel: usize) -> &str {
        self.signals.get(channel).map_or("", |signal| &signal.unit)
    }

    /// The names of the first signals, for people.
    pub(crate) fn first_names(&self) -> String {
        const SHOWN: usize = 12;
        let mut names: Vec<&str> =
            self.signals.iter().take(SHOWN).map(|signal| signal.name.as_str()).collect();
        if self.signals.len() > SHOWN {
            names.push("…");
        }
        names.join(", ")
    }
}

/// The FNV-1a hash with 64 bits, but never 0.
pub(crate) fn fnv1a(bytes: impl Iterator<Item = u8>) -> u64 {
    const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let hash = bytes.fold(OFFSET_BASIS, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME));
    if hash == 0 { OFFSET_BASIS } else { hash }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(signals: &[(&str, &str)]) -> FrameLayout {
        let signals = signals.iter().map(|(name, value_type)| SignalSpec::new(*name, *value_type));
        FrameLayout { signals: signals.collect(), period_ns: None }
    }

    #[test]
    fn equal_layouts_have_equal_numbers_and_others_do_not() {
        let first = layout(&[("a", "LREAL"), ("b", "INT")]);
        assert_eq!(first.number(), first.clone().number());
        assert_eq!(first.number(), FrameLayout { period_ns: Some(5), ..first.clone() }.number());
        let mut numbers = vec![first.number()];
        for other in [
            layout(&[("b", "INT"), ("a", "LREAL")]),
            layout(&[("a", "INT"), ("b", "LREAL")]),
            layout(&[("a", "LREAL")]),
            layout(&[("a", "LREAL"), ("b", "")]),
            layout(&[("aL", "REAL"), ("b", "INT")]),
            layout(&[("a", "LREAL"), ("b", "INT"), ("", "")]),
            layout(&[]),
        ] {
            numbers.push(other.number());
        }
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), 8);
        assert!(!numbers.contains(&0));
    }

    #[test]
    fn the_number_is_the_same_in_every_version() {
        assert_eq!(layout(&[("level.y", "LREAL")]).number(), 0x9f8c_1fe4_b321_758d);
    }

    #[test]
    fn a_signal_is_found_by_name_and_its_type_matches_where_it_is_announced() {
        let layout = layout(&[("a", "LREAL"), ("b", "INT"), ("c", "")]);
        assert_eq!(layout.find("b"), Ok(1));
        assert_eq!(layout.find("c"), Ok(2));
        assert_eq!(layout.check_channel(1, "INT"), Ok(()));
        assert_eq!(layout.check_channel(2, "BOOL"), Ok(()));
    }

    #[test]
    fn a_control_character_in_a_name_is_refused() {
        let error = layout(&[("a b, ü", "LREAL"), ("b\u{1b}[2J", "INT")]).check().unwrap_err();
        assert!(error.to_string().starts_with("channel 1: \"b\\u{1b}[2J\""), "{error}");
    }

    #[test]
    fn two_signals_of_one_name_are_refused_unless_nobody_gave_them_one() {
        let error = layout(&[("a", ""), ("b", ""), ("a", "INT")]).check().unwrap_err();
        let sentence = "channels 0 and 2 are both called \"a\"; give each a name of its own";
        assert_eq!(error.to_string(), sentence);
        assert_eq!(layout(&[("", ""), ("b", ""), ("", "")]).check(), Ok(()));
    }

    #[test]
    fn what_does_not_fit_names_both_sides() {
        let layout = layout(&[("a", "LREAL"), ("b", "INT")]);
        for (conflict, parts) in [
            (layout.find("x").map(drop), ["\"x\"", "a, b"]),
            (layout.check_channel(1, "BOOL"), ["INT", "BOOL"]),
            (layout.check_channel(0, "BOOL"), ["channel 0 (a) carries LREAL", "BOOL"]),
            (layout.check_channel(2, "INT"), ["2 channels", "3"]),
        ] {
            let conflict = conflict.unwrap_err().to_string();
            assert!(parts.iter().all(|part| conflict.contains(part)), "{conflict}");
        }
    }
}
