//! The report of a chain of services.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::summary::Summary;

/// The timing of a chain of services, from the sending of a frame of the first to the sending of the first
/// frame of the last that is computed from it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct ChainReport {
    /// The whole way.
    pub latency_ns: Summary,
    /// Frames of the first service that did not reach the last, although later ones did.
    pub lost: u64,
    /// The way from each service to the next.
    pub hops: Vec<HopReport>,
    /// The distribution by name, encoded like those of a task.
    pub histograms: BTreeMap<String, String>,
}

/// The timing of one hop of a chain.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct HopReport {
    /// The service that is read.
    pub from: String,
    /// The service that is computed from it.
    pub to: String,
    /// From the sending of a frame to the sending of the first frame that is computed from it.
    pub latency_ns: Summary,
    /// The part of it before the release of the cycle that sent; 0 if the release came first.
    pub wait_ns: Summary,
    /// Frames that nothing was computed from, although something was from later ones.
    pub lost: u64,
    /// Frames that are computed from the same frame as one before.
    pub repeated: u64,
    /// Frames that go back to no frame of `from` that was received: the oldest sample behind them came
    /// from elsewhere, or there is none.
    pub unknown: u64,
    /// The distributions by name, encoded like those of a task.
    pub histograms: BTreeMap<String, String>,
}
