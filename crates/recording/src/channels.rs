//! What the channels of a file carry.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{Channel as ChannelRecord, SchemaHeader};

use crate::carried::ChannelFault;
use crate::ros_channel::{Foreign, RosChannel, Schemas};
use crate::writer::{JOURNAL_TOPIC, MARKS_TOPIC};
use crate::{Carried, MAX_RECORD_BYTES, RecordingReadError, TaskLayout, Uncarried};

/// The kind of a message, by its channel.
pub(crate) enum Channel {
    Frames {
        carried: Carried,
        places: Vec<usize>,
    },
    Rows {
        layout: TaskLayout,
        places: Vec<usize>,
    },
    Ros(RosChannel),
    Marks,
    Journal,
    /// Another program wrote it.
    Other,
    /// It cannot be understood.
    Malformed,
}

/// The channels that were described so far.
#[derive(Default)]
pub(crate) struct Channels {
    pub(crate) by_id: BTreeMap<u16, Channel>,
    schemas: Schemas,
    pub(crate) uncarried: BTreeSet<Uncarried>,
    /// Of their descriptions.
    bytes: usize,
}

/// Whether the description of a channel can be understood.
#[derive(PartialEq, Eq)]
pub(crate) enum Learnt {
    Channel,
    Damaged,
}

impl Channels {
    pub(crate) fn learn_schema(
        &mut self,
        header: &SchemaHeader,
        text: &[u8],
    ) -> Result<(), RecordingReadError> {
        self.bytes += self.schemas.learn(header, text);
        self.check_bytes()
    }

    fn check_bytes(&self) -> Result<(), RecordingReadError> {
        let is_too_much = self.bytes > MAX_RECORD_BYTES;
        if is_too_much { Err(RecordingReadError::too_many_channels()) } else { Ok(()) }
    }

    pub(crate) fn learn(&mut self, record: &ChannelRecord) -> Result<Learnt, RecordingReadError> {
        // The summary, and files that were put together, describe a channel again.
        if self.by_id.contains_key(&record.id) {
            return Ok(Learnt::Channel);
        }
        let entries = record.metadata.iter();
        self.bytes += entries.map(|(key, value)| key.len() + value.len()).sum::<usize>();
        self.check_bytes()?;
        let metadata = &record.metadata;
        let frames = Carried::from_metadata(metadata)
            .map(|read| read.map(|(carried, places)| Channel::Frames { carried, places }));
        let known = frames.or_else(|| {
            let rows = TaskLayout::from_metadata(metadata)?;
            Some(rows.map(|(layout, places)| Channel::Rows { layout, places }))
        });
        let channel = match known {
            Some(Ok(channel)) => channel,
            Some(Err(ChannelFault::Format(format))) => {
                return Err(RecordingReadError(format!(
                    "it is of format {format:?}, this program reads 1; use the version that wrote it"
                )));
            }
            Some(Err(ChannelFault::Malformed)) => Channel::Malformed,
            None if record.topic == MARKS_TOPIC => Channel::Marks,
            None if record.topic == JOURNAL_TOPIC => Channel::Journal,
            None => match Foreign::of(record, &self.schemas, &mut self.uncarried) {
                Foreign::Ros(channel) => {
                    self.bytes += channel.bytes();
                    self.check_bytes()?;
                    Channel::Ros(channel)
                }
                Foreign::Other => Channel::Other,
            },
        };
        let is_malformed = matches!(channel, Channel::Malformed);
        self.by_id.insert(record.id, channel);
        Ok(if is_malformed { Learnt::Damaged } else { Learnt::Channel })
    }
}
