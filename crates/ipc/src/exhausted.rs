//! What has run out, where iceoryx2 only says that something failed.

use std::fs;

use iceoryx2::config::Config;
use rustix::fs::statvfs;
use rustix::process::{Resource, getrlimit};

/// File descriptors that opening one thing more may need.
const SPARE_DESCRIPTORS: u64 = 6;
/// Blocks that small files need.
const SPARE_BLOCKS: u64 = 4;

/// The reason for a failure, if something has run out, or else what iceoryx2 says.
pub(crate) fn or(config: &Config, cause: String) -> String {
    let open = fs::read_dir("/proc/self/fd").map_or(0, |fds| fds.count() as u64);
    let limit = getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX);
    if open.saturating_add(SPARE_DESCRIPTORS) >= limit {
        return format!("too many open files: the limit is {limit}, raise it (ulimit -n); {cause}");
    }
    let root = config.global.root_path().to_string();
    let is_full = statvfs(&root).is_ok_and(|found| {
        found.f_bavail <= SPARE_BLOCKS || (found.f_files > 0 && found.f_favail == 0)
    });
    if is_full {
        return format!("the file system of {root} is full; {cause}");
    }
    cause
}
