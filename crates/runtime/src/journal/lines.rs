//! The lines of a journal file, one after the other.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use serde_json::Value;

use super::error::JournalError;
use super::line::{FORMAT, Line};

/// Reads a journal file line by line, numbered from 1. Only one line is in memory at a time, as a file may cover
/// months. An incomplete last line, which a killed node leaves, is skipped.
///
/// The iterator ends after its first error: a line that is not a journal line, a run in another format, or a file
/// that has no run or cannot be read.
#[derive(Debug)]
pub struct JournalLines {
    path: String,
    reader: BufReader<File>,
    bytes: Vec<u8>,
    line: usize,
    /// Length of the complete lines, and whether the last of them lacks its end of line.
    whole_bytes: u64,
    is_open: bool,
    has_run: bool,
    is_over: bool,
    cut_line: Option<usize>,
}

impl JournalLines {
    /// Opens a file.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn open(path: &Path) -> Result<Self, JournalError> {
        let file = File::open(path).map_err(|source| read(&path.display().to_string(), source))?;
        Ok(Self::of(file, path))
    }

    /// Reads an open file; `path` is for errors.
    pub(super) fn of(file: File, path: &Path) -> Self {
        Self {
            path: path.display().to_string(),
            reader: BufReader::new(file),
            bytes: Vec::new(),
            line: 0,
            whole_bytes: 0,
            is_open: false,
            has_run: false,
            is_over: false,
            cut_line: None,
        }
    }

    /// The number of the incomplete last line, once all others were read: the node was killed while writing it.
    pub fn cut_line(&self) -> Option<usize> {
        self.cut_line
    }

    /// Length of the complete lines that were read, in bytes.
    pub(super) fn whole_bytes(&self) -> u64 {
        self.whole_bytes
    }

    /// Whether the last of them lacks its end of line.
    pub(super) fn is_open(&self) -> bool {
        self.is_open
    }

    fn read(&mut self) -> Result<Option<Line>, JournalError> {
        self.bytes.clear();
        let length = self.reader.read_until(b'\n', &mut self.bytes);
        if length.map_err(|source| read(&self.path, source))? == 0 {
            let path = || self.path.clone();
            return if self.has_run { Ok(None) } else { Err(JournalError::Empty { path: path() }) };
        }
        self.line += 1;
        match parse(&self.path, self.line, &self.bytes) {
            Ok(line) if self.has_run || matches!(line, Line::Run(_)) => {
                self.has_run = true;
                self.whole_bytes += self.bytes.len() as u64;
                self.is_open = !self.bytes.ends_with(b"\n");
                Ok(Some(line))
            }
            Ok(_) => {
                let reason = "the first line must be that of a run".into();
                Err(JournalError::BadLine { path: self.path.clone(), line: self.line, reason })
            }
            Err(JournalError::BadLine { .. }) if self.has_run && !self.bytes.ends_with(b"\n") => {
                self.cut_line = Some(self.line);
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

impl Iterator for JournalLines {
    type Item = Result<(usize, Line), JournalError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let line = self.read().transpose();
        self.is_over = !matches!(line, Some(Ok(_)));
        line.map(|line| line.map(|line| (self.line, line)))
    }
}

/// Parses a line; the error says what is wrong with it.
fn parse(path: &str, line: usize, bytes: &[u8]) -> Result<Line, JournalError> {
    let bad = |reason| JournalError::BadLine { path: path.to_owned(), line, reason };
    match serde_json::from_slice(bytes) {
        Ok(Line::Run(header)) if header.format != FORMAT => {
            Err(other_format(path, line, bytes).unwrap_or_else(|| bad(String::new())))
        }
        Ok(content) => Ok(content),
        Err(error) => Err(other_format(path, line, bytes)
            .unwrap_or_else(|| bad(without_place(&error.to_string())))),
    }
}

fn read(path: &str, source: std::io::Error) -> JournalError {
    JournalError::Read { path: path.to_owned(), source }
}

/// The error for the first line of a run in the format of another version, if it is one.
fn other_format(path: &str, line: usize, bytes: &[u8]) -> Option<JournalError> {
    let value: Value = serde_json::from_slice(bytes).ok()?;
    let header = value.get("run")?;
    let format = header.get("format")?.as_u64()?;
    (format != u64::from(FORMAT)).then(|| JournalError::OtherFormat {
        path: path.to_owned(),
        line,
        run: header.get("run").and_then(Value::as_u64).unwrap_or_default(),
        format,
        version: header.get("version").and_then(Value::as_str).unwrap_or("unknown").to_owned(),
    })
}

/// The message of a parse error, without line and column, which would be relative to this line.
pub(super) fn without_place(message: &str) -> String {
    message.split(" at line ").next().unwrap_or(message).to_owned()
}
