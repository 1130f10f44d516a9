//! A domain: the iceoryx2 processes that see each other, and the files that they share.

mod claim;
mod counter;
mod ends_locked;
mod holder;
mod isolated;
mod isolated_folder;
mod leftovers;
mod lock;
pub(crate) mod locked_file;
mod membership;
mod rights;
mod roots;
pub(crate) mod segment;
mod services;
mod sweep;

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use iceoryx2::config::Config;
use tracing::info;

pub(crate) use ends_locked::EndsLocked;
pub use isolated::IsolatedDomain;
use isolated_folder::IsolatedFolder;
pub(crate) use lock::LockGuard;
pub use lock::interrupt_waiting_by;
pub(crate) use membership::Membership;

use crate::config::{describe, root_path};
use crate::{DomainError, config};

/// Which processes see each other: those with the same root path and prefix.
///
/// A clone is the same domain. When its last clone, participant and port are dropped and no other
/// process uses the domain, the files that iceoryx2 leaves behind are removed (see
/// [`remove_leftovers`](Self::remove_leftovers)).
#[derive(Debug, Clone)]
pub struct Domain(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    config: Config,
    /// Whether a participant joined that leaves files behind.
    was_used: AtomicBool,
    /// The folder of an isolated domain.
    folder: Option<IsolatedFolder>,
}

impl Domain {
    /// The domain of the configuration file that the environment variable `ICEORYX2_CONFIG` names,
    /// if it is set and not empty, or else the domain that iceoryx2 itself would use: that of the
    /// first of `./config/iceoryx2.toml`, `~/.config/iceoryx2/iceoryx2.toml` and
    /// `/etc/iceoryx2/iceoryx2.toml` that exists, or of the built-in defaults.
    ///
    /// Logs the domain and the file that selected it through `tracing` at level `info`.
    ///
    /// # Errors
    /// The file that `ICEORYX2_CONFIG` names does not exist, or a file was found but cannot be read
    /// or is not valid. Also rejected, unlike by iceoryx2 itself: an empty file, an unknown key, and a
    /// relative root path, each of which would silently select an unintended domain.
    pub fn find() -> Result<Self, DomainError> {
        Self::load(config::usual_file().as_deref(), None)
    }

    /// The domain of a configuration file of iceoryx2, as [`find`](Self::find) finds it.
    ///
    /// # Errors
    /// The file does not exist, cannot be read or is not valid.
    pub fn from_file(path: &Path) -> Result<Self, DomainError> {
        Self::load(Some(path), None)
    }

    fn load(path: Option<&Path>, folder: Option<IsolatedFolder>) -> Result<Self, DomainError> {
        let config = config::load(path)?;
        let global = &config.global;
        info!(
            "iceoryx2 domain: root path {}, prefix {}, from {}",
            global.root_path(),
            global.prefix,
            config::origin(path)
        );
        Ok(Self(Arc::new(Shared { config, was_used: AtomicBool::new(false), folder })))
    }

    /// The iceoryx2 configuration, for code that uses iceoryx2 directly. The creation timeout is
    /// always 20 ms, and `subscriber-expired-connection-buffer` 8, regardless of the file: a subscriber that is made with it
    /// must not hold samples of more publishers than that which have left.
    pub fn config(&self) -> &Config {
        &self.0.config
    }

    /// The same for a node of iceoryx2 that leaves it to [`Participant`](crate::Participant) to clean up.
    /// By itself it would clean up when it is made or dropped and when a service is opened, without the
    /// domain's lock.
    pub fn config_without_clean_up(&self) -> Config {
        let mut config = self.config().clone();
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        config
    }

    /// The folder in which iceoryx2 keeps its files.
    pub fn root_path(&self) -> PathBuf {
        root_path(self.config())
    }

    /// The prefix of the names of the domain's files.
    pub fn prefix(&self) -> String {
        self.config().global.prefix.to_string()
    }

    /// The domain's files in shared memory and below the root path, without folders. Every file in
    /// shared memory whose name begins with the prefix counts as one of the domain's.
    pub fn files(&self) -> Vec<PathBuf> {
        let mut files = segment::files(self.config());
        files.extend(files_below(&self.root_path()));
        files
    }

    /// Removes the last files of an unused domain; returns whether there were any.
    ///
    /// When all nodes of a domain have ended, iceoryx2 leaves the 16 bytes of a node counter
    /// (`/dev/shm/<prefix>…_node.0_10_0.global_mgmt`) and the empty directories `nodes` and
    /// `services` in the root path, and this crate its lock (`<prefix>isochrone.lock`) and the list
    /// of root paths (`/dev/shm/<prefix>isochrone.roots`). They are harmless. Files of killed processes
    /// are removed as well.
    ///
    /// Does nothing while the domain has a live node. The directories remain, because a program that
    /// does not know the lock may be about to use them. Dropping a domain in which this process took
    /// part calls this.
    pub fn remove_leftovers(&self) -> bool {
        leftovers::remove(self.config())
    }

    fn note_use(&self) {
        self.0.was_used.store(true, Ordering::Relaxed);
    }
}

impl AsRef<Self> for Domain {
    fn as_ref(&self) -> &Self {
        self
    }
}

/// Displays root path and prefix.
impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&describe(self.config()))
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        if *self.was_used.get_mut() || self.folder.is_some() {
            leftovers::remove(&self.config);
        }
        if self.folder.is_some() {
            // All its users have ended.
            segment::remove_all(&self.config);
        }
    }
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            files.extend(files_below(&path));
        } else {
            files.push(path);
        }
    }
    files
}
