//! The node's own recorder: everything that is needed to repeat a run, from its first cycle to its last.
//!
//! Each cycle copies a row in its slack; a thread writes the rows and the journal's entries.

mod cycle;
mod file;
mod recording;
mod writing;

pub(crate) use cycle::{Capture, Recorder};
pub use file::{RecordingFile, RecordingOutcome};
pub(crate) use recording::Recording;
