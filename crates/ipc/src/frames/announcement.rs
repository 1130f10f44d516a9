//! The message in which a publisher describes its frames.

use std::fs;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use crate::{AnnouncementError, FrameLayout, LayoutError, SenderClock, SignalSpec};

/// A publisher's description of its frames: a message on the service `isochrone/layout/<service>`, as JSON.
///
/// ```json
/// {"layout": "9f8c1fe4b321758d", "publisher": "level", "host": "58e1c1f0-…", "period_ns": 1000000,
///  "signals": [{"name": "level.y", "type": "LREAL", "unit": "m"}]}
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Announcement {
    /// The [`FrameHeader::layout`](crate::FrameHeader::layout) of the frames; never 0.
    pub number: u64,
    /// Name of the publisher, for display.
    pub publisher: String,
    /// Identifies the machine: processes with the same value share one monotonic clock. Empty if
    /// unknown.
    pub host: String,
    /// The channels, and the period.
    pub layout: FrameLayout,
}

/// The JSON.
#[derive(Serialize, Deserialize)]
struct Message {
    layout: String,
    #[serde(default)]
    publisher: String,
    #[serde(default)]
    host: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    period_ns: Option<u64>,
    signals: Vec<SignalSpec>,
}

impl Announcement {
    /// The announcement of `publisher`, on this machine, for frames of `layout`.
    pub fn new(publisher: &str, layout: &FrameLayout) -> Self {
        Self {
            number: layout.number(),
            publisher: publisher.to_owned(),
            host: this_host().to_owned(),
            layout: layout.clone(),
        }
    }

    /// Parses a message.
    ///
    /// # Errors
    /// It is not JSON of this form, or too large. Unknown keys are ignored, and control characters,
    /// which could manipulate a terminal, become `\u{fffd}`.
    pub fn from_json(json: &[u8]) -> Result<Self, AnnouncementError> {
        if json.len() > MAX_BYTES {
            let bytes = json.len();
            return Err(AnnouncementError(format!(
                "it has {bytes} bytes, which is more than any layout needs"
            )));
        }
        let message: Message = serde_json::from_slice(json).map_err(|cause| {
            AnnouncementError(format!("it is not the JSON of a layout: {cause}"))
        })?;
        let number = number(&message.layout).ok_or_else(|| {
            let text: String = message.layout.chars().take(SHOWN_CHARS).collect();
            AnnouncementError(format!(
                "its \"layout\" is {text:?}; 16 hexadecimal digits that are not all 0 are needed"
            ))
        })?;
        let Message { publisher, host, period_ns, signals, .. } = message;
        let signal = |signal: SignalSpec| SignalSpec {
            name: printable(signal.name),
            value_type: printable(signal.value_type),
            unit: printable(signal.unit),
        };
        let signals = signals.into_iter().map(signal).collect();
        let layout = FrameLayout { signals, period_ns };
        layout.check_size().map_err(|LayoutError(why)| AnnouncementError(why))?;
        Ok(Self { number, publisher: printable(publisher), host: printable(host), layout })
    }

    /// Serializes the message.
    pub fn to_json(&self) -> Vec<u8> {
        let message = Message {
            layout: format!("{:016x}", self.number),
            publisher: self.publisher.clone(),
            host: self.host.clone(),
            period_ns: self.layout.period_ns,
            signals: self.layout.signals.clone(),
        };
        // Strings and numbers always have a JSON.
        serde_json::to_vec(&message).unwrap_or_default()
    }

    /// Whether the publisher's clock is that of this process.
    pub fn clock(&self) -> SenderClock {
        if self.host.is_empty() || this_host().is_empty() || self.host == this_host() {
            SenderClock::Shared
        } else {
            SenderClock::Foreign
        }
    }
}

/// More than any layout needs.
const MAX_BYTES: usize = 16 << 20;
/// Of a wrong number, for people.
const SHOWN_CHARS: usize = 40;

