//! The message that travels: a header, and values that are written and read one by one.

/// The sequence of the message that ends a turn; its `sent_ns` says how many were sent before.
pub(super) const END: u64 = u64::MAX;

/// What a message begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Header {
    /// Counts the messages, over all turns.
    pub(super) sequence: u64,
    /// When it was sent, `CLOCK_MONOTONIC` nanoseconds: read just before the values are written.
    pub(super) sent_ns: u64,
}

/// A message that was received and read to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Message {
    pub(super) header: Header,
    /// Of all its values.
    pub(super) sum: f64,
}

impl Header {
    pub(super) const WORDS: usize = 2;

    /// What every value of the message is. Small enough for sums to be exact.
    pub(super) fn value(&self) -> f64 {
        (self.sequence & 0xf_ffff) as f64
    }
}

impl Message {
    /// A message whose values one has before oneself.
    pub(super) fn read(header: Header, values: &[f64]) -> Self {
        Self { header, sum: sum(values, |value| *value) }
    }

    /// Whether the values are those that were sent.
    pub(super) fn is_whole(&self, values: usize) -> bool {
        self.sum == self.expected_sum(values)
    }

    pub(super) fn expected_sum(&self, values: usize) -> f64 {
        self.header.value() * values as f64
    }
}

/// The sum of values that are read from something; in eight lanes, so that the reading counts and
/// not the wait of one addition for the other.
pub(super) fn sum<T>(values: &[T], read: impl Fn(&T) -> f64) -> f64 {
    let (rows, rest) = values.as_chunks::<8>();
    let mut lanes = [0.0; 8];
    for row in rows {
        lanes.iter_mut().zip(row).for_each(|(lane, value)| *lane += read(value));
    }
    lanes.iter().sum::<f64>() + rest.iter().map(read).sum::<f64>()
}

/// How many bytes a message of so many values is.
pub(super) const fn bytes(values: usize) -> usize {
    (Header::WORDS + values) * size_of::<f64>()
}

/// Writes a message into bytes.
pub(super) fn encode(header: Header, bytes: &mut [u8]) {
    if let ([sequence, sent_ns, values @ ..], _) = bytes.as_chunks_mut::<8>() {
        *sequence = header.sequence.to_ne_bytes();
        *sent_ns = header.sent_ns.to_ne_bytes();
        values.fill(header.value().to_ne_bytes());
    }
}

/// Reads a message from bytes; `None` if they are too few for a header.
pub(super) fn decode(bytes: &[u8]) -> Option<Message> {
    let ([sequence, sent_ns, values @ ..], _) = bytes.as_chunks::<8>() else { return None };
    Some(Message {
        header: Header {
            sequence: u64::from_ne_bytes(*sequence),
            sent_ns: u64::from_ne_bytes(*sent_ns),
        },
        sum: sum(values, |value| f64::from_ne_bytes(*value)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_reads_back_with_the_sum_of_its_values() {
        for values in [1, 7, 8, 9, 4096] {
            let header = Header { sequence: (7 << 32) + 1_234_567, sent_ns: 42 };
            let mut sent = vec![0; bytes(values)];
            encode(header, &mut sent);
            let message = decode(&sent).unwrap();
            assert_eq!(message.header, header);
            assert!(message.is_whole(values), "{values} values: {message:?}");
        }
    }

    #[test]
    fn a_message_with_a_value_of_another_is_damaged() {
        let mut sent = vec![0; bytes(64)];
        encode(Header { sequence: 5, sent_ns: 42 }, &mut sent);
        sent[bytes(40)..bytes(41)].copy_from_slice(&6.0f64.to_ne_bytes());
        assert!(!decode(&sent).unwrap().is_whole(64));
    }

    #[test]
    fn the_sum_takes_every_value_once() {
        let values: Vec<f64> = (0..21).map(f64::from).collect();
        assert_eq!(sum(&values, |value| *value), 210.0);
        assert_eq!(sum(&[] as &[f64], |value| *value), 0.0);
    }

    #[test]
    fn too_few_bytes_are_no_message() {
        assert_eq!(decode(&[0; 15]), None);
    }
}
