//! The process's membership in an iceoryx2 domain.

use std::sync::OnceLock;
use std::time::Duration;

use iceoryx2::node::{Node, NodeBuilder, NodeCreationFailure};
use iceoryx2::prelude::{LogLevel, NodeName, SignalHandlingMode};

use crate::backoff::Backoff;
use crate::domain::{Domain, EndsLocked, LockGuard, Membership};
use crate::frames::repair::Repairs;
use crate::{JoinError, OpenError, Service, exhausted, give_up_file_override, ipc, local, space};

/// Set once the program has chosen a log level, so that joining does not override it.
pub(crate) static LOG_LEVEL: OnceLock<()> = OnceLock::new();

/// A process, or a part of one, in an iceoryx2 domain. Every port belongs to a participant.
///
/// iceoryx2 never retries a failed connection: an ordinary thread that calls [`tend`](Self::tend)
/// makes the participant's ports retry.
///
/// Ports stay usable after their participant is dropped; it then ends with the last of them. It
/// installs no signal handler. A participant can be shared between threads, but ports of
/// [`ipc::Service`](crate::ipc::Service) stay in the thread that opened them.
///
/// Fork only to `exec`: a child that drops a participant or a port removes the files of its parent,
/// and one that goes on without `exec` must leave the process by `_exit`. The descriptors of iceoryx2
/// 0.10 are not closed on `exec`; a child inherits them, which costs it descriptors and keeps removed
/// memory until it ends.
#[derive(Debug)]
pub struct Participant<S: Service> {
    node: EndsLocked<Node<S>>,
    membership: Membership,
    repairs: Repairs,
    /// Whether it takes services over from writers of other software.
    takes_over: bool,
    /// Whether it is one of two processes of its name that stand in for each other.
    is_twin: bool,
}

impl Participant<ipc::Service> {
    /// Joins a domain under `name`, and removes what killed processes left in it. Its ports connect to
    /// those of other processes.
    ///
    /// Takes milliseconds. Waits for processes that start or end at the same moment. If one of them is
    /// stopped meanwhile, it waits until that process continues and names it in a warning (see
    /// [`interrupt_waiting_by`](crate::interrupt_waiting_by)).
    ///
    /// # Errors
    /// `name` is not a valid node name, something in the domain belongs to another user, or iceoryx2
    /// cannot use the domain.
    pub fn join(name: &str, domain: impl AsRef<Domain>) -> Result<Self, JoinError> {
        Self::join_variant(name, domain)
    }
}

impl Participant<local::Service> {
    /// Joins a domain within this process: its ports connect to those of the process's other local
    /// participants, and leave no files.
    ///
    /// # Errors
    /// `name` is not a valid node name, or iceoryx2 cannot use the domain.
    pub fn join_local(name: &str, domain: impl AsRef<Domain>) -> Result<Self, JoinError> {
        Self::join_variant(name, domain)
    }
}

impl<S: Service> Participant<S> {
    /// Joins a domain with any variant of iceoryx2's services. [`join`](Participant::join) and
    /// [`join_local`](Participant::join_local) are the usual ones.
    ///
    /// # Errors
    /// As [`join`](Participant::join).
    pub fn join_variant(name: &str, domain: impl AsRef<Domain>) -> Result<Self, JoinError> {
        let domain = domain.as_ref();
        Self::join_with(name, domain, domain.config().global.creation_timeout)
    }

    /// Joins again under the same name, and refuses half-made peers at once.
    pub(crate) fn rejoin_without_waiting(&self) -> Result<Self, JoinError> {
        let again = Self::join_with(self.name(), self.membership.domain(), Duration::ZERO)?;
        Ok(Self { is_twin: self.is_twin, ..again.taking_over(self.takes_over) })
    }

    fn join_with(
        name: &str,
        domain: &Domain,
        creation_timeout: Duration,
    ) -> Result<Self, JoinError> {
        LOG_LEVEL.get_or_init(|| iceoryx2::prelude::set_log_level(LogLevel::Warn));
        let node_name = NodeName::new(name).map_err(|_| JoinError::of_name(&beginning(name)))?;
        let mut config = domain.config_without_clean_up();
        config.global.creation_timeout = creation_timeout;

        let membership = Membership::claim::<S>(domain, config, name)?;
        space::require(0).map_err(|shortage| shortage.of_domain(&membership.describe()))?;
        let refused = |cause: &str| JoinError::of_domain(&membership.describe(), cause);
        let failed = |cause: String| {
            let help = "see that the root path is writable, and /dev/shm not full";
            refused(&exhausted::or(membership.config(), cause, help))
        };
        let mut backoff = Backoff::new();
        let node = loop {
            let held = membership.lock().acquire();
            let held = held.map_err(|cause| refused(&cause.to_string()))?;
            membership.prepare_for_node::<S>(&held);
            let created = {
                let _given_up = give_up_file_override();
                NodeBuilder::new()
                    .name(&node_name)
                    .signal_handling_mode(SignalHandlingMode::Disabled)
                    .config(membership.config())
                    .create()
            };
            drop(held);
            match created {
                Ok(node) => break node,
                Err(NodeCreationFailure::InsufficientPermissions) => {
                    return Err(refused(
                        "no permission; all its processes must run as one user, or choose another root-path and \
                         prefix",
                    ));
                }
                // Half-made files are removed once they are old enough to belong to no living process.
                Err(_) if backoff.try_again() => {}
                Err(cause) => return Err(failed(cause.to_string())),
            }
        };
        Ok(Self {
            node: membership.keep(node),
            membership,
            repairs: Repairs::default(),
            takes_over: false,
            is_twin: false,
        })
    }