fn number(text: &str) -> Option<u64> {
    let is_hexadecimal = text.len() == 16 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let number = u64::from_str_radix(text, 16).ok().filter(|_| is_hexadecimal)?;
    (number != 0).then_some(number)
}

fn printable(text: String) -> String {
    if text.contains(char::is_control) { text.replace(char::is_control, "\u{fffd}") } else { text }
}

/// The kernel's boot id: processes of one boot of one machine share a monotonic clock, whatever the
/// names of the containers are that they run in. Empty where it cannot be read.
fn this_host() -> &'static str {
    static HOST: OnceLock<String> = OnceLock::new();
    HOST.get_or_init(|| {
        let id = fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        id.trim().to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn announcement() -> Announcement {
        let signals = vec![
            SignalSpec { unit: "m".to_owned(), ..SignalSpec::new("level \"y\"", "LREAL") },
            SignalSpec::new("ü", ""),
        ];
        let layout = FrameLayout { signals, period_ns: Some(u64::MAX) };
        Announcement::new("level", &layout)
    }

    #[test]
    fn a_message_reads_back_as_it_was() {
        let announcement = announcement();
        assert_eq!(Announcement::from_json(&announcement.to_json()), Ok(announcement.clone()));
        assert_eq!(announcement.clock(), SenderClock::Shared);
    }

    #[test]
    fn what_would_fill_the_memory_is_refused() {
        let refused =
            |json: &str| Announcement::from_json(json.as_bytes()).unwrap_err().to_string();
        let of = |signals: &str| {
            format!(r#"{{"layout": "00000000000000ff", "publisher": "x", "signals": [{signals}]}}"#)
        };
        let many = vec![r#"{"name": "a"}"#; 65_537].join(",");
        assert!(refused(&of(&many)).contains("at most 65536"));
        let long = format!(r#"{{"name": "{}"}}"#, "a".repeat(256));
        assert!(refused(&of(&long)).contains("at most 255"));
        assert!(refused(&" ".repeat(MAX_BYTES + 1)).contains("more than any layout needs"));
    }

    #[test]
    fn what_is_not_needed_may_be_left_out_and_what_is_not_known_is_ignored() {
        let json =
            br#"{"layout": "00000000000000Ff", "signals": [{"name": "a", "min": 3}], "x": []}"#;
        let read = Announcement::from_json(json).unwrap();
        assert_eq!(read.number, 255);
        assert_eq!(read.layout.signals, [SignalSpec::new("a", "")]);
        assert_eq!((read.layout.period_ns, read.clock()), (None, SenderClock::Shared));
    }

    #[test]
    fn control_characters_of_another_process_do_not_reach_a_terminal() {
        let json = br#"{"layout": "00000000000000ff", "publisher": "\u001b[2J",
            "signals": [{"name": "a\nb"}]}"#;
        let read = Announcement::from_json(json).unwrap();
        assert_eq!(read.publisher, "\u{fffd}[2J");
        assert_eq!(read.layout.signals, [SignalSpec::new("a\u{fffd}b", "")]);
    }

    #[test]
    fn another_host_has_another_clock() {
        let elsewhere = Announcement { host: "elsewhere".to_owned(), ..announcement() };
        assert_eq!(elsewhere.clock(), SenderClock::Foreign);
    }

    #[test]
    fn what_is_no_layout_is_refused_with_the_reason() {
        for (json, reason) in [
            (b"".as_slice(), "not the JSON of a layout: EOF"),
            (b"[]", "not the JSON of a layout"),
            (b"{\"layout\": \"00000000000000ff\"}", "missing field `signals`"),
            (b"{\"layout\": 1, \"signals\": []}", "invalid type"),
            (b"{\"layout\": \"0000000000000000\", \"signals\": []}", "\"0000000000000000\""),
            (b"{\"layout\": \"ff\", \"signals\": []}", "16 hexadecimal digits"),
            (b"{\"layout\": \"+0000000000000ff\", \"signals\": []}", "16 hexadecimal digits"),
            (b"\xff\xfe", "not the JSON of a layout"),
        ] {
            let error = Announcement::from_json(json).unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
        }
    }
}
