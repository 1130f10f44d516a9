//! Programs that ask a node.

pub(crate) mod asking;
pub(crate) mod describing;
pub(crate) mod error;
mod json;
pub(crate) mod running_nodes;
pub(crate) mod trace;
