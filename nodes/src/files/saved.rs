//! Saving a file, and keeping the old one.

use std::ffi::OsString;
use std::fs::{self, Metadata};
use std::io::{self, ErrorKind};
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};

use isochrone_runtime::output_target;

use super::replacement::Replacement;
use super::{OutputFile, Unwritable};
use crate::failure::Failure;

/// The outcome for a file.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Saved {
    /// It has the text.
    Written,
    /// It has the text, and the old text is kept in this file.
    Kept(PathBuf),
    /// It had the text already; it and a file that keeps an older text are unchanged.
    Unchanged,
}

/// Writes a text to a file. An existing file is kept as `FILE.bak`. Whatever goes wrong, even a full disk or a crash,
/// the file has the old text or the new one.
pub(crate) fn save(path: &Path, text: &str) -> Result<Saved, Failure> {
    let refused = |why: String| Failure::found(Unwritable::new(path, io::Error::other(why)));
    let failed = |error| {
        let as_before = if path.exists() { "; it is as it was" } else { "" };
        let unwritable = Unwritable::new(path, error);
        Failure::found(format!("{unwritable}{as_before}; `save -o FILE` writes to another place"))
    };
    if path.is_symlink() && !path.exists() {
        let target = fs::read_link(path).unwrap_or_default();
        return Err(refused(format!("it is a link to {}, which is not there", target.display())));
    }
    let target = output_target(path).map_err(failed)?;
    let saved = match fs::metadata(&target) {
        // A link that the system made leads to something that this process has open; it is written, even if it is a
        // pipe.
        Ok(_) if target.is_symlink() => write_as_it_is(path, text),
        Ok(old) if old.is_file() => {
            let backup = backup_of(&target);
            if backup.is_dir() {
                let backup = backup.display();
                return Err(refused(format!(
                    "{backup}, which would keep the old file, is a folder; move it away"
                )));
            }
            replace(&target, text, &old, backup)
        }
        Ok(found) if let Some(kind) = no_place(&found) => {
            return Err(refused(format!("it is {kind}; `save` without -o prints the text")));
        }
        // A terminal or another device is written to directly.
        Ok(_) => write_as_it_is(path, text),
        Err(error) if error.kind() == ErrorKind::NotFound => create(&target, text),
        Err(error) => Err(error),
    };
    saved.map_err(failed)
}

fn replace(target: &Path, text: &str, old: &Metadata, backup: PathBuf) -> io::Result<Saved> {
    let had = fs::read(target)?;
    if had == text.as_bytes() {
        return Ok(Saved::Unchanged);
    }
    let new = Replacement::begin(target)?.with(text.as_bytes())?;
    Replacement::like(old, &backup)?.with(&had)?.persist()?;
    new.persist()?;
    Ok(Saved::Kept(backup))
}

fn create(target: &Path, text: &str) -> io::Result<Saved> {
    Replacement::begin(target)?.with(text.as_bytes())?.persist()?;
    Ok(Saved::Written)
}

fn write_as_it_is(path: &Path, text: &str) -> io::Result<Saved> {
    OutputFile::open(path)?.write_whole(text.as_bytes())?;
    Ok(Saved::Written)
}

/// What a text is not saved to: a pipe, for example, would block the verb until there is a reader.
fn no_place(found: &Metadata) -> Option<&'static str> {
    let kind = found.file_type();
    match () {
        () if kind.is_dir() => Some("a folder"),
        () if kind.is_fifo() => Some("a pipe"),
        () if kind.is_socket() => Some("a socket"),
        () if kind.is_block_device() => Some("a disk"),
        () => None,
    }
}

fn backup_of(file: &Path) -> PathBuf {
    let mut name = OsString::from(file);
    name.push(".bak");
    name.into()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

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
        assert_eq!(save(&file, "one").unwrap(), Saved::Written);
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        for (new, old) in [("two", "one"), ("three", "two")] {
            let Saved::Kept(backup) = save(&file, new).unwrap() else { panic!("{new}") };
            // A second time it has the text already.
            assert_eq!(save(&file, new).unwrap(), Saved::Unchanged);
            assert_eq!(fs::read_to_string(&file).unwrap(), new);
            assert_eq!(fs::read_to_string(&backup).unwrap(), old);
        }
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(names(folder.path()), ["n.toml", "n.toml.bak"]);
    }

    /// What was said to whoever wanted to write there.
    fn refused(path: &Path) -> String {
        let failure = save(path, "one").unwrap_err();
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
        save(&file, "two").unwrap();
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
        save(&file, "one").unwrap();
        assert_eq!(fs::read_to_string(backup_of(&file)).unwrap(), "zero");
        assert!(!backup_of(&file).is_symlink());
    }

    #[test]
    fn what_a_link_leads_to_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("n.toml"), folder.path().join("link"));
        fs::write(&file, "one").unwrap();
        symlink(&file, &link).unwrap();
        save(&link, "two").unwrap();
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
            let failure = save(path, "one").unwrap_err();
            let said = format!("{:?}", failure.report().unwrap());
            assert!(said.contains(path.to_str().unwrap()), "{said}");
        }
        assert_eq!(names(folder.path()), [""; 0]);
    }
}
