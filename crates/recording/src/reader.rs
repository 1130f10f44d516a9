//! Reading the frames of a file.

use std::io::{Read, Seek};

use mcap::records::{MessageHeader, Record};

use crate::channels::{Channel, Channels, Learnt};
use crate::encoded::FrameHead;
use crate::node_writer::{CONFIGURATION, STATE};
use crate::records::Records;
use crate::ros_channel::RosChannel;
use crate::{
    ClockReading, FileCondition, Mark, RecordedEntry, RecordedFrame, RecordedNode, RecordedRow,
    RecordingReadError, RowHead, Uncarried, encoded,
};

/// Reads the frames of a file in the order in which they stand there, which is that of their arrival.
pub struct Reader<R> {
    records: Records<R>,
    channels: Channels,
    clock: ClockReading,
    node: Option<RecordedNode>,
    /// A closed file has it twice.
    has_configuration: bool,
    values: Vec<f64>,
    other_messages: u64,
}

/// An item of a file.
#[derive(Debug)]
pub enum Item<'a> {
    /// A frame.
    Frame(RecordedFrame<'a>),
    /// A remark besides the frames.
    Mark(Mark),
    /// A cycle of a task, in the recording of a node.
    Row(RecordedRow<'a>),
    /// An entry of a node's journal.
    Entry(RecordedEntry),
    /// The text of the configuration that a node was started with.
    Configuration(String),
    /// The state that the node went on with, as the file that retains it has it.
    State(Vec<u8>),
}

impl Item<'_> {
    /// Whether it has the values of a cycle: a frame, or a row.
    pub const fn is_cycle(&self) -> bool {
        matches!(self, Self::Frame(_) | Self::Row(_))
    }
}

/// What a record is to a reader of frames.
enum Understood {
    Frame {
        message: MessageHeader,
        frame: FrameHead,
    },
    Row {
        message: MessageHeader,
        row: RowHead,
    },
    /// What needs no more to be understood.
    Whole(Item<'static>),
    /// Nothing to tell of.
    Nothing,
}

impl<R: Read + Seek> Reader<R> {
    /// Begins to read a file, its end first: that says again what is in it and where, so damage costs less.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn open_with_index(file: R) -> Result<Self, RecordingReadError> {
        Records::open_with_index(file).map(Self::new)
    }
}

impl<R: Read> Reader<R> {
    /// Begins to read a file, from its beginning to its end.
    ///
    /// # Errors
    /// It is no MCAP file, or the system refuses to read it.
    pub fn open(file: R) -> Result<Self, RecordingReadError> {
        Records::open(file).map(Self::new)
    }

    fn new(records: Records<R>) -> Self {
        Self {
            records,
            channels: Channels::default(),
            clock: ClockReading::default(),
            node: None,
            has_configuration: false,
            values: Vec::new(),
            other_messages: 0,
        }
    }

