//! Replacing a file whole or not at all, and keeping the old one.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use rustix::fs::{Gid, Uid, fchown};
use rustix::io::Errno;
use tempfile::NamedTempFile;

use crate::failure::Failure;

/// What became of a file.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Replaced {
    /// It has the text.
    Written,
    /// It has the text, and the old one is kept in this file.
    Kept(PathBuf),
    /// It had the text already; it and the file that keeps an older one are as they were.
    Unchanged,
}

/// Writes a text to a file. One that is there is kept as `FILE.bak`. Whatever goes wrong, a full disk or
/// a crash, the file has the old text or the new one.
pub(super) fn replace(path: &Path, text: &str) -> Result<Replaced, Failure> {
    // What a link leads to is replaced, not the link.
    let file = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folder = folder_of(&file);
    let refused = |why: String| Failure::found(format!("cannot write {}: {why}", path.display()));
    if path.is_symlink() && !path.exists() {
        let target = fs::read_link(path).unwrap_or_default();
        return Err(refused(format!("it is a link to {}, which is not there", target.display())));
    }
    if !folder.is_dir() {
        return Err(refused(format!("there is no folder {}", folder.display())));
    }
    let backup = backup_of(&file);
    if file.is_file() && backup.is_dir() {
        let backup = backup.display();
        return Err(refused(format!(
            "{backup}, which would keep the old file, is a folder; move it away"
        )));
    }
    let written = match fs::metadata(&file) {
        Ok(found) if let Some(kind) = no_place(path, &found) => {
            return Err(refused(format!("it is {kind}; `save` without -o prints the text")));
        }
        Ok(old) if old.is_file() => {
            remove_leftovers(&file);
            if fs::read(&file).is_ok_and(|old| old == text.as_bytes()) {
                return Ok(Replaced::Unchanged);
            }
            in_place(&file, text, &old, &backup).map(|()| Replaced::Kept(backup))
        }
        // A terminal or another device takes the text as it is.
        Ok(_) => fs::write(&file, text).map(|()| Replaced::Written),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            create(&file, text).map(|()| Replaced::Written)
        }
        Err(error) => Err(error),
    };
    let as_before = if file.exists() { "; it is as it was" } else { "" };
    written.map_err(|error| {
        refused(format!("{error}{as_before}; `save -o FILE` writes to another place"))
    })
}

fn in_place(file: &Path, text: &str, old: &fs::Metadata, backup: &Path) -> io::Result<()> {
    // Nobody made it read-only for nothing; root could write it all the same.
    if old.permissions().readonly() {
        return Err(Errno::ACCESS.into());
    }
    fs::OpenOptions::new().append(true).open(file)?;
    let new = written_beside(file, text)?;
    give(new.as_file(), old)?;
    new.as_file().set_permissions(old.permissions())?;
    let kept = tempfile::Builder::new()
        .prefix(&beside(file))
        .make_in(folder_of(file), |path| fs::hard_link(file, path));
    match kept {
        Ok(kept) => drop(kept.persist(backup).map_err(|error| error.error)?),
        // There are file systems without links.
        Err(_) => {
            let copy = written_beside(backup, &fs::read_to_string(file)?)?;
            give(copy.as_file(), old)?;
            copy.as_file().set_permissions(old.permissions())?;
            copy.persist(backup).map_err(|error| error.error)?;
        }
    }
    new.persist(file).map_err(|error| error.error)?;
    sync_folder(file)
}

fn create(file: &Path, text: &str) -> io::Result<()> {
    // Not by way of a file beside it, which would be readable for its owner alone.
    let mut new = fs::OpenOptions::new().write(true).create_new(true).open(file)?;
    let written = new.write_all(text.as_bytes()).and_then(|()| new.sync_all());
    if written.is_err() {
        // What cannot be removed either stays, cut off.
        let _ = fs::remove_file(file);
    }
    written
}

/// What a text is not written to: a pipe would hold the verb until somebody reads.
fn no_place(path: &Path, found: &fs::Metadata) -> Option<&'static str> {
    let kind = found.file_type();
    // What this process has open already may be a pipe.
    let is_own = ["/dev/stdout", "/dev/stderr", "/dev/fd", "/proc/self/fd"]
        .iter()
        .any(|own| path.starts_with(own));
    match () {
        () if kind.is_dir() => Some("a folder"),
        () if is_own => None,
        () if kind.is_fifo() => Some("a pipe"),
        () if kind.is_socket() => Some("a socket"),
        () if kind.is_block_device() => Some("a disk"),
        () => None,
    }
}

/// Gives a file to the owner of the one whose place it is to take. Root alone can do that; for others the
/// group is enough, by which those can read it who could before.
fn give(new: &File, old: &fs::Metadata) -> io::Result<()> {
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

/// What the names of files begin with that are to take the place of another: whose they are, so that those
/// of a process that was killed can be told.
fn prefix(file: &Path) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(file.file_name().unwrap_or(OsStr::new("save")));
    prefix.push(".save-");
    prefix
}

fn beside(file: &Path) -> OsString {
    let mut prefix = prefix(file);
    prefix.push(format!("{}-", std::process::id()));
    prefix
}

/// Removes what a save of this file has left that was killed.
fn remove_leftovers(file: &Path) {
    let prefix = prefix(file);
    let is_left = |name: &OsStr| {
        let rest = name.as_encoded_bytes().strip_prefix(prefix.as_encoded_bytes());
        let process = rest.and_then(|rest| rest.split(|byte| *byte == b'-').next());
        let process = process.and_then(|process| std::str::from_utf8(process).ok());
        let process: Option<u32> = process.and_then(|process| process.parse().ok());
        process.is_some_and(|process| !Path::new(&format!("/proc/{process}")).exists())
    };
    // One that cannot be removed is in nobody's way.
    let entries = fs::read_dir(folder_of(file)).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| is_left(&entry.file_name())) {
        let _ = fs::remove_file(entry.path());
    }
}

