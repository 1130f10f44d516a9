//! What isochrone must keep to, whatever it reads.
//!
//! A [`Target`] is a reader of bytes that others wrote: a file, a message, a frame. It fails, by a panic, if the program
//! does, and if a rule is broken: what is accepted reads back as it was written, and a refusal is a sentence. Two
//! programs call targets: the test of this crate with each file of `corpus/`, and `libfuzzer/` with what it
//! invents.

mod base;
mod targets;

/// A reader of bytes that others wrote.
#[derive(Debug)]
pub struct Target {
    /// Its name, and that of its folder in `corpus/`.
    pub name: &'static str,
    /// The longest input worth trying, in bytes.
    pub max_bytes: usize,
    /// The most memory that one input of that length may take at a time, in MiB.
    pub max_mib: usize,
    /// Reads the bytes; panics if a rule is broken.
    pub read: fn(&[u8]),
}

/// All of them.
pub const TARGETS: &[Target] = &[
    targets::configuration::TARGET,
    targets::csv::TARGET,
    targets::expressions::TARGET,
    targets::frames::TARGET,
    targets::messages::TARGET,
    targets::recordings::TARGET,
    targets::reports::TARGET,
    targets::requests::TARGET,
    targets::states::TARGET,
];

/// Fails unless a text says something, and does nothing to a terminal.
#[track_caller]
fn assert_sentence(text: &str) {
    assert!(!text.trim().is_empty(), "a refusal says nothing");
    let control = text.find(|c: char| c.is_control() && c != '\n');
    assert_eq!(control, None, "a control character in {text:?}");
}
