//! Shared parts of the verbs: the domain, files, the terminal, values and times.

pub(crate) mod columns;
pub(crate) mod configuration;
pub(crate) mod csv_table;
pub(crate) mod domain;
pub(crate) mod failure;
pub(crate) mod files;
pub(crate) mod gate;
pub(crate) mod logging;
pub(crate) mod mcap_file;
pub(crate) mod numbers;
pub(crate) mod rows;
pub(crate) mod session;
pub(crate) mod stop;
pub(crate) mod suggestion;
pub(crate) mod terminal;
pub(crate) mod throttling;
pub(crate) mod twins;
pub(crate) mod wave;
pub(crate) mod wrapping;
