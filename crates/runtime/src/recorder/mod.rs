//! The node's own recorder: what a run needs to be repeated, from its first cycle to its last.
//!
//! Each cycle copies a row in its slack, a thread of its own writes the rows and the journal's entries.

mod cycle;
mod file;
mod recording;
mod writing;

pub(crate) use cycle::{Capture, Recorder};
pub use file::{RecordingFile, RecordingOutcome};
pub(crate) use recording::Recording;
