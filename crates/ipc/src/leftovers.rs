//! What iceoryx2 keeps of a domain that nobody uses any more.

use iceoryx2::config::Config;
use iceoryx2::node::Node;
use iceoryx2::prelude::CallbackProgression;

use crate::Service;

/// Removes the last trace of an unused domain from shared memory; returns whether there was one.
///
/// When all nodes of a domain have ended, iceoryx2 leaves the 16 bytes of a node counter
/// (`/dev/shm/<prefix>…_node.0_10_0.global_mgmt`) and the empty directories `nodes` and
/// `services` in the root path. Neither does harm; tests with a domain each would pile them up.
///
/// Does nothing while the domain has a node, alive or dead. The directories stay: a process that
/// starts at this moment may be about to use them.
pub fn remove_leftovers<S: Service>(config: &Config) -> bool {
    let mut in_use = false;
    let listed = Node::<S>::list(config, |_| {
        in_use = true;
        CallbackProgression::Stop
    });
    if listed.is_err() || in_use {
        return false;
    }
    // SAFETY: iceoryx2 demands that no other process uses the domain, so that node ids stay
    // unique. No node exists; should one be in the making, it has opened or will create a counter,
    // and removing only takes away the name. Two nodes may then get the same count, but an id also
    // holds the process id and the nanosecond of its making, which tell them apart.
    #[allow(unsafe_code)]
    let removed = unsafe { iceoryx2::testing::remove_global_mgmt_segment::<S>(config) };
    removed.unwrap_or(false)
}
