//! What `--check` and `--show` say, and types as people name them.

use std::fmt::Display;

use isochrone_model::format_duration_ns;
use isochrone_recording::message::{BaseType, Definitions, Extent, MessageType};

use crate::config::{Config, OnBad, Profile, QualityOfService, names};

/// The fields of a message, with those of messages in it.
pub(crate) fn message(message: &MessageType) -> String {
    let mut text = format!("{}, {} in DDS\n", message.ros_name(), message.dds_name());
    add_fields(message, "", &mut text);
    text
}

fn add_fields(message: &MessageType, prefix: &str, text: &mut String) {
    for field in &message.fields {
        let path = format!("{prefix}{}", field.name);
        match (&field.field_type.base, field.field_type.extent) {
            (BaseType::Message(inner), Extent::One) => {
                add_fields(inner, &format!("{path}."), text);
            }
            _ => *text += &format!("  {path}: {}\n", field.field_type),
        }
    }
}

/// The names of all types.
pub(crate) fn types(definitions: &Definitions) -> String {
    names(definitions).map(|name| name.replacen('/', "/msg/", 1) + "\n").collect()
}

/// The keys of a link that are not as they are by default.
fn in_brackets(keys: impl Iterator<Item = Option<String>>) -> String {
    let keys: Vec<String> = keys.flatten().collect();
    if keys.is_empty() { String::new() } else { format!(" ({})", keys.join(", ")) }
}

fn of_quality(quality: QualityOfService) -> [Option<String>; 2] {
    let QualityOfService { profile, depth } = quality;
    let is_best_effort = profile == Profile::SensorData;
    [
        is_best_effort.then(|| "qos = \"sensor_data\"".to_owned()),
        (depth != profile.depth()).then(|| format!("depth = {depth}")),
    ]
}

/// What the bridge would do.
pub(crate) fn config(config: &Config) -> String {
    let mut text = format!(
        "node {} in {}, DDS domain {}{}\n",
        config.node,
        config.namespace,
        config.domain,
        if config.is_local { ", this machine alone" } else { "" }
    );
    for link in &config.to_ros {
        let message = link.message.as_ref();
        let what = message.map_or("std_msgs/msg/Float64 for each signal".into(), |outgoing| {
            format!("{} of {}", outgoing.message.ros_name(), outgoing.signals.join(", "))
        });
        let on_bad = match link.on_bad {
            OnBad::Send => None,
            OnBad::Hold => Some("hold"),
            OnBad::Stop => Some("stop"),
        };
        let keys = [
            link.rate.map(|rate| format!("rate = {rate}")),
            on_bad.map(|word| format!("on_bad = \"{word}\"")),
            link.quality.as_ref().map(|topic| format!("quality = \"{topic}\"")),
        ];
        let keys = in_brackets(keys.into_iter().chain(of_quality(link.quality_of_service)));
        text += &format!("{} -> {}: {what}{keys}\n", link.service, link.shown_topic());
    }
    for link in &config.from_ros {
        let names: Vec<&str> = link.message.signals.iter().map(|signal| &*signal.name).collect();
        let message = link.message.message.ros_name();
        let max_gap = link.max_gap.map(|gap| format_duration_ns(gap.as_nanos() as u64));
        let max_gap = max_gap.map(|gap| format!("max_gap = \"{gap}\""));
        let keys = in_brackets(std::iter::once(max_gap).chain(of_quality(link.quality_of_service)));
        let names = names.join(", ");
        text += &format!("{} -> {}: {names} of {message}{keys}\n", link.topic, link.service);
    }
    for node in &config.parameters {
        text += &format!("parameters of {node}\n");
    }
    if let Some(diagnostics) = &config.diagnostics {
        let nodes = diagnostics.nodes.join(", ");
        let of = if nodes.is_empty() { "all nodes" } else { &nodes };
        text += &format!("diagnostics of {of}\n");
    }
    text
}

/// A type with its article: `a float64[]`, `an int32`.
pub(crate) fn with_article(name: &dyn Display) -> String {
    let name = name.to_string();
    let article = if name.starts_with(['a', 'e', 'i', 'o']) { "an" } else { "a" };
    format!("{article} {name}")
}
