//! Requests and answers between processes: bytes, over an iceoryx2 request-response service.
//!
//! For ordinary threads: everything here allocates, and a peer that joins is mapped in the call that
//! meets it. What the bytes mean is not known here.
//!
//! # Memory
//!
//! With each of its limits at 1, iceoryx2 sets aside 72 answers for a server of 12 clients: for every
//! client two requests (one that it waits for, one that it gave up), each with an answer in the
//! buffer, one in the client's hands and one being written. That would be 18 MiB. A [`RequestServer`]
//! writes one answer at a time and sends none to a request that was given up, so it has 25: two for
//! each client and the one being written (6.3 MiB, claimed when it is opened). A [`RequestClient`]
//! has 3 requests (0.8 MiB) instead of iceoryx2's 5: one that servers hold, one in their buffers and
//! the one being written. Where peers of another make keep more than that, sending fails with
//! [`AnswerError::NoRoom`] or [`RequestError::NoRoom`] until they let go.

mod client;
mod departures;
mod error;
mod server;
mod service;
mod upkeep;

pub use client::{Answer, RequestClient, ServingProcess};
pub use error::{AnswerError, RequestError};
pub use server::{Delivery, Request, RequestServer, Unanswered};
pub(crate) use service::process_of;
pub use upkeep::RequestUpkeep;

/// Longest request and longest answer, in bytes.
pub const MAX_MESSAGE_BYTES: usize = 256 << 10;
/// How many clients a service has places for, whatever they do.
pub const MAX_CLIENTS: usize = 8;
/// How many more places it reserves for clients that [act](RequestClient::open_to_act), so that clients that only
/// look are not in their way.
pub const PLACES_TO_ACT: usize = 4;
/// How many servers a service has places for: one that serves, and one that is about to take over.
pub const MAX_SERVERS: usize = 2;
