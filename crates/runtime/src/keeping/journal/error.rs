//! Errors of journal files.

use std::io;

use super::line::FORMAT;

/// Why a journal file cannot be written or read. `Display` names the file, the line and the way out.
#[derive(thiserror::Error)]
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
    /// The thread that writes it could not be started.
    #[error(
        "cannot start the thread that writes the journal {path}: {source}; {}",
        isochrone_ipc::thread_remedy()
    )]
    Thread {
        /// The file.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// The operating system refuses to read it.
    #[error(
        "cannot read the journal {path}: {source}; see that this user may read it, and that /proc is there"
    )]
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
    /// A line is not a line of a journal.
    #[error(
        "{path}:{line}: no line of a journal: {reason}; if `run --journal` wrote the file, remove line {line}, or rename the file to begin another one"
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
}

isochrone_model::debug_as_display!(JournalError);
