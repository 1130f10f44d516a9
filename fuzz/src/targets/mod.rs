//! A file for each target.

pub(crate) mod configuration;
pub(crate) mod csv;
pub(crate) mod expressions;
pub(crate) mod frames;
pub(crate) mod messages;
pub(crate) mod recordings;
pub(crate) mod reports;
pub(crate) mod requests;
pub(crate) mod states;
