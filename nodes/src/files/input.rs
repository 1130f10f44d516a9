//! Files that verbs read.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};

use super::pipe::await_other_end;

const AT_ONCE: Timespec = Timespec { tv_sec: 0, tv_nsec: 0 };
/// Half a second passes before the wait is reported: writers may take a moment.
const LOOKS_UNTIL_SAID: usize = 25;

/// Opens a file for reading. For a named pipe it waits until there is a writer, as `open` does, but reports the wait,
/// and ends it on a signal.
pub(crate) fn open_input(path: &Path) -> io::Result<File> {
    let flags = OFlags::NONBLOCK.bits() as i32;
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path)?;
    if file.metadata()?.file_type().is_fifo() {
        // It is an event, too, if a writer has come and gone.
        let look = || {
            Ok((poll(&mut [PollFd::new(&file, PollFlags::IN)], Some(&AT_ONCE))? > 0).then_some(()))
        };
        await_other_end(path, "writes", LOOKS_UNTIL_SAID, look)?;
    }
    fcntl_setfl(&file, fcntl_getfl(&file)?.difference(OFlags::NONBLOCK))?;
    Ok(file)
}
