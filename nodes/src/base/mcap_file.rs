//! Recordings as files on the command line: opened, and judged once they were read.

mod gaps;

use std::fmt::Display;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use isochrone_engine::escaped;
use isochrone_processes::Stop;
use isochrone_recording::{Damage, FileCondition, Reader, Uncarried};
use isochrone_timing::units::counted;

pub(crate) use self::gaps::{Gaps, SendPosition};
use crate::base::failure::Failure;
use crate::base::files::open_input;
use crate::base::terminal;

/// Opens a file.
pub(crate) fn file(path: &Path) -> Result<File, Failure> {
    open_input(path).map_err(|error| unreadable(path, error))
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
pub(crate) fn unreadable(path: &Path, error: impl Display) -> Failure {
    let way_out = way_out(path);
    Failure::usage(format!("cannot read {}: {error}{way_out}", path.display()))
}

/// What to do with a recording of ROS 2 that is not the MCAP file itself.
fn way_out(path: &Path) -> &'static str {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    match ending {
        _ if path.is_dir() => "; give the .mcap file in it",
        _ if !path.is_file() => "",
        "db3" => {
            "; convert it: ros2 bag convert -i BAG -o OUT.yaml, with storage_id: mcap in OUT.yaml"
        }
        "zst" | "zstd" => "; decompress it first: zstd -d",
        _ => "",
    }
}

/// The damage, if there is any.
pub(crate) fn damage(path: &Path, condition: &FileCondition) -> Option<String> {
    let Damage { at, what } = condition.first_damage.as_ref()?;
    let (file, parts) = (path.display(), counted(condition.damaged, "part"));
    Some(format!("{file} is damaged: {parts} left out, the first at byte {at}: {what}"))
}

/// Says what of a topic of ROS 2 is in no frame.
pub(crate) fn note_uncarried<'l>(all: impl IntoIterator<Item = &'l Uncarried>) {
    for Uncarried { service, what } in all {
        terminal::note(&format!("note: left out of \"{}\": {}", escaped(service), escaped(what)));
    }
}

/// A sentence about parts of a recording that were not read or are missing; empty if it is complete.
pub(crate) fn lack(path: &Path, condition: &FileCondition, gaps: &Gaps) -> Option<String> {
    if condition.is_whole() {
        return None;
    }
    let file = path.display();
    let mut what: Vec<String> = damage(path, condition).into_iter().collect();
    if condition.is_of_part {
        what.push(format!(
            "{file} is a copy of a recording that was not closed or is damaged, and has what could be read of it"
        ));
    }
    if !condition.is_closed {
        let newest = gaps.newest().unwrap_or_else(|| "what is in it".to_owned());
        what.push(format!(
            "{file} was not closed (its recorder was killed, could not write, or is still at it, or this is part of a \
             copy): what came after {newest} is not known"
        ));
    }
    let (bytes, cycles) = (condition.unread_bytes, gaps.cycles());
    // Where no cycle stands before them, nobody knows by the cycles how many there were.
    let messages = if cycles == 0 { condition.unread_messages } else { 0 };
    let unread = [(bytes, "byte"), (cycles, "cycle"), (messages, "message")];
    let unread = unread.into_iter().filter(|(count, _)| *count > 0);
    let unread: Vec<String> = unread.map(|(count, of)| counted(count, of).to_string()).collect();
    if !unread.is_empty() {
        what.push(format!("not read: {}", unread.join(" and ")));
    }
    Some(what.join("; "))
}

/// Says what a recording lacks where that is accepted; else it says too little.
pub(crate) fn accept(lack: Option<String>, may_be_incomplete: bool) -> Result<(), Failure> {
    match lack {
        None => Ok(()),
        Some(lack) if may_be_incomplete => {
            terminal::note(&format!("note: {lack}"));
            Ok(())
        }
        Some(lack) => Err(Failure::inconclusive(lack)),
    }
}

/// The same for what needs no whole recording: all but damage is accepted.
pub(crate) fn accept_undamaged(path: &Path, condition: &FileCondition) -> Result<(), Failure> {
    accept(lack(path, condition, &Gaps::default()), condition.damaged == 0)
}

/// The failure of a file that does not have what is asked for; what is damaged may have had it.
pub(crate) fn lacking(damage: Option<String>, what: String) -> Failure {
    match damage {
        None => Failure::usage(what),
        Some(damage) => Failure::found(format!("{damage}; {what}")),
    }
}

/// Warns of damage before it is said that something is not in a file.
pub(crate) fn warn_of_damage(path: &Path, condition: &FileCondition) {
    if let Some(damage) = damage(path, condition) {
        terminal::note(&format!("warning: {damage}"));
    }
}
