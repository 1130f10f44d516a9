//! What an answer says when it is no result.

use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::Code;

/// Why a request was refused, whole: the `error` of an answer.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// What kind it is.
    pub code: Code,
    /// A sentence.
    pub message: String,
    /// Everything that was found, not only the first; empty where the message says it all.
    #[serde(rename = "data", default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<Finding>,
}

/// One thing that is wrong with a request, or worth a warning.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// What it is about: a signal, a member of the parameters, or a place in a configuration.
    pub name: String,
    /// What is wrong with it.
    pub message: String,
    /// What would be right, such as the name that was probably meant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
    /// Where it stands, if it is in a configuration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<Place>,
}

/// A place in the text of a configuration.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
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

impl Failure {
    /// A failure that its message explains.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), findings: Vec::new() }
    }

    /// A failure whose message is the first finding's, with how many more there are.
    pub fn of(code: Code, findings: Vec<Finding>) -> Self {
        let first = findings.first().map(Finding::to_string).unwrap_or_default();
        let message = match findings.len() {
            0 | 1 => first,
            count => format!("{first} (and {} more)", count - 1),
        };
        Self { code, message, findings }
    }
}

/// The message.
impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

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

isochrone_quality::debug_as_display!(Failure);
