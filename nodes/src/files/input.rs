//! Files that verbs read.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};

use super::pipe::await_other_end;

const AT_ONCE: Timespec = Timespec { tv_sec: 0, tv_nsec: 0 };
/// A writer that takes half a second is not remarkable.
const LOOKS_UNTIL_SAID: usize = 25;

/// Opens a file to read it. A pipe is waited for until somebody writes it, as opening it does, but that is said, and
/// a signal ends it.
pub(crate) fn open_input(path: &Path) -> io::Result<File> {
    let flags = OFlags::NONBLOCK.bits() as i32;
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path)?;
    if file.metadata()?.file_type().is_fifo() {
        // That somebody has written it and gone is an event too.
        let look = || {
            Ok((poll(&mut [PollFd::new(&file, PollFlags::IN)], Some(&AT_ONCE))? > 0).then_some(()))
        };
        await_other_end(path, "writes", LOOKS_UNTIL_SAID, look)?;
    }
    fcntl_setfl(&file, fcntl_getfl(&file)?.difference(OFlags::NONBLOCK))?;
    Ok(file)
}
