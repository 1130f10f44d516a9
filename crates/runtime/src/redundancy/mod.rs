//! Two processes of one node: one holds it and writes, the other follows and takes over.

mod joining;
pub(crate) mod lateness;
mod message;
pub(crate) mod paired;
pub(crate) mod relay;
pub(crate) mod room;
pub(crate) mod rules;
pub(crate) mod twin;

pub use joining::{JoinTwinError, Redundancy, TwinRole};
