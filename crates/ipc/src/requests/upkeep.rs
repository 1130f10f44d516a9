//! What a server needs besides serving, in another thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use iceoryx2::node::NodeState;
use iceoryx2::prelude::CallbackProgression;
use iceoryx2::service::port_factory::PortFactory as _;

use super::client;
use super::service::{self, RequestService};
use crate::{Participant, Service, give_up_file_override, space};

/// How often the dead are looked for while there are clients.
const PAUSE: Duration = Duration::from_millis(250);

/// Clears the clients of a [`RequestServer`](super::RequestServer) that died, and has the server try
/// failed connections again.
///
/// Clearing takes milliseconds and waits for the domain's lock, which the thread that serves must not.
/// It may outlive its server, and keeps the service in being for as long.
#[derive(Debug)]
pub struct RequestUpkeep<S: Service> {
    service: Arc<RequestService<S>>,
    failures: Arc<AtomicU64>,
    /// Failures that an attempt followed.
    answered: u64,
    not_before: Option<Instant>,
}

impl<S: Service> RequestUpkeep<S> {
    pub(super) fn new(service: Arc<RequestService<S>>, failures: Arc<AtomicU64>) -> Self {
        Self { service, failures, answered: 0, not_before: None }
    }

    /// Does what is due; returns whether dead clients were cleared.
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
        let has_dead = self.has_dead();
        if has_dead {
            service::clean_up(participant, &self.service);
        }
        if has_failures && self.show_a_client(participant) {
            self.answered = failures;
        }
        has_dead
    }

    /// Whether a process of the service has died. Servers count: one that was killed takes a place too.
    fn has_dead(&self) -> bool {
        let _given_up = give_up_file_override();
        let mut has_dead = false;
        // What cannot be listed is seen at the next look.
        let _ = self.service.nodes(|state| {
            has_dead |= matches!(state, NodeState::Dead(_));
            if has_dead { CallbackProgression::Stop } else { CallbackProgression::Continue }
        });
        has_dead
    }

    /// Has the server's list of clients change, which makes iceoryx2 come back to a connection that
    /// failed. Returns whether it did.
    fn show_a_client(&self, participant: &Participant<S>) -> bool {
        // In full shared memory the attempt would kill the process that it is to help.
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
