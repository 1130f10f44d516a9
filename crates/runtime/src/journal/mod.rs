//! **The journal of a node in a file**: what was done to its values, run after run, so that `simulate`
//! can do it again.
//!
//! The file has one JSON object a line ([`Line`]). Each run begins with a line `{"run": {…}}`; then each
//! `{"entry": {…}}` is what was done to one task before one of its cycles, and each `{"missed": {…}}` a
//! range of cycles that did not run. A run whose journal is complete closes with `{"end": {…}}`. Lines are
//! only ever added.
//!
//! A [`Journal`] is what a node writes to ([`Prepared::with_journal`](crate::Prepared::with_journal)),
//! [`JournalFile::read`] reads one, and [`JournalLines`] reads it line by line.

mod entry;
mod error;
mod line;
mod lines;
mod missed;
mod place;
mod read;
mod tail;
mod write;
mod writing;

pub use error::JournalError;
pub use line::{FORMAT, Line, Missed, RunEnd, RunHeader, Unclear};
pub use lines::JournalLines;
pub use read::{JournalFile, JournaledRun, Numbered, entry_of_line};
pub use write::Journal;
pub(crate) use writing::{Fate, Mark, Standing, Writing};
