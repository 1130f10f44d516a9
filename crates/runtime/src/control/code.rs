//! What kind of refusal an answer is.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Why a request was refused, for programs: the `code` of a JSON-RPC error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Code {
    /// -32700: the text is no JSON.
    Parse,
    /// -32600: the JSON is no request of JSON-RPC 2.0 as it is taken here.
    InvalidRequest,
    /// -32601: there is no such method.
    UnknownMethod,
    /// -32602: a parameter is missing, unknown or of another type.
    InvalidParams,
    /// -32603: the node itself failed.
    Internal,
    /// 1: a name that does not exist.
    UnknownName,
    /// 2: something that is not written to in this way.
    NotWritable,
    /// 3: a value of another type, out of range or limits, or NaN.
    WrongValue,
    /// 4: the cycle has begun; nothing happened.
    TooLate,
    /// 5: there is no room for the request at the moment; nothing happened.
    Busy,
    /// 6: `control` or `protect` of the configuration forbids it.
    Forbidden,
    /// 7: cannot be changed while the node runs.
    CannotChange,
    /// 8: the configuration has errors.
    Configuration,
    /// 9: what is to be undone was changed since.
    Conflict,
    /// A code that this version does not know.
    Other(i64),
}

impl Code {
    /// All that this version knows.
    pub const ALL: [Self; 14] = [
        Self::Parse,
        Self::InvalidRequest,
        Self::UnknownMethod,
        Self::InvalidParams,
        Self::Internal,
        Self::UnknownName,
        Self::NotWritable,
        Self::WrongValue,
        Self::TooLate,
        Self::Busy,
        Self::Forbidden,
        Self::CannotChange,
        Self::Configuration,
        Self::Conflict,
    ];

    /// The number.
    pub const fn number(self) -> i64 {
        match self {
            Self::Parse => -32700,
            Self::InvalidRequest => -32600,
            Self::UnknownMethod => -32601,
            Self::InvalidParams => -32602,
            Self::Internal => -32603,
            Self::UnknownName => 1,
            Self::NotWritable => 2,
            Self::WrongValue => 3,
            Self::TooLate => 4,
            Self::Busy => 5,
            Self::Forbidden => 6,
            Self::CannotChange => 7,
            Self::Configuration => 8,
            Self::Conflict => 9,
            Self::Other(number) => number,
        }
    }

    /// The code of a number.
    pub fn of(number: i64) -> Self {
        let known = Self::ALL.into_iter().find(|code| code.number() == number);
        known.unwrap_or(Self::Other(number))
    }
}

/// The number.
impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.number().fmt(f)
    }
}

impl Serialize for Code {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_i64(self.number())
    }
}

impl<'de> Deserialize<'de> for Code {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        i64::deserialize(deserializer).map(Self::of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_code_has_its_number_back() {
        for code in Code::ALL {
            assert_eq!(Code::of(code.number()), code);
        }
        assert_eq!(Code::of(77), Code::Other(77));
        assert_eq!(Code::of(-32768).number(), -32768);
    }
}
