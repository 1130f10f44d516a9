//! Files of a running node: the journal, the recording and the retained state.

pub(crate) mod guard;
pub mod journal;
pub(crate) mod output_file;
pub(crate) mod recorded;
pub(crate) mod recorder;
pub mod state;
