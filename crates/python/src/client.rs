//! A running node, as a program operates it.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use isochrone::control::{self, ClientError, Method};
use pyo3::prelude::*;

use crate::Ports;
use crate::errors::unanswered;
use crate::held::Held;
use crate::interruption::interruptible;
use crate::joined::Member;

/// Asks one node.
#[pyclass(frozen, module = "isochrone._native")]
pub(crate) struct Client {
    port: Held<control::Client<Ports>>,
    stop: Arc<AtomicBool>,
}

/// Connects to a node, for a method that changes something or for those that only look.
pub(crate) fn connect(
    py: Python<'_>,
    member: &Member,
    node: &str,
    patience: Duration,
    acts: bool,
) -> PyResult<control::Client<Ports>> {
    let connected = member.open(py, move |participant| {
        Ok(if acts {
            control::Client::connect_to_act(&participant, node, patience)
        } else {
            control::Client::connect(&participant, node, patience)
        })
    })?;
    connected.map_err(|error| unanswered(py, error))
}

#[pymethods]
impl Client {
    #[new]
    fn new(
        py: Python<'_>,
        member: Member,
        node: &str,
        patience_s: f64,
        acts: bool,
    ) -> PyResult<Self> {
        let patience = Duration::from_secs_f64(patience_s);
        let client = connect(py, &member, node, patience, acts)?;
        let stop = Arc::new(AtomicBool::new(false));
        let client = client.interrupted_by(Arc::clone(&stop));
        Ok(Self { port: Held::new(format!("the client of node {node:?}"), client), stop })
    }

    /// Calls a method with parameters in JSON, and returns its result in JSON.
    fn call(&self, py: Python<'_>, method: &str, params: &str) -> PyResult<String> {
        let Self { port, stop } = self;
        // What the node answers is made an exception with Python's lock.
        let call = || port.with(|client| client.call_json(method, params));
        let answer: Result<String, ClientError> = interruptible(py, stop, call)??;
        answer.map_err(|error| unanswered(py, error))
    }

    /// Whether a method changes something in the node.
    #[staticmethod]
    fn changes(method: &str) -> bool {
        Method::ALL.into_iter().any(|known| known.as_str() == method && known.changes())
    }

    /// Leaves the node alone.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        let client = self.port.take()?;
        py.detach(|| drop(client));
        Ok(())
    }
}
