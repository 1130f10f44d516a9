//! Recordings as files on the command line: opened, and judged once they were read.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use isochrone_processes::Stop;
use isochrone_recording::{Condition, Damage, Item, ReadError, Reader, WriteError, is_unclosed};
use isochrone_timing::units::counted;
use jiff::Timestamp;
use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::io::Errno;

use crate::failure::Failure;
use crate::result_file::ResultFile;
use crate::terminal;

/// How many recordings that were not closed are kept beside the one that takes their name.
const MOST_KEPT: usize = 8;

/// Keeps what a file holds under another name, if that is a recording that was not closed: it has what a program
/// did before it was killed or crashed. To be called before anything is written. Where it cannot be kept, that is
/// said, and it is replaced like any other file: no node shall stay down for its last recording.
///
/// # Errors
/// It has another name now, and there is no new file.
pub(crate) fn keep_unclosed(file: &mut ResultFile) -> Result<(), WriteError> {
    let path = file.path().display().to_string();
    match give_other_name(file.path()) {
        Ok(None) => Ok(()),
        Ok(Some(kept)) => {
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

/// The new name; `None` if the file holds no such recording.
fn give_other_name(path: &Path) -> io::Result<Option<PathBuf>> {
    // A pipe is not opened: that would wait for its other end.
    if !fs::metadata(path).is_ok_and(|it| it.is_file()) {
        return Ok(None);
    }
    let mut file = File::open(path)?;
    if !is_unclosed(&mut file)? || is_empty(&mut file)? {
        return Ok(None);
    }
    // Beside the file, and not beside a link to it.
    let path = path.canonicalize()?;
    let mut begin = path.file_stem().unwrap_or_default().to_owned();
    begin.push("_");
    let extension =
        path.extension().map(|extension| [".".as_ref(), extension].into_iter().collect());
    let end: OsString = extension.unwrap_or_default();
    let is_kept = |name: OsString| {
        let [name, begin, end] = [&name, &begin, &end].map(|it| it.as_encoded_bytes());
        let time = name.strip_prefix(begin).and_then(|rest| rest.strip_suffix(end));
        time.is_some_and(|time| time.len() >= 20 && time.get(8) == Some(&b'T'))
    };
    let beside = fs::read_dir(path.parent().unwrap_or(Path::new("/")))?;
    if beside.filter(|it| it.as_ref().is_ok_and(|it| is_kept(it.file_name()))).count() >= MOST_KEPT
    {
        return Err(io::Error::other(format!(
            "{MOST_KEPT} such are kept already; remove those that you do not need"
        )));
    }
    let written = Timestamp::try_from(file.metadata()?.modified()?).map_err(io::Error::other)?;
    let written = written.strftime("%Y%m%dT%H%M%S.%3fZ").to_string();
    // Files may have the same time where a file system counts seconds, or a backup was restored.
    let numbers = (2..).map(|number| format!("_{number}")).take(MOST_KEPT);
    for number in std::iter::once(String::new()).chain(numbers) {
        let mut name = begin.clone();
        name.extend([OsStr::new(&written), number.as_ref(), &end]);
        let kept = path.with_file_name(name);
        match renameat_with(CWD, &path, CWD, &kept, RenameFlags::NOREPLACE) {
            Err(Errno::EXIST) => {}
            renamed => return Ok(renamed.map(|()| Some(kept))?),
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// Whether nothing was recorded in a file. What is damaged may have been something.
fn is_empty(file: &mut File) -> io::Result<bool> {
    file.rewind()?;
    let Ok(mut reader) = Reader::open(file) else { return Ok(false) };
    loop {
        match reader.next_item() {
            Ok(Some(Item::Frame(_) | Item::Row(_))) | Err(_) => return Ok(false),
            Ok(Some(_)) => {}
            Ok(None) => return Ok(reader.condition().damaged == 0),
        }
    }
}

/// Opens a file.
pub(crate) fn file(path: &Path) -> Result<File, Failure> {
    File::open(path).map_err(|error| unreadable(path, &ReadError::Io(error)))
}

/// Begins to read a recording.
pub(crate) fn open(path: &Path) -> Result<Reader<File>, Failure> {
    Reader::open_with_index(file(path)?).map_err(|error| unreadable(path, &error))
}

/// The same; it seems to break off where the program is to end.
pub(crate) fn open_until(path: &Path, stop: &Stop) -> Result<Reader<Until>, Failure> {
    Reader::open_with_index(file_until(path, stop)?).map_err(|error| unreadable(path, &error))
}

/// Opens a file that seems to break off where the program is to end.
pub(crate) fn file_until(path: &Path, stop: &Stop) -> Result<Until, Failure> {
    Ok(Until { file: file(path)?, stop: stop.clone(), has_begun: false })
}

/// A file that is read until the program is to end.
pub(crate) struct Until {
    file: File,
    stop: Stop,
    /// Whether it was read: without its beginning, it would be taken for no recording.
    has_begun: bool,
}

impl Read for Until {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if std::mem::replace(&mut self.has_begun, true) && self.stop.is_due() {
            return Ok(0);
        }
        self.file.read(bytes)
    }
}

impl Seek for Until {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.has_begun = false;
        self.file.seek(to)
    }
}

/// The failure of a file that cannot be read.
pub(crate) fn unreadable(path: &Path, error: &ReadError) -> Failure {
    Failure::usage(format!("cannot read {}: {error}", path.display()))
}

/// Says that a file was not closed. Damage is a failure, for when everything else is done.
pub(crate) fn judge(path: &Path, condition: &Condition) -> Result<(), Failure> {
    let file = path.display();
    if !condition.is_closed {
        terminal::note(&format!(
            "note: {file} was not closed: its recorder was killed, or is still at it; read as far as it goes"
        ));
    }
    damage(path, condition).map_or(Ok(()), |damage| Err(Failure::found(damage)))
}

/// What is damaged, if something is.
pub(crate) fn damage(path: &Path, condition: &Condition) -> Option<String> {
    let Damage { at, what } = condition.first_damage.as_ref()?;
    let (file, parts) = (path.display(), counted(condition.damaged, "part"));
    Some(format!("{file} is damaged: {parts} left out, the first at byte {at}: {what}"))
}

/// The failure of a file that does not have what is asked for; what is damaged may have had it.
pub(crate) fn lacking(damage: Option<String>, what: String) -> Failure {
    match damage {
        None => Failure::usage(what),
        Some(damage) => Failure::found(format!("{damage}; {what}")),
    }
}

/// Warns of damage before it is said that something is not in a file.
pub(crate) fn warn_of_damage(path: &Path, condition: &Condition) {
    if let Some(damage) = damage(path, condition) {
        terminal::note(&format!("warning: {damage}"));
    }
}
