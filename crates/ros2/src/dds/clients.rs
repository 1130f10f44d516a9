//! What tells the requests of a service's clients apart, by the make of their DDS.
//!
//! Fast DDS names a request in the head of its RTPS message, as the standard of remote calls does. Cyclone DDS puts 16
//! bytes before the request: the latter half of its client's identity, and a number.

use isochrone_recording::ByteOrder;
use rustdds::rpc::SampleIdentity;
use rustdds::{GUID, SequenceNumber};

use super::bytes::Body;
use super::reader::Sender;

/// How Cyclone DDS begins its identities.
const CYCLONE: [u8; 2] = [0x01, 0x10];
/// How long what it puts before a request is.
const CYCLONE_HEAD: usize = 16;

/// Who asked, and by what the answer is known.
#[derive(Debug, Clone)]
pub(crate) struct Asker {
    request: SampleIdentity,
    /// What stands before the answer.
    head: Vec<u8>,
}

impl Asker {
    /// Separates what a client puts before its request from that; `None` if there is too little of it.
    pub(crate) fn of(sender: &Sender, body: Body) -> Option<(Self, Body)> {
        let own = SampleIdentity { writer_guid: sender.writer, sequence_number: sender.sequence };
        if sender.writer.to_bytes()[..2] == CYCLONE {
            let (head, rest) = body.bytes.split_at_checked(CYCLONE_HEAD)?;
            let mut head = head.to_vec();
            if body.order == ByteOrder::Big {
                // Two words of eight bytes, and answers are little-endian.
                head[..8].reverse();
                head[8..].reverse();
            }
            let asker = Self { request: own, head };
            return Some((asker, Body { bytes: rest.to_vec(), order: body.order }));
        }
        let mut request = sender.related.unwrap_or(own);
        // Fast DDS says the client's reader, and leaves the number to the message.
        if request.sequence_number == SequenceNumber::UNKNOWN {
            request.sequence_number = sender.sequence;
        }
        if request.writer_guid == GUID::GUID_UNKNOWN {
            request.writer_guid = sender.writer;
        }
        Some((Self { request, head: Vec::new() }, body))
    }

    /// By what the answer is known.
    pub(crate) fn request(&self) -> SampleIdentity {
        self.request
    }

    /// The answer as this client reads it.
    pub(crate) fn answer(&self, answer: &[u8]) -> Vec<u8> {
        [&self.head, answer].concat()
    }
}
