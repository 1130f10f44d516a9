//! The metadata of a channel of frames.

use std::collections::BTreeMap;

use isochrone_ipc::SignalSpec;
use serde::{Deserialize, Serialize};

use crate::spelling::{Field, Spelling};
use crate::{FORMAT, definitions};

pub(crate) const KEY_FORMAT: &str = "isochrone.format";

/// What the frames of a service carry: one layout of it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Carried {
    /// The service, such as `plant/level`.
    pub service: String,
    /// Who writes it, if that is announced; for display.
    pub publisher: String,
    /// Time between two frames in ns, if that is announced.
    pub period_ns: Option<u64>,
    /// One for each value of a frame, in their order; without a name where nobody announces one.
    pub signals: Vec<SignalSpec>,
}

const KEY_SERVICE: &str = "isochrone.service";
const KEY_PUBLISHER: &str = "isochrone.publisher";
pub(crate) const KEY_PERIOD: &str = "isochrone.period_ns";
const KEY_SIGNALS: &str = "isochrone.signals";

/// A signal in the metadata: how it is called, and where it stands in the message.
#[derive(Serialize, Deserialize)]
struct SignalEntry {
    #[serde(flatten)]
    signal: SignalSpec,
    field: String,
    place: usize,
}

/// The fault of a channel.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum ChannelFault {
    /// It is of a later version.
    Format(String),
    /// It cannot be understood.
    Malformed,
}

impl Carried {
    /// The message of these frames.
    pub(crate) fn spelling(&self) -> Spelling {
        Spelling::new(&self.service, &self.signals, definitions::FRAME)
    }

    pub(crate) fn metadata(&self, fields: &[Field]) -> BTreeMap<String, String> {
        let mut metadata = described(&self.signals, fields);
        metadata.insert(KEY_SERVICE.to_owned(), self.service.clone());
        metadata.insert(KEY_PUBLISHER.to_owned(), self.publisher.clone());
        if let Some(period_ns) = self.period_ns {
            metadata.insert(KEY_PERIOD.to_owned(), period_ns.to_string());
        }
        metadata
    }

    /// Reads it back, with the place of each signal; `None` if it is a channel of another program.
    pub(crate) fn from_metadata(
        metadata: &BTreeMap<String, String>,
    ) -> Option<Result<(Self, Vec<usize>), ChannelFault>> {
        let service = metadata.get(KEY_SERVICE)?;
        let (signals, places) = match signals(metadata) {
            Ok(signals) => signals,
            Err(fault) => return Some(Err(fault)),
        };
        let carried = Self {
            service: service.clone(),
            publisher: metadata.get(KEY_PUBLISHER).cloned().unwrap_or_default(),
            period_ns: metadata.get(KEY_PERIOD).and_then(|period| period.parse().ok()),
            signals,
        };
        Some(Ok((carried, places)))
    }
}

/// What the metadata of a channel says of its signals, and of the format.
pub(crate) fn described(signals: &[SignalSpec], fields: &[Field]) -> BTreeMap<String, String> {
    let entry = |(signal, field): (&SignalSpec, &Field)| SignalEntry {
        signal: signal.clone(),
        field: field.path.clone(),
        place: field.place,
    };
    let signals: Vec<_> = signals.iter().zip(fields).map(entry).collect();
    BTreeMap::from([
        (KEY_FORMAT.to_owned(), FORMAT.to_string()),
        // Strings and numbers always have a JSON.
        (KEY_SIGNALS.to_owned(), serde_json::to_string(&signals).unwrap_or_default()),
    ])
}

/// The signals of a channel, and the place of each in the message.
pub(crate) fn signals(
    metadata: &BTreeMap<String, String>,
) -> Result<(Vec<SignalSpec>, Vec<usize>), ChannelFault> {
    let format = metadata.get(KEY_FORMAT).map_or("", String::as_str);
    if format != FORMAT.to_string() {
        return Err(ChannelFault::Format(format.to_owned()));
    }
    let entries = metadata.get(KEY_SIGNALS).and_then(|json| serde_json::from_str(json).ok());
    let entries: Vec<SignalEntry> = entries.ok_or(ChannelFault::Malformed)?;
    let mut seen = vec![false; entries.len()];
    for entry in &entries {
        let place = seen.get_mut(entry.place).ok_or(ChannelFault::Malformed)?;
        if std::mem::replace(place, true) {
            return Err(ChannelFault::Malformed);
        }
    }
    Ok(entries.into_iter().map(|entry| (entry.signal, entry.place)).unzip())
}

/// The name of a service as a ROS topic: `/plant/level`.
pub(crate) fn topic(service: &str) -> String {
    let segment = |segment: &str| {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let segment: String = segment.chars().map(plain).collect();
        let begins_well = segment.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        if begins_well { segment } else { format!("x{segment}") }
    };
    service.split('/').map(|part| format!("/{}", segment(part))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn carried() -> Carried {
        let signals = vec![
            SignalSpec { unit: "m".into(), ..SignalSpec::new("level.y", "LREAL") },
            SignalSpec::new("n", "INT"),
            SignalSpec::new("level.z", ""),
        ];
        let (service, publisher) = ("plant/level".to_owned(), "level".to_owned());
        Carried { service, publisher, period_ns: Some(5), signals }
    }

    #[test]
    fn what_a_channel_carries_reads_back_with_the_places_of_its_values() {
        let carried = carried();
        let metadata = carried.metadata(&carried.spelling().fields);
        assert_eq!(Carried::from_metadata(&metadata), Some(Ok((carried, vec![0, 2, 1]))));
    }

    #[test]
    fn a_channel_of_another_program_is_none_and_one_of_a_later_format_says_which() {
        let carried = carried();
        let mut metadata = carried.metadata(&carried.spelling().fields);
        metadata.insert(KEY_FORMAT.into(), "2".into());
        let fault = Some(Err(ChannelFault::Format("2".into())));
        assert_eq!(Carried::from_metadata(&metadata), fault);
        assert_eq!(Carried::from_metadata(&BTreeMap::new()), None);
    }

    #[test]
    fn places_that_are_none_are_refused() {
        let carried = carried();
        let spelling = carried.spelling();
        for place in [1, 3, usize::MAX] {
            let mut fields = spelling.fields.clone();
            fields[0].place = place;
            let read = Carried::from_metadata(&carried.metadata(&fields));
            assert_eq!(read, Some(Err(ChannelFault::Malformed)));
        }
    }

    #[test]
    fn a_service_is_a_topic_of_ros() {
        assert_eq!(topic("plant/level"), "/plant/level");
        assert_eq!(topic("plant-1/2nd tank"), "/plant_1/x2nd_tank");
        assert_eq!(topic("/a/"), "/x/a/x");
    }
}
