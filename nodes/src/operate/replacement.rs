//! Replacing a file whole or not at all, and keeping the old one.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

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
        Ok(old) if old.is_file() => {
            if fs::read(&file).is_ok_and(|old| old == text.as_bytes()) {
                return Ok(Replaced::Unchanged);
            }
            in_place(&file, text, &old, &backup).map(|()| Replaced::Kept(backup))
        }
        // A device or a pipe takes the text as it is.
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
    new.as_file().set_permissions(old.permissions())?;
    let kept = tempfile::Builder::new().make_in(folder_of(file), |path| fs::hard_link(file, path));
    match kept {
        Ok(kept) => drop(kept.persist(backup).map_err(|error| error.error)?),
        // There are file systems without links.
        Err(_) => {
            let copy = written_beside(backup, &fs::read_to_string(file)?)?;
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

/// A file with the text in the folder of another, on the disk.
fn written_beside(file: &Path, text: &str) -> io::Result<NamedTempFile> {
    let mut new = NamedTempFile::new_in(folder_of(file))?;
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
