//! The messages of a recording, encoded: a header of four bytes, then little-endian fields.

use isochrone_ipc::FrameHeader;

use crate::cdr::{CdrReader, CdrWriter};
use crate::definitions::{FRAME_FIELDS, TASK_FIELDS};
use crate::{Frame, Mark, RecordedEntry, RowHead};

/// Appends a frame, its values in the order of the message.
pub(crate) fn write_frame(frame: &Frame<'_>, values: &[f64], to: &mut Vec<u8>) {
    let header = &frame.header;
    let mut to = CdrWriter::message(to);
    for field in [
        header.sequence,
        header.cycle,
        header.release_ns,
        header.publish_ns,
        header.source_ns,
        header.missed,
        header.flags,
        header.term,
        header.layout,
        frame.received_ns,
        frame.lost,
    ] {
        to.u64(field);
    }
    let sent_after_release_s = match header.release_ns {
        0 => f64::NAN,
        release_ns => header.publish_ns.wrapping_sub(release_ns).cast_signed() as f64 / 1e9,
    };
    for value in [sent_after_release_s].iter().chain(values) {
        to.f64(*value);
    }
}

/// Appends a row, its values in the order of the message.
pub(crate) fn write_row(head: &RowHead, values: &[f64], to: &mut Vec<u8>) {
    let RowHead { cycle, release_ns, start_ns, end_ns, missed, lost } = *head;
    let mut to = CdrWriter::message(to);
    for field in [cycle, release_ns, start_ns, end_ns, missed, lost] {
        to.u64(field);
    }
    for value in values {
        to.f64(*value);
    }
}

/// The values of a message.
pub(crate) struct Values<'a>(&'a [u8]);

/// The fields before the values of a frame.
pub(crate) struct FrameHead {
    pub(crate) header: FrameHeader,
    pub(crate) received_ns: u64,
    pub(crate) lost: u64,
}

impl Values<'_> {
    /// The value at a place of the message; NaN beyond its end.
    pub(crate) fn at(&self, place: usize) -> f64 {
        word(self.0, place).map_or(f64::NAN, f64::from_bits)
    }
}

/// What a message of so many fields and values has; `None` if it is none.
fn split(data: &[u8], fields: usize, values: usize) -> Option<(&[u8], Values<'_>)> {
    let body = CdrReader::message(data)?.rest();
    let (head, rest) = body.split_at_checked(8 * fields)?;
    (rest.len() == 8 * values).then_some((head, Values(rest)))
}

/// Reads a frame of this many values; `None` if it is not one.
pub(crate) fn read_frame(data: &[u8], values: usize) -> Option<(FrameHead, Values<'_>)> {
    let (header, values) = split(data, FRAME_FIELDS, values)?;
    let field = |index| word(header, index);
    let head = FrameHead {
        header: FrameHeader {
            sequence: field(0)?,
            cycle: field(1)?,
            release_ns: field(2)?,
            publish_ns: field(3)?,
            source_ns: field(4)?,
            missed: field(5)?,
            flags: field(6)?,
            term: field(7)?,
            layout: field(8)?,
        },
        received_ns: field(9)?,
        lost: field(10)?,
    };
    Some((head, values))
}

/// Reads a row of this many values; `None` if it is not one.
pub(crate) fn read_row(data: &[u8], values: usize) -> Option<(RowHead, Values<'_>)> {
    let (head, values) = split(data, TASK_FIELDS, values)?;
    let field = |index| word(head, index);
    let head = RowHead {
        cycle: field(0)?,
        release_ns: field(1)?,
        start_ns: field(2)?,
        end_ns: field(3)?,
        missed: field(4)?,
        lost: field(5)?,
    };
    Some((head, values))
}

fn word(words: &[u8], index: usize) -> Option<u64> {
    let bytes = words.get(8 * index..8 * index + 8)?;
    Some(u64::from_le_bytes(bytes.try_into().ok()?))
}

/// Writes a mark.
pub(crate) fn write_mark(mark: &Mark) -> Vec<u8> {
    write_texts(&[mark.time_ns, mark.cycle, mark.count], &[&mark.kind, &mark.service, &mark.text])
}

/// Reads a mark; `None` if it is not one.
pub(crate) fn read_mark(data: &[u8]) -> Option<Mark> {
    let ([time_ns, cycle, count], [kind, service, text]) = read_texts(data)?;
    Some(Mark { time_ns, cycle, count, kind, service, text })
}

/// Writes an entry of a journal.
pub(crate) fn write_entry(entry: &RecordedEntry) -> Vec<u8> {
    write_texts(&[entry.time_ns, entry.cycle], &[&entry.task, &entry.line])
}

/// Reads an entry of a journal; `None` if it is not one.
pub(crate) fn read_entry(data: &[u8]) -> Option<RecordedEntry> {
    let ([time_ns, cycle], [task, line]) = read_texts(data)?;
    Some(RecordedEntry { time_ns, cycle, task, line })
}

/// Writes a message of numbers and texts.
fn write_texts(fields: &[u64], texts: &[&String]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut to = CdrWriter::message(&mut bytes);
    for field in fields {
        to.u64(*field);
    }
    for text in texts {
        to.text(text);
    }
    bytes
}

/// Reads a message of numbers and texts; `None` if it is not one.
fn read_texts<const N: usize, const T: usize>(data: &[u8]) -> Option<([u64; N], [String; T])> {
    let mut reader = CdrReader::message(data)?;
    let mut fields = [0; N];
    for field in &mut fields {
        *field = reader.u64().ok()?;
    }
    let mut texts = [const { String::new() }; T];
    for text in &mut texts {
        *text = reader.text().ok()?.to_owned();
    }
    Some((fields, texts))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::cdr::ENCAPSULATION;

    proptest! {
        #[test]
        fn a_mark_reads_back_as_it_was(
            (time_ns, cycle, count) in any::<(u64, u64, u64)>(),
            (kind, service, text) in any::<(String, String, String)>(),
        ) {
            let mark = Mark { time_ns, cycle, count, kind, service, text };
            prop_assert_eq!(read_mark(&write_mark(&mark)), Some(mark));
        }

        #[test]
        fn an_entry_of_a_journal_reads_back_as_it_was(
            (time_ns, cycle) in any::<(u64, u64)>(), (task, line) in any::<(String, String)>(),
        ) {
            let entry = RecordedEntry { time_ns, cycle, task, line };
            prop_assert_eq!(read_entry(&write_entry(&entry)), Some(entry));
        }

        #[test]
        fn bytes_that_are_no_message_are_none(data in prop::collection::vec(any::<u8>(), 0..200)) {
            let with_header = [&ENCAPSULATION[..], &data].concat();
            for data in [&data, &with_header] {
                let mark = read_mark(data);
                let texts = |mark: Mark| mark.kind.len() + mark.service.len() + mark.text.len();
                prop_assert!(mark.is_none_or(|mark| texts(mark) <= data.len()));
                let channels = data.len() / 8;
                prop_assert!(read_frame(data, channels).is_none());
            }
        }
    }
}
