//! What came over a link.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::summary::Summary;

/// The timing of one stream of frames.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LinkReport {
    /// The service, or the transport that is an arm of a bench.
    pub service: String,
    /// Frames received, or sent by the node that reports.
    pub frames: u64,
    /// Frames published and not received, or that could not be sent. A control input reads the
    /// newest frame, so a faster publisher loses by design.
    pub lost: u64,
    /// Times that a publisher began anew, or that another one was followed.
    pub restarts: u64,
    /// Frames of other publishers than the one that is followed; they are not read.
    #[serde(skip_serializing_if = "is_zero")]
    pub other_writers: u64,
    /// Frames whose stamps lay in the receiver's future: of another clock. Their ages count from
    /// their arrival, and no latency is taken of them.
    #[serde(skip_serializing_if = "is_zero")]
    pub future_stamps: u64,
    /// Frames that arrived with stamps more than a second older than any wait here explains: of
    /// another clock, or held up while they were sent. They count as old as they say.
    #[serde(skip_serializing_if = "is_zero")]
    pub past_stamps: u64,
    /// Frames that could not be read, because nobody had announced their layout yet.
    #[serde(skip_serializing_if = "is_zero")]
    pub unknown_layouts: u64,
    /// Frames received per second.
    pub rate_hz: Option<f64>,
    /// Received minus published: the last hop.
    pub one_way_ns: Summary,
    /// Received minus the publishing of the oldest sample behind the frame, at the beginning of its
    /// way through all nodes.
    pub end_to_end_ns: Summary,
    /// Published minus the publishing of the oldest sample behind the frame: the age of the value
    /// when the last node sent it on.
    pub age_at_publish_ns: Summary,
    /// The distributions themselves, by name, encoded as those of a task.
    pub histograms: BTreeMap<String, String>,
}

fn is_zero(number: &u64) -> bool {
    *number == 0
}
