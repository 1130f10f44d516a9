//! Writing a file.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, WriteOptions};

use crate::carried::topic;
use crate::spelling::{PACKAGE, Spelling, unique};
use crate::{Carried, ClockReading, FORMAT, Frame, Mark, WriteError, definitions, encoded};

/// The encodings of messages and of their definitions.
const MESSAGES: &str = "cdr";
const SCHEMAS: &str = "ros2msg";
/// The channel of marks.
pub(crate) const MARKS_TOPIC: &str = "/isochrone/marks";
/// The channel of the entries of a node's journal.
pub(crate) const JOURNAL_TOPIC: &str = "/isochrone/journal";
/// Size of a chunk before it is compressed.
const CHUNK_BYTES: u64 = 1 << 20;
/// Unix time may move against the monotonic clock by so much before it is read anew.
const SET_NS: u64 = 1_000_000;

/// The options of every file: chunks are made in memory, so that no half of one is ever in the file, and
/// compressed in the thread that writes, so that a task on another CPU keeps that CPU.
pub(crate) fn options() -> WriteOptions {
    WriteOptions::new()
        .profile("ros2")
        .library(concat!("isochrone ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Zstd))
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true)
}

/// Writes a file. Dropped without [`finish`](Self::finish), it is closed as well as that goes.
pub struct Writer<W: Write> {
    pub(crate) file: mcap::Writer<NoSeek<Counted<W>>>,
    written: Arc<AtomicU64>,
    clock: ClockReading,
    topics: HashMap<String, String>,
    taken_topics: HashSet<String>,
    channels: Vec<Channel>,
    marks: Option<u16>,
    pub(crate) journal: Option<u16>,
    /// What a file has at its beginning, and once more at its end: each without the other would be lost with one bit.
    pub(crate) written_twice: Option<(Metadata, Attachment<'static>)>,
    /// Frames that are not in the file yet.
    pending: u64,
    /// The length up to which the file is whole.
    good_bytes: u64,
    message: Vec<u8>,
    ordered: Vec<f64>,
}

/// A channel of a [`Writer`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ChannelId(usize);

struct Channel {
    id: u16,
    /// Where each value of a frame stands in the message.
    places: Vec<usize>,
}

/// The state of a file that could not be written.
#[derive(Debug)]
pub struct Failed<W> {
    /// The output.
    pub out: W,
    /// Cut the file to this length: up to there it can be read.
    pub good_bytes: u64,
    /// How many frames were given to the writer and are not in the file.
    pub lost_frames: u64,
}

impl<W: Write> Writer<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn create(out: W, clock: ClockReading) -> Result<Self, WriteError> {
        let written = Arc::new(AtomicU64::new(0));
        let out = NoSeek::new(Counted { out, written: written.clone() });
        let mut file = options().create(out)?;
        let about = [("format", FORMAT.to_string()), ("version", env!("CARGO_PKG_VERSION").into())];
        let metadata = about.map(|(key, value)| (key.to_owned(), value)).into();
        file.write_metadata(&Metadata { name: "isochrone.recording".into(), metadata })?;
        file.write_metadata(&clock.metadata())?;
        let good_bytes = written.load(Ordering::Relaxed);
        Ok(Self {
            file,
            written,
            clock,
            topics: HashMap::new(),
            taken_topics: [MARKS_TOPIC, JOURNAL_TOPIC].map(str::to_owned).into(),
            channels: Vec::new(),
            marks: None,
            journal: None,
            written_twice: None,
            pending: 0,
            good_bytes,
            message: Vec::new(),
            ordered: Vec::new(),
        })
    }

    /// Adds a channel. Those of one service have one topic.
    ///
    /// # Errors
    /// The file has too many channels, or cannot be written.
    pub fn add(&mut self, carried: &Carried) -> Result<ChannelId, WriteError> {
        let spelling = carried.spelling();
        self.add_channel(&carried.service, &spelling, &carried.metadata(&spelling.fields))
    }

    /// Adds a channel of messages with values.
    pub(crate) fn add_channel(
        &mut self,
        path: &str,
        spelling: &Spelling,
        metadata: &BTreeMap<String, String>,
    ) -> Result<ChannelId, WriteError> {
        let definition = spelling.definition.as_bytes();
        let schema = self.file.add_schema(&spelling.schema_name, SCHEMAS, definition)?;
        let taken = &mut self.taken_topics;
        let topic =
            self.topics.entry(path.to_owned()).or_insert_with(|| unique(topic(path), "_", taken));
        let id = self.file.add_channel(schema, topic, MESSAGES, metadata)?;
        let places = spelling.fields.iter().map(|field| field.place).collect();
        self.channels.push(Channel { id, places });
        self.note_progress(0);
        Ok(ChannelId(self.channels.len() - 1))
    }

    /// Writes a frame. One with other than as many values as its channel carries gets NaN for those that
    /// are missing.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&mut self, channel: ChannelId, frame: &Frame<'_>) -> Result<(), WriteError> {
        let sequence = frame.header.sequence as u32;
        let times = (frame.due_ns, frame.sent_ns);
        self.write_values(channel, frame.values, sequence, times, |values, message| {
            encoded::write_frame(frame, values, message);
        })
    }

    /// Writes a message with values, for which `message` is given them in their order there. `times`: of
    /// the log and of publishing, on the monotonic clock.
    pub(crate) fn write_values(
        &mut self,
        channel: ChannelId,
        values: &[f64],
        sequence: u32,
        times: (u64, u64),
        message: impl FnOnce(&[f64], &mut Vec<u8>),
    ) -> Result<(), WriteError> {
        let Some(Channel { id, places }) = self.channels.get(channel.0) else { return Ok(()) };
        self.ordered.clear();
        self.ordered.resize(places.len(), f64::NAN);
        for (place, value) in places.iter().zip(values) {
            if let Some(slot) = self.ordered.get_mut(*place) {
                *slot = *value;
            }
        }
        message(&self.ordered, &mut self.message);
        let (log_time, publish_time) = (self.clock.unix_ns(times.0), self.clock.unix_ns(times.1));
        let header = MessageHeader { channel_id: *id, sequence, log_time, publish_time };
        self.pending += 1;
        self.file.write_to_known_channel(&header, &self.message)?;
        self.note_progress(1);
        Ok(())
    }

    /// Writes a mark.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn mark(&mut self, mark: &Mark) -> Result<(), WriteError> {
        let channel_id = match self.marks {
            Some(id) => id,
            None => {
                let id = self.add_other("Mark", definitions::MARK, MARKS_TOPIC)?;
                *self.marks.insert(id)
            }
        };
        self.write_other(channel_id, mark.time_ns, &encoded::write_mark(mark))
    }

    /// Adds a channel of messages without values.
    pub(crate) fn add_other(
        &mut self,
        message: &str,
        definition: &str,
        topic: &str,
    ) -> Result<u16, WriteError> {
        let name = format!("{}/msg/{message}", PACKAGE);
        let schema = self.file.add_schema(&name, SCHEMAS, definition.as_bytes())?;
        Ok(self.file.add_channel(schema, topic, MESSAGES, &BTreeMap::new())?)
    }

    /// Writes a message without values.
    pub(crate) fn write_other(
        &mut self,
        channel_id: u16,
        time_ns: u64,
        message: &[u8],
    ) -> Result<(), WriteError> {
        let time = self.clock.unix_ns(time_ns);
        let header = MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
        self.file.write_to_known_channel(&header, message)?;
        self.note_progress(0);
        Ok(())
    }

    /// Follows Unix time where it was set, or has drifted by more than 1 ms: frames from now on have their times
    /// by this reading then.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn follow(&mut self, clock: ClockReading) -> Result<(), WriteError> {
        if clock.moved_ns(self.clock) > SET_NS {
            self.file.write_metadata(&clock.metadata())?;
            self.clock = clock;
            self.note_progress(0);
        }
        Ok(())
    }

    /// Hands everything to the system, so that it is not lost if the process is killed. Nothing is
    /// synchronized with the disk.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.file.flush()?;
        self.note_progress(0);
        self.pending = 0;
        Ok(())
    }

    /// Bytes in the file so far.
    pub fn bytes(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    /// Closes the file.
    ///
    /// # Errors
    /// It cannot be written; the second part says what is left of it.
    pub fn finish(mut self) -> Result<W, (WriteError, Failed<W>)> {
        if let Err(error) = self.flush() {
            return Err((error, self.give_up()));
        }
        let repeated = match &self.written_twice {
            Some((metadata, attachment)) => {
                self.file.write_metadata(metadata).and_then(|()| self.file.attach(attachment))
            }
            None => Ok(()),
        };
        match repeated.and_then(|()| self.file.finish()) {
            Ok(_) => Ok(self.file.into_inner().into_inner().out),
            Err(error) => Err((error.into(), self.give_up())),
        }
    }

    /// Ends after an error.
    pub fn give_up(self) -> Failed<W> {
        let out = self.file.into_inner().into_inner().out;
        Failed { out, good_bytes: self.good_bytes, lost_frames: self.pending }
    }

    /// After a call that succeeded: whatever was written ends with a whole record, and has all frames but the
    /// newest ones, which wait for their chunk to be complete.
    pub(crate) fn note_progress(&mut self, newest: u64) {
        let written = self.bytes();
        if written > self.good_bytes {
            self.good_bytes = written;
            self.pending = newest;
        }
    }
}

/// Counts what is written.
pub(crate) struct Counted<W> {
    out: W,
    written: Arc<AtomicU64>,
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.written.fetch_add(written as u64, Ordering::Relaxed);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
