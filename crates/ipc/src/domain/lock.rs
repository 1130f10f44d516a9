//! The lock of a domain: under it our processes create, open, repair and remove.
//!
//! iceoryx2 0.10 cannot distinguish a file that is being created from one that a killed process left unfinished. The
//! kernel can: it releases a `flock` when its holder dies. So a process that has the lock knows that none of our
//! processes is working on the domain's files, and that an unfinished file is dead, or belongs to a program that does
//! not know the lock.
//!
//! Nothing is locked while processes exchange frames, and no real-time thread waits for the lock.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use iceoryx2::config::Config;
use rustix::io::Errno;

use super::{holder, locked_file};

/// After this time, a waiting process logs for whom it waits.
const TELL_AFTER: Duration = Duration::from_secs(1);
/// How long a process that is ending waits. A start waits for as long as it takes; but a process that is asked to end
/// must end, and iceoryx2 by itself keeps living processes apart.
const END_PATIENCE: Duration = Duration::from_secs(2);
/// How often a waiting process tries again: at first, for a holder that needs a millisecond or two...
const PAUSE: Duration = Duration::from_micros(500);
/// ... and then for one that is stopped.
const LONG_PAUSE: Duration = Duration::from_millis(20);

/// How many earlier holders are remembered.
const REMEMBERED: usize = 15;

static INTERRUPTED: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// When this process last gave up waiting. It has many things to end, and waits once for all of them.
static GAVE_UP: Mutex<Option<Instant>> = Mutex::new(None);
const ONE_END: Duration = Duration::from_secs(10);

/// Makes every wait for a domain's lock end with an error once `flag` is set.
///
/// A process that is stopped (SIGSTOP, a debugger) while it starts or ends delays the start of others for as long as
/// it is stopped. With this flag, a waiting process can still end in order, within two seconds after the flag is set.
/// Only the first flag that is passed is used.
pub fn interrupt_waiting_by(flag: Arc<AtomicBool>) {
    let _ = INTERRUPTED.set(flag);
}

/// Why the lock could not be acquired.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum LockError {
    #[error("{path} cannot be locked ({cause}); {remedy}")]
    Refused { path: String, cause: String, remedy: &'static str },
    #[error("gave up waiting for {holder}")]
    Interrupted { holder: String },
}

/// Where a domain is locked, and by whom.
#[derive(Debug, Clone)]
pub(crate) struct DomainLock {
    /// `None` for services within one process, which have no files.
    place: Option<Arc<LockFile>>,
}

#[derive(Debug)]
struct LockFile {
    path: PathBuf,
    /// The log line of a waiting process.
    holder: String,
}

/// Holds the lock until it is dropped.
#[derive(Debug, Default)]
#[must_use = "dropping it releases the lock"]
pub(crate) struct LockGuard {
    /// Closing it releases the lock.
    _file: Option<File>,
    before: Vec<u32>,
}

impl LockGuard {
    /// Whether a process had the lock a short while ago. It may be dead, and may have died while it had it; in any
    /// case it creates and removes nothing now.
    pub(super) fn was_held_by(&self, process: u32) -> bool {
        self.before.contains(&process)
    }
}

impl DomainLock {
    /// The lock of a domain, for the process that is `name` in it.
    pub(crate) fn of(config: &Config, name: &str) -> Self {
        let holder = format!("{} {}\n", std::process::id(), name.escape_default());
        Self { place: Some(Arc::new(LockFile { path: path(config), holder })) }
    }

    /// A lock that does nothing, where there is nothing to lock.
    pub(crate) fn of_nothing() -> Self {
        Self { place: None }
    }

    /// Waits for the lock; logs after a second for whom.
    pub(crate) fn acquire(&self) -> Result<LockGuard, LockError> {
        self.acquire_within(None)
    }

    /// Waits for the lock no longer than an end may take.
    pub(crate) fn acquire_to_end(&self) -> Result<LockGuard, LockError> {
        self.acquire_within(Some(END_PATIENCE))
    }

    /// Takes the lock if it is free; `None`: another process has it.
    pub(crate) fn try_acquire(&self) -> Result<Option<LockGuard>, LockError> {
        let Some(place) = &self.place else { return Ok(Some(LockGuard::default())) };
        place.attempt().map_err(|error| place.refused(&error))
    }