/// A file with the text in the folder of another, on the disk.
fn written_beside(file: &Path, text: &str) -> io::Result<NamedTempFile> {
    let mut new = tempfile::Builder::new().prefix(&beside(file)).tempfile_in(folder_of(file))?;
    new.write_all(text.as_bytes())?;
    new.as_file().sync_all()?;
    Ok(new)
}

/// A rename is on the disk when its folder is.
fn sync_folder(file: &Path) -> io::Result<()> {
    File::open(folder_of(file))?.sync_all()
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn backup_of(file: &Path) -> PathBuf {
    let mut name = OsString::from(file);
    name.push(".bak");
    name.into()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::{PermissionsExt, symlink};

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn the_old_file_is_kept_and_the_new_one_has_its_rights() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("n.toml");
        assert_eq!(replace(&file, "one").unwrap(), Replaced::Written);
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        for (new, old) in [("two", "one"), ("three", "two")] {
            let Replaced::Kept(backup) = replace(&file, new).unwrap() else { panic!("{new}") };
            // A second time it has the text already.
            assert_eq!(replace(&file, new).unwrap(), Replaced::Unchanged);
            assert_eq!(fs::read_to_string(&file).unwrap(), new);
            assert_eq!(fs::read_to_string(&backup).unwrap(), old);
        }
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(names(folder.path()), ["n.toml", "n.toml.bak"]);
    }

    /// What was said to whoever wanted to write there.
    fn refused(path: &Path) -> String {
        let failure = replace(path, "one").unwrap_err();
        let said = format!("{:?}", failure.report().unwrap());
        // Without the breaks between its lines.
        let words = said.split_whitespace().filter(|word| !["|", "\u{2502}"].contains(word));
        words.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn root_leaves_a_file_to_its_owner_and_others_keep_its_group() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("n.toml");
        fs::write(&file, "one").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        let before = fs::metadata(&file).unwrap();
        let is_root = rustix::process::geteuid().is_root();
        if is_root {
            std::os::unix::fs::chown(&file, Some(12345), Some(23456)).unwrap();
        }
        replace(&file, "two").unwrap();
        for path in [file.clone(), backup_of(&file)] {
            let now = fs::metadata(path).unwrap();
            let expected = if is_root { (12345, 23456) } else { (before.uid(), before.gid()) };
            assert_eq!((now.uid(), now.gid()), expected);
            assert_eq!(now.permissions().mode() & 0o777, 0o640);
        }
    }

    #[test]
    fn a_pipe_a_socket_and_a_folder_are_refused_and_nobody_waits() {
        let folder = tempfile::tempdir().unwrap();
        let [pipe, socket] = ["pipe", "socket"].map(|name| folder.path().join(name));
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RUSR).unwrap();
        let _bound = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        for (path, kind) in [(&*pipe, "a pipe"), (&socket, "a socket"), (folder.path(), "a folder")]
        {
            let said = refused(path);
            assert!(said.contains(kind) && said.contains("prints the text"), "{said}");
        }
        let (link, target) = (folder.path().join("link"), folder.path().join("gone.toml"));
        symlink(&target, &link).unwrap();
        let said = refused(&link);
        assert!(said.contains("gone.toml, which is not there"), "{said}");
    }

    #[test]
    fn a_folder_in_the_place_of_the_old_file_is_named_and_a_link_there_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("n.toml");
        fs::write(&file, "zero").unwrap();
        fs::create_dir(backup_of(&file)).unwrap();
        let said = refused(&file);
        assert!(said.contains("n.toml.bak") && said.contains("is a folder"), "{said}");
        fs::remove_dir(backup_of(&file)).unwrap();
        symlink(folder.path().join("nowhere"), backup_of(&file)).unwrap();
        replace(&file, "one").unwrap();
        assert_eq!(fs::read_to_string(backup_of(&file)).unwrap(), "zero");
        assert!(!backup_of(&file).is_symlink());
    }

    #[test]
    fn what_a_killed_save_has_left_is_removed_and_that_of_another_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("n.toml");
        fs::write(&file, "zero").unwrap();
        // No process has such a number.
        let own = format!(".n.toml.save-{}-b", std::process::id());
        for left in
            [".n.toml.save-4294967295-a", &own, ".n.toml.save-", ".m.toml.save-4294967295-a"]
        {
            fs::write(folder.path().join(left), "").unwrap();
        }
        replace(&file, "one").unwrap();
        let mut kept = vec![".m.toml.save-4294967295-a", ".n.toml.save-", &own];
        kept.extend(["n.toml", "n.toml.bak"]);
        kept.sort_unstable();
        assert_eq!(names(folder.path()), kept);
    }

    #[test]
    fn what_a_link_leads_to_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("n.toml"), folder.path().join("link"));
        fs::write(&file, "one").unwrap();
        symlink(&file, &link).unwrap();
        replace(&link, "two").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "two");
        assert!(link.is_symlink());
    }

    #[test]
    fn a_place_that_cannot_be_written_to_is_named_and_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let nowhere = folder.path().join("missing/n.toml");
        for path in
            [Path::new("/dev/full"), Path::new("/proc/self/n.toml"), folder.path(), &nowhere]
        {
            let failure = replace(path, "one").unwrap_err();
            let said = format!("{:?}", failure.report().unwrap());
            assert!(said.contains(path.to_str().unwrap()), "{said}");
        }
        assert_eq!(names(folder.path()), [""; 0]);
    }
}
