//! Which process has locked a file.

use std::fs::{self, File};
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

use super::locked_file;
use crate::is_stopped;

/// Who has the lock, and what others can do about it.
pub(super) fn of(file: &Path) -> String {
    let path = file.display();
    let opened = locked_file::open(file, File::options().read(true));
    let holders = opened.map(|file| locked_file::read(&file)).unwrap_or_default();
    let last = holders.lines().next().and_then(|line| line.split_once(' '));
    // The kernel knows. What the file says may be of the holder before, for a moment.
    let locks = fs::read_to_string("/proc/locks").unwrap_or_default();
    let inode = fs::symlink_metadata(file).map(|file| file.ino());
    let pid = inode.ok().and_then(|inode| flock_holder(&locks, inode));
    let Some(pid) = pid.or(last.map(|(pid, _)| pid)) else {
        return format!("a process that starts or ends and holds {path}");
    };
    let name = match last {
        Some((last, name)) if last == pid => format!(" ({name})"),
        _ => String::new(),
    };
    let (doing, remedy) = if pid.parse().is_ok_and(is_stopped) {
        ("is stopped while it starts or ends", "continue it (kill -CONT) or end it")
    } else {
        ("starts or ends", "as a rule this takes milliseconds")
    };
    format!("process {pid}{name}, which {doing} and holds {path}; {remedy}")
}

/// The process that has locked the file with this inode, as the kernel lists it in `/proc/locks`.
fn flock_holder(locks: &str, inode: u64) -> Option<&str> {
    let inode = inode.to_string();
    locks.lines().find_map(|line| {
        // 1: FLOCK  ADVISORY  WRITE 4711 fe:00:123 0 EOF. Whoever waits stands behind an arrow.
        let mut fields = line.split_whitespace().skip(1);
        let is_flock = fields.next()? == "FLOCK";
        let (pid, file) = (fields.nth(2)?, fields.next()?);
        (is_flock && file.rsplit(':').next() == Some(&inode)).then_some(pid)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_of_another_kind_on_the_file_has_nothing_to_do_with_ours() {
        assert_eq!(flock_holder("3: POSIX  ADVISORY  WRITE 9 fe:00:7 0 EOF", 7), None);
        assert_eq!(flock_holder("1: FLOCK  ADVISORY  WRITE 8 fe:00:7 0 EOF", 7), Some("8"));
    }
}
