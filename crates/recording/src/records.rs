//! The records of a file, up to where it breaks off.

use std::io::{Read, Seek};

use mcap::MAGIC;
use mcap::records::{Record, Statistics, op};

use crate::chunk::{may_hold, unpack};
use crate::condition::{PART, Tally};
use crate::index::{FOOTER_BYTES, FOOTER_CHECKED_BYTES, Index};
use crate::record::{RECORD_HEAD, claimed_length, contradicts, parse, record_head};
use crate::source::{PROBE_BYTES, Source};
use crate::{FileCondition, MAX_RECORD_BYTES, RecordingReadError};

/// Reads a file record by record; chunks are opened.
pub(crate) struct Records<R> {
    source: Source<R>,
    /// The index at its end.
    index: Index,
    /// Where the record in `body` begins.
    record_at: u64,
    body: Vec<u8>,
    chunk: Vec<u8>,
    /// How much of the chunk was read.
    chunk_at: usize,
    zstd: zstd::bulk::Decompressor<'static>,
    section: Section,
    /// Of what was read of this section.
    crc: crc32fast::Hasher,
    tally: Tally,
    statistics: Option<Statistics>,
    condition: FileCondition,
}

/// The sections of a file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    Data,
    Summary,
    /// Behind the end, or where nothing is known of what follows.
    Over,
}

/// Where the next record stands.
enum RecordLocation {
    InFile { opcode: u8 },
    InChunk { opcode: u8, start: usize, end: usize },
}

impl<R: Read + Seek> Records<R> {
    /// Begins with the schemas and channels that the end of the file repeats.
    pub(crate) fn open_with_index(mut file: R) -> Result<Self, RecordingReadError> {
        let mut index = Index::read(&mut file)?;
        let chunk = std::mem::take(&mut index.described);
        let record_at = index.at;
        Ok(Self { chunk, record_at, ..Self::begin(file, index)? })
    }
}

impl<R: Read> Records<R> {
    pub(crate) fn open(file: R) -> Result<Self, RecordingReadError> {
        Self::begin(file, Index::default())
    }

    fn begin(file: R, index: Index) -> Result<Self, RecordingReadError> {
        let is_known_by_its_end = index.at > 0;
        let mut records = Self {
            source: Source::new(file),
            index,
            record_at: 0,
            body: Vec::new(),
            chunk: Vec::new(),
            chunk_at: 0,
            zstd: zstd::bulk::Decompressor::new()?,
            section: Section::Data,
            crc: crc32fast::Hasher::new(),
            tally: Tally::default(),
            statistics: None,
            condition: FileCondition::default(),
        };
        if !records.read_body(MAGIC.len() as u64)? || records.body != MAGIC {
            if !is_known_by_its_end {
                return Err(RecordingReadError("it is no MCAP file".into()));
            }
            records.note("a beginning that is none of an MCAP file");
        }
        records.crc.update(MAGIC);
        Ok(records)
    }

