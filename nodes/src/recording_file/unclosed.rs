//! Recordings that were not closed, which are kept where another one takes their name.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Seek};
use std::path::{Path, PathBuf};

use isochrone_recording::{Reader, WriteError, is_unclosed};
use jiff::Timestamp;
use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::io::Errno;

use crate::result_file::ResultFile;
use crate::terminal;

/// How many are kept beside the one that takes their name.
const MOST_KEPT: usize = 8;

/// Keeps what a file holds under another name, if that is a recording that was not closed: it has what a program
/// did before it was killed or crashed. To be called before anything is written. Where it cannot be kept, that is
/// said, and it is replaced like any other file: no node shall stay down for its last recording.
///
/// # Errors
/// It has another name now, and there is no new file.
pub(crate) fn keep_unclosed(file: &mut ResultFile) -> Result<(), WriteError> {
    // A pipe is not opened: that would wait for its other end.
    if !file.is_watched() {
        return Ok(());
    }
    let path = file.path().display().to_string();
    let written_at = match unclosed_at(file.path()) {
        Ok(Some(written_at)) => written_at,
        Ok(None) => return Ok(()),
        Err(error) => {
            terminal::note(&format!(
                "warning: {path} is replaced; it cannot be read, so whether it is a recording that was not closed \
                 is not known: {error}"
            ));
            return Ok(());
        }
    };
    match give_other_name(file.path(), written_at) {
        Ok(kept) => {
            let kept = kept.display();
            terminal::note(&format!(
                "note: the recording {path} was not closed (its recorder was killed, or could not write); kept as {kept}"
            ));
            file.renew().map_err(WriteError::Io)
        }
        Err(error) => {
            terminal::note(&format!(
                "warning: the recording {path} was not closed, and is replaced: it cannot be kept under another \
                 name: {error}"
            ));
            Ok(())
        }
    }
}

/// When a recording that was not closed was written last; `None` if the file holds no such recording, or one of
/// nothing.
fn unclosed_at(path: &Path) -> io::Result<Option<Timestamp>> {
    let mut file = File::open(path)?;
    if !is_unclosed(&mut file)? {
        return Ok(None);
    }
    let written_at = Timestamp::try_from(file.metadata()?.modified()?).map_err(io::Error::other)?;
    file.rewind()?;
    // What is damaged may have been something.
    let is_empty = Reader::open(file).is_ok_and(|mut reader| {
        reader.skip_cycle().is_ok_and(|has_one| !has_one) && reader.condition().damaged == 0
    });
    Ok((!is_empty).then_some(written_at))
}

/// Gives a file a name under which it is kept; returns that.
fn give_other_name(path: &Path, written_at: Timestamp) -> io::Result<PathBuf> {
    // Beside the file, and not beside a link to it.
    let path = path.canonicalize()?;
    let names = KeptNames::of(&path);
    if names.count()? >= MOST_KEPT {
        return Err(io::Error::other(format!(
            "{MOST_KEPT} such are kept already; remove those that you do not need"
        )));
    }
    for kept in names.at(written_at) {
        match renameat_with(CWD, &path, CWD, &kept, RenameFlags::NOREPLACE) {
            Err(Errno::EXIST) => {}
            renamed => return Ok(renamed.map(|()| kept)?),
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// The names under which what a file held is kept: `level_20261121T093015.250Z.mcap` for `level.mcap`.
struct KeptNames<'a> {
    path: &'a Path,
    begin: OsString,
    end: OsString,
}

impl<'a> KeptNames<'a> {
    fn of(path: &'a Path) -> Self {
        let mut begin = path.file_stem().unwrap_or_default().to_owned();
        begin.push("_");
        let extension = path.extension();
        let end = extension.map(|it| [OsStr::new("."), it].into_iter().collect());
        Self { path, begin, end: end.unwrap_or_default() }
    }

    /// How many files have such names.
    fn count(&self) -> io::Result<usize> {
        let beside = fs::read_dir(self.path.parent().unwrap_or(Path::new("/")))?;
        Ok(beside.filter(|it| it.as_ref().is_ok_and(|it| self.has(&it.file_name()))).count())
    }

    fn has(&self, name: &OsStr) -> bool {
        let [name, begin, end] = [name, &self.begin, &self.end].map(OsStr::as_encoded_bytes);
        let time = name.strip_prefix(begin).and_then(|rest| rest.strip_suffix(end));
        time.is_some_and(|time| time.len() >= 20 && time.get(8) == Some(&b'T'))
    }

    /// Those for what was written last at a time, the best one first. Files may have the same time where a file
    /// system counts seconds, or a backup was restored.
    fn at(&self, written_at: Timestamp) -> impl Iterator<Item = PathBuf> {
        let time = written_at.strftime("%Y%m%dT%H%M%S.%3fZ").to_string();
        let numbers = (2..).map(|number| format!("_{number}")).take(MOST_KEPT);
        std::iter::once(String::new()).chain(numbers).map(move |number| {
            let mut name = self.begin.clone();
            name.extend([OsStr::new(&time), number.as_ref(), &self.end]);
            self.path.with_file_name(name)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_of_kept_files_are_known_again_and_others_are_not_taken_for_them() {
        let written_at: Timestamp = "2026-11-21T09:30:15.25Z".parse().unwrap();
        for file in ["level.mcap", "level", "a.b.mcap", "level_20261121T093015.250Z.mcap"] {
            let names = KeptNames::of(Path::new(file));
            for name in names.at(written_at) {
                assert!(names.has(name.as_os_str()), "{name:?} of {file}");
            }
        }
        let names = KeptNames::of(Path::new("/data/level.mcap"));
        let paths: Vec<_> = names.at(written_at).take(2).collect();
        let expected = ["level_20261121T093015.250Z.mcap", "level_20261121T093015.250Z_2.mcap"];
        assert_eq!(paths, expected.map(|name| Path::new("/data").join(name)));
        for other in ["level.mcap", "level_2.mcap", "level_20261121T093015.250Z.csv", "x.mcap"] {
            assert!(!names.has(other.as_ref()), "{other}");
        }
    }
}
