//! Files that a process writes, which may have more rights than whoever can write in their folders.

use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

use rustix::fs::{CWD, Mode, OFlags, PROC_SUPER_MAGIC, fstat, fstatfs, openat, readlinkat};
use rustix::io::Errno;
use rustix::process::geteuid;

/// Most links that are followed, as in the kernel.
const MOST_LINKS: usize = 40;
/// In a folder with these bits everybody may put files, and only their owners may remove them.
const STICKY_FOR_ALL: u32 = 0o1002;

/// Opens a file that is to be written. A link in it is followed, unless another user has put it into a folder where
/// everybody may put files, such as `/tmp`: it could lead to any file that this process may write. The kernel
/// refuses the same where `fs.protected_symlinks` is 1, which not every machine has.
///
/// # Errors
/// There is such a link, or the system refuses.
pub fn open_output(path: &Path, options: &OpenOptions, flags: OFlags) -> io::Result<File> {
    let mut options = options.clone();
    options.custom_flags((flags | OFlags::NOFOLLOW).bits() as i32);
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        // Whoever puts a link on the way after this look could as well put a folder of their own there.
        for link in path.ancestors() {
            if let Ok(found) = fs::symlink_metadata(link)
                && found.is_symlink()
            {
                refuse_planted(link, found.uid())?;
            }
        }
        match options.open(&path) {
            Err(error) if Errno::from_io_error(&error) == Some(Errno::LOOP) => {}
            opened => return opened,
        }
        // Since that look another one may have come. Held open, none comes between this look and the target.
        let held = OFlags::PATH | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let link = openat(CWD, &path, held, Mode::empty())?;
        refuse_planted(&path, fstat(&link)?.st_uid)?;
        // Such as /dev/stdout: a link that the system makes, and that leads to no path.
        if fstatfs(&link)?.f_type == PROC_SUPER_MAGIC {
            options.custom_flags(flags.bits() as i32);
            return options.open(&path);
        }
        let target = readlinkat(&link, "", Vec::new())?;
        path.pop();
        path.push(OsStr::from_bytes(target.as_bytes()));
    }
    Err(Errno::LOOP.into())
}

/// Refuses a link that another user has put into a folder of everybody.
fn refuse_planted(link: &Path, owner: u32) -> io::Result<()> {
    let folder = match link.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let about = fs::metadata(folder)?;
    let is_of_all = about.mode() & STICKY_FOR_ALL == STICKY_FOR_ALL;
    if is_of_all && owner != geteuid().as_raw() && owner != about.uid() {
        let (link, folder) = (link.display(), folder.display());
        return Err(io::Error::new(
            ErrorKind::PermissionDenied,
            format!(
                "{link} is a link that another user (id {owner}) has put into {folder}, where everybody may \
                 write; remove it, or choose another file"
            ),
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;
    use std::io::Write;
    use std::os::unix::fs::{PermissionsExt, lchown, symlink};

    use super::*;

    fn open(path: &Path) -> io::Result<File> {
        open_output(path, OpenOptions::new().write(true).create(true), OFlags::empty())
    }

    #[test]
    fn a_link_is_followed_also_to_a_file_that_is_not_there_yet() {
        let folder = tempfile::tempdir().unwrap();
        let there = |name: &str| folder.path().join(name);
        fs::create_dir(there("far")).unwrap();
        symlink("far/there.mcap", there("one")).unwrap();
        symlink("one", there("two")).unwrap();
        open(&there("two")).unwrap().write_all(b"x").unwrap();
        assert_eq!(fs::read(there("far/there.mcap")).unwrap(), b"x");
        symlink("round", there("round")).unwrap();
        assert_eq!(Errno::from_io_error(&open(&there("round")).unwrap_err()), Some(Errno::LOOP));
        // Our own link in a folder of everybody.
        fs::set_permissions(folder.path(), Permissions::from_mode(0o1777)).unwrap();
        open(&there("two")).unwrap();
    }

    #[test]
    fn a_link_that_another_user_has_put_into_a_folder_of_everybody_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let there = |name: &str| folder.path().join(name);
        fs::write(there("precious"), "of root").unwrap();
        fs::create_dir(there("far")).unwrap();
        fs::set_permissions(folder.path(), Permissions::from_mode(0o1777)).unwrap();
        symlink("precious", there("out.mcap")).unwrap();
        symlink("far", there("near")).unwrap();
        for link in ["out.mcap", "near"] {
            if lchown(there(link), Some(65_533), None).is_err() {
                return isochrone_testing::not_tested(
                    "a link of another user",
                    "only root can make one",
                );
            }
        }
        for path in ["out.mcap", "near/out.mcap"] {
            let refused = open(&there(path)).unwrap_err();
            assert_eq!(refused.kind(), ErrorKind::PermissionDenied);
            assert!(refused.to_string().contains("another user (id 65533)"), "{refused}");
        }
        assert_eq!(fs::read(there("precious")).unwrap(), b"of root");
        // Where others cannot put links, whoever can may do worse.
        fs::set_permissions(folder.path(), Permissions::from_mode(0o755)).unwrap();
        open(&there("out.mcap")).unwrap();
    }
}
