//! The upkeep of a request-response service, beside its server.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::service::port_factory::PortFactory as _;

use super::client;
use super::service::{self, RequestService, process_of};
use crate::{Participant, Service, exhausted, give_up_file_override, space};

/// How often dead clients are looked for while there are clients.
const PAUSE: Duration = Duration::from_millis(250);

/// Removes clients of a [`RequestServer`](super::RequestServer) that died, and makes the server retry failed
/// connections.
///
/// Removal takes milliseconds and waits for the domain's lock, which the serving thread must not do. It may outlive
/// its server, and keeps the service in existence for as long.
#[derive(Debug)]
pub struct RequestUpkeep<S: Service> {
    service: Arc<RequestService<S>>,
    failures: Arc<AtomicU64>,
    /// Count of failures up to the last attempt.
    answered: u64,
    not_before: Option<Instant>,
    /// Whether the log says that there are too few descriptors.
    is_short_told: bool,
    /// Servers of other processes that were there at the last look.
    strangers: Vec<(UniqueNodeId, u128)>,
}

impl<S: Service> RequestUpkeep<S> {
    pub(super) fn new(service: Arc<RequestService<S>>, failures: Arc<AtomicU64>) -> Self {
        let strangers = Vec::new();
        Self { service, failures, answered: 0, not_before: None, is_short_told: false, strangers }
    }

    /// Does the upkeep that is due; returns whether dead clients were removed.
    ///
    /// For an ordinary thread, some ten times a second. While there are no clients it reads two
    /// counters; otherwise it looks at most every 250 ms whether all of them live.
    pub fn tend(&mut self, participant: &Participant<S>) -> bool {
        let failures = self.failures.load(Ordering::Relaxed);
        let has_failures = failures != self.answered;
        if !has_failures && self.service.dynamic_config().number_of_clients() == 0 {
            return false;
        }
        let now = Instant::now();
        if self.not_before.is_some_and(|instant| now < instant) {
            return false;
        }
        self.not_before = Some(now + PAUSE);
        self.tell_shortage(has_failures);
        let has_dead = self.has_dead();
        if has_dead {
            service::clean_up(participant, &self.service);
        }
        if has_failures && self.show_a_client(participant) {
            self.answered = failures;
        }
        has_dead
    }

    /// A server of another process that came since the last look, in words: nearly always there is none.
    pub fn new_stranger(&mut self) -> Option<String> {
        if self.service.dynamic_config().number_of_servers() <= 1 {
            self.strangers.clear();
            return None;
        }
        let own = std::process::id();
        let strangers: Vec<_> = service::servers(&self.service)
            .into_iter()
            .filter(|(node, _)| process_of::<S>(*node).is_some_and(|process| process != own))
            .collect();
        let new = strangers.iter().find(|stranger| !self.strangers.contains(stranger));
        let new = new.map(|(node, _)| service::holder(&self.service, *node));
        self.strangers = strangers;
        new
    }

    /// Logs why clients cannot be connected, once until they can.
    fn tell_shortage(&mut self, has_failures: bool) {
        let shortage = exhausted::descriptors().filter(|_| has_failures);
        if let (Some(shortage), false) = (&shortage, self.is_short_told) {
            let service = self.service.name();
            tracing::warn!("service \"{service}\": clients cannot be connected: {shortage}");
        }
        self.is_short_told = shortage.is_some();
    }

    /// Whether a process of the service has died. Servers count: one that was killed takes a place too.
    fn has_dead(&self) -> bool {
        !service::dead(&self.service).is_empty()
    }

    /// Changes the server's list of clients, which makes iceoryx2 retry a failed connection. Returns whether it did.
    fn show_a_client(&self, participant: &Participant<S>) -> bool {
        // If shared memory is full, the attempt would kill the process that it is meant to help.
        if space::require(0).is_err() {
            return false;
        }
        let Ok(_held) = participant.lock_at_once(self.service.name().as_str()) else {
            return false;
        };
        let _given_up = give_up_file_override();
        client::builder(&self.service, 1, 1).create().is_ok()
    }
}
