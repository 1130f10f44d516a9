//! The part of the Python package `isochrone` that is not Python: thin classes over the types of isochrone's crates.
//! The package's own modules, in `python/isochrone`, say what they are for, and are what programs use.

mod client;
mod errors;
mod frame_reader;
mod frame_writer;
mod held;
mod interruption;
mod joined;
mod lent;
mod pace;
mod recording;
mod simulation;
mod trace;

use std::sync::Arc;

/// Ports of this kind may be handed from thread to thread.
pub(crate) use isochrone::ipc::ipc_threadsafe::Service as Ports;
use pyo3::prelude::*;

/// What is in common with Rust.
#[pymodule]
mod _native {
    use super::*;

    #[pymodule_export]
    use super::client::Client;
    #[pymodule_export]
    use super::frame_reader::FrameReader;
    #[pymodule_export]
    use super::frame_writer::FrameWriter;
    #[pymodule_export]
    use super::lent::Lent;
    #[pymodule_export]
    use super::pace::{Pace, duration_ns, now_ns};
    #[pymodule_export]
    use super::recording::read;
    #[pymodule_export]
    use super::simulation::simulate;
    #[pymodule_export]
    use super::trace::trace;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        isochrone::ipc::interrupt_waiting_by(Arc::clone(&interruption::OPENING));
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
