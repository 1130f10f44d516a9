//! The index at the end of a closed file.

use std::io::{self, BufReader, Read, Seek, SeekFrom};

use mcap::MAGIC;
use mcap::records::{Record, op};

use crate::MAX_RECORD_BYTES;
use crate::record::{RECORD_HEAD, parse, record_head};

/// What an end of the data takes, with its head.
const DATA_END_BYTES: usize = RECORD_HEAD + 4;
/// What a footer has.
pub(crate) const FOOTER_BYTES: usize = 20;
/// Of these, what its checksum is of.
pub(crate) const FOOTER_CHECKED_BYTES: usize = 16;
/// What stands behind the summary.
const END_BYTES: usize = RECORD_HEAD + FOOTER_BYTES + MAGIC.len();

/// What the end of a file says, if its checksum is right; nothing else of it was read then.
#[derive(Default)]
pub(crate) struct Index {
    /// Schemas and channels again, as they stand there.
    pub(crate) described: Vec<u8>,
    /// Where they stand.
    pub(crate) at: u64,
    /// Where chunks, attachments, metadata and the end of the data begin, the last one first.
    starts: Vec<u64>,
}

impl Index {
    /// Reads it, and goes back to the beginning of the file. It has nothing if the file was not closed, its end is
    /// damaged, or one cannot go back in it.
    ///
    /// # Errors
    /// The system refuses to go back.
    pub(crate) fn read(file: &mut (impl Read + Seek)) -> io::Result<Self> {
        let Ok(length) = file.seek(SeekFrom::End(0)) else { return Ok(Self::default()) };
        // A part that cannot be read at the end may be readable earlier in the file.
        let index = Self::at_end_of(file, length).ok().flatten();
        file.seek(SeekFrom::Start(0))?;
        Ok(index.unwrap_or_default())
    }

    /// Where the next of the parts begins behind a place that was read.
    pub(crate) fn next_after(&mut self, at: u64) -> Option<u64> {
        while self.starts.pop_if(|start| *start <= at).is_some() {}
        self.starts.last().copied()
    }

    fn at_end_of(file: &mut (impl Read + Seek), length: u64) -> io::Result<Option<Self>> {
        let Some(footer_at) = length.checked_sub(END_BYTES as u64) else { return Ok(None) };
        file.seek(SeekFrom::Start(footer_at))?;
        let mut end = [0; END_BYTES];
        file.read_exact(&mut end)?;
        let Some((checked, footer)) = footer(&end) else { return Ok(None) };
        let begin = footer.summary_start.checked_sub(DATA_END_BYTES as u64);
        let rest = footer_at.checked_sub(footer.summary_start);
        let (Some(begin), Some(mut rest)) = (begin, rest) else { return Ok(None) };

        file.seek(SeekFrom::Start(begin))?;
        let mut file = BufReader::new(file);
        let mut data_end = [0; DATA_END_BYTES];
        file.read_exact(&mut data_end)?;
        if record_head(&data_end) != Some((op::DATA_END, 4)) {
            return Ok(None);
        }
        let mut index = Self { at: footer.summary_start, starts: vec![begin], ..Self::default() };
        let mut crc = crc32fast::Hasher::new();
        let mut body = Vec::new();
        while let Some(behind_head) = rest.checked_sub(RECORD_HEAD as u64) {
            let mut head = [0; RECORD_HEAD];
            file.read_exact(&mut head)?;
            let Some((opcode, length)) = record_head(&head) else { return Ok(None) };
            if length > behind_head.min(MAX_RECORD_BYTES as u64) {
                return Ok(None);
            }
            rest = behind_head - length;
            body.clear();
            (&mut file).take(length).read_to_end(&mut body)?;
            crc.update(&head);
            crc.update(&body);
            if matches!(opcode, op::SCHEMA | op::CHANNEL) {
                index.described.extend_from_slice(&head);
                index.described.extend_from_slice(&body);
            }
            if index.described.len() > MAX_RECORD_BYTES {
                return Ok(None);
            }
            if matches!(opcode, op::CHUNK_INDEX | op::ATTACHMENT_INDEX | op::METADATA_INDEX) {
                index.starts.extend(match parse(opcode, &body) {
                    Ok(Record::ChunkIndex(of)) => Some(of.chunk_start_offset),
                    Ok(Record::AttachmentIndex(of)) => Some(of.offset),
                    Ok(Record::MetadataIndex(of)) => Some(of.offset),
                    _ => None,
                });
            }
        }
        crc.update(checked);
        index.starts.sort_unstable_by(|one, other| other.cmp(one));
        Ok((rest == 0 && crc.finalize() == footer.summary_crc).then_some(index))
    }
}

/// The footer at the end of a file, and what its checksum is of.
fn footer(end: &[u8]) -> Option<(&[u8], mcap::records::Footer)> {
    let record = end.strip_suffix(MAGIC)?;
    let (head, body) = record.split_at_checked(RECORD_HEAD)?;
    if record_head(head)? != (op::FOOTER, FOOTER_BYTES as u64) {
        return None;
    }
    let Ok(Record::Footer(footer)) = parse(op::FOOTER, body) else { return None };
    Some((record.get(..RECORD_HEAD + FOOTER_CHECKED_BYTES)?, footer))
}
