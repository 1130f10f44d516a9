//! Writing to stdout and stderr. A reader that went away (`| head`) ends the program in silence. Names
//! come from files and from other processes, so nothing in them reaches a terminal as a command.

use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::{Mutex, PoisonError};

use isochrone_engine::escaped_lines;
use miette::Report;
use rustix::termios::tcgetwinsize;

use crate::failure::Failure;

/// Writes a result to stdout.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(escaped_lines(text).as_bytes()).and_then(|()| out.flush()).map_err(|error| {
        match error.kind() {
            ErrorKind::BrokenPipe => Failure::reader_left(),
            _ => Failure::found(format!("cannot write to stdout: {error}")),
        }
    })
}

/// Columns and lines of a terminal that does not say.
const SIZE: (usize, usize) = (80, 24);

/// Columns and lines of the terminal that stdout is.
pub(crate) fn size() -> (usize, usize) {
    match tcgetwinsize(io::stdout()) {
        Ok(size) if size.ws_col > 0 && size.ws_row > 0 => {
            (usize::from(size.ws_col), usize::from(size.ws_row))
        }
        _ => SIZE,
    }
}

/// Writes a note for people to stderr. There is no one to tell if that fails.
pub(crate) fn note(text: &str) {
    let _ = writeln!(notes(), "{}", escaped_lines(text.trim_end()));
}

/// The notes that are kept while they are held back.
const MOST_HELD: usize = 64 * 1024;
/// Notes and logs that wait until the terminal is free; `None` while nothing is held.
static HELD: Mutex<Option<Vec<u8>>> = Mutex::new(None);

/// Where notes and logs go: stderr.
pub(crate) fn notes() -> Notes {
    Notes
}

/// Writes to stderr, or keeps what is written while notes are held.
pub(crate) struct Notes;

impl Write for Notes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut *HELD.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(held) => {
                let room = MOST_HELD.saturating_sub(held.len());
                held.extend_from_slice(bytes.get(..room).unwrap_or(bytes));
                Ok(bytes.len())
            }
            // tracing reports a log that it cannot write with eprintln!, which panics where stderr is a
            // pipe without a reader. A log that nobody reads any more must not end a plant.
            None => {
                let _ = io::stderr().write_all(bytes);
                Ok(bytes.len())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Holds notes and logs back where stderr is a terminal: a program draws on all of it.
pub(crate) fn hold_notes() {
    if io::stderr().is_terminal() {
        HELD.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default();
    }
}

/// Writes what was held.
pub(crate) fn release_notes() {
    let held = HELD.lock().unwrap_or_else(PoisonError::into_inner).take();
    let _ = io::stderr().write_all(&held.unwrap_or_default());
}

/// Writes why a verb failed to stderr.
pub(crate) fn note_failure(failure: &Failure) {
    if let Some(report) = failure.report() {
        note_report(report);
    }
}

/// Writes what is wrong to stderr. The colours are the renderer's own; whoever makes a report has
/// escaped what is quoted in it.
pub(crate) fn note_report(report: &Report) {
    let _ = writeln!(io::stderr(), "{}", format!("{report:?}").trim_end());
}

/// Writes a result to stdout as JSON.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    match serde_json::to_string_pretty(value) {
        Ok(text) => print(&(text + "\n")),
        Err(error) => Err(Failure::found(format!("cannot write JSON: {error}"))),
    }
}

/// A value as one line of JSON.
pub(crate) fn json_line(value: &impl serde::Serialize) -> Result<String, Failure> {
    match serde_json::to_string(value) {
        Ok(text) => Ok(text + "\n"),
        Err(error) => Err(Failure::found(format!("cannot write JSON: {error}"))),
    }
}

/// Whether stderr is a terminal where colour is welcome.
pub(crate) fn stderr_has_colour() -> bool {
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// How errors look: drawn with lines and colour on a terminal, plain where they are piped.
pub(crate) fn set_up_reports() {
    let terminal = io::stderr().is_terminal();
    let hook = miette::set_hook(Box::new(move |_| {
        Box::new(
            miette::MietteHandlerOpts::new()
                .terminal_links(false)
                .color(stderr_has_colour())
                .unicode(terminal)
                .context_lines(1)
                .wrap_lines(terminal)
                .build(),
        )
    }));
    // Only a second call could fail.
    debug_assert!(hook.is_ok());
}
