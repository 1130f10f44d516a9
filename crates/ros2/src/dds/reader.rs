//! Reading a topic.
//!
//! RustDDS takes a reader and a writer of one topic for a match whatever their types are, so messages of another type
//! would be read as if they were of the reader's. Here each writer's type is looked up when its first message comes.

use std::collections::HashMap;
use std::io;

use rustdds::mio1::{Interest, Registry, Token, event::Source};
use rustdds::no_key::SimpleDataReader;
use rustdds::rpc::SampleIdentity;
use rustdds::{DomainParticipant, GUID, SequenceNumber};

use super::bytes::{AsTheyAre, Body};

/// Most writers whose types are remembered.
const MOST_WRITERS: usize = 1024;

/// Reads a topic.
pub(crate) struct Reader {
    reader: SimpleDataReader<Body, AsTheyAre>,
    participant: DomainParticipant,
    type_name: String,
    /// Whether writers are of the reader's type.
    writers: HashMap<GUID, bool>,
}

/// What lies in a reader.
pub(crate) enum Received {
    /// A message, and who sent it.
    Message(Body, Sender),
    /// A message in an encoding other than CDR.
    Unreadable(String),
    /// The first message of a writer of this other type.
    OtherType(String),
    /// A further one.
    OtherTypeAgain,
}

/// Who sent a message.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sender {
    pub(crate) writer: GUID,
    pub(crate) sequence: SequenceNumber,
    /// What the sender says that a request is known by.
    pub(crate) related: Option<SampleIdentity>,
    /// When the sender says that it was sent, in Unix ns.
    pub(crate) sent_unix_ns: Option<u64>,
}

impl Reader {
    pub(super) fn new(
        reader: SimpleDataReader<Body, AsTheyAre>,
        participant: DomainParticipant,
        type_name: &str,
    ) -> Self {
        Self { reader, participant, type_name: type_name.to_owned(), writers: HashMap::new() }
    }

    /// Lets a poll wake when a message comes.
    pub(crate) fn register(&mut self, registry: &Registry, token: Token) -> io::Result<()> {
        Source::register(&mut self.reader, registry, token, Interest::READABLE)
    }

    /// The next message; `None` if there is none. Ask until there is none: nothing wakes for what lies here.
    pub(crate) fn next(&mut self) -> Option<Received> {
        self.reader.drain_read_notifications();
        let message = match self.reader.try_take_one() {
            Ok(message) => message?,
            Err(error) => return Some(Received::Unreadable(error.to_string())),
        };
        let writer = message.writer_guid();
        match self.writers.get(&writer) {
            Some(false) => return Some(Received::OtherTypeAgain),
            Some(true) => {}
            None => {
                if let Some(other) = self.other_type(writer) {
                    return Some(Received::OtherType(other));
                }
            }
        }
        let sender = Sender {
            writer,
            sequence: message.sequence_number,
            related: message.related_sample_identity(),
            sent_unix_ns: message.source_timestamp().map(|time| unix_ns(time.to_ticks())),
        };
        Some(Received::Message(message.into_value(), sender))
    }

    /// The type of a writer, if it is known to be another one.
    fn other_type(&mut self, guid: GUID) -> Option<String> {
        let writers = self.participant.discovered_writers();
        let writer =
            writers.iter().find(|writer| writer.writer_proxy.remote_writer_guid == guid)?;
        let type_name = &writer.publication_topic_data.type_name;
        let is_same = *type_name == self.type_name;
        if self.writers.len() >= MOST_WRITERS {
            self.writers.clear();
        }
        self.writers.insert(guid, is_same);
        (!is_same).then(|| type_name.clone())
    }
}

/// Ticks of 1/2^32 s as ns.
fn unix_ns(ticks: u64) -> u64 {
    ((u128::from(ticks) * 1_000_000_000) >> 32) as u64
}
