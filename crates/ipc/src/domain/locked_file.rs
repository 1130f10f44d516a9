//! A small file that one process at a time has locked.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileExt as _, MetadataExt as _, OpenOptionsExt as _};
use std::path::Path;

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::io::Errno;
use rustix::process::geteuid;

/// Opens a file of this user, and nothing of this name that another user may have created: opening a pipe would wait,
/// and the contents of another user's file cannot be trusted.
pub(crate) fn open(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
    let file = options.custom_flags(flags.bits() as i32).open(path)?;
    let found = file.metadata()?;
    if !found.is_file() || found.uid() != geteuid().as_raw() {
        let why = "it is no ordinary file, or another user's";
        return Err(io::Error::new(ErrorKind::PermissionDenied, why));
    }
    Ok(file)
}

/// Opens or creates the file, and locks it until this is dropped; `None` if another process has locked it.
pub(crate) fn try_lock(path: &Path) -> io::Result<Option<File>> {
    loop {
        let mut options = File::options();
        options.create(true).truncate(false).write(true).read(true).mode(0o600);
        let file = open(path, &mut options)?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => return Ok(None),
            Err(Errno::INTR) => continue,
            Err(error) => return Err(error.into()),
        }
        // The last process to leave removes the file, and this may be the removed one.
        let (named, opened) = (fs::symlink_metadata(path), file.metadata()?);
        let is_same =
            |named: fs::Metadata| (named.dev(), named.ino()) == (opened.dev(), opened.ino());
        if named.is_ok_and(is_same) {
            return Ok(Some(file));
        }
    }
}

/// Its contents.
pub(super) fn read(file: &File) -> String {
    let mut bytes = [0; 4096];
    let length = file.read_at(&mut bytes, 0).unwrap_or(0);
    String::from_utf8_lossy(bytes.get(..length).unwrap_or_default()).into_owned()
}

/// Replaces its contents. It does no harm if they cannot be written (a full disk).
pub(super) fn write(file: &File, text: &str) {
    let _ = file.set_len(0).and_then(|()| file.write_all_at(text.as_bytes(), 0));
}
