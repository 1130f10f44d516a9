//! What is known before the file is read, and what tables have in common.

use std::path::PathBuf;

use isochrone_engine::Problem;
use isochrone_ipc::check_service_name;
use isochrone_recording::message::Definitions;

use super::table::{Table, Text};

/// What the command line says, and what types there are.
#[derive(Debug, Clone)]
pub(crate) struct Bases {
    pub(crate) definitions: Definitions,
    pub(crate) node: Option<String>,
    pub(crate) namespace: Option<String>,
    pub(crate) domain: u16,
    /// The folder that relative paths begin at.
    pub(crate) folder: PathBuf,
}

/// The service that a table names.
pub(super) fn service(table: &Table<'_>) -> Option<Text> {
    let service = table.wanted("service", "plant/level")?;
    if let Err(error) = check_service_name(&service.text) {
        table.report(Problem::BadName, service.span.clone(), &error.to_string(), "");
        return None;
    }
    Some(service)
}
