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
    if !is_all_there(opcode, body) {
        return Err(match opcode {
            op::ATTACHMENT => "an attachment that is cut off".into(),
            _ => malformed(opcode),
        });
    }
    if opcode == op::ATTACHMENT {
        let crc = body.split_last_chunk().map(|(rest, crc)| (rest, u32::from_le_bytes(*crc)));
        if crc.is_some_and(|(rest, crc)| crc != 0 && crc != crc32fast::hash(rest)) {
            return Err("an attachment whose checksum is wrong".into());
        }
    }
    mcap::parse_record(opcode, body).map_err(|_| malformed(opcode))
}

fn malformed(opcode: u8) -> String {
    format!("a record ({opcode:#04x}) that is malformed")
}

/// A part of a record.
enum Part {
    /// So many bytes.
    Bytes(usize),
    /// A length, and so many bytes.
    Text,
    /// A length, and keys and values that take so many bytes.
    Texts,
}

/// What stands in a record up to its last text.
const fn parts(opcode: u8) -> &'static [Part] {
    use Part::{Bytes, Text, Texts};
    match opcode {
        op::HEADER => &[Text, Text],
        op::SCHEMA => &[Bytes(2), Text, Text],
        op::CHANNEL => &[Bytes(4), Text, Text, Texts],
        op::CHUNK => &[Bytes(28), Text],
        // The offsets of its messages have a length, too.
        op::CHUNK_INDEX => &[Bytes(32), Text, Bytes(8), Text],
        // Behind its texts, at least the size of its content and a checksum.
        op::ATTACHMENT => &[Bytes(16), Text, Text, Bytes(8 + 4)],
        op::ATTACHMENT_INDEX => &[Bytes(40), Text, Text],
        op::METADATA => &[Text, Texts],
        op::METADATA_INDEX => &[Bytes(16), Text],
        _ => &[],
    }
}

/// Whether a record has all of its texts. The parser takes that for granted: it sets as much memory aside as a text
/// claims, and ends the program where the end of an attachment is missing.
fn is_all_there(opcode: u8, body: &[u8]) -> bool {
    parts(opcode).iter().try_fold(body, behind).is_some()
}

/// What stands behind a part, if that is there.
fn behind<'a>(bytes: &'a [u8], part: &Part) -> Option<&'a [u8]> {
    match part {
        Part::Bytes(count) => bytes.get(*count..),
        Part::Text => behind_text(bytes),
        Part::Texts => {
            let (_, mut texts) = bytes.split_first_chunk::<4>()?;
            let end = behind_text(bytes)?.len();
            while texts.len() > end {
                // The parser reads a value behind each key, wherever the key ends.
                texts = behind_text(behind_text(texts)?)?;
            }
            Some(texts)
        }
    }
}

/// What stands behind a text, if that is there.
fn behind_text(bytes: &[u8]) -> Option<&[u8]> {
    let (length, rest) = bytes.split_first_chunk()?;
    rest.get(usize::try_from(u32::from_le_bytes(*length)).ok()?..)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_its_record_does_not_hold_is_found_before_memory_is_set_aside_for_it() {
        let is_text = |part: &&Part| !matches!(part, Part::Bytes(_));
        for opcode in 0..=u8::MAX {
            for texts in 0..parts(opcode).iter().filter(is_text).count() {
                let (mut body, mut left) = (Vec::new(), texts);
                for part in parts(opcode) {
                    match part {
                        Part::Bytes(count) => body.extend(vec![0; *count]),
                        Part::Text | Part::Texts if left == 0 => {
                            body.extend(u32::MAX.to_le_bytes());
                            break;
                        }
                        Part::Text | Part::Texts => {
                            body.extend([0; 4]);
                            left -= 1;
                        }
                    }
                }
                body.extend([0; 100]);
                assert!(!is_all_there(opcode, &body), "text {texts} of {opcode:#04x}");
            }
        }
        // A value within the metadata of a channel, and behind them.
        for bytes in [9_u32, 5] {
            let texts =
                [&bytes.to_le_bytes()[..], b"\x01\0\0\0k", &u32::MAX.to_le_bytes()].concat();
            assert!(!is_all_there(op::CHANNEL, &[&[0; 12][..], &texts, &[0; 100]].concat()));
        }
    }
}
