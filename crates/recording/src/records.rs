//! The records of a file, up to where it breaks off.

use std::io::{BufReader, Read, Seek};

use mcap::MAGIC;
use mcap::records::{Record, Statistics, op};

use crate::chunk::{may_hold, unpack};
use crate::condition::Tally;
use crate::index::{FOOTER_BYTES, FOOTER_CHECKED_BYTES, Index};
use crate::record::{RECORD_HEAD, parse, record_head};
use crate::{Condition, MAX_RECORD_BYTES, ReadError};

/// How much is read before it is known that there is more.
const STEP_BYTES: u64 = 1 << 20;

/// Reads a file record by record; chunks are opened.
pub(crate) struct Records<R> {
    file: BufReader<R>,
    /// What its end says.
    index: Index,
    /// Bytes that were read of the file.
    at: u64,
    /// The last of them.
    newest: [u8; MAGIC.len()],
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
    condition: Condition,
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
enum Found {
    InFile { opcode: u8 },
    InChunk { opcode: u8, start: usize, end: usize },
}

impl<R: Read + Seek> Records<R> {
    /// Begins with the schemas and channels that the end of the file repeats.
    pub(crate) fn open_with_index(mut file: R) -> Result<Self, ReadError> {
        let mut index = Index::read(&mut file)?;
        let chunk = std::mem::take(&mut index.described);
        let record_at = index.at;
        Ok(Self { index, chunk, record_at, ..Self::open(file)? })
    }
}

impl<R: Read> Records<R> {
    pub(crate) fn open(file: R) -> Result<Self, ReadError> {
        let mut records = Self {
            file: BufReader::with_capacity(1 << 16, file),
            index: Index::default(),
            at: 0,
            newest: [0; MAGIC.len()],
            record_at: 0,
            body: Vec::new(),
            chunk: Vec::new(),
            chunk_at: 0,
            zstd: zstd::bulk::Decompressor::new()?,
            section: Section::Data,
            crc: crc32fast::Hasher::new(),
            tally: Tally::default(),
            statistics: None,
            condition: Condition::default(),
        };
        if !records.read_body(MAGIC.len() as u64)? || records.body != MAGIC {
            return Err(ReadError::NotMcap);
        }
        records.crc.update(MAGIC);
        Ok(records)
    }

    /// The next record of the data; `None` at the end.
    pub(crate) fn next_record(&mut self) -> Result<Option<Record<'_>>, ReadError> {
        loop {
            let Some(found) = self.find()? else { return Ok(None) };
            // A borrow that is returned on one way only would last for the whole loop, so it is parsed twice.
            match self.record(&found) {
                Ok(record) => {
                    let is_message = matches!(record, Record::Message { .. });
                    self.tally.messages += u64::from(is_message);
                }
                Err(what) => {
                    if let Found::InChunk { .. } = found {
                        self.chunk_at = self.chunk.len();
                    }
                    self.note(what);
                    continue;
                }
            }
            return Ok(self.record(&found).ok());
        }
    }

