//! What is written into an image.

/// A value for a slot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Store {
    /// The slot.
    pub slot: u32,
    /// The value.
    pub value: f64,
    /// What was there, once the value is written.
    pub before: f64,
}

impl Store {
    /// A value that is not written yet.
    pub fn new(slot: usize, value: f64) -> Self {
        Self { slot: slot as u32, value, before: value }
    }
}
