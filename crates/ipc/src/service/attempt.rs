//! Attempts to open services that may be in the middle of creation or removal: the same for all messaging patterns.

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::service::service_hash::ServiceHash;

use crate::backoff::Backoff;
use crate::domain::LockGuard;
use crate::{OpenError, Participant, Service};

/// The outcome of an attempt to open a service.
pub(crate) enum Attempt<T> {
    Done(T),
    Absent,
    /// It is in the middle of creation or removal, or has no place; the obstacle was removed, or is too young to be.
    Again(String),
}

/// What keeps a service from being opened.
pub(crate) enum Obstacle {
    Absent,
    NoPlaceForNode,
    /// The types and sizes that it carries, and those that are needed.
    OtherTypes {
        carries: String,
        needs: String,
    },
    OtherVersion,
    Damaged,
    Forbidden,
    /// An obstacle that may pass.
    Passing(String),
}

impl Obstacle {
    /// Removes dead remains if that may help, and says whether to try again.
    pub(crate) fn judge<S: Service, T>(
        self,
        participant: &Participant<S>,
        service: &str,
        held: &LockGuard,
    ) -> Result<Attempt<T>, OpenError> {
        let (service, domain) = (service.to_owned(), participant.domain());
        Err(match self {
            Self::Absent => return Ok(Attempt::Absent),
            Self::NoPlaceForNode => {
                participant.membership().sweep::<S>(held);
                return Ok(Attempt::Again("all its places for nodes are taken".to_owned()));
            }
            Self::OtherTypes { carries, needs } => {
                OpenError::OtherTypes { service, carries, needs }
            }
            Self::OtherVersion => OpenError::OtherVersion { service, ours: "0.10.0".to_owned() },
            Self::Damaged => OpenError::Corrupted { service, domain },
            Self::Forbidden => OpenError::Permission { service, domain },
            // No process that knows the lock creates or removes it at this moment.
            Self::Passing(cause) => {
                participant.membership().sweep::<S>(held);
                return Ok(Attempt::Again(cause));
            }
        })
    }
}

/// Opens a service under the domain's lock; `absent` decides what happens if there is none.
pub(crate) fn repeat<S: Service, T>(
    participant: &Participant<S>,
    service: &str,
    open: impl Fn(&LockGuard) -> Result<Attempt<T>, OpenError>,
    absent: impl Fn() -> Result<Option<T>, String>,
) -> Result<Option<T>, OpenError> {
    let mut backoff = Backoff::new();
    loop {
        let held = participant.lock(service)?;
        let cause = match open(&held)? {
            Attempt::Done(opened) => return Ok(Some(opened)),
            Attempt::Again(cause) => cause,
            Attempt::Absent => match absent() {
                Ok(made) => return Ok(made),
                Err(cause) => cause,
            },
        };
        drop(held);
        if !backoff.try_again() {
            return Err(failed(participant, service, cause));
        }
    }
}

/// Opens a port of a service under the domain's lock, and tries again after `clean_up` while the obstacle may be
/// dead, or about to leave.
pub(crate) fn repeat_port<S: Service, P>(
    participant: &Participant<S>,
    service: &str,
    open: impl Fn() -> Result<P, OpenError>,
    clean_up: impl Fn(),
) -> Result<P, OpenError> {
    let mut backoff = Backoff::new();
    loop {
        let held = participant.lock(service)?;
        let port = open();
        drop(held);
        match port {
            Ok(port) => return Ok(port),
            Err(refusal) => {
                clean_up();
                if !backoff.try_again() {
                    return Err(refusal);
                }
            }
        }
    }
}

/// Removes what dead processes left in the domain and among the `ports` of this service, as they may occupy places.
pub(crate) fn clean_up<S: Service>(
    participant: &Participant<S>,
    service: &str,
    hash: &ServiceHash,
    ports: impl FnOnce() -> Vec<(UniqueNodeId, u128)>,
) {
    let Ok(held) = participant.lock(service) else { return };
    let domain = participant.membership();
    domain.sweep::<S>(&held);
    domain.remove_strangers::<S>(hash, &ports(), &held);
}

pub(crate) fn failed<S: Service>(
    participant: &Participant<S>,
    service: &str,
    cause: impl ToString,
) -> OpenError {
    OpenError::Failed {
        service: service.to_owned(),
        domain: participant.domain(),
        cause: crate::exhausted::or(
            participant.membership().config(),
            cause.to_string(),
            "see that /dev/shm is not full and that no peer hangs in its start, then try again",
        ),
    }
}
