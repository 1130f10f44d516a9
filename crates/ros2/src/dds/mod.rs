//! DDS, the wire of ROS 2: topics of bytes.

mod bytes;
mod clients;
mod graph;
mod participant;
mod reader;
mod writer;

pub(crate) use bytes::Body;
pub(crate) use clients::Asker;
pub(crate) use graph::Graph;
pub(crate) use participant::Dds;
pub(crate) use reader::{Reader, Received, Sender};
pub(crate) use writer::{Unsent, Writer};
