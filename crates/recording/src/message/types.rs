//! The types of messages and their fields.

use std::fmt;
use std::sync::Arc;

use super::{Primitive, RosValue};

/// The type of a message: its fields, with all messages in it.
#[derive(Debug, Clone, PartialEq)]
pub struct MessageType {
    /// Its package and name: `geometry_msgs/Twist`.
    pub name: String,
    /// Its fields in their order.
    pub fields: Vec<MessageField>,
    /// How many bytes a message has at least.
    pub(crate) least_bytes: usize,
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq)]
pub struct MessageField {
    /// Its name.
    pub name: String,
    /// Its type.
    pub field_type: FieldType,
    /// What it is where nobody says; zero, or an empty text, without it.
    pub default: Option<RosValue>,
}

/// The type of a field.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldType {
    /// The type of one element.
    pub base: BaseType,
    /// How many of them there are.
    pub extent: Extent,
}

/// The type of one element.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum BaseType {
    /// A number or truth value.
    Primitive(Primitive),
    /// A text, of at most so many bytes.
    Text(Option<usize>),
    /// Another message.
    Message(Arc<MessageType>),
}

/// How many elements a field has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Extent {
    /// One.
    One,
    /// So many.
    Array(usize),
    /// Any number up to this one.
    Sequence(Option<usize>),
}

impl MessageType {
    /// Its name as DDS has it: `geometry_msgs::msg::dds_::Twist_`; of a half of a service, which is named
    /// `rcl_interfaces/GetParameters_Request`, `rcl_interfaces::srv::dds_::GetParameters_Request_`.
    pub fn dds_name(&self) -> String {
        let (package, name) = self.name.split_once('/').unwrap_or(("", &self.name));
        let is_half = name.ends_with("_Request") || name.ends_with("_Response");
        format!("{package}::{}::dds_::{name}_", if is_half { "srv" } else { "msg" })
    }

    /// Its name as ROS has it: `geometry_msgs/msg/Twist`.
    pub fn ros_name(&self) -> String {
        self.name.replacen('/', "/msg/", 1)
    }

    /// Where a field stands among the fields.
    pub(crate) fn position(&self, name: &str) -> Option<usize> {
        self.fields.iter().position(|field| field.name == name)
    }
}

impl FieldType {
    /// How many bytes it takes at least.
    pub(crate) fn least_bytes(&self) -> usize {
        match self.extent {
            Extent::One => self.base.least_bytes(),
            Extent::Array(count) => count.saturating_mul(self.base.least_bytes()),
            Extent::Sequence(_) => 4,
        }
    }
}

impl BaseType {
    /// How many bytes one takes at least.
    pub(crate) fn least_bytes(&self) -> usize {
        match self {
            Self::Primitive(primitive) => primitive.bytes(),
            Self::Text(_) => 4,
            Self::Message(message) => message.least_bytes,
        }
    }
}

impl fmt::Display for BaseType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Primitive(primitive) => f.write_str(primitive.name()),
            Self::Text(None) => f.write_str("string"),
            Self::Text(Some(most)) => write!(f, "string<={most}"),
            Self::Message(message) => f.write_str(&message.ros_name()),
        }
    }
}

impl fmt::Display for FieldType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let base = &self.base;
        match self.extent {
            Extent::One => write!(f, "{base}"),
            Extent::Array(count) => write!(f, "{base}[{count}]"),
            Extent::Sequence(None) => write!(f, "{base}[]"),
            Extent::Sequence(Some(most)) => write!(f, "{base}[<={most}]"),
        }
    }
}
