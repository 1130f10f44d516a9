//! Whether shared memory has room.
//!
//! iceoryx2 makes its segments without asking: in a full file system that goes well, and the first
//! touch of a page that there is no room for kills the process (SIGBUS). So we ask.

use rustix::fs::statvfs;

/// Where POSIX shared memory lives on Linux.
const FOLDER: &str = "/dev/shm";
/// For what iceoryx2 makes beside the frames: management, connections, the list of ports.
const HEADROOM_BYTES: u64 = 512 << 10;

/// Says by an error that `needed_bytes` do not fit: how many are needed, and how many are free.
pub(crate) fn require(needed_bytes: u64) -> Result<(), (u64, u64)> {
    let needed_bytes = needed_bytes.saturating_add(HEADROOM_BYTES);
    // Where the folder cannot be asked, iceoryx2 will say what is wrong with it.
    let Ok(file_system) = statvfs(FOLDER) else { return Ok(()) };
    let free_bytes = file_system.f_bavail.saturating_mul(file_system.f_frsize);
    match free_bytes < needed_bytes {
        true => Err((needed_bytes, free_bytes)),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_has_is_refused_with_both_numbers() {
        let (needed, free) = require(u64::MAX / 2).unwrap_err();
        assert!(needed > free);
        assert_eq!(require(0), Ok(()));
    }
}
