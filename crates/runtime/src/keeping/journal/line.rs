//! The lines of a journal file.

use isochrone_model::Entry;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

/// The format that is written, and the only one that is read.
pub const FORMAT: u32 = 1;

/// A line of a journal file: an object with one member, which says what it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Line {
    /// A run begins.
    Run(RunHeader),
    /// Values of a task were changed.
    Entry(Entry),
    /// A run has ended, and its journal is complete.
    End(RunEnd),
    /// Cycles did not run. Only earlier versions wrote this.
    #[serde(alias = "unclear", skip_serializing)]
    Missed(IgnoredAny),
}

impl Line {
    /// The line for an entry. `None`: it is not journaled, as when the program sets inputs, which no operator did.
    pub(crate) fn of_entry(entry: &Entry) -> Option<Self> {
        let is_an_operators = !entry.changes.is_empty() || entry.configuration.is_some();
        is_an_operators.then(|| Self::Entry(entry.clone()))
    }

    /// As JSON, without a newline. `None`: it cannot be written, which does not happen.
    pub(crate) fn json(&self) -> Option<String> {
        serde_json::to_string(self).ok()
    }

    /// As in the file, with a newline. `None`: it cannot be written, which does not happen.
    pub(super) fn text(&self) -> Option<Vec<u8>> {
        Some((self.json()? + "\n").into_bytes())
    }
}

/// The header of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunHeader {
    /// [`FORMAT`] of the lines that follow.
    pub format: u32,
    /// Number of the run in the file, from 1.
    pub run: u64,
    /// Name of the node.
    pub node: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// File of the configuration that the node was started with.
    pub file: String,
    /// SHA-256 of the configuration's text: 64 hexadecimal digits.
    pub sha256: String,
    /// When the node was started, in ns of UTC since 1970.
    pub started_unix_ns: u64,
    /// Text of the configuration; `None` if an older version wrote the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub configuration: Option<String>,
    /// The last transaction of the earlier runs in the file; `None` if an older version wrote the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after_transaction: Option<u64>,
    /// The term with which the process held the node; `None`: the node has one process, or an older version wrote the
    /// run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub term: Option<u64>,
}

/// The end of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RunEnd {
    /// Number of the run in the file, from 1.
    pub run: u64,
    /// When the node ended, in ns of UTC since 1970.
    pub ended_unix_ns: u64,
    /// The last transaction of all runs up to it; `None` if an older version wrote the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_transaction: Option<u64>,
}
