//! Single records.

use mcap::records::{Record, op};

/// The largest record, and the largest chunk before it is compressed, that a reader takes: 64 MiB. What is
/// larger counts as damaged.
pub const MAX_RECORD_BYTES: usize = 64 << 20;
/// The first byte of a record, and its length.
pub(crate) const RECORD_HEAD: usize = 9;

/// The opcode and the length at the beginning of a record.
pub(crate) fn record_head(head: &[u8]) -> Option<(u8, u64)> {
    let (opcode, length) = head.split_first()?;
    Some((*opcode, u64::from_le_bytes(*length.first_chunk()?)))
}

/// Reads what is behind the head of a record; says why it is damaged.
pub(crate) fn parse(opcode: u8, body: &[u8]) -> Result<Record<'_>, String> {
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
