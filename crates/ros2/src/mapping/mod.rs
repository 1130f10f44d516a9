//! What becomes of a frame's values in a message, and of a message in a frame.

mod incoming;
mod outgoing;

pub(crate) use incoming::{Incoming, Misfit};
pub(crate) use outgoing::{Outgoing, Takes, takes, time};

use isochrone_recording::message::{BaseType, Extent, FieldPath, MessageType, Primitive};

/// Most single values of a message, so that a service of them is no surprise.
const MOST_LEAVES: usize = 4096;

/// The time stamp of a message's header, if it has one.
pub(crate) fn stamp_of(message: &MessageType) -> Option<FieldPath> {
    let stamp = FieldPath::find(message, "header.stamp").ok()?;
    let BaseType::Message(found) = &stamp.field_type().base else { return None };
    (found.name == "builtin_interfaces/Time").then_some(stamp)
}

/// The single numbers of a message that it always has, by path, but for the time stamp of its header.
pub(crate) fn numbers_of(message: &MessageType) -> Vec<(String, Primitive)> {
    let mut leaves = Vec::new();
    collect(message, "", stamp_of(message).is_some(), &mut leaves);
    leaves
}

fn collect(
    message: &MessageType,
    prefix: &str,
    has_stamp: bool,
    leaves: &mut Vec<(String, Primitive)>,
) {
    for field in &message.fields {
        let path = format!("{prefix}{}", field.name);
        if has_stamp && path == "header.stamp" || leaves.len() > MOST_LEAVES {
            continue;
        }
        match (&field.field_type.base, field.field_type.extent) {
            (BaseType::Primitive(primitive), Extent::One) => leaves.push((path, *primitive)),
            (BaseType::Primitive(primitive), Extent::Array(count)) => {
                leaves.extend((0..count).map(|index| (format!("{path}[{index}]"), *primitive)));
            }
            (BaseType::Message(inner), Extent::One) => {
                collect(inner, &format!("{path}."), has_stamp, leaves);
            }
            _ => {}
        }
    }
    leaves.truncate(MOST_LEAVES);
}

/// The name of a signal for a field of a message: `covariance[3]` is `covariance.3`.
pub(crate) fn signal_name(path: &str) -> String {
    path.replace('[', ".").replace(']', "")
}

/// The type of a signal that has every value of a field.
pub(crate) fn value_type(primitive: Primitive) -> &'static str {
    match primitive {
        Primitive::Bool => "BOOL",
        Primitive::Int8 | Primitive::UInt8 | Primitive::Int16 => "INT",
        _ => "LREAL",
    }
}
