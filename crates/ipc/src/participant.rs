//! The process's membership in an iceoryx2 domain.

use std::fs::{self, DirEntry, Metadata};
use std::marker::PhantomData;
use std::os::unix::fs::PermissionsExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::OnceLock;
use std::thread;
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder, NodeCreationFailure};
use iceoryx2::prelude::{LogLevel, NodeName, SignalHandlingMode};
use rustix::thread::{CapabilitySet, capabilities, set_capabilities};

use crate::backoff::Backoff;
use crate::{JoinError, Service, space};

/// Set once somebody chose a log level, so that joining does not override the choice.
pub(crate) static LOG_LEVEL: OnceLock<()> = OnceLock::new();

/// How long to wait, per dead node, for another process that is cleaning up after it.
const CLEANUP_TIMEOUT: Duration = Duration::from_millis(200);

/// A process (or a part of one) that takes part in an iceoryx2 domain; ports belong to one.
///
/// Ports stay usable after their participant was dropped; it then ends with the last of them.
/// iceoryx2 installs no signal handler through it. It can be shared between threads; the ports of
/// [`ipc::Service`](crate::ipc::Service) stay in the thread that opened them.
#[derive(Debug)]
pub struct Participant<S: Service> {
    node: Node<S>,
}

impl<S: Service> Participant<S> {
    /// Joins the domain of `config` under `name`, and removes what killed processes left in it.
    ///
    /// Takes milliseconds; waits up to a second for others that start at the same moment.
    ///
    /// # Errors
    /// `name` is not a node name, or iceoryx2 cannot use the domain.
    pub fn join(name: &str, config: &Config) -> Result<Self, JoinError> {
        Self::join_with(name, config.clone())
    }

    /// As [`join`](Self::join), for ports in real-time threads: connecting never waits.
    ///
    /// A peer that is not fully made yet, or never will be because it was killed, is a failed
    /// connection at once instead of after the creation timeout. Have a [`Repair`](crate::Repair)
    /// for each port, and see [`give_up_file_override`].
    ///
    /// # Errors
    /// As `join`.
    pub fn join_for_real_time(name: &str, config: &Config) -> Result<Self, JoinError> {
        let mut config = config.clone();
        config.global.creation_timeout = Duration::ZERO;
        Self::join_with(name, config)
    }

    fn join_with(name: &str, mut config: Config) -> Result<Self, JoinError> {
        LOG_LEVEL.get_or_init(|| iceoryx2::prelude::set_log_level(LogLevel::Warn));
        let node_name =
            NodeName::new(name).map_err(|_| JoinError::Name { name: name.to_owned() })?;
        // iceoryx2 would clean up on its own when a node is made or dropped and when a service
        // is opened. That is done here instead, see `clean_up`.
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;

        remove_half_made(&config);
        space::require(0).map_err(|(needed_bytes, free_bytes)| JoinError::SharedMemoryFull {
            domain: domain(&config),
            needed_bytes,
            free_bytes,
        })?;
        let mut backoff = Backoff::new();
        let node = loop {
            let created = NodeBuilder::new()
                .name(&node_name)
                .signal_handling_mode(SignalHandlingMode::Disabled)
                .config(&config)
                .create();
            match created {
                Ok(node) => break node,
                Err(NodeCreationFailure::InsufficientPermissions) => {
                    return Err(JoinError::Permission { domain: domain(&config) });
                }
                // Two processes that create the domain's first files at once can trip each other.
                Err(_) if backoff.try_again() => {}
                Err(cause) => {
                    return Err(JoinError::Failed {
                        domain: domain(&config),
                        cause: cause.to_string(),
                    });
                }
            }
        };
        let participant = Self { node };
        participant.clean_up();
        Ok(participant)
    }

    /// The name under which this participant joined.
    pub fn name(&self) -> &str {
        self.node.name().as_str()
    }

    /// Removes what killed processes left: their ports, samples and files.
    ///
    /// Touches many files; never call it in a cycle. Others that clean up at the same time are
    /// waited for, 200 ms at most per dead process.
    pub fn clean_up(&self) {
        // iceoryx2 panics when it meets a node that is between "created" and "alive"
        // (eclipse-iceoryx/iceoryx2#1880). That node is not dead, so there is nothing to do.
        let _ = catch_unwind(AssertUnwindSafe(|| {
            self.node.blocking_cleanup_dead_nodes(CLEANUP_TIMEOUT)
        }));
    }

