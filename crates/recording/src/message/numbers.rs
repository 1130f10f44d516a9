//! The numbers of a message as the values of a frame.

use isochrone_ipc::SignalSpec;

use super::{
    BaseType, DefinitionError, Extent, FieldPath, FieldType, MessageType, Primitive, RosValue,
};
use crate::CdrError;

/// Most numbers of a message that become values, so that a frame of them is no surprise.
const MOST_NUMBERS: usize = 4096;

/// The single numbers that every message of a type has, but for the time stamp of its header.
#[derive(Debug, Clone)]
pub struct MessageNumbers {
    /// The way to each, as text: `linear.x`, `covariance[3]`.
    pub paths: Vec<String>,
    /// What is none, as no two messages need to have as many of it, or as it is a text: `name: string[]`.
    pub others: Vec<String>,
    fields: Vec<FieldPath>,
    stamp: Option<FieldPath>,
}

impl MessageNumbers {
    /// Those of a type.
    ///
    /// # Errors
    /// It has too many.
    pub fn of(message: &MessageType) -> Result<Self, DefinitionError> {
        let stamp = stamp_of(message);
        let mut numbers = Self { paths: Vec::new(), others: Vec::new(), fields: Vec::new(), stamp };
        numbers.collect(message, "")?;
        let fields = numbers.paths.iter().map(|path| FieldPath::find(message, path));
        numbers.fields = fields.collect::<Result<_, _>>()?;
        Ok(numbers)
    }

    fn collect(&mut self, message: &MessageType, prefix: &str) -> Result<(), DefinitionError> {
        for field in &message.fields {
            let path = format!("{prefix}{}", field.name);
            if self.stamp.is_none() || path != "header.stamp" {
                self.collect_field(&field.field_type, path)?;
            }
        }
        if self.paths.len().max(self.others.len()) > MOST_NUMBERS {
            let name = message.ros_name();
            return Err(DefinitionError(format!("{name} has more than {MOST_NUMBERS} values")));
        }
        Ok(())
    }

    fn collect_field(&mut self, field: &FieldType, path: String) -> Result<(), DefinitionError> {
        match (&field.base, field.extent) {
            (BaseType::Primitive(_), Extent::One) => self.paths.push(path),
            (BaseType::Message(inner), Extent::One) => self.collect(inner, &format!("{path}."))?,
            (BaseType::Primitive(_) | BaseType::Message(_), Extent::Array(count)) => {
                let element = FieldType { base: field.base.clone(), extent: Extent::One };
                // One more than is possible is told by what it stands in.
                for index in 0..count.min(MOST_NUMBERS + 1) {
                    self.collect_field(&element, format!("{path}[{index}]"))?;
                }
            }
            _ => self.others.push(format!("{path}: {field}")),
        }
        Ok(())
    }

    /// The channels of a frame of them: `covariance[3]` is `covariance.3`.
    pub fn signals(&self) -> Vec<SignalSpec> {
        let named = self.paths.iter().zip(&self.fields);
        let signal = |(path, field): (&String, &FieldPath)| {
            SignalSpec::new(path.replace('[', ".").replace(']', ""), value_type(field))
        };
        named.map(signal).collect()
    }

    /// Replaces the values by those of a message.
    ///
    /// # Errors
    /// It has a 64-bit integer that a value does not hold exactly.
    pub fn read(&self, message: &RosValue, values: &mut Vec<f64>) -> Result<(), CdrError> {
        values.clear();
        for (field, path) in self.fields.iter().zip(&self.paths) {
            let inexact = || CdrError::new("no value holds this integer exactly").within(path);
            values.push(field.number(message).ok_or_else(inexact)?);
        }
        Ok(())
    }

    /// The time in the header of a message, in Unix ns.
    pub fn stamp_unix_ns(&self, message: &RosValue) -> Option<u64> {
        stamped_unix_ns(self.stamp.as_ref()?.value(message)?)
    }
}

/// The time stamp of a message's header, if it has one.
pub fn stamp_of(message: &MessageType) -> Option<FieldPath> {
    let stamp = FieldPath::find(message, "header.stamp").ok()?;
    let BaseType::Message(found) = &stamp.field_type().base else { return None };
    (found.name == "builtin_interfaces/Time" && stamp.field_type().extent == Extent::One)
        .then_some(stamp)
}

/// The Unix time of a `builtin_interfaces/Time`, in ns; zero stands for none.
pub fn stamped_unix_ns(time: &RosValue) -> Option<u64> {
    let [seconds, nanoseconds] = time.parts() else { return None };
    let [seconds, nanoseconds] = [seconds.number()?, nanoseconds.number()?];
    let unix_ns = (seconds as i64).saturating_mul(1_000_000_000).saturating_add(nanoseconds as i64);
    u64::try_from(unix_ns).ok().filter(|unix_ns| *unix_ns > 0)
}

/// The type of a signal that has every value of a field.
pub fn value_type(field: &FieldPath) -> &'static str {
    match field.field_type().base {
        BaseType::Primitive(Primitive::Bool) => "BOOL",
        BaseType::Primitive(Primitive::Int8 | Primitive::UInt8 | Primitive::Int16) => "INT",
        _ => "LREAL",
    }
}
