//! Finds the exhausted resource, where iceoryx2 only says that something failed.

use std::fs;

use iceoryx2::config::Config;
use rustix::fs::{Access, access, statvfs};
use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};

use crate::domain::segment::FOLDER;

/// File descriptors that opening one thing more may need.
const SPARE_DESCRIPTORS: u64 = 6;
/// Blocks that small files need.
const SPARE_BLOCKS: u64 = 4;
/// More than any file needs that iceoryx2 makes beside those of messages.
const SMALL_FILE_BYTES: u64 = 1 << 20;
/// Address space that opening one thing more may need, a thread and its memory included.
const SPARE_ADDRESSES: u64 = 8 << 20;
/// The names in /proc/self/status of the address space in use, and of its peak: by the time that a failure is
/// explained, what was allocated before it is gone.
const USED: &str = "VmSize:";
const MOST_USED: &str = "VmPeak:";
/// Its name for the private writable memory of the process.
const DATA_USED: &str = "VmData:";

/// The cause of a failure and its remedy, if a resource is exhausted or cannot be written; otherwise what iceoryx2
/// says, with `remedy`.
pub(crate) fn or(config: &Config, cause: String, remedy: &str) -> String {
    let root = config.global.root_path().to_string();
    let why = limit().or_else(|| {
        let folders = [FOLDER, &root];
        folders.into_iter().find_map(full).or_else(|| folders.into_iter().find_map(unwritable))
    });
    match why {
        Some(why) => format!("{why}; {cause}"),
        None => format!("{cause}; {remedy}"),
    }
}

/// The limit of this process that may have caused a failure, and how to raise it.
pub fn limit() -> Option<String> {
    descriptors().or_else(|| file_size(SMALL_FILE_BYTES)).or_else(memory)
}

/// The limit that forbids creating and mapping a segment of this size, if one does.
pub(crate) fn limit_of_segment(bytes: u64) -> Option<String> {
    file_size(bytes).or_else(|| address_space(bytes, USED))
}

/// The remedy if no thread can be started. The system reports three limits with the same error (EAGAIN).
pub fn thread_remedy() -> String {
    memory().unwrap_or_else(|| "raise the limit of processes (ulimit -u)".to_owned())
}

/// Says that this process has too little private memory to start a thread, if so.
fn memory() -> Option<String> {
    address_space(SPARE_ADDRESSES, MOST_USED).or_else(data)
}

/// Says that this process must not create a file of this size, if so.
fn file_size(bytes: u64) -> Option<String> {
    let limit = getrlimit(Resource::Fsize).current.filter(|limit| *limit < bytes)?;
    Some(format!(
        "the limit of file sizes is {limit} bytes, and shared memory needs files of up to {bytes}: raise it \
         (ulimit -f)"
    ))
}

/// Says that this process cannot map this many bytes in addition to its peak use, if so.
fn address_space(bytes: u64, key: &str) -> Option<String> {
    let (used, limit) = reached(Resource::As, key, bytes)?;
    Some(format!(
        "too little address space: {used} of {limit} bytes were in use, raise the limit (ulimit -v)"
    ))
}

/// Says that this process has no room for the stack of a thread, if so.
fn data() -> Option<String> {
    let (used, limit) = reached(Resource::Data, DATA_USED, SPARE_ADDRESSES)?;
    Some(format!(
        "too little room for data: {used} of {limit} bytes are in use, raise the limit (ulimit -d)"
    ))
}

/// The bytes in use and the limit, if this many more would exceed it.
fn reached(resource: Resource, key: &str, bytes: u64) -> Option<(u64, u64)> {
    let limit = getrlimit(resource).current?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let used = status.lines().find_map(|line| line.strip_prefix(key))?;
    let used: u64 = used.trim().strip_suffix(" kB")?.parse().ok()?;
    let used = used.saturating_mul(1024);
    (used.saturating_add(bytes) > limit).then_some((used, limit))
}

/// Says that this process can hardly open any more files, if so.
pub fn descriptors() -> Option<String> {
    let limit = getrlimit(Resource::Nofile).current?;
    let is_short = match fs::read_dir("/proc/self/fd") {
        Ok(open) => (open.count() as u64).saturating_add(SPARE_DESCRIPTORS) >= limit,
        // Not even that could be opened.
        Err(error) => error.raw_os_error() == Some(Errno::MFILE.raw_os_error()),
    };
    is_short.then(|| format!("too many open files: the limit is {limit}, raise it (ulimit -n)"))
}

/// Says that a file system has no room for small files.
fn full(folder: &str) -> Option<String> {
    let found = statvfs(folder).ok()?;
    if found.f_files > 0 && found.f_favail == 0 {
        return Some(format!("the file system of {folder} has no inodes left, remove files on it"));
    }
    let is_full = found.f_bavail <= SPARE_BLOCKS;
    is_full.then(|| format!("the file system of {folder} is full, make room on it"))
}

/// Why this process cannot create files in a folder.
fn unwritable(folder: &str) -> Option<String> {
    let why = match access(folder, Access::WRITE_OK | Access::EXEC_OK).err()? {
        Errno::ROFS => format!("is read-only: mount -o remount,rw {folder}"),
        Errno::ACCESS | Errno::PERM => "cannot be written by this user: change its rights".into(),
        Errno::NOENT => "does not exist: create it, or mount it".into(),
        _ => return None,
    };
    Some(format!("{folder} {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_cannot_be_written_is_named_with_the_way_out() {
        let folder = tempfile::tempdir().unwrap();
        let absent = folder.path().join("absent").display().to_string();
        assert_eq!(unwritable(folder.path().to_str().unwrap()), None);
        let why = unwritable(&absent).unwrap();
        assert_eq!(why, format!("{absent} does not exist: create it, or mount it"));
    }
}