    /// The next frame, row, entry or mark; `None` at the end of the file, or where it breaks off.
    ///
    /// # Errors
    /// The file cannot be read: it is of a later format, compressed in another way, or the system refuses.
    /// Damage is no error: what is damaged is passed over, and [counted](Self::condition).
    pub fn next_item(&mut self) -> Result<Option<Item<'_>>, RecordingReadError> {
        let understood = loop {
            match self.understand_next()? {
                None => return Ok(None),
                Some(Understood::Nothing) => {}
                Some(understood) => break understood,
            }
        };
        let channel = |message: &MessageHeader| self.channels.by_id.get(&message.channel_id);
        Ok(match understood {
            Understood::Frame { message, frame } => match channel(&message) {
                Some(
                    Channel::Frames { carried, .. } | Channel::Ros(RosChannel { carried, .. }),
                ) => Some(Item::Frame(RecordedFrame {
                    channel: message.channel_id,
                    carried,
                    header: frame.header,
                    values: &self.values,
                    received_ns: frame.received_ns,
                    due_ns: self.clock.monotonic_ns(message.log_time),
                    due_unix_ns: message.log_time,
                    sent_unix_ns: message.publish_time,
                    lost: frame.lost,
                })),
                _ => None,
            },
            Understood::Row { message, row } => match channel(&message) {
                Some(Channel::Rows { layout, .. }) => Some(Item::Row(RecordedRow {
                    channel: message.channel_id,
                    layout,
                    head: row,
                    values: &self.values,
                    release_unix_ns: message.log_time,
                    end_unix_ns: message.publish_time,
                })),
                _ => None,
            },
            Understood::Whole(item) => Some(item),
            Understood::Nothing => None,
        })
    }

    /// Skips to behind the next frame or row; `false` if there is none.
    ///
    /// # Errors
    /// As [`next_item`](Self::next_item).
    pub fn skip_cycle(&mut self) -> Result<bool, RecordingReadError> {
        while let Some(item) = self.next_item()? {
            if item.is_cycle() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The node that the file is a recording of, as far as that was read; `None`: it is of services.
    pub fn node(&self) -> Option<&RecordedNode> {
        self.node.as_ref()
    }

    fn understand_next(&mut self) -> Result<Option<Understood>, RecordingReadError> {
        let Some(record) = self.records.next_record()? else { return Ok(None) };
        let mut wrong = None;
        let understood = match record {
            Record::Schema { header, data } => {
                self.channels.learn_schema(&header, &data)?;
                Some(Understood::Nothing)
            }
            Record::Channel(channel) => match self.channels.learn(&channel)? {
                Learnt::Channel => Some(Understood::Nothing),
                Learnt::Damaged => None,
            },
            Record::Metadata(metadata) => {
                let clock = ClockReading::from_metadata(&metadata.name, &metadata.metadata);
                self.clock = clock.unwrap_or(self.clock);
                let node = RecordedNode::from_metadata(&metadata.name, &metadata.metadata);
                self.node = node.or(self.node.take());
                Some(Understood::Nothing)
            }
            Record::Message { header: message, data } => {
                match self.channels.by_id.get_mut(&message.channel_id) {
                    Some(Channel::Ros(channel)) => {
                        let read = channel.read(&message, &data, self.clock, &mut self.values);
                        let frame = read.map_err(|why| wrong = Some(why)).ok();
                        frame.map(|frame| Understood::Frame { message, frame })
                    }
                    Some(Channel::Frames { carried, places }) => {
                        let frame = encoded::read_frame(&data, carried.signals.len());
                        frame.map(|(frame, values)| {
                            self.values.clear();
                            self.values.extend(places.iter().map(|place| values.at(*place)));
                            Understood::Frame { message, frame }
                        })
                    }
                    Some(Channel::Rows { places, .. }) => {
                        let row = encoded::read_row(&data, places.len());
                        row.map(|(row, values)| {
                            self.values.clear();
                            self.values.extend(places.iter().map(|place| values.at(*place)));
                            Understood::Row { message, row }
                        })
                    }
                    Some(Channel::Marks) => {
                        encoded::read_mark(&data).map(|mark| Understood::Whole(Item::Mark(mark)))
                    }
                    Some(Channel::Journal) => encoded::read_entry(&data)
                        .map(|entry| Understood::Whole(Item::Entry(entry))),
                    Some(Channel::Other) => {
                        self.other_messages += 1;
                        Some(Understood::Nothing)
                    }
                    Some(Channel::Malformed) | None => None,
                }
            }
            Record::Attachment { header, data, .. }
                if header.name == CONFIGURATION && !self.has_configuration =>
            {
                let text = String::from_utf8(data.into_owned()).ok();
                self.has_configuration = text.is_some();
                text.map(|text| Understood::Whole(Item::Configuration(text)))
            }
            Record::Attachment { header, data, .. } if header.name == STATE => {
                Some(Understood::Whole(Item::State(data.into_owned())))
            }
            _ => Some(Understood::Nothing),
        };
        if understood.is_none() {
            let contradiction = || "a record that contradicts the rest of the file".to_owned();
            self.records.note(wrong.unwrap_or_else(contradiction));
        }
        Ok(Some(understood.unwrap_or(Understood::Nothing)))
    }

    /// The damage that was found so far; whether the file was closed is known at its end.
    pub fn condition(&self) -> &FileCondition {
        self.records.condition()
    }

    /// What does not become frames, of the topics of ROS 2 that were read so far.
    pub fn uncarried(&self) -> impl Iterator<Item = &Uncarried> {
        self.channels.uncarried.iter()
    }

    /// How many messages of other programs were passed over so far.
    pub fn other_messages(&self) -> u64 {
        self.other_messages
    }
}
