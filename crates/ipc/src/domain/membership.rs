//! A participant's membership in a domain: what it may change there, and when.

use iceoryx2::config::Config;
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::service::service_hash::ServiceHash;

use super::claim::claim;
use super::lock::{DomainLock, LockGuard};
use super::{Domain, EndsLocked, counter, roots, sweep};
use crate::config::describe;
use crate::{JoinError, Service, give_up_file_override};

/// A domain, as its participant uses it.
#[derive(Debug)]
pub(crate) struct Membership {
    domain: Domain,
    /// The domain's configuration, with the settings of this participant.
    config: Config,
    lock: DomainLock,
}

impl Membership {
    /// Joins `domain` under `name`, to use it with `config`.
    ///
    /// # Errors
    /// The domain's folders cannot be created, or it belongs to another user.
    pub(crate) fn claim<S: Service>(
        domain: &Domain,
        config: Config,
        name: &str,
    ) -> Result<Self, JoinError> {
        let lock = claim::<S>(&config, name)?;
        if S::CROSSES_PROCESSES {
            domain.note_use();
        }
        Ok(Self { domain: domain.clone(), config, lock })
    }

    pub(crate) fn domain(&self) -> &Domain {
        &self.domain
    }

    pub(crate) fn config(&self) -> &Config {
        &self.config
    }

    pub(crate) fn lock(&self) -> &DomainLock {
        &self.lock
    }

    /// Root path and prefix, for messages.
    pub(crate) fn describe(&self) -> String {
        describe(&self.config)
    }

    /// Makes `thing` be dropped under the domain's lock, and the domain last as long as `thing`.
    pub(crate) fn keep<T>(&self, thing: T) -> EndsLocked<T> {
        EndsLocked::new(thing, &self.lock, Some(self.domain.clone()))
    }

    /// Removes what dead processes left, and prepares the creation of a node.
    pub(crate) fn prepare_for_node<S: Service>(&self, held: &LockGuard) {
        if !S::CROSSES_PROCESSES {
            return;
        }
        roots::enter(&self.config);
        sweep::sweep::<S>(&self.config, held);
        let _given_up = give_up_file_override();
        counter::repair(&self.config);
        counter::make(&self.config);
    }

    /// Removes what dead processes left.
    pub(crate) fn sweep<S: Service>(&self, held: &LockGuard) {
        sweep::sweep::<S>(&self.config, held);
    }

    /// Removes from a service those `ports`, each with its node, whose node is not alive.
    pub(crate) fn remove_strangers<S: Service>(
        &self,
        hash: &ServiceHash,
        ports: &[(UniqueNodeId, u128)],
        held: &LockGuard,
    ) {
        sweep::remove_strangers::<S>(&self.config, hash, ports, held);
    }
}
