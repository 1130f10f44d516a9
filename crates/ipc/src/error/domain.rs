//! Why there is no domain, or no part in one.

use thiserror::Error;

/// Most bytes of root path and prefix. iceoryx2's paths end at 255, and its own names take the rest;
/// it panics beyond.
pub(crate) const MAX_DOMAIN_BYTES: usize = 120;

/// Why a [`Domain`](crate::Domain) cannot be used.
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DomainError {
    /// There is no file at the path that was given.
    #[error(
        "iceoryx2 configuration {path}: no such file; give an existing file, or none for the defaults"
    )]
    NotFound {
        /// The path as given.
        path: String,
    },
    /// The path is not ASCII, is empty or is longer than iceoryx2 can hold (255 bytes).
    #[error(
        "iceoryx2 configuration {path}: not a usable file path; use an ASCII path of at most 255 bytes"
    )]
    UnusablePath {
        /// The path as given.
        path: String,
    },
    /// The names of iceoryx2's files would exceed its limit.
    #[error(
        "root-path {root_path} and prefix {prefix} are too long for iceoryx2; together at most {MAX_DOMAIN_BYTES} bytes"
    )]
    TooLong {
        /// The root path.
        root_path: String,
        /// The prefix.
        prefix: String,
    },
    /// The folder of an isolated domain cannot be created.
    #[error(
        "cannot create a folder in {place} for a domain: {cause}; set TMPDIR to a writable folder"
    )]
    NoFolder {
        /// Parent folder.
        place: String,
        /// The system's error.
        cause: String,
    },
    /// The file exists but cannot be read.
    #[error("iceoryx2 configuration {path}: cannot be read; check its permissions")]
    Unreadable {
        /// The path of the file.
        path: String,
    },
    /// It is a directory, a pipe or a device, or larger than 1 MiB.
    #[error(
        "iceoryx2 configuration {path}: not an ordinary file of at most 1 MiB; give one, or none for the defaults"
    )]
    NoFile {
        /// The path as given.
        path: String,
    },
    /// The word that an isolated domain's prefix begins with cannot stand in the names of files.
    #[error(
        "isolated domain {word:?}: the word begins the names of its files; write it with ASCII letters, digits, - and _"
    )]
    Word {
        /// The word as given.
        word: String,
    },
    /// The file is empty, so iceoryx2 would use its defaults for everything.
    #[error(
        "iceoryx2 configuration {path}: empty; write [global] with a root-path and a prefix, or give no file for the defaults"
    )]
    Empty {
        /// The path of the file.
        path: String,
    },
    /// The file is not TOML, or has a value that iceoryx2 does not accept.
    #[error(
        "iceoryx2 configuration {path}:{line}:{column}: not a valid iceoryx2 0.10 configuration: {cause}; compare it with `iox2 config show`"
    )]
    Malformed {
        /// The path of the file.
        path: String,
        /// From 1.
        line: usize,
        /// From 1, in characters.
        column: usize,
        /// What is wrong there.
        cause: String,
    },
    /// The file has a key that iceoryx2 does not know and would ignore.
    #[error("iceoryx2 configuration {path}:{line}:{column}: {table} has no key {key:?}; {remedy}")]
    UnknownKey {
        /// The path of the file.
        path: String,
        /// From 1.
        line: usize,
        /// From 1, in characters.
        column: usize,
        /// The table that contains the key, such as `[global]`.
        table: String,
        /// The key as it is written.
        key: String,
        /// What to write instead.
        remedy: String,
    },
    /// The root path is relative, so processes started in different folders would not share a domain.
    #[error(
        "iceoryx2 configuration {path}:{line}:{column}: root-path {root_path:?} is relative, so each folder would have a domain of its own; begin it with /"
    )]
    RelativeRootPath {
        /// The path of the file.
        path: String,
        /// From 1.
        line: usize,
        /// From 1, in characters.
        column: usize,
        /// The root path.
        root_path: String,
    },
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
