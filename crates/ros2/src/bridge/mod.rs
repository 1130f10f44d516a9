//! Frames to messages and back, each in a thread of its own, as the ports of iceoryx2 stay in theirs.

mod clocks;
mod counts;
mod each_signal;
mod events;
mod from_ros;
mod gap;
mod one_message;
mod outlet;
mod quality;
mod rate_limit;
mod silence;
mod to_ros;
mod watch;

pub(crate) use clocks::read_clocks;
pub(crate) use counts::{Count, Hearing, LinkCounts};
pub(crate) use events::Events;
pub(crate) use from_ros::from_ros;
pub(crate) use quality::{Level, status};
pub(crate) use to_ros::to_ros;
pub(crate) use watch::Watch;
