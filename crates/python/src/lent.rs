//! A frame that is read where it lies, in the publisher's memory.

use std::sync::Arc;

use pyo3::prelude::*;

/// Keeps a frame where it is as long as an array has it for its base.
#[pyclass(frozen, module = "isochrone._native")]
pub(crate) struct Lent {
    /// What the reader counts.
    pub(crate) _token: Arc<()>,
    /// The reader, whose memory it is.
    pub(crate) _reader: Py<PyAny>,
}
