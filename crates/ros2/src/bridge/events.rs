//! What becomes known of others in the domain of DDS: who came, who does not fit, and clocks that are set.

use std::collections::HashMap;

use isochrone_recording::ClockReading;
use rustdds::policy::Reliability;
use rustdds::{
    DomainParticipantStatusEvent as Event, DomainParticipantStatusListener, EndpointDescription,
    RTPSEntity, StatusEvented,
};

use super::clocks::{read_clocks, set_by_ns};
use crate::dds::Dds;

/// From where on a step of Unix time is told, in ns.
const STEP_NS: i64 = 100_000_000;

/// Tells what becomes known.
pub(crate) struct Events {
    listener: DomainParticipantStatusListener,
    /// The types of the bridge's topics, by the names in DDS.
    types: HashMap<String, String>,
    clocks: ClockReading,
    /// How the identities of the bridge's own endpoints begin.
    own: [u8; 12],
}

impl Events {
    /// Of topics and their types, by their names in DDS.
    pub(crate) fn of(dds: &Dds, types: HashMap<String, String>) -> Self {
        let listener = dds.participant.status_listener();
        let guid = dds.participant.guid().to_bytes();
        let mut own = [0; 12];
        own.copy_from_slice(&guid[..12]);
        Self { listener, types, clocks: read_clocks(), own }
    }

    /// Tells what became known, and returns whether Unix time went back, which keeps a best-effort reader of RustDDS from
    /// giving messages until the old time is reached again.
    pub(crate) fn tell(&mut self) -> bool {
        while let Some(event) = self.listener.try_recv_status() {
            self.tell_of(&event);
        }
        let now = read_clocks();
        let set_ns = set_by_ns(now, std::mem::replace(&mut self.clocks, now));
        if set_ns.abs() >= STEP_NS {
            let set_s = set_ns as f64 / 1e9;
            tracing::warn!(
                "Unix time was set by {set_s:.3} s: time stamps of messages jump with it"
            );
        }
        set_ns <= -STEP_NS
    }

    fn tell_of(&self, event: &Event) {
        match event {
            Event::ReaderDetected { reader } => self.detected("subscriber", reader),
            Event::WriterDetected { writer } => self.detected("publisher", writer),
            Event::RemoteReaderMatched { remote_reader, .. } => {
                tracing::debug!("a subscriber is there: {remote_reader:?}");
            }
            Event::RemoteWriterMatched { remote_writer, .. } => {
                tracing::debug!("a publisher is there: {remote_writer:?}");
            }
            Event::RemoteWriterQosIncompatible { requested_qos, offered_qos, .. } => {
                let is_reliable =
                    matches!(requested_qos.reliability(), Some(Reliability::Reliable { .. }));
                let remedy = if is_reliable {
                    "; write qos = \"sensor_data\" in its [[from_ros]] if it sends best-effort"
                } else {
                    ""
                };
                tracing::warn!(
                    "a publisher's quality of service does not fit, so nothing comes from it: it offers {offered_qos:?}{remedy}"
                );
            }
            Event::RemoteReaderQosIncompatible { requested_qos, .. } => {
                tracing::warn!(
                    "a subscriber's quality of service does not fit, so it gets nothing: it wants {requested_qos:?}; write \
                     qos = \"default\" in its [[to_ros]] if it wants reliable messages"
                );
            }
            Event::ReaderLost { guid, reason } | Event::WriterLost { guid, reason } => {
                tracing::debug!("{guid:?} is gone: {reason:?}");
            }
            Event::ParticipantLost { id, reason } => {
                tracing::info!("a participant of DDS is gone: {id:?}: {reason:?}");
            }
            _ => {}
        }
    }

    fn detected(&self, what: &str, endpoint: &EndpointDescription) {
        let EndpointDescription { topic_name, type_name, guid, .. } = endpoint;
        if guid.to_bytes()[..12] == self.own[..] {
            return;
        }
        match self.types.get(topic_name) {
            Some(own) if own != type_name => tracing::warn!(
                "a {what} of {topic_name} has the type {type_name} instead of {own}: nothing passes between it and the \
                 bridge"
            ),
            Some(_) => tracing::info!("a {what} of {topic_name} is there"),
            None => {}
        }
    }
}
