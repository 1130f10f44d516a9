//! A small file that one process at a time has locked.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::{FileExt as _, MetadataExt as _, OpenOptionsExt as _};
use std::path::Path;

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::io::Errno;

/// Opens the file, makes it if there is none, and locks it until it is dropped; `None` when somebody
/// else has locked it.
pub(super) fn try_lock(path: &Path) -> io::Result<Option<File>> {
    loop {
        let file = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .read(true)
            .mode(0o600)
            .custom_flags(OFlags::NOFOLLOW.bits() as i32)
            .open(path)?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => return Ok(None),
            Err(Errno::INTR) => continue,
            Err(error) => return Err(error.into()),
        }
        // Whoever leaves last removes the file; what was locked may be that one.
        let (named, opened) = (fs::symlink_metadata(path), file.metadata()?);
        let is_same =
            |named: fs::Metadata| (named.dev(), named.ino()) == (opened.dev(), opened.ino());
        if named.is_ok_and(is_same) {
            return Ok(Some(file));
        }
    }
}

/// What stands in it.
pub(super) fn read(file: &File) -> String {
    let mut bytes = [0; 4096];
    let length = file.read_at(&mut bytes, 0).unwrap_or(0);
    String::from_utf8_lossy(bytes.get(..length).unwrap_or_default()).into_owned()
}

/// Replaces what stands in it. That it cannot be written (a full disk) harms nobody.
pub(super) fn write(file: &File, text: &str) {
    let _ = file.set_len(0).and_then(|()| file.write_all_at(text.as_bytes(), 0));
}
