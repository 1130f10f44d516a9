//! Who may use a port: the process that opened it, one thread at a time.

use std::sync::{Mutex, TryLockError};

use pyo3::prelude::*;

use crate::errors::{Closed, failed};

/// A port, until it is closed.
pub(crate) struct Held<T> {
    /// What it is, for messages: `the publisher of "plant/level"`.
    what: String,
    /// The process that opened it. Files and threads of iceoryx2 are of one process.
    process: u32,
    port: Mutex<Option<T>>,
}

impl<T> Held<T> {
    pub(crate) fn new(what: String, port: T) -> Self {
        Self { what, process: std::process::id(), port: Mutex::new(Some(port)) }
    }

    pub(crate) fn what(&self) -> &str {
        &self.what
    }

    /// Uses the port.
    pub(crate) fn with<R>(&self, act: impl FnOnce(&mut T) -> R) -> PyResult<R> {
        self.slot(|port| match port {
            Some(port) => Ok(act(port)),
            None => Err(Closed::new_err(format!("{} is closed", self.what))),
        })
    }

    /// Takes the port out, to close it; `None`: it is closed.
    pub(crate) fn take(&self) -> PyResult<Option<T>> {
        self.slot(|port| Ok(port.take()))
    }

    fn slot<R>(&self, act: impl FnOnce(&mut Option<T>) -> PyResult<R>) -> PyResult<R> {
        let Self { what, process, port } = self;
        if *process != std::process::id() {
            return Err(failed(format!(
                "{what} belongs to process {process}, which this one was forked from; open another one here, or start \
                 processes with multiprocessing's \"spawn\""
            )));
        }
        // Who waits for it here would keep Python's lock from whoever has it.
        match port.try_lock() {
            Ok(mut port) => act(&mut port),
            Err(TryLockError::Poisoned(port)) => act(&mut port.into_inner()),
            Err(TryLockError::WouldBlock) => Err(failed(format!(
                "{what} is used by another thread at this moment; open one for each thread, or use a lock"
            ))),
        }
    }
}

/// In a forked process nothing is closed: that would remove the files of the parent.
impl<T> Drop for Held<T> {
    fn drop(&mut self) {
        if self.process != std::process::id() {
            let port = self.port.get_mut().unwrap_or_else(|poisoned| poisoned.into_inner());
            std::mem::forget(port.take());
        }
    }
}
