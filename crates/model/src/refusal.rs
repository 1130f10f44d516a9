//! Refusals of requests, and findings.

use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Why a request was refused, whole: the `error` of an answer.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// The kind of refusal.
    pub code: Code,
    /// A sentence.
    pub message: String,
    /// All findings, not only the first; empty if the message says everything.
    #[serde(rename = "data", default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<Finding>,
}

/// One thing that is wrong with a request, or worth a warning, as answers carry it. Of a configuration that a request
/// brings, it is made from a diagnostic of the engine, with line and column.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// Its subject: a signal, a member of the parameters, or a place in a configuration.
    pub name: String,
    /// What is wrong with it.
    pub message: String,
    /// What would be right, such as a suggested name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
    /// The place, if it is in a configuration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<ConfigPlace>,
}

/// A place in the text of a configuration.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConfigPlace {
    /// Line, from 1.
    pub line: u64,
    /// Column, from 1; columns count characters.
    pub column: u64,
    /// The bytes that it is about.
    pub span: Range<u64>,
    /// Bytes that have to do with it: where a name stands for the first time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first: Option<Range<u64>>,
}

impl Refusal {
    /// A refusal that its message explains.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), findings: Vec::new() }
    }

    /// A refusal for one reason, with the way out.
    pub fn one(
        code: Code,
        name: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self::of(code, vec![Finding::new(name, message).with_help(help)])
    }

    /// A refusal whose message is the first finding's, with how many more there are.
    pub fn of(code: Code, findings: Vec<Finding>) -> Self {
        let first = findings.first().map(Finding::to_string).unwrap_or_default();
        let message = match findings.len() {
            0 | 1 => first,
            count => format!("{first} (and {} more)", count - 1),
        };
        Self { code, message, findings }
    }
}

/// The message; where there are several findings, each with its way out, at most 20 of them.
impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 20;
        if self.findings.len() <= 1 {
            return f.write_str(&self.message);
        }
        for (index, finding) in self.findings.iter().take(SHOWN).enumerate() {
            let separator = if index == 0 { "" } else { "; " };
            write!(f, "{separator}{}", finding.message)?;
            if let Some(help) = &finding.help {
                write!(f, " ({help})")?;
            }
        }
        match self.findings.len().checked_sub(SHOWN) {
            Some(more @ 1..) => write!(f, "; and {more} more"),
            _ => Ok(()),
        }
    }
}

impl std::error::Error for Refusal {}

crate::debug_as_display!(Refusal);

impl Finding {
    /// What is wrong with `name`.
    pub fn new(name: impl Into<String>, message: impl Into<String>) -> Self {
        Self { name: name.into(), message: message.into(), help: None, place: None }
    }

    /// The same with what would be right.
    #[must_use]
    pub fn with_help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}

/// Message and help.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        match &self.help {
            Some(help) => write!(f, "; {help}"),
            None => Ok(()),
        }
    }
}

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
    /// -32602: a parameter is missing, unknown or of another type, or a text is no value of its signal.
    InvalidParams,
    /// -32603: the node itself failed.
    Internal,
    /// 1: a name that does not exist.
    UnknownName,
    /// 2: something that is not written to in this way.
    NotWritable,
    /// 3: a value of another type, out of range or limits, or NaN.
    WrongValue,
    /// 4: the cycle has begun, or the node is ending; nothing happened.
    TooLate,
    /// 5: there is no room for the request at the moment; nothing happened.
    Busy,
    /// 6: `control` or `protect` of the configuration forbids it.
    Forbidden,
    /// 7: cannot be changed while the node runs.
    CannotChange,
    /// 8: the configuration has errors.
    Configuration,
    /// 9: what is to be undone was changed since, or what was to be forced was released before its cycle.
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
