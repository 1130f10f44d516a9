//! A task: its thread and cycle, and the ways into it and out of it.

mod account;
pub(crate) mod alarms;
pub(crate) mod bindings;
pub(crate) mod clocks;
pub(crate) mod cycle;
pub(crate) mod events;
pub(crate) mod faults;
pub(crate) mod freshness;
pub(crate) mod inputs;
pub(crate) mod last_second;
pub(crate) mod limiter;
pub(crate) mod messages;
pub(crate) mod orders;
pub(crate) mod outputs;
pub(crate) mod panics;
pub(crate) mod real_time_thread;
pub(crate) mod records;
pub(crate) mod responses;
pub(crate) mod retained;
pub(crate) mod rows;
pub(crate) mod snapshots;
pub(crate) mod threads;
pub(crate) mod timing_channels;
pub(crate) mod traces;
