//! Connections that failed, and how they come about after all.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::peers::Peers;
use crate::service;
use crate::{OpenError, Participant, Service, give_up_file_override, space};

/// The first attempts follow each other quickly: most failures are two ports that connect to each
/// other at the same moment.
const FIRST_PAUSE: Duration = Duration::from_millis(20);
/// The last ones do not: what fails for long (no file descriptor, no memory) fails in every attempt,
/// and each attempt costs the port's slack some microseconds.
const LONGEST_PAUSE: Duration = Duration::from_secs(1);

/// Retries a port's failed connections.
///
/// iceoryx2 connects a port when the list of its peers changes and never retries a connection that
/// failed, so a reader could wait forever for a publisher that exists. `Repair` notices the failure
/// and changes the list by adding a peer that leaves at once. It may be used in another thread than
/// its port, and may outlive it.
#[derive(Debug)]
pub struct Repair {
    service: String,
    peer: Peer,
    failures: Arc<AtomicU64>,
    /// How many peers the port last saw, and how many of them were told.
    present: Arc<AtomicUsize>,
    told: usize,
    /// Failures that an attempt followed.
    answered: u64,
    pause: Duration,
    not_before: Option<Instant>,
    /// Whether it was told that the attempts do not help.
    has_warned: bool,
}

/// What the port connects to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Peer {
    Publisher,
    Subscriber,
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Publisher => "publisher",
            Self::Subscriber => "subscriber",
        })
    }
}

impl Repair {
    pub(crate) fn new(service: &str, peer: Peer, peers: &Peers) -> Self {
        let service = service.to_owned();
        Self {
            service,
            peer,
            failures: peers.failure_count(),
            present: peers.present(),
            told: 0,
            answered: 0,
            pause: FIRST_PAUSE,
            not_before: None,
            has_warned: false,
        }
    }

    /// Whether the port still exists.
    pub(crate) fn has_port(&self) -> bool {
        // The port counts with the same counter.
        Arc::strong_count(&self.failures) > 1
    }

    /// Makes the port retry if a connection has failed since the last attempt. Returns whether it did.
    ///
    /// Call it in an ordinary thread, many times a second. It loads two atomics as long as nothing
    /// fails, and otherwise takes some hundred microseconds for file operations. If connecting keeps
    /// failing for more than a second, one warning is logged.
    pub fn tend<S: Service>(&mut self, participant: &Participant<S>) -> bool {
        self.tell_peers();
        // Read before the attempt: a failure that the attempt itself meets calls for another.
        let failures = self.failures.load(Ordering::Relaxed);
        if failures == self.answered && self.not_before.is_none() {
            return false;
        }
        let now = Instant::now();
        if self.not_before.is_some_and(|instant| now < instant) {
            return false;
        }
        if failures == self.answered {
            self.pause = FIRST_PAUSE;
            self.not_before = None;
            self.has_warned = false;
            return false;
        }
        self.not_before = Some(now + self.pause);
        self.pause = (self.pause * 2).min(LONGEST_PAUSE);
        // What keeps the port from connecting may keep us from it too, until it has passed.
        let shown = self.show_a_peer(participant);
        if self.pause == LONGEST_PAUSE && !std::mem::replace(&mut self.has_warned, true) {
            self.warn(shown.as_ref().err());
        }
        if shown.is_ok() {
            self.answered = failures;
        }
        shown.is_ok()
    }

    /// Logs how many peers the port is connected to, where that has changed.
    fn tell_peers(&mut self) {
        let present = self.present.load(Ordering::Relaxed);
        if present != self.told {
            self.told = present;
            let ending = if present == 1 { "" } else { "s" };
            tracing::debug!("service {:?} has {present} {}{ending} now", self.service, self.peer);
        }
    }

    /// Says that the attempts do not help, and `why` no attempt could be made, if so.
    fn warn(&self, why: Option<&OpenError>) {
        let service = &self.service;
        let peer = self.peer;
        let why = match why {
            Some(error) => error.to_string(),
            None => {
                "its memory cannot be opened; see that file descriptors and memory suffice, and \
                     that all processes run as one user"
                    .to_owned()
            }
        };
        tracing::warn!(
            "a connection to a {peer} of service {service:?} keeps failing, and is tried again every \
             second: {why}"
        );
    }

    /// Adds a peer to the list and takes it away.
    fn show_a_peer<S: Service>(&self, participant: &Participant<S>) -> Result<(), OpenError> {
        let Some(opened) = service::open_existing_at_once(participant, &self.service)? else {
            return Ok(());
        };
        // In full shared memory the attempt would kill the process that it is to help.
        space::require(0).map_err(|shortage| shortage.of_service(&self.service))?;
        let failed = |cause: String| service::failed(participant, &self.service, cause);
        match self.peer {
            Peer::Publisher => {
                let port = {
                    let _given_up = give_up_file_override();
                    opened.publisher_builder().initial_max_slice_len(1).create()
                };
                port.map(drop).map_err(|cause| failed(cause.to_string()))
            }
            Peer::Subscriber => {
                let port = {
                    let _given_up = give_up_file_override();
                    opened.subscriber_builder().buffer_size(1).create()
                };
                port.map(drop).map_err(|cause| failed(cause.to_string()))
            }
        }
    }
}