    pub(crate) fn node(&self) -> &Node<S> {
        &self.node
    }

    pub(crate) fn domain(&self) -> String {
        domain(self.node.config())
    }
}

/// Gives up, for the calling thread, root's right to open files whatever their permissions say,
/// until what this returns is dropped.
///
/// iceoryx2 marks shared memory that is still being made by its permissions. Root opens it all the
/// same, finds it empty, and sleeps a millisecond at a time until it is not: for ever, if its maker
/// was killed. Without the right a port of this thread sees the mark, and goes on. Call it after
/// opening the ports, and drop it before them: ports remove files, in directories that another user
/// may have made. For a thread without privileges it does nothing.
pub fn give_up_file_override() -> FileOverrideGivenUp {
    let given_up = give_up_effective(CapabilitySet::DAC_OVERRIDE | CapabilitySet::DAC_READ_SEARCH);
    FileOverrideGivenUp { given_up, of_this_thread: PhantomData }
}

/// Takes capabilities out of the thread's effective set; returns those that were in it.
fn give_up_effective(unwanted: CapabilitySet) -> CapabilitySet {
    let Ok(mut sets) = capabilities(None) else { return CapabilitySet::empty() };
    let given_up = sets.effective & unwanted;
    if given_up.is_empty() {
        return given_up;
    }
    sets.effective -= given_up;
    // To have fewer capabilities is always allowed.
    match set_capabilities(None, sets) {
        Ok(()) => given_up,
        Err(_) => CapabilitySet::empty(),
    }
}

/// Gives back what [`give_up_file_override`] took, when it is dropped.
#[must_use = "dropping it gives the right back"]
#[derive(Debug)]
pub struct FileOverrideGivenUp {
    given_up: CapabilitySet,
    /// Each thread has its own capabilities.
    of_this_thread: PhantomData<*const ()>,
}

impl Drop for FileOverrideGivenUp {
    fn drop(&mut self) {
        if self.given_up.is_empty() {
            return;
        }
        if let Ok(mut sets) = capabilities(None) {
            // They are still permitted, so they may become effective again.
            sets.effective |= self.given_up;
            let _ = set_capabilities(None, sets);
        }
    }
}

/// Removes segments of the domain that have no size, or that nobody may read yet. Their creator was
/// killed before it had sized or filled them. iceoryx2 0.10, run as root, would wait for ever for
/// the size; and where it is the node counter that nobody filled, no process could join again.
fn remove_half_made(config: &Config) {
    /// Making a segment takes microseconds; one that stays half-made for so long belongs to nobody.
    const ABANDONED: Duration = Duration::from_millis(200);
    const OWNER_READ: u32 = 0o400;
    let prefix = config.global.prefix.to_string();
    let half_made = |entry: &DirEntry| {
        let ours = is_segment_of(&prefix, entry.file_name().as_encoded_bytes());
        let unfinished = |file: Metadata| {
            file.is_file() && (file.len() == 0 || file.permissions().mode() & OWNER_READ == 0)
        };
        ours && entry.metadata().is_ok_and(unfinished)
    };
    let find = || {
        let entries = fs::read_dir("/dev/shm").into_iter().flatten().flatten();
        entries.filter(half_made).map(|entry| entry.path()).collect::<Vec<_>>()
    };
    let before = find();
    if before.is_empty() {
        return;
    }
    thread::sleep(ABANDONED);
    for segment in find().iter().filter(|segment| before.contains(segment)) {
        // Another process may do the same at this moment.
        let _ = fs::remove_file(segment);
    }
}

/// Whether shared memory of this name belongs to the domain with this prefix. iceoryx2 names it by the
/// prefix, the SHA-1 of a type in hexadecimal digits, an underscore and more; by the prefix alone,
/// that of a domain whose prefix begins with ours would look like ours.
fn is_segment_of(prefix: &str, name: &[u8]) -> bool {
    const HASH_DIGITS: usize = 40;
    let hash_and_more = name.strip_prefix(prefix.as_bytes());
    let split = hash_and_more.and_then(|rest| rest.split_at_checked(HASH_DIGITS));
    split.is_some_and(|(hash, more)| {
        hash.iter().all(u8::is_ascii_hexdigit) && more.starts_with(b"_")
    })
}

fn domain(config: &Config) -> String {
    format!("{} (prefix {})", config.global.root_path(), config.global.prefix)
}