    fn record(&self, found: &Found) -> Result<Record<'_>, String> {
        match *found {
            Found::InFile { opcode } => parse(opcode, &self.body),
            Found::InChunk { opcode, .. } if !may_hold(opcode) => {
                Err(format!("a chunk with a record ({opcode:#04x}) that no chunk has"))
            }
            Found::InChunk { opcode, start, end } => {
                parse(opcode, self.chunk.get(start..end).unwrap_or_default())
            }
        }
    }

    /// Takes note of damage that the record just read turns out to have.
    pub(crate) fn note(&mut self, what: impl Into<String>) {
        self.condition.note(self.record_at, what);
    }

    pub(crate) fn condition(&self) -> &Condition {
        &self.condition
    }

    fn find(&mut self) -> Result<Option<Found>, ReadError> {
        loop {
            if let Some(found) = self.find_in_chunk() {
                return Ok(Some(found));
            }
            if self.section == Section::Over {
                return Ok(None);
            }
            let Some(opcode) = self.read_record()? else {
                self.break_off();
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
                        return Ok(Some(Found::InFile { opcode }));
                    }
                    self.open_chunk()?;
                }
                (0x80.., _) => {}
                _ => self.note(format!("a record ({opcode:#04x}) that cannot stand there")),
            }
        }
    }

    fn find_in_chunk(&mut self) -> Option<Found> {
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
            self.chunk_at = self.chunk.len();
            self.note("a chunk ends within a record");
            return None;
        };
        let start = self.chunk_at + RECORD_HEAD;
        self.chunk_at = start + length;
        Some(Found::InChunk { opcode, start, end: start + length })
    }

    /// Reads a record of the file into `body`; `None` where the file breaks off, or is so damaged that
    /// nothing is known of what follows.
    fn read_record(&mut self) -> Result<Option<u8>, ReadError> {
        loop {
            self.record_at = self.at;
            let next = self.index.next_after(self.at);
            let room = next.map_or(u64::MAX, |next| next - self.at);
            if room < RECORD_HEAD as u64 {
                self.note("what is no record");
                self.read_body(room)?;
                continue;
            }
            if !self.read_body(RECORD_HEAD as u64)? {
                return Ok(None);
            }
            let Some((opcode, length)) = record_head(&self.body) else { return Ok(None) };
            let room = room - RECORD_HEAD as u64;
            if length > room.min(MAX_RECORD_BYTES as u64) {
                let rest = if next.is_some() { "" } else { "; what follows it is not read" };
                self.note(format!("a record of {length} bytes{rest}"));
                self.skip(room)?;
                continue;
            }
            let before = self.crc.clone();
            self.crc.update(&self.body);
            if !self.read_body(length)? {
                return Ok(None);
            }
            match opcode {
                // Its checksum is of what stands before it, and that of the footer of what follows it.
                op::DATA_END => self.crc = before,
                op::FOOTER => self.crc.update(self.body.get(..FOOTER_CHECKED_BYTES).unwrap_or(&[])),
                _ => self.crc.update(&self.body),
            }
            return Ok(Some(opcode));
        }
    }

    /// The checksum of what was read since the last one.
    fn sum(&mut self) -> u32 {
        std::mem::take(&mut self.crc).finalize()
    }

    /// Behind the footer.
    fn end(&mut self) -> Result<(), ReadError> {
        if self.section == Section::Summary {
            let sum = self.sum();
            let said = self.body.get(FOOTER_CHECKED_BYTES..).unwrap_or_default();
            self.tally.is_checksum_wrong |= said != [0; 4] && said != sum.to_le_bytes();
        }
        let footer_at = self.record_at;
        self.record_at = self.at;
        self.condition.is_closed = self.read_body(MAGIC.len() as u64)?;
        if self.condition.is_closed && self.body != MAGIC {
            self.note("an end that is none of an MCAP file");
        } else if self.condition.is_closed && self.read_body(1)? {
            self.note("more behind the end of the file, which is not read");
        }
        if self.condition.is_closed
            && let Some(what) = self.tally.compare(self.statistics.as_ref())
        {
            self.condition.note_if_first(footer_at, what);
        }
        self.section = Section::Over;
        Ok(())
    }

    /// Where the file ends without a footer. If its writer came to its end, the way there was lost.
    fn break_off(&mut self) {
        self.condition.is_closed = self.newest == *MAGIC && self.at > MAGIC.len() as u64;
        if self.condition.is_closed {
            let what = "a record that does not end where it says";
            self.condition.note_if_first(self.record_at, what);
        }
        self.section = Section::Over;
    }

    fn open_chunk(&mut self) -> Result<(), ReadError> {
        self.tally.chunks += 1;
        self.chunk.clear();
        self.chunk_at = 0;
        match mcap::parse_record(op::CHUNK, &self.body) {
            Ok(Record::Chunk { header, data }) => {
                if let Err(what) = unpack(&mut self.zstd, &header, &data, &mut self.chunk)? {
                    self.chunk.clear();
                    self.note(what);
                }
            }
            _ => self.note("a chunk without its header"),
        }
        Ok(())
    }

    /// Reads so many bytes into `body`; `false` if the file ends before.
    fn read_body(&mut self, length: u64) -> Result<bool, ReadError> {
        self.body.clear();
        // What a length claims is believed as far as the file goes.
        while (self.body.len() as u64) < length {
            let step = (length - self.body.len() as u64).min(STEP_BYTES);
            let read = (&mut self.file).take(step).read_to_end(&mut self.body)?;
            self.at += read as u64;
            if read == 0 {
                break;
            }
        }
        let kept = self.body.len().min(MAGIC.len());
        self.newest.rotate_left(kept);
        for (kept, byte) in self.newest.iter_mut().rev().zip(self.body.iter().rev()) {
            *kept = *byte;
        }
        Ok(self.body.len() as u64 == length)
    }

    /// Passes over so many bytes, or what there is of them.
    fn skip(&mut self, mut length: u64) -> Result<(), ReadError> {
        while length > 0 && self.read_body(length.min(STEP_BYTES))? {
            length -= length.min(STEP_BYTES);
        }
        Ok(())
    }
}
