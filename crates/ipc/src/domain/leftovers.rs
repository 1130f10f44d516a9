//! Leftovers of a domain that nobody uses any more.

use iceoryx2::config::Config;
use iceoryx2::node::Node;
use iceoryx2::prelude::CallbackProgression;
use iceoryx2::service::ipc;

use super::{claim, sweep};

/// Removes the last traces of an unused domain, see [`Domain::remove_leftovers`](super::Domain).
pub(super) fn remove(config: &Config) -> bool {
    let Ok(lock) = claim::claim::<ipc::Service>(config, "isochrone/leftovers") else {
        return false;
    };
    let Ok(held) = lock.acquire_to_end() else { return false };
    sweep::sweep::<ipc::Service>(config, &held);
    if is_in_use(config) {
        return false;
    }
    // SAFETY: iceoryx2 demands that no other process uses the domain, so that node ids stay
    // unique. No node exists, and processes of this crate make one under the lock that is held here.
    // Should a program that knows no lock be making one, it has opened or will create a counter, and
    // removing only takes away the name. Two nodes may then get the same count, but an id also holds
    // the process id and the nanosecond of its making, which tell them apart.
    #[allow(unsafe_code)]
    let removed = unsafe { iceoryx2::testing::remove_global_mgmt_segment::<ipc::Service>(config) };
    claim::leave(config, &held);
    drop(held);
    removed.unwrap_or(false)
}

/// Whether there is a node in the domain, or may be one.
pub(super) fn is_in_use(config: &Config) -> bool {
    let mut in_use = false;
    let listed = Node::<ipc::Service>::list(config, |_| {
        in_use = true;
        CallbackProgression::Stop
    });
    listed.is_err() || in_use
}
