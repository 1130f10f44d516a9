//! What `--check` and `--show` say.

use isochrone_recording::message::{BaseType, Extent, MessageType};

use crate::config::Config;

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
        text += &format!("{} -> {}: {what}\n", link.service, link.topic);
    }
    for link in &config.from_ros {
        let names: Vec<&str> = link.message.signals.iter().map(|signal| &*signal.name).collect();
        let message = link.message.message.ros_name();
        text += &format!("{} -> {}: {} of {message}\n", link.topic, link.service, names.join(", "));
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
