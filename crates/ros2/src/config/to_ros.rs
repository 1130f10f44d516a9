//! A table `[[to_ros]]`.

use std::ops::Range;
use std::sync::Arc;

use isochrone_engine::Problem;
use isochrone_recording::message::{FieldPath, MessageType, RosValue};
use toml::de::DeValue;

use super::bases::{Bases, check_type, service};
use super::fields::find_field;
use super::table::{Entry, Table, Text, number};
use super::types::{NoType, example, find_type, no_signal};
use super::{Config, OnBad, Profile, QUALITY_TYPE, QualityOfService, ToRos};
use crate::mapping::{Outgoing, Takes, takes};
use crate::names::{self, full_topic};
use crate::shown::with_article;

/// What is said of names for a message that does not carry them.
pub(super) const NO_NAMES: &str =
    "has no field for names: they stand for its elements in their order";
pub(super) const LIST_SIGNALS: &str = "leave names out, and list the signals";

/// Highest element of a sequence that can be named.
const MOST_ELEMENTS: usize = 4096;

pub(super) fn to_ros(table: &Table<'_>, bases: &Bases, config: &Config) -> Option<ToRos> {
    let service = service(table)?;
    let topic = topic(table, &service, config);
    let quality =
        table.text("quality").and_then(|written| full(table, "quality", &written, config));
    let message = match table.get("type") {
        None => {
            if let Some(fields) = table.get("fields") {
                let help = "write type = \"std_msgs/msg/Float64\"";
                let message = "[[to_ros]] has fields and no type";
                table.report(Problem::MissingKey, fields.span(), message, help);
            }
            Some(None)
        }
        Some(_) => outgoing(table, bases).map(Some),
    };
    let rate = table.number("rate", 0.001, 100_000.0);
    let on_bad = [("send", OnBad::Send), ("hold", OnBad::Hold), ("stop", OnBad::Stop)];
    let on_bad = table.word("on_bad", &on_bad);
    let quality_of_service = quality_of_service(table);
    let topic = topic?;
    if let Some(Some(outgoing)) = &message {
        check_type(table, "topic", &topic, &outgoing.message.ros_name(), config);
    }
    if let Some(quality) = &quality {
        check_type(table, "quality", quality, QUALITY_TYPE, config);
        if *quality == topic {
            let message = format!("{quality} is the topic of the values already");
            let span = table.get("quality").map_or(table.span.clone(), |entry| entry.span());
            table.report(Problem::Conflict, span, &message, "give quality a topic of its own");
        }
    }
    Some(ToRos {
        topic,
        service: service.text,
        message: message?,
        rate,
        on_bad,
        quality,
        quality_of_service,
    })
}

/// The topic that a table names, or that of its service.
fn topic(table: &Table<'_>, service: &Text, config: &Config) -> Option<String> {
    let of_service = || Text { text: format!("/{}", service.text), span: service.span.clone() };
    full(table, "topic", &table.text("topic").unwrap_or_else(of_service), config)
}

/// The full name of a topic.
pub(super) fn full(
    table: &Table<'_>,
    key: &str,
    written: &Text,
    config: &Config,
) -> Option<String> {
    match full_topic(&written.text, &config.namespace, &config.node) {
        Ok(full) => Some(full),
        Err(names::BadName { problem, suggestion }) => {
            let message = format!("\"{}\" is no name of a topic: {problem}", written.text);
            let help = format!("write {key} = \"{suggestion}\"");
            table.report(Problem::BadName, written.span.clone(), &message, &help);
            None
        }
    }
}

/// The quality of service that a table names.
pub(super) fn quality_of_service(table: &Table<'_>) -> QualityOfService {
    let words = [("default", Profile::Default), ("sensor_data", Profile::SensorData)];
    let known = |word: &str| match word {
        "best_effort" => Some("sensor_data"),
        "reliable" => Some("default"),
        _ => None,
    };
    let profile = table.word_or("qos", &words, known);
    let depth = table.whole("depth", 1, 10_000).unwrap_or(profile.depth());
    QualityOfService { profile, depth }
}

/// The type that a table names.
pub(super) fn message_type(table: &Table<'_>, bases: &Bases) -> Option<Arc<MessageType>> {
    let written = table.wanted("type", "std_msgs/msg/Float64")?;
    match find_type(&bases.definitions, &written.text) {
        Ok(message) => Some(message),
        Err(NoType { error, help }) => {
            table.report(Problem::BadName, written.span, &error.to_string(), &help);
            None
        }
    }
}

/// The names of elements, if the table has any.
pub(super) fn element_names(table: &Table<'_>) -> Option<Vec<String>> {
    let names = table.texts("names")?;
    Some(names.into_iter().map(|name| name.text).collect())
}

/// The signals for the elements of a sequence: a list, or a text with `*` for each name.
pub(super) fn element_signals(
    table: &Table<'_>,
    path: &Text,
    entry: Entry<'_>,
    names: Option<&[String]>,
) -> Option<Vec<String>> {
    let wrong = |message: &str, help: &str| {
        table.report(Problem::WrongType, entry.span(), message, help);
        None
    };
    let signals: Vec<String> = match (entry.get_ref(), names) {
        (DeValue::Array(array), _) => {
            let text = |it: &toml::Spanned<DeValue<'_>>| it.get_ref().as_str().map(str::to_owned);
            let Some(signals) = array.iter().map(text).collect::<Option<Vec<_>>>() else {
                return wrong("a list of signals has texts", "write [\"a\", \"b\"]");
            };
            signals
        }
        (DeValue::String(pattern), Some(names)) if pattern.contains('*') => {
            names.iter().map(|name| pattern.replace('*', name)).collect()
        }
        _ => {
            let message = format!("{} is a sequence", path.text);
            return wrong(&message, "write a list of signals, or names and \"*.position\"");
        }
    };
    if let Some(names) = names
        && names.len() != signals.len()
    {
        let (signals, names) = (signals.len(), names.len());
        let message = format!("{} has {signals} signals for {names} names", path.text);
        table.report(Problem::OutOfRange, entry.span(), &message, "");
        return None;
    }
    Some(signals)
}

