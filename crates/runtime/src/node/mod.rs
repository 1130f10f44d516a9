//! A node's states: prepared, running, ended; and what operates it.

pub(crate) mod active_alarms;
mod alarm_sentences;
pub(crate) mod alarms;
pub(crate) mod apply;
pub(crate) mod event;
pub(crate) mod operate;
pub(crate) mod operating;
pub(crate) mod outcome;
pub(crate) mod prepare;
pub(crate) mod process_alarms;
pub(crate) mod report;
pub(crate) mod running;
pub(crate) mod standing;
pub(crate) mod warning;
