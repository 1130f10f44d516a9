//! Room in shared memory, checked before it is claimed.
//!
//! iceoryx2 makes its segments without asking: in a full file system that goes well, and the first
//! touch of a page that there is no room for kills the process (SIGBUS). So we ask before a port is
//! made ([`require`]), and claim all pages of a publisher's frames afterwards ([`reserve`]).
//!
//! What remains: two processes may pass the question at the same moment when there is room for one
//! of them only, and the loser may die before it has claimed anything. And the small segment of each
//! connection (some kilobytes, more for publishers with many frames) is made and written in one go
//! by whichever of its two ports sees the other first. Where it is the port that lives already, it
//! does so in its next `prepare`, `send`, `maintain` or `newest`, and dies if shared memory has
//! filled up by then. A process of this crate does not join without [`HEADROOM_BYTES`] left, so it
//! takes a peer of another make, or somebody who fills the memory between a peer's joining and its
//! connection.

use std::fs::{self, File};
use std::path::Path;

use iceoryx2::config::Config;
use rustix::fs::{FallocateFlags, fallocate, statvfs};
use rustix::io::{Errno, retry_on_intr};

use crate::domain::segment::FOLDER;
use crate::{JoinError, OpenError, exhausted};

/// For what iceoryx2 makes beside the frames: management, connections, the list of ports.
const HEADROOM_BYTES: u64 = 512 << 10;

/// Why there is no room for something.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Shortage {
    /// Shared memory has less room than it needs.
    Full { needed_bytes: u64, free_bytes: u64 },
    /// A limit of this process forbids it, which this names with the way out.
    Limit(String),
}

impl Shortage {
    /// The error of whoever opens a port of `service`.
    pub(crate) fn of_service(self, service: &str) -> OpenError {
        let service = service.to_owned();
        match self {
            Self::Full { needed_bytes, free_bytes } => {
                OpenError::SharedMemoryFull { service, needed_bytes, free_bytes }
            }
            Self::Limit(cause) => OpenError::Limit { service, cause },
        }
    }

    /// The error of whoever joins `domain`.
    pub(crate) fn of_domain(self, domain: &str) -> JoinError {
        let cause = match self {
            Self::Full { needed_bytes, free_bytes } => format!(
                "/dev/shm has {free_bytes} bytes free, and {needed_bytes} are needed; remove what nobody uses there, or \
                 enlarge it: mount -o remount,size=256M /dev/shm"
            ),
            Self::Limit(cause) => cause,
        };
        JoinError::of_domain(domain, cause)
    }
}

/// Fails if a segment of `needed_bytes`, and the headroom, do not fit into shared memory, or the segment is more
/// than this process may make or map.
pub(crate) fn require(needed_bytes: u64) -> Result<(), Shortage> {
    if let Some(limit) = exhausted::limit_of_segment(needed_bytes) {
        return Err(Shortage::Limit(limit));
    }
    let needed_bytes = needed_bytes.saturating_add(HEADROOM_BYTES);
    // Where the folder cannot be asked, iceoryx2 will say what is wrong with it.
    let Some(free_bytes) = free_bytes() else { return Ok(()) };
    if free_bytes < needed_bytes {
        Err(Shortage::Full { needed_bytes, free_bytes })
    } else {
        Ok(())
    }
}

/// Claims every page of the segment whose name begins with `prefix` and ends with `suffix`, so that
/// no touch of it can fail any more; fails if there is no room for it. A segment that is no file, within
/// one process, needs nothing.
///
/// Looks through the whole folder: for set-up only.
fn reserve(prefix: &str, suffix: &str) -> Result<(), Shortage> {
    let Some(segment) = find(prefix, suffix) else { return Ok(()) };
    let Ok(bytes) = segment.metadata().map(|metadata| metadata.len()) else { return Ok(()) };
    // The pages that were written keep what they have.
    match retry_on_intr(|| fallocate(&segment, FallocateFlags::empty(), 0, bytes)) {
        Err(Errno::NOSPC) => {
            let free_bytes = free_bytes().unwrap_or_default();
            Err(Shortage::Full { needed_bytes: bytes, free_bytes })
        }
        // A file system that cannot do it leaves things as they were.
        _ => Ok(()),
    }
}

/// Claims the memory of a port's messages.
pub(crate) fn reserve_messages(config: &Config, port: u128) -> Result<(), Shortage> {
    // iceoryx2 names the segment of the messages by the port.
    let names = &config.global;
    let suffix = format!("_{port}{}", names.service.data_segment_suffix);
    reserve(&names.prefix.to_string(), &suffix)
}

fn find(prefix: &str, suffix: &str) -> Option<File> {
    let entries = fs::read_dir(FOLDER).ok()?.flatten();
    let mut names = entries.map(|entry| entry.file_name());
    let name = names.find(|name| {
        let name = name.as_encoded_bytes();
        name.starts_with(prefix.as_bytes()) && name.ends_with(suffix.as_bytes())
    })?;
    let path = Path::new(FOLDER).join(name);
    File::options().read(true).write(true).open(path).ok()
}

fn free_bytes() -> Option<u64> {
    let file_system = statvfs(FOLDER).ok()?;
    Some(file_system.f_bavail.saturating_mul(file_system.f_frsize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_has_is_refused_with_both_numbers() {
        let Err(Shortage::Full { needed_bytes, free_bytes }) = require(u64::MAX / 2) else {
            panic!("it fits")
        };
        assert!(needed_bytes > free_bytes);
        assert_eq!(require(0), Ok(()));
    }

    #[test]
    fn a_segment_that_shared_memory_cannot_hold_is_refused_with_both_numbers() {
        let prefix = format!("isospace{}_", std::process::id());
        let path = Path::new(FOLDER).join(format!("{prefix}x.data"));
        let file_system = statvfs(FOLDER).unwrap();
        let bytes = (file_system.f_blocks + 1) * file_system.f_frsize;
        // As iceoryx2 does: nothing says that this is too long.
        File::create_new(&path).unwrap().set_len(bytes).unwrap();
        let refused = reserve(&prefix, "x.data");
        let other = reserve(&prefix, "y.data");
        fs::remove_file(&path).unwrap();
        let Err(Shortage::Full { needed_bytes, free_bytes }) = refused else { panic!("it fits") };
        assert_eq!(needed_bytes, bytes);
        assert!(free_bytes < bytes);
        assert_eq!(other, Ok(()));
    }
}
