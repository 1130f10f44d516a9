//! Messages of any length as frames: each carries a part, in words of eight bytes.

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{FramePublisher, Service, Stamp};

/// Words of a frame: the number of the message, the index of the part, the bytes of the whole, and the part.
pub(super) const WORDS: usize = WORDS_BEFORE + PART_WORDS;
const WORDS_BEFORE: usize = 3;
const PART_WORDS: usize = 16_384;
const PART_BYTES: usize = PART_WORDS * size_of::<f64>();
/// As many parts as wait for a reader.
const MOST_PARTS: usize = 8;

/// Sends a message; one that is too long is not sent, with a warning.
pub(super) fn send<S: Service>(publisher: &mut FramePublisher<S>, bytes: &[u8]) {
    let parts = bytes.len().div_ceil(PART_BYTES).max(1);
    if parts > MOST_PARTS {
        tracing::warn!("{} bytes of set values and forces are too many for a standby", bytes.len());
        return;
    }
    let number = publisher.next_sequence();
    for part in 0..parts {
        publisher.prepare();
        if let Some(words) = publisher.values_mut() {
            fill(words, number, part, bytes);
            publisher.send(Stamp::default(), || Monotonic.now_ns());
        }
    }
}

/// Writes a part of a message into a frame.
fn fill(words: &mut [f64], number: u64, part: usize, bytes: &[u8]) {
    let before = [number, part as u64, bytes.len() as u64];
    let own = bytes.get(part * PART_BYTES..).unwrap_or_default();
    let own = own.get(..PART_BYTES.min(own.len())).unwrap_or_default();
    let own = own.chunks(size_of::<f64>()).map(|chunk| {
        let mut word = [0; size_of::<f64>()];
        word.iter_mut().zip(chunk).for_each(|(to, from)| *to = *from);
        u64::from_le_bytes(word)
    });
    let all = before.into_iter().chain(own);
    words.iter_mut().zip(all).for_each(|(to, from)| *to = f64::from_bits(from));
}

/// A message of which parts have come.
#[derive(Debug, Default)]
pub(super) struct Incoming {
    number: u64,
    bytes: Vec<u8>,
    parts: usize,
}

impl Incoming {
    /// Takes the next part; the message if it is whole now. A message with a part that is missing is dropped.
    pub(super) fn take(&mut self, words: &[f64]) -> Option<Vec<u8>> {
        let (before, words) = words.split_first_chunk::<WORDS_BEFORE>()?;
        let [number, part, length] = before.map(f64::to_bits);
        let (part, length) = (usize::try_from(part).ok()?, usize::try_from(length).ok()?);
        if part == 0 {
            *self = Self { number, bytes: Vec::new(), parts: 0 };
        }
        if number != self.number || part != self.parts || length > MOST_PARTS * PART_BYTES {
            // The parts that follow find no beginning.
            self.parts = usize::MAX;
            return None;
        }
        self.bytes.extend(words.iter().flat_map(|word| word.to_bits().to_le_bytes()));
        self.parts += 1;
        if self.bytes.len() < length {
            return None;
        }
        self.bytes.truncate(length);
        self.parts = usize::MAX;
        Some(std::mem::take(&mut self.bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(number: u64, bytes: &[u8]) -> Vec<Vec<f64>> {
        let part = |part| {
            let mut words = vec![0.0; WORDS];
            fill(&mut words, number, part, bytes);
            words
        };
        (0..bytes.len().div_ceil(PART_BYTES).max(1)).map(part).collect()
    }

    fn taken(incoming: &mut Incoming, parts: &[Vec<f64>]) -> Option<Vec<u8>> {
        parts.iter().filter_map(|part| incoming.take(part)).next()
    }

    #[test]
    fn a_message_of_any_length_arrives_to_the_byte() {
        let mut incoming = Incoming::default();
        for length in [0, 1, 8, 9, PART_BYTES - 1, PART_BYTES, PART_BYTES + 1, 3 * PART_BYTES + 5] {
            let bytes: Vec<u8> = (0..length).map(|at| (at * 31 % 251) as u8).collect();
            assert_eq!(taken(&mut incoming, &parts(length as u64, &bytes)), Some(bytes));
        }
    }

    #[test]
    fn a_message_without_one_of_its_parts_is_dropped_and_the_next_one_arrives() {
        let bytes = vec![7; 3 * PART_BYTES];
        for missing in 0..3 {
            let mut incoming = Incoming::default();
            let mut some = parts(1, &bytes);
            some.remove(missing);
            assert_eq!(taken(&mut incoming, &some), None);
            assert_eq!(taken(&mut incoming, &parts(2, b"next")), Some(b"next".to_vec()));
        }
    }

    #[test]
    fn parts_of_two_messages_make_none() {
        let (one, other) = (parts(1, &vec![1; 2 * PART_BYTES]), parts(2, &vec![2; 2 * PART_BYTES]));
        let mixed = [one[0].clone(), other[1].clone()];
        assert_eq!(taken(&mut Incoming::default(), &mixed), None);
    }
}
