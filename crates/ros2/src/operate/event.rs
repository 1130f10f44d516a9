//! `/parameter_events`: that parameters have changed.

use std::sync::Arc;

use isochrone_recording::message::{Definitions, MessageType, RosValue, encode};
use rustdds::policy::Durability;

use crate::bridge::read_clocks;
use crate::config::{Profile, QualityOfService};
use crate::dds::{Dds, Writer};
use crate::failure::Failure;
use crate::mapping::time;
use crate::names::dds_topic;

/// As many events as ROS keeps.
const DEPTH: u32 = 1000;

/// Tells ROS which parameters changed.
pub(super) struct Events {
    writer: Writer,
    message: Arc<MessageType>,
    /// The full name of the node in ROS.
    node: String,
}

impl Events {
    pub(super) fn open(
        dds: &Dds,
        definitions: &Definitions,
        node: String,
    ) -> Result<Self, Failure> {
        let message = definitions.find("rcl_interfaces/ParameterEvent").map_err(Failure::found)?;
        let quality = QualityOfService { profile: Profile::Default, depth: DEPTH };
        let topic = dds_topic("/parameter_events");
        let writer = dds.writer(&topic, &message.dds_name(), quality, Durability::Volatile)?;
        Ok(Self { writer, message, node })
    }

    /// Tells of changed parameters: names and `ParameterValue`s.
    pub(super) fn tell(&self, changed: Vec<(String, RosValue)>) {
        if changed.is_empty() {
            return;
        }
        let parameter = |(name, value)| RosValue::Message(vec![RosValue::Text(name), value]);
        let none = RosValue::Several(Vec::new());
        let event = RosValue::Message(vec![
            time(read_clocks().unix_ns),
            RosValue::Text(self.node.clone()),
            none.clone(),
            RosValue::Several(changed.into_iter().map(parameter).collect()),
            none,
        ]);
        match encode(&self.message, &event) {
            Ok(body) => drop(self.writer.send(body)),
            Err(error) => tracing::error!("cannot send /parameter_events: {error}"),
        }
    }
}
