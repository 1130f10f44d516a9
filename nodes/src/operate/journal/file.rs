//! The journal in a file: printed while it is read, as it may cover months.

use std::cell::RefCell;
use std::io::{self, Write};
use std::iter::Peekable;
use std::path::Path;

use isochrone_engine::escaped;
use isochrone_runtime::journal::{JournalError, JournalLines, Line, RunHeader};
use serde::ser::{Error, SerializeMap, SerializeSeq};
use serde::{Serialize, Serializer};

use super::text::{text, time};
use crate::base::failure::Failure;
use crate::base::terminal;

/// How much is printed at once, in bytes.
const BLOCK: usize = 64 * 1024;

/// Prints the runs of a file.
pub(super) fn print(path: &Path, json: bool) -> Result<(), Failure> {
    let mut lines = JournalLines::open(path).map_err(Failure::usage)?;
    let mut out = Printer::default();
    let printed =
        if json { print_json(&mut lines, &mut out) } else { print_text(&mut lines, &mut out) };
    // The lines before an error are printed.
    out.print_all()?;
    printed?;
    if let Some(line) = lines.cut_line() {
        let path = path.display();
        terminal::note(&format!(
            "note: {path}: line {line} is cut off: the node was killed while it wrote"
        ));
    }
    Ok(())
}

fn print_text(lines: &mut JournalLines, out: &mut Printer) -> Result<(), Failure> {
    for line in lines {
        let text = match line.map_err(Failure::usage)?.1 {
            Line::Run(run) => head(&run),
            Line::Entry(entry) => text(&entry),
            Line::Missed(_) | Line::End(_) => continue,
        };
        out.print(text.as_bytes())?;
    }
    Ok(())
}

fn head(run: &RunHeader) -> String {
    let RunHeader { run, node, file, started_unix_ns, .. } = run;
    let (node, file, started) = (escaped(node), escaped(file), time(*started_unix_ns));
    format!("run {run} of node \"{node}\", {file}, started {started}\n")
}

fn print_json(lines: &mut JournalLines, out: &mut Printer) -> Result<(), Failure> {
    let runs = Runs { lines: RefCell::new(lines.peekable()), error: RefCell::new(None) };
    let written = serde_json::to_writer_pretty(&mut *out, &runs);
    if let Some(error) = runs.error.take() {
        return Err(Failure::usage(error));
    }
    if let Some(failure) = out.failure.take() {
        return Err(failure);
    }
    written.map_err(|error| Failure::found(format!("cannot write JSON: {error}")))?;
    out.print(b"\n")
}

/// The runs of a file, read while they are written.
struct Runs<'a> {
    lines: RefCell<Peekable<&'a mut JournalLines>>,
    error: RefCell<Option<JournalError>>,
}

/// A run whose header has been read.
struct Run<'r, 'a> {
    header: RunHeader,
    entries: Entries<'r, 'a>,
}

/// The entries up to the next run.
struct Entries<'r, 'a>(&'r Runs<'a>);

impl Runs<'_> {
    /// The next line, if it is one that is wanted.
    fn next<E: Error>(&self, is_wanted: impl Fn(&Line) -> bool) -> Result<Option<Line>, E> {
        let wanted = |line: &Result<(usize, Line), JournalError>| {
            line.as_ref().map_or(true, |(_, line)| is_wanted(line))
        };
        let line = self.lines.borrow_mut().next_if(wanted);
        line.transpose().map(|line| line.map(|(_, line)| line)).map_err(|error| {
            let custom = E::custom(&error);
            *self.error.borrow_mut() = Some(error);
            custom
        })
    }
}

impl Serialize for Runs<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut runs = serializer.serialize_seq(None)?;
        while let Some(line) = self.next(|_| true)? {
            if let Line::Run(header) = line {
                runs.serialize_element(&Run { header, entries: Entries(self) })?;
            }
        }
        runs.end()
    }
}

impl Serialize for Run<'_, '_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut run = serializer.serialize_map(Some(2))?;
        run.serialize_entry("run", &self.header)?;
        run.serialize_entry("entries", &self.entries)?;
        run.end()
    }
}

impl Serialize for Entries<'_, '_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut entries = serializer.serialize_seq(None)?;
        while let Some(line) = self.0.next(|line| !matches!(line, Line::Run(_)))? {
            if let Line::Entry(entry) = line {
                entries.serialize_element(&entry)?;
            }
        }
        entries.end()
    }
}

/// Prints what is written to it a piece at a time.
#[derive(Default)]
struct Printer {
    text: Vec<u8>,
    /// Why nothing more can be printed.
    failure: Option<Failure>,
}

impl Printer {
    fn print(&mut self, text: &[u8]) -> Result<(), Failure> {
        self.text.extend_from_slice(text);
        if self.text.len() < BLOCK { Ok(()) } else { self.print_lines() }
    }

    /// Prints the lines that are whole: a piece of one may end within a character.
    fn print_lines(&mut self) -> Result<(), Failure> {
        let end = self.text.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let rest = self.text.split_off(end);
        self.print_all()?;
        self.text = rest;
        Ok(())
    }

    fn print_all(&mut self) -> Result<(), Failure> {
        let text = std::mem::take(&mut self.text);
        if text.is_empty() { Ok(()) } else { terminal::print(&String::from_utf8_lossy(&text)) }
    }
}

impl Write for Printer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.print(bytes).map_err(|failure| {
            self.failure = Some(failure);
            io::Error::other("it cannot be printed")
        })?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
