//! A value written into an image.

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
    /// In the place of the slot of a force that was released before its cycle: stands for none.
    pub(crate) const RELEASED: u32 = u32::MAX;

    /// A value that is not written yet.
    pub fn new(slot: usize, value: f64) -> Self {
        Self { slot: slot as u32, value, before: value }
    }

    /// Whether it is of a force that was released before its cycle, and was not written.
    pub fn is_released(&self) -> bool {
        self.slot == Self::RELEASED
    }
}
