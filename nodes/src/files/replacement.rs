//! Replacing a file by a new text.

use std::ffi::OsString;
use std::fs::{self, File, Metadata, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{Gid, Uid, fchown};
use rustix::io::Errno;
use tempfile::NamedTempFile;

use super::folder_of;

/// Permissions of a new file, before the umask.
const RIGHTS: u32 = 0o666;

/// A temporary file beside the file that it will replace. Dropping it leaves that file as it is.
pub(super) struct Replacement {
    new: NamedTempFile,
    target: PathBuf,
}

impl Replacement {
    /// Creates an empty one, with the permissions and the owner of the existing file.
    ///
    /// # Errors
    /// The file may not be replaced, or no file can be created in its folder.
    pub(super) fn begin(target: &Path) -> io::Result<Self> {
        match fs::metadata(target) {
            Ok(old) => {
                look_for_a_writer(target, &old)?;
                Self::like(&old, target)
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Self::make(target, RIGHTS),
            Err(error) => Err(error),
        }
    }

    /// The same, with the permissions and the owner of another file.
    pub(super) fn like(other: &Metadata, target: &Path) -> io::Result<Self> {
        let replacement = Self::make(target, 0o600)?;
        let new = replacement.new.as_file();
        give(new, other)?;
        new.set_permissions(other.permissions())?;
        Ok(replacement)
    }

    fn make(target: &Path, rights: u32) -> io::Result<Self> {
        let mut prefix = OsString::from(".");
        prefix.push(target.file_name().unwrap_or_default());
        prefix.push(".");
        let mut options = OpenOptions::new();
        options.write(true).create_new(true).mode(rights);
        let mut name = tempfile::Builder::new();
        // With the system's own errors: the name of a temporary file tells nobody anything.
        let new = name.prefix(&prefix).make_in(folder_of(target), |path| options.open(path))?;
        Ok(Self { new, target: target.to_owned() })
    }

    /// Writes the text to the disk.
    pub(super) fn with(mut self, text: &[u8]) -> io::Result<Self> {
        // With the system's own errors, as the name of a temporary file tells nobody anything.
        self.new.as_file_mut().write_all(text)?;
        self.new.as_file().sync_all()?;
        Ok(self)
    }

    /// Replaces the file.
    pub(super) fn persist(self) -> io::Result<()> {
        let Self { new, target } = self;
        new.persist(&target).map_err(|error| error.error)?;
        // The new name is on the disk once the folder is. A folder may be writable but not readable.
        File::open(folder_of(&target)).map_or(Ok(()), |folder| folder.sync_all())
    }
}

/// Refuses to replace a file that is read-only, or that another program is still writing.
fn look_for_a_writer(path: &Path, old: &Metadata) -> io::Result<()> {
    // It was made read-only on purpose; root could write it regardless.
    if old.permissions().readonly() {
        return Err(Errno::ACCESS.into());
    }
    let file = OpenOptions::new().append(true).open(path)?;
    // Some file systems have no locks.
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => Err(being_written()),
        _ => Ok(()),
    }
}

/// The error if another program is writing the file.
pub(super) fn being_written() -> io::Error {
    io::Error::other("it is being written already; choose another file")
}

/// Gives a file the owner and group of another one. Only root can change the owner; for others the group is enough,
/// so that everybody who could read the old file can read the new one.
fn give(new: &File, old: &Metadata) -> io::Result<()> {
    let now = new.metadata()?;
    let (uid, gid) = (old.uid(), old.gid());
    if (now.uid(), now.gid()) == (uid, gid) {
        return Ok(());
    }
    let gid = Some(Gid::from_raw(gid));
    match fchown(new, Some(Uid::from_raw(uid)), gid) {
        Err(Errno::PERM) => fchown(new, None, gid).map_err(|_| {
            io::Error::new(
                ErrorKind::PermissionDenied,
                format!("its owner ({uid}) and group are others, and only root could keep them"),
            )
        }),
        given => given.map_err(io::Error::from),
    }
}
