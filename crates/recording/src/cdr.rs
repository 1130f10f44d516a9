//! Messages in CDR, the encoding of ROS 2: a header of four bytes, then little-endian fields.

use isochrone_ipc::FrameHeader;

use crate::{Frame, Mark};

/// Plain CDR, little-endian.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// The definition of `isochrone/FrameHeader`. All fields take eight bytes, so nothing is padded.
pub(crate) const FRAME_HEADER: &str = "\
uint64 sequence
uint64 cycle
uint64 release_ns
uint64 publish_ns
uint64 source_ns
uint64 missed
uint64 flags
uint64 term
uint64 layout
uint64 received_ns
uint64 lost
float64 sent_after_release_s
";
/// Number of its fields.
const HEADER_FIELDS: usize = 12;

/// The definition of `isochrone/Mark`.
pub(crate) const MARK: &str = "\
uint64 time_ns
uint64 cycle
uint64 count
string kind
string service
string text
";

/// Appends a frame, its values in the order of the message.
pub(crate) fn write_frame(frame: &Frame<'_>, values: &[f64], to: &mut Vec<u8>) {
    let header = &frame.header;
    to.clear();
    to.extend_from_slice(&ENCAPSULATION);
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
        to.extend_from_slice(&field.to_le_bytes());
    }
    let sent_after_release_s = match header.release_ns {
        0 => f64::NAN,
        release_ns => header.publish_ns.wrapping_sub(release_ns).cast_signed() as f64 / 1e9,
    };
    for value in [sent_after_release_s].iter().chain(values) {
        to.extend_from_slice(&value.to_le_bytes());
    }
}

/// A frame in its message.
pub(crate) struct FrameWords<'a> {
    pub(crate) head: FrameHead,
    values: &'a [u8],
}

/// What stands before the values.
pub(crate) struct FrameHead {
    pub(crate) header: FrameHeader,
    pub(crate) received_ns: u64,
    pub(crate) lost: u64,
}

impl FrameWords<'_> {
    /// The value at a place of the message; NaN beyond its end.
    pub(crate) fn value(&self, place: usize) -> f64 {
        word(self.values, place).map_or(f64::NAN, f64::from_bits)
    }
}

/// Reads a frame of so many values; `None` if it is none.
pub(crate) fn read_frame(data: &[u8], channels: usize) -> Option<FrameWords<'_>> {
    let body = data.strip_prefix(&ENCAPSULATION)?;
    let (header, values) = body.split_at_checked(8 * HEADER_FIELDS)?;
    if values.len() != 8 * channels {
        return None;
    }
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
    Some(FrameWords { head, values })
}

fn word(words: &[u8], index: usize) -> Option<u64> {
    let bytes = words.get(8 * index..8 * index + 8)?;
    Some(u64::from_le_bytes(bytes.try_into().ok()?))
}

/// Writes a mark.
pub(crate) fn write_mark(mark: &Mark) -> Vec<u8> {
    let mut to = ENCAPSULATION.to_vec();
    for field in [mark.time_ns, mark.cycle, mark.count] {
        to.extend_from_slice(&field.to_le_bytes());
    }
    for text in [&mark.kind, &mark.service, &mark.text] {
        // Where strings begin is counted from behind the four bytes, which are as many as they align to.
        to.resize(to.len().next_multiple_of(4), 0);
        let length = u32::try_from(text.len() + 1).unwrap_or(u32::MAX);
        to.extend_from_slice(&length.to_le_bytes());
        to.extend_from_slice(text.as_bytes());
        to.push(0);
    }
    to
}

/// Reads a mark; `None` if it is none.
pub(crate) fn read_mark(data: &[u8]) -> Option<Mark> {
    let body = data.strip_prefix(&ENCAPSULATION)?;
    let field = |index| word(body, index);
    let mut at = 24_usize;
    let mut text = || {
        at = at.next_multiple_of(4);
        let length = u32::from_le_bytes(body.get(at..at + 4)?.try_into().ok()?) as usize;
        let bytes = body.get(at + 4..(at + 4).checked_add(length)?)?;
        at += 4 + length;
        let (zero, text) = bytes.split_last()?;
        (*zero == 0).then(|| String::from_utf8(text.to_vec()).ok())?
    };
    Some(Mark {
        time_ns: field(0)?,
        cycle: field(1)?,
        count: field(2)?,
        kind: text()?,
        service: text()?,
        text: text()?,
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
        fn bytes_that_are_no_message_are_none(data in prop::collection::vec(any::<u8>(), 0..200)) {
            let with_header = [&ENCAPSULATION[..], &data].concat();
            for data in [&data, &with_header] {
                let mark = read_mark(data);
                prop_assert!(mark.is_none_or(|mark| write_mark(&mark).len() <= data.len()));
                let channels = data.len() / 8;
                prop_assert!(read_frame(data, channels).is_none());
            }
        }
    }
}
