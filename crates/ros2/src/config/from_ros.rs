//! A table `[[from_ros]]`.

use isochrone_engine::Problem;
use isochrone_model::OWN_SERVICES;
use isochrone_recording::message::FieldPath;
use toml::de::DeValue;

use super::bases::{Bases, service};
use super::table::{Entry, Table, Text};
use super::to_ros::{element_names, element_signals, full, message_type, quality_of_service};
use super::{Config, FromRos};
use crate::mapping::{Incoming, Takes, takes};

pub(super) fn from_ros(table: &Table<'_>, bases: &Bases, config: &Config) -> Option<FromRos> {
    let topic = table.wanted("topic", "/cmd_vel");
    let topic = topic.and_then(|written| Some((full(table, &written, config)?, written.span)));
    let message = message_type(table, bases);
    let service = service(table);
    if let Some(service) = &service {
        check_service(table, service, config);
    }
    if let Some((topic, span)) = &topic
        && config.to_ros.iter().any(|to_ros| to_ros.topic == *topic && to_ros.message.is_some())
    {
        let message = format!("{topic} is also sent: the bridge would follow itself");
        let help = "give one of them another topic";
        table.report(Problem::Conflict, span.clone(), &message, help);
    }
    let max_gap = table.duration("max_gap");
    let quality_of_service = quality_of_service(table);
    let mut incoming = Incoming::new(message?);
    let names = element_names(table);
    if let (Some(names), Some(entry)) = (&names, table.get("names"))
        && !incoming.name_elements(names.clone())
    {
        let message = format!("{} has no field for names", incoming.message.ros_name());
        table.report(Problem::NoEffect, entry.span(), &message, "leave names out");
    }
    match table.entries("fields") {
        Some(fields) => {
            for (path, entry) in &fields {
                add_field(table, &mut incoming, path, entry, names.as_deref());
            }
        }
        None => match Incoming::of_all(incoming.message.clone()) {
            Ok(all) => incoming = all,
            Err(error) => table.errors.add(isochrone_engine::Diagnostic::new(
                Problem::OutOfRange,
                table.span.clone(),
                error.to_string(),
            )),
        },
    }
    if incoming.signals.is_empty() {
        let message = format!("no field of {} becomes a signal", incoming.message.ros_name());
        let help = "write fields = { \"linear.x\" = \"v\" }";
        table.report(Problem::MissingKey, table.span.clone(), &message, help);
        return None;
    }
    Some(FromRos {
        topic: topic?.0,
        message: incoming,
        service: service?.text,
        max_gap,
        quality_of_service,
    })
}

fn check_service(table: &Table<'_>, service: &Text, config: &Config) {
    let name = &service.text;
    let problem = if name.starts_with(OWN_SERVICES) {
        (
            Problem::BadName,
            format!("\"{name}\" is reserved: services of nodes begin with {OWN_SERVICES}"),
        )
    } else if config.from_ros.iter().any(|other| other.service == *name) {
        (Problem::Duplicate, format!("\"{name}\" has a topic already; a service has one writer"))
    } else {
        return;
    };
    table.report(problem.0, service.span.clone(), &problem.1, "name another service");
}

fn add_field(
    table: &Table<'_>,
    incoming: &mut Incoming,
    path: &Text,
    entry: Entry<'_>,
    names: Option<&[String]>,
) {
    let wrong = |span: std::ops::Range<usize>, message: &str| {
        table.report(Problem::OutOfRange, span, message, "");
    };
    let found = match FieldPath::find(&incoming.message, &path.text) {
        Ok(found) => found,
        Err(error) => return wrong(path.span.clone(), &error.to_string()),
    };
    let is_taken = |incoming: &Incoming, signal: &str| {
        incoming.signals.iter().any(|known| known.name == signal)
    };
    let mut add = |signal: &str, name: Option<usize>| {
        if is_taken(incoming, signal) {
            let message = format!("there is a signal \"{signal}\" already");
            return table.report(Problem::Duplicate, entry.span(), &message, "");
        }
        let added = match name {
            Some(name) => incoming.named(&path.text, name, signal),
            None => incoming.field(&path.text, signal),
        };
        if let Err(error) = added {
            wrong(path.span.clone(), &error.to_string());
        }
    };
    match (takes(&found), entry.get_ref()) {
        (Takes::Number(_), DeValue::String(signal)) => add(signal, None),
        (Takes::Number(_), _) => wrong(entry.span(), "a field becomes a signal: write its name"),
        (Takes::Numbers, _) if names.is_some() => {
            let signals = element_signals(table, path, entry, names).unwrap_or_default();
            for (index, signal) in signals.iter().enumerate() {
                add(signal, Some(index));
            }
        }
        (Takes::Numbers, DeValue::Array(_)) => {
            let base = path.text.trim_end_matches("[]").to_owned();
            let signals = element_signals(table, path, entry, None).unwrap_or_default();
            for (index, signal) in signals.iter().enumerate() {
                if is_taken(incoming, signal) {
                    let message = format!("there is a signal \"{signal}\" already");
                    table.report(Problem::Duplicate, entry.span(), &message, "");
                } else if let Err(error) = incoming.field(&format!("{base}[{index}]"), signal) {
                    wrong(path.span.clone(), &error.to_string());
                }
            }
        }
        _ => {
            let message = format!("{} is a {}: name a number in it", path.text, found.field_type());
            wrong(path.span.clone(), &message);
        }
    }
}
