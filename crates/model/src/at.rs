//! Before which cycle something happens.

use std::fmt;
use std::str::FromStr;

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A cycle of a task. In JSON its number, or a string such as `"+500"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// This one.
    Cycle(u64),
    /// The cycle that is this many after the current one.
    In(u64),
}

impl At {
    /// The forms that it may have in a request, in words.
    pub const EXPECTED: &'static str =
        "a whole number, the cycle, or a string such as \"+500\": in 500 cycles";
}

impl From<u64> for At {
    fn from(cycle: u64) -> Self {
        Self::Cycle(cycle)
    }
}

impl FromStr for At {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, at): (_, fn(u64) -> Self) = match text.strip_prefix('+') {
            Some(number) => (number, Self::In),
            None => (text, Self::Cycle),
        };
        let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
        match number.parse() {
            Ok(number) if is_number => Ok(at(number)),
            _ => Err("give a cycle, such as 250000, or +500: in 500 cycles".into()),
        }
    }
}

/// As it is written.
impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cycle(cycle) => cycle.fmt(f),
            Self::In(ahead) => write!(f, "+{ahead}"),
        }
    }
}

impl Serialize for At {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Cycle(cycle) => serializer.serialize_u64(*cycle),
            Self::In(_) => serializer.collect_str(self),
        }
    }
}

impl<'de> Deserialize<'de> for At {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfAt;
        impl Visitor<'_> for OfAt {
            type Value = At;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(At::EXPECTED)
            }

            fn visit_u64<E>(self, cycle: u64) -> Result<At, E> {
                Ok(At::Cycle(cycle))
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<At, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_any(OfAt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_is_named_by_its_number_or_counted_from_now() {
        assert_eq!("250000".parse(), Ok(At::Cycle(250_000)));
        assert_eq!("+50".parse(), Ok(At::In(50)));
        for text in ["", "+", "++5", "-5", "5s", "+5s", "1.5"] {
            assert!(text.parse::<At>().unwrap_err().contains("+500"), "{text}");
        }
    }

    #[test]
    fn in_json_a_cycle_is_a_number_and_one_from_now_a_string() {
        for (at, json) in [(At::Cycle(u64::MAX), "18446744073709551615"), (At::In(500), "\"+500\"")]
        {
            assert_eq!(serde_json::to_string(&at).unwrap(), json);
            assert_eq!(serde_json::from_str::<At>(json).unwrap(), at);
        }
        for text in ["-1", "1.0", "\"five\"", "\"-5\"", "true", "null"] {
            assert!(serde_json::from_str::<At>(text).is_err(), "{text}");
        }
    }
}
