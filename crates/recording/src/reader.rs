//! Reading the frames of a file.

use std::collections::BTreeMap;
use std::io::Read;

use mcap::records::{Channel as ChannelRecord, MessageHeader, Record};

use crate::carried::ChannelFault;
use crate::cdr::FrameHead;
use crate::records::Records;
use crate::writer::MARKS_TOPIC;
use crate::{
    Carried, ClockReading, Condition, MAX_RECORD_BYTES, Mark, ReadError, RecordedFrame, cdr,
};

/// Reads the frames of a file in the order in which they stand there, which is that of their arrival.
pub struct Reader<R> {
    records: Records<R>,
    channels: Channels,
    clock: ClockReading,
    values: Vec<f64>,
    other_messages: u64,
}

/// What stands in a file.
#[derive(Debug)]
pub enum Item<'a> {
    /// A frame.
    Frame(RecordedFrame<'a>),
    /// What is to be known beside the frames.
    Mark(Mark),
}

/// What a message is, by its channel.
enum Channel {
    Frames {
        carried: Carried,
        places: Vec<usize>,
    },
    Marks,
    /// Another program wrote it.
    Other,
}

#[derive(Default)]
struct Channels {
    by_id: BTreeMap<u16, Channel>,
    /// Of their descriptions.
    bytes: usize,
}

/// What a record is to a reader of frames.
enum Understood {
    Frame {
        message: MessageHeader,
        frame: FrameHead,
    },
    Mark(Mark),
    /// Nothing to tell of.
    Nothing,
}

impl<R: Read> Reader<R> {
    /// Begins to read a file.
    ///
    /// # Errors
    /// It is no MCAP file, or the system refuses to read it.
    pub fn open(file: R) -> Result<Self, ReadError> {
        Ok(Self {
            records: Records::open(file)?,
            channels: Channels::default(),
            clock: ClockReading::default(),
            values: Vec::new(),
            other_messages: 0,
        })
    }

    /// The next frame or mark; `None` at the end of the file, or where it breaks off.
    ///
    /// # Errors
    /// The file cannot be read: it is of a later format, compressed in another way, or the system refuses.
    /// Damage is no error: what is damaged is passed over, and [counted](Self::condition).
    pub fn next_item(&mut self) -> Result<Option<Item<'_>>, ReadError> {
        let (message, frame) = loop {
            match self.understand_next()? {
                None => return Ok(None),
                Some(Understood::Mark(mark)) => return Ok(Some(Item::Mark(mark))),
                Some(Understood::Frame { message, frame }) => break (message, frame),
                Some(Understood::Nothing) => {}
            }
        };
        let Some(Channel::Frames { carried, .. }) = self.channels.by_id.get(&message.channel_id)
        else {
            return Ok(None);
        };
        Ok(Some(Item::Frame(RecordedFrame {
            channel: message.channel_id,
            carried,
            header: frame.header,
            values: &self.values,
            received_ns: frame.received_ns,
            due_ns: self.clock.monotonic_ns(message.log_time),
            due_unix_ns: message.log_time,
            sent_unix_ns: message.publish_time,
            lost: frame.lost,
        })))
    }

    fn understand_next(&mut self) -> Result<Option<Understood>, ReadError> {
        let Some(record) = self.records.next_record()? else { return Ok(None) };
        let understood = match record {
            Record::Channel(channel) => match self.channels.learn(&channel)? {
                Learnt::Channel => Some(Understood::Nothing),
                Learnt::Damaged => None,
            },
            Record::Metadata(metadata) => {
                let clock = ClockReading::from_metadata(&metadata.name, &metadata.metadata);
                self.clock = clock.unwrap_or(self.clock);
                Some(Understood::Nothing)
            }
            Record::Message { header: message, data } => {
                match self.channels.by_id.get(&message.channel_id) {
                    Some(Channel::Frames { carried, places }) => {
                        let frame = cdr::read_frame(&data, carried.signals.len());
                        frame.map(|frame| {
                            self.values.clear();
                            self.values.extend(places.iter().map(|place| frame.value(*place)));
                            Understood::Frame { message, frame: frame.head }
                        })
                    }
                    Some(Channel::Marks) => cdr::read_mark(&data).map(Understood::Mark),
                    Some(Channel::Other) => {
                        self.other_messages += 1;
                        Some(Understood::Nothing)
                    }
                    None => None,
                }
            }
            _ => Some(Understood::Nothing),
        };
        if understood.is_none() {
            self.records.note_here("a record that contradicts the rest of the file");
        }
        Ok(Some(understood.unwrap_or(Understood::Nothing)))
    }

    /// What was found to be wrong so far; whether the file was closed is known at its end.
    pub fn condition(&self) -> &Condition {
        self.records.condition()
    }

    /// How many messages of other programs were passed over so far.
    pub fn other_messages(&self) -> u64 {
        self.other_messages
    }
}

#[derive(PartialEq, Eq)]
enum Learnt {
    Channel,
    Damaged,
}

impl Channels {
    fn learn(&mut self, record: &ChannelRecord) -> Result<Learnt, ReadError> {
        // The summary, and files that were put together, describe a channel again.
        if self.by_id.contains_key(&record.id) {
            return Ok(Learnt::Channel);
        }
        let entries = record.metadata.iter();
        self.bytes += entries.map(|(key, value)| key.len() + value.len()).sum::<usize>();
        if self.bytes > MAX_RECORD_BYTES {
            return Err(ReadError::TooManyChannels);
        }
        let channel = match Carried::from_metadata(&record.metadata) {
            Some(Ok((carried, places))) => Channel::Frames { carried, places },
            Some(Err(ChannelFault::Format(format))) => return Err(ReadError::Format { format }),
            Some(Err(ChannelFault::Malformed)) => return Ok(Learnt::Damaged),
            None if record.topic == MARKS_TOPIC => Channel::Marks,
            None => Channel::Other,
        };
        self.by_id.insert(record.id, channel);
        Ok(Learnt::Channel)
    }
}
