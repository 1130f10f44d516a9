//! The bridge in a domain of DDS.

use std::net::{IpAddr, Ipv4Addr};
use std::sync::Mutex;

use rustdds::policy::{Durability, History, Reliability, ResourceLimits};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, Duration, GUID, Publisher, QosPolicies,
    QosPolicyBuilder, RTPSEntity, Subscriber, Topic, TopicKind,
};

use super::reader::Reader;
use super::writer::Writer;
use crate::config::{Profile, QualityOfService};
use crate::failure::Failure;

/// What a reader keeps while the bridge is held up, in messages.
const READER_SAMPLES: i32 = 1024;

/// The bridge in a domain of DDS, with the endpoints that it has there.
pub(crate) struct Dds {
    pub(crate) participant: DomainParticipant,
    publisher: Publisher,
    subscriber: Subscriber,
    endpoints: Mutex<Endpoints>,
}

/// What the bridge reads or writes: its topic in DDS, and what it is known by.
pub(super) type Endpoint = (String, GUID);

/// What the bridge reads and writes, for those who look at the graph of ROS.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Endpoints {
    pub(super) readers: Vec<Endpoint>,
    pub(super) writers: Vec<Endpoint>,
}

impl Dds {
    /// Joins a domain.
    pub(crate) fn join(domain: u16, is_local: bool) -> Result<Self, Failure> {
        let cannot = |cause: &dyn std::fmt::Display| {
            Failure::found(format!("cannot join the DDS domain {domain}: {cause}"))
        };
        let mut builder = DomainParticipantBuilder::new(domain);
        if is_local {
            builder = builder.with_only_networks([IpAddr::V4(Ipv4Addr::LOCALHOST)]);
        }
        let participant = builder.build().map_err(|cause| cannot(&cause))?;
        let qos = QosPolicyBuilder::new().build();
        let publisher = participant.create_publisher(&qos).map_err(|cause| cannot(&cause))?;
        let subscriber = participant.create_subscriber(&qos).map_err(|cause| cannot(&cause))?;
        Ok(Self { participant, publisher, subscriber, endpoints: Mutex::default() })
    }

    /// The participant's identity.
    pub(super) fn guid(&self) -> GUID {
        self.participant.guid()
    }

    /// The topic in DDS of a reader or writer of the bridge.
    pub(crate) fn topic_of(&self, guid: GUID) -> Option<String> {
        let Endpoints { readers, writers } = self.endpoints();
        let mut all = readers.into_iter().chain(writers);
        all.find(|(_, known)| *known == guid).map(|(topic, _)| topic)
    }

    /// What the bridge reads and writes now.
    pub(super) fn endpoints(&self) -> Endpoints {
        self.endpoints.lock().map(|endpoints| endpoints.clone()).unwrap_or_default()
    }

    fn topic(&self, name: &str, type_name: &str, qos: &QosPolicies) -> Result<Topic, Failure> {
        let topic = self.participant.create_topic(
            name.to_owned(),
            type_name.to_owned(),
            qos,
            TopicKind::NoKey,
        );
        topic.map_err(|cause| Failure::found(format!("cannot use the topic {name}: {cause}")))
    }

    /// Writes a topic, by its names in DDS.
    pub(crate) fn writer(
        &self,
        topic: &str,
        type_name: &str,
        quality: QualityOfService,
        durability: Durability,
    ) -> Result<Writer, Failure> {
        let qos = policies(quality, durability).build();
        let topic_of_dds = self.topic(topic, type_name, &qos)?;
        let writer = self.publisher.create_datawriter_no_key(&topic_of_dds, Some(qos));
        let writer = writer
            .map_err(|cause| Failure::found(format!("cannot write the topic {topic}: {cause}")))?;
        if let Ok(mut endpoints) = self.endpoints.lock() {
            endpoints.writers.push((topic.to_owned(), writer.guid()));
        }
        Ok(Writer::new(writer))
    }

    /// Forgets a writer that is gone.
    pub(crate) fn forget_writer(&self, guid: GUID) {
        if let Ok(mut endpoints) = self.endpoints.lock() {
            endpoints.writers.retain(|(_, known)| *known != guid);
        }
    }

    /// Reads a topic, by its names in DDS.
    pub(crate) fn reader(
        &self,
        topic: &str,
        type_name: &str,
        quality: QualityOfService,
    ) -> Result<Reader, Failure> {
        let depth = quality.depth.cast_signed();
        let limits = ResourceLimits {
            max_samples: depth.max(READER_SAMPLES),
            max_instances: 1,
            max_samples_per_instance: depth.max(READER_SAMPLES),
        };
        let qos = policies(quality, Durability::Volatile).resource_limits(limits).build();
        let topic_of_dds = self.topic(topic, type_name, &qos)?;
        let reader = self.subscriber.create_simple_datareader_no_key(&topic_of_dds, Some(qos));
        let reader = reader
            .map_err(|cause| Failure::found(format!("cannot read the topic {topic}: {cause}")))?;
        if let Ok(mut endpoints) = self.endpoints.lock() {
            endpoints.readers.push((topic.to_owned(), reader.guid()));
        }
        Ok(Reader::new(reader, self.participant.clone(), type_name))
    }
}

fn policies(quality: QualityOfService, durability: Durability) -> QosPolicyBuilder {
    let reliability = match quality.profile {
        // A writer that waited for a reader that hangs would keep all other topics waiting.
        Profile::Default => Reliability::Reliable { max_blocking_time: Duration::ZERO },
        Profile::SensorData => Reliability::BestEffort,
    };
    QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth: quality.depth.cast_signed() })
}
