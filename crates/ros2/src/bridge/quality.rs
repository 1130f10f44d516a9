//! What a frame is worth, as a message.

use std::sync::Arc;

use isochrone_model::Flags;
use isochrone_recording::CdrError;
use isochrone_recording::message::{MessageType, RosValue, encode};

/// The levels of a `DiagnosticStatus`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Level {
    Ok = 0,
    Warning = 1,
    Error = 2,
    Stale = 3,
}

impl Level {
    /// What flags amount to.
    pub(crate) fn of(flags: Flags) -> Self {
        let has = |flag| flags.contains(flag);
        if has(Flags::STALE) || has(Flags::STOPPED) {
            Self::Stale
        } else if has(Flags::ERROR) {
            Self::Error
        } else if flags.without(Flags::FORCED).is_empty() {
            Self::Ok
        } else {
            Self::Warning
        }
    }
}

/// A `diagnostic_msgs/DiagnosticStatus`.
pub(crate) fn status(
    level: Level,
    name: &str,
    message: &str,
    hardware: &str,
    values: &[(&str, String)],
) -> RosValue {
    let text = |text: &str| RosValue::Text(text.replace('\0', "?"));
    let pair = |(key, value): &(&str, String)| RosValue::Message(vec![text(key), text(value)]);
    RosValue::Message(vec![
        RosValue::Number(f64::from(level as u8)),
        text(name),
        text(message),
        text(hardware),
        RosValue::Several(values.iter().map(pair).collect()),
    ])
}

/// What is known of a frame's worth.
pub(super) struct Worth<'a> {
    pub(super) service: &'a str,
    pub(super) flags: Flags,
    /// From its source to now.
    pub(super) age_s: Option<f64>,
    pub(super) sequence: u64,
    /// Frames lost before it.
    pub(super) lost: u64,
}

impl Worth<'_> {
    /// As a `DiagnosticStatus`.
    pub(super) fn encode(&self, message: &Arc<MessageType>) -> Result<Vec<u8>, CdrError> {
        let words = self.flags.words().collect::<Vec<_>>().join(" ");
        let shown = if words.is_empty() { "OK" } else { &words };
        let values = [
            ("flags", self.flags.bits().to_string()),
            ("age_s", self.age_s.map_or_else(String::new, |age_s| format!("{age_s:.6}"))),
            ("sequence", self.sequence.to_string()),
            ("lost", self.lost.to_string()),
        ];
        encode(message, &status(Level::of(self.flags), self.service, shown, "", &values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_flag_is_the_level() {
        for (flags, level) in [
            (Flags::NONE, Level::Ok),
            (Flags::FORCED, Level::Ok),
            (Flags::UPSTREAM | Flags::FORCED, Level::Warning),
            (Flags::UPSTREAM | Flags::ERROR, Level::Error),
            (Flags::ERROR | Flags::STALE, Level::Stale),
            (Flags::STOPPED, Level::Stale),
        ] {
            assert_eq!(Level::of(flags), level, "{flags}");
        }
    }
}
