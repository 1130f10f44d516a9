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

/// Whether the fields of a record, of which `body` is the beginning, contradict the length in its head.
pub(crate) fn contradicts(opcode: u8, length: u64, body: &[u8]) -> bool {
    match claimed_length(opcode, body) {
        Some(claimed) => claimed != length,
        // The fields end behind it.
        None => {
            let has_fields = matches!(
                opcode,
                op::HEADER | op::CHUNK | op::MESSAGE_INDEX | op::ATTACHMENT | op::METADATA
            );
            has_fields && body.len() as u64 == length
        }
    }
}

/// How long a record is by its fields, from what stands behind its head; `None` where they do not say, or end behind
/// what there is.
pub(crate) fn claimed_length(opcode: u8, body: &[u8]) -> Option<u64> {
    let u32_at = |at: usize| Some(u32::from_le_bytes(*body.get(at..)?.first_chunk()?) as usize);
    let u64_at = |at: usize| Some(u64::from_le_bytes(*body.get(at..)?.first_chunk()?));
    match opcode {
        op::HEADER => {
            let library = 4 + u32_at(0)?;
            Some((library + 4 + u32_at(library)?) as u64)
        }
        op::CHUNK => {
            const COMPRESSION: usize = 28;
            let size = COMPRESSION + 4 + u32_at(COMPRESSION)?;
            u64_at(size)?.checked_add(size as u64 + 8)
        }
        op::MESSAGE_INDEX => Some(6 + u32_at(2)? as u64),
        op::ATTACHMENT => {
            const NAME: usize = 16;
            const CHECKSUM: u64 = 4;
            let media_type = NAME + 4 + u32_at(NAME)?;
            let size = media_type + 4 + u32_at(media_type)?;
            u64_at(size)?.checked_add(size as u64 + 8 + CHECKSUM)
        }
        op::METADATA => {
            let entries = 4 + u32_at(0)?;
            Some((entries + 4 + u32_at(entries)?) as u64)
        }
        _ => None,
    }
}
