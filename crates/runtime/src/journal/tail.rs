//! The end of a journal file: what the next run in it goes on from. It is read backwards, as the file may have
//! months of lines.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

use super::error::JournalError;
use super::line::Line;
use super::lines::{JournalLines, parse};

/// Least that is read at once, in bytes.
const BLOCK: u64 = 64 * 1024;

/// What a file ends with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Tail {
    /// Number of its last run; 0: it has none.
    pub(super) run: u64,
    /// The last transaction of all its runs; 0: there is none.
    pub(super) transaction: u64,
    /// Length of its complete lines, in bytes.
    pub(super) bytes: u64,
    /// Whether the last of them lacks its end of line.
    pub(super) is_open: bool,
    /// Whether an incomplete line comes after them.
    pub(super) is_cut: bool,
}

impl Tail {
    /// Reads the end of a file up to where it says what was before: the end of the last run, or its beginning if
    /// the node was killed. Of what versions wrote that did not say so, all is read.
    ///
    /// # Errors
    /// It cannot be read, or what was read is no journal, or of another format.
    pub(super) fn read(path: &Path) -> Result<Self, JournalError> {
        let name = path.display().to_string();
        let failed = |source| JournalError::Read { path: name.clone(), source };
        let file = File::open(path).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        let mut tail = Self { bytes: length, ..Self::default() };
        if length == 0 {
            return Ok(tail);
        }
        // Whatever ends like one, a journal begins with a run.
        JournalLines::open(path)?.next().transpose()?;
        let mut lines = Backwards { file, begins: length, held: Vec::new() };
        let mut is_last = true;
        while let Some(bytes) = lines.next().map_err(failed)? {
            let has_end = bytes.ends_with(b"\n");
            // Lines have no numbers from here.
            match parse(&name, 0, &bytes) {
                Ok(line) => {
                    tail.is_open |= is_last && !has_end;
                    if tail.take(&line) {
                        break;
                    }
                }
                Err(_) if is_last && !has_end => {
                    (tail.is_cut, tail.bytes) = (true, lines.ends());
                }
                Err(error) => return Err(first_error(path).unwrap_or(error)),
            }
            is_last = false;
        }
        Ok(tail)
    }

    /// Takes in a line, from the last to the first; whether nothing is to be known of those before it.
    fn take(&mut self, line: &Line) -> bool {
        let last = match line {
            Line::Run(header) => {
                self.run = self.run.max(header.run);
                header.after_transaction
            }
            Line::End(end) => {
                self.run = self.run.max(end.run);
                end.last_transaction
            }
            Line::Entry(entry) => {
                self.transaction = self.transaction.max(entry.transaction);
                None
            }
            Line::Missed(_) | Line::Unclear(_) => None,
        };
        self.transaction = self.transaction.max(last.unwrap_or_default());
        last.is_some()
    }
}

/// The first thing that is wrong with a file, with its line.
fn first_error(path: &Path) -> Option<JournalError> {
    match JournalLines::open(path) {
        Ok(lines) => lines.filter_map(Result::err).next(),
        Err(error) => Some(error),
    }
}

/// The lines of a file from the last to the first, each with its end.
struct Backwards {
    file: File,
    /// Where what is held begins in the file.
    begins: u64,
    /// Up to the line that was taken last.
    held: Vec<u8>,
}

impl Backwards {
    /// Where the lines end that have not been taken.
    fn ends(&self) -> u64 {
        self.begins + self.held.len() as u64
    }

    fn next(&mut self) -> io::Result<Option<Vec<u8>>> {
        loop {
            let before = self.held.len().saturating_sub(1);
            let held = self.held.get(..before).unwrap_or_default();
            if let Some(end) = held.iter().rposition(|byte| *byte == b'\n') {
                return Ok(Some(self.held.split_off(end + 1)));
            }
            if self.begins == 0 {
                let first = std::mem::take(&mut self.held);
                return Ok(Some(first).filter(|first| !first.is_empty()));
            }
            // A long line is read in few pieces.
            let most = BLOCK.max(self.held.len() as u64);
            let from = self.begins.saturating_sub(most);
            let mut held = vec![0; (self.begins - from) as usize];
            self.file.read_exact_at(&mut held, from)?;
            held.append(&mut self.held);
            (self.held, self.begins) = (held, from);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUN: &str = r#"{"run":{"format":1,"run":3,"node":"n","version":"0","file":"f","sha256":"","started_unix_ns":0"#;

    fn tail_of(text: &str) -> Result<Tail, JournalError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        Tail::read(file.path())
    }

    fn entry(transaction: u64) -> String {
        format!(
            "{{\"entry\":{{\"sequence\":1,\"transaction\":{transaction},\"action\":\"set\",\"task\":\"t\",\
             \"cycle\":1,\"unix_ns\":1,\"changes\":[]}}}}\n"
        )
    }

    #[test]
    fn the_end_of_a_run_tells_all_and_the_lines_before_it_are_not_looked_at() {
        let end = r#"{"end":{"run":7,"ended_unix_ns":0,"last_transaction":41}}"#;
        let text = format!("{RUN}}}}}\nnonsense\n{}{end}\n", entry(90));
        let tail = tail_of(&text).unwrap();
        let bytes = text.len() as u64;
        let expected = Tail { run: 7, transaction: 41, bytes, is_open: false, is_cut: false };
        assert_eq!(tail, expected);
    }

    #[test]
    fn a_run_without_an_end_is_read_up_to_its_beginning() {
        let run = format!("{RUN},\"after_transaction\":9}}}}\n");
        let text = format!("{run}nonsense\n{run}{}{}{}", entry(12), entry(11), "{\"entr");
        let tail = tail_of(&text).unwrap();
        assert_eq!((tail.run, tail.transaction, tail.is_cut), (3, 12, true));
        assert_eq!(tail.bytes, text.len() as u64 - 6);
        assert_eq!(tail_of(&run).unwrap().transaction, 9);
        let open = tail_of(run.trim_end()).unwrap();
        assert!(open.is_open && !open.is_cut);
    }

    #[test]
    fn what_older_versions_wrote_is_read_to_its_first_line_however_long_its_lines_are() {
        let long = format!("{RUN},\"configuration\":\"{}\"}}}}\n", "x".repeat(300_000));
        let end = r#"{"end":{"run":3,"ended_unix_ns":0}}"#;
        let text = format!("{long}{}{end}\n{long}{end}\n", entry(5));
        let tail = tail_of(&text).unwrap();
        assert_eq!((tail.run, tail.transaction, tail.bytes), (3, 5, text.len() as u64));
        let broken = text.replace("\"entry\"", "\"enrty\"");
        let told = tail_of(&broken).unwrap_err().to_string();
        assert!(told.contains(":2: no line of a journal: unknown variant `enrty`"), "{told}");
    }

    #[test]
    fn a_file_that_does_not_begin_with_a_run_is_no_journal() {
        assert_eq!(tail_of("").unwrap(), Tail::default());
        let end = r#"{"end":{"run":7,"ended_unix_ns":0,"last_transaction":41}}"#;
        let told = tail_of(&format!("dear diary\n{end}\n")).unwrap_err().to_string();
        assert!(told.contains(":1: no line of a journal"), "{told}");
    }
}
