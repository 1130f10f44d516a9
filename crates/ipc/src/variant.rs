//! Which of iceoryx2's service variants ports can use.

use iceoryx2::service::{ipc, ipc_threadsafe, local, local_threadsafe};

/// A variant of iceoryx2's services: [`ipc::Service`] and [`local::Service`], and those of their kind
/// whose ports threads may share.
pub trait Service: iceoryx2::service::Service {
    /// Whether it has files and shared memory that other processes see, and that outlive a process.
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
