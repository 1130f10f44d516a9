//! The records of a file, up to where it breaks off.

use std::io::{BufReader, ErrorKind, Read};

use mcap::MAGIC;
use mcap::records::{ChunkHeader, Record, op};

use crate::ReadError;

/// The largest record, and the largest chunk before it is compressed, that a reader takes: 64 MiB. What is
/// larger counts as damaged.
pub const MAX_RECORD_BYTES: usize = 64 << 20;
/// How much is read before it is known that there is more.
const STEP_BYTES: u64 = 1 << 20;
/// The first byte of a record, and its length.
const RECORD_HEAD: usize = 9;

/// In what state a file is, once it was read to its end.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Condition {
    /// Whether its writer closed it. One that was killed did not.
    pub is_closed: bool,
    /// Records and chunks that were passed over because they are damaged.
    pub damaged: u64,
    /// The first of them.
    pub first_damage: Option<Damage>,
}

/// What is wrong with a part of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins, in bytes from the beginning of the file.
    pub at: u64,
    /// What is wrong.
    pub what: String,
}

/// Reads a file record by record; chunks are opened.
pub(crate) struct Records<R> {
    file: BufReader<R>,
    /// Bytes that were read of the file.
    at: u64,
    /// Where the record in `body` begins.
    record_at: u64,
    body: Vec<u8>,
    chunk: Vec<u8>,
    /// How much of the chunk was read.
    chunk_at: usize,
    zstd: zstd::bulk::Decompressor<'static>,
    is_over: bool,
    condition: Condition,
}

/// Where the next record stands.
enum Found {
    InFile { opcode: u8 },
    InChunk { opcode: u8, start: usize, end: usize },
}

