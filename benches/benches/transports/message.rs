//! What travels: sequence, time of sending, and values.

use isochrone_benches::Failure;

/// The sequence of the message that ends a turn; its time says how many were sent before.
pub(crate) const END: u64 = u64::MAX;
/// Sequence and time of sending.
const HEAD: usize = 2;

/// One end of a connection that carries messages of one size, as words, both ways.
pub(crate) trait Wire {
    /// Sends a message.
    fn send(&mut self, words: &[u64]) -> Result<(), Failure>;
    /// Waits for the next message, and reads it into `words`.
    fn receive(&mut self, words: &mut [u64]) -> Result<(), Failure>;
}

/// Room for a message of so many values.
pub(crate) fn room(values: usize) -> Vec<u64> {
    vec![0; HEAD + values]
}

/// Writes a message; all of its values are the same.
pub(crate) fn write(words: &mut [u64], sequence: u64, sent_ns: u64) {
    if let [first, second, values @ ..] = words {
        (*first, *second) = (sequence, sent_ns);
        values.fill(value(sequence).to_bits());
    }
}

/// Sequence and time of a message whose values add up to what was sent.
pub(crate) fn read(words: &[u64]) -> Result<(u64, u64), Failure> {
    let [sequence, sent_ns, values @ ..] = words else {
        return Err("a message is too short".into());
    };
    let sum: f64 = values.iter().map(|bits| f64::from_bits(*bits)).sum();
    if sum == value(*sequence) * values.len() as f64 {
        Ok((*sequence, *sent_ns))
    } else {
        Err(format!("message {sequence} is damaged").into())
    }
}

/// Small enough for sums to be exact.
fn value(sequence: u64) -> f64 {
    (sequence & 0xf_ffff) as f64
}

/// The words of a message that came as bytes.
#[cfg(any(feature = "zeromq", feature = "zenoh"))]
pub(crate) fn from_bytes(bytes: &[u8], words: &mut [u64]) -> Result<(), Failure> {
    let (chunks, rest) = bytes.as_chunks::<8>();
    if chunks.len() != words.len() || !rest.is_empty() {
        return Err(format!("a message of {} bytes came", bytes.len()).into());
    }
    words.iter_mut().zip(chunks).for_each(|(word, bytes)| *word = u64::from_ne_bytes(*bytes));
    Ok(())
}

/// A message as bytes.
#[cfg(any(feature = "zeromq", feature = "zenoh"))]
pub(crate) fn to_bytes(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_ne_bytes()).collect()
}
