//! Errors of opening ports.

use thiserror::Error;

use super::{LayoutError, ServiceNameError};

/// The name for errors that are not about one service.
pub(crate) const EVERYTHING: &str = "*";

/// Why a port of a service could not be opened.
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The service name is not possible.
    #[error(transparent)]
    ServiceName(#[from] ServiceNameError),
    /// The layout cannot be announced.
    #[error("service {service:?}: {source}")]
    Layout {
        /// Name of the service.
        service: String,
        /// What is wrong with the layout.
        source: LayoutError,
    },
    /// The service does not carry frames, or frames of another version, or its layout service does not
    /// carry layouts.
    #[error(
        "service {service:?} carries {carries}, but {needs}; use another service name, or end all processes of the service and start again"
    )]
    OtherTypes {
        /// Name of the service.
        service: String,
        /// Its types and sizes.
        carries: String,
        /// What is needed, with types and sizes: `frames are …`.
        needs: String,
    },
    /// The service was created by another version of iceoryx2.
    #[error(
        "service {service:?} was created by another version of iceoryx2, this process has {ours}; run the same version everywhere, or separate the domains by prefix and root path"
    )]
    OtherVersion {
        /// Name of the service.
        service: String,
        /// Version of this process.
        ours: String,
    },
    /// The service already has a publisher.
    #[error(
        "service {service:?} is written by {other}; a service has one writer: end that one, or use another service name (only one that is not of isochrone can be taken over)"
    )]
    SecondPublisher {
        /// Name of the service.
        service: String,
        /// Node name, executable and process id of the other publisher.
        other: String,
    },
    /// A living program that is not of isochrone writes the service.
    #[error(
        "service {service:?} is written by {other}; a service has one writer: end that one, use another service name, or take the service over from it (--take-over; take_over in a program)"
    )]
    PlainWriter {
        /// Name of the service.
        service: String,
        /// Node name, executable and process id of the writer.
        other: String,
    },
    /// A writer of another machine reaches this one through a link.
    #[error(
        "service {service:?} is written on another machine already{}, whose frames arrive through {through}; a service has one writer: end that one, or use another service name",
        by(.publisher)
    )]
    FarWriter {
        /// Name of the service.
        service: String,
        /// Name that the writer announces; empty if it announces none.
        publisher: String,
        /// Node, executable and process id of the link.
        through: String,
    },
    /// All places that the service's creator provided are taken.
    #[error(
        "service {service:?} has no place for another {what} (its creator provided {limit}{}); end one, or end all of them and let a node of isochrone create the service{}",
        taken(.holders),
        with_more(.what)
    )]
    Full {
        /// Name of the service.
        service: String,
        /// `publisher`, `subscriber`, `server`, `client` or `node`.
        what: &'static str,
        /// How many there can be.
        limit: usize,
        /// The nodes that hold the places: name, program and process id; empty if unknown.
        holders: String,
    },
    /// The domain could not be locked, or not before the process was asked to end.
    #[error("{} in {domain} cannot be opened: {cause}", named(service))]
    Locked {
        /// Name of the service.
        service: String,
        /// Root path and prefix.
        domain: String,
        /// The file that cannot be locked, or the process that holds the lock.
        cause: String,
    },
    /// The service belongs to another user.
    #[error(
        "service {service:?} in {domain}: no permission; all its processes must run as one user"
    )]
    Permission {
        /// Name of the service.
        service: String,
        /// Root path and prefix.
        domain: String,
    },
    /// There is no room for the frames, requests or answers.
    #[error(
        "service {service:?}: /dev/shm has {free_bytes} bytes free, and its messages need {needed_bytes}; remove what nobody uses there, or enlarge it: mount -o remount,size=256M /dev/shm"
    )]
    SharedMemoryFull {
        /// Name of the service.
        service: String,
        /// Approximate number of bytes needed.
        needed_bytes: u64,
        /// Free bytes.
        free_bytes: u64,
    },
    /// A limit of this process leaves no room for them.
    #[error("service {service:?}: {cause}")]
    Limit {
        /// Name of the service.
        service: String,
        /// The limit, and how to raise it.
        cause: String,
    },
    /// The service's files are damaged, or were removed while it was in use.
    #[error(
        "service {service:?} in {domain} is damaged; end all its processes, then remove its files in that place"
    )]
    Corrupted {
        /// Name of the service.
        service: String,
        /// Root path and prefix.
        domain: String,
    },
    /// iceoryx2 kept failing during retries for most of a second.
    #[error("{} in {domain} cannot be opened: {cause}", named(service))]
    Failed {
        /// Name of the service.
        service: String,
        /// Root path and prefix.
        domain: String,
        /// What has run out or cannot be written, iceoryx2's last error, and the remedy.
        cause: String,
    },
}

/// A service, or all of them where it is they that were looked for.
fn named(service: &str) -> String {
    if service == EVERYTHING { "the services".into() } else { format!("service {service:?}") }
}

fn taken(holders: &str) -> String {
    if holders.is_empty() { String::new() } else { format!("; taken: {holders}") }
}

/// What a node's configuration can do about it.
fn with_more(what: &str) -> &'static str {
    if what == "subscriber" { ", with more `readers` for its output" } else { "" }
}

fn by(publisher: &str) -> String {
    if publisher.is_empty() { String::new() } else { format!(" by {publisher:?}") }
}

isochrone_model::debug_as_display!(OpenError);
