//! Retrying failed connections.

use std::fmt;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::OpenError;
use crate::peers::Peers;

/// The first attempts follow each other quickly: most failures are two ports that connect to each
/// other at the same moment.
const FIRST_PAUSE: Duration = Duration::from_millis(20);
/// Later ones do not: a lasting cause (no file descriptor, no memory) makes every attempt fail, and each attempt
/// costs the port's slack some microseconds.
const LONGEST_PAUSE: Duration = Duration::from_secs(1);

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

/// The repairs of a participant's ports.
#[derive(Debug, Default)]
pub(crate) struct Repairs(Mutex<Vec<Repair>>);

impl Repairs {
    /// Adds those of a port that is being opened.
    pub(crate) fn adopt(&self, service: &str, peer: Peer, peers: &Peers) {
        let mut repairs = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        repairs.retain(Repair::has_port);
        repairs.push(Repair::new(service, peer, peers));
    }

    /// Makes each port with a failed connection see a peer that joins and leaves at once, with `show`.
    pub(crate) fn tend(&self, show: impl Fn(&str, Peer) -> Result<(), OpenError>) {
        // No thread of a cycle takes this lock: ports are opened before the first one.
        let mut repairs = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        repairs.retain(Repair::has_port);
        for repair in repairs.iter_mut() {
            repair.tend(&show);
        }
    }
}

/// Retries a port's failed connections.
///
/// iceoryx2 connects a port when the list of its peers changes and never retries a connection that
/// failed, so a reader could wait forever for a publisher that exists. `Repair` notices the failure
/// and changes the list by adding a peer that leaves at once.
#[derive(Debug)]
struct Repair {
    service: String,
    peer: Peer,
    failures: Arc<AtomicU64>,
    /// How many peers the port last saw, and the count that was last logged.
    present: Arc<AtomicUsize>,
    logged_count: usize,
    /// Count of failures up to the last attempt.
    answered: u64,
    pause: Duration,
    not_before: Option<Instant>,
    /// Whether the warning that the attempts do not help was logged.
    has_warned: bool,
}

impl Repair {
    fn new(service: &str, peer: Peer, peers: &Peers) -> Self {
        let service = service.to_owned();
        Self {
            service,
            peer,
            failures: peers.failure_count(),
            present: peers.present(),
            logged_count: 0,
            answered: 0,
            pause: FIRST_PAUSE,
            not_before: None,
            has_warned: false,
        }
    }

    /// Whether the port still exists.
    fn has_port(&self) -> bool {
        // The port counts with the same counter.
        Arc::strong_count(&self.failures) > 1
    }

    /// Makes the port retry if a connection has failed since the last attempt. If connecting keeps
    /// failing for more than a second, one warning is logged.
    fn tend(&mut self, show: impl Fn(&str, Peer) -> Result<(), OpenError>) {
        self.tell_peers();
        // Read before the attempt: a failure that the attempt itself meets calls for another.
        let failures = self.failures.load(Ordering::Relaxed);
        if failures == self.answered && self.not_before.is_none() {
            return;
        }
        let now = Instant::now();
        if self.not_before.is_some_and(|instant| now < instant) {
            return;
        }
        if failures == self.answered {
            self.pause = FIRST_PAUSE;
            self.not_before = None;
            self.has_warned = false;
            return;
        }
        self.not_before = Some(now + self.pause);
        self.pause = (self.pause * 2).min(LONGEST_PAUSE);
        // What keeps the port from connecting may keep us from showing a peer, too.
        let shown = show(&self.service, self.peer);
        if self.pause == LONGEST_PAUSE && !std::mem::replace(&mut self.has_warned, true) {
            self.warn(shown.as_ref().err());
        }
        if shown.is_ok() {
            self.answered = failures;
        }
    }

    /// Logs how many peers the port is connected to, where that has changed.
    fn tell_peers(&mut self) {
        let present = self.present.load(Ordering::Relaxed);
        if present != self.logged_count {
            self.logged_count = present;
            let ending = if present == 1 { "" } else { "s" };
            tracing::debug!("service {:?} has {present} {}{ending} now", self.service, self.peer);
        }
    }

    /// Warns that the attempts do not help, and `why` no attempt could be made, if so.
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
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn a_port_with_a_failed_connection_is_shown_a_peer_until_it_ends() {
        let (repairs, peers) = (Repairs::default(), Peers::default());
        let shown = Cell::new(0);
        let tend = || {
            repairs.tend(|service, peer| {
                assert_eq!((service, peer), ("plant/a", Peer::Publisher));
                shown.set(shown.get() + 1);
                Ok(())
            });
            shown.get()
        };
        repairs.adopt("plant/a", Peer::Publisher, &peers);
        assert_eq!(tend(), 0, "no connection failed");
        peers.failure_count().fetch_add(1, Ordering::Relaxed);
        assert_eq!(tend(), 1);
        assert_eq!(tend(), 1, "it was answered");
        peers.failure_count().fetch_add(1, Ordering::Relaxed);
        drop(peers);
        assert_eq!(tend(), 1, "nobody is left to connect");
        assert!(repairs.0.lock().unwrap().is_empty());
    }
}
