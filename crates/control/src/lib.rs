//! **Operating a running node**: what may be done to it, and the requests that ask for it.
//!
//! The service `isochrone/<node>/control` is an iceoryx2 request-response service of bytes. A message in either
//! direction is one UTF-8 [JSON-RPC 2.0] object of at most 256 KiB. The `id` is a string that the client chooses;
//! there are no batches and no notifications, and an unknown parameter is an error. A request is checked completely
//! before anything is changed, and the `data` of an error has all [findings](Finding).
//!
//! A program calls [`Method`]s with a [`Client`]; each has [`Params`], which determine the type of its result. A node
//! answers with a [`ControlService`], which parses and checks requests and lets an [`Operated`] carry them out, by
//! the rules of the [`desk`]. [`parse`] and [`answer`] are the protocol alone.
//!
//! Use it in ordinary threads only.
//!
//! [JSON-RPC 2.0]: https://www.jsonrpc.org/specification

#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]
#![forbid(unsafe_code)]

mod client;
pub mod desk;
mod envelope;
mod members;
mod protocol;
mod service;
mod texts;

pub use isochrone_model::{
    Access, Action, AlarmChange, AlarmEntry, AlarmMoment, AlarmSeverity, AlarmState, AppliedChange,
    AskedBy, At, CALLING_TASK, Change, ChangedValue, Code, ConfigPlace, Entry, Finding, Followed,
    Force, Given, Hold, PendingEntry, ProcessAlarm, Refusal, Role, Tuned, Types, Value, Values,
    Written,
};

pub use client::asking::Client;
pub use client::describing::{DescribedNode, describe_nodes};
pub use client::error::{ClientError, other_servers, silence};
pub use client::running_nodes::{RunningNode, running_nodes};
pub use client::trace::{Trace, TraceRow, signals_by_task};
pub use envelope::{MAX_ID_BYTES, Parsed, Unparsed, parse};
pub use protocol::*;
pub use service::{CallResult, ControlService, Operated};
pub use texts::{Room, answer, request};

/// The name of a node's control service.
pub fn service_name(node: &str) -> String {
    format!("isochrone/{node}/control")
}

/// The name of a node's telemetry service, with all its signals and timings.
pub fn telemetry_service_name(node: &str) -> String {
    format!("isochrone/{node}/telemetry")
}

/// The node whose telemetry service has this name.
pub fn node_of_telemetry(service: &str) -> Option<&str> {
    service.strip_prefix("isochrone/")?.strip_suffix("/telemetry")
}
