//! The first step into a domain, and the last one out of it.

use std::fs;

use iceoryx2::config::Config;

use super::lock::{self, DomainLock, LockGuard};
use super::{rights, roots};
use crate::{JoinError, Service, twins};

/// Makes sure that a domain is ours, and says how to lock it.
///
/// # Errors
/// Its folders cannot be created, or it belongs to another user.
pub(super) fn claim<S: Service>(config: &Config, name: &str) -> Result<DomainLock, JoinError> {
    if !S::CROSSES_PROCESSES {
        return Ok(DomainLock::of_nothing());
    }
    rights::claim(config)?;
    Ok(DomainLock::of(config, name))
}

/// Removes what a domain keeps besides iceoryx2's files; for the last process to leave.
pub(super) fn leave(config: &Config, _held: &LockGuard) {
    roots::leave(config);
    twins::remove_all(config);
    // A process that waits for it notices that it is gone, and creates another.
    let _ = fs::remove_file(lock::path(config));
}
