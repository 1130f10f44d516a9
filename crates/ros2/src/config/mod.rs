//! What the bridge is to do, from a file or from the command line.

mod bases;
mod fields;
mod file;
mod from_ros;
mod table;
mod to_ros;
mod types;

use std::time::Duration;

pub(crate) use bases::{Bases, SLASH};
pub(crate) use file::{MOST_DOMAIN, read};
pub(crate) use types::{NoType, example, find_type, names, no_signal};

use crate::mapping::{Incoming, Outgoing};

/// The type of a topic of frames' flags and ages.
const QUALITY_TYPE: &str = "diagnostic_msgs/msg/DiagnosticStatus";

/// What the bridge is to do.
#[derive(Debug, Clone, Default)]
pub(crate) struct Config {
    /// The name of the node in ROS.
    pub(crate) node: String,
    /// Its namespace: `/`, or `/plant`.
    pub(crate) namespace: String,
    /// The domain of DDS.
    pub(crate) domain: u16,
    /// Whether it speaks to this machine alone.
    pub(crate) is_local: bool,
    pub(crate) to_ros: Vec<ToRos>,
    pub(crate) from_ros: Vec<FromRos>,
    /// Nodes whose parameters are those of ROS.
    pub(crate) parameters: Vec<String>,
    pub(crate) diagnostics: Option<Diagnostics>,
}

impl Config {
    /// The type of a topic of the bridge, if it has one.
    fn type_of(&self, topic: &str) -> Option<String> {
        let to_ros = self.to_ros.iter().flat_map(|link| {
            let message = link.message.as_ref().map(|it| (&link.topic, it.message.ros_name()));
            let quality = link.quality.as_ref().map(|it| (it, QUALITY_TYPE.to_owned()));
            message.into_iter().chain(quality)
        });
        let from_ros = self.from_ros.iter().map(|it| (&it.topic, it.message.message.ros_name()));
        to_ros.chain(from_ros).find(|(known, _)| *known == topic).map(|(_, type_name)| type_name)
    }

    /// The full name in ROS of the node that has the parameters of a control node.
    pub(crate) fn node_of_ros(&self, node: &str) -> String {
        format!("{}/{node}", self.namespace.trim_end_matches('/'))
    }
}

/// What goes to `/diagnostics`.
#[derive(Debug, Clone)]
pub(crate) struct Diagnostics {
    /// The nodes; empty: all that run.
    pub(crate) nodes: Vec<String>,
    pub(crate) interval: Duration,
}

/// A service whose frames become messages.
#[derive(Debug, Clone)]
pub(crate) struct ToRos {
    pub(crate) service: String,
    /// The topic; of signals each, what their topics begin with.
    pub(crate) topic: String,
    /// How; `None`: each signal is a `Float64` on a topic of its own.
    pub(crate) message: Option<Outgoing>,
    /// Most messages in a second.
    pub(crate) rate: Option<f64>,
    pub(crate) on_bad: OnBad,
    /// The topic of the frames' flags and ages.
    pub(crate) quality: Option<String>,
    pub(crate) quality_of_service: QualityOfService,
}

impl ToRos {
    /// The topic for people; of signals each, `/plant/level/SIGNAL`.
    pub(crate) fn shown_topic(&self) -> String {
        let each = if self.message.is_none() { "/SIGNAL" } else { "" };
        format!("{}{each}", self.topic)
    }

    /// Least time between two messages, in ns.
    pub(crate) fn interval_ns(&self) -> u64 {
        self.rate.map_or(0, |hz| (1e9 / hz) as u64)
    }
}

/// What a frame with a flag other than `FORCED` does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OnBad {
    /// It is sent as any other.
    Send,
    /// The last good values are sent again.
    Hold,
    /// Nothing is sent.
    Stop,
}

/// A topic whose messages become frames.
#[derive(Debug, Clone)]
pub(crate) struct FromRos {
    pub(crate) topic: String,
    pub(crate) message: Incoming,
    pub(crate) service: String,
    /// The longest time without a message before the frame is sent once more with `STALE`.
    pub(crate) max_gap: Option<Duration>,
    pub(crate) quality_of_service: QualityOfService,
}

/// How a topic is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct QualityOfService {
    pub(crate) profile: Profile,
    /// How many messages are kept.
    pub(crate) depth: u32,
}

/// A profile of ROS.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Profile {
    /// Reliable: what is lost is sent again.
    Default,
    /// Best effort: what is lost is lost.
    SensorData,
}

impl Profile {
    /// The depth of this profile in ROS.
    pub(crate) fn depth(self) -> u32 {
        match self {
            Self::Default => 10,
            Self::SensorData => 5,
        }
    }
}

impl QualityOfService {
    /// What a profile of ROS is.
    pub(crate) fn of(profile: Profile) -> Self {
        Self { profile, depth: profile.depth() }
    }
}