    /// Whether its publishers take a service over from a living writer that is not of this crate, such as
    /// one that uses iceoryx2 alone, instead of being refused. Readers follow them at once, and count the frames of
    /// the other as those of a second writer until it ends.
    #[must_use]
    pub fn taking_over(self, takes_over: bool) -> Self {
        Self { takes_over, ..self }
    }

    /// One of two processes of this name that stand in for each other: its publishers open beside those of the
    /// other, have the port name [`TWIN_PORT_NAME`](crate::TWIN_PORT_NAME), and send with the
    /// [term](crate::FramePublisher::go_on) of the twin that holds the node.
    #[must_use]
    pub fn as_twin(self) -> Self {
        Self { is_twin: true, ..self }
    }

    /// Whether it is [one of two](Self::as_twin).
    pub fn is_twin(&self) -> bool {
        self.is_twin
    }

    pub(crate) fn takes_over(&self) -> bool {
        self.takes_over
    }

    /// The name under which this participant joined.
    pub fn name(&self) -> &str {
        self.node.name().as_str()
    }

    /// Removes the ports, samples and files of killed processes.
    ///
    /// Touches many files and waits for the domain's lock; never call it in a cycle.
    pub fn clean_up(&self) {
        if let Ok(held) = self.membership.lock().acquire() {
            self.membership.sweep::<S>(&held);
        }
    }

    pub(crate) fn repairs(&self) -> &Repairs {
        &self.repairs
    }

    pub(crate) fn node(&self) -> &Node<S> {
        &self.node
    }

    /// Keeps other processes from creating or removing anything in the domain while `service` is opened.
    pub(crate) fn lock(&self, service: &str) -> Result<LockGuard, OpenError> {
        let locked = self.membership.lock().acquire();
        locked.map_err(|cause| self.locked(service, cause.to_string()))
    }

    /// As [`lock`](Self::lock), but fails at once if another process has the lock.
    pub(crate) fn lock_at_once(&self, service: &str) -> Result<LockGuard, OpenError> {
        let busy = || "another process starts or ends at this moment".to_owned();
        let locked = self.membership.lock().try_acquire().map_err(|cause| cause.to_string());
        locked.and_then(|held| held.ok_or_else(busy)).map_err(|cause| self.locked(service, cause))
    }

    /// Whether no process is starting or ending in the domain right now, so that opening or ending a port would not
    /// wait. This may change at any time; it is for running processes that should not be held up by one that is
    /// stopped during its start.
    pub fn may_open_at_once(&self) -> bool {
        matches!(self.membership.lock().try_acquire(), Ok(Some(_)))
    }

    fn locked(&self, service: &str, cause: String) -> OpenError {
        OpenError::Locked { service: service.to_owned(), domain: self.domain(), cause }
    }

    pub(crate) fn membership(&self) -> &Membership {
        &self.membership
    }

    /// Root path and prefix of its domain, for messages.
    pub fn domain(&self) -> String {
        self.membership.describe()
    }
}

/// Most characters of a name that an error repeats.
const SHOWN: usize = 160;

/// A name that is too long for a message, cut.
fn beginning(name: &str) -> String {
    match name.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", name.get(..end).unwrap_or_default()),
        None => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use crate::{IsolatedDomain, local};

    use super::*;

    #[test]
    fn a_name_that_is_too_long_is_refused_in_a_message_of_readable_length() {
        let domain = IsolatedDomain::new("isotest").unwrap();
        let join =
            |name: &str| Participant::<local::Service>::join_local(name, &domain).unwrap_err();
        let message = join(&"x".repeat(100_000)).to_string();
        assert!(message.len() < 300 && message.contains("at most 128"), "{message}");
        assert!(join("ä").to_string().contains("\"ä\""));
    }
}