impl<R: Read> Records<R> {
    pub(crate) fn open(file: R) -> Result<Self, ReadError> {
        let mut file = BufReader::with_capacity(1 << 16, file);
        let mut magic = [0; MAGIC.len()];
        match file.read_exact(&mut magic) {
            Ok(()) if magic == MAGIC => {}
            Ok(()) => return Err(ReadError::NotMcap),
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                return Err(ReadError::NotMcap);
            }
            Err(error) => return Err(error.into()),
        }
        Ok(Self {
            file,
            at: MAGIC.len() as u64,
            record_at: 0,
            body: Vec::new(),
            chunk: Vec::new(),
            chunk_at: 0,
            zstd: zstd::bulk::Decompressor::new()?,
            is_over: false,
            condition: Condition::default(),
        })
    }

    /// The next record of the data; `None` at the end.
    pub(crate) fn next_record(&mut self) -> Result<Option<Record<'_>>, ReadError> {
        loop {
            let Some(found) = self.find()? else { return Ok(None) };
            // A borrow that is returned on one way only would last for the whole loop, so it is parsed twice.
            if let Err(what) = self.record(&found) {
                self.note(self.record_at, what);
                continue;
            }
            return Ok(self.record(&found).ok());
        }
    }

    fn record(&self, found: &Found) -> Result<Record<'_>, String> {
        match *found {
            Found::InFile { opcode } => parse(opcode, &self.body),
            Found::InChunk { opcode, start, end } => {
                parse(opcode, self.chunk.get(start..end).unwrap_or_default())
            }
        }
    }

    /// Takes note of damage that the record just read turns out to have.
    pub(crate) fn note_here(&mut self, what: &str) {
        self.note(self.record_at, what.to_owned());
    }

    pub(crate) fn condition(&self) -> &Condition {
        &self.condition
    }

    fn find(&mut self) -> Result<Option<Found>, ReadError> {
        loop {
            if let Some(found) = self.find_in_chunk() {
                return Ok(Some(found));
            }
            if self.is_over {
                return Ok(None);
            }
            let Some(opcode) = self.read_record()? else {
                self.is_over = true;
                return Ok(None);
            };
            match opcode {
                op::CHUNK => self.open_chunk()?,
                op::DATA_END => {
                    self.is_over = true;
                    self.read_to_footer()?;
                    return Ok(None);
                }
                op::FOOTER => {
                    self.is_over = true;
                    self.read_end()?;
                    return Ok(None);
                }
                opcode => return Ok(Some(Found::InFile { opcode })),
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
            self.note(self.record_at, "a chunk ends within a record".into());
            return None;
        };
        let start = self.chunk_at + RECORD_HEAD;
        self.chunk_at = start + length;
        Some(Found::InChunk { opcode, start, end: start + length })
    }

    /// Reads a record of the file into `body`; `None` where the file breaks off, or is so damaged that
    /// nothing is known of what follows.
    fn read_record(&mut self) -> Result<Option<u8>, ReadError> {
        self.record_at = self.at;
        let mut head = [0; RECORD_HEAD];
        if !self.fill(&mut head)? {
            return Ok(None);
        }
        let Some((opcode, length)) = record_head(&head) else { return Ok(None) };
        if length > MAX_RECORD_BYTES as u64 {
            let what = format!("a record of {length} bytes; what follows it is not read");
            self.note(self.record_at, what);
            return Ok(None);
        }
        self.body.clear();
        // What a length claims is believed as far as the file goes.
        while (self.body.len() as u64) < length {
            let step = (length - self.body.len() as u64).min(STEP_BYTES);
            let read = (&mut self.file).take(step).read_to_end(&mut self.body)?;
            self.at += read as u64;
            if read == 0 {
                return Ok(None);
            }
        }
        Ok(Some(opcode))
    }

    /// Passes over the summary.
    fn read_to_footer(&mut self) -> Result<(), ReadError> {
        while let Some(opcode) = self.read_record()? {
            if opcode == op::FOOTER {
                return self.read_end();
            }
        }
        Ok(())
    }

    fn read_end(&mut self) -> Result<(), ReadError> {
        let mut magic = [0; MAGIC.len()];
        self.condition.is_closed = self.fill(&mut magic)? && magic == MAGIC;
        Ok(())
    }

    fn open_chunk(&mut self) -> Result<(), ReadError> {
        self.chunk.clear();
        self.chunk_at = 0;
        match mcap::parse_record(op::CHUNK, &self.body) {
            Ok(Record::Chunk { header, data }) => {
                if let Err(what) = unpack(&mut self.zstd, &header, &data, &mut self.chunk)? {
                    self.chunk.clear();
                    self.note(self.record_at, what);
                }
            }
            _ => self.note(self.record_at, "a chunk without its header".into()),
        }
        Ok(())
    }

    /// `false` if the file ends before.
    fn fill(&mut self, to: &mut [u8]) -> Result<bool, ReadError> {
        match self.file.read_exact(to) {
            Ok(()) => {
                self.at += to.len() as u64;
                Ok(true)
            }
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    fn note(&mut self, at: u64, what: String) {
        self.condition.damaged += 1;
        self.condition.first_damage.get_or_insert(Damage { at, what });
    }
}

fn record_head(head: &[u8]) -> Option<(u8, u64)> {
    let (opcode, length) = head.split_first()?;
    Some((*opcode, u64::from_le_bytes(length.try_into().ok()?)))
}

/// Unpacks a chunk; the inner error says why it is damaged.
fn unpack(
    zstd: &mut zstd::bulk::Decompressor<'_>,
    header: &ChunkHeader,
    data: &[u8],
    chunk: &mut Vec<u8>,
) -> Result<Result<(), String>, ReadError> {
    let size = header.uncompressed_size;
    let size = match usize::try_from(size) {
        Ok(size) if size <= MAX_RECORD_BYTES => size,
        _ => return Ok(Err(format!("a chunk of {size} bytes"))),
    };
    match header.compression.as_str() {
        "" => chunk.extend_from_slice(data),
        "zstd" => {
            chunk.reserve(size);
            if let Err(error) = zstd.decompress_to_buffer(data, chunk) {
                return Ok(Err(format!("a chunk that cannot be decompressed: {error}")));
            }
        }
        name => return Err(ReadError::Compression { name: name.to_owned() }),
    }
    let crc = header.uncompressed_crc;
    if chunk.len() != size || crc != 0 && crc != crc32fast::hash(chunk) {
        return Ok(Err("a chunk whose checksum is wrong".into()));
    }
    Ok(Ok(()))
}

fn parse(opcode: u8, body: &[u8]) -> Result<Record<'_>, String> {
    if opcode == op::ATTACHMENT {
        if !attachment_fits(body) {
            return Err("an attachment that is cut off".into());
        }
        let crc = body.split_last_chunk().map(|(rest, crc)| (rest, u32::from_le_bytes(*crc)));
        if crc.is_some_and(|(rest, crc)| crc != 0 && crc != crc32fast::hash(rest)) {
            return Err("an attachment whose checksum is wrong".into());
        }
    }
    mcap::parse_record(opcode, body)
        .map_err(|_| format!("a record ({opcode:#04x}) that is malformed"))
}

/// Whether an attachment has all of its fields. The parser takes that for granted.
fn attachment_fits(body: &[u8]) -> bool {
    const TIMES: usize = 16;
    const SIZE_AND_CHECKSUM: usize = 8 + 4;
    let mut rest = body.get(TIMES..);
    for _ in 0..2 {
        rest = rest.and_then(|rest| {
            let (length, rest) = rest.split_first_chunk()?;
            rest.get(usize::try_from(u32::from_le_bytes(*length)).ok()?..)
        });
    }
    rest.is_some_and(|rest| rest.len() >= SIZE_AND_CHECKSUM)
}
