//! Files of a running node: the journal and the recording.

pub mod journal;
pub(crate) mod output_file;
pub(crate) mod recorded;
pub(crate) mod recorder;