fn outgoing(table: &Table<'_>, bases: &Bases) -> Option<Outgoing> {
    let message = message_type(table, bases)?;
    let mut outgoing = Outgoing::new(message);
    let names = element_names(table);
    if let Some(names) = &names {
        fill_names(table, &mut outgoing, names);
    }
    let Some(fields) = table.entries("fields") else {
        if table.get("fields").is_none() {
            let (message, help) = match example(&outgoing.message, "level.y") {
                Some(example) => {
                    ("[[to_ros]] has no fields".into(), format!("write fields = {{ {example} }}"))
                }
                None => (no_signal(&outgoing.message), String::new()),
            };
            table.report(Problem::MissingKey, table.span.clone(), &message, &help);
        }
        return None;
    };
    let mut are_constants = true;
    for (path, entry) in &fields {
        let before = table.errors.count();
        add_field(table, &mut outgoing, path, entry, names.as_deref());
        are_constants &= before == table.errors.count();
    }
    if outgoing.signals.is_empty() && are_constants {
        let message = "[[to_ros]] sends no signal: fields has constants alone";
        let span = table.get("fields").map_or(table.span.clone(), |entry| entry.span());
        let help = example(&outgoing.message, "level.y");
        let help = help.map(|example| format!("write fields = {{ {example} }}"));
        table.report(Problem::MissingKey, span, message, &help.unwrap_or_default());
    }
    Some(outgoing)
}

/// Puts the names into the field for them.
fn fill_names(table: &Table<'_>, outgoing: &mut Outgoing, names: &[String]) {
    let message = outgoing.message.clone();
    let is_for_names = |field: &&str| {
        FieldPath::find(&message, field).is_ok_and(|path| takes(&path) == Takes::Texts)
    };
    let texts = names.iter().map(|name| RosValue::Text(name.clone())).collect();
    let field = ["name", "names", "joint_names"].iter().find(|field| is_for_names(field));
    let is_set = field.map(|field| outgoing.constant(field, RosValue::Several(texts)).is_ok());
    if is_set != Some(true)
        && let Some(entry) = table.get("names")
    {
        let message = format!("{} {NO_NAMES}", message.ros_name());
        table.report(Problem::NoEffect, entry.span(), &message, LIST_SIGNALS);
    }
}

fn add_field(
    table: &Table<'_>,
    outgoing: &mut Outgoing,
    path: &Text,
    entry: Entry<'_>,
    names: Option<&[String]>,
) {
    let wrong = |span: Range<usize>, message: &str| {
        table.report(Problem::OutOfRange, span, message, "");
    };
    let Some(found) = find_field(table, &outgoing.message, path, entry) else { return };
    if found.element_of_sequence().is_some_and(|(_, index)| index >= MOST_ELEMENTS) {
        return wrong(path.span.clone(), &format!("at most {MOST_ELEMENTS} elements can be named"));
    }
    let before = outgoing.clone();
    let value = entry.get_ref();
    let done = match (takes(&found), value) {
        (Takes::Number(_), DeValue::String(signal)) => outgoing.signal(&path.text, signal),
        (Takes::Number(primitive), value) => {
            let number = value.as_bool().map(f64::from).or_else(|| number(value));
            let Some(number) = number else {
                let message =
                    format!("{} is a signal or {}", path.text, with_article(&primitive.name()));
                return wrong(entry.span(), &message);
            };
            outgoing.constant(&path.text, RosValue::Number(number))
        }
        (Takes::Text, DeValue::String(text)) => {
            outgoing.constant(&path.text, RosValue::Text(text.to_string()))
        }
        (Takes::Texts, DeValue::Array(array)) => {
            let text = |it: &toml::Spanned<DeValue<'_>>| {
                Some(RosValue::Text(it.get_ref().as_str()?.to_owned()))
            };
            let Some(texts) = array.iter().map(text).collect() else {
                return wrong(entry.span(), &format!("{} is a list of texts", path.text));
            };
            outgoing.constant(&path.text, RosValue::Several(texts))
        }
        (Takes::Numbers, _) => {
            let Some(signals) = element_signals(table, path, entry, names) else { return };
            outgoing.signals(&path.text, signals.iter().map(String::as_str))
        }
        (Takes::Text | Takes::Texts, _) => {
            let field = with_article(found.field_type());
            return wrong(entry.span(), &format!("{} is {field}, which takes text", path.text));
        }
        (Takes::Nothing, _) => {
            let field = with_article(found.field_type());
            let message = format!("{} is {field}: name a number in it", path.text);
            return wrong(path.span.clone(), &message);
        }
    };
    if let Err(error) = done {
        return wrong(path.span.clone(), &error.to_string());
    }
    // What a field cannot be is found when a message is made, and that is now.
    if let Err(error) = outgoing.encode(&vec![0.0; outgoing.signals.len()], 0) {
        *outgoing = before;
        wrong(entry.span(), &error.to_string());
    }
}
