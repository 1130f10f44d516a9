//! The value of a message.

/// A value of a field, or a whole message.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum RosValue {
    /// A number of at most 32 bits, a float, or a truth value: 0 or 1.
    Number(f64),
    /// An `int64` or `uint64`.
    Integer(i128),
    /// A text.
    Text(String),
    /// Several numbers, but for `int64` and `uint64`.
    Numbers(Vec<f64>),
    /// Several of anything else.
    Several(Vec<RosValue>),
    /// A message: its fields in their order.
    Message(Vec<RosValue>),
}

impl RosValue {
    /// The number, if it is one; one of 64 bits only if a float has it exactly.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Integer(integer) => {
                let number = *integer as f64;
                (number as i128 == *integer).then_some(number)
            }
            _ => None,
        }
    }

    /// The text, if it is one.
    pub fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The elements or fields of what has several, but for numbers.
    pub fn parts(&self) -> &[Self] {
        match self {
            Self::Several(parts) | Self::Message(parts) => parts,
            _ => &[],
        }
    }
}
