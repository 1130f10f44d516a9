//! Files that verbs read.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

use isochrone_processes::is_asked_to_end;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;

use crate::terminal;

/// Between two looks for a signal.
const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 20_000_000 };

/// A writer that takes half a second is not remarkable.
const LOOKS_UNTIL_SAID: u32 = 25;

/// Opens a file to read it. A pipe is waited for until somebody writes it, as opening it does, but that is said, and
/// a signal ends it.
pub(crate) fn open_input(path: &Path) -> io::Result<File> {
    let flags = OFlags::NONBLOCK.bits() as i32;
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path)?;
    if file.metadata()?.file_type().is_fifo() {
        await_writer(path, &file)?;
    }
    fcntl_setfl(&file, fcntl_getfl(&file)?.difference(OFlags::NONBLOCK))?;
    Ok(file)
}

fn await_writer(path: &Path, pipe: &File) -> io::Result<()> {
    let mut looks = 0;
    // That somebody has written it and gone is an event too.
    while !has_event(pipe)? {
        if is_asked_to_end() {
            return Err(io::Error::other("nobody writes this pipe"));
        }
        looks += 1;
        if looks == LOOKS_UNTIL_SAID {
            terminal::note(&format!("waiting until somebody writes the pipe {}", path.display()));
        }
    }
    Ok(())
}

fn has_event(pipe: &File) -> io::Result<bool> {
    match poll(&mut [PollFd::new(pipe, PollFlags::IN)], Some(&LOOK)) {
        Err(Errno::INTR) => Ok(false),
        polled => Ok(polled? > 0),
    }
}
