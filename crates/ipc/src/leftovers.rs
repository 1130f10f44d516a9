//! What iceoryx2 keeps of a domain that nobody uses any more.

use iceoryx2::config::Config;
use iceoryx2::node::Node;
use iceoryx2::prelude::CallbackProgression;

use crate::Service;
use crate::domain::Domain;

/// Removes the last traces of an unused domain; returns whether there was one.
///
/// When all nodes of a domain have ended, iceoryx2 leaves the 16 bytes of a node counter
/// (`/dev/shm/<prefix>…_node.0_10_0.global_mgmt`) and the empty directories `nodes` and `services` in the
/// root path, and this crate its lock (`<prefix>isochrone.lock`) and the list of root paths
/// (`/dev/shm/<prefix>isochrone.roots`). None does harm; tests with a domain each
/// would pile them up.
///
/// Does nothing while the domain has a living node. The directories stay: a program that knows no lock
/// may be about to use them.
pub fn remove_leftovers<S: Service>(config: &Config) -> bool {
    let Ok(domain) = Domain::claim::<S>(config.clone(), "isochrone/leftovers") else {
        return false;
    };
    let Ok(held) = domain.lock().acquire_to_end() else { return false };
    domain.sweep::<S>(&held);
    let mut in_use = false;
    let listed = Node::<S>::list(config, |_| {
        in_use = true;
        CallbackProgression::Stop
    });
    if listed.is_err() || in_use {
        return false;
    }
    // SAFETY: iceoryx2 demands that no other process uses the domain, so that node ids stay
    // unique. No node exists, and processes of this crate make one under the lock that is held here.
    // Should a program that knows no lock be making one, it has opened or will create a counter, and
    // removing only takes away the name. Two nodes may then get the same count, but an id also holds
    // the process id and the nanosecond of its making, which tell them apart.
    #[allow(unsafe_code)]
    let removed = unsafe { iceoryx2::testing::remove_global_mgmt_segment::<S>(config) };
    if S::CROSSES_PROCESSES {
        domain.leave(&held);
    }
    drop(held);
    removed.unwrap_or(false)
}