    fn acquire_within(&self, patience: Option<Duration>) -> Result<LockGuard, LockError> {
        let begin = Instant::now();
        let patience =
            patience.map(|patience| if gave_up_lately() { Duration::ZERO } else { patience });
        let mut give_up = patience.and_then(|patience| begin.checked_add(patience));
        let mut is_told = false;
        loop {
            if let Some(held) = self.try_acquire()? {
                return Ok(held);
            }
            let now = Instant::now();
            if INTERRUPTED.get().is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                // A process that is asked to end during its start usually finishes the start sooner.
                give_up = give_up.or(now.checked_add(END_PATIENCE));
            }
            let holder =
                || self.place.as_ref().map_or_else(String::new, |place| holder::of(&place.path));
            if give_up.is_some_and(|instant| now > instant) {
                *GAVE_UP.lock().unwrap_or_else(PoisonError::into_inner) = Some(now);
                return Err(LockError::Interrupted { holder: holder() });
            }
            if !is_told && now.duration_since(begin) > TELL_AFTER {
                is_told = true;
                tracing::warn!("waiting for {}", holder());
            }
            thread::sleep(if is_told { LONG_PAUSE } else { PAUSE });
        }
    }
}

fn gave_up_lately() -> bool {
    let last = *GAVE_UP.lock().unwrap_or_else(PoisonError::into_inner);
    last.is_some_and(|instant| instant.elapsed() < ONE_END)
}

impl LockFile {
    /// Takes the lock; `None` if another process has it.
    fn attempt(&self) -> io::Result<Option<LockGuard>> {
        let Some(file) = locked_file::try_lock(&self.path)? else { return Ok(None) };
        let before = locked_file::read(&file);
        let others = before.lines().filter(|line| !self.holder.starts_with(line));
        let holders =
            others.take(REMEMBERED).fold(self.holder.clone(), |all, other| all + other + "\n");
        locked_file::write(&file, &holders);
        let pid = |line: &str| line.split_once(' ')?.0.parse().ok();
        let before = before.lines().filter_map(pid).collect();
        Ok(Some(LockGuard { _file: Some(file), before }))
    }

    fn refused(&self, error: &io::Error) -> LockError {
        let is_file = fs::symlink_metadata(&self.path).map_or(true, |found| found.is_file());
        let remedy = match error.raw_os_error().map(Errno::from_raw_os_error) {
            code if !is_file || code.is_none() => "remove it",
            Some(Errno::MFILE | Errno::NFILE) => "raise the limit of open files (ulimit -n)",
            Some(Errno::NOSPC) => "make room on the file system of the root path",
            _ => "see that the root path is writable",
        };
        let path = self.path.display().to_string();
        LockError::Refused { path, cause: error.to_string(), remedy }
    }
}

/// Path of a domain's lock. Domains may share a root path.
pub(super) fn path(config: &Config) -> PathBuf {
    let root = config.global.root_path().to_string();
    Path::new(&root).join(format!("{}isochrone.lock", config.global.prefix))
}
#[cfg(test)]
mod tests {
    use super::*;

    fn lock(folder: &Path) -> DomainLock {
        let holder = format!("{} somebody\n", std::process::id());
        let path = folder.join("x.lock");
        DomainLock { place: Some(Arc::new(LockFile { path, holder })) }
    }

    #[test]
    fn one_at_a_time_holds_the_lock_and_the_next_is_told_by_whom() {
        let folder = tempfile::tempdir().unwrap();
        let lock = lock(folder.path());
        let held = lock.acquire().unwrap();
        assert!(lock.try_acquire().unwrap().is_none());
        let waited = lock.acquire_within(Some(Duration::ZERO)).unwrap_err().to_string();
        let holder = format!("process {} (somebody)", std::process::id());
        assert!(waited.contains(&holder), "{waited}");
        drop(held);
        assert!(lock.try_acquire().unwrap().is_some());
    }

    #[test]
    fn a_holder_that_has_not_written_its_name_yet_is_known_to_the_kernel() {
        let folder = tempfile::tempdir().unwrap();
        let lock = lock(folder.path());
        let _held = lock.acquire().unwrap();
        fs::write(folder.path().join("x.lock"), "1 the one before\n").unwrap();
        let waited = lock.acquire_within(Some(Duration::ZERO)).unwrap_err().to_string();
        let holder = format!("process {}, which", std::process::id());
        assert!(waited.contains(&holder), "{waited}");
    }

    #[test]
    fn a_lock_whose_file_was_removed_meanwhile_is_not_taken_for_the_domains() {
        let folder = tempfile::tempdir().unwrap();
        let lock = lock(folder.path());
        let old = lock.acquire().unwrap();
        fs::remove_file(folder.path().join("x.lock")).unwrap();
        let new = lock.try_acquire().unwrap();
        assert!(new.is_some(), "a new file, a new lock");
        drop(old);
        assert!(lock.try_acquire().unwrap().is_none());
    }
}
