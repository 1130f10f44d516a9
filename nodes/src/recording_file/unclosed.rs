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

/// Keeps what a file holds under another name, if that is a recording that was not closed, or cannot be read: it has
/// what a program did before it was killed or crashed. To be called before anything is written. Where it cannot be
/// kept, that is said, and it is replaced like any other file: no node shall stay down for its last recording.
///
/// # Errors
/// It has another name now, and there is no new file.
pub(crate) fn keep_unclosed(file: &mut ResultFile) -> Result<(), WriteError> {
    // A pipe is not opened: that would wait for its other end.
    if !file.is_watched() {
        return Ok(());
    }
    let path = file.path().display().to_string();
    let what = match is_worth_keeping(file.path()) {
        Ok(false) => return Ok(()),
        Ok(true) => {
            format!(
                "the recording {path} was not closed (its recorder was killed, or could not write)"
            )
        }
        Err(error) => {
            format!("{path} may be a recording that was not closed; it cannot be read: {error}")
        }
    };
    match give_other_name(file.path()) {
        Ok(kept) => {
            terminal::note(&format!("note: {what}; kept as {}", kept.display()));
            file.renew().map_err(WriteError::Io)
        }
        Err(error) => {
            let why = format!("it is replaced, as it cannot be kept under another name: {error}");
            terminal::note(&format!("warning: {what}; {why}"));
            Ok(())
        }
    }
}

/// Whether a file holds a recording that was not closed and has something in it.
fn is_worth_keeping(path: &Path) -> io::Result<bool> {
    // One that has just been made need not be read.
    if fs::metadata(path)?.len() == 0 {
        return Ok(false);
    }
    let mut file = File::open(path)?;
    if !is_unclosed(&mut file)? {
        return Ok(false);
    }
    file.rewind()?;
    // What is damaged may have been something.
    let is_empty = Reader::open(file).is_ok_and(|mut reader| {
        reader.skip_cycle().is_ok_and(|has_one| !has_one) && reader.condition().damaged == 0
    });
    Ok(!is_empty)
}

/// Gives a file a name under which it is kept; returns that.
fn give_other_name(path: &Path) -> io::Result<PathBuf> {
    // Beside the file, and not beside a link to it.
    let path = path.canonicalize()?;
    let written_at = fs::metadata(&path)?.modified()?;
    let written_at = Timestamp::try_from(written_at).map_err(io::Error::other)?;
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

/// How the time stands in such a name.
const TIME: &str = "20261121T093015.250Z";

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
        let Some((time, number)) = time.and_then(|time| time.split_at_checked(TIME.len())) else {
            return false;
        };
        let is_as_in = |(byte, pattern): (&u8, u8)| {
            if pattern.is_ascii_digit() { byte.is_ascii_digit() } else { *byte == pattern }
        };
        let is_number = |number: &[u8]| number.iter().all(u8::is_ascii_digit);
        let is_numbered = number.is_empty() || number.strip_prefix(b"_").is_some_and(is_number);
        is_numbered && time.iter().zip(TIME.bytes()).all(is_as_in)
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
        for other in [
            "level.mcap",
            "level_2.mcap",
            "level_20261121T093015.250Z.csv",
            "level_20261121T093015.250Z_closed.mcap",
            "x.mcap",
        ] {
            assert!(!names.has(other.as_ref()), "{other}");
        }
    }
}
