//! A domain: what its processes have in common in the file system, who may touch it, and when.

mod counter;
mod lock;
mod locked_file;
mod rights;
mod roots;
pub(crate) mod segment;
mod sweep;

use std::fs;

use iceoryx2::config::Config;
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::service::service_hash::ServiceHash;

pub use lock::interrupt_waiting_by;
pub(crate) use lock::{DomainLock, EndsLocked, Held};

use crate::{JoinError, Service, give_up_file_override};

/// A domain as a process sees that lives in it.
#[derive(Debug, Clone)]
pub(crate) struct Domain {
    config: Config,
    lock: DomainLock,
}

impl Domain {
    /// The domain of `config`, for the process that is `name` in it.
    ///
    /// # Errors
    /// Its folders cannot be made, or it belongs to somebody else.
    pub(crate) fn claim<S: Service>(config: Config, name: &str) -> Result<Self, JoinError> {
        if !S::CROSSES_PROCESSES {
            return Ok(Self { config, lock: DomainLock::of_nothing() });
        }
        rights::claim(&config)?;
        let lock = DomainLock::of(&config, name);
        Ok(Self { config, lock })
    }

    pub(crate) fn config(&self) -> &Config {
        &self.config
    }

    pub(crate) fn lock(&self) -> &DomainLock {
        &self.lock
    }

    /// Root path and prefix, for people.
    pub(crate) fn describe(&self) -> String {
        describe(&self.config)
    }

    /// Removes what dead processes left, and gets ready what a node needs that is to be created now.
    pub(crate) fn prepare_for_node<S: Service>(&self, held: &Held) {
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
    pub(crate) fn sweep<S: Service>(&self, held: &Held) {
        sweep::sweep::<S>(&self.config, held);
    }

    /// Removes from a service those `ports`, each with its node, whose node is not alive.
    pub(crate) fn remove_strangers<S: Service>(
        &self,
        hash: &ServiceHash,
        ports: &[(UniqueNodeId, u128)],
        held: &Held,
    ) {
        sweep::remove_strangers::<S>(&self.config, hash, ports, held);
    }

    /// Removes what the domain keeps beside iceoryx2's files; for who leaves last.
    pub(crate) fn leave(&self, _held: &Held) {
        roots::leave(&self.config);
        // Whoever waits for it sees that it is gone, and makes another.
        let _ = fs::remove_file(lock::path(&self.config));
    }
}

pub(crate) fn describe(config: &Config) -> String {
    format!("{} (prefix {})", config.global.root_path(), config.global.prefix)
}
