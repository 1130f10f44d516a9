//! The bridge in the graph of ROS: which node has which endpoints.

use std::sync::Arc;

use isochrone_recording::message::{Definitions, Extent, FieldPath, MessageType, RosValue, encode};
use rustdds::GUID;
use rustdds::policy::Durability;

use super::participant::{Dds, Endpoints};
use super::writer::Writer;
use crate::config::{Config, Profile, QualityOfService};
use crate::failure::Failure;

/// The topic of the graph, which has no `rt/` before it.
const TOPIC: &str = "ros_discovery_info";

/// Tells the nodes of ROS which endpoints the bridge has: `ros2 node list` shows it.
pub(crate) struct Graph {
    writer: Writer,
    message: Arc<MessageType>,
    namespace: String,
    node: String,
    told: Option<Endpoints>,
}

impl Graph {
    /// Before Iron, ROS gave an identity 24 bytes instead of 16.
    const OLD_GID: &str = "char[24] data\n";
    const OLD: [&str; 3] = ["foxy", "galactic", "humble"];

    pub(crate) fn open(
        dds: &Dds,
        config: &Config,
        definitions: &Definitions,
    ) -> Result<Self, Failure> {
        let distribution = std::env::var("ROS_DISTRO").unwrap_or_default();
        let mut definitions = definitions.clone();
        if Self::OLD.contains(&&*distribution) {
            definitions.add("rmw_dds_common/Gid", Self::OLD_GID);
        }
        let message =
            definitions.find("rmw_dds_common/ParticipantEntitiesInfo").map_err(Failure::found)?;
        let quality = QualityOfService { profile: Profile::Default, depth: 1 };
        let writer = dds.writer(TOPIC, &message.dds_name(), quality, Durability::TransientLocal)?;
        // It is no endpoint of the node.
        dds.forget_writer(writer.guid());
        let namespace = config.namespace.clone();
        Ok(Self { writer, message, namespace, node: config.node.clone(), told: None })
    }

    /// Tells what has changed since it was called last.
    pub(crate) fn tend(&mut self, dds: &Dds) {
        let endpoints = dds.endpoints();
        if self.told.as_ref() == Some(&endpoints) {
            return;
        }
        match self.body(dds.guid(), &endpoints) {
            Ok(body) => {
                if self.writer.send(body).is_ok() {
                    self.told = Some(endpoints);
                }
            }
            Err(error) => tracing::error!("cannot tell the graph of ROS: {error}"),
        }
    }

    fn body(&self, participant: GUID, endpoints: &Endpoints) -> Result<Vec<u8>, String> {
        let data = FieldPath::find(&self.message, "gid.data").map_err(|error| error.to_string())?;
        let length = match data.field_type().extent {
            Extent::Array(length) => length,
            _ => 16,
        };
        let gid = |guid: &GUID| {
            let mut bytes: Vec<f64> = guid.to_bytes().map(f64::from).to_vec();
            bytes.resize(length, 0.0);
            RosValue::Message(vec![RosValue::Numbers(bytes)])
        };
        let gids = |guids: &[GUID]| RosValue::Several(guids.iter().map(gid).collect());
        let node = RosValue::Message(vec![
            RosValue::Text(self.namespace.clone()),
            RosValue::Text(self.node.clone()),
            gids(&endpoints.readers),
            gids(&endpoints.writers),
        ]);
        let whole = RosValue::Message(vec![gid(&participant), RosValue::Several(vec![node])]);
        encode(&self.message, &whole).map_err(|error| error.to_string())
    }
}
