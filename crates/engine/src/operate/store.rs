//! What is written into an image.

/// A value for a slot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Store {
    pub(crate) slot: u32,
    pub(crate) value: f64,
    /// What was there, once it is written.
    pub(crate) before: f64,
}

impl Store {
    pub(super) fn new(slot: usize, value: f64) -> Self {
        Self { slot: slot as u32, value, before: value }
    }
}
