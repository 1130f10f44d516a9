//! What the ordinary thread has of a node.

use std::sync::Arc;

use isochrone_ipc::{LayoutAnnouncer, RealTime, Service};
use isochrone_timing::TaskTiming;

use crate::alarms::Alarm;
use crate::events::Log;
use crate::layouts::Resolver;
use crate::operating::Shared;
use crate::placement::FollowedFrames;
use crate::records::RecordReceiver;
use crate::snapshots::Snapshots;
use crate::telemetry::Telemetry;

/// What the ordinary thread has of a node beside its threads; the participant is dropped last.
pub(crate) struct Parts<S: Service> {
    pub(crate) node: String,
    pub(crate) tasks: Vec<Task<S>>,
    pub(crate) operating: Shared,
    pub(crate) snapshots: Snapshots,
    pub(crate) telemetry: Option<Telemetry<S>>,
    pub(crate) announcers: Vec<LayoutAnnouncer<S>>,
    pub(crate) alarms: Vec<Alarm>,
    pub(crate) participant: Option<Arc<RealTime<S>>>,
}

/// What the ordinary thread has of a task.
pub(crate) struct Task<S: Service> {
    pub(crate) name: String,
    /// For each bank the blocks that one of it may be, for messages.
    pub(crate) banks: Vec<String>,
    pub(crate) timing: TaskTiming,
    pub(crate) records: RecordReceiver,
    /// Of a task that follows a service.
    pub(crate) followed: Option<FollowedFrames>,
    pub(crate) log: Log,
    pub(crate) resolvers: Vec<Resolver<S>>,
}
