//! What becomes of a frame's values in a message, and of a message in a frame.

mod incoming;
mod outgoing;

pub(crate) use incoming::{Incoming, Misfit};
pub(crate) use outgoing::{Outgoing, Takes, takes, time};
