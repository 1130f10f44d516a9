//! Frames of values: services, layouts, and the ports that write and read them.

pub(crate) mod announcement;
pub(crate) mod announcing;
pub(crate) mod far_writers;
pub(crate) mod following;
pub(crate) mod frame_ref;
pub(crate) mod header;
pub(crate) mod kept;
pub(crate) mod layout;
pub(crate) mod layout_ports;
pub(crate) mod layout_source;
pub(crate) mod next_frame;
pub(crate) mod peers;
pub(crate) mod publisher;
pub(crate) mod raw;
pub(crate) mod repair;
pub(crate) mod service;
pub(crate) mod signal_frame;
pub(crate) mod signal_reader;
pub(crate) mod subscriber;
pub(crate) mod subscriber_counters;
pub(crate) mod tend;
pub(crate) mod told_layouts;
pub(crate) mod writers;
