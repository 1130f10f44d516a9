//! A table `[[from_ros]]`.

use isochrone_engine::Problem;
use isochrone_model::OWN_SERVICES;
use toml::de::DeValue;

use super::bases::{Bases, check_type, service};
use super::fields::find_field;
use super::table::{Entry, Table, Text};
use super::to_ros::{
    LIST_SIGNALS, NO_NAMES, element_names, element_signals, full, message_type, quality_of_service,
};
use super::types::{example, no_signal};
use super::{Config, FromRos};
use crate::mapping::{Incoming, Takes, takes};
use crate::shown::with_article;

pub(super) fn from_ros(table: &Table<'_>, bases: &Bases, config: &Config) -> Option<FromRos> {
    let topic = table.wanted("topic", "/cmd_vel");
    let topic =
        topic.and_then(|written| Some((full(table, "topic", &written, config)?, written.span)));
    let message = message_type(table, bases);
    let service = service(table);
    if let Some(service) = &service {
        check_service(table, service, config);
    }
    let is_sent = |topic: &str| {
        config.to_ros.iter().any(|to_ros| to_ros.topic == topic && to_ros.message.is_some())
    };
    if let Some((topic, span)) = topic.as_ref().filter(|(topic, _)| is_sent(topic)) {
        let message = format!("{topic} is also sent: the bridge would follow itself");
        let help = "give one of them another topic";
        table.report(Problem::Conflict, span.clone(), &message, help);
    }
    let max_gap = table.duration("max_gap");
    let quality_of_service = quality_of_service(table);
    let mut incoming = Incoming::new(message?);
    if let Some((topic, _)) = topic.as_ref().filter(|(topic, _)| !is_sent(topic)) {
        check_type(table, "topic", topic, &incoming.message.ros_name(), config);
    }
    let names = element_names(table);
    if let (Some(names), Some(entry)) = (&names, table.get("names"))
        && !incoming.name_elements(names.clone())
    {
        let message = format!("{} {NO_NAMES}", incoming.message.ros_name());
        table.report(Problem::NoEffect, entry.span(), &message, LIST_SIGNALS);
    }
    let before = table.errors.count();
    match table.entries("fields") {
        Some(fields) => {
            for (path, entry) in &fields {
                add_field(table, &mut incoming, path, entry, names.as_deref());
            }
        }
        None if table.get("fields").is_some() => {}
        None => match Incoming::of_all(incoming.message.clone()) {
            Ok(all) => incoming = all,
            Err(error) => {
                table.report(Problem::OutOfRange, table.span.clone(), &error.to_string(), "");
            }
        },
    }
    if incoming.signals.is_empty() {
        if table.errors.count() == before {
            let (message, help) = match example(&incoming.message, "v") {
                Some(example) => (
                    format!("no field of {} becomes a signal", incoming.message.ros_name()),
                    format!("write fields = {{ {example} }}"),
                ),
                None => (no_signal(&incoming.message), String::new()),
            };
            table.report(Problem::MissingKey, table.span.clone(), &message, &help);
        }
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
    let is_named = incoming.finds_by_name();
    let wrong = |span: std::ops::Range<usize>, message: &str| {
        table.report(Problem::OutOfRange, span, message, "");
    };
    let Some(found) = find_field(table, &incoming.message, path, entry) else { return };
    let mut add = |path_text: &str, signal: &str, name: Option<usize>| {
        if incoming.signals.iter().any(|known| known.name == signal) {
            let message = format!("there is a signal \"{signal}\" already");
            return table.report(Problem::Duplicate, entry.span(), &message, "");
        }
        let added = match name {
            Some(name) => incoming.named(path_text, name, signal),
            None => incoming.field(path_text, signal),
        };
        if let Err(error) = added {
            wrong(path.span.clone(), &error.to_string());
        }
    };
    match (takes(&found), entry.get_ref()) {
        (Takes::Number(_), DeValue::String(signal)) => add(&path.text, signal, None),
        (Takes::Number(_), _) => wrong(entry.span(), "a field becomes a signal: write its name"),
        (Takes::Numbers, value) if names.is_some() || value.as_array().is_some() => {
            let base = path.text.trim_end_matches("[]");
            let signals = element_signals(table, path, entry, names).unwrap_or_default();
            for (index, signal) in signals.iter().enumerate() {
                if is_named {
                    add(&path.text, signal, Some(index));
                } else {
                    add(&format!("{base}[{index}]"), signal, None);
                }
            }
        }
        _ => {
            let field = with_article(found.field_type());
            wrong(path.span.clone(), &format!("{} is {field}: name a number in it", path.text));
        }
    }
}
