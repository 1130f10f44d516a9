//! Writing a topic.

use rustdds::bytes::Bytes;
use rustdds::dds::WriteError;
use rustdds::no_key::DataWriter;
use rustdds::rpc::SampleIdentity;
use rustdds::{GUID, RTPSEntity, Timestamp, WriteOptionsBuilder};

use super::bytes::AsTheyAre;

/// Writes a topic.
pub(crate) struct Writer {
    writer: DataWriter<Bytes, AsTheyAre>,
}

/// Why a message was not sent.
pub(crate) enum Unsent {
    /// A reliable reader does not confirm, and as many messages wait for it as are kept.
    NoRoom,
    /// DDS failed.
    Failed(String),
}

impl Writer {
    pub(super) fn new(writer: DataWriter<Bytes, AsTheyAre>) -> Self {
        Self { writer }
    }

    pub(crate) fn guid(&self) -> GUID {
        self.writer.guid()
    }

    /// Sends a body. Never waits.
    pub(crate) fn send(&self, body: Vec<u8>) -> Result<(), Unsent> {
        sent(self.writer.write(Bytes::from(body), Some(Timestamp::now())))
    }

    /// Sends a body that answers a request.
    pub(crate) fn answer(&self, body: Vec<u8>, request: SampleIdentity) -> Result<(), Unsent> {
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(request)
            .build();
        sent(self.writer.write_with_options(Bytes::from(body), options).map(|_| ()))
    }
}

fn sent(sent: Result<(), WriteError<Bytes>>) -> Result<(), Unsent> {
    match sent {
        Ok(()) => Ok(()),
        Err(WriteError::WouldBlock { .. }) => Err(Unsent::NoRoom),
        Err(error) => Err(Unsent::Failed(error.to_string())),
    }
}
