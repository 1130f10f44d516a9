//! The first step into a domain, and the last one out of it.

use std::fs;

use iceoryx2::config::Config;

use super::lock::{self, DomainLock, Held};
use super::{rights, roots};
use crate::{JoinError, Service};

/// Makes sure that a domain is ours, and says how to lock it.
///
/// # Errors
/// Its folders cannot be made, or it belongs to somebody else.
pub(super) fn claim<S: Service>(config: &Config, name: &str) -> Result<DomainLock, JoinError> {
    if !S::CROSSES_PROCESSES {
        return Ok(DomainLock::of_nothing());
    }
    rights::claim(config)?;
    Ok(DomainLock::of(config, name))
}

/// Removes what a domain keeps beside iceoryx2's files; for who leaves last.
pub(super) fn leave(config: &Config, _held: &Held) {
    roots::leave(config);
    // Whoever waits for it sees that it is gone, and makes another.
    let _ = fs::remove_file(lock::path(config));
}
