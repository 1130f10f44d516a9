//! What becomes known of others in the domain of DDS: who came, who does not fit, and clocks that are set.

use std::collections::HashMap;

use isochrone_recording::ClockReading;
use rustdds::policy::{Durability, Reliability};
use rustdds::{
    DomainParticipantStatusEvent as Event, DomainParticipantStatusListener, EndpointDescription,
    QosPolicies, RTPSEntity, StatusEvented,
};

use super::clocks::{read_clocks, set_by_ns};
use crate::dds::Dds;
use crate::names::topic_of_ros;

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
    pub(crate) fn tell(&mut self, dds: &Dds) -> bool {
        while let Some(event) = self.listener.try_recv_status() {
            self.tell_of(dds, &event);
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

    fn tell_of(&self, dds: &Dds, event: &Event) {
        match event {
            Event::ReaderDetected { reader } => self.detected("subscriber", reader),
            Event::WriterDetected { writer } => self.detected("publisher", writer),
            Event::RemoteReaderMatched { remote_reader, .. } => {
                tracing::debug!("a subscriber is there: {remote_reader:?}");
            }
            Event::RemoteWriterMatched { remote_writer, .. } => {
                tracing::debug!("a publisher is there: {remote_writer:?}");
            }
            Event::RemoteWriterQosIncompatible {
                local_reader, requested_qos, offered_qos, ..
            } => {
                let topic = dds.topic_of(*local_reader).unwrap_or_default();
                let unfit = unfit(requested_qos, offered_qos);
                let remedy = if lacks_reliability(requested_qos, offered_qos) {
                    "; write qos = \"sensor_data\" in its [[from_ros]]"
                } else {
                    ""
                };
                tracing::warn!(
                    "a publisher of {} does not fit in its quality of service, so nothing comes from it: {unfit}{remedy}",
                    topic_of_ros(&topic)
                );
            }
            Event::RemoteReaderQosIncompatible {
                local_writer, requested_qos, offered_qos, ..
            } => {
                let topic = dds.topic_of(*local_writer).unwrap_or_default();
                let unfit = unfit(requested_qos, offered_qos);
                let remedy = if lacks_reliability(requested_qos, offered_qos) {
                    "; write qos = \"default\" in its [[to_ros]]"
                } else {
                    "; change it there, as the bridge offers nothing else"
                };
                tracing::warn!(
                    "a subscriber of {} does not fit in its quality of service, so it gets nothing: {unfit}{remedy}",
                    topic_of_ros(&topic)
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
        let topic = topic_of_ros(topic_name);
        match self.types.get(topic_name) {
            Some(own) if own != type_name => tracing::warn!(
                "a {what} of {topic} has the type {type_name} instead of {own}: nothing passes between it and the \
                 bridge"
            ),
            Some(_) => tracing::info!("a {what} of {topic} is there"),
            None => {}
        }
    }
}

fn lacks_reliability(requested: &QosPolicies, offered: &QosPolicies) -> bool {
    requested.is_reliable() && offered.reliability() == Some(Reliability::BestEffort)
}

/// What does not fit between a subscriber and a publisher, in words.
fn unfit(requested: &QosPolicies, offered: &QosPolicies) -> String {
    let mut unfit = Vec::new();
    if lacks_reliability(requested, offered) {
        unfit.push("the publisher sends best-effort, and the subscriber wants reliable".to_owned());
    }
    let durability = |qos: &QosPolicies| qos.durability().unwrap_or(Durability::Volatile);
    if durability(offered) < durability(requested) {
        unfit.push(
            "the publisher keeps nothing for those who come later (volatile), and the subscriber wants that (transient \
             local)"
                .to_owned(),
        );
    }
    match offered.compliance_failure_wrt(requested) {
        Some(policy) if unfit.is_empty() => format!("its {policy:?}").to_lowercase(),
        _ => unfit.join("; "),
    }
}

#[cfg(test)]
mod tests {
    use rustdds::{Duration, QosPolicyBuilder};

    use super::*;

    #[test]
    fn what_does_not_fit_is_said_in_words() {
        let best_effort = QosPolicyBuilder::new().best_effort().build();
        let reliable = || QosPolicyBuilder::new().reliable(Duration::ZERO);
        let late = reliable().durability(Durability::TransientLocal).build();
        let reliable = reliable().build();
        assert_eq!(
            unfit(&reliable, &best_effort),
            "the publisher sends best-effort, and the subscriber wants reliable"
        );
        assert_eq!(
            unfit(&late, &reliable),
            "the publisher keeps nothing for those who come later (volatile), and the subscriber wants that (transient \
             local)"
        );
    }
}
