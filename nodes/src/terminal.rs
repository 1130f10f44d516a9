//! Writing to stdout and stderr. A reader that went away (`| head`) ends the program in silence. Names
//! come from files and from other processes, so nothing in them reaches a terminal as a command.

use std::io::{self, ErrorKind, IsTerminal, Write};

use isochrone_engine::escaped_lines;
use miette::Report;

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

/// Writes a note for people to stderr. There is no one to tell if that fails.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr(), "{}", escaped_lines(text.trim_end()));
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
