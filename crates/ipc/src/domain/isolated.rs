//! A domain that nobody else is in.

use std::fs;
use std::io;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use super::Domain;
use crate::DomainError;

const FILE: &str = "domain.toml";
const ROOT: &str = "iceoryx2";

/// A domain with a prefix and a root path of its own, in a temporary folder: for tests, benches and
/// demonstrations, which must meet nothing else that runs on the machine.
///
/// Nothing is left of it after it and the participants and ports in it are dropped. Processes that
/// it was handed on to must have ended by then.
///
/// ```
/// # use isochrone_ipc::{IsolatedDomain, Participant, ipc};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let domain = IsolatedDomain::new("mytest")?;
/// let participant = Participant::<ipc::Service>::join("level", &domain)?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct IsolatedDomain {
    domain: Domain,
    folder: PathBuf,
}

impl IsolatedDomain {
    /// Makes one, in the folder for temporary files. Its prefix is `word`, the process id and a
    /// number.
    ///
    /// # Errors
    /// There is no place for the folder, or its path or `word` is too long for iceoryx2.
    pub fn new(word: &str) -> Result<Self, DomainError> {
        Self::within(&std::env::temp_dir(), word)
    }

    /// As [`new`](Self::new), in a folder in `place`.
    ///
    /// # Errors
    /// As `new`.
    pub fn within(place: &Path, word: &str) -> Result<Self, DomainError> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let no_folder = |error: io::Error| DomainError::NoFolder {
            place: place.display().to_string(),
            cause: error.to_string(),
        };
        let folder = tempfile::Builder::new().prefix("isochrone-").tempdir_in(place);
        let folder = folder.map_err(no_folder)?;
        let path = folder.path().to_owned();
        let root_path = path.join(ROOT).display().to_string();
        let prefix = format!("{word}{}_{number}_", std::process::id());
        let file = path.join(FILE);
        let text = format!("[global]\nroot-path = {root_path:?}\nprefix = {prefix:?}\n");
        fs::write(&file, text).map_err(no_folder)?;
        Ok(Self { domain: Domain::load(Some(&file), Some(folder))?, folder: path })
    }

    /// The folder that the domain is in, for whatever else belongs to those who use it.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The configuration file of the domain, for another process.
    pub fn file(&self) -> PathBuf {
        self.folder.join(FILE)
    }
}

impl Deref for IsolatedDomain {
    type Target = Domain;

    fn deref(&self) -> &Domain {
        &self.domain
    }
}
