//! Which of iceoryx2's service variants ports can use.

use iceoryx2::service::{ipc, ipc_threadsafe, local, local_threadsafe};

/// A service variant of iceoryx2: [`ipc::Service`], [`local::Service`], and the variants of both whose
/// ports may be shared between threads.
pub trait Service: iceoryx2::service::Service {
    /// Whether other processes can see its files and shared memory, which outlive the process.
    const CROSSES_PROCESSES: bool;
}

impl Service for ipc::Service {
    const CROSSES_PROCESSES: bool = true;
}

impl Service for ipc_threadsafe::Service {
    const CROSSES_PROCESSES: bool = true;
}

impl Service for local::Service {
    const CROSSES_PROCESSES: bool = false;
}

impl Service for local_threadsafe::Service {
    const CROSSES_PROCESSES: bool = false;
}