    /// The next record of the data; `None` at the end.
    pub(crate) fn next_record(&mut self) -> Result<Option<Record<'_>>, RecordingReadError> {
        loop {
            let Some(found) = self.find()? else { return Ok(None) };
            // A borrow that is returned on one way only would last for the whole loop, so it is parsed twice.
            let read = self.record(&found).map(|record| match record {
                Record::Message { .. } => (1, false),
                Record::Metadata(metadata) => (0, metadata.name == PART),
                _ => (0, false),
            });
            match read {
                Ok((messages, is_of_part)) => {
                    self.tally.messages += messages;
                    self.condition.is_of_part |= is_of_part;
                }
                Err(what) => {
                    match found {
                        RecordLocation::InFile { .. } => self.note_unread(what),
                        RecordLocation::InChunk { start, .. } => {
                            self.leave_chunk(start - RECORD_HEAD, what)
                        }
                    }
                    continue;
                }
            }
            return Ok(self.record(&found).ok());
        }
    }

    fn record(&self, found: &RecordLocation) -> Result<Record<'_>, String> {
        match *found {
            RecordLocation::InFile { opcode } => parse(opcode, &self.body),
            RecordLocation::InChunk { opcode, .. } if !may_hold(opcode) => {
                Err(format!("a chunk with a record ({opcode:#04x}) that no chunk has"))
            }
            RecordLocation::InChunk { opcode, start, end } => {
                parse(opcode, self.chunk.get(start..end).unwrap_or_default())
            }
        }
    }

    /// Takes note of damage that the record just read turns out to have.
    pub(crate) fn note(&mut self, what: impl Into<String>) {
        self.condition.note(self.record_at, what);
    }

    /// The same, for damage for which all of that record is passed over.
    fn note_unread(&mut self, what: impl Into<String>) {
        self.note(what);
        self.condition.unread_bytes += self.source.at() - self.record_at;
    }

    /// Takes note of damage within a chunk, of which nothing is read from there on.
    fn leave_chunk(&mut self, at: usize, what: impl Into<String>) {
        self.note(what);
        self.condition.unread_bytes += (self.chunk.len() - at) as u64;
        self.chunk_at = self.chunk.len();
    }

    pub(crate) fn condition(&self) -> &FileCondition {
        &self.condition
    }

    fn find(&mut self) -> Result<Option<RecordLocation>, RecordingReadError> {
        loop {
            if let Some(found) = self.find_in_chunk() {
                return Ok(Some(found));
            }
            if self.section == Section::Over {
                return Ok(None);
            }
            let Some(opcode) = self.read_record()? else {
                self.break_off()?;
                return Ok(None);
            };
            let is_all_read = self.index.next_after(self.record_at).is_none();
            match (opcode, self.section) {
                (op::FOOTER, _) if self.body.len() == FOOTER_BYTES && is_all_read => self.end()?,
                (op::DATA_END, Section::Data) if self.body.len() == 4 && is_all_read => {
                    let sum = self.sum();
                    let said = &self.body;
                    self.tally.is_checksum_wrong |= *said != [0; 4] && *said != sum.to_le_bytes();
                    self.section = Section::Summary;
                }
                (op::SCHEMA | op::CHANNEL | op::SUMMARY_OFFSET, Section::Summary)
                | (op::CHUNK_INDEX | op::ATTACHMENT_INDEX | op::METADATA_INDEX, Section::Summary) =>
                    {}
                (op::STATISTICS, Section::Summary) => match parse(opcode, &self.body) {
                    Ok(Record::Statistics(statistics)) => self.statistics = Some(statistics),
                    _ => self.note("statistics that are malformed"),
                },
                (op::STATISTICS | op::SUMMARY_OFFSET, Section::Data)
                | (op::CHUNK_INDEX | op::ATTACHMENT_INDEX | op::METADATA_INDEX, Section::Data)
                    if is_all_read =>
                {
                    self.condition.note_if_first(self.record_at, "no end of the data");
                    self.section = Section::Summary;
                }
                (op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE, _)
                | (op::CHUNK | op::MESSAGE_INDEX | op::ATTACHMENT | op::METADATA, _) => {
                    if self.section == Section::Summary {
                        let what = format!("a record ({opcode:#04x}) behind the end of the data");
                        self.condition.note_if_first(self.record_at, what);
                        self.section = Section::Data;
                    }
                    if opcode != op::CHUNK {
                        return Ok(Some(RecordLocation::InFile { opcode }));
                    }
                    self.open_chunk()?;
                }
                (0x80.., _) if !is_chunk(&self.body) => {}
                _ => self.note_unread(cannot_stand_there(opcode)),
            }
        }
    }

    fn find_in_chunk(&mut self) -> Option<RecordLocation> {
        let head = self.chunk.get(self.chunk_at..)?;
        if head.is_empty() {
            return None;
        }
        let known = head.split_at_checked(RECORD_HEAD).and_then(|(head, rest)| {
            let (opcode, length) = record_head(head)?;
            let length = usize::try_from(length).ok().filter(|length| *length <= rest.len())?;
            Some((opcode, length))
        });
        let Some((opcode, length)) = known else {
            self.leave_chunk(self.chunk_at, "a chunk ends within a record");
            return None;
        };
        let start = self.chunk_at + RECORD_HEAD;
        self.chunk_at = start + length;
        Some(RecordLocation::InChunk { opcode, start, end: start + length })
    }

    /// Reads a record of the file into `body`; `None` where the file ends or breaks off. What cannot be a record,
    /// or not as long as it says, is passed over: to the next one that the end of the file knows, or that is found.
    fn read_record(&mut self) -> Result<Option<u8>, RecordingReadError> {
        const HEAD: u64 = RECORD_HEAD as u64;
        loop {
            self.record_at = self.source.at();
            let next = self.index.next_after(self.record_at);
            let room = next.map_or(u64::MAX, |next| next - self.record_at);
            if room < HEAD {
                self.pass_over(next, "what is no record")?;
                continue;
            }
            let Some((opcode, length)) = record_head(self.source.peek(HEAD)?) else {
                return Ok(None);
            };
            let probed = self.source.peek(HEAD + length.min(PROBE_BYTES as u64))?;
            let probed = probed.get(RECORD_HEAD..).unwrap_or_default();
            let claimed = claimed_length(opcode, probed);
            let is_contradicted = contradicts(opcode, length, probed);
            if length > (room - HEAD).min(MAX_RECORD_BYTES as u64) {
                self.pass_over(next, format!("a record of {length} bytes"))?;
                continue;
            }
            if is_contradicted {
                self.pass_over(next, "a record that cannot be as long as it says")?;
                continue;
            }
            if matches!(opcode, 0 | 0x10..0x80) {
                self.pass_over(next, cannot_stand_there(opcode))?;
                continue;
            }
            if self.source.peek(HEAD + length)?.len() as u64 != HEAD + length {
                // One of which the fields say the same was cut off. What other ones say of their length may be wrong.
                if claimed.is_none() && self.passes_over_to_another()? {
                    continue;
                }
                return Ok(None);
            }
            let before = self.crc.clone();
            self.read_body(HEAD)?;
            self.crc.update(&self.body);
            self.read_body(length)?;
            match opcode {
                // Its checksum is of what stands before it, and that of the footer of what follows it.
                op::DATA_END => self.crc = before,
                op::FOOTER => self.crc.update(self.body.get(..FOOTER_CHECKED_BYTES).unwrap_or(&[])),
                _ => self.crc.update(&self.body),
            }
            return Ok(Some(opcode));
        }
    }

    /// Passes over what is damaged.
    fn pass_over(
        &mut self,
        next: Option<u64>,
        what: impl Into<String>,
    ) -> Result<(), RecordingReadError> {
        match next {
            Some(next) => self.source.skip(next - self.record_at)?,
            None => {
                self.source.skip(1)?;
                self.source.find_record()?;
            }
        }
        self.note_unread(what);
        Ok(())
    }

    /// Passes over a record that seems to go on behind the end of the file, if another one stands before that end.
    fn passes_over_to_another(&mut self) -> Result<bool, RecordingReadError> {
        self.source.skip(1)?;
        self.source.find_record()?;
        let is_found = !self.source.peek(1)?.is_empty();
        if is_found {
            self.note_unread("a record that would go on behind the end of the file");
        }
        Ok(is_found)
    }

    /// The checksum of what was read since the last one.
    fn sum(&mut self) -> u32 {
        std::mem::take(&mut self.crc).finalize()
    }

    /// Behind the footer.
    fn end(&mut self) -> Result<(), RecordingReadError> {
        if self.section == Section::Summary {
            let sum = self.sum();
            let said = self.body.get(FOOTER_CHECKED_BYTES..).unwrap_or_default();
            self.tally.is_checksum_wrong |= said != [0; 4] && said != sum.to_le_bytes();
        }
        let footer_at = self.record_at;
        self.record_at = self.source.at();
        self.condition.is_closed = self.read_body(MAGIC.len() as u64)?;
        if self.condition.is_closed && self.body != MAGIC {
            self.note("an end that is none of an MCAP file");
        } else if self.condition.is_closed && !self.source.peek(1)?.is_empty() {
            self.record_at = self.source.at();
            self.source.skip(u64::MAX)?;
            self.note_unread("more behind the end of the file, which is not read");
        }
        let said = self.statistics.as_ref().map_or(0, |said| said.message_count);
        self.condition.unread_messages = said.saturating_sub(self.tally.messages);
        if self.condition.is_closed
            && let Some(what) = self.tally.compare(self.statistics.as_ref())
        {
            self.condition.note_if_first(footer_at, what);
        }
        self.section = Section::Over;
        Ok(())
    }

    /// Where the file ends without a footer. If its writer came to its end, the way there was lost.
    fn break_off(&mut self) -> Result<(), RecordingReadError> {
        self.source.skip(u64::MAX)?;
        let (begin, end) = (self.record_at, self.source.at());
        self.condition.unread_bytes += end - begin;
        self.condition.is_closed = *self.source.newest() == *MAGIC && end > MAGIC.len() as u64;
        if self.condition.is_closed {
            self.condition.note_if_first(begin, "a record that does not end where it says");
        }
        self.section = Section::Over;
        Ok(())
    }

    fn open_chunk(&mut self) -> Result<(), RecordingReadError> {
        self.tally.chunks += 1;
        self.chunk.clear();
        self.chunk_at = 0;
        match parse(op::CHUNK, &self.body) {
            Ok(Record::Chunk { header, data }) => {
                if let Err(what) = unpack(&mut self.zstd, &header, &data, &mut self.chunk)? {
                    self.chunk.clear();
                    self.note_unread(what);
                }
            }
            _ => self.note_unread("a chunk without its header"),
        }
        Ok(())
    }

    /// Reads this many bytes into `body`; `false` if the file ends before.
    fn read_body(&mut self, length: u64) -> Result<bool, RecordingReadError> {
        self.body.clear();
        self.source.take(length, &mut self.body)?;
        Ok(self.body.len() as u64 == length)
    }
}

/// Whether what stands behind the head of a record is a chunk, whatever the record passes for.
fn is_chunk(body: &[u8]) -> bool {
    claimed_length(op::CHUNK, body) == Some(body.len() as u64)
}

fn cannot_stand_there(opcode: u8) -> String {
    format!("a record ({opcode:#04x}) that cannot stand there")
}
