//! Writing to stdout and stderr. Names come from files and other processes, so nothing in them reaches a terminal as a
//! command.

use std::io::{self, Write};

use isochrone_engine::escaped_lines;

/// Writes a result to stdout. A reader that went away wants no more of it.
pub(crate) fn print(text: &str) {
    let mut out = io::stdout().lock();
    let _ = out.write_all(escaped_lines(text).as_bytes()).and_then(|()| out.flush());
}

/// Writes a note for people to stderr. There is no one to tell if that fails.
pub(crate) fn note(text: &str) {
    let _ = writeln!(Notes, "{}", escaped_lines(text.trim_end()));
}

/// Writes to stderr, and never fails: a log that nobody reads must not end the bridge.
#[derive(Clone, Copy)]
pub(crate) struct Notes;

impl Write for Notes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let _ = io::stderr().write_all(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}
