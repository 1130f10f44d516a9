//! The bytes of a file, with a look ahead.

use std::io::{self, ErrorKind, Read};

use mcap::MAGIC;

use crate::MAX_RECORD_BYTES;
use crate::record::{RECORD_HEAD, claimed_length, record_head};

/// How much is read at once.
const STEP_BYTES: usize = 1 << 16;
/// How far behind its head a record is looked at, to know it by its fields: names and media types fit in.
pub(crate) const PROBE_BYTES: usize = 1 << 10;
/// How much is searched for a record at once.
const SEARCH_BYTES: usize = 1 << 18;

pub(crate) struct Source<R> {
    file: R,
    /// Read from the file; what was taken of it is removed now and then.
    bytes: Vec<u8>,
    /// How much of `bytes` was taken.
    taken: usize,
    /// Where the file is, in bytes from its beginning.
    at: u64,
    /// The last bytes that were read from the file.
    newest: [u8; MAGIC.len()],
    is_over: bool,
}

impl<R: Read> Source<R> {
    pub(crate) fn new(file: R) -> Self {
        Self { file, bytes: Vec::new(), taken: 0, at: 0, newest: [0; MAGIC.len()], is_over: false }
    }

    /// Bytes that were taken.
    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    /// The last bytes that were read from the file, which at its end are those that it ends with.
    pub(crate) fn newest(&self) -> &[u8; MAGIC.len()] {
        &self.newest
    }

    /// Up to so many of the bytes to come; fewer if the file ends before. What a length claims is believed as far
    /// as the file goes.
    pub(crate) fn peek(&mut self, count: u64) -> io::Result<&[u8]> {
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        while self.ahead().len() < count && !self.is_over {
            if self.taken > self.bytes.len() / 2 {
                self.bytes.drain(..self.taken);
                self.taken = 0;
            }
            self.read_more()?;
        }
        let ahead = self.ahead();
        Ok(ahead.get(..count).unwrap_or(ahead))
    }

    /// Takes up to so many bytes, and adds them to others.
    pub(crate) fn take(&mut self, count: u64, to: &mut Vec<u8>) -> io::Result<()> {
        let taken = self.peek(count)?;
        to.extend_from_slice(taken);
        let taken = taken.len();
        self.pass(taken);
        Ok(())
    }

    /// Passes over up to so many bytes.
    pub(crate) fn skip(&mut self, mut count: u64) -> io::Result<()> {
        while count > 0 {
            let passed = self.peek(count.min(STEP_BYTES as u64))?.len();
            if passed == 0 {
                break;
            }
            self.pass(passed);
            count -= passed as u64;
        }
        Ok(())
    }

    /// Passes over what is no record of which one can be sure, to the next one, or to the end of the file.
    pub(crate) fn find_record(&mut self) -> io::Result<()> {
        const WANTED: usize = SEARCH_BYTES + RECORD_HEAD + PROBE_BYTES;
        loop {
            let ahead = self.peek(WANTED as u64)?.len();
            let is_last = ahead < WANTED;
            let searched = if is_last { ahead } else { SEARCH_BYTES };
            let begins = |at: &usize| self.ahead().get(*at..).is_some_and(|it| self.is_record(it));
            let found = (0..searched).find(begins);
            self.pass(found.unwrap_or(searched));
            if found.is_some() || is_last {
                return Ok(());
            }
        }
    }

    /// Whether bytes begin with a record whose fields say how long it is, and say the same as its head.
    fn is_record(&self, bytes: &[u8]) -> bool {
        let Some((head, body)) = bytes.split_at_checked(RECORD_HEAD) else { return false };
        let Some((opcode, length)) = record_head(head) else { return false };
        let probed = body.get(..PROBE_BYTES).unwrap_or(body);
        claimed_length(opcode, probed) == Some(length)
            && length <= MAX_RECORD_BYTES as u64
            && (!self.is_over || length <= body.len() as u64)
    }

    fn ahead(&self) -> &[u8] {
        self.bytes.get(self.taken..).unwrap_or_default()
    }

    fn pass(&mut self, count: usize) {
        self.taken += count;
        self.at += count as u64;
    }

    /// Reads what there is: whoever reads a pipe does not wait for more than the next record.
    fn read_more(&mut self) -> io::Result<()> {
        let before = self.bytes.len();
        self.bytes.resize(before + STEP_BYTES, 0);
        let read = loop {
            match self.file.read(self.bytes.get_mut(before..).unwrap_or_default()) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                read => break read,
            }
        };
        self.bytes.truncate(before + *read.as_ref().unwrap_or(&0));
        self.is_over = read? == 0;
        let new = self.bytes.get(before..).unwrap_or_default();
        for byte in new.get(new.len().saturating_sub(MAGIC.len())..).unwrap_or_default() {
            self.newest.rotate_left(1);
            if let Some(last) = self.newest.last_mut() {
                *last = *byte;
            }
        }
        Ok(())
    }
}
