//! The bridge in the graph of ROS: which node has which endpoints.

use std::sync::Arc;

use isochrone_recording::message::{Definitions, Extent, FieldPath, MessageType, RosValue, encode};
use rustdds::GUID;
use rustdds::policy::Durability;

use super::participant::{Dds, Endpoint, Endpoints};
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
    /// The bridge, and the nodes whose parameters it serves.
    nodes: Vec<String>,
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
        let nodes = [std::slice::from_ref(&config.node), &config.parameters].concat();
        Ok(Self { writer, message, namespace, nodes, told: None })
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
        // The services of parameters are of the node whose parameters they are; all else is of the bridge.
        let owner = |topic: &str| {
            let of_node = |node: &&String| {
                let services = format!("{}/{node}/", self.namespace.trim_end_matches('/'));
                topic.get(2..).is_some_and(|name| name.starts_with(&services))
                    && !topic.starts_with("rt/")
            };
            self.nodes.iter().find(of_node).or(self.nodes.first())
        };
        let gids = |node: &String, endpoints: &[Endpoint]| {
            let own = endpoints.iter().filter(|(topic, _)| owner(topic) == Some(node));
            RosValue::Several(own.map(|(_, guid)| gid(guid)).collect())
        };
        let node = |name: &String| {
            RosValue::Message(vec![
                RosValue::Text(self.namespace.clone()),
                RosValue::Text(name.clone()),
                gids(name, &endpoints.readers),
                gids(name, &endpoints.writers),
            ])
        };
        let nodes = RosValue::Several(self.nodes.iter().map(node).collect());
        let whole = RosValue::Message(vec![gid(&participant), nodes]);
        encode(&self.message, &whole).map_err(|error| error.to_string())
    }
}
