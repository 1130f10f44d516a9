//! The report of a link.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::summary::Summary;

/// Which way the frames of a link went, as the reporting program saw it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Direction {
    /// It received them.
    Received,
    /// It sent them.
    Sent,
}

impl Direction {
    /// The word in a report.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Received => "received",
            Self::Sent => "sent",
        }
    }
}

/// The timing of one stream of frames.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LinkReport {
    /// Name of the service, or of the transport if the link is an arm of a bench.
    pub service: String,
    /// `received` or `sent` by the reporting program; `null` for an arm of a bench.
    pub direction: Option<Direction>,
    /// Frames received, or frames sent if the reporting node is the publisher.
    pub frames: u64,
    /// Frames that were published but not received, or that could not be sent. A control input
    /// reads only the newest frame, so it loses frames by design if the publisher is faster.
    pub lost: u64,
    /// Times the publisher restarted or another publisher took over; `null` if the frames were sent,
    /// or of an arm of a bench.
    pub restarts: Option<u64>,
    /// Frames from other publishers than the one followed; they are not read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_writers: Option<u64>,
    /// Frames with time stamps in the receiver's future, from another clock. Their age counts from
    /// their arrival, and no latency is computed from them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub future_stamps: Option<u64>,
    /// Frames whose time stamps were more than a second older than any wait here explains, from
    /// another clock or delayed while being sent. Their age is what the stamps say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub past_stamps: Option<u64>,
    /// Frames that could not be read because their layout had not been announced yet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unknown_layouts: Option<u64>,
    /// Frames by their flags: how many had each, for an observer.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub flagged: BTreeMap<String, u64>,
    /// Frames received per second.
    pub rate_hz: Option<f64>,
    /// Receive time minus publish time: the last hop.
    pub one_way_ns: Summary,
    /// Receive time minus the publish time of the oldest sample behind the frame, counted from the
    /// start of its path through all nodes.
    pub end_to_end_ns: Summary,
    /// Publish time minus the publish time of the oldest sample behind the frame: the age of the
    /// value when the last node sent it on.
    pub age_at_publish_ns: Summary,
    /// The distributions by name, encoded like those of a task.
    pub histograms: BTreeMap<String, String>,
}
