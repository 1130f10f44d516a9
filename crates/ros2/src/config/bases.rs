//! What is known before the file is read, and what tables have in common.

use std::path::PathBuf;

use isochrone_engine::Problem;
use isochrone_ipc::check_service_name;
use isochrone_recording::message::Definitions;

use super::Config;
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

/// Refuses a topic that has another type in another table.
pub(super) fn check_type(
    table: &Table<'_>,
    key: &str,
    topic: &str,
    type_name: &str,
    config: &Config,
) {
    let Some(other) = config.type_of(topic).filter(|other| other != type_name) else { return };
    let span = table.get(key).map_or(table.span.clone(), |entry| entry.span());
    let message =
        format!("{topic} has the type {type_name} here, and {other} above: a topic has one type");
    table.report(Problem::Conflict, span, &message, "give one of them another topic");
}

/// What is said of a service that is written as a topic.
pub(crate) const SLASH: &str = "begins with a slash, which no service of isochrone does";

/// The service that a table names.
pub(super) fn service(table: &Table<'_>) -> Option<Text> {
    let service = table.wanted("service", "plant/level")?;
    if let Some(rest) = service.text.strip_prefix('/') {
        let message = format!("\"{}\" {SLASH}", service.text);
        let help = format!("write service = \"{rest}\"");
        table.report(Problem::BadName, service.span.clone(), &message, &help);
        return None;
    }
    if let Err(error) = check_service_name(&service.text) {
        table.report(Problem::BadName, service.span.clone(), &error.to_string(), "");
        return None;
    }
    Some(service)
}
