//! **The journal of a node in a file**: what was done to its values, run after run.
//!
//! The file has one JSON object a line ([`Line`]). Each run begins with a line `{"run": {…}}`; then each
//! `{"entry": {…}}` is what was done to one task before one of its cycles. A run whose journal is complete
//! closes with `{"end": {…}}`. Lines are only ever added, and a file that has grown to 16 MiB is kept beside
//! the next one.
//!
//! A [`Journal`] is what a node writes to ([`Prepared::with_journal`](crate::Prepared::with_journal)), and
//! [`JournalLines`] reads a file line by line.

mod entry;
mod error;
mod line;
mod lines;
mod rotation;
mod tail;
mod write;
mod writing;

pub use entry::entry_of_line;
pub use error::JournalError;
pub use line::{FORMAT, Line, RunEnd, RunHeader};
pub use lines::JournalLines;
pub use write::Journal;
pub(crate) use write::JournalAtTakeover;
pub(crate) use writing::{Fate, Mark, WriterProgress, Writing};
