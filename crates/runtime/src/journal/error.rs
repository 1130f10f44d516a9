//! What can be wrong with a journal file.

use std::io;

use isochrone_engine::operate::Refusals;

use super::line::{FORMAT, RunHeader};

/// Why a journal file cannot be written or read. `Display` names the file, the line and the way out.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// The operating system refuses to open it, or to write to it.
    #[error(
        "cannot write the journal {path}: {source}; name a file in a place that can be written"
    )]
    Write {
        /// The file.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// There is no thread to write it.
    #[error(
        "cannot start the thread that writes the journal {path}: {source}; raise the limit of processes (ulimit -u)"
    )]
    Thread {
        /// The file.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// The operating system refuses to read it.
    #[error("cannot read the journal {path}: {source}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// Another process writes it.
    #[error("another node writes the journal {path}; name a file of its own for each")]
    InUse {
        /// The file.
        path: String,
    },
    /// A line is none of a journal.
    #[error(
        "{path}:{line}: no line of a journal: {reason}; a journal is a file that `run --journal` wrote"
    )]
    BadLine {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A run is written in another format.
    #[error(
        "{path}:{line}: run {run} has format {format}, and this program knows format {FORMAT}; use the version that wrote it, {version}, or begin another file"
    )]
    OtherFormat {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
        /// The run.
        run: u64,
        /// Its format.
        format: u64,
        /// The version that wrote it.
        version: String,
    },
    /// It has no runs.
    #[error("{path} has no runs; a journal is a file that `run --journal` wrote")]
    Empty {
        /// The file.
        path: String,
    },
    /// It has no run of this number.
    #[error("{path} has no run {run}; its runs are {first} to {last}")]
    NoRun {
        /// The file.
        path: String,
        /// The run that was asked for.
        run: u64,
        /// The first that there is.
        first: u64,
        /// The last that there is.
        last: u64,
    },
    /// A run is of another configuration.
    #[error(
        "{path}:{line}: run {run} is of another configuration than {found}: of {file} as it was then (sha256 {expected}…, and this is {sha256}…); give that one, simulate the text that the journal keeps (--recorded), or choose another run by --run",
        run = .header.run, file = .header.file, expected = start(&.header.sha256), sha256 = start(.sha256)
    )]
    OtherConfiguration {
        /// The journal.
        path: String,
        /// The line of the run, from 1.
        line: usize,
        /// The run.
        header: Box<RunHeader>,
        /// The configuration that was given.
        found: String,
        /// Its hash.
        sha256: String,
    },
    /// The beginning of a run is lost.
    #[error(
        "{path}:{line}: what was done first in run {run} is lost, as the file was truncated while the node ran; it cannot be repeated. Rename a journal rather than truncate it (logrotate: `create` rather than `copytruncate`)"
    )]
    Cut {
        /// The file.
        path: String,
        /// The line of the run, from 1.
        line: usize,
        /// The run.
        run: u64,
    },
    /// An entry does not fit the configuration, so somebody has edited it.
    #[error("{path}:{line}: {refusals}")]
    Unfit {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
        /// All that is wrong with the entry.
        refusals: Refusals,
    },
}

/// Enough of a hash to tell it from others.
fn start(hash: &str) -> String {
    hash.chars().take(12).collect()
}
