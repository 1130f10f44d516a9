//! How an instance says that something is wrong.

use crate::{Pin, PinType, status};

/// The output by which an instance says that something is wrong, with its place: among the slots of
/// the instance, or among the outputs that it was [looked for](Self::among) in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Indication {
    /// `status`, a status word: an error from `16#8000` on.
    Status(usize),
    /// `error` of a block without `status`: TRUE is an error.
    Error(usize),
}

impl Indication {
    /// Looks for it among outputs; `None` if they say nothing of errors.
    pub const fn among(outputs: &[Pin]) -> Option<Self> {
        let mut found = None;
        let mut place = 0;
        while place < outputs.len() {
            let Pin { name, pin_type, .. } = outputs[place];
            if status::is_status(name) && matches!(pin_type, PinType::Word) {
                return Some(Self::Status(place));
            }
            if matches!((name.as_bytes(), pin_type), (b"error", PinType::Bool)) {
                found = Some(Self::Error(place));
            }
            place += 1;
        }
        found
    }

    /// Its place.
    #[inline]
    pub const fn place(self) -> usize {
        match self {
            Self::Status(place) | Self::Error(place) => place,
        }
    }

    /// Whether a value of the pin is an error.
    #[inline]
    pub fn is_error(self, value: f64) -> bool {
        match self {
            Self::Status(_) => value >= f64::from(status::FIRST_ERROR),
            Self::Error(_) => value != 0.0,
        }
    }

    /// The status word that a value of the pin is; `None` for a pin that shows no more than whether
    /// there is an error.
    pub fn status_word(self, value: f64) -> Option<u16> {
        matches!(self, Self::Status(_)).then_some(value as u16)
    }
}
