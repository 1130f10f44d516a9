//! What ROS can ask of nodes and see of them: parameters and diagnostics.

mod diagnostics;
mod event;
mod parameters;
mod requests;
mod service;
mod value;

pub(crate) use diagnostics::diagnostics;
pub(crate) use parameters::parameters;
