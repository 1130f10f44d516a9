//! Calls of a node's control service.
#![allow(unsafe_code)] // the C interface

use std::ffi::{CString, c_char};
use std::ptr::{null, null_mut};
use std::sync::Arc;
use std::time::Duration;

use isochrone_control::{Client, ClientError};
use isochrone_ipc::{ForRealTime, ipc};

use crate::arguments::{Place, optional_text, text};
use crate::handles::{self, Port};
use crate::joined::Joined;
use crate::participant::{isochrone_participant, joined};
use crate::status::{
    Failure, ISOCHRONE_ERROR_NODE, ISOCHRONE_ERROR_REFUSED, act, c_string, isochrone_status,
};

/// A client of a node. It belongs to the thread that opened it.
pub struct isochrone_client {
    _private: (),
}

pub(crate) struct NodeClient {
    client: Client<ipc::Service>,
    answer: CString,
    _joined: Arc<Joined>,
}

impl Port for NodeClient {
    type Handle = isochrone_client;
    const NOUN: &str = "client";
}

/// Connects to a running node. For ordinary threads: its calls wait.
///
/// node: its name, as in [node] of its configuration.
/// timeout_ns: how long each call waits for its answer, in ns; 5 s are good.
/// client: receives the handle; NULL on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_client_open(
    participant: *mut isochrone_participant,
    node: *const c_char,
    timeout_ns: u64,
    client: *mut *mut isochrone_client,
) -> isochrone_status {
    act(|| {
        // SAFETY: these are the pointers that the interface asks for.
        let (node, place) = unsafe {
            let place = Place::new(client, "client")?;
            place.set(null_mut());
            (text(node, "node")?, place)
        };
        let joined = joined(participant)?;
        let patience = Duration::from_nanos(timeout_ns);
        let client = Client::connect(joined.participant.ordinary(), node, patience);
        let client = client.map_err(|error| Failure::new(ISOCHRONE_ERROR_NODE, error))?;
        let client = NodeClient { client, answer: CString::default(), _joined: joined };
        place.set(handles::open(ForRealTime::nothing().map(|()| client))?);
        Ok(())
    })
}

/// Calls a method of the node, such as "get" or "set", and waits for the answer. docs/control.md lists the methods.
///
/// params: its parameters, a JSON object such as {"values": {"ramp.setChangeRate": 5.0}}; NULL: none.
/// answer: receives the result as JSON. With ISOCHRONE_ERROR_REFUSED it receives the error object with code, message and
/// data, and nothing was changed; with any other failure NULL. Valid until the next call with this client.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_client_call(
    client: *mut isochrone_client,
    method: *const c_char,
    params: *const c_char,
    answer: *mut *const c_char,
) -> isochrone_status {
    act(|| {
        // SAFETY: these are the pointers that the interface asks for.
        let (method, params, place) = unsafe {
            let place = Place::new(answer, "answer")?;
            place.set(null());
            (text(method, "method")?, optional_text(params, "params")?.unwrap_or("{}"), place)
        };
        handles::with(client, |NodeClient { client, answer, .. }| {
            let (json, outcome) = match client.call_json(method, params) {
                Ok(result) => (result, Ok(())),
                Err(ClientError::Refused(refusal)) => {
                    let json = serde_json::to_string(&refusal).unwrap_or_default();
                    (json, Err(Failure::new(ISOCHRONE_ERROR_REFUSED, refusal)))
                }
                Err(error) => return Err(Failure::new(ISOCHRONE_ERROR_NODE, error)),
            };
            *answer = c_string(&json);
            place.set(answer.as_ptr());
            outcome
        })
    })
}

/// Ends a client. NULL is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_client_close(client: *mut isochrone_client) -> isochrone_status {
    act(|| handles::close::<NodeClient>(client))
}
