//! Output files. The process may have more rights than other users who can write to their folders.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{OFlags, PROC_SUPER_MAGIC, statfs};
use rustix::io::Errno;
use rustix::process::geteuid;

/// The most symbolic links that are followed, as in the kernel.
const MOST_LINKS: usize = 40;
/// In a folder with these mode bits everybody may create files, and only their owners may remove them.
const STICKY_FOR_ALL: u32 = 0o1002;
const ROOT: u32 = 0;

/// Opens the [target](output_target) of a path to write to it. `flags` are more of open(2), such as `O_NONBLOCK`, as
/// [`custom_flags`](OpenOptionsExt::custom_flags) takes them; those of `options` do not count.
///
/// # Errors
/// The path has no target, or the system refuses to open it.
pub fn open_output(path: &Path, options: &OpenOptions, flags: i32) -> io::Result<File> {
    let target = output_target(path)?;
    // Somebody may put a link there before the file is opened.
    let follow = if target.is_symlink() { OFlags::empty() } else { OFlags::NOFOLLOW };
    options.clone().custom_flags(flags | follow.bits() as i32).open(target)
}

/// The file that is written for a path: the path itself or the target of its links, which need not exist. The result
/// is a link only if the system made it, like the one that `/dev/stdout` leads to, which has no path.
///
/// # Errors
/// The file, or a link on the way to it, is in a folder where everybody may create files, such as `/tmp`, and belongs
/// to another user. Such a link could lead to any file that this process may write, and such a pipe or file would
/// disclose what it writes. The kernel refuses the same if `fs.protected_symlinks`, `fs.protected_fifos` and
/// `fs.protected_regular` are 1, which they are not on every machine. Files of root are accepted.
pub fn output_target(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        // A user who can put a link on the way after this check could also put a folder of their own there.
        for link in path.ancestors() {
            if let Ok(found) = fs::symlink_metadata(link)
                && (found.is_symlink() || (link == path && !found.is_dir()))
            {
                refuse_planted(link, &found)?;
            }
        }
        if !path.is_symlink() || statfs(folder_of(&path))?.f_type == PROC_SUPER_MAGIC {
            return Ok(path);
        }
        let target = fs::read_link(&path)?;
        path.pop();
        path.push(target);
    }
    Err(Errno::LOOP.into())
}

/// Refuses what another user has put into a folder where everybody may create files.
fn refuse_planted(path: &Path, found: &Metadata) -> io::Result<()> {
    let (folder, owner) = (folder_of(path), found.uid());
    let about = fs::metadata(folder)?;
    let is_of_all = about.mode() & STICKY_FOR_ALL == STICKY_FOR_ALL;
    if is_of_all && ![ROOT, geteuid().as_raw(), about.uid()].contains(&owner) {
        let what = match found.file_type() {
            kind if kind.is_symlink() => "link",
            kind if kind.is_fifo() => "pipe",
            _ => "file",
        };
        let (path, folder) = (path.display(), folder.display());
        return Err(io::Error::new(
            ErrorKind::PermissionDenied,
            format!(
                "{path} is a {what} that another user (id {owner}) has put into {folder}, where everybody may \
                 write; remove it, or choose another file"
            ),
        ));
    }
    Ok(())
}

/// The folder that a file is in: `.` for a plain name.
pub fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;
    use std::io::Write;
    use std::os::unix::fs::{PermissionsExt, chown, lchown, symlink};

    use rustix::fs::{CWD, FileType, mknodat};

    use super::*;

    fn open(path: &Path) -> io::Result<File> {
        open_output(path, OpenOptions::new().write(true).create(true), 0)
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
    fn what_another_user_has_put_into_a_folder_of_everybody_is_refused() {
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
        fs::write(there("report.json"), "").unwrap();
        mknodat(CWD, there("pipe"), FileType::Fifo, 0o666.into(), 0).unwrap();
        for path in ["report.json", "pipe"] {
            chown(there(path), Some(65_533), None).unwrap();
        }
        for path in ["out.mcap", "near/out.mcap", "report.json", "pipe"] {
            let refused = open(&there(path)).unwrap_err();
            assert_eq!(refused.kind(), ErrorKind::PermissionDenied);
            assert!(refused.to_string().contains("another user (id 65533)"), "{refused}");
        }
        assert_eq!(fs::read(there("precious")).unwrap(), b"of root");
        // Where others cannot put links, whoever can may do worse.
        fs::set_permissions(folder.path(), Permissions::from_mode(0o755)).unwrap();
        open(&there("out.mcap")).unwrap();
        open(&there("report.json")).unwrap();
    }
}
