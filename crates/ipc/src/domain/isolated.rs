//! A domain that no other program uses.

use std::fs;
use std::io;
use std::ops::Deref;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use iceoryx2::config::Config;
use rustix::process::geteuid;

use super::isolated_folder::{FOLDERS, IsolatedFolder, MAKER};
use super::{Domain, leftovers, locked_file, segment};
use crate::config::root_path;
use crate::{DomainError, config};

const FILE: &str = "domain.toml";
const ROOT: &str = "iceoryx2";

/// A domain with a prefix and root path of its own, in a temporary folder: for tests, benches and
/// demonstrations that must not see anything else on the machine.
///
/// Dropping it and its participants and ports removes all its files. Other processes that use it must
/// have ended before. If the process that created it is killed, its files are removed when the same
/// user creates the next isolated domain in the same place.
///
/// ```
/// # use isochrone_ipc::{IsolatedDomain, Participant};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let domain = IsolatedDomain::new("mytest")?;
/// let participant = Participant::join("level", &domain)?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct IsolatedDomain {
    domain: Domain,
    folder: PathBuf,
}

impl IsolatedDomain {
    /// Creates a domain in the folder for temporary files. Its prefix is `word`, the process id and a
    /// number.
    ///
    /// # Errors
    /// The folder cannot be created, its path or `word` is too long for iceoryx2, or `word` has other
    /// characters than ASCII letters, digits, `-` and `_`.
    pub fn new(word: &str) -> Result<Self, DomainError> {
        Self::within(&std::env::temp_dir(), word)
    }

    /// As [`new`](Self::new), in a folder in `place`.
    ///
    /// # Errors
    /// As `new`.
    pub fn within(place: &Path, word: &str) -> Result<Self, DomainError> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let stands_in_names =
            |letter: u8| letter.is_ascii_alphanumeric() || b"-_".contains(&letter);
        if !word.bytes().all(stands_in_names) {
            return Err(DomainError::new(format!(
                "isolated domain {word:?}: the word begins the names of its files; write it with ASCII \
                 letters, digits, - and _"
            )));
        }
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let no_folder = |error: io::Error| {
            DomainError::new(format!(
                "cannot create a folder in {} for a domain: {error}; set TMPDIR to a writable folder",
                place.display()
            ))
        };
        let folder = IsolatedFolder::make(place).map_err(no_folder)?;
        let path = folder.dir.path().to_owned();
        let root_path = path.join(ROOT).display().to_string();
        let prefix = format!("{word}{}_{number}_", std::process::id());
        let file = path.join(FILE);
        let text = format!("[global]\nroot-path = {root_path:?}\nprefix = {prefix:?}\n");
        fs::write(&file, text).map_err(no_folder)?;
        let domain = Domain::load(Some(&file), Some(folder))?;
        remove_dead(place);
        Ok(Self { domain, folder: path })
    }

    /// The domain's folder, which its users may use for other files too.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The domain's iceoryx2 configuration file, to pass to another process.
    pub fn file(&self) -> PathBuf {
        self.folder.join(FILE)
    }
}

impl AsRef<Domain> for IsolatedDomain {
    fn as_ref(&self) -> &Domain {
        &self.domain
    }
}

impl Deref for IsolatedDomain {
    type Target = Domain;

    fn deref(&self) -> &Domain {
        &self.domain
    }
}

/// Removes the isolated domains in a place whose makers were killed, unless somebody still lives there.
fn remove_dead(place: &Path) {
    let ours = |entry: &fs::DirEntry| {
        let is_named = entry.file_name().as_encoded_bytes().starts_with(FOLDERS.as_bytes());
        let is_ours = |found: fs::Metadata| found.is_dir() && found.uid() == geteuid().as_raw();
        is_named && entry.metadata().is_ok_and(is_ours)
    };
    let entries = fs::read_dir(place).into_iter().flatten().flatten();
    for folder in entries.filter(ours).map(|entry| entry.path()) {
        let maker = folder.join(MAKER);
        // The maker's end removes the folder's content one by one: without its lock, what is left is
        // what an interrupted end left. A folder without a domain may belong to a maker that begins.
        if !maker.is_file() && !folder.join(ROOT).is_dir() {
            continue;
        }
        let Ok(Some(_dead)) = locked_file::try_lock(&maker) else { continue };
        if let Some(config) = config_in(&folder) {
            leftovers::remove(&config);
            if leftovers::is_in_use(&config) {
                continue;
            }
            segment::remove_all(&config);
        }
        tracing::info!("{} is removed: its maker was killed", folder.display());
        let _ = fs::remove_dir_all(folder);
    }
}

/// The configuration of the domain in a folder, if it got one.
fn config_in(folder: &Path) -> Option<Config> {
    let file = folder.join(FILE);
    let config = config::parse(&file.display().to_string(), &fs::read(&file).ok()?).ok()?;
    (root_path(&config) == folder.join(ROOT)).then_some(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_that_cannot_stand_in_the_name_of_a_file_is_refused_and_leaves_nothing() {
        let place = tempfile::tempdir().unwrap();
        for word in ["\u{e4}", "a/b", "a b", "\u{1b}[31m"] {
            let error = IsolatedDomain::within(place.path(), word).unwrap_err();
            let sentence = error.to_string();
            assert!(sentence.starts_with(&format!("isolated domain {word:?}: ")), "{sentence}");
            assert!(sentence.contains("ASCII letters, digits, - and _"), "{sentence}");
        }
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
    }

    #[test]
    fn what_a_killed_maker_left_is_removed_and_what_lives_stays() {
        let place = tempfile::tempdir().unwrap();
        let living = IsolatedDomain::within(place.path(), "isoalive").unwrap();
        // As a killed maker leaves it: the lock is released, all else is there.
        let dead = place.path().join("isochrone-dead");
        let prefix = format!("isodead{}_", std::process::id());
        fs::create_dir_all(dead.join(ROOT)).unwrap();
        fs::write(dead.join(MAKER), "").unwrap();
        let text = format!("[global]\nroot-path = {:?}\nprefix = {prefix:?}\n", dead.join(ROOT));
        fs::write(dead.join(FILE), text).unwrap();
        let segment = Path::new(segment::FOLDER).join(format!("{prefix}x.data"));
        fs::write(&segment, "").unwrap();
        let strange = place.path().join("isochrone-strange");
        fs::create_dir(&strange).unwrap();
        // As one leaves it that is killed while it removes its folder.
        let half = place.path().join("isochrone-half");
        fs::create_dir_all(half.join(ROOT).join("nodes")).unwrap();
        let next = IsolatedDomain::within(place.path(), "isonext").unwrap();
        assert!(!dead.exists() && !segment.exists() && !half.exists());
        assert!(living.file().exists() && next.file().exists() && strange.exists());
    }
}
