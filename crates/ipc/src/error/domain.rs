//! Why there is no domain, or no part in one.

use thiserror::Error;

/// Most bytes of root path and prefix. iceoryx2's paths end at 255, and its own names take the rest;
/// it panics beyond.
pub(crate) const MAX_DOMAIN_BYTES: usize = 120;

/// Why a [`Domain`](crate::Domain) cannot be used: the file and the place in it, what is wrong there, and what to do.
#[derive(Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct DomainError(String);

impl DomainError {
    pub(crate) fn new(sentence: String) -> Self {
        Self(sentence)
    }

    /// What is wrong with a configuration file as a whole.
    pub(crate) fn of_file(path: &str, what: &str) -> Self {
        Self(format!("iceoryx2 configuration {path}: {what}"))
    }

    /// What is wrong at a line and a column of it, both from 1.
    pub(crate) fn at(path: &str, (line, column): (usize, usize), what: &str) -> Self {
        Self(format!("iceoryx2 configuration {path}:{line}:{column}: {what}"))
    }
}

/// Why [`Participant::join`](crate::Participant::join) failed.
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum JoinError {
    /// The name is longer than 128 bytes or is not ASCII.
    #[error("node name {name:?}: iceoryx2 takes at most 128 ASCII characters")]
    Name {
        /// The name as given; of a longer one, its beginning.
        name: String,
    },
    /// The domain belongs to another user or cannot be written.
    #[error(
        "cannot join the iceoryx2 domain {domain}: no permission; all its processes must run as one user, or choose another root-path and prefix"
    )]
    Permission {
        /// Root path and prefix.
        domain: String,
    },
    /// Something in the domain belongs to another user.
    #[error(
        "cannot join the iceoryx2 domain {domain}: {path} belongs to {owner}, and this process runs as {ours}; run as the owner, have the owner remove it when no process uses the domain, or choose another root-path and prefix"
    )]
    OtherUser {
        /// Root path and prefix.
        domain: String,
        /// The folder, file or segment.
        path: String,
        /// Name and number of its owner.
        owner: String,
        /// Name and number of the process's user.
        ours: String,
    },
    /// The domain could not be locked, or not before the process was asked to end.
    #[error("cannot join the iceoryx2 domain {domain}: {cause}")]
    Locked {
        /// Root path and prefix.
        domain: String,
        /// The file that cannot be locked, or the process that holds the lock.
        cause: String,
    },
    /// Shared memory has no room for what every process of a domain needs.
    #[error(
        "cannot join the iceoryx2 domain {domain}: /dev/shm has {free_bytes} bytes free, and {needed_bytes} are needed; remove what nobody uses there, or enlarge it: mount -o remount,size=256M /dev/shm"
    )]
    SharedMemoryFull {
        /// Root path and prefix.
        domain: String,
        /// Approximate number of bytes needed.
        needed_bytes: u64,
        /// Free bytes.
        free_bytes: u64,
    },
    /// iceoryx2 kept failing during retries for most of a second.
    #[error("cannot join the iceoryx2 domain {domain}: {cause}")]
    Failed {
        /// Root path and prefix.
        domain: String,
        /// What has run out or cannot be written, iceoryx2's last error, and the remedy.
        cause: String,
    },
}

isochrone_model::debug_as_display!(DomainError, JoinError);
